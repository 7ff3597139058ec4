//! The index: faces come and go, and every instruction set finds the same neighbours.
#![no_main]

use arbitrary::{Arbitrary, Result, Unstructured};
use libfuzzer_sys::fuzz_target;
use planegrasp_core::matching::{
    Candidates, Kernel, Metric, ProposalSettings, Queries, QueryKeypoint, ReferenceIndex,
    ReferenceSet,
};
use planegrasp_fuzz::Number;

#[derive(Debug, Arbitrary)]
enum Step {
    Add {
        rows: u8,
        radius: Number,
        frame: [Number; 4],
        signs: Option<[i8; 3]>,
    },
    AddAnotherLength {
        length: u16,
    },
    Remove {
        face: u8,
    },
    Search {
        rows: u8,
        k: u8,
        among: Vec<u8>,
        first: Option<u16>,
        keypoint: [Number; 4],
        signs: Option<[i8; 3]>,
    },
    Odd {
        bytes: u8,
    },
}

#[derive(Debug, Arbitrary)]
struct Settings {
    exhaustive: u8,
    first: u8,
    faces: u8,
    words: u8,
    probes: u8,
    bits: u8,
}

fuzz_target!(|bytes: &[u8]| {
    let _ = run(&mut Unstructured::new(bytes));
});

fn run(u: &mut Unstructured<'_>) -> Result<()> {
    let metric = *u.choose(&[Metric::Euclidean, Metric::Hamming])?;
    let length = u.int_in_range(0..=140)?;
    let mut indices = Vec::new();
    let settings: Settings = u.arbitrary()?;
    let settings = ProposalSettings {
        exhaustive: settings.exhaustive.into(),
        first: settings.first.into(),
        faces: usize::from(settings.faces % 8),
        words: settings.words.into(),
        probes: settings.probes.into(),
        bits: settings.bits.into(),
    };
    let farthest = match u.ratio(1, 2)? {
        true => f32::INFINITY,
        false => u.arbitrary::<Number>()?.0 as f32,
    };
    for kernel in Kernel::available() {
        let index = ReferenceIndex::with_kernel(metric, length, kernel);
        let index = index.with_settings(settings);
        let Ok(index) = index.and_then(|index| index.with_farthest(farthest)) else {
            return Ok(());
        };
        indices.push(index);
    }
    for _ in 0..u.int_in_range(0..=12)? {
        let step: Step = u.arbitrary()?;
        let data = descriptors(&step, length, u)?;
        let outcomes: Vec<_> = indices.iter_mut().map(|i| apply(i, &step, &data)).collect();
        assert!(
            outcomes.windows(2).all(|pair| pair[0] == pair[1]),
            "{step:?}"
        );
    }
    Ok(())
}

/// Bytes for the descriptors of a step: few different ones, so that distances are alike.
fn descriptors(step: &Step, length: usize, u: &mut Unstructured<'_>) -> Result<Vec<u8>> {
    let count = match step {
        Step::Add { rows, .. } | Step::Search { rows, .. } => usize::from(*rows) * length,
        Step::Odd { bytes } => usize::from(*bytes),
        _ => 0,
    };
    let available = u.len().min(64);
    let bytes = u.bytes(available)?;
    let stride = bytes.len().saturating_sub(3).max(1);
    let byte = |i: usize| bytes.get(i % stride).copied().unwrap_or(0);
    Ok((0..count).map(byte).collect())
}

/// What a step leads to, to be compared between instruction sets.
fn apply(index: &mut ReferenceIndex, step: &Step, data: &[u8]) -> (bool, Vec<u32>, Candidates) {
    let mut found = Candidates::default();
    let mut faces = Vec::new();
    let succeeded;
    match step {
        Step::Add {
            rows,
            radius,
            frame,
            signs,
        } => {
            let count = usize::from(*rows);
            let points = (0..count).map(|i| [(i % 5) as f32, 1.0]).collect();
            let length = data.len().checked_div(count).unwrap_or(8);
            let radius = radius.0 as f32;
            let frames = vec![numbers(frame); count];
            let mut set = ReferenceSet::new(points, frames, data.to_vec(), length, radius);
            if let Some(signs) = signs {
                set = set.and_then(|set| set.with_signs(&repeated(signs, count)));
            }
            succeeded = set.is_ok_and(|set| index.add(set).is_ok());
        }
        Step::AddAnotherLength { length } => {
            let length = usize::from(*length);
            let set = ReferenceSet::new(vec![], vec![], vec![], length, 1.0);
            succeeded = set.is_ok_and(|set| index.add(set).is_ok());
        }
        Step::Remove { face } => succeeded = index.remove((*face).into()).is_ok(),
        Step::Search {
            rows,
            k,
            among,
            first,
            keypoint,
            signs,
        } => {
            let signs = signs.map(|signs| repeated(&signs, (*rows).into()));
            let queries = Queries {
                descriptors: data,
                signs: signs.as_deref(),
            };
            let mut among: Vec<u32> = among.iter().map(|&face| face.into()).collect();
            among.truncate(12);
            among.sort_unstable();
            among.dedup();
            let first = first.map_or(usize::MAX, usize::from);
            let scope: Vec<_> = among.iter().copied().map(|face| (face, first)).collect();
            succeeded = index
                .candidates_into(queries, (*k).into(), &scope, &mut found)
                .is_ok();
            let [x, y, scale, angle] = numbers(keypoint);
            let keypoint = |i: u8| QueryKeypoint {
                point: [x + f32::from(i), y],
                scale: scale * f32::from(i),
                angle,
            };
            let keypoints: Vec<_> = (0..*rows).map(keypoint).collect();
            let among = (k % 2 == 0).then_some(&among[..]);
            if let Ok(proposed) = index.propose(data, &keypoints, among) {
                assert!(proposed.is_sorted() && proposed.len() <= index.faces().len());
                faces = proposed;
            }
            if let Ok(candidates) = index.candidates(data, usize::from(*k % 9)) {
                check(index, &candidates);
            }
        }
        Step::Odd { .. } => succeeded = index.candidates(data, 2).is_ok(),
    }
    // NaN is not equal to itself, and there must not be any.
    assert!(found.ratio.iter().all(|ratio| *ratio >= 0.0), "{found:?}");
    (succeeded, faces, found)
}

/// Small numbers by turns, most of them signs.
fn repeated(signs: &[i8; 3], count: usize) -> Vec<i8> {
    signs
        .map(|sign| sign % 3)
        .into_iter()
        .cycle()
        .take(count)
        .collect()
}

fn numbers(all: &[Number; 4]) -> [f32; 4] {
    [0, 1, 2, 3].map(|i| all[i].0 as f32)
}

/// Candidates are of faces and references that there are, and are sorted.
fn check(index: &ReferenceIndex, found: &Candidates) {
    for (i, (&face, &reference)) in found.face.iter().zip(&found.reference).enumerate() {
        let known = index.faces().get(face as usize);
        assert_eq!(known.is_some(), found.distance[i].is_finite());
        assert!(known.is_none_or(|set| (reference as usize) < set.len()));
    }
    for row in found.distance.chunks(found.k) {
        assert!(row.is_sorted());
    }
}
