//! Dense refinement: any reference, frame, start and settings, with memory of the one before.
#![no_main]

use arbitrary::Arbitrary;
use libfuzzer_sys::fuzz_target;
use planegrasp_core::alignment::{AlignmentConfig, AlignmentReference, AlignmentWorkspace, align};
use planegrasp_fuzz::{Homography, Number, Picture};

#[derive(Debug, Arbitrary)]
struct Settings {
    max_tiles: u8,
    min_tiles: u8,
    min_correlation: Number,
    max_motion: Number,
    start_sigma: Number,
    displacement_floor: Number,
    max_iterations: u8,
    renderings: u8,
}

#[derive(Debug, Arbitrary)]
struct Input {
    reference: Picture,
    /// The reference itself where there is none.
    frame: Option<Picture>,
    starts: [Homography; 2],
    settings: Option<Settings>,
}

fuzz_target!(|input: Input| {
    let config = input
        .settings
        .map_or(AlignmentConfig::default(), |s| AlignmentConfig {
            max_tiles: s.max_tiles.into(),
            min_tiles: s.min_tiles.into(),
            min_correlation: s.min_correlation.0,
            max_motion: s.max_motion.0,
            start_sigma: s.start_sigma.0,
            displacement_floor: s.displacement_floor.0,
            max_iterations: s.max_iterations.into(),
            renderings: s.renderings.into(),
        });
    let Ok(reference) = AlignmentReference::new(input.reference.gray()) else {
        return;
    };
    if config.check().is_err() {
        return;
    }
    let frame = input.frame.as_ref().unwrap_or(&input.reference);
    let mut workspace = AlignmentWorkspace::new();
    for start in &input.starts {
        let found = align(&reference, &frame.gray(), &start.0, &config, &mut workspace);
        let mut fresh = AlignmentWorkspace::new();
        assert_eq!(
            format!("{found:?}"),
            format!(
                "{:?}",
                align(&reference, &frame.gray(), &start.0, &config, &mut fresh)
            ),
            "the alignment before must leave no trace"
        );
        if let Some(found) = found {
            assert!(found.homography.iter().all(|v| v.is_finite()), "{found:?}");
            assert!(found.score_before.abs() <= 1.0 && found.score_after.abs() <= 1.0);
            assert!(found.information.iter().all(|v| v.is_finite()), "{found:?}");
        }
    }
});
