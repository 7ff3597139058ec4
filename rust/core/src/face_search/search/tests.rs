//! The search of black faces with exact matches.
#![allow(clippy::unwrap_used)]

use nalgebra::Vector2;

use super::*;
use crate::face_search::evidence::ImageFeatures;
use crate::face_search::scenes::{
    HEIGHT, WIDTH, camera, features, mapped, one_each, plain_face, points, settings, view,
};
use crate::matching::Candidates;
use crate::random::SplitMix64;

static BLACK: [u8; 640 * 480] = [0; 640 * 480];

/// Of each face 40 keypoints, seen with noise at an own place, and 60 wrong matches.
fn scene(faces: usize) -> (Vec<SearchedFace>, Evidence) {
    let mut random = SplitMix64::new(7);
    let mut candidates = Candidates {
        k: 1,
        ..Candidates::default()
    };
    let (mut library, mut image) = (Vec::new(), Vec::new());
    for face in 0..faces {
        let reference = points(100, WIDTH as f64, HEIGHT as f64, face as u64);
        let H = view(15.0 * face as f64, 40.0 * face as f64);
        let wrong = points(60, 640.0, 480.0, 100 + face as u64);
        for (keypoint, point) in reference.iter().enumerate() {
            let noise = Vector2::new(random.normal(), random.normal()) * 0.5;
            image.push(match keypoint.checked_sub(40) {
                Some(i) => wrong[i],
                None => mapped(&H, *point) + noise,
            });
            candidates.face.push(face as u32);
            candidates.reference.push(keypoint as u32);
            candidates.ratio.push(0.4 + 0.3 * random.uniform() as f32);
        }
        library.push(plain_face(&reference));
    }
    let evidence = Evidence::new(&candidates, features(&image), faces).unwrap();
    (library, evidence)
}

/// Black faces look like nothing: their appearance is not asked for.
fn blind() -> SearchSettings {
    SearchSettings {
        min_agreement: 0.0,
        ..settings()
    }
}

fn numbers(faces: &[SearchedFace]) -> Vec<usize> {
    (0..faces.len()).collect()
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let (faces, evidence) = scene(5);
    let camera = camera();
    let view = View {
        evidence: &evidence,
        gray: GrayImage::new(640, 480, &BLACK).unwrap(),
        camera: &camera,
    };
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().unwrap();
        pool.install(|| find(&faces, &numbers(&faces), &view, &blind(), 3))
    };
    let attempts = with(1);
    let found = attempts.iter().filter(|attempt| attempt.outcome.is_ok());
    assert_eq!(found.count(), 5);
    assert!(attempts.is_sorted_by_key(|attempt| (attempt.face, attempt.instance)));
    for threads in [2, 4] {
        assert_eq!(with(threads), attempts);
    }
}

#[test]
fn a_face_is_found_where_it_is_and_refused_for_what_it_lacks() {
    let (faces, evidence) = scene(1);
    let camera = camera();
    let view_of = View {
        evidence: &evidence,
        gray: GrayImage::new(640, 480, &BLACK).unwrap(),
        camera: &camera,
    };
    let outcome = |settings: &SearchSettings| {
        let mut attempts = find(&faces, &numbers(&faces), &view_of, settings, 1);
        assert_eq!(attempts.len(), 1);
        attempts.remove(0).outcome
    };
    let found = outcome(&blind()).unwrap();
    let truth = faces[0]
        .corners()
        .map(|corner| mapped(&view(0.0, 0.0), corner));
    for (seen, expected) in found.outline.iter().zip(truth) {
        assert!((seen - expected).norm() < 1.0);
    }
    assert!(found.inliers.len() >= 40);
    let refused = |change: fn(&mut SearchSettings)| {
        let mut settings = blind();
        change(&mut settings);
        outcome(&settings).unwrap_err()
    };
    assert!(matches!(
        refused(|s| s.min_matches = 101),
        Refusal::TooFewMatches {
            matches: 100,
            needed: 101
        }
    ));
    assert_eq!(
        refused(|s| s.iterations = 0),
        Refusal::NoHomography { matches: 100 }
    );
    assert!(matches!(
        refused(|s| s.min_inliers = 90),
        Refusal::TooFewInliers { .. }
    ));
    assert!(matches!(
        refused(|s| s.min_side = 500.0),
        Refusal::ShortSide { .. }
    ));
    assert!(matches!(
        refused(|s| s.max_stretch = 1.0),
        Refusal::Stretched { .. }
    ));
    assert!(matches!(
        refused(|s| s.min_coverage = 1.0),
        Refusal::Coverage { .. }
    ));
    assert!(matches!(
        refused(|s| s.min_agreement = 0.1),
        Refusal::Agreement { .. }
    ));
}

#[test]
fn keypoints_beyond_the_reference_are_no_second_instance() {
    let reference = points(60, WIDTH as f64, 2.0 * HEIGHT as f64, 3);
    let image: Vec<_> = reference
        .iter()
        .map(|p| mapped(&view(0.0, 0.0), *p))
        .collect();
    let faces = [plain_face(&reference)];
    let camera = camera();
    let view_of = View {
        evidence: &one_each(&image, &[0.5; 60]),
        gray: GrayImage::new(640, 480, &BLACK).unwrap(),
        camera: &camera,
    };
    let attempts = find(&faces, &[0], &view_of, &blind(), usize::MAX);
    assert_eq!(attempts.len(), 1);
    assert!(attempts[0].outcome.is_ok());
}

#[test]
fn faces_that_the_evidence_does_not_know_have_no_matches() {
    let (mut faces, evidence) = scene(1);
    faces.push(faces[0].clone());
    faces.push(plain_face(&[]));
    let camera = camera();
    let view_of = View {
        evidence: &evidence,
        gray: GrayImage::new(640, 480, &BLACK).unwrap(),
        camera: &camera,
    };
    let attempts = find(&faces, &numbers(&faces), &view_of, &blind(), 2);
    let outcomes: Vec<_> = attempts
        .iter()
        .map(|a| (a.face, a.outcome.as_ref().err()))
        .collect();
    let unknown = Refusal::TooFewMatches {
        matches: 0,
        needed: 10,
    };
    let expected = [
        (0, None),
        (1, Some(&unknown)),
        (2, Some(&Refusal::NoFeatures)),
    ];
    assert_eq!(outcomes, expected);
    let predicted = view(0.0, 0.0);
    assert!(look_where(0, &faces[0], &predicted, &view_of, &blind()).is_some());
    assert!(look_where(1, &faces[1], &predicted, &view_of, &blind()).is_none());
}

#[test]
fn no_features_and_no_instances_are_no_trouble() {
    let evidence = Evidence::new(
        &Candidates {
            k: 4,
            ..Candidates::default()
        },
        ImageFeatures::default(),
        1,
    );
    let (faces, some) = scene(1);
    let camera = camera();
    let mut view_of = View {
        evidence: &evidence.unwrap(),
        gray: GrayImage::new(640, 480, &BLACK).unwrap(),
        camera: &camera,
    };
    assert_eq!(
        find(&faces, &numbers(&faces), &view_of, &settings(), 3).len(),
        1
    );
    assert!(find(&[], &[0], &view_of, &settings(), 3).is_empty());
    view_of.evidence = &some;
    assert!(find(&faces, &numbers(&faces), &view_of, &settings(), 0).is_empty());
}
