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
