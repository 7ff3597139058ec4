//! Refined poses that compete, and the verdict between them.

use crate::error::PoseError;
use crate::estimate::PoseEstimate;
use crate::lm::{Minimum, Precision, minimize};
use crate::pose_problem::PoseProblem;
use crate::pose_state::{PARAMETERS, PoseState};
use crate::scale::ScalePrior;

/// Minima whose rotations differ by less than this are the same one [rad] (0.3°): the two planar
/// solutions of a real ambiguity lie degrees apart, and below this nobody needs to choose.
const SAME_ANGLE: f64 = 5e-3;

/// A refined pose.
pub type PoseMinimum = Minimum<PoseState, PARAMETERS>;

/// Refines every start; different minima, the cheapest first.
pub fn refine_all(
    problem: &PoseProblem,
    starts: impl IntoIterator<Item = PoseState>,
) -> Vec<PoseMinimum> {
    let mut minima: Vec<PoseMinimum> = starts
        .into_iter()
        .filter_map(|start| minimize(problem, start, Precision::Fine))
        .collect();
    minima.sort_by(|a, b| a.normal.cost.total_cmp(&b.normal.cost));
    let mut distinct: Vec<PoseMinimum> = Vec::with_capacity(minima.len());
    for minimum in minima {
        let rotation = |m: &PoseMinimum| m.state.T_camera_object.rotation;
        if distinct
            .iter()
            .all(|d| rotation(d).angle_to(&rotation(&minimum)) > SAME_ANGLE)
        {
            distinct.push(minimum);
        }
    }
    distinct
}

/// The pose of the cheapest minimum in metres, with the next one as its alternative.
///
/// Costs are squared residuals in sigmas, so exp(-Δ/2) is how probable the second minimum is
/// relative to the first; from `ambiguity_odds` on the estimate is ambiguous.
pub fn summarise(
    problem: &PoseProblem,
    minima: &[PoseMinimum],
    scale: &ScalePrior,
    ambiguity_odds: f64,
) -> Result<PoseEstimate, PoseError> {
    let best = minima.first().ok_or(PoseError::Undetermined)?;
    let inverse = best
        .normal
        .hessian
        .cholesky()
        .ok_or(PoseError::Undetermined)?
        .inverse();
    let covariance = scale.metric_covariance(&best.state, &inverse);
    if !covariance.iter().all(|value| value.is_finite()) {
        return Err(PoseError::Undetermined);
    }
    let second = minima.get(1);
    let odds = second.map_or(0.0, |m| (-0.5 * (m.normal.cost - best.normal.cost)).exp());
    let T = &best.state.T_camera_object;
    let squared: f64 = problem
        .points
        .iter()
        .map(|p| problem.squared_error(T, p))
        .sum();
    Ok(PoseEstimate {
        T_camera_object: scale.metric_pose(&best.state),
        covariance: Some(covariance),
        noise_covariance: Some(scale.noise_covariance(
            &best.state,
            &inverse,
            !problem.planes.is_empty(),
        )),
        ambiguous: odds >= ambiguity_odds,
        alternative: second.map(|m| scale.metric_pose(&m.state)),
        reprojection_rms: (squared / problem.points.len().max(1) as f64).sqrt(),
        depth_pixels: problem.planes.iter().map(|plane| plane.pixels).sum(),
    })
}
