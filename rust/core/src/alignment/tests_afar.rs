//! Starts that are many pixels off.

use nalgebra::{Matrix3, Vector2};

use super::tests::{
    FRONTAL, HEIGHT, OBLIQUE, SMALL, WIDTH, align_in, corner_error, frame, moved, reference, same,
};
use super::*;
use crate::GrayImage;

#[test]
fn coarse_frames_bring_home_a_start_that_is_too_far_for_the_fine_one() {
    // Only what the tiles can see decides.
    let config = AlignmentConfig {
        max_motion: 60.0,
        ..AlignmentConfig::default()
    };
    for (H, pixels) in [(FRONTAL, -20.0), (FRONTAL, 20.0), (OBLIQUE, 20.0)] {
        let start = moved(&H, pixels);
        let pixels = frame(&H, 2.0, same);
        let image = GrayImage::new(WIDTH, HEIGHT, &pixels).unwrap();
        let coarse = CoarseFrames::new(&image);
        let mut workspace = AlignmentWorkspace::new();
        let reference = reference();
        let afar = align_from_afar(
            &reference,
            &image,
            &coarse,
            &start,
            0,
            &config,
            &mut workspace,
        );
        let error = corner_error(&afar.unwrap().homography, &H);
        assert!(error < 0.2, "{error} px from afar");
        let near = align_in(&pixels, &start, &config);
        let error = near.map_or(f64::INFINITY, |found| corner_error(&found.homography, &H));
        assert!(error > 5.0, "{error} px without coarse frames");
    }
}

#[test]
fn a_small_face_is_found_many_pixels_beside_its_start() {
    // A quarter of the frame has 27 × 19 pixels of it: hardly a tile of 8 × 8 beside another.
    let config = AlignmentConfig::default();
    let pixels = frame(&SMALL, 2.0, same);
    let image = GrayImage::new(WIDTH, HEIGHT, &pixels).unwrap();
    let (coarse, reference) = (CoarseFrames::new(&image), reference());
    for by in [[18.0, -9.0], [-26.0, 4.0], [7.0, 30.0]] {
        let start = Matrix3::new_translation(&Vector2::from(by)) * SMALL;
        let found = align_from_afar(
            &reference,
            &image,
            &coarse,
            &start,
            10,
            &config,
            &mut AlignmentWorkspace::new(),
        );
        let error = found.map_or(f64::INFINITY, |found| {
            corner_error(&found.homography, &SMALL)
        });
        assert!(error < 0.2, "{error} px from {by:?} px beside");
    }
}
