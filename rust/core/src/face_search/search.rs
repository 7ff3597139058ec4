//! The search for every instance of every face.

use std::collections::HashSet;

use nalgebra::{Matrix3, Vector2};
use rayon::prelude::*;

use super::aligned::{WELL_SPREAD, aligned};
use super::estimate::{HomographyEstimate, from_strict, from_supported, refine};
use super::evidence::{Evidence, FaceEvidence, Match};
use super::face::SearchedFace;
use super::plausible::{coverage, outline, stretch};
use super::refusal::Refusal;
use super::settings::SearchSettings;
use crate::quadrilateral::Quadrilateral;
use crate::{Camera, GrayImage};

/// A face of which so many tiles agree has the shape of the view that they agree with.
const MOST_OF_IT: f64 = 0.5;
/// So many inliers, well spread, need not be borne out by grey values.
const PLENTY: f64 = 60.0;

/// A way to come by a homography.
type Source = fn(&FaceEvidence<'_>, &Camera, &SearchSettings) -> Option<HomographyEstimate>;

/// What the search looks at in one frame.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    /// Its features and the references that look like them.
    pub evidence: &'a Evidence,
    /// The image without lens distortion.
    pub gray: GrayImage<'a>,
    /// The camera.
    pub camera: &'a Camera,
}

/// A face where it was found.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundFace {
    /// From edge coordinates of the reference to undistorted pixels, scaled to H[2, 2] = 1.
    pub homography: Matrix3<f64>,
    /// The same from the matches alone, before the alignment of grey values.
    pub matched_homography: Matrix3<f64>,
    /// Its corners in undistorted pixels: top-left of the reference, then clockwise.
    pub outline: [Vector2<f64>; 4],
    /// Matches that the homography explains.
    pub inliers: Vec<Match>,
    /// Share of the face over which they are spread.
    pub coverage: f64,
    /// Share of its textured cells that look like the reference.
    pub agreement: f64,
    /// Whether its grey values leave no doubt: its tiles agree with the reference well, or nearly all.
    pub is_evident: bool,
}

/// The numbers of one attempt, as far as it got.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Figures {
    /// Matches that pass the ratio test.
    pub matches: Option<usize>,
    /// Matches that the homography explains.
    pub inliers: Option<usize>,
    /// Departure from a rigid view, as a factor.
    pub stretch: Option<f64>,
    /// See [`FoundFace::coverage`].
    pub coverage: Option<f64>,
    /// See [`FoundFace::agreement`].
    pub agreement: Option<f64>,
    /// Share of the aligned tiles that agree with the reference.
    pub tiles: Option<f64>,
}

/// One attempt at one face.
#[derive(Debug, Clone, PartialEq)]
pub struct Attempt {
    /// Number of the face.
    pub face: usize,
    /// 0 for the first attempt, 1 for the search after the first instance, …
    pub instance: usize,
    /// The numbers.
    pub figures: Figures,
    /// The face, or why it is not there.
    pub outcome: Result<FoundFace, Refusal>,
}

/// Finds every instance of the faces numbered in `among`: attempts in their order, and for each face
/// in the order of its instances. The attempt that ends the search for further instances is left out.
pub fn find(
    faces: &[SearchedFace],
    among: &[usize],
    view: &View<'_>,
    settings: &SearchSettings,
    max_instances: usize,
) -> Vec<Attempt> {
    among
        .par_iter()
        // One takes several times as long as another.
        .with_max_len(1)
        .filter_map(|&number| Some((number, faces.get(number)?)))
        .flat_map_iter(|(number, face)| find_one(number, face, view, settings, max_instances))
        .collect()
}

/// Verifies one face where a homography predicts it.
///
/// The matches need not pass the ratio test: they must lie where another face of the object,
/// already found, says.
pub fn look_where(
    number: usize,
    face: &SearchedFace,
    predicted: &Matrix3<f64>,
    view: &View<'_>,
    settings: &SearchSettings,
) -> Option<FoundFace> {
    outline(predicted, face, view.camera, settings).ok()?;
    let estimate = refine(
        predicted,
        &view.evidence.of(number, face),
        view.camera,
        settings,
    )?;
    verify(face, estimate, view, settings, &mut Figures::default()).ok()
}

fn find_one(
    number: usize,
    face: &SearchedFace,
    view: &View<'_>,
    settings: &SearchSettings,
    max_instances: usize,
) -> Vec<Attempt> {
    let mut attempts = Vec::new();
    let refused = |refusal: Refusal, matches: Option<usize>| Attempt {
        face: number,
        instance: 0,
        figures: Figures {
            matches,
            ..Figures::default()
        },
        outcome: Err(refusal),
    };
    if face.is_empty() {
        return vec![refused(Refusal::NoFeatures, None)];
    }
    // Most faces of a large library end here.
    if view.evidence.count(number, settings.max_loose_ratio) < settings.min_matches {
        let matches = view.evidence.count(number, settings.max_ratio);
        let refusal = Refusal::TooFewMatches {
            matches,
            needed: settings.min_matches,
        };
        return vec![refused(refusal, Some(matches))];
    }
    let mut evidence = view.evidence.of(number, face);
    for instance in 0..max_instances {
        let sources: &[Source] = match instance {
            0 => &[from_strict, from_supported],
            // Support is dear, and finds weak faces: a further instance must pass the ratio test.
            _ => &[from_strict],
        };
        let (figures, outcome) = attempt(face, sources, &evidence, view, settings);
        let found = outcome.as_ref().ok();
        let outline = found.map(|found| found.outline);
        let explained: HashSet<u32> = found
            .iter()
            .flat_map(|found| found.inliers.iter().map(|one| one.feature))
            .collect();
        if instance == 0 || outline.is_some() {
            attempts.push(Attempt {
                face: number,
                instance,
                figures,
                outcome,
            });
        }
        let Some(inside) = outline.and_then(Quadrilateral::new) else {
            break;
        };
        // Keypoints may lie beyond the border of the reference: what explained this instance is not
        // evidence for another one, wherever it is.
        evidence.remove(|one| {
            explained.contains(&one.feature) || inside.depth_inside(one.points.target) >= 0.0
        });
    }
    attempts
}

/// One attempt at one face: matches, homography, verification.
fn attempt(
    face: &SearchedFace,
    sources: &[Source],
    evidence: &FaceEvidence<'_>,
    view: &View<'_>,
    settings: &SearchSettings,
) -> (Figures, Result<FoundFace, Refusal>) {
    let matches = evidence.passing(settings.max_ratio).len();
    let counted = Figures {
        matches: Some(matches),
        ..Figures::default()
    };
    let mut last = if matches >= settings.min_matches {
        (counted, Err(Refusal::NoHomography { matches }))
    } else {
        let needed = settings.min_matches;
        (counted, Err(Refusal::TooFewMatches { matches, needed }))
    };
    for hypothesis in sources {
        let Some(estimate) = hypothesis(evidence, view.camera, settings) else {
            continue;
        };
        let mut figures = counted;
        let outcome = verify(face, estimate, view, settings, &mut figures);
        let found = outcome.is_ok();
        last = (figures, outcome);
        if found {
            break;
        }
    }
    last
}

/// The face, or why the estimate cannot be a view of it.
fn verify(
    face: &SearchedFace,
    estimate: HomographyEstimate,
    view: &View<'_>,
    settings: &SearchSettings,
    figures: &mut Figures,
) -> Result<FoundFace, Refusal> {
    let HomographyEstimate {
        matrix,
        inliers,
        stretched,
    } = estimate;
    figures.inliers = Some(inliers.len());
    if inliers.len() < settings.min_inliers {
        return Err(Refusal::TooFewInliers {
            inliers: inliers.len(),
            needed: settings.min_inliers,
        });
    }
    let outline = outline(&matrix, face, view.camera, settings)?;
    let stretch = stretch(&matrix, face, view.camera);
    figures.stretch = Some(stretch);
    check_stretch(stretch, settings)?;
    let coverage = coverage(inliers.iter().map(|one| one.points.source), face.size());
    figures.coverage = Some(coverage);
    if coverage < settings.min_coverage {
        let least = settings.min_coverage;
        return Err(Refusal::Coverage { coverage, least });
    }
    let agreement = face.appearance().agreement(view.gray, &matrix);
    figures.agreement = Some(agreement);
    if agreement < settings.min_agreement {
        let least = settings.min_agreement;
        return Err(Refusal::Agreement { agreement, least });
    }
    let found = FoundFace {
        homography: matrix,
        matched_homography: matrix,
        outline,
        inliers,
        coverage,
        agreement,
        is_evident: false,
    };
    let aligned = aligned(found, face, view, settings);
    figures.agreement = Some(aligned.found.agreement);
    figures.tiles = Some(aligned.tiles);
    figures.stretch = Some(aligned.stretch);
    check_stretch(aligned.stretch, settings)?;
    // A stretched face has parts that a rigid view shows, too.
    if let Some(stretch) = stretched.filter(|_| !(aligned.sure && aligned.tiles >= MOST_OF_IT)) {
        figures.stretch = Some(stretch);
        check_stretch(stretch, settings)?;
    }
    let (found, tiles) = (aligned.found, aligned.tiles);
    let least = needed_tiles(found.inliers.len(), coverage, settings);
    if tiles < least && !aligned.sure {
        return Err(Refusal::Tiles { tiles, least });
    }
    Ok(found)
}

fn check_stretch(stretch: f64, settings: &SearchSettings) -> Result<(), Refusal> {
    let most = settings.max_stretch;
    if stretch > most {
        return Err(Refusal::Stretched { stretch, most });
    }
    Ok(())
}

/// The share of aligned tiles that must agree: the fewer the inliers, the more. Inliers close together
/// may be one thing that looks alike by chance: they count in proportion to their spread.
fn needed_tiles(inliers: usize, coverage: f64, settings: &SearchSettings) -> f64 {
    let evidence = inliers as f64 * (coverage / WELL_SPREAD).min(1.0);
    settings.min_doubtful_tiles * (1.0 - evidence / PLENTY).max(0.0)
}

#[cfg(test)]
mod tests;
