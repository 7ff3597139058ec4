//! The search of black faces with exact matches.
#![allow(clippy::unwrap_used)]

use nalgebra::Vector2;

use super::*;
use crate::face_search::evidence::ImageFeatures;
use crate::face_search::scenes::{
    HEIGHT, WIDTH, camera, face_taught, features, mapped, one_each, plain_face, points, settings,
    view,
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
    // Samples with noise are never exactly rigid.
    assert_eq!(
        refused(|s| s.max_stretch = 1.0),
        Refusal::NoHomography { matches: 100 }
    );
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
fn a_face_of_another_shape_than_taught_is_refused_as_stretched() {
    // So many exact matches outweigh the prior on the shape.
    let reference = points(300, WIDTH as f64, HEIGHT as f64, 0);
    let H = view(0.0, 0.0);
    let image: Vec<_> = reference.iter().map(|p| mapped(&H, *p)).collect();
    let (evidence, camera) = (one_each(&image, &[0.5; 300]), camera());
    let view_of = View {
        evidence: &evidence,
        gray: GrayImage::new(640, 480, &BLACK).unwrap(),
        camera: &camera,
    };
    let attempt = |higher: f64| {
        let taught = face_taught(&reference, higher);
        find(&[taught], &[0], &view_of, &blind(), 1).remove(0)
    };
    let wrong = attempt(1.7);
    let Err(Refusal::Stretched { stretch, most }) = wrong.outcome else {
        panic!("{wrong:?}");
    };
    assert!((1.65..1.75).contains(&stretch), "{stretch}");
    assert_eq!((most, wrong.figures.stretch), (1.6, Some(stretch)));
    assert!(attempt(1.0).outcome.is_ok());
}

#[test]
fn few_matches_of_a_face_of_another_shape_are_no_rigid_view_of_it() {
    // Too few to outweigh the prior: from the shape that was taught follows a view turned away.
    let reference = points(25, WIDTH as f64, HEIGHT as f64, 4);
    let mut random = SplitMix64::new(11);
    let image: Vec<_> = reference
        .iter()
        .map(|p| {
            let noise = Vector2::new(random.normal(), random.normal()) * 0.5;
            mapped(&view(20.0, 30.0), *p) + noise
        })
        .collect();
    let (evidence, camera) = (one_each(&image, &[0.5; 25]), camera());
    let view_of = View {
        evidence: &evidence,
        gray: GrayImage::new(640, 480, &BLACK).unwrap(),
        camera: &camera,
    };
    let attempt = |higher: f64| {
        let taught = face_taught(&reference, higher);
        find(&[taught], &[0], &view_of, &blind(), 1).remove(0)
    };
    for (higher, stretched) in [(1.75, 1.75), (1.0 / 1.75, 1.75)] {
        let wrong = attempt(higher);
        let Err(Refusal::Stretched { stretch, .. }) = wrong.outcome else {
            panic!("{wrong:?}");
        };
        assert!((stretch / stretched - 1.0).abs() < 0.1, "{stretch}");
    }
    assert!(attempt(1.0).outcome.is_ok());
}

#[test]
fn a_face_taught_a_tenth_too_high_is_found_where_its_matches_are() {
    let (faces, evidence) = scene(1);
    let camera = camera();
    let view_of = View {
        evidence: &evidence,
        gray: GrayImage::new(640, 480, &BLACK).unwrap(),
        camera: &camera,
    };
    let points: Vec<_> = (0..100).map(|i| faces[0].point(i)).collect();
    let wrong = face_taught(&points, 1.1);
    let attempt = find(&[wrong], &[0], &view_of, &blind(), 1).remove(0);
    let found = attempt.outcome.unwrap();
    let errors = faces[0].corners().map(|corner| {
        let truth = mapped(&view(0.0, 0.0), corner);
        (mapped(&found.homography, corner) - truth).norm()
    });
    // Its corners lie 8 px from where a face of the taught shape would have them.
    assert!(errors.iter().all(|&error| error < 1.5), "{errors:?}");
    assert!(found.inliers.len() >= 40);
}

#[test]
fn what_is_known_of_the_shape_helps_few_matches_on_a_part_of_an_oblique_face() {
    let camera = camera();
    let truth = view(62.0, 20.0);
    let errors = |aspect_sigma: f64| {
        let error = |seed: u64| {
            let part = points(14, 130.0, 100.0, seed);
            let reference: Vec<_> = part.iter().map(|p| p + Vector2::new(40.0, 150.0)).collect();
            let mut random = SplitMix64::new(seed + 100);
            let image: Vec<_> = reference
                .iter()
                .map(|p| mapped(&truth, *p) + Vector2::new(random.normal(), random.normal()) * 0.6)
                .collect();
            let face = plain_face(&reference);
            let evidence = one_each(&image, &[0.5; 14]);
            let settings = SearchSettings {
                aspect_sigma,
                ..blind()
            };
            let found = from_strict(&evidence.of(0, &face), &camera, &settings);
            found.map_or(f64::INFINITY, |found| {
                let corners = face.corners().into_iter();
                let off = corners.map(|c| (mapped(&found.matrix, c) - mapped(&truth, c)).norm());
                off.fold(0.0, f64::max)
            })
        };
        let mut errors: Vec<f64> = (0..21).map(error).collect();
        errors.sort_by(f64::total_cmp);
        errors
    };
    // 14 matches with 0.6 px of noise on a tenth of the face; 18 of 21 such views or more are found.
    let (with, without) = (errors(0.02), errors(1e6));
    assert!(with[16].is_finite() && without[16].is_finite());
    assert!(
        3.0 * with[10] < without[10],
        "median {} px with, {} px without",
        with[10],
        without[10]
    );
}

#[test]
fn few_inliers_that_do_not_look_like_the_reference_are_refused_for_their_tiles() {
    let settings = |least: f64| SearchSettings {
        min_doubtful_tiles: least,
        ..settings()
    };
    assert_eq!(needed_tiles(0, 0.5, &settings(0.9)), 0.9);
    assert_eq!(needed_tiles(30, 0.5, &settings(0.9)), 0.45);
    assert_eq!(needed_tiles(60, 0.5, &settings(0.9)), 0.0);
    assert_eq!(needed_tiles(500, 0.5, &settings(0.9)), 0.0);
    assert_eq!(needed_tiles(0, 0.5, &settings(0.0)), 0.0);
    // Close together they count less.
    let clustered = needed_tiles(30, 0.5 * WELL_SPREAD, &settings(0.9));
    assert!((clustered - 0.675).abs() < 1e-12);
    // A black face has no tiles at all.
    let few = points(14, WIDTH as f64, HEIGHT as f64, 5);
    let face = plain_face(&few);
    let image: Vec<_> = few.iter().map(|p| mapped(&view(0.0, 0.0), *p)).collect();
    let evidence = one_each(&image, &[0.5; 14]);
    let camera = camera();
    let view_of = View {
        evidence: &evidence,
        gray: GrayImage::new(640, 480, &BLACK).unwrap(),
        camera: &camera,
    };
    let outcome = |least: f64| {
        let settings = SearchSettings {
            min_doubtful_tiles: least,
            ..blind()
        };
        find(std::slice::from_ref(&face), &[0], &view_of, &settings, 1).remove(0)
    };
    let refused = outcome(0.9);
    assert_eq!(refused.figures.inliers, Some(14));
    assert_eq!(refused.figures.tiles, Some(0.0));
    let least = needed_tiles(14, refused.figures.coverage.unwrap(), &settings(0.9));
    assert_eq!(refused.outcome, Err(Refusal::Tiles { tiles: 0.0, least }));
    assert!(outcome(0.0).outcome.is_ok());
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
