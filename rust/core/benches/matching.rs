//! Time of exact matching, a frame's descriptors against those of one face and of a few, and of the
//! proposal of faces of a large library.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use planegrasp_core::matching::{
    Candidates, Kernel, Metric, QueryKeypoint, ReferenceIndex, ReferenceSet,
};
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
        let frames = vec![[1.0, 0.0, 0.0, 1.0]; PER_FACE];
        let set = ReferenceSet::new(points, frames, bytes, length, 1.5);
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

fn proposal(criterion: &mut Criterion) {
    let mut random = SplitMix64::new(2);
    let queries = descriptors(QUERIES, 128, &mut random);
    let keypoints: Vec<QueryKeypoint> = (0..QUERIES)
        .map(|_| QueryKeypoint {
            point: [640.0, 480.0].map(|size| (size * random.uniform()) as f32),
            scale: 2.0 + 20.0 * random.uniform() as f32,
            angle: 6.3 * random.uniform() as f32,
        })
        .collect();
    let mut group = criterion.benchmark_group("proposal");
    group.sample_size(20);
    for faces in [20, 100] {
        let index = index(Metric::Euclidean, 128, faces, Kernel::best());
        group.bench_function(BenchmarkId::from_parameter(faces), |b| {
            b.iter(|| index.propose(&queries, &keypoints, None));
        });
    }
    group.finish();
}

criterion_group!(benches, exact, proposal);
criterion_main!(benches);
