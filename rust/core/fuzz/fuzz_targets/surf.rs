//! SURF: any settings, several images of any size on one extractor.
#![no_main]

use arbitrary::Arbitrary;
use libfuzzer_sys::fuzz_target;
use planegrasp_core::surf::{Surf, SurfConfig};
use planegrasp_fuzz::{Number, Picture};

#[derive(Debug, Arbitrary)]
struct Input {
    hessian_threshold: Number,
    octaves: u8,
    octave_layers: u8,
    extended: bool,
    upright: bool,
    max_features: u8,
    images: [Picture; 2],
}

fuzz_target!(|input: Input| {
    let config = SurfConfig {
        hessian_threshold: input.hessian_threshold.0 as f32,
        octaves: usize::from(input.octaves % 7),
        octave_layers: usize::from(input.octave_layers % 6),
        extended: input.extended,
        upright: input.upright,
        max_features: input.max_features.into(),
    };
    let Ok(mut surf) = Surf::new(config) else {
        return;
    };
    for image in &input.images {
        let features = surf.extract(image.gray());
        image.assert_holds(&features.keypoints);
        let bytes = features.keypoints.len() * config.descriptor_length();
        assert_eq!(features.descriptors.len(), bytes);
        assert!(config.max_features == 0 || features.keypoints.len() <= config.max_features);
        // The memory of the image before leaves no trace.
        let mut fresh = Surf::new(config).expect("the same settings");
        assert_eq!(fresh.extract(image.gray()), features);
    }
});
