//! Evidence from hand-made candidates.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::face_search::scenes::{face, features, plain_face};

/// Takes (x, y) to (2x + 100, y + 50).
const DOUBLED: Matrix3<f64> = Matrix3::new(2.0, 0.0, 100.0, 0.0, 1.0, 50.0, 0.0, 0.0, 1.0);

fn line(xs: &[f64], y: f64) -> Vec<Vector2<f64>> {
    xs.iter().map(|&x| Vector2::new(x, y)).collect()
}

/// Two (face, keypoint) candidates each for features in a row, at x = 100, 110, …
fn candidates(nearest: &[[(u32, u32); 2]], ratio: &[f32]) -> (Candidates, ImageFeatures) {
    let all = nearest.as_flattened();
    let candidates = Candidates {
        k: 2,
        face: all.iter().map(|one| one.0).collect(),
        reference: all.iter().map(|one| one.1).collect(),
        distance: vec![0.0; all.len()],
        ratio: ratio.to_vec(),
    };
    let xs: Vec<f64> = (0..nearest.len())
        .map(|i| 100.0 + 10.0 * i as f64)
        .collect();
    (candidates, features(&line(&xs, 50.0)))
}

fn sorted(nearest: &[[(u32, u32); 2]], ratio: &[f32], faces: usize) -> Evidence {
    let (candidates, features) = candidates(nearest, ratio);
    Evidence::new(&candidates, features, faces).unwrap()
}

fn seen(matches: &[Match]) -> Vec<(u32, u32)> {
    matches.iter().map(|m| (m.feature, m.reference)).collect()
}

#[test]
fn matches_are_of_one_face_and_pass_the_ratio_test() {
    let nearest = [[(0, 0), (0, 1)], [(0, 1), (1, 0)], [(1, 0), (0, 0)]];
    let evidence = sorted(&nearest, &[0.1, 0.95, 0.2], 2);
    let faces = [
        plain_face(&line(&[10.0, 90.0], 10.0)),
        plain_face(&line(&[5.0], 5.0)),
    ];
    let first = evidence.of(0, &faces[0]).passing(0.8);
    assert_eq!(seen(&first), [(0, 0)]);
    assert_eq!(first[0].points.source, Vector2::new(10.0, 10.0));
    assert_eq!(first[0].points.target, Vector2::new(100.0, 50.0));
    assert_eq!(first[0].ratio, f64::from(0.1_f32));
    assert_eq!(seen(&evidence.of(1, &faces[1]).passing(0.8)), [(2, 0)]);
    assert_eq!(
        seen(&evidence.of(0, &faces[0]).passing(1.0)),
        [(0, 0), (1, 1)]
    );
    assert_eq!(
        [0.05, 0.8, 1.0].map(|ratio| evidence.count(0, ratio)),
        [0, 1, 2]
    );
    assert_eq!((evidence.features(), evidence.faces()), (3, 2));
}

#[test]
fn features_without_a_neighbour_match_nothing() {
    let evidence = sorted(&[[(NONE, NONE); 2]; 2], &[f32::INFINITY; 2], 1);
    let face = plain_face(&line(&[10.0], 10.0));
    let of_face = evidence.of(0, &face);
    assert!(of_face.passing(1.0).is_empty());
    assert!(of_face.agreeing(&Matrix3::identity(), 1e9).is_empty());
    assert_eq!(evidence.features(), 2);
}

#[test]
fn no_features_match_nothing() {
    let evidence = sorted(&[], &[], 2);
    assert!(evidence.of(1, &plain_face(&[])).passing(1.0).is_empty());
    assert_eq!(evidence.count(0, 1.0), 0);
}

#[test]
fn unknown_faces_and_keypoints_match_nothing() {
    let evidence = sorted(&[[(0, 2), (7, 0)], [(2, 0), (0, 1)]], &[0.1, 0.1], 2);
    let face = plain_face(&line(&[0.0, 5.0], 0.0));
    let of_face = evidence.of(0, &face);
    assert!(of_face.passing(1.0).is_empty());
    assert_eq!(seen(&of_face.agreeing(&DOUBLED, 1.0)), [(1, 1)]);
    for number in [2, 7, usize::MAX] {
        assert_eq!(evidence.count(number, 1.0), 0);
        assert!(evidence.of(number, &face).passing(1.0).is_empty());
    }
}

#[test]
fn the_nearest_that_agrees_is_taken_whatever_the_ratio() {
    // Seen at 100, 110, 120: the third looks more like the wrong point, the right one is second.
    let nearest = [[(0, 0), (0, 1)], [(0, 1), (0, 0)], [(0, 3), (0, 2)]];
    let evidence = sorted(&nearest, &[0.1, 2.0, 0.9], 2);
    let face = plain_face(&line(&[0.0, 5.0, 10.0, 40.0], 0.0));
    let of_face = evidence.of(0, &face);
    assert_eq!(
        seen(&of_face.agreeing(&DOUBLED, 0.5)),
        [(0, 0), (1, 1), (2, 2)]
    );
    // Where both agree, the nearer descriptor counts.
    let wide = of_face.agreeing(&DOUBLED, 100.0);
    assert_eq!(seen(&wide), [(0, 0), (1, 1), (2, 3)]);
    let shifted = Matrix3::new_translation(&Vector2::new(0.6, 0.0)) * DOUBLED;
    assert!(of_face.agreeing(&shifted, 0.5).is_empty());
    assert!(evidence.of(1, &face).agreeing(&DOUBLED, 0.5).is_empty());
}

#[test]
fn points_behind_the_camera_do_not_agree() {
    let evidence = sorted(&[[(0, 0), (NONE, NONE)]], &[0.5], 1);
    let face = plain_face(&line(&[0.0], 0.0));
    let of_face = evidence.of(0, &face);
    assert_eq!(of_face.agreeing(&DOUBLED, 0.5).len(), 1);
    assert!(of_face.agreeing(&-DOUBLED, 0.5).is_empty());
    assert!(of_face.agreeing(&Matrix3::repeat(f64::NAN), 0.5).is_empty());
}

#[test]
fn removed_features_are_gone_from_every_question() {
    let nearest = [[(0, 0), (0, 1)], [(0, 1), (0, 0)], [(0, 1), (0, 0)]];
    let evidence = sorted(&nearest, &[0.1; 3], 1);
    let face = plain_face(&line(&[0.0, 5.0], 0.0));
    let mut of_face = evidence.of(0, &face);
    of_face.remove(|one| one.points.target.x < 105.0);
    assert_eq!(seen(&of_face.passing(0.8)), [(1, 1), (2, 1)]);
    assert_eq!(seen(&of_face.agreeing(&DOUBLED, 0.5)), [(1, 1)]);
    of_face.remove(|_| true);
    assert!(of_face.passing(1.0).is_empty());
    // The evidence itself is whole.
    assert_eq!(evidence.of(0, &face).passing(0.8).len(), 3);
}

#[test]
fn the_local_map_is_from_the_reference_to_the_frame() {
    let (candidates, mut features) = candidates(&[[(0, 0), (0, 1)]], &[0.5]);
    features.scales[0] = 6.0;
    features.angles[0] = std::f32::consts::FRAC_PI_2;
    let evidence = Evidence::new(&candidates, features, 1).unwrap();
    let frames = vec![[2.0, 0.0, 0.0, 2.0], [1.0, 1.0, 1.0, 1.0]];
    let face = face(&line(&[0.0, 5.0], 0.0), frames);
    let of_face = evidence.of(0, &face);
    let one = of_face.passing(1.0)[0];
    // Three times larger, turned from x towards y.
    let map = of_face.local_map(&one).unwrap();
    assert!((map - Matrix2::new(0.0, -3.0, 3.0, 0.0)).norm() < 1e-6);
    let flat = Match {
        reference: 1,
        ..one
    };
    assert_eq!(of_face.local_map(&flat), None);
}

#[test]
fn arrays_that_do_not_fit_each_other_are_refused() {
    let changes: [fn(&mut Candidates, &mut ImageFeatures); 8] = [
        |c, _| c.k = 3,
        |c, _| c.k = 0,
        |c, _| c.face.truncate(3),
        |c, _| c.reference.push(0),
        |c, _| c.ratio.truncate(1),
        |_, f| f.points.truncate(1),
        |_, f| f.scales.push(1.0),
        |_, f| f.angles.clear(),
    ];
    for (i, change) in changes.iter().enumerate() {
        let (mut candidates, mut features) = candidates(&[[(0, 0); 2]; 2], &[0.5; 2]);
        change(&mut candidates, &mut features);
        let error = Evidence::new(&candidates, features, 1).unwrap_err();
        assert!(
            matches!(error, InputError::CandidateCount { .. }),
            "change {i}"
        );
    }
}

#[test]
fn features_that_are_not_finite_are_refused() {
    let changes: [fn(&mut ImageFeatures); 3] = [
        |f| f.points[1].y = f64::NAN,
        |f| f.scales[0] = f32::INFINITY,
        |f| f.angles[1] = f32::NAN,
    ];
    for change in changes {
        let (candidates, mut features) = candidates(&[[(0, 0); 2]; 2], &[0.5; 2]);
        change(&mut features);
        let error = Evidence::new(&candidates, features, 1).unwrap_err();
        assert_eq!(error, InputError::NotFinite { what: "features" });
    }
}
