//! The alignment of one face in one frame.

use nalgebra::{Matrix2, Matrix3, SMatrix, Vector2};

use super::displacement::{Displacement, measure};
use super::motion::{Information, Observation, solve};
use super::template::Template;
use super::tiles::choose;
use super::view::{Centred, PARAMETERS, View, apply};
use super::{AlignmentConfig, AlignmentReference, AlignmentWorkspace};
use crate::GrayImage;

/// Times the reference is rendered by a better homography and aligned again: the first alignment
/// starts at fractions of a pixel, where interpolating the frame blurs and shifts it a little.
const RENDERINGS: usize = 2;
/// Iterations end where no corner moves farther than this \[px\].
const CONVERGED: f64 = 0.005;

/// Where an alignment ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Alignment {
    /// From reference edge coordinates to undistorted pixels, scaled to H\[2, 2\] = 1: refined if
    /// `accepted`, the start otherwise.
    pub homography: Matrix3<f64>,
    /// Mean correlation (-1 … 1) of the tiles with the frame at the start.
    pub score_before: f64,
    /// The same at the refined homography.
    pub score_after: f64,
    /// Whether the refined homography is better and within the allowed motion.
    pub accepted: bool,
    /// Iterations in all.
    pub iterations: usize,
    /// Number of tiles that agreed with the reference at the end.
    pub tiles: usize,
    /// Information (8×8) of the positions (x, y) \[px\] of the face's corners, top-left, then
    /// clockwise, at the refined homography.
    pub information: SMatrix<f64, PARAMETERS, PARAMETERS>,
}

/// Refines a homography (reference edge coordinates to undistorted pixels) on the grey values.
///
/// `frame` is undistorted. `None` where the start shows no front of the reference, or too few
/// textured tiles of it in the frame.
pub fn align(
    reference: &AlignmentReference,
    frame: &GrayImage,
    start: &Matrix3<f64>,
    config: &AlignmentConfig,
    workspace: &mut AlignmentWorkspace,
) -> Option<Alignment> {
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || align_here(reference, frame, start, config, workspace),
    )
}

#[inline(always)]
fn align_here(
    reference: &AlignmentReference,
    frame: &GrayImage,
    start: &Matrix3<f64>,
    config: &AlignmentConfig,
    workspace: &mut AlignmentWorkspace,
) -> Option<Alignment> {
    let first = View::new(reference, start)?;
    choose(
        &first,
        reference,
        frame,
        config.max_tiles,
        &mut workspace.tiles,
    );
    let mut view = first.clone();
    let mut scores = [0.0; RENDERINGS];
    let mut iterations = 0;
    let mut last = None;
    for score in &mut scores {
        render(&view, reference, workspace);
        let round = descend(&view, &first, frame, config, workspace)?;
        *score = round.score;
        iterations += round.iterations;
        view = View::new(reference, &(round.motion * view.homography))?;
        last = Some(round);
    }
    let last = last?;
    let [score_before, score_after] = scores;
    let farthest = farthest(&view.outline, &first.outline);
    let accepted = score_after > score_before && farthest <= config.max_motion;
    let homography = if accepted {
        view.homography
    } else {
        first.homography
    };
    Some(Alignment {
        homography: homography / homography[(2, 2)],
        score_before,
        score_after,
        accepted,
        iterations,
        tiles: last.tiles,
        information: of_corners(&last.information, &view)?,
    })
}

/// A descent on one rendering.
struct Round {
    /// The homography of the frame.
    motion: Matrix3<f64>,
    /// Mean correlation where it started.
    score: f64,
    iterations: usize,
    tiles: usize,
    information: SMatrix<f64, PARAMETERS, PARAMETERS>,
}

#[inline(always)]
fn render(view: &View, reference: &AlignmentReference, workspace: &mut AlignmentWorkspace) {
    workspace.templates.clear();
    for &tile in &workspace.tiles {
        workspace
            .templates
            .extend(Template::render(tile, view, reference));
    }
}

#[inline(always)]
fn descend(
    view: &View,
    first: &View,
    frame: &GrayImage,
    config: &AlignmentConfig,
    workspace: &mut AlignmentWorkspace,
) -> Option<Round> {
    let mut motion = Matrix3::identity();
    let mut round = None;
    let mut score = None;
    for iteration in 1..=config.max_iterations {
        let outline = view.outline.map(|corner| apply(&motion, corner));
        let centred = Centred::about(&outline);
        let correlation = observe(frame, &motion, &centred, config, workspace)?;
        let tiles = workspace.observations.len();
        if tiles < config.min_tiles {
            return None;
        }
        let prior = prior(&outline, &first.outline, &centred, config.start_sigma);
        let (step, information) =
            solve(&mut workspace.observations, &prior, &mut workspace.squares)?;
        let change = centred.homography(&step);
        motion = change * motion;
        let converged =
            farthest(&outline.map(|corner| apply(&change, corner)), &outline) < CONVERGED;
        round = Some(Round {
            motion,
            score: *score.get_or_insert(correlation),
            iterations: iteration,
            tiles,
            information: information.matrix,
        });
        if converged {
            break;
        }
    }
    round
}

/// Fills the observations with the tiles that agree; returns the mean correlation of all tiles.
#[inline(always)]
fn observe(
    frame: &GrayImage,
    motion: &Matrix3<f64>,
    centred: &Centred,
    config: &AlignmentConfig,
    workspace: &mut AlignmentWorkspace,
) -> Option<f64> {
    workspace.observations.clear();
    let (mut sum, mut count) = (0.0, 0);
    for template in &workspace.templates {
        let Some(displacement) = measure(template, frame, motion) else {
            continue;
        };
        sum += displacement.correlation.max(0.0);
        count += 1;
        if agrees(&displacement, config) {
            let observation = Observation::new(&displacement, centred, config.displacement_floor);
            workspace.observations.extend(observation);
        }
    }
    (count > 0).then(|| sum / f64::from(count))
}

fn agrees(displacement: &Displacement, config: &AlignmentConfig) -> bool {
    displacement.correlation >= config.min_correlation
        && displacement.offset.norm() <= config.max_motion
}

/// The start as a measurement of the corners.
fn prior(
    outline: &[Vector2<f64>; 4],
    start: &[Vector2<f64>; 4],
    centred: &Centred,
    sigma: f64,
) -> Information {
    let mut information = Information::none();
    let each = Matrix2::identity() / sigma.powi(2);
    for (now, before) in outline.iter().zip(start) {
        information.add(&centred.jacobian(*now), &(before - now), &each);
    }
    information
}

/// Largest distance of corresponding corners \[px\].
fn farthest(a: &[Vector2<f64>; 4], b: &[Vector2<f64>; 4]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).norm())
        .fold(0.0, f64::max)
}

/// Information of the parameters as that of the corners' positions.
fn of_corners(
    information: &SMatrix<f64, PARAMETERS, PARAMETERS>,
    view: &View,
) -> Option<SMatrix<f64, PARAMETERS, PARAMETERS>> {
    let centred = Centred::about(&view.outline);
    let mut corners = SMatrix::<f64, PARAMETERS, PARAMETERS>::zeros();
    for (i, corner) in view.outline.iter().enumerate() {
        corners
            .fixed_view_mut::<2, PARAMETERS>(2 * i, 0)
            .copy_from(&centred.jacobian(*corner));
    }
    let inverse = corners.try_inverse()?;
    Some(inverse.transpose() * information * inverse)
}
