//! Both poses of a plane from its homography, by the homography's first order.
//!
//! Collins and Bartoli, "Infinitesimal Plane-Based Pose Estimation" (IJCV 2014). At a face point
//! with image v (normalised plane), depth z and homography derivative J, the pose satisfies
//! z·J = \[I | -v\]·\[r1 r2\]. With a rotation R_v that turns the optical axis into the ray of v,
//! \[I | -v\]·R_v = \[B | 0\], so z·B⁻¹·J is the upper left 2×2 of R_vᵀ·R. The largest singular value of
//! such a block is 1, which gives z; its columns complete to unit length in two ways, mirrored about
//! the ray: the two planar solutions.

use nalgebra::{Isometry3, Matrix2, Matrix2x3, Matrix3, Rotation3, Vector2, Vector3};

use crate::camera::Camera;
use crate::error::PoseError;
use crate::face::{Correspondence, Face};
use crate::rigid;

/// The correspondences of a planar pose: four points, eight equations for six unknowns.
pub const MIN_POINTS: usize = 4;

/// Points whose spread across their main direction is below this share of the spread along it
/// count as collinear: the rotation about such a line is lost in noise.
const MIN_SPREAD_RATIO: f64 = 5e-3;

/// Both planar solutions `T_camera_face`, the one with the smaller reprojection error first.
pub fn planar_poses(face: &Face, camera: &Camera) -> Result<[Isometry3<f64>; 2], PoseError> {
    check_points(&face.points)?;
    let origin = centroid(&face.points);
    let (pixel, slope) = face.homography_at(origin);
    let v = camera.to_normalised(pixel);
    let J = Matrix2::from_diagonal(&Vector2::new(1.0 / camera.fx, 1.0 / camera.fy)) * slope;
    let rotations = rotations_from_first_order(v, J).ok_or(PoseError::Undetermined)?;
    let mut poses = Vec::with_capacity(2);
    for R in rotations {
        let t = translation(&R, &face.points, camera).ok_or(PoseError::Undetermined)?;
        let T = rigid::from_parts(R, t);
        poses.push((squared_error(&T, &face.points, camera), T));
    }
    poses.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok([poses[0].1, poses[1].1])
}

/// Refuses fewer than four points, and points on a line.
pub fn check_points(points: &[Correspondence]) -> Result<(), PoseError> {
    if points.len() < MIN_POINTS {
        return Err(PoseError::TooFewPoints {
            found: points.len(),
            needed: MIN_POINTS,
        });
    }
    let (narrow, wide) = spread(points.iter().map(|point| point.face), points.len());
    if narrow <= MIN_SPREAD_RATIO * wide {
        return Err(PoseError::Collinear { narrow, wide });
    }
    Ok(())
}

/// Standard deviations across and along the main direction of points.
pub fn spread(points: impl Iterator<Item = Vector2<f64>> + Clone, count: usize) -> (f64, f64) {
    let n = count.max(1) as f64;
    let mean = points.clone().sum::<Vector2<f64>>() / n;
    let covariance = points
        .map(|p| (p - mean) * (p - mean).transpose())
        .sum::<Matrix2<f64>>()
        / n;
    let half_trace = covariance.trace() / 2.0;
    let root = (half_trace * half_trace - covariance.determinant())
        .max(0.0)
        .sqrt();
    (
        (half_trace - root).max(0.0).sqrt(),
        (half_trace + root).sqrt(),
    )
}

fn centroid(points: &[Correspondence]) -> Vector2<f64> {
    points.iter().map(|point| point.face).sum::<Vector2<f64>>() / points.len() as f64
}

fn rotations_from_first_order(v: Vector2<f64>, J: Matrix2<f64>) -> Option<[Matrix3<f64>; 2]> {
    let R_v = *Rotation3::rotation_between(&Vector3::z(), &v.push(1.0))?.matrix();
    let B = Matrix2x3::new(1.0, 0.0, -v.x, 0.0, 1.0, -v.y) * R_v.fixed_view::<3, 2>(0, 0);
    let A = B.try_inverse()? * J;
    let gram = A.transpose() * A;
    let half_trace = gram.trace() / 2.0;
    let root = (half_trace * half_trace - gram.determinant())
        .max(0.0)
        .sqrt();
    let largest = (half_trace + root).sqrt();
    if !(largest.is_finite() && largest > 0.0) {
        return None;
    }
    let block = A / largest;
    let rest = Matrix2::identity() - block.transpose() * block;
    let c1 = rest[(0, 0)].max(0.0).sqrt();
    let c2 = rest[(1, 1)].max(0.0).sqrt() * if rest[(0, 1)] < 0.0 { -1.0 } else { 1.0 };
    Some([1.0, -1.0].map(|sign| {
        let x = block.column(0).push(sign * c1);
        let y = block.column(1).push(sign * c2);
        R_v * Matrix3::from_columns(&[x, y, x.cross(&y)])
    }))
}

/// Translation that minimises the algebraic error of all points under a known rotation.
fn translation(
    R: &Matrix3<f64>,
    points: &[Correspondence],
    camera: &Camera,
) -> Option<Vector3<f64>> {
    let mut left = Matrix3::zeros();
    let mut right = Vector3::zeros();
    for point in points {
        let v = camera.to_normalised(point.image);
        let rows = Matrix2x3::new(1.0, 0.0, -v.x, 0.0, 1.0, -v.y);
        let weight = rows.transpose() * rows;
        left += weight;
        right -= weight * (R * point.face.push(0.0));
    }
    Some(left.try_inverse()? * right)
}

fn squared_error(T: &Isometry3<f64>, points: &[Correspondence], camera: &Camera) -> f64 {
    let error = |point: &Correspondence| {
        let p = T.rotation * point.face.push(0.0) + T.translation.vector;
        camera
            .project(p)
            .map_or(f64::INFINITY, |pixel| (pixel - point.image).norm_squared())
    };
    points.iter().map(error).sum()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::synthetic::{Scene, grid, pose_distance};

    #[test]
    fn one_of_the_two_is_exact_without_noise() {
        for (tilt, azimuth) in [(0.0, 0.0), (0.3, 1.0), (0.9, -2.0), (1.3, 0.4)] {
            let scene = Scene::tilted(tilt, azimuth);
            let face = scene.face(&grid(0.2, 0.15, 5));
            let [best, _] = planar_poses(&face, &scene.camera).unwrap();
            let (angle, distance) = pose_distance(&best, &scene.T_camera_object);
            assert!(
                angle < 1e-6 && distance < 1e-7,
                "{tilt}: {angle:e} {distance:e}"
            );
        }
    }

    #[test]
    fn the_other_is_tilted_about_the_ray_to_the_other_side() {
        let scene = Scene::tilted(0.6, 0.8);
        let [best, other] = planar_poses(&scene.face(&grid(0.2, 0.2, 5)), &scene.camera).unwrap();
        let ray = scene.T_camera_object.translation.vector.normalize();
        let tilt = |T: &Isometry3<f64>| (T.rotation * -Vector3::z()).angle(&ray);
        assert!((tilt(&best) - tilt(&other)).abs() < 1e-6);
        assert!((pose_distance(&best, &other).0 - 1.2).abs() < 0.3);
    }

    #[test]
    fn degenerate_points_are_refused() {
        let scene = Scene::tilted(0.3, 0.0);
        let few = scene.face(&grid(0.2, 0.2, 5)[..3]);
        let expected = PoseError::TooFewPoints {
            found: 3,
            needed: 4,
        };
        assert_eq!(planar_poses(&few, &scene.camera), Err(expected));
        let line: Vec<_> = (0..8)
            .map(|i| Vector2::new(0.01, 0.02) * f64::from(i))
            .collect();
        let error = planar_poses(&scene.face(&line), &scene.camera).unwrap_err();
        assert!(matches!(error, PoseError::Collinear { .. }), "{error}");
        let same = scene.face(&[Vector2::zeros(); 6]);
        assert!(matches!(
            planar_poses(&same, &scene.camera),
            Err(PoseError::Collinear { .. })
        ));
    }
}
