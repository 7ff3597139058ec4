//! Votes of queries for faces, and where each would put the face.
//!
//! The keypoints of a query and of a descriptor like it give a local map from the reference to the
//! frame. The maps of a face in view predict each other's places, those of something else do not
//! (after the pose clustering of Lowe, IJCV 2004, and the weak geometric consistency of Jégou, Douze
//! and Schmid, ECCV 2008).

use std::cmp::Reverse;
use std::collections::HashMap;

use nalgebra::{Matrix2, Vector2};
use rayon::prelude::*;

use super::inverted::Postings;
use super::signature::BITS;
use crate::matching::{QueryKeypoint, ReferenceSet};

/// Signatures that are compared at once.
const CHUNK: usize = 64;
/// Differing bits over which a vote's weight falls to 1 / √e (Jégou et al. use a quarter of 64).
const SIGMA: f64 = 8.0;
/// A query that looks like more faces than these tells none from the others.
const MOST_ALIKE: usize = 32;
/// So many votes of a face are looked at, the heaviest …
const MOST_VOTES: usize = 512;
/// … and of these so many are asked which others they predict.
const ASKED: usize = 128;
/// How far from where it is predicted another vote may lie, as a share of the distance …
const TOLERANCE: f32 = 0.4;
/// … but always \[px\].
const TOLERANCE_PX: f32 = 8.0;
/// Frobenius distance to the identity of one local map, seen from the other.
const MAP_TOLERANCE: f32 = 0.8;
/// Places of a face are never finer than this \[reference px\].
const FINEST_PLACE: f32 = 1.0;

/// A vote of one query for one face.
///
/// Weights are whole numbers, so that their sum does not depend on the order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vote {
    /// Number of the face.
    pub face: u32,
    /// About the keypoint, from the reference to the frame, and back.
    map: Matrix2<f32>,
    inverse: Matrix2<f32>,
    /// Of the descriptor, reference image.
    source: Vector2<f32>,
    /// Of the query, frame.
    target: Vector2<f32>,
    weight: u64,
}

impl Vote {
    /// `None` where the query or the descriptor has no area.
    fn new(
        face: u32,
        (set, reference): (&ReferenceSet, usize),
        query: QueryKeypoint,
        weight: u64,
    ) -> Option<Self> {
        let map = query.frame() * set.frame(reference).try_inverse()?;
        Some(Self {
            face,
            map,
            inverse: map.try_inverse()?,
            source: Vector2::from(set.points()[reference]),
            target: query.place(),
            weight,
        })
    }

    /// Whether another vote, farther than `radius` from here on the reference, lies where this one's
    /// map predicts it, and has about the same map.
    fn predicts(&self, other: &Self, radius: f32) -> bool {
        let between = other.source - self.source;
        let predicted = self.map * between;
        let error = predicted - (other.target - self.target);
        let allowed = (TOLERANCE.powi(2) * predicted.norm_squared()).max(TOLERANCE_PX.powi(2));
        let turned = self.inverse * other.map - Matrix2::identity();
        between.norm_squared() > radius * radius
            && error.norm_squared() <= allowed
            && turned.norm_squared() <= MAP_TOLERANCE.powi(2)
    }
}

/// What queries vote for, one query after the other.
#[derive(Debug, Clone)]
pub struct Ballot<'a> {
    faces: &'a [ReferenceSet],
    votes: Vec<Vote>,
    /// Of each face what is nearest to this query.
    nearest: Vec<Nearest>,
    /// Faces that have any, for this query.
    marked: Vec<u32>,
    weights: [u64; BITS + 1],
}

/// A descriptor of a face and in how many bits it differs.
#[derive(Debug, Clone, Copy)]
struct Nearest {
    bits: u32,
    reference: u32,
}

impl Nearest {
    const NONE: Self = Self {
        bits: u32::MAX,
        reference: u32::MAX,
    };
}

impl<'a> Ballot<'a> {
    /// For these faces.
    pub fn new(faces: &'a [ReferenceSet]) -> Self {
        Self {
            faces,
            votes: Vec::new(),
            nearest: vec![Nearest::NONE; faces.len()],
            marked: Vec::new(),
            weights: std::array::from_fn(|bits| {
                let sigmas = bits as f64 / SIGMA;
                (1e6 * (-0.5 * sigmas * sigmas).exp()) as u64
            }),
        }
    }

    /// Marks the faces that have a descriptor within so many bits of the query's signature.
    pub fn mark(&mut self, signature: u64, postings: &Postings, bits: u32) {
        for (number, signatures) in postings.signatures.chunks(CHUNK).enumerate() {
            let differing = differing(signature, signatures);
            for (i, &differing) in differing[..signatures.len()].iter().enumerate() {
                let differing = u32::from(differing);
                if differing <= bits {
                    let entry = number * CHUNK + i;
                    let face = postings.faces[entry];
                    let nearest = &mut self.nearest[face as usize];
                    if nearest.bits == u32::MAX {
                        self.marked.push(face);
                    }
                    if differing < nearest.bits {
                        *nearest = Nearest {
                            bits: differing,
                            reference: postings.references[entry],
                        };
                    }
                }
            }
        }
    }

    /// Counts this query's votes: one a face, however often it has the like (burstiness: Jégou,
    /// Douze and Schmid, CVPR 2009), and less the more faces have it.
    pub fn cast(&mut self, query: QueryKeypoint) {
        let share = self.marked.len().max(1);
        for face in self.marked.drain(..) {
            let nearest = std::mem::replace(&mut self.nearest[face as usize], Nearest::NONE);
            if share <= MOST_ALIKE {
                let reference = (&self.faces[face as usize], nearest.reference as usize);
                let weight = self.weights[nearest.bits as usize] / share as u64;
                self.votes.extend(Vote::new(face, reference, query, weight));
            }
        }
    }

    /// All votes, in the order of the queries.
    pub fn into_votes(self) -> Vec<Vote> {
        self.votes
    }
}

/// The faces with most votes that agree, ascending; none without any.
pub fn most(mut votes: Vec<Vote>, faces: &[ReferenceSet], count: usize) -> Vec<u32> {
    votes.sort_by_key(|vote| (vote.face, Reverse(vote.weight)));
    let of_faces: Vec<&[Vote]> = votes.chunk_by(|a, b| a.face == b.face).collect();
    let mut scores: Vec<(Reverse<u64>, u32)> = of_faces
        .into_par_iter()
        .map(|votes| {
            let face = votes[0].face;
            let radius = faces[face as usize].radius();
            (Reverse(agreeing(votes, radius)), face)
        })
        .collect();
    scores.retain(|(score, _)| score.0 > 0);
    scores.sort_unstable();
    scores.truncate(count);
    let mut faces: Vec<u32> = scores.into_iter().map(|(_, face)| face).collect();
    faces.sort_unstable();
    faces
}

/// Largest weight of the votes for one face, the heaviest first, that one of them predicts: 0 where each
/// stands alone. Each place of the face counts once.
fn agreeing(votes: &[Vote], radius: f32) -> u64 {
    let votes = &votes[..votes.len().min(MOST_VOTES)];
    let places = places(votes, radius);
    let mut is_counted = vec![false; votes.len()];
    let sums = votes.iter().take(ASKED).map(|asked| {
        is_counted.fill(false);
        let others = votes.iter().zip(&places);
        others
            .filter(|(other, place)| {
                !is_counted[**place] && asked.predicts(other, radius) && {
                    is_counted[**place] = true;
                    true
                }
            })
            .map(|(other, _)| other.weight)
            .sum()
    });
    sums.max().unwrap_or(0)
}

/// A number of the place of each vote on the reference, below the number of votes.
fn places(votes: &[Vote], radius: f32) -> Vec<usize> {
    let mut known = HashMap::new();
    let size = radius.max(FINEST_PLACE);
    let cells = votes
        .iter()
        .map(|vote| vote.source.map(|v| (v / size).floor() as i64));
    cells
        .map(|cell| {
            let next = known.len();
            *known.entry((cell.x, cell.y)).or_insert(next)
        })
        .collect()
}

/// Number of differing bits of up to [`CHUNK`] signatures.
fn differing(signature: u64, signatures: &[u64]) -> [u8; CHUNK] {
    pulp::Arch::new().dispatch(|| {
        let mut counts = [0; CHUNK];
        for (count, other) in counts.iter_mut().zip(signatures) {
            *count = (signature ^ other).count_ones() as u8;
        }
        counts
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::Rotation2;

    use super::*;
    use crate::random::SplitMix64;

    /// An oblique view at 80°, turned.
    fn oblique() -> Matrix2<f32> {
        Rotation2::new(0.8).into_inner() * Matrix2::new(0.17, 0.0, 0.0, 1.0) * 1.5
    }

    fn vote(map: Matrix2<f32>, source: Vector2<f32>, target: Vector2<f32>) -> Vote {
        Vote {
            face: 0,
            map,
            inverse: map.try_inverse().unwrap(),
            source,
            target,
            weight: 10,
        }
    }

    /// Where a view has a place of the face, off by so many pixels along x.
    fn seen(x: f32, y: f32, off: f32) -> Vote {
        let source = Vector2::new(x, y);
        vote(
            oblique(),
            source,
            oblique() * source + Vector2::new(off, 0.0),
        )
    }

    #[test]
    fn a_vote_predicts_what_an_oblique_view_shows_at_any_distance() {
        let asked = seen(10.0, 20.0, 0.0);
        for (x, y) in [(300.0, 20.0), (10.0, 300.0), (-200.0, 150.0), (20.0, 20.0)] {
            assert!(asked.predicts(&seen(x, y, 0.0), 5.0));
        }
        // The same place says nothing.
        assert!(!asked.predicts(&asked, 0.0));
        assert!(!asked.predicts(&seen(14.9, 20.0, 0.0), 5.0));
    }

    #[test]
    fn places_and_maps_may_be_off_by_some_and_no_more() {
        let asked = seen(0.0, 0.0, 0.0);
        let far = Vector2::new(0.0, 200.0);
        let allowed = TOLERANCE * (oblique() * far).norm();
        assert!(allowed > TOLERANCE_PX);
        assert!(asked.predicts(&seen(far.x, far.y, 0.99 * allowed), 5.0));
        assert!(!asked.predicts(&seen(far.x, far.y, 1.01 * allowed), 5.0));
        assert!(asked.predicts(&seen(0.0, 6.0, 0.99 * TOLERANCE_PX), 5.0));
        assert!(!asked.predicts(&seen(0.0, 6.0, 1.01 * TOLERANCE_PX), 5.0));
        for (share, is_alike) in [(0.99, true), (1.01, false)] {
            // Enlarged by f, the map is (f - 1)·√2 from the identity.
            let enlarged = 1.0 + share * MAP_TOLERANCE / 2.0_f32.sqrt();
            let other = vote(enlarged * oblique(), far, oblique() * far);
            assert_eq!(asked.predicts(&other, 5.0), is_alike);
        }
    }

    #[test]
    fn each_place_of_a_face_counts_once() {
        let mut votes = vec![seen(0.0, 0.0, 0.0)];
        votes.extend(std::iter::repeat_n(seen(105.0, 105.0, 0.0), 30));
        assert_eq!(agreeing(&votes, 10.0), 10);
        votes.truncate(1);
        votes.extend([
            seen(105.0, 105.0, 0.0),
            seen(55.0, 5.0, 0.0),
            seen(5.0, 95.0, 0.0),
        ]);
        assert_eq!(agreeing(&votes, 10.0), 30);
        assert_eq!(agreeing(&votes[..1], 10.0), 0);
        assert_eq!(agreeing(&[], 10.0), 0);
    }

    #[test]
    fn few_heavy_votes_are_found_among_many() {
        let mut random = SplitMix64::new(3);
        let mut votes: Vec<Vote> = (0..5)
            .map(|i| seen(30.0 * i as f32, 17.0 * (i % 3) as f32, 0.0))
            .collect();
        votes.extend((0..1000).map(|_| {
            let turn = Rotation2::new(6.3 * random.uniform() as f32).into_inner();
            let mut point = || 400.0 * random.uniform() as f32;
            let places = [
                Vector2::new(point(), point()),
                Vector2::new(point(), point()),
            ];
            Vote {
                weight: 1,
                ..vote(turn, places[0], places[1])
            }
        }));
        // Some of the others agree by chance.
        assert!((40..50).contains(&agreeing(&votes, 10.0)));
    }

    #[test]
    fn what_looks_like_very_many_faces_votes_for_none() {
        let one = |_| {
            let upright = vec![[1.0, 0.0, 0.0, 1.0]];
            ReferenceSet::new(vec![[0.0; 2]], upright, vec![0; 8], 8, 1.0).unwrap()
        };
        let faces: Vec<ReferenceSet> = (0..=MOST_ALIKE).map(one).collect();
        let query = QueryKeypoint {
            point: [5.0; 2],
            scale: 2.0,
            angle: 0.5,
        };
        for (count, expected) in [(MOST_ALIKE, MOST_ALIKE), (MOST_ALIKE + 1, 0)] {
            let postings = Postings {
                signatures: vec![7; count],
                faces: (0..count as u32).collect(),
                references: vec![0; count],
            };
            let mut ballot = Ballot::new(&faces);
            ballot.mark(7, &postings, 0);
            ballot.cast(query);
            assert_eq!(ballot.into_votes().len(), expected);
        }
    }

    #[test]
    fn a_keypoint_without_an_area_has_no_vote() {
        let set =
            |frame| ReferenceSet::new(vec![[0.0; 2]], vec![frame], vec![0; 8], 8, 1.0).unwrap();
        let query = |scale| QueryKeypoint {
            point: [5.0; 2],
            scale,
            angle: 0.5,
        };
        let vote = |frame, scale| Vote::new(0, (&set(frame), 0), query(scale), 1);
        assert!(vote([1.0, 0.0, 0.0, 1.0], 2.0).is_some());
        assert_eq!(vote([1.0, 0.0, 0.0, 1.0], 0.0), None);
        assert_eq!(vote([1.0, 1.0, 1.0, 1.0], 2.0), None);
    }
}
