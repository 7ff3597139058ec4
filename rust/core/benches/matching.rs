//! Time of exact matching: a frame's descriptors against those of one face, a few and some more.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use planegrasp_core::matching::{Candidates, Kernel, Metric, ReferenceIndex, ReferenceSet};
use planegrasp_core::random::SplitMix64;

const QUERIES: usize = 2000;
const PER_FACE: usize = 2000;
const K: usize = 16;

fn descriptors(count: usize, length: usize, random: &mut SplitMix64) -> Vec<u8> {
    (0..count * length)
        .map(|_| random.index(128) as u8)
        .collect()
}

#[allow(clippy::expect_used)]
fn index(metric: Metric, length: usize, faces: usize, kernel: Kernel) -> ReferenceIndex {
    let mut random = SplitMix64::new(0);
    let mut index = ReferenceIndex::with_kernel(metric, length, kernel);
    for _ in 0..faces {
        let points = (0..PER_FACE)
            .map(|i| [(i % 50) as f32, (i / 50) as f32])
            .collect();
        let bytes = descriptors(PER_FACE, length, &mut random);
        let set = ReferenceSet::new(points, bytes, length, 1.5);
        set.and_then(|set| index.add(set))
            .expect("the set fits the index");
    }
    index
}

fn exact(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("candidates");
    group.sample_size(20);
    for (metric, length) in [(Metric::Euclidean, 128), (Metric::Hamming, 32)] {
        let queries = descriptors(QUERIES, length, &mut SplitMix64::new(1));
        for faces in [1, 6] {
            for kernel in Kernel::available() {
                let index = index(metric, length, faces, kernel);
                let mut found = Candidates::default();
                let all: Vec<_> = (0..faces as u32).map(|face| (face, usize::MAX)).collect();
                group.throughput(Throughput::Elements((QUERIES * PER_FACE * faces) as u64));
                let name = format!("{metric:?} {kernel:?}");
                group.bench_function(BenchmarkId::new(name, faces), |b| {
                    b.iter(|| index.candidates_into(&queries, K, &all, &mut found));
                });
            }
        }
    }
    group.finish();
}

criterion_group!(benches, exact);
criterion_main!(benches);
