//! SIFT (Lowe, IJCV 2004) with RootSIFT descriptors (Arandjelović & Zisserman, CVPR 2012).
//!
//! [`Sift::extract`] goes through the stages in order: [`octave`] (scale space, gradients and
//! extrema in one pass, see [`band`]), [`orientation`], [`crate::budget`], [`descriptor`].

pub mod band;
pub mod config;
pub mod convolve;
pub mod descriptor;
pub mod extrema;
pub mod first_level;
pub mod gradient;
pub mod kernel;
pub mod octave;
pub mod orientation;
pub mod refine;
pub mod ring;
pub mod sampling;
pub mod simd;

pub use config::SiftConfig;
pub use descriptor::LENGTH;

use pulp::Arch;
use rayon::prelude::*;

use crate::budget::Budget;
use crate::{GrayImage, InputError, Keypoint};
use band::{Filters, Source};
use convolve::PaddedKernel;
use descriptor::{Describe, DescriptorPattern};
use kernel::FirstKernel;
use octave::Octave;
use orientation::{FindOrientations, OrientationPattern, Orientations};
use refine::{Extremum, Limits};

/// Largest side of an image [px].
const MAX_SIDE: usize = 1 << 16;
/// Largest image [px]: 8192 × 8192, for which 2 GB are needed.
const MAX_PIXELS: usize = 1 << 26;
/// Keypoints that a thread takes at once.
const CHUNK: usize = 32;

/// Keypoints of an image and their descriptors.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SiftFeatures {
    /// From the finest octave to the coarsest, within it from top to bottom. `scale` is twice the
    /// keypoint's σ; a place with several orientations occurs with each.
    pub keypoints: Vec<Keypoint>,
    /// One a keypoint: unit vectors in units of 1/255, at most 127 (see [`descriptor`]).
    pub descriptors: Vec<[u8; LENGTH]>,
}

/// Finds and describes keypoints; keeps its memory for the next image of the same size.
///
/// Runs on the threads of the current rayon pool; their number does not change the result.
#[derive(Debug)]
pub struct Sift {
    config: SiftConfig,
    arch: Arch,
    filters: Filters,
    around: OrientationPattern,
    pattern: DescriptorPattern,
    workspace: Workspace,
    features: SiftFeatures,
}

/// Memory for images of one size.
#[derive(Debug, Default)]
struct Workspace {
    size: (usize, usize),
    threads: usize,
    octaves: Vec<Octave>,
    found: Vec<Located>,
    orientations: Vec<Orientations>,
    oriented: Vec<Keypoint>,
    /// Which of `found` each of `oriented` is.
    origins: Vec<u32>,
    chosen: Vec<Located>,
    budget: Budget,
}

/// An extremum and the index of its octave.
#[derive(Debug, Clone, Copy)]
struct Located {
    octave: u32,
    extremum: Extremum,
}

impl Sift {
    /// An extractor.
    ///
    /// # Errors
    /// [`InputError::OutOfRange`] for a setting outside of its range.
    pub fn new(config: SiftConfig) -> Result<Self, InputError> {
        config.check()?;
        let sigma = config.sigma;
        let blurs = kernel::increments(sigma, config.octave_layers);
        let filters = Filters {
            first: FirstKernel::new(sigma, config.double_first_octave),
            next: blurs
                .into_iter()
                .map(|blur| PaddedKernel::new(&kernel::gaussian(blur)))
                .collect(),
        };
        Ok(Self {
            config,
            arch: Arch::new(),
            filters,
            around: OrientationPattern::default(),
            pattern: DescriptorPattern::default(),
            workspace: Workspace::default(),
            features: SiftFeatures::default(),
        })
    }

    /// The settings.
    pub fn config(&self) -> &SiftConfig {
        &self.config
    }

    /// Features of an image; none where it is too small for any.
    ///
    /// # Errors
    /// [`InputError::OutOfRange`] for an image of more than 65 536 px along one side or 2²⁶ px.
    pub fn extract(&mut self, image: GrayImage) -> Result<&SiftFeatures, InputError> {
        self.prepare(image.width(), image.height())?;
        self.compute_octaves(image);
        self.locate();
        self.orient();
        self.choose();
        self.describe();
        Ok(&self.features)
    }

    /// Memory for an image of this size.
    fn prepare(&mut self, width: usize, height: usize) -> Result<(), InputError> {
        check_size(width, height)?;
        let threads = rayon::current_num_threads();
        let work = &mut self.workspace;
        if (work.size, work.threads) == ((width, height), threads) {
            return Ok(());
        }
        let doubled = self.config.double_first_octave;
        let first_step = if doubled { 0.5 } else { 1.0 };
        // The old memory is released before the new is taken.
        work.octaves.clear();
        let filters = &self.filters;
        let limits = |(width, height)| Limits {
            width,
            height,
            layers: self.config.octave_layers,
            contrast: (self.config.contrast_threshold * 255.0 / self.config.octave_layers as f64)
                as f32,
            edge: self.config.edge_threshold as f32,
        };
        let octaves = octave::sizes((width, height), doubled).enumerate();
        work.octaves.extend(octaves.map(|(o, size)| {
            let step = first_step * (o as f32).exp2();
            let image_width = (o == 0).then_some(width);
            Octave::new(filters, limits(size), step, image_width, threads)
        }));
        (work.size, work.threads) = ((width, height), threads);
        Ok(())
    }

    fn compute_octaves(&mut self, image: GrayImage) {
        let mut source = Source::Image(image);
        for octave in &mut self.workspace.octaves {
            octave.compute(self.arch, &self.filters, source);
            source = Source::Level(octave.next_base());
        }
    }

    /// Gathers the octaves' extrema, without those that several samples led to.
    fn locate(&mut self) {
        let work = &mut self.workspace;
        work.found.clear();
        for (o, octave) in work.octaves.iter().enumerate() {
            let begin = work.found.len();
            work.found.extend(octave.extrema().map(|&extremum| Located {
                octave: o as u32,
                extremum,
            }));
            let key = |located: &Located| {
                let [layer, y, x] = located.extremum.sample;
                [y, x, layer]
            };
            work.found[begin..].sort_unstable_by_key(key);
        }
        work.found
            .dedup_by_key(|located| (located.octave, located.extremum.sample));
    }

    /// Gives each extremum its orientations.
    fn orient(&mut self) {
        let work = &mut self.workspace;
        let (octaves, arch, pattern) = (&work.octaves, self.arch, &self.around);
        let base_sigma = self.config.sigma as f32;
        let layers = self.config.octave_layers as f32;
        let sigma = |e: &Extremum| base_sigma * (e.layer / layers).exp2();
        work.orientations
            .resize(work.found.len(), Orientations::default());
        work.orientations
            .par_iter_mut()
            .zip(&work.found)
            .with_min_len(CHUNK)
            .for_each(|(orientations, Located { octave, extremum })| {
                *orientations = arch.dispatch(FindOrientations {
                    pattern,
                    plane: plane(octaves, *octave, extremum),
                    center: (0.5 * extremum.x, 0.5 * extremum.y),
                    sigma: 0.5 * sigma(extremum),
                });
            });
        work.oriented.clear();
        work.origins.clear();
        for (i, (located, found)) in work.found.iter().zip(&work.orientations).enumerate() {
            let (step, e) = (octaves[located.octave as usize].step, &located.extremum);
            for &angle in found.as_slice() {
                work.origins.push(i as u32);
                work.oriented.push(Keypoint {
                    x: e.x * step,
                    y: e.y * step,
                    scale: 2.0 * sigma(e) * step,
                    angle,
                    response: e.response,
                    sign: if e.is_maximum { 1 } else { -1 },
                });
            }
        }
    }

    /// Keeps as many keypoints as the budget allows.
    fn choose(&mut self) {
        let work = &mut self.workspace;
        let kept = work
            .budget
            .spread(&work.oriented, self.config.max_features, work.size);
        let keypoints = &mut self.features.keypoints;
        keypoints.clear();
        work.chosen.clear();
        for &i in kept {
            keypoints.push(work.oriented[i as usize]);
            work.chosen
                .push(work.found[work.origins[i as usize] as usize]);
        }
    }

    fn describe(&mut self) {
        let SiftFeatures {
            keypoints,
            descriptors,
        } = &mut self.features;
        descriptors.resize(keypoints.len(), [0; LENGTH]);
        let (octaves, arch, pattern) = (&self.workspace.octaves, self.arch, &self.pattern);
        descriptors
            .par_iter_mut()
            .zip(&*keypoints)
            .zip(&self.workspace.chosen)
            .with_min_len(CHUNK)
            .for_each(|((out, keypoint), Located { octave, extremum })| {
                arch.dispatch(Describe {
                    pattern,
                    plane: plane(octaves, *octave, extremum),
                    center: (0.5 * extremum.x, 0.5 * extremum.y),
                    sigma: 0.25 * keypoint.scale / octaves[*octave as usize].step,
                    angle: keypoint.angle,
                    out,
                });
            });
    }
}

/// Gradients of the level next to an extremum.
fn plane<'a>(
    octaves: &'a [Octave],
    octave: u32,
    extremum: &Extremum,
) -> &'a gradient::GradientPlane {
    &octaves[octave as usize].gradients[extremum.sample[0] as usize - 1]
}

fn check_size(width: usize, height: usize) -> Result<(), InputError> {
    let check = |name, value: usize, most: usize, valid| {
        if value <= most {
            return Ok(());
        }
        Err(InputError::OutOfRange {
            name,
            value: value as f64,
            valid,
        })
    };
    check("width", width, MAX_SIDE, "at most 65536 px")?;
    check("height", height, MAX_SIDE, "at most 65536 px")?;
    check(
        "width × height",
        width * height,
        MAX_PIXELS,
        "at most 2²⁶ px",
    )
}
