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

/// Frames of keypoints that are neither turned nor large.
fn upright(count: usize) -> Vec<[f32; 4]> {
    vec![[1.0, 0.0, 0.0, 1.0]; count]
}

fn set(count: usize, length: usize, largest: usize, random: &mut SplitMix64) -> ReferenceSet {
    let bytes = descriptors(count, length, largest, random);
    let points = (0..count)
        .map(|_| [random.index(3) as f32 * 4.0, random.index(3) as f32 * 4.0])
        .collect();
    let radius = [0.0, 4.5, 100.0][random.index(3)];
    ReferenceSet::new(points, upright(count), bytes, length, radius).unwrap()
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

fn signs(count: usize, random: &mut SplitMix64) -> Vec<i8> {
    (0..count).map(|_| random.index(3) as i8 - 1).collect()
}

#[test]
fn only_keypoints_of_one_sign_are_compared() {
    let mut random = SplitMix64::new(8);
    for sizes in [vec![], vec![1], vec![0, 5, 0], vec![70, 33, 400]] {
        let mut signed = |n| {
            let of_set = signs(n, &mut random);
            let set = set(n, 64, 127, &mut random);
            set.with_signs(&of_set).unwrap()
        };
        let sets: Vec<_> = sizes.iter().map(|&n| signed(n)).collect();
        let descriptors = descriptors(100, 64, 127, &mut random);
        let of_queries = signs(100, &mut random);
        let index = index(Metric::Euclidean, 64, &sets, Kernel::best());
        for signs in [None, Some(&of_queries[..])] {
            let queries = Queries {
                descriptors: &descriptors,
                signs,
            };
            let expected = oracle::candidates(Metric::Euclidean, 64, &sets, queries, 7);
            assert_eq!(index.candidates(queries, 7).unwrap(), expected, "{sizes:?}");
        }
    }
}

/// Of a set with signs those that a search looks at which is limited to its first so many.
fn looked_at(set: &ReferenceSet, first: usize) -> Vec<usize> {
    let groups = [-1, 0, 1]
        .into_iter()
        .filter_map(|sign| set.with_sign(sign));
    let numbers = groups.flat_map(|group| {
        group
            .numbers()
            .iter()
            .take(32 * group.blocks_of_first(first))
    });
    let mut numbers: Vec<usize> = numbers.map(|number| number as usize).collect();
    numbers.sort_unstable();
    numbers
}

#[test]
fn signs_hold_for_every_instruction_set_for_the_first_of_each_face_and_for_the_ratio() {
    let mut random = SplitMix64::new(11);
    for (metric, length) in [(Metric::Euclidean, 64), (Metric::Hamming, 32)] {
        for (k, first) in [(1, 40), (3, 100), (200, 150)] {
            let sets: Vec<_> = [300, 50, 200]
                .map(|n| {
                    let of_set = signs(n, &mut random);
                    set(n, length, 127, &mut random)
                        .with_signs(&of_set)
                        .unwrap()
                })
                .into();
            // The same with nothing but what is looked at.
            let looked_at: Vec<Vec<usize>> = sets.iter().map(|set| looked_at(set, first)).collect();
            let cut = |(set, numbers): (&ReferenceSet, &Vec<usize>)| {
                let (points, bytes, signs) = (set.points(), set.descriptors(), set.signs());
                let points = numbers.iter().map(|&i| points[i]).collect();
                let bytes = numbers.iter().flat_map(|&i| &bytes[i * length..][..length]);
                let signs: Vec<i8> = numbers.iter().map(|&i| signs[i]).collect();
                let (bytes, frames) = (bytes.copied().collect(), upright(numbers.len()));
                let set = ReferenceSet::new(points, frames, bytes, length, set.radius());
                set.unwrap().with_signs(&signs).unwrap()
            };
            let mut cut: Vec<_> = sets.iter().zip(&looked_at).map(cut).collect();
            cut[1] = ReferenceSet::default();
            let descriptors = descriptors(90, length, 127, &mut random);
            let of_queries = signs(90, &mut random);
            let queries = Queries {
                descriptors: &descriptors,
                signs: Some(&of_queries),
            };
            let mut expected = oracle::candidates(metric, length, &cut, queries, k);
            for (face, reference) in expected.face.iter().zip(&mut expected.reference) {
                if *face != NONE {
                    *reference = looked_at[*face as usize][*reference as usize] as u32;
                }
            }
            for kernel in Kernel::available() {
                let mut index = index(metric, length, &sets, kernel);
                index.remove(1).unwrap();
                let mut found = Candidates::default();
                let among = [(0, first), (2, first)];
                index
                    .candidates_into(queries, k, &among, &mut found)
                    .unwrap();
                assert_eq!(found, expected, "{metric:?} {k} {first} {kernel:?}");
            }
        }
    }
}

#[test]
fn descriptors_and_the_first_of_them_are_the_same_with_signs() {
    let mut random = SplitMix64::new(9);
    let plain = set(500, 8, 255, &mut random);
    let of_set = signs(500, &mut random);
    let set = plain.clone().with_signs(&of_set).unwrap();
    assert_eq!(set.descriptors(), plain.descriptors());
    assert_eq!(set.signs(), of_set);
    // Of the first hundred each sign has about a third, of which whole blocks are looked at.
    for sign in [-1, 0, 1] {
        let group = set.with_sign(sign).unwrap();
        let among = of_set[..100].iter().filter(|&&s| s == sign).count();
        assert_eq!(group.blocks_of_first(100), among.div_ceil(32));
        assert!(group.numbers().iter().is_sorted());
    }
    assert!(plain.with_sign(1).is_none());
}

#[test]
fn signs_that_do_not_fit_are_refused() {
    let mut random = SplitMix64::new(10);
    let set = set(3, 8, 255, &mut random);
    let (descriptors, signs) = (3, 2);
    let expected = InputError::SignCount { descriptors, signs };
    assert_eq!(set.clone().with_signs(&[1, 1]), Err(expected.clone()));
    assert!(set.clone().with_signs(&[1, 0, 2]).is_err());
    let index = index(Metric::Euclidean, 8, &[set], Kernel::best());
    let found = |signs| {
        let signs = Some(signs);
        let descriptors = &[0; 24];
        index.candidates(Queries { descriptors, signs }, 1)
    };
    assert_eq!(found(&[1, 1]), Err(expected));
    assert!(found(&[1, 0, -2]).is_err());
    assert!(found(&[1, 0, -1]).is_ok());
}

#[test]
fn the_ratio_looks_beyond_the_k_nearest_for_another_place() {
    // Twenty views of one point, then one of another point that is twice as far.
    let mut bytes: Vec<u8> = (0..20).flat_map(|_| [10, 0, 0, 0]).collect();
    bytes.extend([20, 0, 0, 0]);
    let mut points = vec![[5.0, 5.0]; 20];
    points.push([50.0, 5.0]);
    let set = ReferenceSet::new(points, upright(21), bytes, 4, 3.0).unwrap();
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
            .candidates_into(&queries, 5, &[(0, usize::MAX)], &mut found)
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
    let short = ReferenceSet::new(vec![[0.0; 2]], upright(1), vec![0; 32], 32, 1.0).unwrap();
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
    for k in [0, 4097, usize::MAX] {
        let refused = index.candidates(&[0; 64], k);
        assert!(matches!(refused, Err(InputError::OutOfRange { .. })), "{k}");
    }
    for length in [0, 5000] {
        let set = ReferenceSet::new(vec![], vec![], vec![], length, 1.0);
        assert!(matches!(set, Err(InputError::OutOfRange { .. })));
    }
    for (frames, expected) in [
        (
            upright(2),
            InputError::FrameCount {
                points: 1,
                frames: 2,
            },
        ),
        (
            vec![[f32::NAN; 4]],
            InputError::NotFinite { what: "frames" },
        ),
    ] {
        let set = ReferenceSet::new(vec![[0.0; 2]], frames, vec![0; 8], 8, 1.0);
        assert_eq!(set, Err(expected));
    }
    assert!(
        ReferenceIndex::new(Metric::Hamming, 0)
            .candidates(&[1], 1)
            .is_err()
    );
}
