//! The two rigid views of a plane that look alike.
//!
//! A small or distant plane looks almost the same turned to one side or to the other. The estimate of
//! eight free parameters lies between the two when it is imprecise, and a descent from it may
//! end in the wrong one: both are tried.

use nalgebra::{Isometry3, Matrix3};

use super::evidence::Match;
use super::face::SearchedFace;
use crate::Camera;
use crate::face::{Correspondence, Face};
use crate::ippe::planar_poses;

/// The homographies of both planar poses that the matches have under a first estimate; none where
/// they do not determine any.
pub fn rigid_views(
    H: &Matrix3<f64>,
    matches: &[Match],
    face: &SearchedFace,
    camera: &Camera,
) -> Vec<Matrix3<f64>> {
    poses(H, matches, face, camera)
        .into_iter()
        .flatten()
        .map(|T_camera_face| {
            let R = T_camera_face.rotation.to_rotation_matrix().into_inner();
            let (r1, r2) = (R.column(0).into_owned(), R.column(1).into_owned());
            let plane = Matrix3::from_columns(&[r1, r2, T_camera_face.translation.vector]);
            camera.matrix() * plane * face.face_from_edge()
        })
        .collect()
}

fn poses(
    H: &Matrix3<f64>,
    matches: &[Match],
    face: &SearchedFace,
    camera: &Camera,
) -> Option<[Isometry3<f64>; 2]> {
    let metric = face.face_from_edge();
    let points = matches.iter().map(|one| {
        let mapped = metric * one.points.source.push(1.0);
        Correspondence {
            face: mapped.xy() / mapped.z,
            image: one.points.target,
        }
    });
    let size = (
        (metric[(0, 0)] * face.size().x).abs(),
        (metric[(1, 1)] * face.size().y).abs(),
    );
    let homography = H * metric.try_inverse()?;
    let seen = Face::new(Isometry3::identity(), size, points.collect(), homography).ok()?;
    planar_poses(&seen, camera).ok()
}
