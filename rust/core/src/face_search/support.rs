//! Which candidates agree with others about how the face is turned, scaled and placed.
//!
//! A keypoint has a position, a scale and an orientation, and its oblique view a direction and a
//! tilt: together a local affine map from the reference into the frame. Where that map predicts
//! another candidate, it supports the match. Weak, blurred or small faces have few right matches
//! among many; support finds them where the ratio test alone cannot (after the pose clustering of
//! Lowe, IJCV 2004, with affine instead of similarity frames).

use std::collections::HashMap;

use nalgebra::Matrix2;

use super::evidence::{FaceEvidence, Match};
use super::neighbourhood::Neighbourhood;

/// For so many matches is support looked for, the best by ratio.
const MOST_MATCHES: usize = 250;
/// Frobenius distance of one local map, seen from the other, to the identity.
const MAP_TOLERANCE: f64 = 0.8;
/// Matches supported by fewer others are dropped.
const MIN_SUPPORT: usize = 2;

/// The matches that candidates about them support, and these candidates; the best supported first.
///
/// Supporters need not be the nearest of their features nor pass any ratio test.
pub fn supported(matches: &[Match], evidence: &FaceEvidence<'_>) -> Vec<Match> {
    let mut best_first = matches.to_vec();
    best_first.sort_by(|a, b| a.ratio.total_cmp(&b.ratio));
    best_first.truncate(MOST_MATCHES);
    let neighbourhood = Neighbourhood::new(evidence.all());
    // By feature and keypoint, since one candidate may support many matches.
    let mut support: HashMap<(u32, u32), (usize, Match)> = HashMap::new();
    let mut predicted = Vec::new();
    for one in &best_first {
        let supporters = supporters(one, &neighbourhood, evidence, &mut predicted);
        if supporters.len() >= MIN_SUPPORT {
            let count = supporters.len();
            for member in supporters.into_iter().chain([*one]) {
                let known = support
                    .entry((member.feature, member.reference))
                    .or_insert((0, member));
                known.0 = known.0.max(count);
            }
        }
    }
    let mut counted: Vec<(usize, Match)> = support.into_values().collect();
    counted.sort_by_key(|(count, one)| (std::cmp::Reverse(*count), one.feature, one.reference));
    counted.into_iter().map(|(_, one)| one).collect()
}

/// The candidates where the match's local map predicts them, one a feature, mapped about alike.
fn supporters(
    one: &Match,
    neighbourhood: &Neighbourhood<'_>,
    evidence: &FaceEvidence<'_>,
    predicted: &mut Vec<u32>,
) -> Vec<Match> {
    let local = evidence.local_map(one);
    let Some((map, inverse)) = local.and_then(|map| Some((map, map.try_inverse()?))) else {
        return Vec::new();
    };
    neighbourhood.predicted(one, &map.cast(), predicted);
    let mut supporters: Vec<Match> = Vec::new();
    for &other in predicted.iter() {
        let other = neighbourhood.matches[other as usize];
        // The same feature seen twice supports nothing.
        if other.feature == one.feature
            || supporters
                .last()
                .is_some_and(|s| s.feature == other.feature)
        {
            continue;
        }
        let alike =
            |other: Matrix2<f64>| (inverse * other - Matrix2::identity()).norm() < MAP_TOLERANCE;
        if evidence.local_map(other).is_some_and(alike) {
            supporters.push(*other);
        }
    }
    supporters
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation2, Vector2};

    use super::*;
    use crate::face_search::scenes::{face, frame_seen_as, one_each, points};
    use crate::random::SplitMix64;

    /// Matches, and the local map that the frames of each say.
    struct Scene {
        reference: Vec<Vector2<f64>>,
        image: Vec<Vector2<f64>>,
        maps: Vec<Matrix2<f64>>,
        ratio: Vec<f32>,
    }

    /// Turned by 0.5 rad and seen 1.5 times larger, compressed along the image's x.
    fn true_map() -> Matrix2<f64> {
        Matrix2::new(0.5, 0.0, 0.0, 1.0) * Rotation2::new(0.5).matrix() * 1.5
    }

    /// True matches of an affine view first, all within [`RADIUS`] of each other, then wrong ones.
    fn scene(good: usize, bad: usize, seed: u64) -> Scene {
        // At most 45 · √2 · 1.5 = 95 px apart in the frame.
        let near = points(good, 45.0, 45.0, seed).into_iter();
        let reference: Vec<Vector2<f64>> = near
            .map(|p| p + Vector2::new(120.0, 100.0))
            .chain(points(bad, 300.0, 300.0, seed + 500))
            .collect();
        let wrong = points(bad, 600.0, 600.0, seed + 1000);
        let seen = |p: &Vector2<f64>| true_map() * p + Vector2::new(50.0, 40.0);
        let mut random = SplitMix64::new(seed + 2000);
        let turned: Vec<Matrix2<f64>> = (0..bad)
            .map(|_| {
                let angle = random.uniform() * std::f64::consts::TAU;
                Rotation2::new(angle).matrix() * (0.3 + 1.7 * random.uniform())
            })
            .collect();
        Scene {
            image: reference[..good].iter().map(seen).chain(wrong).collect(),
            maps: [vec![true_map(); good], turned].concat(),
            ratio: (0..good + bad)
                .map(|_| 0.5 + 0.4 * random.uniform() as f32)
                .collect(),
            reference,
        }
    }

    /// The features of the matches that are supported, and of their supporters; the best supported
    /// first.
    fn kept(scene: &Scene) -> Vec<u32> {
        kept_of(scene, 1.0)
    }

    /// The same where support is looked for only for matches that pass a ratio test.
    fn kept_of(scene: &Scene, max_ratio: f64) -> Vec<u32> {
        let face = face(
            &scene.reference,
            scene.maps.iter().map(frame_seen_as).collect(),
        );
        let evidence = one_each(&scene.image, &scene.ratio);
        let of_face = evidence.of(0, &face);
        let passing = of_face.passing(max_ratio);
        let expected = scene.ratio.iter().filter(|&&r| f64::from(r) < max_ratio);
        assert_eq!(passing.len(), expected.count());
        supported(&passing, &of_face)
            .iter()
            .map(|one| one.feature)
            .collect()
    }

    #[test]
    fn right_matches_support_each_other_and_wrong_ones_fall_away() {
        let kept = kept(&scene(10, 40, 0));
        // Each right one has the nine others: more than any wrong one.
        let mut first = kept[..10].to_vec();
        first.sort_unstable();
        assert_eq!(first, (0..10).collect::<Vec<u32>>());
        assert!(kept.len() <= 12, "{kept:?}");
    }

    #[test]
    fn supporters_need_not_pass_the_ratio_test() {
        let mut scene = scene(10, 40, 0);
        scene.ratio.fill(1.5);
        scene.ratio[3] = 0.5;
        let mut kept = kept_of(&scene, 0.9);
        kept.sort_unstable();
        assert_eq!(kept, (0..10).collect::<Vec<u32>>());
    }

    #[test]
    fn what_lies_far_away_supports_nothing() {
        let mut scene = scene(6, 0, 0);
        // As exact as before, but 200 px apart, two by two: each has one other near it.
        for (i, (reference, image)) in scene.reference.iter_mut().zip(&mut scene.image).enumerate()
        {
            let shift = Vector2::new(400.0 * (i / 2) as f64, 0.0);
            *reference += shift;
            *image += true_map() * shift;
        }
        assert!(kept(&scene).is_empty());
    }

    #[test]
    fn only_wrong_matches_leave_little() {
        let left: usize = (0..10).map(|seed| kept(&scene(0, 60, seed)).len()).sum();
        assert!(left < 60, "{left} in ten scenes");
    }

    #[test]
    fn local_maps_need_not_be_exact() {
        // The true map shortens one direction twice as much as the other: up to 15% off, what is
        // predicted is off by 2 · 0.15 / 1.15 of its length at most, within the tolerance.
        for (x, y, least) in [
            (1.15, 1.0, 10),
            (0.9, 1.15, 10),
            (1.3, 1.0, 8),
            (0.8, 1.2, 8),
        ] {
            let mut scene = scene(10, 0, 0);
            scene.maps = vec![true_map() * Matrix2::new(x, 0.0, 0.0, y); 10];
            let kept = kept(&scene).len();
            assert!(kept >= least, "{kept} at {x}, {y}");
        }
    }

    #[test]
    fn matches_that_are_turned_against_each_other_do_not_support_each_other() {
        // Positions agree, but every keypoint says another orientation.
        let mut scene = scene(10, 0, 0);
        for (i, map) in scene.maps.iter_mut().enumerate() {
            *map = true_map() * Rotation2::new(std::f64::consts::TAU * i as f64 / 10.0).matrix();
        }
        assert!(kept(&scene).is_empty());
    }

    #[test]
    fn one_reference_point_seen_many_times_supports_nothing() {
        let mut scene = scene(10, 0, 0);
        scene.reference = vec![scene.reference[0]; 10];
        scene.image = vec![scene.image[0]; 10];
        assert!(kept(&scene).is_empty());
    }

    #[test]
    fn keypoints_without_area_support_nothing() {
        let scene = scene(10, 0, 0);
        let evidence = one_each(&scene.image, &scene.ratio);
        let flat = face(&scene.reference, vec![[1.0, 1.0, 1.0, 1.0]; 10]);
        let of_face = evidence.of(0, &flat);
        assert!(supported(&of_face.passing(1.0), &of_face).is_empty());
    }

    #[test]
    fn of_very_many_matches_the_best_by_ratio_are_asked() {
        let mut many = scene(40, 1000, 0);
        many.ratio = [vec![0.3; 40], vec![0.8; 1000]].concat();
        let found = kept(&many);
        assert_eq!(found.iter().filter(|&&feature| feature < 40).count(), 40);
        assert!(found.len() <= MOST_MATCHES);
        // Last by ratio, the right ones are not asked.
        many.ratio[..40].fill(0.9);
        assert!(!kept(&many).iter().any(|&feature| feature < 40));
    }

    #[test]
    fn points_at_the_end_of_all_numbers_support_nothing() {
        let mut scene = scene(10, 0, 0);
        for end in [f64::MAX, f64::MIN, 1e19, -1e19] {
            scene.image.fill(Vector2::new(end, end));
            assert!(kept(&scene).is_empty(), "{end}");
        }
    }

    #[test]
    fn too_few_to_support_each_other() {
        for count in 0..3 {
            assert!(kept(&scene(count, 0, 0)).is_empty());
        }
        assert_eq!(kept(&scene(3, 0, 0)).len(), 3);
    }
}
