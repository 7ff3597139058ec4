//! From matches to a homography of one face (paper, Algorithm 1: RANSAC homography).

use std::collections::HashSet;

use nalgebra::Matrix3;

use super::evidence::{FaceEvidence, Match};
use super::face::SearchedFace;
use super::plausible::{convex_outline, rigidity};
use super::rigid_views::rigid_views;
use super::settings::SearchSettings;
use super::support::supported;
use crate::Camera;
use crate::homography::{PointMatch, Prior, RansacConfig, estimate, refine as refine_on};

/// Rounds of collecting the matches that agree and fitting to them: how far a match may be off, over
/// the threshold. A rough start is right near the matches that it comes from only.
const ROUNDS: [f64; 3] = [2.0, 1.0, 1.0];
/// So many inliers are no chance, and only one rigid view agrees with them.
pub const SURE: usize = 30;
/// Scale of the loss in refinement over the threshold: most inliers are far better than the worst.
const LOSS_SCALE: f64 = 0.1;
/// Fisher's F from which on matches speak against a rigid view. By chance, 10 is exceeded once in
/// a few thousand times with ten matches.
const SHAPE_EVIDENCE: f64 = 10.0;
/// Views of which no corner is farther apart than this [px] are one.
const SAME_VIEW: f64 = 1.0;
/// Matches are never better than this [px]: exact ones would speak against any other homography.
const LEAST_ERROR: f64 = 0.1;

/// A homography from reference edge coordinates to undistorted pixels, and its inliers.
#[derive(Debug, Clone, PartialEq)]
pub struct HomographyEstimate {
    /// Scaled to H[2, 2] = 1.
    pub matrix: Matrix3<f64>,
    /// Matches that it explains, in the order of the features.
    pub inliers: Vec<Match>,
    /// By which factor the matches say that the face is stretched, where that is more than a rigid
    /// view may be and no rigid view explains them as well.
    pub stretched: Option<f64>,
}

/// From the matches that pass the ratio test, sampled in the order of their ratio.
pub fn from_strict(
    evidence: &FaceEvidence<'_>,
    camera: &Camera,
    settings: &SearchSettings,
) -> Option<HomographyEstimate> {
    let mut strict = evidence.passing(settings.max_ratio);
    if strict.len() < settings.min_matches {
        return None;
    }
    strict.sort_by(|a, b| a.ratio.total_cmp(&b.ratio));
    sampled(&strict, evidence, camera, settings)
}

/// For faces with few right matches among many: from all those with a weaker ratio that support
/// each other, sampled in the order of their support.
pub fn from_supported(
    evidence: &FaceEvidence<'_>,
    camera: &Camera,
    settings: &SearchSettings,
) -> Option<HomographyEstimate> {
    let loose = evidence.passing(settings.max_loose_ratio);
    if loose.len() < settings.min_matches {
        return None;
    }
    sampled(&supported(&loose, evidence), evidence, camera, settings)
}

fn sampled(
    best_first: &[Match],
    evidence: &FaceEvidence<'_>,
    camera: &Camera,
    settings: &SearchSettings,
) -> Option<HomographyEstimate> {
    let config = RansacConfig {
        threshold: settings.threshold,
        max_iterations: settings.iterations,
        ..RansacConfig::default()
    };
    // Evidence has finite points and the settings are checked: an error is no answer here.
    let rigidity = rigidity(evidence.face(), camera)?;
    // Four matches with noise are allowed more than the result.
    let most = settings.max_stretch.powi(2);
    let possible = |H: &Matrix3<f64>| {
        rigidity.stretch(H) <= most && convex_outline(H, evidence.face()).is_ok()
    };
    let found = estimate(&points(best_first), &config, possible).ok()??;
    refine(&found.matrix, evidence, camera, settings)
}

/// Refines a homography over all matches that agree with it.
///
/// Matches that the ratio test refused, but that lie where the first estimate says, take part:
/// they make it more precise, and cannot bring a wrong estimate about. So does the knowledge that
/// the face is rigid and about as wide and high as taught. `None` where the estimate degenerates or
/// fewer than four matches agree.
pub fn refine(
    start: &Matrix3<f64>,
    evidence: &FaceEvidence<'_>,
    camera: &Camera,
    settings: &SearchSettings,
) -> Option<HomographyEstimate> {
    let face = evidence.face();
    let prior = Prior {
        rigidity: rigidity(face, camera)?,
        sigma: settings.aspect_sigma,
    };
    let better = |estimate: &HomographyEstimate| {
        rigid_views(&estimate.matrix, &estimate.inliers, face, camera)
            .iter()
            .filter(|view| !looks_the_same(view, &estimate.matrix, face))
            .filter_map(|view| refined(view, evidence, Some(&prior), settings))
            .max_by(|a, b| score(a, settings).total_cmp(&score(b, settings)))
            .filter(|other| score(other, settings) > score(estimate, settings))
    };
    let free = refined(start, evidence, None, settings)?;
    let mut rigid =
        refined(&free.matrix, evidence, Some(&prior), settings).unwrap_or_else(|| free.clone());
    if rigid.inliers.len() < SURE
        && let Some(other) = better(&rigid)
    {
        // The view across of a first result, which may have come from few matches, is better known
        // from its own matches.
        rigid = better(&other).unwrap_or(other);
    }
    // A face of another shape than taught still has a rigid view that some of its matches agree
    // with. Without the prior all of them do, and show the shape.
    let stretch = prior.rigidity.stretch(&free.matrix);
    let stretched =
        stretch > settings.max_stretch && explains_better(&free, &rigid, settings) > SHAPE_EVIDENCE;
    rigid.stretched = stretched.then_some(stretch);
    Some(rigid)
}

/// Whether a descent from a view ends where another one is: all corners are near it.
fn looks_the_same(view: &Matrix3<f64>, other: &Matrix3<f64>, face: &SearchedFace) -> bool {
    let [Ok(here), Ok(there)] = [view, other].map(|H| convex_outline(H, face)) else {
        return false;
    };
    let mut corners = here.iter().zip(&there);
    corners.all(|(a, b)| (a - b).norm() < SAME_VIEW)
}

/// How much better the matches agree with a homography of eight free parameters than with a rigid
/// view of six: Fisher's F, which is about one where the difference is chance.
fn explains_better(
    free: &HomographyEstimate,
    rigid: &HomographyEstimate,
    settings: &SearchSettings,
) -> f64 {
    let errors = |H: &Matrix3<f64>| -> f64 {
        let most = settings.threshold.powi(2);
        let matches = free.inliers.iter();
        matches
            .map(|one| one.points.squared_error(H).min(most))
            .sum()
    };
    let count = free.inliers.len() as f64;
    let (without, with) = (errors(&free.matrix), errors(&rigid.matrix));
    let noise = without.max(count * LEAST_ERROR.powi(2)) / (2.0 * count - 8.0).max(1.0);
    (with - without) / 2.0 / noise
}

/// Rounds of collecting the matches that agree and fitting to them.
fn refined(
    start: &Matrix3<f64>,
    evidence: &FaceEvidence<'_>,
    prior: Option<&Prior>,
    settings: &SearchSettings,
) -> Option<HomographyEstimate> {
    let mut matrix = normalise(start)?;
    for tolerance in ROUNDS {
        let radius = tolerance * settings.threshold;
        let inliers = one_per_place(evidence.agreeing(&matrix, radius));
        if inliers.len() < 4 {
            return None;
        }
        let scale = LOSS_SCALE * settings.threshold;
        let fitted = refine_on(&points(&inliers), &matrix, scale, prior);
        matrix = fitted.map_or(Some(matrix), |fitted| normalise(&fitted))?;
    }
    let inliers = one_per_place(evidence.agreeing(&matrix, settings.threshold));
    Some(HomographyEstimate {
        matrix,
        inliers,
        stretched: None,
    })
}

/// How many matches agree, and how well: the complement of MSAC's truncated squared errors.
fn score(estimate: &HomographyEstimate, settings: &SearchSettings) -> f64 {
    let squared = settings.threshold.powi(2);
    let inliers = estimate.inliers.iter();
    inliers
        .map(|one| 1.0 - one.points.squared_error(&estimate.matrix) / squared)
        .sum()
}

/// Scales to H[2, 2] = 1, so that w > 0 in front of the camera; `None` where degenerate.
///
/// H[2, 2] is w at the reference's corner (0, 0), which every acceptable view has in front.
fn normalise(matrix: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let scale = matrix[(2, 2)];
    (matrix.iter().all(|v| v.is_finite()) && scale.abs() >= 1e-12).then(|| matrix / scale)
}

/// Drops repeats of a keypoint that was described more than once (several orientations).
fn one_per_place(mut matches: Vec<Match>) -> Vec<Match> {
    matches.sort_by(|a, b| a.ratio.total_cmp(&b.ratio));
    let mut places = HashSet::with_capacity(matches.len());
    matches.retain(|one| {
        let quarters = (one.points.target * 4.0).map(|v| v.round() as i64);
        places.insert((quarters.x, quarters.y))
    });
    matches.sort_by_key(|one| one.feature);
    matches
}

fn points(matches: &[Match]) -> Vec<PointMatch> {
    matches.iter().map(|one| one.points).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::Vector2;

    use super::*;
    use crate::face_search::scenes::{plain_face, view};

    fn seen(feature: u32, (x, y): (f64, f64), ratio: f64) -> Match {
        Match {
            feature,
            reference: feature,
            nearest: true,
            ratio,
            points: PointMatch {
                source: Vector2::zeros(),
                target: Vector2::new(x, y),
            },
        }
    }

    #[test]
    fn a_view_looks_the_same_where_no_corner_is_far_away() {
        let (face, here) = (plain_face(&[]), view(20.0, 30.0));
        let moved = |x: f64| Matrix3::new_translation(&Vector2::new(x, 0.0)) * here;
        assert!(looks_the_same(&moved(0.9), &here, &face));
        assert!(!looks_the_same(&moved(1.1), &here, &face));
        // Turned to the other side it looks nearly the same in the middle, not at its corners.
        assert!(!looks_the_same(&view(-20.0, 30.0), &here, &face));
        assert!(!looks_the_same(&Matrix3::zeros(), &here, &face));
    }

    #[test]
    fn of_several_descriptions_of_one_place_the_best_by_ratio_stays() {
        let matches = vec![
            seen(0, (50.0, 50.0), 0.7),
            seen(1, (10.0, 20.0), 0.9),
            seen(2, (10.05, 20.05), 0.3),
            seen(3, (10.0, 20.0), 0.6),
            // Half a pixel away is another keypoint.
            seen(4, (10.5, 20.0), 0.8),
        ];
        let kept: Vec<u32> = one_per_place(matches).iter().map(|m| m.feature).collect();
        assert_eq!(kept, [0, 2, 4]);
        assert!(one_per_place(Vec::new()).is_empty());
    }

    #[test]
    fn equally_good_descriptions_of_one_place_leave_the_first() {
        let matches = vec![seen(3, (1.0, 1.0), 0.5), seen(5, (1.0, 1.0), 0.5)];
        assert_eq!(one_per_place(matches)[0].feature, 3);
    }

    #[test]
    fn a_homography_is_scaled_to_be_positive_at_the_corner() {
        let H = Matrix3::new(2.0, 0.0, 4.0, 0.0, 6.0, 8.0, 0.0, 0.0, -2.0);
        let expected = Matrix3::new(-1.0, 0.0, -2.0, 0.0, -3.0, -4.0, 0.0, 0.0, 1.0);
        assert_eq!(normalise(&H), Some(expected));
    }

    #[test]
    fn what_has_no_scale_is_degenerate() {
        let mut infinite = Matrix3::identity();
        infinite[(0, 1)] = f64::INFINITY;
        for H in [Matrix3::zeros(), Matrix3::repeat(f64::NAN), infinite] {
            assert_eq!(normalise(&H), None);
        }
    }
}
