//! Exact search: every query is compared with all descriptors of the faces.

use rayon::prelude::*;

use super::blocks::ROWS;
use super::kernel::Kernel;
use super::nearest::{Nearest, Neighbour};
use super::scan::Tiles;
use super::{Candidates, Metric, ReferenceSet};

/// Queries that a thread takes at once: four tiles make use of a panel of references in its cache.
const QUERIES: usize = 32;

/// Ratio of a query of which all k neighbours are at the nearest one's place.
const OPEN: f32 = -1.0;

/// Where and how to look.
#[derive(Debug, Clone, Copy)]
pub struct Search<'a> {
    /// Instruction set.
    pub kernel: Kernel,
    /// How descriptors are compared.
    pub metric: Metric,
    /// Bytes of a descriptor.
    pub length: usize,
    /// All faces of the index.
    pub faces: &'a [ReferenceSet],
    /// Numbers of those to look at, ascending, and at how many of their descriptors, rounded up to
    /// whole blocks.
    pub among: &'a [(u32, usize)],
    /// Only references nearer than this are neighbours: squared distance, or differing bits.
    pub farthest: i32,
}

impl Search<'_> {
    /// The k ≥ 1 nearest of each query, and the ratio to the nearest elsewhere.
    pub fn candidates_into(&self, queries: &[u8], k: usize, found: &mut Candidates) {
        found.reset(queries.len() / self.length, k);
        let neighbours = found
            .face
            .par_chunks_mut(QUERIES * k)
            .zip(found.reference.par_chunks_mut(QUERIES * k))
            .zip(found.distance.par_chunks_mut(QUERIES * k));
        queries
            .par_chunks(QUERIES * self.length)
            .zip(neighbours)
            .zip(found.ratio.par_chunks_mut(QUERIES))
            .for_each_init(
                || {
                    (
                        Tiles::default(),
                        vec![Nearest::new(k, self.farthest); QUERIES],
                    )
                },
                |(tiles, nearest), ((queries, ((face, reference), distance)), ratio)| {
                    self.nearest(queries, tiles, nearest);
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
        self.close_ratios(queries, found);
    }

    /// The nearest of each query of one thread's share.
    fn nearest(&self, queries: &[u8], tiles: &mut Tiles, nearest: &mut [Nearest]) {
        tiles.fill(
            queries.chunks_exact(self.length),
            self.length,
            self.farthest,
        );
        for nearest in nearest.iter_mut() {
            nearest.clear();
        }
        for &(face, first) in self.among {
            let blocks = self.faces[face as usize].blocks();
            tiles.scan(
                (self.kernel, self.metric),
                (face, blocks, first.div_ceil(ROWS)),
                |query, other| {
                    nearest[query].insert(other);
                    nearest[query].limit()
                },
            );
        }
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
    fn close_ratios(&self, queries: &[u8], found: &mut Candidates) {
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
            .flat_map_iter(|(open, first)| self.elsewhere(queries, open, first))
            .collect();
        for (query, closest) in open.into_iter().zip(closest) {
            let distance = closest.map(|d| self.distance(d));
            let nearest = found.distance[query * k];
            found.ratio[query] = distance.map_or(self.beyond(nearest), |d| ratio(nearest, d));
        }
    }

    /// Distances to the nearest that are elsewhere than each query's first neighbour.
    fn elsewhere(
        &self,
        queries: &[u8],
        numbers: &[usize],
        first: &[(u32, u32)],
    ) -> Vec<Option<i32>> {
        let mut tiles = Tiles::default();
        let query = |&number: &usize| &queries[number * self.length..][..self.length];
        tiles.fill(numbers.iter().map(query), self.length, self.farthest);
        let mut closest = vec![None; numbers.len()];
        for &(face, count) in self.among {
            let blocks = self.faces[face as usize].blocks();
            tiles.scan(
                (self.kernel, self.metric),
                (face, blocks, count.div_ceil(ROWS)),
                |query, other| {
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

/// Nearest distance over the nearest elsewhere. Exactly like two places is as ambiguous as can be.
fn ratio(nearest: f32, elsewhere: f32) -> f32 {
    if elsewhere == 0.0 {
        1.0
    } else {
        nearest / elsewhere
    }
}
