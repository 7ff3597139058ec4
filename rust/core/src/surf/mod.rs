//! SURF: speeded-up robust features (Bay, Ess, Tuytelaars & Van Gool, CVIU 2008).
//!
//! Blobs are maxima of the determinant of the Hessian, whose second derivatives are box filters on
//! an integral image; they are described by sums of Haar wavelets. Where we go another way than
//! the paper:
//! - A wavelet of side 2s is a difference of means over s × s. Means are taken once for the whole
//!   image, and each neighbourhood samples them bilinearly on its turned and scaled grid: the
//!   wavelets turn with it, and nothing is rounded to whole pixels.
//! - A wavelet counts for the fields around it by how near their centres are, instead of for one.
//! - Descriptors are normalised by the sum of their absolute values, and the root of each is taken,
//!   with its sign: as for SIFT (Arandjelović & Zisserman, CVPR 2012), a few strong gradients count
//!   less. Of mutual nearest neighbours, more are right, above all for 128 numbers.
//! - The sign of the Laplacian is not kept: descriptors of bright and dark blobs are far apart.
//! - Descriptors are bytes, see [`SurfFeatures::descriptors`].
//!
//! The results are the same for any number of threads.
//!
//! This module is behind the feature `surf`, which is off by default: SURF was patented (US 8 165
//! 401, EP 1 850 270, both by now at the end of their terms), and who builds this crate should
//! decide for themselves.

mod config;
mod descriptor;
mod extrema;
mod hessian;
mod integral;
mod orientation;
mod patch;
mod smoothed;
#[cfg(test)]
mod tests;

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

pub use config::SurfConfig;

use crate::budget::Budget;
use crate::{GrayImage, InputError, Keypoint};
use descriptor::Descriptor;
use extrema::BandOfKeypoints;
use hessian::{ColumnSums, Octave};
use integral::Integral;
use orientation::Orientation;
use smoothed::Pyramid;

/// Keypoints described by one task.
const BATCH: usize = 16;

/// Features of one image.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SurfFeatures {
    /// Keypoints; their scale is the side 20 s of the square that is described, s the standard
    /// deviation that the filter stands for, and their response the determinant of the Hessian.
    pub keypoints: Vec<Keypoint>,
    /// One descriptor a keypoint, 64 or 128 bytes each, compared by Euclidean distance. A byte is
    /// 64 plus 127 times a number of the descriptor of length 1, within 0…127: the offset cancels
    /// out, and numbers beyond ±½ hardly occur.
    pub descriptors: Vec<u8>,
}

/// Extracts features, and keeps the memory for it from image to image.
#[derive(Debug)]
pub struct Surf {
    config: SurfConfig,
    orientation: Orientation,
    descriptor: Descriptor,
    integral: Integral,
    octaves: Vec<Octave>,
    sums: Vec<ColumnSums>,
    bands: Vec<BandOfKeypoints>,
    found: Vec<Keypoint>,
    budget: Budget,
    pyramid: Pyramid,
    features: SurfFeatures,
}

impl Surf {
    /// An extractor with these settings.
    ///
    /// # Errors
    /// [`InputError::OutOfRange`] for a setting outside of its range.
    pub fn new(config: SurfConfig) -> Result<Self, InputError> {
        config.check()?;
        let octave = |number: usize| Octave {
            step: 1 << number,
            sizes: (0..config.octave_layers + 2)
                .map(|layer| hessian::filter_size(number, layer))
                .collect(),
            layers: vec![Vec::new(); config.octave_layers + 2],
            ..Octave::default()
        };
        Ok(Self {
            config,
            orientation: Orientation::new(),
            descriptor: Descriptor::new(),
            integral: Integral::default(),
            octaves: (0..config.octaves).map(octave).collect(),
            sums: Vec::new(),
            bands: Vec::new(),
            found: Vec::new(),
            budget: Budget::default(),
            pyramid: Pyramid::default(),
            features: SurfFeatures::default(),
        })
    }

    /// The settings.
    pub fn config(&self) -> &SurfConfig {
        &self.config
    }

    /// The features of an image, by octave, band of rows, layer and row.
    pub fn extract(&mut self, image: GrayImage<'_>) -> &SurfFeatures {
        let size = (image.width(), image.height());
        self.integral.compute(image);
        self.found.clear();
        for number in 0..self.octaves.len() {
            let (finer, rest) = self.octaves.split_at_mut(number);
            hessian::compute(&self.integral, &mut rest[0], finer.last(), &mut self.sums);
            let threshold = self.config.hessian_threshold;
            extrema::find(&rest[0], size, threshold, &mut self.bands, &mut self.found);
        }
        let kept = self
            .budget
            .spread(&self.found, self.config.max_features, size);
        let keypoints = kept.iter().map(|&i| self.found[i as usize]);
        self.features.keypoints.clear();
        self.features.keypoints.extend(keypoints);
        self.pyramid.compute(&self.integral, self.config.octaves);
        self.describe();
        &self.features
    }

    /// Orientations and descriptors of all keypoints.
    fn describe(&mut self) {
        let length = self.config.descriptor_length();
        let SurfFeatures {
            keypoints,
            descriptors,
        } = &mut self.features;
        descriptors.resize(keypoints.len() * length, 0);
        let keypoints = keypoints.par_chunks_mut(BATCH);
        let batches = keypoints.zip(descriptors.par_chunks_mut(BATCH * length));
        batches.for_each(|(keypoints, descriptors)| {
            Arch::new().dispatch(Batch {
                keypoints,
                descriptors,
                length,
                pyramid: &self.pyramid,
                orientation: (!self.config.upright).then_some(&self.orientation),
                descriptor: &self.descriptor,
            });
        });
    }
}

/// Some keypoints and what describes them.
struct Batch<'a> {
    keypoints: &'a mut [Keypoint],
    descriptors: &'a mut [u8],
    length: usize,
    pyramid: &'a Pyramid,
    orientation: Option<&'a Orientation>,
    descriptor: &'a Descriptor,
}

impl WithSimd for Batch<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let descriptors = self.descriptors.chunks_exact_mut(self.length);
        for (keypoint, bytes) in self.keypoints.iter_mut().zip(descriptors) {
            let image = self.pyramid.at(keypoint.scale / descriptor::DIAMETER);
            if let Some(orientation) = self.orientation {
                keypoint.angle = orientation.of(keypoint, image);
            }
            self.descriptor.describe(keypoint, image, bytes);
        }
    }
}
