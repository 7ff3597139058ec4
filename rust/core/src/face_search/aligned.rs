//! The homography of a face, made better by its grey values where they are to be believed.

use nalgebra::Matrix3;

use super::estimate::SURE;
use super::face::SearchedFace;
use super::plausible::{outline, stretch};
use super::rigid_views::rigid_views;
use super::search::{FoundFace, View};
use super::settings::SearchSettings;
use crate::alignment::{
    Alignment, AlignmentConfig, AlignmentWorkspace, CoarseFrames, align, align_from_afar,
};
use crate::robust::median;

/// Alignments of a wrong view, or of something else, stay below this correlation (0.88 in 300 frames),
/// those of the right one above (0.91 with two thirds of the face hidden); only blur brings them down.
const GOOD_SCORE: f64 = 0.9;
/// Where less of the face than this agrees, the correlation may be chance.
const GOOD_SHARE: f64 = 0.3;
/// Inliers on less of the face than this say too little about the rest of it.
pub const WELL_SPREAD: f64 = 0.3;
/// An alignment that stretches the face by more than this factor has lost hold of a part of it; the
/// right ones of photographs stay below 1.05.
const MOST_STRETCH: f64 = 1.1;

/// Share of the aligned tiles that leaves no doubt even where noise hides weak texture and they
/// correlate less than that: a wrong rigid view of a weak face can have 0.8.
const EVIDENT_TILES: f64 = 0.9;
/// Corners that the alignment moves by less than this [px] leave the coarse look of a face as it is.
const SAME_LOOK: f64 = 1.0;

/// What the alignment of a face gave.
#[derive(Debug, Clone)]
pub struct Aligned {
    /// The face with the aligned homography, or as it was where that is not better.
    pub found: FoundFace,
    /// Share of the aligned tiles that agree with the reference.
    pub tiles: f64,
    /// Departure of its homography from a rigid view, as a factor.
    pub stretch: f64,
    /// Whether the grey values leave no doubt that the face is there.
    pub sure: bool,
}

/// An alignment and how far it can be believed.
struct Candidate {
    alignment: Alignment,
    /// It leaves no doubt that it is the right one.
    good: bool,
    /// It is as rigid a view as that of the matches.
    rigid: bool,
    /// Correlation at its homography.
    score: f64,
}

/// Aligns the grey values of a face.
///
/// The alignment may end at a neighbouring period of the texture, or in a fold of a face of which
/// the matches know a corner only. It must leave the inliers where they are, be a view as rigid as
/// theirs, and show the reference better than before. Where it does not at once, the start may have
/// been far off: then both rigid views are tried, coarse to fine.
pub fn aligned(
    found: FoundFace,
    face: &SearchedFace,
    view: &View<'_>,
    settings: &SearchSettings,
) -> Aligned {
    let matched = stretch(&found.homography, face, view.camera);
    let as_it_was = |found: FoundFace, tiles: f64, sure: bool| Aligned {
        found,
        tiles,
        stretch: matched,
        sure,
    };
    let Some(reference) = face.alignment() else {
        return as_it_was(found, 0.0, false);
    };
    let mut workspace = AlignmentWorkspace::new();
    let config = AlignmentConfig::default();
    let judged = |alignment: Alignment| Candidate {
        good: is_good(&alignment),
        rigid: stretch(&alignment.homography, face, view.camera) <= MOST_STRETCH * matched,
        score: score(&alignment),
        alignment,
    };
    let direct = align(
        reference,
        &view.gray,
        &found.homography,
        &config,
        &mut workspace,
    );
    let mut candidates: Vec<Candidate> = direct.into_iter().map(judged).collect();
    let known = found.inliers.len() >= SURE && found.coverage >= WELL_SPREAD;
    if !known && !candidates.iter().any(is_evident) {
        let coarse = CoarseFrames::new(&view.gray);
        let views = rigid_views(&found.homography, &found.inliers, face, view.camera);
        let afar = views.iter().filter_map(|start| {
            align_from_afar(
                reference,
                &view.gray,
                &coarse,
                start,
                0,
                &config,
                &mut workspace,
            )
        });
        candidates.extend(afar.map(judged));
    }
    let (there, elsewhere): (Vec<Candidate>, Vec<Candidate>) = candidates
        .into_iter()
        .partition(|one| keeps_inliers(&one.alignment.homography, &found, settings));
    let Some(best) = best(there) else {
        // What the frame shows elsewhere says that something of this look is about.
        let tiles = best(elsewhere).map_or(0.0, |one| share(&one.alignment));
        return as_it_was(found, tiles, false);
    };
    let tiles = share(&best.alignment);
    let (sure, evident) = (best.good && best.rigid, is_evident(&best));
    let H = best.alignment.homography;
    let seen = outline(&H, face, view.camera, settings).ok();
    let better = best.alignment.accepted && (best.rigid || best.good);
    match seen.filter(|_| better) {
        Some(outline) => {
            let moves = outline.iter().zip(&found.outline);
            let stays = moves.into_iter().all(|(a, b)| (a - b).norm() < SAME_LOOK);
            let agreement = match stays {
                true => found.agreement,
                false => face.appearance().agreement(view.gray, &H),
            };
            let found = FoundFace {
                homography: H,
                outline,
                agreement,
                is_evident: evident,
                ..found
            };
            Aligned {
                found,
                tiles,
                stretch: stretch(&H, face, view.camera),
                sure,
            }
        }
        None => as_it_was(found, tiles, sure && !best.alignment.accepted),
    }
}

/// Whether there is no need to look for a better one, also where noise keeps the correlation low.
fn is_evident(candidate: &Candidate) -> bool {
    candidate.rigid && (candidate.good || share(&candidate.alignment) >= EVIDENT_TILES)
}

/// The one to be believed most.
fn best(candidates: Vec<Candidate>) -> Option<Candidate> {
    candidates.into_iter().max_by(|a, b| {
        (a.good, a.rigid)
            .cmp(&(b.good, b.rigid))
            .then(a.score.total_cmp(&b.score))
    })
}

/// Whether an alignment leaves no doubt that it is the right one.
fn is_good(alignment: &Alignment) -> bool {
    share(alignment) >= GOOD_SHARE && score(alignment) >= GOOD_SCORE
}

/// Correlation at the homography of an alignment: its start where it was not accepted.
fn score(alignment: &Alignment) -> f64 {
    match alignment.accepted {
        true => alignment.score_after,
        false => alignment.score_before,
    }
}

fn share(alignment: &Alignment) -> f64 {
    alignment.tiles as f64 / alignment.compared.max(1) as f64
}

/// Whether a homography maps the inliers about as well as the one that was found from them.
///
/// That one fits them best, also where they are noisy or few: another one may be farther from most
/// of them by the threshold, not by a period of the texture.
fn keeps_inliers(H: &Matrix3<f64>, found: &FoundFace, settings: &SearchSettings) -> bool {
    let error = |H: &Matrix3<f64>| {
        let errors = found.inliers.iter().map(|one| one.points.squared_error(H));
        median(&mut errors.collect::<Vec<_>>()).map_or(f64::INFINITY, f64::sqrt)
    };
    error(H) <= error(&found.homography) + settings.threshold
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::Vector2;

    use super::*;
    use crate::GrayImage;
    use crate::face_search::evidence::Match;
    use crate::face_search::scenes::{
        HEIGHT, WIDTH, camera, face_from_edge, mapped, one_each, points, settings, view,
    };
    use crate::homography::PointMatch;

    /// Dots with this period of the reference [px], here 9 px of the frame.
    const PERIOD: f64 = 20.6;

    fn dots(p: Vector2<f64>) -> f64 {
        let wave = |v: f64| (std::f64::consts::TAU * v / PERIOD).sin();
        128.0 + 60.0 * wave(p.x) * wave(p.y)
    }

    /// The same everywhere, besides waves that do not repeat.
    fn weak(p: Vector2<f64>) -> f64 {
        let waves = (1..8).map(|k| {
            let (angle, length) = (0.9 * f64::from(k), 60.0 + 17.0 * f64::from(k));
            (p.x * angle.cos() + p.y * angle.sin()) / length * std::f64::consts::TAU
        });
        dots(p) + 6.0 * waves.map(f64::sin).sum::<f64>()
    }

    fn gray(value: f64) -> u8 {
        value.round().clamp(0.0, 255.0) as u8
    }

    fn face_of(texture: fn(Vector2<f64>) -> f64) -> SearchedFace {
        let centre = |i: usize| Vector2::new((i % WIDTH) as f64 + 0.5, (i / WIDTH) as f64 + 0.5);
        let pixels: Vec<u8> = (0..WIDTH * HEIGHT)
            .map(|i| gray(texture(centre(i))))
            .collect();
        let image = GrayImage::new(WIDTH, HEIGHT, &pixels).unwrap();
        SearchedFace::new(image, face_from_edge(), vec![], vec![]).unwrap()
    }

    fn frame_of(texture: fn(Vector2<f64>) -> f64, H: &Matrix3<f64>) -> Vec<u8> {
        let back = H.try_inverse().unwrap();
        (0..640 * 480)
            .map(|i| {
                let p = mapped(&back, Vector2::new((i % 640) as f64, (i / 640) as f64));
                let inside =
                    p.x >= 0.0 && p.y >= 0.0 && p.x <= WIDTH as f64 && p.y <= HEIGHT as f64;
                gray(if inside { texture(p) } else { 90.0 })
            })
            .collect()
    }

    /// Aligns from where 40 exact matches of a homography are.
    fn aligned_from(
        start: &Matrix3<f64>,
        texture: fn(Vector2<f64>) -> f64,
        seen: &Matrix3<f64>,
    ) -> Aligned {
        let (face, pixels, camera) = (face_of(texture), frame_of(texture, seen), camera());
        let inliers: Vec<Match> = points(40, WIDTH as f64, HEIGHT as f64, 1)
            .into_iter()
            .enumerate()
            .map(|(i, source)| Match {
                feature: i as u32,
                reference: i as u32,
                nearest: true,
                ratio: 0.5,
                points: PointMatch {
                    source,
                    target: mapped(start, source),
                },
            })
            .collect();
        let view = View {
            evidence: &one_each(&[], &[]),
            gray: GrayImage::new(640, 480, &pixels).unwrap(),
            camera: &camera,
        };
        let found = FoundFace {
            homography: *start,
            matched_homography: *start,
            outline: outline(start, &face, &camera, &settings()).unwrap(),
            inliers,
            coverage: 0.8,
            agreement: 1.0,
            is_evident: false,
        };
        aligned(found, &face, &view, &settings())
    }

    fn moved(x: f64, H: &Matrix3<f64>) -> Matrix3<f64> {
        Matrix3::new_translation(&Vector2::new(x, 0.0)) * H
    }

    fn corner(H: &Matrix3<f64>) -> Vector2<f64> {
        mapped(H, Vector2::zeros())
    }

    #[test]
    fn the_alignment_does_not_leave_the_inliers_for_the_next_period() {
        let seen = view(0.0, 0.0);
        let period = (mapped(&seen, Vector2::new(PERIOD, 0.0)) - corner(&seen)).norm();
        // Half of a period of dots of two signs is none.
        let start = moved(0.56 * period, &seen);
        let aligned = aligned_from(&start, dots, &seen);
        assert_eq!(aligned.found.homography, start);
        // Within a pixel or two of the start it is believed.
        let near = aligned_from(&moved(0.15 * period, &seen), weak, &seen);
        let error = (corner(&near.found.homography) - corner(&seen)).norm();
        assert!(error < 0.1, "{error} px");
        assert!(near.sure && near.tiles > 0.9);
    }
}
