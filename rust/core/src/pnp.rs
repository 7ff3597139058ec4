//! Pose without depth: both planar solutions, refined on all faces together.

use nalgebra::Isometry3;

use crate::camera::Camera;
use crate::candidates::{PoseMinimum, refine_all, summarise};
use crate::error::{InputError, PoseError};
use crate::estimate::PoseEstimate;
use crate::face::Face;
use crate::ippe;
use crate::lm::{Precision, minimize};
use crate::pose_problem::{ObjectPoint, PoseProblem};
use crate::pose_state::PoseState;
use crate::robust::median;
use crate::scale::ScalePrior;

/// Settings of [`estimate`].
#[derive(Debug, Clone, PartialEq)]
pub struct PnPConfig {
    /// Standard deviation of an image point along one axis [px]; `None` estimates it from the
    /// residuals.
    pub pixel_sigma: Option<f64>,
    /// The estimate does not go below this [px].
    pub pixel_sigma_floor: f64,
    /// Standard deviation of the relative error of the taught size (1 % = 0.01); 0 = exact.
    pub size_sigma: f64,
    /// The pose is ambiguous when the other solution is at least this probable, relative to the
    /// best one.
    pub ambiguity_odds: f64,
}

impl Default for PnPConfig {
    fn default() -> Self {
        Self {
            pixel_sigma: None,
            pixel_sigma_floor: 0.1,
            size_sigma: 0.015,
            ambiguity_odds: 0.01,
        }
    }
}

impl PnPConfig {
    /// Refuses settings without meaning.
    pub fn check(&self) -> Result<(), InputError> {
        let valid = "> 0 px and finite";
        let positive = |name, value: f64| match value.is_finite() && value > 0.0 {
            true => Ok(()),
            false => Err(InputError::OutOfRange { name, value, valid }),
        };
        positive("pixel_sigma", self.pixel_sigma.unwrap_or(1.0))?;
        positive("pixel_sigma_floor", self.pixel_sigma_floor)?;
        if !(self.size_sigma >= 0.0 && self.size_sigma < 1.0) {
            let (name, value) = ("size_sigma", self.size_sigma);
            return Err(InputError::OutOfRange {
                name,
                value,
                valid: "≥ 0 and < 1",
            });
        }
        if !(self.ambiguity_odds > 0.0 && self.ambiguity_odds < 1.0) {
            let (name, value) = ("ambiguity_odds", self.ambiguity_odds);
            return Err(InputError::OutOfRange {
                name,
                value,
                valid: "between 0 and 1",
            });
        }
        Ok(())
    }
}

/// Pose from the correspondences of all faces.
pub fn estimate(
    faces: &[Face],
    camera: &Camera,
    config: &PnPConfig,
) -> Result<PoseEstimate, PoseError> {
    summarise_solutions(&solve(faces, camera, config)?, config)
}

/// The estimate that solutions without depth give.
pub fn summarise_solutions(
    solutions: &PlanarSolutions,
    config: &PnPConfig,
) -> Result<PoseEstimate, PoseError> {
    // Without depth its bias matters to nothing, but the prior of a problem needs one.
    let scale = ScalePrior {
        size_sigma: config.size_sigma,
        bias_sigma: 1.0,
    };
    summarise(
        &solutions.problem,
        &solutions.minima,
        &scale,
        config.ambiguity_odds,
    )
}

/// The problem with its noise, and its one or two minima, best first.
#[derive(Debug, Clone)]
pub struct PlanarSolutions {
    /// Correspondences of all faces with the pixel noise.
    pub problem: PoseProblem,
    /// Different minima, at least one.
    pub minima: Vec<PoseMinimum>,
}

/// Starts from both planar poses of the best face and refines each on all faces.
pub fn solve(
    faces: &[Face],
    camera: &Camera,
    config: &PnPConfig,
) -> Result<PlanarSolutions, PoseError> {
    config.check()?;
    let best = best_face(faces)?;
    let T_face_object = best.T_object_face.inverse();
    let starts =
        ippe::planar_poses(best, camera)?.map(|T_camera_face| T_camera_face * T_face_object);

    let mut problem = PoseProblem::new(camera, object_points(faces), 1.0);
    let approached = starts.map(|start| approach(&mut problem, faces, start));
    let poses = || approached.iter().flatten();
    let sigma = poses().map(|T| robust_sigma(&problem, T, 0..problem.points.len()));
    let sigma = sigma
        .fold(f64::INFINITY, f64::min)
        .max(config.pixel_sigma_floor);
    problem.pixel_sigma = config.pixel_sigma.unwrap_or(sigma);
    let minima = refine_all(&problem, poses().map(|T| PoseState::new(*T)));
    if minima.is_empty() {
        return Err(PoseError::Undetermined);
    }
    Ok(PlanarSolutions { problem, minima })
}

/// The face with the largest product of inliers and image area that they span.
fn best_face(faces: &[Face]) -> Result<&Face, PoseError> {
    let support = |face: &Face| {
        let image = face.points.iter().map(|point| point.image);
        let (narrow, wide) = ippe::spread(image, face.points.len());
        if face.points.len() < ippe::MIN_POINTS {
            0.0
        } else {
            face.points.len() as f64 * narrow * wide
        }
    };
    let better = |a: &&Face, b: &&Face| support(a).total_cmp(&support(b));
    Ok(faces.iter().max_by(better).ok_or(InputError::NoFaces)?)
}

fn object_points(faces: &[Face]) -> Vec<ObjectPoint> {
    let of = |face: &Face| -> Vec<ObjectPoint> {
        let to_object = |p: &crate::face::Correspondence| ObjectPoint {
            object: face.to_object(p.face),
            image: p.image,
        };
        face.points.iter().map(to_object).collect()
    };
    faces.iter().flat_map(of).collect()
}

/// First refinement with coarse noise: that of the face which fits worst, so that the faces other
/// than the starting one are not taken for outliers before the pose has come near them.
fn approach(
    problem: &mut PoseProblem,
    faces: &[Face],
    start: Isometry3<f64>,
) -> Option<Isometry3<f64>> {
    let mut T = start;
    for _ in faces {
        let mut first = 0;
        let mut coarse: f64 = 0.0;
        for face in faces {
            let range = first..first + face.points.len();
            first = range.end;
            coarse = coarse.max(robust_sigma(problem, &T, range));
        }
        // Without noise the residuals are rounding: any scale that keeps the arithmetic sane does.
        problem.pixel_sigma = coarse.clamp(1e-3, 1e3);
        T = minimize(problem, PoseState::new(T), Precision::Coarse)?
            .state
            .T_camera_object;
    }
    Some(T)
}

/// Standard deviation of one coordinate [px] from the median of the squared distances, which is
/// 2·ln 2 of its square; with the degrees of freedom that the pose takes.
fn robust_sigma(problem: &PoseProblem, T: &Isometry3<f64>, range: std::ops::Range<usize>) -> f64 {
    let points = &problem.points[range];
    let mut squared: Vec<f64> = points.iter().map(|p| problem.squared_error(T, p)).collect();
    let n = points.len() as f64;
    let freedom = if n > 3.0 { n / (n - 3.0) } else { 1.0 };
    median(&mut squared).map_or(0.0, |m| {
        (m / (2.0 * std::f64::consts::LN_2) * freedom).sqrt()
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::synthetic::{Scene, grid, pose_distance};
    use nalgebra::{Vector2, Vector3};

    #[test]
    fn exact_points_give_the_exact_pose() {
        let scene = Scene::tilted(0.5, 0.7);
        let face = scene.face(&grid(0.2, 0.2, 6));
        let estimate = estimate(&[face], &scene.camera, &PnPConfig::default()).unwrap();
        let (angle, distance) = pose_distance(&estimate.T_camera_object, &scene.T_camera_object);
        assert!(angle < 1e-6 && distance < 1e-7, "{angle:e} {distance:e}");
        assert!(!estimate.ambiguous);
        assert!(estimate.reprojection_rms < 1e-5);
    }

    #[test]
    fn a_small_noisy_frontal_face_is_ambiguous_and_a_large_tilted_one_is_not() {
        let small = Scene {
            size: (0.04, 0.04),
            ..Scene::tilted(0.25, 0.7)
        };
        let face = small.noisy_face(&grid(0.04, 0.04, 5), 0.5, 1);
        let estimate_small = estimate(&[face], &small.camera, &PnPConfig::default()).unwrap();
        assert!(estimate_small.ambiguous && estimate_small.alternative.is_some());
        let large = Scene::tilted(0.7, 0.7);
        let face = large.noisy_face(&grid(0.2, 0.2, 12), 0.3, 1);
        let estimate_large = estimate(&[face], &large.camera, &PnPConfig::default()).unwrap();
        assert!(!estimate_large.ambiguous);
    }

    #[test]
    fn wrong_matches_among_the_inliers_do_not_bend_the_pose() {
        let scene = Scene::tilted(0.5, 0.7);
        let mut face = scene.noisy_face(&grid(0.2, 0.2, 12), 0.2, 2);
        for point in face.points.iter_mut().step_by(8) {
            point.image += Vector2::new(6.0, -4.0);
        }
        let estimate = estimate(&[face], &scene.camera, &PnPConfig::default()).unwrap();
        let (angle, _) = pose_distance(&estimate.T_camera_object, &scene.T_camera_object);
        assert!(angle.to_degrees() < 0.5, "{}", angle.to_degrees());
    }

    #[test]
    fn two_faces_of_a_box_are_exact_and_unambiguous() {
        let front = Scene::tilted(0.6, 1.7);
        let turn = Vector3::y() * std::f64::consts::FRAC_PI_2;
        for sign in [-1.0, 1.0] {
            let side = Scene {
                T_object_face: Isometry3::new(Vector3::new(sign * 0.1, 0.0, -0.1), turn * sign),
                ..Scene::tilted(0.6, 1.7)
            };
            let normal = side.T_camera_face().rotation * Vector3::z();
            if normal.dot(&side.T_camera_face().translation.vector) >= 0.0 {
                continue;
            }
            let points = grid(0.2, 0.2, 5);
            let faces = [front.face(&points), side.face(&points)];
            let estimate = estimate(&faces, &front.camera, &PnPConfig::default()).unwrap();
            let (angle, distance) =
                pose_distance(&estimate.T_camera_object, &front.T_camera_object);
            assert!(angle < 1e-6 && distance < 1e-7, "{angle:e} {distance:e}");
            assert!(!estimate.ambiguous);
            return;
        }
        panic!("no second face is visible");
    }

    #[test]
    fn settings_without_meaning_are_refused() {
        for config in [
            PnPConfig {
                pixel_sigma: Some(0.0),
                ..PnPConfig::default()
            },
            PnPConfig {
                pixel_sigma_floor: f64::NAN,
                ..PnPConfig::default()
            },
            PnPConfig {
                ambiguity_odds: 1.0,
                ..PnPConfig::default()
            },
        ] {
            assert!(matches!(config.check(), Err(InputError::OutOfRange { .. })));
        }
        let scene = Scene::tilted(0.5, 0.7);
        let none = estimate(&[], &scene.camera, &PnPConfig::default());
        assert_eq!(none, Err(PoseError::Input(InputError::NoFaces)));
    }
}
