//! One octave: its memory, and its bands run in parallel.

use pulp::Arch;

use super::band::{Band, BandMemory, BandOutput, Filters, MAX_LAYERS, Source};
use super::extrema::BORDER;
use super::gradient::GradientPlane;
use super::refine::Limits;

/// Fewer rows than this are not worth a band of their own: the rows around a band that it needs
/// as well are about 40 on either side.
const MIN_BAND_ROWS: usize = 96;

/// Memory of one octave.
#[derive(Debug)]
pub struct Octave {
    /// Distance of its pixels [px of the image].
    pub step: f32,
    limits: Limits,
    band_rows: usize,
    bands: Vec<BandMemory>,
    /// Gradients of levels 1…layers.
    pub gradients: Vec<GradientPlane>,
    next_base: Vec<f32>,
}

impl Octave {
    /// Memory for an octave whose size and limits are `limits`; `image_width` of the image if the
    /// octave is made from it directly.
    pub fn new(
        filters: &Filters,
        limits: Limits,
        step: f32,
        image_width: Option<usize>,
        threads: usize,
    ) -> Self {
        let Limits { width, height, .. } = limits;
        let count = (height / MIN_BAND_ROWS).clamp(1, threads);
        // Even, so that the next octave's rows are divided too.
        let band_rows = height.div_ceil(count).next_multiple_of(2);
        let plane = || GradientPlane {
            width: width.div_ceil(2),
            height: height.div_ceil(2),
            values: vec![0; width.div_ceil(2) * height.div_ceil(2)],
        };
        Self {
            step,
            limits,
            band_rows,
            bands: (0..height.div_ceil(band_rows))
                .map(|_| BandMemory::new(filters, width, image_width))
                .collect(),
            gradients: (0..limits.layers).map(|_| plane()).collect(),
            next_base: vec![0.0; width.div_ceil(2) * height.div_ceil(2)],
        }
    }

    /// Computes the octave's gradients, its extrema and the next octave's first level.
    pub fn compute(&mut self, arch: Arch, filters: &Filters, source: Source) {
        let mut planes = self.gradients.iter_mut().map(|p| p.values.as_mut_slice());
        let output = BandOutput {
            gradients: std::array::from_fn(|_| planes.next()),
            next_base: &mut self.next_base,
        };
        let shared = Shared {
            arch,
            filters,
            source,
            limits: self.limits,
            band_rows: self.band_rows,
        };
        run(&shared, &mut self.bands, 0, output);
    }

    /// First level of the next octave.
    pub fn next_base(&self) -> &[f32] {
        &self.next_base
    }

    /// Extrema from top to bottom.
    pub fn extrema(&self) -> impl Iterator<Item = &super::refine::Extremum> {
        self.bands.iter().flat_map(|band| &band.extrema)
    }
}

/// Sizes of the octaves of an image [px], from the finest, as long as extrema fit in.
pub fn sizes(
    (width, height): (usize, usize),
    doubled: bool,
) -> impl Iterator<Item = (usize, usize)> {
    let factor = if doubled { 2 } else { 1 };
    let first = (width * factor, height * factor);
    std::iter::successors(Some(first), |&(w, h)| Some((w.div_ceil(2), h.div_ceil(2))))
        .take_while(|&(w, h)| w.min(h) > 2 * BORDER)
}

/// What all bands of an octave have in common.
struct Shared<'a> {
    arch: Arch,
    filters: &'a Filters,
    source: Source<'a>,
    limits: Limits,
    band_rows: usize,
}

/// Runs bands, the first of which begins at row `begin`, and of which `output` holds the rows.
fn run(shared: &Shared, bands: &mut [BandMemory], begin: usize, output: BandOutput) {
    match bands {
        [] => {}
        [memory] => shared.arch.dispatch(Band {
            filters: shared.filters,
            source: shared.source,
            limits: shared.limits,
            rows: (begin, (begin + shared.band_rows).min(shared.limits.height)),
            memory,
            output,
        }),
        _ => {
            let (upper, lower) = bands.split_at_mut(bands.len() / 2);
            let rows = upper.len() * shared.band_rows;
            let (above, below) = split(output, rows, shared.limits.width);
            rayon::join(
                || run(shared, upper, begin, above),
                || run(shared, lower, begin + rows, below),
            );
        }
    }
}

/// The first `rows` rows and the others.
fn split(output: BandOutput, rows: usize, width: usize) -> (BandOutput, BandOutput) {
    let (above, below) = output.next_base.split_at_mut(rows / 2 * width.div_ceil(2));
    let mut halves = output
        .gradients
        .map(|plane| plane.map(|values| values.split_at_mut(rows / 2 * width.div_ceil(2))));
    let mut lower: [Option<&mut [u32]>; MAX_LAYERS] = [const { None }; MAX_LAYERS];
    let upper = std::array::from_fn(|i| {
        halves[i].take().map(|(up, low)| {
            lower[i] = Some(low);
            up
        })
    });
    (
        BandOutput {
            gradients: upper,
            next_base: above,
        },
        BandOutput {
            gradients: lower,
            next_base: below,
        },
    )
}
