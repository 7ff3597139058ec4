//! The baseline: three depth look-ups.
//!
//! Paul, Chowdhury, Nicolescu, Nicolescu and Feil-Seifer, "Object Detection and Pose Estimation
//! from RGB and Depth Data for Real-time, Adaptive Robotic Grasping" (arXiv:2101.07347), eq. 3-5:
//! the face's centre, the middle of its right edge and the middle of its top edge are mapped
//! through the homography, looked up in the depth image and deprojected; their differences are the
//! x and y axes. The two edge points lie where depth sensors fail, which is why this is the baseline.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::camera::Camera;
use crate::depth_image::DepthImage;
use crate::error::{InputError, PoseError};
use crate::estimate::PoseEstimate;
use crate::face::Face;
use crate::rigid;

/// Pose from the first face; no covariance, no ambiguity.
pub fn estimate(
    faces: &[Face],
    camera: &Camera,
    depth: Option<&DepthImage<'_>>,
) -> Result<PoseEstimate, PoseError> {
    let face = faces.first().ok_or(InputError::NoFaces)?;
    let depth = depth.ok_or(PoseError::DepthRequired)?;
    let (right, top) = (face.width / 2.0, face.height / 2.0);
    let p_c = deproject(face, camera, depth, "centre", Vector2::zeros())?;
    let p_x = deproject(face, camera, depth, "right edge", Vector2::new(right, 0.0))?;
    let p_y = deproject(face, camera, depth, "top edge", Vector2::new(0.0, top))?;

    let R = frame(p_x - p_c, p_y - p_c).ok_or(PoseError::DegenerateTriangle)?;
    let T = rigid::from_parts(R, p_c);
    Ok(PoseEstimate {
        T_camera_object: T * face.T_object_face.inverse(),
        covariance: None,
        noise_covariance: None,
        ambiguous: false,
        alternative: None,
        reprojection_rms: reprojection_rms(face, camera, &T),
        depth_pixels: 3,
    })
}

/// A point of the face [m] as a point in the camera frame [m], by its nearest depth pixel.
fn deproject(
    face: &Face,
    camera: &Camera,
    depth: &DepthImage<'_>,
    name: &'static str,
    point: Vector2<f64>,
) -> Result<Vector3<f64>, PoseError> {
    let pixel = face.to_image(point);
    let observed = camera.observe(pixel);
    let (u, v) = ((observed.x + 0.5).floor(), (observed.y + 0.5).floor());
    let inside =
        (0.0..depth.width() as f64).contains(&u) && (0.0..depth.height() as f64).contains(&v);
    if !inside {
        return Err(PoseError::OutsideImage {
            point: name,
            u: observed.x,
            v: observed.y,
            width: depth.width(),
            height: depth.height(),
        });
    }
    let (u, v) = (u as usize, v as usize);
    let z = depth
        .at(u, v)
        .ok_or(PoseError::NoDepth { point: name, u, v })?;
    Ok(camera.to_normalised(pixel).push(1.0) * z)
}

/// Rotation with y kept, z = x × y, and x recalculated as y × z; `None` for parallel axes.
///
/// The recalculated x is the x' of the paper's ε (eq. 13).
fn frame(x: Vector3<f64>, y: Vector3<f64>) -> Option<Matrix3<f64>> {
    let y = y.try_normalize(f64::EPSILON)?;
    let z = x
        .try_normalize(f64::EPSILON)?
        .cross(&y)
        .try_normalize(1e-9)?;
    Some(Matrix3::from_columns(&[y.cross(&z), y, z]))
}

fn reprojection_rms(face: &Face, camera: &Camera, T_camera_face: &nalgebra::Isometry3<f64>) -> f64 {
    let mut squared = 0.0;
    for point in &face.points {
        let p = T_camera_face.rotation * point.face.push(0.0) + T_camera_face.translation.vector;
        let error = camera
            .project(p)
            .map(|pixel| (pixel - point.image).norm_squared());
        squared += error.unwrap_or(f64::INFINITY);
    }
    (squared / face.points.len().max(1) as f64).sqrt()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::synthetic::{Scene, grid, pose_distance};

    #[test]
    fn three_good_depths_give_the_pose() {
        // A face that is a little larger than its depth look-ups need, so that the edges have depth.
        let scene = Scene::tilted(0.4, 0.5);
        let larger = Scene {
            size: (0.22, 0.22),
            ..Scene::tilted(0.4, 0.5)
        };
        let depth = larger.depth(0.0, 0);
        let image = DepthImage::new((640, 480), &depth, &scene.camera).unwrap();
        let face = scene.face(&grid(0.2, 0.2, 4));
        let estimate = estimate(&[face], &scene.camera, Some(&image)).unwrap();
        let (angle, distance) = pose_distance(&estimate.T_camera_object, &scene.T_camera_object);
        // Half a pixel of rounding in the look-up is about 0.3 mm of depth at this tilt.
        assert!(angle < 0.008 && distance < 0.001, "{angle} {distance}");
        assert_eq!(estimate.covariance, None);
    }

    #[test]
    fn a_hole_at_a_looked_up_point_is_named() {
        let scene = Scene::tilted(0.0, 0.0);
        let larger = Scene {
            size: (0.22, 0.22),
            ..Scene::tilted(0.0, 0.0)
        };
        let face = scene.face(&grid(0.2, 0.2, 4));
        for (point, at) in [
            ("centre", [0.0, 0.0]),
            ("right edge", [0.1, 0.0]),
            ("top edge", [0.0, 0.1]),
        ] {
            let mut depth = larger.depth(0.0, 0);
            let pixel = face.to_image(Vector2::from(at));
            let (u, v) = (pixel.x.round() as usize, pixel.y.round() as usize);
            depth[v * 640 + u] = 0.0;
            let image = DepthImage::new((640, 480), &depth, &scene.camera).unwrap();
            let error =
                estimate(std::slice::from_ref(&face), &scene.camera, Some(&image)).unwrap_err();
            assert_eq!(error, PoseError::NoDepth { point, u, v });
        }
    }

    #[test]
    fn a_point_outside_of_the_image_is_named() {
        let mut scene = Scene::tilted(0.0, 0.0);
        scene.T_camera_object.translation.x = 0.4;
        let depth = scene.depth(0.0, 0);
        let image = DepthImage::new((640, 480), &depth, &scene.camera).unwrap();
        let error = estimate(&[scene.face(&[])], &scene.camera, Some(&image)).unwrap_err();
        assert!(
            matches!(
                error,
                PoseError::OutsideImage {
                    point: "right edge",
                    ..
                }
            ),
            "{error}"
        );
        let without = estimate(&[scene.face(&[])], &scene.camera, None);
        assert_eq!(without, Err(PoseError::DepthRequired));
    }

    #[test]
    fn skewed_axes_keep_y_and_recalculate_x() {
        let y = Vector3::new(0.0, 2.0, 0.0);
        let R = frame(Vector3::new(1.0, 0.2, 0.0), y).unwrap();
        assert!((R - Matrix3::identity()).norm() < 1e-12);
    }

    #[test]
    fn parallel_axes_span_no_frame() {
        assert_eq!(frame(Vector3::x(), Vector3::x() * 2.0), None);
        assert_eq!(frame(Vector3::zeros(), Vector3::x()), None);
    }
}
