//! SURF against blobs of known place and size, and against itself in turned images.

#![allow(clippy::unwrap_used)]

use std::f32::consts::{FRAC_PI_2, PI};

use super::*;
use crate::random::SplitMix64;

/// An image and its size.
struct Picture {
    width: usize,
    height: usize,
    pixels: Vec<u8>,
}

impl Picture {
    fn new(width: usize, height: usize, gray: impl Fn(f32, f32) -> f32) -> Self {
        let at = |i: usize| gray((i % width) as f32, (i / width) as f32);
        let pixels = (0..width * height).map(|i| at(i).round() as u8).collect();
        Self {
            width,
            height,
            pixels,
        }
    }

    /// Blobs of both signs, of many sizes, anywhere: something to describe.
    fn blobs(width: usize, height: usize) -> Self {
        let mut random = SplitMix64::new(1);
        let mut unit = || random.uniform() as f32;
        let blobs: Vec<[f32; 5]> = (0..width * height / 300)
            .map(|_| {
                let (x, y) = (width as f32 * unit(), height as f32 * unit());
                [
                    x,
                    y,
                    1.5 + 6.0 * unit() * unit(),
                    120.0 * unit() - 60.0,
                    unit(),
                ]
            })
            .collect();
        Self::new(width, height, |x, y| {
            let sum: f32 = blobs
                .iter()
                .map(|[bx, by, sigma, height, skew]| {
                    let (dx, dy) = (x - bx + skew * (y - by), y - by);
                    height * (-(dx * dx + dy * dy) / (2.0 * sigma * sigma)).exp()
                })
                .sum();
            (128.0 + sum).clamp(0.0, 255.0)
        })
    }

    /// Turned by 90°: pixel (x, y) comes to (height - 1 - y, x).
    fn turned(&self) -> Self {
        let (width, height) = (self.height, self.width);
        let from = |i: usize| (i / width) + (self.height - 1 - i % width) * self.width;
        Self {
            width,
            height,
            pixels: (0..width * height).map(|i| self.pixels[from(i)]).collect(),
        }
    }

    fn image(&self) -> GrayImage<'_> {
        GrayImage::new(self.width, self.height, &self.pixels).unwrap()
    }

    fn features(&self, config: SurfConfig) -> SurfFeatures {
        Surf::new(config).unwrap().extract(self.image()).clone()
    }
}

fn gaussian(x: f32, y: f32, sigma: f32) -> Picture {
    Picture::new(320, 240, |u, v| {
        let square = (u - x).powi(2) + (v - y).powi(2);
        40.0 + 150.0 * (-square / (2.0 * sigma * sigma)).exp()
    })
}

fn strongest(features: &SurfFeatures) -> Keypoint {
    let by_response = |a: &&Keypoint, b: &&Keypoint| a.response.total_cmp(&b.response);
    *features.keypoints.iter().max_by(by_response).unwrap()
}

/// The keypoint next to a place, and its descriptor.
fn nearest(features: &SurfFeatures, x: f32, y: f32, scale: f32) -> (Keypoint, &[u8]) {
    let length = features.descriptors.len() / features.keypoints.len();
    let off = |k: &Keypoint| (k.x - x).hypot(k.y - y) + 4.0 * (k.scale / scale).ln().abs();
    let pairs = features
        .keypoints
        .iter()
        .zip(features.descriptors.chunks(length));
    let (keypoint, descriptor) = pairs.min_by(|a, b| off(a.0).total_cmp(&off(b.0))).unwrap();
    (*keypoint, descriptor)
}

fn distance(a: &[u8], b: &[u8]) -> f32 {
    let square = |(a, b): (&u8, &u8)| f32::from(a.abs_diff(*b)).powi(2);
    a.iter().zip(b).map(square).sum::<f32>().sqrt()
}

#[test]
fn a_blob_is_found_where_it_is() {
    // The quadratic through grid points a step apart fits a Gaussian's response to a few
    // hundredths of the step; half a pixel, the error of mistaken edges, is many times that.
    for (x, y, sigma, tolerance) in [
        (100.0, 80.0, 3.0, 0.03),
        (100.3, 80.4, 3.0, 0.03),
        (101.25, 80.5, 6.0, 0.08),
        (100.7, 90.2, 12.0, 0.2),
        (150.0, 120.0, 20.0, 0.4),
    ] {
        let features = gaussian(x, y, sigma).features(SurfConfig::default());
        let found = strongest(&features);
        assert!((found.x - x).hypot(found.y - y) < tolerance, "{found:?}");
    }
}

#[test]
fn scale_grows_with_the_blob() {
    // Of the box filters one answers most whose nominal σ is 0.7 times that of the blob; the grid
    // of scales leaves a few percent.
    for sigma in [3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 20.0] {
        let features = gaussian(160.0, 120.0, sigma).features(SurfConfig::default());
        let ratio = strongest(&features).scale / (descriptor::DIAMETER * sigma);
        assert!((ratio - 0.72).abs() < 0.04, "{sigma} {ratio}");
    }
}

#[test]
fn the_response_is_that_of_the_box_filters() {
    // On 40 + x·y the 9 × 9 filter sees pure mixed curvature: four lobes of 3 × 3 pixels whose
    // centres are 4 px apart sum to 9 · 16; the derivatives along the axes vanish.
    let picture = Picture::new(15, 15, |x, y| 40.0 + x * y);
    let mut integral = Integral::default();
    integral.compute(picture.image());
    let mut octave = Octave {
        step: 1,
        sizes: vec![9],
        layers: vec![Vec::new()],
        ..Octave::default()
    };
    hessian::compute(&integral, &mut octave, None, &mut Vec::new());
    let expected = -0.81 * (9.0_f32 * 16.0 / 81.0).powi(2);
    for row in octave.valid(0, 15) {
        for column in octave.valid(0, 15) {
            let value = octave.layers[0][row * octave.columns + column];
            assert!((value - expected).abs() < 1e-4, "{value} {expected}");
        }
    }
    assert_eq!(octave.valid(0, 15), 4..11);
}

#[test]
fn coarse_octaves_answer_as_fine_ones_do() {
    let picture = Picture::blobs(150, 130);
    let mut integral = Integral::default();
    integral.compute(picture.image());
    let octave = |step: usize| Octave {
        step,
        sizes: vec![27, 39],
        layers: vec![Vec::new(); 2],
        ..Octave::default()
    };
    let mut scratch = Vec::new();
    let mut fine = octave(1);
    hessian::compute(&integral, &mut fine, None, &mut scratch);
    for step in [2, 4, 8, 16] {
        let mut coarse = octave(step);
        hessian::compute(&integral, &mut coarse, None, &mut scratch);
        let mut shared = octave(step);
        if step == 2 {
            hessian::compute(&integral, &mut shared, Some(&fine), &mut scratch);
        }
        for layer in 0..2 {
            for row in coarse.valid(layer, picture.height) {
                for column in coarse.valid(layer, picture.width) {
                    let at = row * coarse.columns + column;
                    let expected = fine.layers[layer][(row * fine.columns + column) * step];
                    assert_eq!(coarse.layers[layer][at], expected);
                    if step == 2 {
                        assert_eq!(shared.layers[layer][at], expected);
                    }
                }
            }
        }
    }
}

#[test]
fn features_turn_with_the_image() {
    let picture = Picture::blobs(401, 303);
    let turned = picture.turned();
    for extended in [false, true] {
        let config = SurfConfig {
            extended,
            octaves: 1,
            ..SurfConfig::default()
        };
        let (a, b) = (picture.features(config), turned.features(config));
        assert!(a.keypoints.len() > 60, "{}", a.keypoints.len());
        assert_eq!(a.keypoints.len(), b.keypoints.len());
        let mut alike = 0;
        for (i, k) in a.keypoints.iter().enumerate() {
            let (x, y) = (picture.height as f32 - 1.0 - k.y, k.x);
            let (other, descriptor) = nearest(&b, x, y, k.scale);
            assert!((other.x - x).hypot(other.y - y) < 1e-2);
            let turn = (other.angle - k.angle - FRAC_PI_2 + 3.0 * PI).rem_euclid(2.0 * PI) - PI;
            let length = config.descriptor_length();
            let same = distance(&a.descriptors[i * length..][..length], descriptor);
            // A few keypoints have two directions that are equally strong.
            alike += usize::from(turn.abs() < 0.01 && same < 8.0);
        }
        assert!(alike * 20 >= a.keypoints.len() * 19, "{alike}");
    }
}

#[test]
fn upright_features_have_no_orientation() {
    let picture = Picture::blobs(257, 193);
    let config = SurfConfig {
        upright: true,
        ..SurfConfig::default()
    };
    let (upright, plain) = (
        picture.features(config),
        picture.features(SurfConfig::default()),
    );
    assert!(upright.keypoints.iter().all(|k| k.angle == 0.0));
    assert_eq!(upright.keypoints.len(), plain.keypoints.len());
    assert_ne!(upright.descriptors, plain.descriptors);
}

#[test]
fn descriptors_have_length_one() {
    for extended in [false, true] {
        let config = SurfConfig {
            extended,
            ..SurfConfig::default()
        };
        let features = Picture::blobs(257, 193).features(config);
        let length = config.descriptor_length();
        assert_eq!(
            features.descriptors.len(),
            features.keypoints.len() * length
        );
        for bytes in features.descriptors.chunks(length) {
            assert!(bytes.iter().all(|&b| b <= 127));
            // Each number is rounded by half a unit at most, which adds up to √length / 2.
            let norm = distance(bytes, &vec![64; length]);
            assert!(
                (norm - 127.0).abs() < 0.5 * (length as f32).sqrt(),
                "{norm}"
            );
        }
    }
}

#[test]
fn any_number_of_threads_gives_the_same() {
    let picture = Picture::blobs(401, 303);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| picture.features(SurfConfig::default()))
    };
    let one = with(1);
    assert!(one.keypoints.len() > 100);
    assert_eq!(one, with(2));
    assert_eq!(one, with(5));
}

#[test]
fn an_image_leaves_nothing_behind_for_the_next() {
    let (large, small) = (Picture::blobs(401, 303), Picture::blobs(140, 151));
    let mut surf = Surf::new(SurfConfig::default()).unwrap();
    let first = surf.extract(small.image()).clone();
    surf.extract(large.image());
    assert_eq!(*surf.extract(small.image()), first);
    assert!(!first.keypoints.is_empty());
}

#[test]
fn odd_images_have_features_or_none() {
    let config = SurfConfig {
        hessian_threshold: 0.0,
        octaves: 5,
        octave_layers: 4,
        ..SurfConfig::default()
    };
    let mut surf = Surf::new(config).unwrap();
    for (width, height) in [
        (0, 0),
        (0, 7),
        (1, 1),
        (1, 300),
        (300, 1),
        (8, 8),
        (9, 9),
        (27, 27),
        (29, 29),
        (33, 500),
        (500, 34),
        (640, 9),
        (201, 200),
    ] {
        let mut random = SplitMix64::new(7);
        let noise: Vec<u8> = (0..width * height)
            .map(|_| random.index(256) as u8)
            .collect();
        let features = surf.extract(GrayImage::new(width, height, &noise).unwrap());
        let inside = |k: &Keypoint| {
            (-0.5..width as f32 - 0.5).contains(&k.x) && (-0.5..height as f32 - 0.5).contains(&k.y)
        };
        assert!(features.keypoints.iter().all(inside));
        assert_eq!(features.descriptors.len(), features.keypoints.len() * 64);
        // The three smallest filters, of 9 to 21 px, and room for neighbours.
        if width.min(height) < 23 {
            assert!(features.keypoints.is_empty());
        }
        let constant = vec![77; width * height];
        let features = surf.extract(GrayImage::new(width, height, &constant).unwrap());
        assert!(features.keypoints.is_empty());
    }
}

#[test]
fn more_is_found_with_a_lower_threshold_and_more_octaves() {
    let picture = Picture::blobs(401, 303);
    let count = |hessian_threshold, octaves, octave_layers| {
        let config = SurfConfig {
            hessian_threshold,
            octaves,
            octave_layers,
            ..SurfConfig::default()
        };
        picture.features(config).keypoints.len()
    };
    let usual = count(20.0, 3, 2);
    assert!(usual > 20);
    assert!(count(2.0, 3, 2) > usual);
    assert!(count(20.0, 1, 2) < usual);
    assert!(count(20.0, 3, 4) > usual);
}

#[test]
fn the_budget_is_kept() {
    let config = SurfConfig {
        max_features: 50,
        ..SurfConfig::default()
    };
    let features = Picture::blobs(401, 303).features(config);
    assert_eq!(features.keypoints.len(), 50);
    assert_eq!(features.descriptors.len(), 50 * 64);
}

#[test]
fn settings_out_of_range_are_refused() {
    let usual = SurfConfig::default();
    for hessian_threshold in [-1.0, f32::NAN, f32::INFINITY] {
        assert!(
            Surf::new(SurfConfig {
                hessian_threshold,
                ..usual
            })
            .is_err()
        );
    }
    for octaves in [0, 6] {
        assert!(Surf::new(SurfConfig { octaves, ..usual }).is_err());
    }
    for octave_layers in [0, 5] {
        assert!(
            Surf::new(SurfConfig {
                octave_layers,
                ..usual
            })
            .is_err()
        );
    }
    assert_eq!(*Surf::new(usual).unwrap().config(), usual);
}
