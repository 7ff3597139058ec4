//! SIFT: any settings, several images of any size on one extractor.
#![no_main]

use arbitrary::Arbitrary;
use libfuzzer_sys::fuzz_target;
use planegrasp_core::sift::{Sift, SiftConfig};
use planegrasp_fuzz::{Number, Picture};

#[derive(Debug, Arbitrary)]
struct Input {
    max_features: u8,
    octave_layers: u8,
    contrast: u8,
    edge: Number,
    sigma: u8,
    double_first_octave: bool,
    images: [Picture; 2],
}

fuzz_target!(|input: Input| {
    let config = SiftConfig {
        max_features: input.max_features.into(),
        octave_layers: usize::from(input.octave_layers % 10),
        contrast_threshold: f64::from(input.contrast) / 2000.0,
        edge_threshold: input.edge.0,
        sigma: 0.9 + f64::from(input.sigma) / 100.0,
        double_first_octave: input.double_first_octave,
    };
    let Ok(mut sift) = Sift::new(config.clone()) else {
        return;
    };
    for image in &input.images {
        let features = sift.extract(image.gray()).expect("not too large");
        image.assert_holds(&features.keypoints);
        assert_eq!(features.keypoints.len(), features.descriptors.len());
        assert!(config.max_features == 0 || features.keypoints.len() <= config.max_features);
        // The memory of the image before leaves no trace.
        let fresh = Sift::new(config.clone()).expect("the same settings");
        assert_eq!({ fresh }.extract(image.gray()).as_ref(), Ok(&features));
    }
});
