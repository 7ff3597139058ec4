//! The index on libraries that are large enough for faces to be proposed.

use nalgebra::{Rotation2, Vector2};

use super::ProposalSettings;
use crate::InputError;
use crate::matching::{
    Candidates, Kernel, MOST_FILED, Metric, QueryKeypoint, ReferenceIndex, ReferenceSet, oracle,
};
use crate::random::SplitMix64;

/// Angle and scale of a reference's keypoint, by its number.
fn own_frame(keypoint: usize) -> (f32, f32) {
    (keypoint as f32, 2.0 + (keypoint % 7) as f32)
}

/// A library of faces with nothing in common, large enough for its settings to propose faces.
fn library(metric: Metric, random: &mut SplitMix64) -> Vec<ReferenceSet> {
    let faces = 60;
    (0..faces)
        .map(|_| {
            let count = 80 + random.index(60);
            let bytes = (0..count * 32).map(|_| random.index(256) as u8).collect();
            let points = (0..count).map(|i| [(3 * i) as f32, (i % 10) as f32 * 20.0]);
            let radius = if metric == Metric::Hamming { 0.5 } else { 2.5 };
            let frames = (0..count).map(|i| {
                let (angle, scale) = own_frame(i);
                let (s, c) = angle.sin_cos();
                [c, -s, s, c].map(|v| scale * v)
            });
            ReferenceSet::new(points.collect(), frames.collect(), bytes, 32, radius).unwrap()
        })
        .collect()
}

/// What a frame shows.
struct Frame {
    queries: Vec<u8>,
    keypoints: Vec<QueryKeypoint>,
}

impl Frame {
    /// Descriptors of some faces, each changed a little, so many of each, among as many others.
    ///
    /// Each face is turned, enlarged and moved in its own way.
    fn of(sets: &[&ReferenceSet], each: usize, metric: Metric, random: &mut SplitMix64) -> Self {
        let (mut queries, mut keypoints) = (Vec::new(), Vec::new());
        for set in sets {
            for byte in &set.descriptors()[..each * 32] {
                queries.push(match metric {
                    Metric::Euclidean => byte.saturating_add(random.index(20) as u8),
                    Metric::Hamming => byte ^ u8::from(random.index(3) == 0) << random.index(8),
                });
            }
            let (turn, enlarged) = (6.0 * random.uniform(), 0.5 + random.uniform());
            let shift = Vector2::new(random.uniform(), random.uniform()) * 300.0;
            keypoints.extend((0..each).map(|i| {
                let point = Vector2::from(set.points()[i].map(f64::from));
                let seen = Rotation2::new(turn) * point * enlarged + shift;
                let (angle, scale) = own_frame(i);
                QueryKeypoint {
                    point: [seen.x as f32, seen.y as f32],
                    scale: enlarged as f32 * scale,
                    angle: turn as f32 + angle,
                }
            }));
        }
        let others = keypoints.len();
        queries.extend((0..others * 32).map(|_| random.index(256) as u8));
        keypoints.extend((0..others).map(|_| scattered(random)));
        Self { queries, keypoints }
    }

    fn proposed(&self, index: &ReferenceIndex) -> Vec<u32> {
        index.propose(&self.queries, &self.keypoints, None).unwrap()
    }

    /// Among the proposed faces.
    fn candidates(&self, index: &ReferenceIndex, k: usize) -> Candidates {
        let proposed = self.proposed(index).into_iter();
        let among: Vec<(u32, usize)> = proposed.map(|face| (face, usize::MAX)).collect();
        let mut found = Candidates::default();
        index
            .candidates_into(&self.queries, k, &among, &mut found)
            .unwrap();
        found
    }
}

/// A keypoint anywhere, of any angle and scale.
fn scattered(random: &mut SplitMix64) -> QueryKeypoint {
    QueryKeypoint {
        point: [640.0, 480.0].map(|size| (size * random.uniform()) as f32),
        scale: 2.0 + 20.0 * random.uniform() as f32,
        angle: 6.3 * random.uniform() as f32,
    }
}

const PROPOSING: ProposalSettings = ProposalSettings {
    exhaustive: 1000,
    first: 1000,
    faces: 4,
    words: 64,
    probes: 4,
    bits: 16,
};

fn index_of(sets: &[ReferenceSet], metric: Metric, settings: ProposalSettings) -> ReferenceIndex {
    let index = ReferenceIndex::new(metric, 32);
    let mut index = index.with_settings(settings).unwrap();
    for set in sets {
        index.add(set.clone()).unwrap();
    }
    index
}

#[test]
fn among_the_proposed_faces_of_a_large_library_the_search_is_exact() {
    for metric in [Metric::Euclidean, Metric::Hamming] {
        let mut random = SplitMix64::new(5);
        let sets = library(metric, &mut random);
        let frame = Frame::of(&[&sets[3], &sets[41]], 60, metric, &mut random);
        let index = index_of(&sets, metric, PROPOSING);
        let proposed = frame.proposed(&index);
        assert!(proposed.len() <= 4, "{metric:?} {proposed:?}");
        assert!(
            proposed.contains(&3) && proposed.contains(&41),
            "{metric:?} {proposed:?}"
        );
        let mut kept = vec![ReferenceSet::default(); 60];
        for &face in &proposed {
            kept[face as usize] = sets[face as usize].clone();
        }
        let expected = oracle::candidates(metric, 32, &kept, &frame.queries, 200);
        assert_eq!(frame.candidates(&index, 200), expected);
    }
}

#[test]
fn proposals_do_not_depend_on_threads_or_instruction_set() {
    let mut random = SplitMix64::new(6);
    let sets = library(Metric::Euclidean, &mut random);
    let frame = Frame::of(&[&sets[7], &sets[20]], 60, Metric::Euclidean, &mut random);
    let with = |kernel, threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            let index = ReferenceIndex::with_kernel(Metric::Euclidean, 32, kernel);
            let mut index = index.with_settings(PROPOSING).unwrap();
            for set in &sets {
                index.add(set.clone()).unwrap();
            }
            frame.candidates(&index, 5)
        })
    };
    let expected = with(Kernel::best(), 1);
    for kernel in Kernel::available() {
        assert_eq!(with(kernel, 3), expected, "{kernel:?}");
    }
}

#[test]
fn a_face_whose_descriptors_are_scattered_over_the_frame_is_not_there() {
    let mut random = SplitMix64::new(10);
    let sets = library(Metric::Euclidean, &mut random);
    // Five, of a face with little texture, against thirty of one that is not there.
    let mut frame = Frame::of(&[&sets[12]], 5, Metric::Euclidean, &mut random);
    frame
        .queries
        .extend_from_slice(&sets[30].descriptors()[..30 * 32]);
    frame
        .keypoints
        .extend((0..30).map(|_| scattered(&mut random)));
    let one = index_of(
        &sets,
        Metric::Euclidean,
        ProposalSettings {
            faces: 1,
            ..PROPOSING
        },
    );
    assert_eq!(frame.proposed(&one), [12]);
    // All at its place, it would come first.
    let all = Frame::of(&[&sets[30]], 30, Metric::Euclidean, &mut random);
    frame.queries.extend(all.queries);
    frame.keypoints.extend(all.keypoints);
    assert_eq!(frame.proposed(&one), [30]);
}

#[test]
fn only_faces_that_are_asked_for_are_proposed() {
    let mut random = SplitMix64::new(12);
    let sets = library(Metric::Euclidean, &mut random);
    let index = index_of(&sets, Metric::Euclidean, PROPOSING);
    let frame = Frame::of(&[&sets[9], &sets[31]], 30, Metric::Euclidean, &mut random);
    let proposed = |among: &[u32]| {
        let Frame { queries, keypoints } = &frame;
        index.propose(queries, keypoints, Some(among))
    };
    let odd: Vec<u32> = (1..60).step_by(2).rev().collect();
    let found = proposed(&odd).unwrap();
    assert!(found.contains(&9) && found.contains(&31), "{found:?}");
    assert!(found.iter().all(|face| odd.contains(face)), "{found:?}");
    let less: Vec<u32> = odd.into_iter().filter(|&face| face != 9).collect();
    let found = proposed(&less).unwrap();
    assert!(!found.contains(&9) && found.contains(&31), "{found:?}");
    // Few are all looked at, whether they are there or not.
    assert_eq!(proposed(&[40, 9, 9, 2]).unwrap(), [2, 9, 40]);
    assert!(proposed(&[]).unwrap().is_empty());
    assert_eq!(
        proposed(&[2, 60]),
        Err(InputError::NoSuchFace {
            face: 60,
            count: 60
        })
    );
}

#[test]
fn one_descriptor_alone_says_nothing() {
    let mut random = SplitMix64::new(11);
    let sets = library(Metric::Euclidean, &mut random);
    let index = index_of(&sets, Metric::Euclidean, PROPOSING);
    let mut frame = Frame::of(&[&sets[5]], 1, Metric::Euclidean, &mut random);
    assert!(frame.proposed(&index).is_empty());
    // Nor does the same place, seen twice.
    for _ in 0..2 {
        frame.queries.extend_from_within(..32);
        frame.keypoints.push(frame.keypoints[0]);
    }
    assert!(frame.proposed(&index).is_empty());
    let two = Frame::of(&[&sets[5]], 2, Metric::Euclidean, &mut random);
    assert_eq!(two.proposed(&index), [5]);
}

#[test]
fn a_library_is_searched_in_full_again_when_enough_was_removed() {
    let mut random = SplitMix64::new(7);
    let sets = library(Metric::Euclidean, &mut random);
    let mut index = index_of(&sets, Metric::Euclidean, PROPOSING);
    let frame = Frame::of(&[&sets[1], &sets[0]], 60, Metric::Euclidean, &mut random);
    assert!(frame.proposed(&index).contains(&1));
    index.remove(1).unwrap();
    let proposed = frame.proposed(&index);
    assert!(
        !proposed.contains(&1) && proposed.contains(&0),
        "{proposed:?}"
    );
    for face in (2..60).rev().take(52) {
        index.remove(face).unwrap();
    }
    assert_eq!(frame.proposed(&index), [0, 2, 3, 4, 5, 6, 7]);
    let all = oracle::candidates(Metric::Euclidean, 32, index.faces(), &frame.queries, 5);
    assert_eq!(frame.candidates(&index, 5), all);
    assert!(index.add(sets[1].clone()).is_ok());
    assert!(frame.proposed(&index).contains(&60));
}

#[test]
fn each_setting_of_the_proposal_changes_what_is_proposed() {
    let mut random = SplitMix64::new(8);
    let sets = library(Metric::Euclidean, &mut random);
    // The least that says something of each of many faces.
    let shown: Vec<&ReferenceSet> = sets.iter().step_by(2).collect();
    let frame = Frame::of(&shown, 2, Metric::Euclidean, &mut random);
    let many = ProposalSettings {
        faces: 40,
        ..PROPOSING
    };
    let proposed = |settings| frame.proposed(&index_of(&sets, Metric::Euclidean, settings));
    let expected = proposed(many);
    let right = expected.iter().filter(|&&face| face % 2 == 0).count();
    assert!(right > 25 && expected.len() < 40, "{expected:?}");
    for changed in [
        ProposalSettings {
            exhaustive: 100_000,
            ..many
        },
        ProposalSettings { first: 1, ..many },
        ProposalSettings { faces: 1, ..many },
        ProposalSettings { words: 2, ..many },
        ProposalSettings { probes: 1, ..many },
        ProposalSettings { bits: 30, ..many },
    ] {
        assert_ne!(proposed(changed), expected, "{changed:?}");
    }
}

#[test]
fn queries_need_a_keypoint_each() {
    let index = ReferenceIndex::new(Metric::Euclidean, 32);
    let refused = index.propose(&[0; 64], &[scattered(&mut SplitMix64::new(0))], None);
    assert!(matches!(
        refused,
        Err(InputError::DescriptorCount {
            points: 1,
            bytes: 64,
            ..
        })
    ));
}

#[test]
fn settings_that_propose_nothing_are_refused() {
    for settings in [
        ProposalSettings {
            first: 0,
            ..PROPOSING
        },
        ProposalSettings {
            first: MOST_FILED + 1,
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
            Err(InputError::OutOfRange {
                value: 0.0 | 1001.0,
                ..
            })
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
            let points = (0..9).map(|i| [3.0 * i as f32, 0.0]).collect();
            let upright = vec![[1.0, 0.0, 0.0, 1.0]; 9];
            index
                .add(ReferenceSet::new(points, upright, vec![byte; 36], 4, 1.0).unwrap())
                .unwrap();
        }
        let keypoints: Vec<QueryKeypoint> = (0..2)
            .map(|i| QueryKeypoint {
                point: [3.0 * i as f32, 0.0],
                scale: 1.0,
                angle: 0.0,
            })
            .collect();
        // All look like each face's first descriptor: one place.
        let proposed = index.propose(&[byte; 8], &keypoints, None).unwrap();
        assert!(proposed.is_empty());
        let found = index.candidates(&[byte; 4], 1).unwrap();
        assert_eq!((found.distance[0], found.ratio[0]), (0.0, 1.0));
    }
}
