//! Alignment on one rendering of the reference.

use std::ops::Range;

use nalgebra::{Matrix2, Matrix3, SMatrix, Vector2};

use super::displacement::{Displacement, measure};
use super::motion::{Information, Observation, certain, solve};
use super::template::Template;
use super::view::{Centred, PARAMETERS, View, apply};
use super::{AlignmentConfig, AlignmentReference, AlignmentWorkspace};
use crate::GrayImage;

/// Iterations end where no corner moves farther than this \[px\] …
const CONVERGED: f64 = 0.005;
/// … or than this where the reference is rendered anew from there.
const NEARLY_CONVERGED: f64 = 0.05;

/// A tile is not linear over longer displacements than this \[px\]: the measurement is wrong.
const LONGEST_OFFSET: f64 = 4.0;

/// Where a descent ended.
#[derive(Debug, Clone)]
pub struct Descent {
    /// The homography of the frame that the rendering must be moved by.
    pub motion: Matrix3<f64>,
    /// Iterations that it took.
    pub iterations: usize,
    /// Tiles that agreed with the reference.
    pub tiles: usize,
    /// Information of the parameters of [`Centred::homography`] about the outline.
    pub information: SMatrix<f64, PARAMETERS, PARAMETERS>,
}

/// Renders chosen tiles as the view shows them, besides those that are rendered already.
#[inline(always)]
pub fn render(
    view: &View,
    reference: &AlignmentReference,
    numbers: Range<usize>,
    workspace: &mut AlignmentWorkspace,
) {
    for number in numbers {
        let template = Template::render(number, workspace.tiles[number], view, reference);
        workspace.templates.extend(template);
    }
}

/// Correlation of each of so many tiles with the frame where it was rendered, by its number; NaN
/// where it has none.
#[inline(always)]
pub fn correlate(
    frame: &GrayImage,
    templates: &[Template],
    tiles: usize,
    correlations: &mut Vec<f64>,
) {
    correlations.clear();
    correlations.resize(tiles, f64::NAN);
    for template in templates {
        if let Some(displacement) = measure(template, frame, &Matrix3::identity()) {
            correlations[template.number] = displacement.correlation;
        }
    }
}

/// Moves the rendered tiles to where the frame shows them.
///
/// `start` is the outline that the prior holds to; `is_last` says that no better rendering follows.
/// `None` where too few tiles agree.
#[inline(always)]
pub fn descend(
    view: &View,
    start: &[Vector2<f64>; 4],
    is_last: bool,
    frame: &GrayImage,
    config: &AlignmentConfig,
    workspace: &mut AlignmentWorkspace,
) -> Option<Descent> {
    let converged = if is_last { CONVERGED } else { NEARLY_CONVERGED };
    let mut motion = Matrix3::identity();
    let mut descent = None;
    for iteration in 1..=config.max_iterations {
        let outline = view.outline.map(|corner| apply(&motion, corner));
        let centred = Centred::about(&outline);
        observe(frame, &motion, &centred, config, workspace);
        let tiles = workspace.observations.len();
        if tiles < config.min_tiles {
            return None;
        }
        let prior = prior(&outline, start, &centred, config.start_sigma);
        let (step, information) =
            solve(&mut workspace.observations, &prior, &mut workspace.squares)?;
        let change = centred.homography(&step);
        motion = change * motion;
        descent = Some(Descent {
            motion,
            iterations: iteration,
            tiles,
            information: information.matrix,
        });
        let moved = outline.map(|corner| apply(&change, corner));
        if farthest(&moved, &outline) < converged {
            break;
        }
    }
    keep_agreeing(view, workspace);
    descent
}

/// Remembers which points of the reference the motion is of.
fn keep_agreeing(view: &View, workspace: &mut AlignmentWorkspace) {
    workspace.agreeing.clear();
    for (observation, &number) in workspace.observations.iter().zip(&workspace.observed) {
        if observation.weight() > 0.0 {
            let centre = workspace.templates[number].tile.centre();
            workspace.agreeing.extend(view.reference_point(centre));
        }
    }
}

/// Largest distance of corresponding corners \[px\].
pub fn farthest(a: &[Vector2<f64>; 4], b: &[Vector2<f64>; 4]) -> f64 {
    let distances = a.iter().zip(b).map(|(a, b)| (a - b).norm());
    distances.fold(0.0, f64::max)
}

/// Fills the observations with the tiles that agree with the reference.
#[inline(always)]
fn observe(
    frame: &GrayImage,
    motion: &Matrix3<f64>,
    centred: &Centred,
    config: &AlignmentConfig,
    workspace: &mut AlignmentWorkspace,
) {
    workspace.observations.clear();
    workspace.observed.clear();
    let floor = Matrix2::identity() * config.displacement_floor.powi(2);
    for (number, template) in workspace.templates.iter().enumerate() {
        let Some(found) = measure(template, frame, motion) else {
            continue;
        };
        if agrees(&found, config) {
            let covariance = found.covariance + floor;
            let observation = Observation::new(found.predicted, found.offset, covariance, centred);
            if let Some(observation) = observation {
                workspace.observations.push(observation);
                workspace.observed.push(number);
            }
        }
    }
}

fn agrees(displacement: &Displacement, config: &AlignmentConfig) -> bool {
    displacement.correlation >= config.min_correlation
        && displacement.offset.norm() <= LONGEST_OFFSET
}

/// The start as a measurement of the corners.
fn prior(
    outline: &[Vector2<f64>; 4],
    start: &[Vector2<f64>; 4],
    centred: &Centred,
    sigma: f64,
) -> Information {
    let covariance = Matrix2::identity() * sigma.powi(2);
    certain(
        outline
            .iter()
            .zip(start)
            .filter_map(|(now, before)| Observation::new(*now, before - now, covariance, centred)),
    )
}
