//! Robust estimation and refinement of homographies from any matches.
#![no_main]
#![allow(non_snake_case)]

use arbitrary::Arbitrary;
use libfuzzer_sys::fuzz_target;
use planegrasp_core::homography::{Prior, RansacConfig, Rigidity, estimate, refine};
use planegrasp_fuzz::{Homography, Matches, Number};

#[derive(Debug, Arbitrary)]
struct Input {
    matches: Matches,
    threshold: Number,
    min_iterations: u8,
    max_iterations: u8,
    seed: u64,
    possible: u8,
    start: Homography,
    scale: Number,
    prior: Option<(Homography, Homography, Number)>,
}

fuzz_target!(|input: Input| {
    let matches = &input.matches.0;
    let config = RansacConfig {
        threshold: input.threshold.0,
        min_iterations: input.min_iterations.into(),
        max_iterations: input.max_iterations.into(),
        seed: input.seed,
    };
    let possible = |H: &nalgebra::Matrix3<f64>| input.possible > 64 || H[(0, 0)] > 0.0;
    if let Ok(Some(found)) = estimate(matches, &config, possible) {
        assert!(found.inliers <= matches.len());
        assert!(found.iterations <= config.max_iterations);
        assert!(found.matrix.iter().all(|v| v.is_finite()), "{found:?}");
    }
    let prior = input.prior.and_then(|(camera, metric, sigma)| {
        let rigidity = Rigidity::new(camera.0, &metric.0)?;
        let sigma = sigma.0;
        Some(Prior { rigidity, sigma })
    });
    if let Some(H) = refine(matches, &input.start.0, input.scale.0, prior.as_ref()) {
        assert!(H.iter().all(|v| v.is_finite()), "{H}");
    }
});
