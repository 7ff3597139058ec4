//! The alignment of one face in one frame.

use nalgebra::{Matrix3, SMatrix};

use super::descent::{Descent, correlate, descend, farthest, render};
use super::tiles::{SIDE, Tile, choose};
use super::view::{Centred, PARAMETERS, View, apply};
use super::{AlignmentConfig, AlignmentReference, AlignmentWorkspace};
use crate::GrayImage;

/// A rendering from which no corner moves farther than this \[px\] is the last one.
const SETTLED: f64 = 0.01;
/// The first rendering, from a rough start, is of one in so many tiles …
const FIRST_SHARE: usize = 3;
/// … but of at least so many, and of all where not so large a share of them agrees, or a corner
/// moves farther than this \[px\]: then the start is poor, or something hides the face.
const FIRST_TILES: usize = 36;
const FIRST_AGREEING: f64 = 0.8;
const FIRST_MOTION: f64 = 2.0;

/// Where an alignment ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Alignment {
    /// From reference edge coordinates to undistorted pixels, scaled to H\[2, 2\] = 1: refined if
    /// `accepted`, the start otherwise.
    pub homography: Matrix3<f64>,
    /// Mean correlation (-1 … 1) with the frame at the start, over the tiles of the first rendering that
    /// agree with the reference at the start or at the end.
    pub score_before: f64,
    /// The same at the refined homography.
    pub score_after: f64,
    /// Whether the refined homography is better and within the allowed motion.
    pub accepted: bool,
    /// Iterations that led to it.
    pub iterations: usize,
    /// Number of tiles that agreed with the reference at the end.
    pub tiles: usize,
    /// Of so many that were compared.
    pub compared: usize,
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
    dispatch(Task {
        reference,
        frame,
        start,
        config,
        workspace,
    })
}

/// Runs it with the instructions that the processor has.
///
/// Rows of a tile are eight numbers, an AVX2 vector: compiled for AVX-512 it was a sixth slower.
fn dispatch(task: Task) -> Option<Alignment> {
    #[cfg(target_arch = "x86_64")]
    if let Some(simd) = pulp::x86::V3::try_new() {
        return pulp::Simd::vectorize(simd, task);
    }
    pulp::Arch::new().dispatch(task)
}

/// An alignment to be compiled for each instruction set. A closure would not do: its call is not
/// inlined into the function that enables the instructions.
struct Task<'a> {
    reference: &'a AlignmentReference,
    frame: &'a GrayImage<'a>,
    start: &'a Matrix3<f64>,
    config: &'a AlignmentConfig,
    workspace: &'a mut AlignmentWorkspace,
}

impl pulp::NullaryFnOnce for Task<'_> {
    type Output = Option<Alignment>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        align_here(
            self.reference,
            self.frame,
            self.start,
            self.config,
            self.workspace,
        )
    }
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
        SIDE,
        config.max_tiles,
        &mut workspace.tiles,
    );
    let mut last = descend_first(&first, reference, frame, config, workspace)?;
    let tiles = workspace.tiles.len();
    let mut iterations = last.iterations;
    let mut view = View::new(reference, &(last.motion * first.homography))?;
    for rendering in 1..config.renderings {
        workspace.templates.clear();
        render(&view, reference, 0..tiles, workspace);
        correlate(frame, &workspace.templates, tiles, &mut workspace.after);
        let is_last = rendering + 1 == config.renderings;
        last = descend(&view, &first.outline, is_last, frame, config, workspace)?;
        iterations += last.iterations;
        let next = View::new(reference, &(last.motion * view.homography))?;
        let moved = farthest(&next.outline, &view.outline);
        view = next;
        if moved < SETTLED {
            break;
        }
    }
    let (before, after) = (&workspace.before, &workspace.after);
    let [score_before, score_after] = scores(before, after, config.min_correlation)?;
    let moved = farthest(&view.outline, &first.outline);
    let accepted = score_after > score_before && moved <= config.max_motion;
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
        compared: tiles,
        information: of_corners(&last.information, &view)?,
    })
}

/// The descent on the first rendering, of a few tiles or of all, whose correlations it leaves behind.
#[inline(always)]
fn descend_first(
    first: &View,
    reference: &AlignmentReference,
    frame: &GrayImage,
    config: &AlignmentConfig,
    workspace: &mut AlignmentWorkspace,
) -> Option<Descent> {
    let few = spread_first(&mut workspace.tiles);
    let tiles = workspace.tiles.len();
    workspace.templates.clear();
    render(first, reference, 0..few, workspace);
    let mut descent = descend(first, &first.outline, false, frame, config, workspace);
    if few < tiles && !descent.as_ref().is_some_and(|d| is_clear(d, few, first)) {
        render(first, reference, few..tiles, workspace);
        descent = descend(first, &first.outline, false, frame, config, workspace);
    }
    correlate(frame, &workspace.templates, tiles, &mut workspace.before);
    descent
}

/// Whether so few tiles leave no doubt where the face is.
fn is_clear(descent: &Descent, few: usize, start: &View) -> bool {
    let outline = start.outline.map(|corner| apply(&descent.motion, corner));
    descent.tiles as f64 >= FIRST_AGREEING * few as f64
        && farthest(&outline, &start.outline) <= FIRST_MOTION
}

/// Puts the tiles of the first rendering first, spread evenly over the others; returns their number.
fn spread_first(tiles: &mut [Tile]) -> usize {
    let few = tiles.len().div_ceil(FIRST_SHARE);
    if few < FIRST_TILES {
        return tiles.len();
    }
    for number in 0..few {
        tiles.swap(number, number * FIRST_SHARE);
    }
    few
}

/// Mean correlations, by Fisher's transformation, of the tiles that both renderings have and at least one of them agrees with: a
/// hidden tile agrees with neither, and its correlations are chance. `None` where there are none.
fn scores(before: &[f64], after: &[f64], min_correlation: f64) -> Option<[f64; 2]> {
    let (mut sums, mut count) = ([0.0; 2], 0);
    for (a, b) in before.iter().zip(after) {
        // Comparisons with NaN are false.
        if a.is_finite() && b.is_finite() && (*a >= min_correlation || *b >= min_correlation) {
            sums = [sums[0] + fisher(*a), sums[1] + fisher(*b)];
            count += 1;
        }
    }
    (count > 0).then(|| sums.map(|sum| (sum / f64::from(count)).tanh()))
}

/// Fisher's transformation, which makes the variance of correlations equal (Biometrika 1915).
fn fisher(correlation: f64) -> f64 {
    correlation.clamp(-0.9999, 0.9999).atanh()
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
