//! The index against the search by its definition.

use super::*;
use crate::InputError;
use crate::random::SplitMix64;

/// Descriptors around a few centres, as those of oblique views of one point are.
fn descriptors(count: usize, length: usize, largest: usize, random: &mut SplitMix64) -> Vec<u8> {
    let centres: Vec<u8> = (0..6 * length)
        .map(|_| random.index(largest + 1) as u8)
        .collect();
    let mut bytes = Vec::new();
    for _ in 0..count {
        let centre = &centres[random.index(6) * length..][..length];
        for &byte in centre {
            let noise = random.index(4) as u8;
            bytes.push((byte.saturating_add(noise)).min(largest as u8));
        }
    }
    bytes
}

fn set(count: usize, length: usize, largest: usize, random: &mut SplitMix64) -> ReferenceSet {
    let bytes = descriptors(count, length, largest, random);
    let points = (0..count)
        .map(|_| [random.index(3) as f32 * 4.0, random.index(3) as f32 * 4.0])
        .collect();
    let radius = [0.0, 4.5, 100.0][random.index(3)];
    ReferenceSet::new(points, vec![[0.0; 4]; count], bytes, length, radius).unwrap()
}

fn index(metric: Metric, length: usize, sets: &[ReferenceSet], kernel: Kernel) -> ReferenceIndex {
    let mut index = ReferenceIndex::with_kernel(metric, length, kernel);
    for (number, set) in sets.iter().enumerate() {
        assert_eq!(index.add(set.clone()).unwrap(), number);
    }
    index
}

#[test]
fn every_instruction_set_finds_what_the_definition_says() {
    let mut random = SplitMix64::new(1);
    for metric in [Metric::Euclidean, Metric::Hamming] {
        for (length, largest) in [
            (1, 3),
            (32, 255),
            (61, 255),
            (64, 127),
            (128, 127),
            (128, 255),
        ] {
            for sizes in [
                vec![],
                vec![1],
                vec![0, 5, 0],
                vec![33, 64, 2],
                vec![2500, 40],
            ] {
                let sets: Vec<_> = sizes
                    .iter()
                    .map(|&n| set(n, length, largest, &mut random))
                    .collect();
                let queries = descriptors(random.index(80), length, largest, &mut random);
                let k = 1 + random.index(40);
                let expected = oracle::candidates(metric, length, &sets, &queries, k);
                for kernel in Kernel::available() {
                    let found = index(metric, length, &sets, kernel)
                        .candidates(&queries, k)
                        .unwrap();
                    assert_eq!(
                        found, expected,
                        "{metric:?} {length} {sizes:?} {k} {kernel:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn the_ratio_looks_beyond_the_k_nearest_for_another_place() {
    // Twenty views of one point, then one of another point that is twice as far.
    let mut bytes: Vec<u8> = (0..20).flat_map(|_| [10, 0, 0, 0]).collect();
    bytes.extend([20, 0, 0, 0]);
    let mut points = vec![[5.0, 5.0]; 20];
    points.push([50.0, 5.0]);
    let set = ReferenceSet::new(points, vec![[0.0; 4]; 21], bytes, 4, 3.0).unwrap();
    let index = index(Metric::Euclidean, 4, &[set], Kernel::best());
    for k in [1, 4, 20, 21, 30] {
        assert_eq!(index.candidates(&[0; 4], k).unwrap().ratio, [0.5], "{k}");
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let mut random = SplitMix64::new(2);
    let sets = [3000, 100].map(|n| set(n, 128, 127, &mut random));
    let queries = descriptors(500, 128, 127, &mut random);
    let index = index(Metric::Euclidean, 128, &sets, Kernel::best());
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().unwrap();
        pool.install(|| index.candidates(&queries, 9).unwrap())
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn memory_of_another_frame_leaves_no_trace() {
    let mut random = SplitMix64::new(3);
    let sets = [set(200, 32, 255, &mut random)];
    let index = index(Metric::Hamming, 32, &sets, Kernel::best());
    let mut found = Candidates::default();
    for count in [70, 3, 0, 40] {
        let queries = descriptors(count, 32, 255, &mut random);
        index
            .candidates_into(&queries, 5, (&[0], usize::MAX), &mut found)
            .unwrap();
        assert_eq!(found, index.candidates(&queries, 5).unwrap());
    }
}

#[test]
fn a_removed_face_is_not_found_and_the_others_keep_their_numbers() {
    let mut random = SplitMix64::new(4);
    let sets = [50, 60, 70].map(|n| set(n, 64, 127, &mut random));
    let mut index = index(Metric::Euclidean, 64, &sets, Kernel::best());
    index.remove(1).unwrap();
    let kept = [sets[0].clone(), ReferenceSet::default(), sets[2].clone()];
    let queries = descriptors(40, 64, 127, &mut random);
    let expected = oracle::candidates(Metric::Euclidean, 64, &kept, &queries, 6);
    assert_eq!(index.candidates(&queries, 6).unwrap(), expected);
    assert_eq!(index.add(sets[1].clone()).unwrap(), 3);
    assert!(index.faces()[1].is_empty());
    for face in [1, 4] {
        let count = 4;
        assert_eq!(
            index.remove(face),
            Err(InputError::NoSuchFace { face, count })
        );
    }
}

#[test]
fn what_does_not_fit_is_refused_with_its_numbers() {
    let mut index = ReferenceIndex::new(Metric::Euclidean, 64);
    let short = ReferenceSet::new(vec![[0.0; 2]], vec![[0.0; 4]], vec![0; 32], 32, 1.0).unwrap();
    assert_eq!(
        index.add(short),
        Err(InputError::DescriptorLength {
            length: 32,
            expected: 64
        })
    );
    assert!(matches!(
        index.candidates(&[0; 65], 1),
        Err(InputError::DescriptorCount {
            points: 1,
            length: 64,
            bytes: 65
        })
    ));
    assert!(matches!(
        index.candidates(&[], 0),
        Err(InputError::OutOfRange { .. })
    ));
    for length in [0, 5000] {
        let set = ReferenceSet::new(vec![], vec![], vec![], length, 1.0);
        assert!(matches!(set, Err(InputError::OutOfRange { .. })));
    }
    assert!(
        ReferenceIndex::new(Metric::Hamming, 0)
            .candidates(&[1], 1)
            .is_err()
    );
}

/// A library of faces with nothing in common, large enough for its settings to propose faces.
fn library(metric: Metric, random: &mut SplitMix64) -> Vec<ReferenceSet> {
    let faces = 60;
    (0..faces)
        .map(|_| {
            let count = 80 + random.index(60);
            let bytes = (0..count * 32).map(|_| random.index(256) as u8).collect();
            let points = (0..count).map(|i| [i as f32, 0.0]).collect();
            let radius = if metric == Metric::Hamming { 0.5 } else { 2.5 };
            ReferenceSet::new(points, vec![[0.0; 4]; count], bytes, 32, radius).unwrap()
        })
        .collect()
}

/// Descriptors of some faces as a frame has them, each changed a little, among as many others.
fn frame(sets: &[&ReferenceSet], metric: Metric, random: &mut SplitMix64) -> Vec<u8> {
    let mut queries = Vec::new();
    for set in sets {
        for byte in &set.descriptors()[..60 * 32] {
            queries.push(match metric {
                Metric::Euclidean => byte.saturating_add(random.index(20) as u8),
                Metric::Hamming => byte ^ u8::from(random.index(3) == 0) << random.index(8),
            });
        }
    }
    queries.extend((0..60 * 32).map(|_| random.index(256) as u8));
    queries
}

const PROPOSING: ProposalSettings = ProposalSettings {
    exhaustive: 1000,
    first: 1000,
    faces: 4,
    words: 64,
    probes: 4,
    bits: 16,
};

#[test]
fn among_the_proposed_faces_of_a_large_library_the_search_is_exact() {
    for metric in [Metric::Euclidean, Metric::Hamming] {
        let mut random = SplitMix64::new(5);
        let sets = library(metric, &mut random);
        let queries = frame(&[&sets[3], &sets[41]], metric, &mut random);
        let mut index = ReferenceIndex::new(metric, 32)
            .with_settings(PROPOSING)
            .unwrap();
        for set in &sets {
            index.add(set.clone()).unwrap();
        }
        let found = index.candidates(&queries, 200).unwrap();
        let proposed: Vec<u32> = (0..60).filter(|f| found.face.contains(f)).collect();
        assert!(proposed.len() <= 4, "{metric:?} {proposed:?}");
        assert!(
            proposed.contains(&3) && proposed.contains(&41),
            "{metric:?} {proposed:?}"
        );
        let mut kept = vec![ReferenceSet::default(); 60];
        for &face in &proposed {
            kept[face as usize] = sets[face as usize].clone();
        }
        assert_eq!(found, oracle::candidates(metric, 32, &kept, &queries, 200));
    }
}

#[test]
fn proposals_do_not_depend_on_threads_or_instruction_set() {
    let mut random = SplitMix64::new(6);
    let sets = library(Metric::Euclidean, &mut random);
    let queries = frame(&[&sets[7], &sets[20]], Metric::Euclidean, &mut random);
    let with = |kernel, threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            let index = ReferenceIndex::with_kernel(Metric::Euclidean, 32, kernel);
            let mut index = index.with_settings(PROPOSING).unwrap();
            for set in &sets {
                index.add(set.clone()).unwrap();
            }
            index.candidates(&queries, 5).unwrap()
        })
    };
    let expected = with(Kernel::best(), 1);
    for kernel in Kernel::available() {
        assert_eq!(with(kernel, 3), expected, "{kernel:?}");
    }
}

#[test]
fn a_library_is_searched_in_full_again_when_enough_was_removed() {
    let mut random = SplitMix64::new(7);
    let sets = library(Metric::Euclidean, &mut random);
    let mut index = ReferenceIndex::new(Metric::Euclidean, 32)
        .with_settings(PROPOSING)
        .unwrap();
    for set in &sets {
        index.add(set.clone()).unwrap();
    }
    let queries = frame(&[&sets[1]], Metric::Euclidean, &mut random);
    index.remove(1).unwrap();
    let found = index.candidates(&queries, 5).unwrap();
    assert!(!found.face.contains(&1));
    assert!(found.face.iter().all(|&face| face != NONE));
    for face in (2..60).rev().take(52) {
        index.remove(face).unwrap();
    }
    let expected = oracle::candidates(Metric::Euclidean, 32, index.faces(), &queries, 5);
    assert_eq!(index.candidates(&queries, 5).unwrap(), expected);
    assert!(index.add(sets[1].clone()).is_ok());
    assert!(index.candidates(&queries, 1).unwrap().face.contains(&60));
}

#[test]
fn each_setting_of_the_proposal_changes_what_is_found() {
    let mut random = SplitMix64::new(8);
    let sets = library(Metric::Euclidean, &mut random);
    let queries = frame(&[&sets[2], &sets[33]], Metric::Euclidean, &mut random);
    let found = |settings| {
        let mut index = ReferenceIndex::new(Metric::Euclidean, 32)
            .with_settings(settings)
            .unwrap();
        for set in &sets {
            index.add(set.clone()).unwrap();
        }
        index.candidates(&queries, 300).unwrap()
    };
    let expected = found(PROPOSING);
    for changed in [
        ProposalSettings {
            exhaustive: 100_000,
            ..PROPOSING
        },
        ProposalSettings {
            first: 10,
            ..PROPOSING
        },
        ProposalSettings {
            faces: 1,
            ..PROPOSING
        },
        ProposalSettings {
            words: 2,
            ..PROPOSING
        },
        ProposalSettings {
            probes: 1,
            ..PROPOSING
        },
        ProposalSettings {
            bits: 30,
            ..PROPOSING
        },
    ] {
        assert_ne!(found(changed), expected, "{changed:?}");
    }
}

#[test]
fn settings_that_propose_nothing_are_refused() {
    for settings in [
        ProposalSettings {
            first: 0,
            ..PROPOSING
        },
        ProposalSettings {
            faces: 0,
            ..PROPOSING
        },
        ProposalSettings {
            words: 0,
            ..PROPOSING
        },
        ProposalSettings {
            probes: 0,
            ..PROPOSING
        },
    ] {
        let index = ReferenceIndex::new(Metric::Euclidean, 32).with_settings(settings);
        assert!(matches!(
            index,
            Err(InputError::OutOfRange { value: 0.0, .. })
        ));
    }
}

#[test]
fn descriptors_that_are_all_alike_can_be_proposed() {
    let settings = ProposalSettings {
        exhaustive: 10,
        ..PROPOSING
    };
    for byte in [0, 255] {
        let index = ReferenceIndex::new(Metric::Euclidean, 4);
        let mut index = index.with_settings(settings).unwrap();
        for _ in 0..8 {
            let (points, frames) = (vec![[0.0; 2]; 9], vec![[0.0; 4]; 9]);
            index
                .add(ReferenceSet::new(points, frames, vec![byte; 36], 4, 1.0).unwrap())
                .unwrap();
        }
        let found = index.candidates(&[byte; 4], 1).unwrap();
        assert_eq!((found.distance[0], found.ratio[0]), (0.0, 1.0));
    }
}
