//! One octave's scale space, computed from top to bottom over a band of its rows.
//!
//! All levels advance together, each as soon as the one before it is far enough, so that only the
//! latest rows of each are kept, and these stay in the processor's cache. What is needed of the
//! levels later (gradients, every second pixel for the next octave) is written out on the way.
//! Rows above and below the band are computed as far as its own rows need them; since each row's
//! arithmetic is the same wherever a band begins, the bands change nothing in the result.

use pulp::{Simd, WithSimd};

use super::convolve::{BLOCK, PaddedKernel, TILE, Tile, convolve};
use super::extrema::{BORDER, scan_row};
use super::first_level::FirstLevel;
use super::gradient::pack_row;
use super::kernel::FirstKernel;
use super::refine::{Extremum, Limits, MAX_ROWS, refine};
use super::ring::RowRing;
use crate::GrayImage;

/// Rows of differences below the one that is scanned that the refinement may look at.
const AHEAD: usize = MAX_ROWS + 1;

/// The filters of an octave.
#[derive(Debug)]
pub struct Filters {
    /// To the first level of the first octave.
    pub first: FirstKernel,
    /// From each level to the next.
    pub next: Vec<PaddedKernel>,
}

/// Where an octave's first level comes from.
#[derive(Debug, Clone, Copy)]
pub enum Source<'a> {
    /// The image, to be enlarged and blurred.
    Image(GrayImage<'a>),
    /// The first level itself: rows of the octave's width.
    Level(&'a [f32]),
}

/// Memory for a band of an octave.
#[derive(Debug)]
pub struct BandMemory {
    first: FirstLevel,
    levels: Vec<RowRing>,
    differences: Vec<RowRing>,
    tile: Tile,
    /// What was found in the band's rows, from top to bottom.
    pub extrema: Vec<Extremum>,
}

impl BandMemory {
    /// Memory for rows of `width`; `image_width` of the image if it is the source.
    pub fn new(filters: &Filters, width: usize, image_width: Option<usize>) -> Self {
        let length = width.next_multiple_of(BLOCK);
        let last = RowRing::new(TILE, length);
        let levels = filters.next.len() + 1;
        let rings = filters.next.iter().map(|kernel| {
            // Also the rows above and below of the gradients.
            RowRing::new(2 * kernel.radius().max(1) + TILE, length)
        });
        Self {
            first: image_width.map_or_else(FirstLevel::default, |width| {
                FirstLevel::new(&filters.first, width)
            }),
            levels: rings.chain([last]).collect(),
            // A difference is computed with its coarser level, ahead of the row that is scanned.
            differences: lead(filters)[1..levels]
                .iter()
                .map(|ahead| RowRing::new(AHEAD + ahead + TILE, length))
                .collect(),
            tile: Tile::new(width),
            extrema: Vec::new(),
        }
    }
}

/// What a band writes: its own rows only.
#[derive(Debug)]
pub struct BandOutput<'a> {
    /// Gradients of levels 1…layers, half as many rows, of half the octave's width.
    pub gradients: [Option<&'a mut [u32]>; MAX_LAYERS],
    /// First level of the next octave: every second pixel of every second row.
    pub next_base: &'a mut [f32],
}

/// Largest number of scales an octave.
pub const MAX_LAYERS: usize = 8;
const MAX_LEVELS: usize = MAX_LAYERS + 3;

/// The computation of one band.
pub struct Band<'a> {
    /// Filters of all octaves.
    pub filters: &'a Filters,
    /// What the octave is made from.
    pub source: Source<'a>,
    /// Size of the octave and which extrema are kept.
    pub limits: Limits,
    /// Rows begin…end of the octave; `begin` is even.
    pub rows: (usize, usize),
    /// Its memory.
    pub memory: &'a mut BandMemory,
    /// Its results, besides the extrema.
    pub output: BandOutput<'a>,
}

impl WithSimd for Band<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let levels = self.filters.next.len() + 1;
        let height = self.limits.height;
        let lead = lead(self.filters);
        let (begin, end) = self.rows;
        let start = |i: usize| begin.saturating_sub(lead[i] + 1);
        let mut done: [usize; MAX_LEVELS] = std::array::from_fn(|i| start(i.min(levels - 1)));
        self.memory.extrema.clear();
        self.memory.first.start(&self.filters.first, done[0]);
        // From where the first level has its first row.
        let mut scanned = begin as isize - 2 * lead[0] as isize - 2;
        while scanned < end as isize {
            let target = scanned + TILE as isize;
            for i in 0..levels {
                let until = (target + lead[i] as isize).clamp(0, height as isize) as usize;
                while done[i] < until {
                    let rows = if until - done[i] >= TILE { TILE } else { 1 };
                    self.level_rows(simd, i, done[i], rows);
                    done[i] += rows;
                }
            }
            for y in scanned.max(begin as isize)..target.min(end as isize) {
                self.scan(simd, y as usize);
            }
            scanned = target;
        }
    }
}

/// How many rows each level is ahead of the row that is scanned.
fn lead(filters: &Filters) -> [usize; MAX_LEVELS] {
    let last = filters.next.len();
    let mut lead = [AHEAD; MAX_LEVELS];
    for i in (0..last).rev() {
        lead[i] = lead[i + 1] + filters.next[i].radius();
    }
    lead
}

impl Band<'_> {
    /// Computes rows of level i and what follows from them.
    #[inline(always)]
    fn level_rows<S: Simd>(&mut self, simd: S, i: usize, y: usize, rows: usize) {
        let size = (self.limits.width, self.limits.height);
        if i == 0 {
            for y in y..y + rows {
                self.first_row(simd, y);
            }
            return;
        }
        let (before, after) = self.memory.levels.split_at_mut(i);
        let (source, target) = (&before[i - 1], &mut after[0]);
        let (kernel, tile) = (&self.filters.next[i - 1], &mut self.memory.tile);
        if rows == TILE {
            convolve::<S, TILE>(simd, kernel, source, size, y, tile, target);
        } else {
            convolve::<S, 1>(simd, kernel, source, size, y, tile, target);
        }
        for y in y..y + rows {
            let (fine, coarse) = (source.row(y), target.row(y));
            let difference = self.memory.differences[i - 1].row_mut(y);
            for ((d, &c), &f) in difference.iter_mut().zip(coarse).zip(fine) {
                *d = c - f;
            }
        }
        if (1..=self.limits.layers).contains(&i) {
            for y in y..y + rows {
                self.write_gradients(i, y);
            }
        }
        if i == self.limits.layers {
            for y in y..y + rows {
                self.write_next_base(y);
            }
        }
    }

    #[inline(always)]
    fn first_row<S: Simd>(&mut self, simd: S, y: usize) {
        let width = self.limits.width;
        let row = &mut self.memory.levels[0].row_mut(y)[..width.next_multiple_of(BLOCK)];
        match self.source {
            Source::Image(image) => {
                self.memory
                    .first
                    .row(simd, &self.filters.first, image, y, row);
            }
            Source::Level(level) => {
                row[..width].copy_from_slice(&level[y * width..(y + 1) * width]);
            }
        }
    }

    /// Gradients of the row above y, whose neighbours are complete now.
    #[inline(always)]
    fn write_gradients(&mut self, level: usize, y: usize) {
        let (begin, end) = self.rows;
        let Limits { width, height, .. } = self.limits;
        // The first and the last row of the plane have no gradient.
        let written = begin.max(2) + 1..end.min(2 * height.div_ceil(2) - 2) + 1;
        if y.is_multiple_of(2) || !written.contains(&y) {
            return;
        }
        let ring = &self.memory.levels[level];
        if let Some(plane) = &mut self.output.gradients[level - 1] {
            let (index, columns) = ((y - 1 - begin) / 2, width.div_ceil(2));
            let out = &mut plane[index * columns..(index + 1) * columns];
            pack_row(ring.row(y - 2), ring.row(y - 1), ring.row(y), out);
        }
    }

    #[inline(always)]
    fn write_next_base(&mut self, y: usize) {
        let (begin, end) = self.rows;
        if !(begin..end).contains(&y) || !y.is_multiple_of(2) {
            return;
        }
        let width = self.limits.width;
        let next_width = width.div_ceil(2);
        let index = (y - begin) / 2;
        let out = &mut self.output.next_base[index * next_width..(index + 1) * next_width];
        let row = &self.memory.levels[self.limits.layers].row(y)[..width.next_multiple_of(2)];
        for (value, pair) in out.iter_mut().zip(row.as_chunks::<2>().0) {
            *value = pair[0];
        }
    }

    #[inline(always)]
    fn scan<S: Simd>(&mut self, simd: S, y: usize) {
        let Limits { width, height, .. } = self.limits;
        if y < BORDER || y + BORDER >= height {
            return;
        }
        let differences = self.memory.differences.as_slice();
        // The refined value may be somewhat larger than the sample's.
        let threshold = 0.75 * self.limits.contrast;
        for layer in 1..=self.limits.layers {
            scan_row(simd, differences, (layer, y, width), threshold, |x| {
                let refined = refine(differences, [layer, y, x], &self.limits);
                self.memory.extrema.extend(refined);
            });
        }
    }
}
