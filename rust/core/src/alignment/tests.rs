//! The whole alignment against exact homographies of a smooth texture.

use nalgebra::{Matrix3, Vector2};

use super::view::{View, apply};
use super::*;
use crate::GrayImage;
use crate::random::SplitMix64;

pub(super) const WIDTH: usize = 640;
pub(super) const HEIGHT: usize = 480;
const SIZE: [usize; 2] = [240, 180];

pub(super) const FRONTAL: Matrix3<f64> =
    Matrix3::new(0.93, -0.2, 220.0, 0.21, 0.95, 110.0, 0.0, 0.0, 1.0);
pub(super) const SMALL: Matrix3<f64> =
    Matrix3::new(0.45, 0.1, 250.0, -0.12, 0.43, 200.0, 1e-4, 1e-4, 1.0);
pub(super) const OBLIQUE: Matrix3<f64> =
    Matrix3::new(0.55, 0.05, 230.0, 0.1, 1.1, 120.0, -1.2e-3, 3e-4, 1.0);
const LEAVING: Matrix3<f64> = Matrix3::new(0.9, 0.0, -70.0, 0.0, 0.9, -30.0, 1e-4, 0.0, 1.0);

/// Waves in many directions: wavelengths of 14 to 40 reference pixels.
fn texture(x: f64, y: f64) -> f64 {
    let waves: f64 = (0..9)
        .map(|k| {
            let (angle, length) = (0.7 * f64::from(k), 14.0 + 3.2 * f64::from(k));
            let along = x * angle.cos() + y * angle.sin();
            (std::f64::consts::TAU * along / length + f64::from(k * k)).sin()
        })
        .sum();
    120.0 + 13.0 * waves
}

fn to_gray(value: f64) -> u8 {
    value.round().clamp(0.0, 255.0) as u8
}

pub(super) fn reference() -> AlignmentReference {
    let [width, height] = SIZE;
    let pixels: Vec<u8> = (0..width * height)
        .map(|i| to_gray(texture((i % width) as f64 + 0.5, (i / width) as f64 + 0.5)))
        .collect();
    AlignmentReference::new(GrayImage::new(width, height, &pixels).unwrap()).unwrap()
}

/// A frame with the texture before grey; `light` changes a value by where it lies on the reference.
pub(super) fn frame(
    H: &Matrix3<f64>,
    sigma: f64,
    light: impl Fn(f64, Vector2<f64>) -> f64,
) -> Vec<u8> {
    let inverse = H.try_inverse().unwrap();
    let mut random = SplitMix64::new(3);
    let [width, height] = SIZE.map(|side| side as f64);
    (0..WIDTH * HEIGHT)
        .map(|i| {
            let p = apply(
                &inverse,
                Vector2::new((i % WIDTH) as f64, (i / WIDTH) as f64),
            );
            let on_face = p.x >= 0.0 && p.y >= 0.0 && p.x <= width && p.y <= height;
            let value = if on_face {
                light(texture(p.x, p.y), p)
            } else {
                90.0
            };
            to_gray(value + sigma * random.normal())
        })
        .collect()
}

pub(super) fn same(value: f64, _: Vector2<f64>) -> f64 {
    value
}

/// The homography with its outline moved by about this many pixels, each corner differently.
pub(super) fn moved(H: &Matrix3<f64>, pixels: f64) -> Matrix3<f64> {
    let change = Matrix3::new(
        1.0 + 0.004 * pixels,
        -0.003 * pixels,
        0.3 * pixels,
        0.002 * pixels,
        1.0 - 0.003 * pixels,
        0.5 * pixels,
        1e-5 * pixels,
        -8e-6 * pixels,
        1.0,
    );
    let centre = apply(H, Vector2::new(SIZE[0] as f64 / 2.0, SIZE[1] as f64 / 2.0));
    let to = Matrix3::new(1.0, 0.0, -centre.x, 0.0, 1.0, -centre.y, 0.0, 0.0, 1.0);
    to.try_inverse().unwrap() * change * to * H
}

/// Largest distance of the corners \[px\].
pub(super) fn corner_error(a: &Matrix3<f64>, b: &Matrix3<f64>) -> f64 {
    let outline = |H| View::new(&reference(), H).unwrap().outline;
    super::descent::farthest(&outline(a), &outline(b))
}

pub(super) fn align_in(
    pixels: &[u8],
    start: &Matrix3<f64>,
    config: &AlignmentConfig,
) -> Option<Alignment> {
    let image = GrayImage::new(WIDTH, HEIGHT, pixels).unwrap();
    align(
        &reference(),
        &image,
        start,
        config,
        &mut AlignmentWorkspace::new(),
    )
}

fn refined(pixels: &[u8], start: &Matrix3<f64>) -> Alignment {
    let alignment = align_in(pixels, start, &AlignmentConfig::default()).unwrap();
    assert!(alignment.accepted, "{alignment:?}");
    assert!(alignment.score_after > alignment.score_before);
    alignment
}

#[test]
fn exact_views_are_found_to_a_twentieth_of_a_pixel() {
    for H in [FRONTAL, SMALL, OBLIQUE, LEAVING] {
        for pixels in [0.3, 1.5, -1.5] {
            let start = moved(&H, pixels);
            assert!(corner_error(&start, &H) > 0.8 * pixels.abs());
            let found = refined(&frame(&H, 0.0, same), &start).homography;
            let error = corner_error(&found, &H);
            // What remains is interpolation in the reference, rounding to grey levels, and how far a
            // corner out of the frame is from what is seen.
            assert!(error < 0.05, "{error} px from {pixels} px off {H}");
        }
    }
}

#[test]
fn noise_moves_corners_as_far_as_the_information_says() {
    for H in [FRONTAL, SMALL, OBLIQUE] {
        let alignment = refined(&frame(&H, 3.0, same), &moved(&H, 1.0));
        let covariance = alignment.information.try_inverse().unwrap();
        let sigma = covariance.diagonal().max().sqrt();
        // The worst of four corners in two coordinates: 3.5 sigmas; and what is exact to 0.02 px.
        let error = corner_error(&alignment.homography, &H);
        assert!(error < 3.5 * sigma + 0.02, "{error} px, sigma {sigma} px");
        assert!(sigma < 0.12, "{sigma} px");
    }
}

#[test]
fn lighting_hardly_matters() {
    let error = |light: fn(f64, Vector2<f64>) -> f64| {
        let pixels = frame(&FRONTAL, 0.0, light);
        corner_error(
            &refined(&pixels, &moved(&FRONTAL, 1.0)).homography,
            &FRONTAL,
        )
    };
    assert!(error(|value, _| 0.6 * value + 40.0) < 0.033);
    // A tile has a gain and a bias of its own, but no slope: 0.07 grey levels a pixel against the
    // texture's 5 to 10.
    assert!(error(|value, p| (0.6 + p.x / 2400.0) * value + p.y / 24.0) < 0.1);
}

#[test]
fn what_hides_a_third_of_the_face_does_not_pull() {
    // The same waves elsewhere: a third of the tiles has texture, but another.
    let hidden = |value: f64, p: Vector2<f64>| {
        if p.x < 80.0 {
            texture(p.y * 1.1 + 300.0, 40.0 - p.x)
        } else {
            value
        }
    };
    for H in [FRONTAL, OBLIQUE] {
        let found = refined(&frame(&H, 1.0, hidden), &moved(&H, 1.0)).homography;
        let error = corner_error(&found, &H);
        assert!(error < 0.1, "{error} px");
    }
}

#[test]
fn an_exact_start_is_not_made_worse() {
    let alignment = align_in(
        &frame(&OBLIQUE, 0.0, same),
        &OBLIQUE,
        &AlignmentConfig::default(),
    )
    .unwrap();
    assert!(corner_error(&alignment.homography, &OBLIQUE) < 0.033);
}

#[test]
fn a_motion_beyond_the_limit_is_refused() {
    let (pixels, start) = (frame(&FRONTAL, 0.0, same), moved(&FRONTAL, 1.0));
    let config = AlignmentConfig {
        max_motion: 0.2,
        ..AlignmentConfig::default()
    };
    let alignment = align_in(&pixels, &start, &config).unwrap();
    assert!(!alignment.accepted);
    assert!(corner_error(&alignment.homography, &start) < 1e-9);
}

#[test]
fn a_frame_of_something_else_is_no_evidence() {
    let other = |_: f64, p: Vector2<f64>| texture(p.y * 1.7 + 1000.0, 0.6 * p.x);
    let pixels = frame(&FRONTAL, 1.0, other);
    let found = align_in(&pixels, &FRONTAL, &AlignmentConfig::default());
    assert!(found.is_none_or(|alignment| alignment.score_after < 0.8));
    assert_eq!(
        align_in(&[90; WIDTH * HEIGHT], &FRONTAL, &AlignmentConfig::default()),
        None
    );
}

#[test]
fn starts_that_show_nothing_are_refused() {
    let pixels = frame(&FRONTAL, 0.0, same);
    let shifted = |x: f64| Matrix3::new(1.0, 0.0, x, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    let tiny = Matrix3::from_diagonal(&nalgebra::Vector3::new(0.01, 0.01, 1.0));
    let huge = Matrix3::from_diagonal(&nalgebra::Vector3::new(1e9, 1e9, 1.0));
    let horizon = Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, -4.166e-3, 0.0, 1.0);
    let unknown = Matrix3::from_element(f64::NAN);
    for start in [shifted(1e4), shifted(-1e4), shifted(1e300), tiny, unknown] {
        assert_eq!(
            align_in(&pixels, &start, &AlignmentConfig::default()),
            None,
            "{start}"
        );
    }
    // These two show some of the face: there must only be no panic.
    align_in(&pixels, &huge, &AlignmentConfig::default());
    align_in(&pixels, &horizon, &AlignmentConfig::default());
    for (width, height) in [(0, 0), (5, 5), (9, 480), (640, 1)] {
        let image = GrayImage::new(width, height, &pixels[..width * height]).unwrap();
        let config = AlignmentConfig::default();
        let found = align(
            &reference(),
            &image,
            &FRONTAL,
            &config,
            &mut AlignmentWorkspace::new(),
        );
        assert_eq!(found, None);
    }
}

#[test]
fn references_without_texture_or_size_are_refused() {
    let constant = AlignmentReference::new(GrayImage::new(50, 50, &[7; 2500]).unwrap()).unwrap();
    let pixels = frame(&FRONTAL, 3.0, same);
    let image = GrayImage::new(WIDTH, HEIGHT, &pixels).unwrap();
    let config = AlignmentConfig::default();
    let mut workspace = AlignmentWorkspace::new();
    assert_eq!(
        align(&constant, &image, &FRONTAL, &config, &mut workspace),
        None
    );
    for (width, height) in [(0, 0), (7, 100), (100, 7)] {
        let pixels = vec![0; width * height];
        assert!(AlignmentReference::new(GrayImage::new(width, height, &pixels).unwrap()).is_err());
    }
}

#[test]
fn a_used_workspace_changes_nothing() {
    let reference = reference();
    let config = AlignmentConfig::default();
    let mut used = AlignmentWorkspace::new();
    for H in [FRONTAL, OBLIQUE] {
        let pixels = frame(&H, 2.0, same);
        let image = GrayImage::new(WIDTH, HEIGHT, &pixels).unwrap();
        let aligned = |workspace: &mut AlignmentWorkspace| {
            align(&reference, &image, &moved(&H, 1.0), &config, workspace)
        };
        assert_eq!(aligned(&mut used), aligned(&mut AlignmentWorkspace::new()));
    }
}

#[test]
fn a_400_px_reference_takes_little_memory() {
    let pixels = vec![0; 400 * 400];
    let reference = AlignmentReference::new(GrayImage::new(400, 400, &pixels).unwrap()).unwrap();
    assert!(reference.bytes() < 150_000, "{}", reference.bytes());
}
