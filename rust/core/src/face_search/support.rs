//! Which matches agree with others about how the face is turned, scaled and placed.
//!
//! A keypoint has a position, a scale and an orientation, and its oblique view a direction and a
//! tilt: together a local affine map from the reference into the frame. Where that map predicts
//! another match, the two support each other. Weak, blurred or small faces have few right matches
//! among many; support finds them where the ratio test alone cannot (after the pose clustering of
//! Lowe, IJCV 2004, with affine instead of similarity frames).

use nalgebra::{Matrix2, Vector2};

use super::evidence::{FaceEvidence, Match};

/// Pairs are compared with each other: so many matches at most, the best by ratio.
const MOST_MATCHES: usize = 250;
/// A local map may be off by this share of the distance that it predicts over.
const TOLERANCE: f64 = 0.3;
/// Or by so many pixels.
const TOLERANCE_PX: f64 = 4.0;
/// Frobenius distance of one local map, seen from the other, to the identity.
const MAP_TOLERANCE: f64 = 0.8;
/// Matches supported by fewer others are dropped.
const MIN_SUPPORT: usize = 2;

/// The matches that others support, the best supported first.
pub fn supported(matches: &[Match], evidence: &FaceEvidence<'_>) -> Vec<Match> {
    let mut locals: Vec<Local> = matches
        .iter()
        .filter_map(|one| Local::new(one, evidence.local_map(one)?))
        .collect();
    locals.sort_by(|a, b| a.of.ratio.total_cmp(&b.of.ratio));
    locals.truncate(MOST_MATCHES);
    let mut counted: Vec<(usize, Match)> = locals
        .iter()
        .map(|local| {
            let others = locals.iter().filter(|other| local.supports(other));
            (others.count(), local.of)
        })
        .filter(|(count, _)| *count >= MIN_SUPPORT)
        .collect();
    counted.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
    counted.into_iter().map(|(_, one)| one).collect()
}

/// A match with the affine map of its neighbourhood.
struct Local {
    of: Match,
    map: Matrix2<f64>,
    inverse: Matrix2<f64>,
}

impl Local {
    fn new(of: &Match, map: Matrix2<f64>) -> Option<Self> {
        let inverse = map.try_inverse()?;
        Some(Self {
            of: *of,
            map,
            inverse,
        })
    }

    /// Whether its map predicts where the other match lies and how it is mapped.
    fn supports(&self, other: &Self) -> bool {
        let between: Vector2<f64> = other.of.points.source - self.of.points.source;
        // The same reference point seen twice supports nothing.
        if between.norm_squared() < 1e-12 {
            return false;
        }
        let predicted = self.map * between;
        let error = predicted - (other.of.points.target - self.of.points.target);
        let allowed = TOLERANCE_PX.max(TOLERANCE * predicted.norm());
        error.norm_squared() < allowed * allowed
            && (self.inverse * other.map - Matrix2::identity()).norm() < MAP_TOLERANCE
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation2;

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

    /// True matches of an affine view first, then wrong ones.
    fn scene(good: usize, bad: usize, seed: u64) -> Scene {
        let reference = points(good + bad, 300.0, 300.0, seed);
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

    /// The features of the matches that are supported, the best supported first.
    fn kept(scene: &Scene) -> Vec<u32> {
        let face = face(
            &scene.reference,
            scene.maps.iter().map(frame_seen_as).collect(),
        );
        let evidence = one_each(&scene.image, &scene.ratio);
        let of_face = evidence.of(0, &face);
        let all = of_face.passing(1.0);
        assert_eq!(all.len(), scene.reference.len());
        supported(&all, &of_face)
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
    fn too_few_to_support_each_other() {
        for count in 0..3 {
            assert!(kept(&scene(count, 0, 0)).is_empty());
        }
        assert_eq!(kept(&scene(3, 0, 0)).len(), 3);
    }
}
