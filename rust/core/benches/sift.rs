//! SIFT of a 640×480 image on one thread: the whole, and its scale space alone.

#![allow(missing_docs)] // the macros' functions

use criterion::{Criterion, criterion_group, criterion_main};
use planegrasp_core::GrayImage;
use planegrasp_core::random::SplitMix64;
use planegrasp_core::sift::{Sift, SiftConfig};

const SIZE: (usize, usize) = (640, 480);

/// Blobs of all sizes on grey, and some noise: about as many keypoints as in a photograph.
fn scene() -> Vec<u8> {
    let mut random = SplitMix64::new(0);
    let mut image = vec![128.0; SIZE.0 * SIZE.1];
    for _ in 0..3000 {
        let (cx, cy) = (random.uniform() * 640.0, random.uniform() * 480.0);
        let (sigma, height) = (1.0 + 5.0 * random.uniform().powi(3), 40.0 * random.normal());
        let reach = (3.0 * sigma) as isize + 1;
        for y in (cy as isize - reach).max(0)..(cy as isize + reach).min(480) {
            for x in (cx as isize - reach).max(0)..(cx as isize + reach).min(640) {
                let square = (x as f64 - cx).powi(2) + (y as f64 - cy).powi(2);
                image[y as usize * SIZE.0 + x as usize] +=
                    height * (-square / (2.0 * sigma * sigma)).exp();
            }
        }
    }
    let noisy = |v: f64| (v + 2.0 * random.normal()) as u8;
    image.into_iter().map(noisy).collect()
}

fn extraction(criterion: &mut Criterion) {
    let pixels = scene();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let (Ok(image), Ok(pool)) = (GrayImage::new(SIZE.0, SIZE.1, &pixels), pool) else {
        return;
    };
    let without_keypoints = SiftConfig {
        contrast_threshold: 1.0,
        ..SiftConfig::default()
    };
    let cases = [
        ("extract", SiftConfig::default()),
        ("scale_space", without_keypoints),
    ];
    for (name, config) in cases {
        let Ok(mut sift) = Sift::new(config) else {
            return;
        };
        criterion.bench_function(&format!("sift/{name}"), |bencher| {
            pool.install(|| bencher.iter(|| sift.extract(image).map(|f| f.keypoints.len())));
        });
    }
}

criterion_group!(benches, extraction);
criterion_main!(benches);
