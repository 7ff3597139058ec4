//! Going through all descriptors of some faces.

use super::Metric;
use super::blocks::DescriptorBlocks;
use super::kernel::{Kernel, QueryTile, TILE, TileDistances};
use super::nearest::Neighbour;

/// Blocks that all tiles go through before the next ones are fetched: they stay in the processor's
/// second-level cache meanwhile.
const PANEL: usize = 32;

/// A few tiles of queries with their limits.
#[derive(Debug, Clone, Default)]
pub struct Tiles {
    tiles: Vec<QueryTile>,
    limits: Vec<[i32; TILE]>,
}

impl Tiles {
    /// Takes over queries of `length` bytes each; anything nearer than `farthest` is near enough for
    /// them at first.
    pub fn fill<'a>(
        &mut self,
        queries: impl ExactSizeIterator<Item = &'a [u8]>,
        length: usize,
        farthest: i32,
    ) {
        let (count, mut queries) = (queries.len(), queries);
        let tiles = count.div_ceil(TILE);
        self.tiles.resize_with(tiles, QueryTile::default);
        self.limits.clear();
        for (number, tile) in self.tiles.iter_mut().enumerate() {
            tile.fill(queries.by_ref().take(TILE), length);
            let filled = count - number * TILE;
            self.limits
                .push(std::array::from_fn(|lane| match lane < filled {
                    true => farthest,
                    false => i32::MIN,
                }));
        }
    }

    /// Offers each query every descriptor of a face that is below the query's limit, in order.
    ///
    /// Of the face's blocks the first `count` are looked at, if it has as many. `offer` is told the query's number and the neighbour, and answers with the new limit.
    pub fn scan(
        &mut self,
        (kernel, metric): (Kernel, Metric),
        (face, blocks, count): (u32, &DescriptorBlocks, usize),
        mut offer: impl FnMut(usize, Neighbour) -> i32,
    ) {
        let mut found = TileDistances::default();
        let count = count.min(blocks.blocks());
        for panel in (0..count).step_by(PANEL) {
            let end = (panel + PANEL).min(count);
            for (number, (tile, limits)) in self.tiles.iter().zip(&mut self.limits).enumerate() {
                for block in panel..end {
                    kernel.distances(metric, tile, blocks.block(block), limits, &mut found);
                    let below = found.below.map(|bits| bits & blocks.valid(block));
                    if below == [0; TILE] {
                        continue;
                    }
                    for lane in 0..TILE {
                        let row = &found.distance[lane];
                        for i in rows(below[lane]) {
                            if row[i] < limits[lane] {
                                let neighbour = Neighbour {
                                    distance: row[i],
                                    face,
                                    reference: (block * super::blocks::ROWS + i) as u32,
                                };
                                limits[lane] = offer(number * TILE + lane, neighbour);
                            }
                        }
                    }
                }
            }
        }
    }
}

/// The numbers of the bits that are set.
fn rows(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let row = (bits != 0).then(|| bits.trailing_zeros() as usize);
        bits &= bits.wrapping_sub(1);
        row
    })
}
