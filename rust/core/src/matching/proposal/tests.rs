//! The index on libraries that are large enough for faces to be proposed.

use super::ProposalSettings;
use crate::InputError;
use crate::matching::{Kernel, Metric, NONE, ReferenceIndex, ReferenceSet, oracle};
use crate::random::SplitMix64;

/// A library of faces with nothing in common, large enough for its settings to propose faces.
fn library(metric: Metric, random: &mut SplitMix64) -> Vec<ReferenceSet> {
    let faces = 60;
    (0..faces)
        .map(|_| {
            let count = 80 + random.index(60);
            let bytes = (0..count * 32).map(|_| random.index(256) as u8).collect();
            let points = (0..count).map(|i| [i as f32, 0.0]).collect();
            let radius = if metric == Metric::Hamming { 0.5 } else { 2.5 };
            ReferenceSet::new(points, bytes, 32, radius).unwrap()
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
            let points = vec![[0.0; 2]; 9];
            index
                .add(ReferenceSet::new(points, vec![byte; 36], 4, 1.0).unwrap())
                .unwrap();
        }
        let found = index.candidates(&[byte; 4], 1).unwrap();
        assert_eq!((found.distance[0], found.ratio[0]), (0.0, 1.0));
    }
}
