//! Time of SURF on an image with blobs of many sizes, on one thread and on all.

#![allow(missing_docs)]

use criterion::{Criterion, criterion_group, criterion_main};
use planegrasp_core::GrayImage;
use planegrasp_core::random::SplitMix64;
use planegrasp_core::surf::{Surf, SurfConfig};

const WIDTH: usize = 640;
const HEIGHT: usize = 480;

/// Grey values of 2500 Gaussian blobs of both signs: about as many keypoints as a photograph has.
fn blobs() -> Vec<u8> {
    let mut random = SplitMix64::new(1);
    let mut image = vec![128.0_f64; WIDTH * HEIGHT];
    for _ in 0..2500 {
        let (x, y) = (
            random.uniform() * WIDTH as f64,
            random.uniform() * HEIGHT as f64,
        );
        let sigma = 1.5 + 6.0 * random.uniform().powi(2);
        let height = 120.0 * random.uniform() - 60.0;
        let reach = (4.0 * sigma) as usize;
        let (column, row) = (x as usize, y as usize);
        for v in row.saturating_sub(reach)..(row + reach).min(HEIGHT) {
            for u in column.saturating_sub(reach)..(column + reach).min(WIDTH) {
                let square = (u as f64 - x).powi(2) + (v as f64 - y).powi(2);
                image[v * WIDTH + u] += height * (-square / (2.0 * sigma * sigma)).exp();
            }
        }
    }
    image.iter().map(|v| v.clamp(0.0, 255.0) as u8).collect()
}

fn bench(criterion: &mut Criterion) {
    let pixels = blobs();
    let Ok(image) = GrayImage::new(WIDTH, HEIGHT, &pixels) else {
        return;
    };
    for threads in [1, rayon::current_num_threads()] {
        let (Ok(pool), Ok(mut surf)) = (
            rayon::ThreadPoolBuilder::new().num_threads(threads).build(),
            Surf::new(SurfConfig::default()),
        ) else {
            return;
        };
        let found = pool.install(|| surf.extract(image).keypoints.len());
        let name = format!("surf 640x480, {found} keypoints, {threads} threads");
        criterion.bench_function(&name, |bencher| {
            pool.install(|| bencher.iter(|| surf.extract(image).keypoints.len()));
        });
    }
}

criterion_group!(benches, bench);
criterion_main!(benches);
