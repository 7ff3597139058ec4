//! Votes of queries for faces.

use super::inverted::Postings;
use super::signature::BITS;

/// Signatures that are compared at once.
const CHUNK: usize = 64;
/// Differing bits over which a vote's weight falls to 1 / √e (Jégou et al. use a quarter of 64).
const SIGMA: f64 = 8.0;

/// What queries vote for, one query after the other.
///
/// Weights are whole numbers, so that their sum does not depend on the order.
#[derive(Debug, Clone)]
pub struct Ballot {
    /// Of each face.
    votes: Vec<u64>,
    /// Fewest differing bits of each face, for this query.
    fewest: Vec<u32>,
    /// Faces that have any, for this query.
    marked: Vec<u32>,
    weights: [u64; BITS + 1],
}

impl Ballot {
    /// For so many faces.
    pub fn new(faces: usize) -> Self {
        Self {
            votes: vec![0; faces],
            fewest: vec![u32::MAX; faces],
            marked: Vec::new(),
            weights: std::array::from_fn(|bits| {
                let sigmas = bits as f64 / SIGMA;
                (1e6 * (-0.5 * sigmas * sigmas).exp()) as u64
            }),
        }
    }

    /// Marks the faces that have a descriptor within so many bits of the query's signature.
    pub fn mark(&mut self, signature: u64, postings: &Postings, bits: u32) {
        let chunks = postings.signatures.chunks(CHUNK);
        for (signatures, faces) in chunks.zip(postings.faces.chunks(CHUNK)) {
            let differing = differing(signature, signatures);
            for (&differing, &face) in differing.iter().zip(faces) {
                if u32::from(differing) <= bits {
                    let fewest = &mut self.fewest[face as usize];
                    if *fewest == u32::MAX {
                        self.marked.push(face);
                    }
                    *fewest = (*fewest).min(u32::from(differing));
                }
            }
        }
    }

    /// Counts this query's votes: one a face, however often it has the like (burstiness: Jégou,
    /// Douze and Schmid, CVPR 2009), and less the more faces have it.
    pub fn cast(&mut self) {
        let share = self.marked.len().max(1) as u64;
        for face in self.marked.drain(..) {
            let fewest = &mut self.fewest[face as usize];
            self.votes[face as usize] += self.weights[*fewest as usize] / share;
            *fewest = u32::MAX;
        }
    }

    /// Sum of the votes for each face.
    pub fn into_votes(self) -> Vec<u64> {
        self.votes
    }
}

/// Votes together.
pub fn sum(mut a: Vec<u64>, b: Vec<u64>) -> Vec<u64> {
    for (a, b) in a.iter_mut().zip(b) {
        *a += b;
    }
    a
}

/// Faces with most votes, ascending; none without any.
pub fn most(votes: &[u64], count: usize) -> Vec<u32> {
    let mut faces: Vec<u32> = (0..votes.len() as u32).collect();
    faces.retain(|&face| votes[face as usize] > 0);
    faces.sort_by_key(|&face| (std::cmp::Reverse(votes[face as usize]), face));
    faces.truncate(count);
    faces.sort_unstable();
    faces
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
