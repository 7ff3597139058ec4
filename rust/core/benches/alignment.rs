//! Time of an alignment, by the size and the tilt of the face in the frame.

#![allow(non_snake_case)]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use nalgebra::{Matrix3, Vector3};
use planegrasp_core::GrayImage;
use planegrasp_core::alignment::{AlignmentConfig, AlignmentReference, AlignmentWorkspace, align};

const FRAME: [usize; 2] = [640, 480];
const SIDE: usize = 400;

fn texture(x: f64, y: f64) -> u8 {
    let waves: f64 = (0..9)
        .map(|k| {
            let (angle, length) = (0.7 * f64::from(k), 9.0 + 3.2 * f64::from(k));
            let along = x * angle.cos() + y * angle.sin();
            (std::f64::consts::TAU * along / length).sin()
        })
        .sum();
    (120.0 + 13.0 * waves).clamp(0.0, 255.0) as u8
}

fn frame(H: &Matrix3<f64>) -> Vec<u8> {
    let inverse = H.try_inverse().unwrap_or_else(Matrix3::identity);
    (0..FRAME[0] * FRAME[1])
        .map(|i| {
            let p = inverse * Vector3::new((i % FRAME[0]) as f64, (i / FRAME[0]) as f64, 1.0);
            texture(p.x / p.z, p.y / p.z)
        })
        .collect()
}

fn alignments(criterion: &mut Criterion) {
    let pixels: Vec<u8> = (0..SIDE * SIDE)
        .map(|i| texture((i % SIDE) as f64 + 0.5, (i / SIDE) as f64 + 0.5))
        .collect();
    let Ok(image) = GrayImage::new(SIDE, SIDE, &pixels) else {
        return;
    };
    let Ok(reference) = AlignmentReference::new(image) else {
        return;
    };
    let mut group = criterion.benchmark_group("align");
    let scale = Matrix3::new(0.47, 0.0, 220.0, 0.0, 0.47, 140.0, 0.0, 0.0, 1.0);
    let views = [
        ("frontal", Matrix3::identity()),
        (
            "60 degrees",
            Matrix3::new(0.5, 0.0, 0.0, 0.0, 1.0, 0.0, 6e-4, 0.0, 1.0),
        ),
        (
            "75 degrees",
            Matrix3::new(0.26, 0.0, 0.0, 0.0, 1.0, 0.0, 8e-4, 0.0, 1.0),
        ),
    ];
    for (name, view) in views {
        let H = scale * view;
        let pixels = frame(&H);
        let Ok(image) = GrayImage::new(FRAME[0], FRAME[1], &pixels) else {
            return;
        };
        let mut start = H;
        start[(0, 2)] += 0.3;
        start[(1, 2)] -= 0.2;
        let config = AlignmentConfig::default();
        let mut workspace = AlignmentWorkspace::new();
        group.bench_function(BenchmarkId::from_parameter(name), |bencher| {
            bencher.iter(|| {
                align(
                    &reference,
                    &image,
                    black_box(&start),
                    &config,
                    &mut workspace,
                )
            });
        });
    }
    group.finish();
}

criterion_group!(benches, alignments);
criterion_main!(benches);
