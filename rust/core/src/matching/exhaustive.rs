//! Exact search: every query is compared with all descriptors of the faces that have its sign.

use rayon::prelude::*;

use super::kernel::Kernel;
use super::nearest::{Nearest, Neighbour};
use super::reference::Group;
use super::scan::Tiles;
use super::{Candidates, Metric, Queries, ReferenceSet};

/// Queries that a thread takes at once: four tiles make use of a panel of references in its cache.
const QUERIES: usize = 32;

/// Ratio of a query of which all k neighbours are at the nearest one's place.
const OPEN: f32 = -1.0;

/// What to look for, where and how.
#[derive(Debug, Clone, Copy)]
pub struct Search<'a> {
    /// Descriptors of the frame.
    pub queries: Queries<'a>,
    /// The numbers of those to look for.
    pub numbers: &'a [u32],
    /// Their sign.
    pub sign: i8,
    /// Instruction set.
    pub kernel: Kernel,
    /// How descriptors are compared.
    pub metric: Metric,
    /// Bytes of a descriptor.
    pub length: usize,
    /// All faces of the index.
    pub faces: &'a [ReferenceSet],
    /// Numbers of those to look at, ascending, and at how many of their descriptors; of those with the
    /// sign whole blocks.
    pub among: &'a [(u32, usize)],
    /// Only references nearer than this are neighbours: squared distance, or differing bits.
    pub farthest: i32,
}

impl Search<'_> {
    /// The k ≥ 1 nearest of each of the numbered queries, and the ratio to the nearest elsewhere.
    pub fn candidates(&self, k: usize) -> Candidates {
        let mut found = Candidates::default();
        found.reset(self.numbers.len(), k);
        let neighbours = found
            .face
            .par_chunks_mut(QUERIES * k)
            .zip(found.reference.par_chunks_mut(QUERIES * k))
            .zip(found.distance.par_chunks_mut(QUERIES * k));
        self.numbers
            .par_chunks(QUERIES)
            .zip(neighbours)
            .zip(found.ratio.par_chunks_mut(QUERIES))
            .for_each_init(
                || {
                    (
                        Tiles::default(),
                        vec![Nearest::new(k, self.farthest); QUERIES],
                    )
                },
                |(tiles, nearest), ((numbers, ((face, reference), distance)), ratio)| {
                    self.nearest(numbers, tiles, nearest);
                    for (query, nearest) in nearest.iter().take(ratio.len()).enumerate() {
                        for (i, neighbour) in (query * k..).zip(nearest.found()) {
                            face[i] = neighbour.face;
                            reference[i] = neighbour.reference;
                            distance[i] = self.distance(neighbour.distance);
                        }
                        ratio[query] = self.ratio(nearest.found(), k);
                    }
                },
            );
        self.close_ratios(&mut found);
        found
    }

    /// The nearest of each query of one thread's share.
    fn nearest(&self, numbers: &[u32], tiles: &mut Tiles, nearest: &mut [Nearest]) {
        self.fill(tiles, numbers.iter());
        for nearest in nearest.iter_mut() {
            nearest.clear();
        }
        for (face, group, blocks) in self.groups() {
            tiles.scan(
                (self.kernel, self.metric),
                (face, group.blocks(), blocks),
                |query, other| {
                    nearest[query].insert(numbered(other, group));
                    nearest[query].limit()
                },
            );
        }
    }

    /// The faces that have descriptors with the sign, these, and how many blocks of them to look at.
    fn groups(&self) -> impl Iterator<Item = (u32, &Group, usize)> {
        self.among.iter().filter_map(|&(face, first)| {
            let group = self.faces[face as usize].with_sign(self.sign)?;
            Some((face, group, group.blocks_of_first(first)))
        })
    }

    fn fill<'a>(&self, tiles: &mut Tiles, numbers: impl ExactSizeIterator<Item = &'a u32>) {
        let queries = numbers.map(|&number| self.queries.of(number, self.length));
        tiles.fill(queries, self.length, self.farthest);
    }

    /// The ratio as far as the k nearest tell it, [`OPEN`] where they do not.
    fn ratio(&self, nearest: &[Neighbour], k: usize) -> f32 {
        let Some(first) = nearest.first() else {
            return f32::INFINITY;
        };
        let elsewhere = nearest
            .iter()
            .find(|other| self.is_elsewhere((first.face, first.reference), other));
        match elsewhere {
            Some(other) => ratio(self.distance(first.distance), self.distance(other.distance)),
            None if nearest.len() < k => self.beyond(self.distance(first.distance)),
            None => OPEN,
        }
    }

    /// Looks for the nearest elsewhere beyond the k nearest, of the queries that need it.
    fn close_ratios(&self, found: &mut Candidates) {
        let ratios = found.ratio.iter().enumerate();
        let open: Vec<usize> = ratios.filter(|r| *r.1 == OPEN).map(|r| r.0).collect();
        let k = found.k;
        let first: Vec<(u32, u32)> = open
            .iter()
            .map(|&query| (found.face[query * k], found.reference[query * k]))
            .collect();
        let closest: Vec<Option<i32>> = open
            .par_chunks(QUERIES)
            .zip(first.par_chunks(QUERIES))
            .flat_map_iter(|(open, first)| self.elsewhere(open, first))
            .collect();
        for (query, closest) in open.into_iter().zip(closest) {
            let distance = closest.map(|d| self.distance(d));
            let nearest = found.distance[query * k];
            found.ratio[query] = distance.map_or(self.beyond(nearest), |d| ratio(nearest, d));
        }
    }

    /// Distances to the nearest that are elsewhere than each query's first neighbour.
    fn elsewhere(&self, open: &[usize], first: &[(u32, u32)]) -> Vec<Option<i32>> {
        let mut tiles = Tiles::default();
        self.fill(&mut tiles, open.iter().map(|&i| &self.numbers[i]));
        let mut closest = vec![None; open.len()];
        for (face, group, blocks) in self.groups() {
            tiles.scan(
                (self.kernel, self.metric),
                (face, group.blocks(), blocks),
                |query, other| {
                    let other = numbered(other, group);
                    if self.is_elsewhere(first[query], &other) {
                        closest[query] = Some(other.distance);
                    }
                    closest[query].unwrap_or(self.farthest)
                },
            );
        }
        closest
    }

    /// The ratio where nothing elsewhere is near: it is at least as far as the farthest neighbour.
    fn beyond(&self, nearest: f32) -> f32 {
        match self.farthest {
            i32::MAX => 0.0,
            farthest => ratio(nearest, self.distance(farthest)),
        }
    }

    fn is_elsewhere(&self, (face, reference): (u32, u32), other: &Neighbour) -> bool {
        let set = &self.faces[face as usize];
        face != other.face || !set.same_place(reference as usize, other.reference as usize)
    }

    fn distance(&self, distance: i32) -> f32 {
        match self.metric {
            Metric::Euclidean => (distance as f32).sqrt(),
            Metric::Hamming => distance as f32,
        }
    }
}

/// A neighbour by its number within the face.
fn numbered(neighbour: Neighbour, group: &Group) -> Neighbour {
    Neighbour {
        reference: group.numbers().get(neighbour.reference as usize),
        ..neighbour
    }
}

/// Nearest distance over the nearest elsewhere. Exactly like two places is as ambiguous as can be.
fn ratio(nearest: f32, elsewhere: f32) -> f32 {
    if elsewhere == 0.0 {
        1.0
    } else {
        nearest / elsewhere
    }
}
