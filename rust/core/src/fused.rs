//! Pose from reprojection and depth together: the default.
//!
//! 1. both planar solutions without depth ([`pnp`]), which predict where each face's plane is;
//! 2. each face's plane from its depth pixels, robust against what covers it ([`depth_plane`]);
//! 3. refinement of the pose under both, from both planar solutions and from the one turned into
//!    the measured plane. The cheapest minimum wins, so that depth also decides between the two
//!    planar solutions where it is too weak to add accuracy.
//!
//! Where no plane is usable the answer is that of [`pnp`].

use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use rayon::prelude::*;

use crate::camera::Camera;
use crate::candidates::{PoseMinimum, refine_all, summarise};
use crate::depth_image::DepthImage;
use crate::depth_plane::{self, DepthConfig};
use crate::error::PoseError;
use crate::estimate::PoseEstimate;
use crate::face::Face;
use crate::plane_observation::PlaneObservation;
use crate::pnp::{self, PlanarSolutions, PnPConfig};
use crate::pose_problem::PoseProblem;
use crate::pose_state::PoseState;
use crate::scale::ScalePrior;

/// A plane contradicts the image when agreeing with it raises the reprojection cost by this many
/// squared sigmas (seven sigmas in one direction) …
const CONTRADICTION: f64 = 50.0;
/// … and by this much a point: many points make small systematic errors significant.
const CONTRADICTION_PER_POINT: f64 = 0.5;

/// Settings of [`estimate`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FusedConfig {
    /// Reprojection, and the verdict between two solutions.
    pub pnp: PnPConfig,
    /// Depth.
    pub depth: DepthConfig,
}

/// Pose from the correspondences and the depth of all faces.
pub fn estimate(
    faces: &[Face],
    camera: &Camera,
    depth: Option<&DepthImage<'_>>,
    config: &FusedConfig,
) -> Result<PoseEstimate, PoseError> {
    config.depth.check()?;
    let odds = config.pnp.ambiguity_odds;
    let planar = pnp::solve(faces, camera, &config.pnp)?;
    let poses = rival_poses(&planar);
    let mut problem = planar.problem.clone();
    let scale = ScalePrior {
        size_sigma: config.pnp.size_sigma,
        bias_sigma: config.depth.bias_sigma,
    };
    problem.disagreement_sigma = scale.disagreement_sigma();
    if let Some(depth) = depth {
        let observe = |face| depth_plane::observe(face, &poses, camera, depth, &config.depth);
        problem.planes = faces.iter().filter_map(observe).collect();
    }
    while !problem.planes.is_empty() {
        let minima = refine_all(&problem, starts(&problem, &poses));
        match minima.first() {
            Some(best) if !contradicts(&problem, best, &poses) => {
                return summarise(&problem, &minima, &scale, odds);
            }
            best => drop_worst_plane(&mut problem, best),
        }
    }
    pnp::summarise_solutions(&planar, &config.pnp)
}

/// The same for the faces of each of several objects, which do not know of each other.
pub fn estimate_each(
    objects: &[Vec<Face>],
    camera: &Camera,
    depth: Option<&DepthImage<'_>>,
    config: &FusedConfig,
) -> Vec<Result<PoseEstimate, PoseError>> {
    objects
        .par_iter()
        .map(|faces| estimate(faces, camera, depth, config))
        .collect()
}

/// The planar solutions that depth could still prefer without contradicting the image.
fn rival_poses(planar: &PlanarSolutions) -> Vec<Isometry3<f64>> {
    let cost = |m: &PoseMinimum| m.normal.cost;
    let best = planar.minima.first().map_or(0.0, cost);
    let limit = best + contradiction(&planar.problem);
    let rivals = planar.minima.iter().filter(|m| cost(m) <= limit);
    rivals.map(|m| m.state.T_camera_object).collect()
}

/// The planar solutions, and the best one turned into the best measured plane.
fn starts(problem: &PoseProblem, poses: &[Isometry3<f64>]) -> Vec<PoseState> {
    let best_plane = problem.planes.iter().max_by_key(|plane| plane.pixels);
    let turned = best_plane
        .zip(poses.first())
        .and_then(|(plane, T)| turned_into(plane, T));
    poses
        .iter()
        .copied()
        .chain(turned)
        .map(PoseState::new)
        .collect()
}

/// Turns a pose about a face's centre by the smallest rotation that puts the face into its plane.
fn turned_into(plane: &PlaneObservation, T: &Isometry3<f64>) -> Option<Isometry3<f64>> {
    // The normal faces the camera: n·p < 0, and q = n / (n·p).
    let measured = -plane.inverse_plane;
    let turn = UnitQuaternion::rotation_between(&(T.rotation * plane.normal), &measured)?;
    let centre = T.rotation * plane.point + T.translation.vector;
    let translation = centre - turn * (T.rotation * plane.point);
    Some(Isometry3::from_parts(
        Translation3::from(translation),
        turn * T.rotation,
    ))
}

fn contradicts(problem: &PoseProblem, best: &PoseMinimum, poses: &[Isometry3<f64>]) -> bool {
    let cost = |T: &Isometry3<f64>| problem.reprojection_cost(T);
    let without = poses.iter().map(cost).fold(f64::INFINITY, f64::min);
    let rise = cost(&best.state.T_camera_object) - without;
    rise > contradiction(problem)
}

/// The rise of the reprojection cost at which depth contradicts the image.
fn contradiction(problem: &PoseProblem) -> f64 {
    CONTRADICTION.max(CONTRADICTION_PER_POINT * problem.points.len() as f64)
}

fn drop_worst_plane(problem: &mut PoseProblem, best: Option<&PoseMinimum>) {
    let cost = |plane: &PlaneObservation| {
        best.map_or(0.0, |minimum| plane.squared_distance(&minimum.state))
    };
    let costs = problem.planes.iter().map(cost).enumerate();
    if let Some((worst, _)) = costs.max_by(|a, b| a.1.total_cmp(&b.1)) {
        problem.planes.remove(worst);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::synthetic::{KINECT_SIGMA, Scene, grid, pose_distance};

    fn estimated(scene: &Scene, faces: &[Face], depth: &[f32]) -> PoseEstimate {
        let image = DepthImage::new((640, 480), depth, &scene.camera).unwrap();
        estimate(faces, &scene.camera, Some(&image), &FusedConfig::default()).unwrap()
    }

    #[test]
    fn exact_evidence_gives_the_exact_pose() {
        let scene = Scene::tilted(0.5, 0.7);
        let estimate = estimated(
            &scene,
            &[scene.face(&grid(0.2, 0.2, 6))],
            &scene.depth(0.0, 0),
        );
        let (angle, distance) = pose_distance(&estimate.T_camera_object, &scene.T_camera_object);
        assert!(angle < 1e-6 && distance < 1e-6, "{angle:e} {distance:e}");
        assert!(!estimate.ambiguous && estimate.alternative.is_none());
        assert!(estimate.depth_pixels > 1000);
    }

    #[test]
    fn depth_settles_what_is_ambiguous_without_it() {
        let scene = Scene {
            size: (0.06, 0.06),
            ..Scene::tilted(0.25, 0.7)
        };
        let face = scene.noisy_face(&grid(0.06, 0.06, 5), 0.5, 1);
        let faces = [face];
        let none = estimate(&faces, &scene.camera, None, &FusedConfig::default()).unwrap();
        assert!(none.ambiguous);
        assert_eq!(
            none,
            pnp::estimate(&faces, &scene.camera, &PnPConfig::default()).unwrap()
        );
        let with = estimated(&scene, &faces, &scene.depth(KINECT_SIGMA, 1));
        assert!(!with.ambiguous);
        let (angle, _) = pose_distance(&with.T_camera_object, &scene.T_camera_object);
        assert!(angle.to_degrees() < 1.0, "{}", angle.to_degrees());
    }

    #[test]
    fn a_plane_that_contradicts_the_image_is_not_used() {
        let scene = Scene::tilted(0.6, 0.0);
        let faces = [scene.noisy_face(&grid(0.2, 0.2, 12), 0.3, 1)];
        let wrong = Scene {
            size: (0.5, 0.5),
            ..Scene::tilted(0.3, 0.0)
        };
        let estimate = estimated(&scene, &faces, &wrong.depth(KINECT_SIGMA, 1));
        assert_eq!(estimate.depth_pixels, 0);
        let (angle, _) = pose_distance(&estimate.T_camera_object, &scene.T_camera_object);
        assert!(angle.to_degrees() < 1.0);
    }

    #[test]
    fn turning_into_a_plane_keeps_the_centre() {
        let scene = Scene::tilted(0.4, 1.0);
        let plane = PlaneObservation {
            normal: nalgebra::Vector3::z(),
            point: nalgebra::Vector3::new(0.0, 0.0, 0.02),
            inverse_plane: nalgebra::Vector3::new(0.3, -0.2, 1.4),
            information: nalgebra::Matrix3::identity(),
            pixels: 100,
        };
        let T = scene.T_camera_object;
        let turned = turned_into(&plane, &T).unwrap();
        let centre = nalgebra::Point3::from(plane.point);
        assert!((turned * centre - T * centre).norm() < 1e-12);
        let normal = turned.rotation * plane.normal;
        assert!((normal + plane.inverse_plane.normalize()).norm() < 1e-12);
    }

    #[test]
    fn settings_without_meaning_are_refused() {
        let default = DepthConfig::default;
        for depth in [
            DepthConfig {
                sigma: Some(-1.0),
                ..default()
            },
            DepthConfig {
                sigma_floor: 0.0,
                ..default()
            },
            DepthConfig {
                bias_sigma: f64::INFINITY,
                ..default()
            },
            DepthConfig {
                correlation_area: 0.5,
                ..default()
            },
            DepthConfig {
                gate: 1.0,
                ..default()
            },
            DepthConfig {
                erosion: -1.0,
                ..default()
            },
            DepthConfig {
                min_pixels: 2,
                ..default()
            },
            DepthConfig {
                max_pixels: 10,
                ..default()
            },
            DepthConfig {
                max_view_angle: 1.6,
                ..default()
            },
        ] {
            assert!(depth.check().is_err(), "{depth:?}");
        }
        assert_eq!(default().check(), Ok(()));
    }
}
