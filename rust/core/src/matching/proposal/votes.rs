//! Votes of queries for faces, and where each would put the face.
//!
//! A query and a descriptor like it say how the face is turned, how large it is and where. Those of a
//! face in view agree on that, those of something else do not (Lowe, IJCV 2004; weak geometric
//! consistency: Jégou, Douze and Schmid, ECCV 2008).

use super::inverted::Postings;
use super::signature::BITS;
use crate::matching::{KeypointShape, QueryKeypoint, ReferenceSet};

/// Signatures that are compared at once.
const CHUNK: usize = 64;
/// Differing bits over which a vote's weight falls to 1 / √e (Jégou et al. use a quarter of 64).
const SIGMA: f64 = 8.0;
/// Of a face's votes so many, evenly, are asked how many others agree with them.
const ASKED: usize = 128;
/// How far apart angles \[256ths of a turn\] and sizes \[eighths of an octave\] may be: a tilted face is
/// not only turned and enlarged.
const TURN: u8 = 32;
const SIZE: u8 = 6;
/// How far off another vote may lie, as a share of the distance over which it is predicted …
const TOLERANCE: f32 = 0.4;
/// … and beside that \[px\].
const TOLERANCE_PX: f32 = 8.0;

/// A vote of one query for one face.
///
/// Weights are whole numbers, so that their sum does not depend on the order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vote {
    face: u32,
    /// How the face is turned and how large it is.
    seen: KeypointShape,
    /// Of the descriptor, reference image.
    source: [f32; 2],
    /// Of the query, image.
    target: [f32; 2],
    weight: u64,
}

impl Vote {
    /// A test of whether others, of another place of the face, put it where this one does.
    ///
    /// `radius`: what is closer on the reference is the same place.
    fn agrees(&self, radius: f32) -> impl Fn(&Self) -> bool {
        let (sine, cosine) = self.seen.angle().sin_cos();
        let (scale, this) = (self.seen.scale(), *self);
        move |other| {
            let apart = other.seen.seen_from(this.seen);
            let [x, y] = [0, 1].map(|i| other.source[i] - this.source[i]);
            let predicted = [cosine * x - sine * y, sine * x + cosine * y];
            let error = [0, 1]
                .map(|i| other.target[i] - this.target[i] - scale * predicted[i])
                .map(|v| v * v);
            let distance = x.hypot(y);
            let allowed = TOLERANCE * scale * distance + TOLERANCE_PX;
            distance > radius
                && apart.steps_of_turn() <= TURN
                && apart.steps_of_size() <= SIZE
                && error[0] + error[1] <= allowed * allowed
        }
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
        let share = self.marked.len().max(1) as u64;
        for face in self.marked.drain(..) {
            let nearest = std::mem::replace(&mut self.nearest[face as usize], Nearest::NONE);
            let set = &self.faces[face as usize];
            let reference = nearest.reference as usize;
            self.votes.push(Vote {
                face,
                seen: query.shape.seen_from(set.shapes()[reference]),
                source: set.points()[reference],
                target: query.point,
                weight: self.weights[nearest.bits as usize] / share,
            });
        }
    }

    /// All votes, in the order of the queries.
    pub fn into_votes(self) -> Vec<Vote> {
        self.votes
    }
}

/// The faces with most votes that agree, ascending; none without any.
pub fn most(mut votes: Vec<Vote>, faces: &[ReferenceSet], count: usize) -> Vec<u32> {
    votes.sort_by_key(|vote| vote.face);
    let mut all: Vec<(u64, &[Vote])> = votes
        .chunk_by(|a, b| a.face == b.face)
        .map(|of_face| (of_face.iter().map(|vote| vote.weight).sum(), of_face))
        .collect();
    all.sort_by_key(|&(weight, of_face)| (std::cmp::Reverse(weight), of_face[0].face));
    let mut best: Vec<(u64, u32)> = Vec::new();
    for (weight, of_face) in all {
        // No more than all of its votes agree: what follows is behind, too.
        if best.len() >= count && best[count - 1].0 >= weight {
            break;
        }
        let face = of_face[0].face;
        let score = agreeing(of_face, faces[face as usize].radius());
        if score > 0 {
            let place = best.partition_point(|one| one.0 >= score);
            best.insert(place, (score, face));
        }
    }
    let mut faces: Vec<u32> = best.into_iter().take(count).map(|one| one.1).collect();
    faces.sort_unstable();
    faces
}

/// Largest weight of the votes for one face that agree with one of them: 0 where each stands alone.
fn agreeing(votes: &[Vote], radius: f32) -> u64 {
    let asked = votes.iter().step_by(votes.len().div_ceil(ASKED).max(1));
    let sums = asked.map(|vote| {
        let agrees = vote.agrees(radius);
        let agreeing = votes.iter().filter(|other| agrees(other));
        agreeing.map(|other| other.weight).sum()
    });
    sums.max().unwrap_or(0)
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
