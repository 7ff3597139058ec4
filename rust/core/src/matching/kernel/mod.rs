//! Distances of several queries to a block of descriptors at once, by what the processor offers.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
#[cfg(target_arch = "aarch64")]
mod neon;
mod portable;

use super::Metric;
use super::blocks::{Lanes, ROWS, squared_norm, words};

/// Queries in a tile.
pub const TILE: usize = 8;

/// A few queries that go through the references together, so that each reference is loaded once
/// for all of them.
#[derive(Debug, Clone, Default)]
pub struct QueryTile {
    /// Four bytes of each query at a time.
    words: Vec<[u32; TILE]>,
    /// Squared norm of each query.
    norms: [i32; TILE],
    /// Sum of each query's bytes.
    sums: [i32; TILE],
    /// Whether a byte is larger than 127.
    wide: bool,
}

impl QueryTile {
    /// Takes over up to [`TILE`] queries of `length` bytes each; missing ones are zeros.
    pub fn fill<'a>(&mut self, queries: impl Iterator<Item = &'a [u8]>, length: usize) {
        self.words.clear();
        self.words.resize(length.div_ceil(4), [0; TILE]);
        self.norms = [0; TILE];
        self.sums = [0; TILE];
        self.wide = false;
        for (lane, query) in queries.take(TILE).enumerate() {
            for (column, word) in self.words.iter_mut().zip(words(query)) {
                column[lane] = word;
            }
            self.norms[lane] = squared_norm(query);
            self.sums[lane] = query.iter().map(|&byte| i32::from(byte)).sum();
            // Without an end at the first such byte, several are looked at at a time.
            self.wide |= query.iter().fold(0, |bits, byte| bits | byte) > 127;
        }
    }

    /// What the squared distance has of the query alone: with r' = r - 128 as it is stored,
    /// |q - r|² = (|q|² - 256·Σq) + |r|² - 2·q·r'.
    fn offset(&self, query: usize) -> i32 {
        self.norms[query] - 256 * self.sums[query]
    }
}

/// What a kernel finds for a tile and a block.
#[repr(C, align(64))]
#[derive(Debug, Clone)]
pub struct TileDistances {
    /// Squared Euclidean distances or numbers of differing bits.
    pub distance: [[i32; ROWS]; TILE],
    /// Bits of the rows that are below the query's limit.
    pub below: [u32; TILE],
}

impl Default for TileDistances {
    fn default() -> Self {
        Self {
            distance: [[0; ROWS]; TILE],
            below: [0; TILE],
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Level {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    AvxVnni,
    #[cfg(target_arch = "x86_64")]
    Avx512,
    #[cfg(target_arch = "aarch64")]
    Neon,
}

/// An instruction set that this processor has. All give equal numbers, at different speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kernel(Level);

impl Kernel {
    /// All that this processor can run, slowest first.
    pub fn available() -> Vec<Self> {
        #[cfg_attr(
            not(any(target_arch = "x86_64", target_arch = "aarch64")),
            allow(unused_mut)
        )]
        let mut levels = vec![Self(Level::Portable)];
        #[cfg(target_arch = "x86_64")]
        {
            use std::arch::is_x86_feature_detected as has;
            if has!("avx2") {
                levels.push(Self(Level::Avx2));
            }
            if has!("avx2") && has!("avxvnni") {
                levels.push(Self(Level::AvxVnni));
            }
            if has!("avx512f") && has!("avx512vnni") && has!("avx512vpopcntdq") {
                levels.push(Self(Level::Avx512));
            }
        }
        #[cfg(target_arch = "aarch64")]
        if std::arch::is_aarch64_feature_detected!("neon") {
            levels.push(Self(Level::Neon));
        }
        levels
    }

    /// The fastest.
    pub fn best() -> Self {
        Self::available().pop().unwrap_or(Self(Level::Portable))
    }

    /// Distances of a tile of queries to a block with the squared norms of its descriptors.
    pub fn distances(
        self,
        metric: Metric,
        tile: &QueryTile,
        (block, norms): (&[Lanes], &Lanes),
        limits: &[i32; TILE],
        found: &mut TileDistances,
    ) {
        match (self.0, metric) {
            (Level::Portable, Metric::Euclidean) => {
                portable::euclidean(tile, block, norms, limits, found);
            }
            (Level::Portable, Metric::Hamming) => portable::hamming(tile, block, limits, found),
            // SAFETY: a level is made by `available` only, which asked the processor for it.
            #[cfg(target_arch = "x86_64")]
            (Level::Avx2, Metric::Euclidean) => unsafe {
                avx2::euclidean(tile, block, norms, limits, found);
            },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            (Level::AvxVnni, Metric::Euclidean) => unsafe {
                avx2::euclidean_vnni(tile, block, norms, limits, found);
            },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            (Level::Avx2 | Level::AvxVnni, Metric::Hamming) => unsafe {
                avx2::hamming(tile, block, limits, found);
            },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            (Level::Avx512, Metric::Euclidean) => unsafe {
                avx512::euclidean(tile, block, norms, limits, found);
            },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            (Level::Avx512, Metric::Hamming) => unsafe {
                avx512::hamming(tile, block, limits, found);
            },
            // SAFETY: as above.
            #[cfg(target_arch = "aarch64")]
            (Level::Neon, Metric::Euclidean) => unsafe {
                neon::euclidean(tile, block, norms, limits, found);
            },
            // SAFETY: as above.
            #[cfg(target_arch = "aarch64")]
            (Level::Neon, Metric::Hamming) => unsafe {
                neon::hamming(tile, block, limits, found);
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matching::blocks::DescriptorBlocks;
    use crate::random::SplitMix64;

    fn bytes(count: usize, largest: usize, random: &mut SplitMix64) -> Vec<u8> {
        (0..count)
            .map(|_| random.index(largest + 1) as u8)
            .collect()
    }

    fn expected(metric: Metric, a: &[u8], b: &[u8]) -> i32 {
        let pairs = a.iter().zip(b);
        match metric {
            Metric::Euclidean => pairs.map(|(a, b)| i32::from(a.abs_diff(*b)).pow(2)).sum(),
            Metric::Hamming => pairs.map(|(a, b)| (a ^ b).count_ones() as i32).sum(),
        }
    }

    fn check(kernel: Kernel, metric: Metric, queries: &[u8], references: &[u8], length: usize) {
        let blocks = DescriptorBlocks::new(references, length);
        let mut tile = QueryTile::default();
        tile.fill(queries.chunks_exact(length), length);
        let mut found = TileDistances::default();
        let limit = length as i32 * if metric == Metric::Hamming { 4 } else { 10_000 };
        kernel.distances(metric, &tile, blocks.block(0), &[limit; TILE], &mut found);
        for (i, q) in queries.chunks_exact(length).enumerate() {
            for (j, r) in references.chunks_exact(length).enumerate() {
                let distance = expected(metric, q, r);
                let seen = (found.distance[i][j], found.below[i] >> j & 1 == 1);
                let true_one = (distance, distance < limit);
                assert_eq!(seen, true_one, "{kernel:?} {metric:?} {length} {i} {j}");
            }
        }
    }

    #[test]
    fn every_level_gives_the_distances_of_the_definition() {
        // Miri, which looks for undefined behaviour, is a thousand times slower.
        let lengths: &[usize] = match cfg!(miri) {
            true => &[1, 9],
            false => &[1, 4, 32, 61, 64, 128, 200, 1025],
        };
        let mut random = SplitMix64::new(7);
        for kernel in Kernel::available() {
            for metric in [Metric::Euclidean, Metric::Hamming] {
                for &length in lengths {
                    for largest in [127, 255] {
                        let queries = bytes(TILE * length, largest, &mut random);
                        let references = bytes(ROWS * length, largest, &mut random);
                        check(kernel, metric, &queries, &references, length);
                    }
                }
            }
        }
    }

    #[test]
    fn every_level_is_exact_at_the_ends_of_the_range() {
        let length = if cfg!(miri) { 12 } else { 132 };
        for kernel in Kernel::available() {
            for metric in [Metric::Euclidean, Metric::Hamming] {
                for (a, b) in [
                    (0, 255),
                    (255, 0),
                    (255, 255),
                    (127, 0),
                    (127, 255),
                    (128, 0),
                ] {
                    let (queries, references) = (vec![a; TILE * length], vec![b; ROWS * length]);
                    check(kernel, metric, &queries, &references, length);
                }
            }
        }
    }

    #[test]
    fn the_best_level_is_the_last_available() {
        assert_eq!(Some(&Kernel::best()), Kernel::available().last());
    }
}
