//! Following against rendered poses of a smooth texture.

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector2, Vector3};

use super::*;
use crate::alignment::{AlignmentWorkspace, apply};
use crate::{Camera, GrayImage};

const SIZE: [usize; 2] = [300, 240];
/// Metres of one reference pixel.
const PIXEL: f64 = 0.001;

fn camera() -> Camera {
    Camera::new((640, 480), (525.0, 525.0), (319.5, 239.5), [0.0; 5]).unwrap()
}

fn texture(p: Vector2<f64>) -> f64 {
    let waves: f64 = (0..9)
        .map(|k| {
            let (angle, length) = (0.7 * f64::from(k), 22.0 + 5.2 * f64::from(k));
            let along = p.x * angle.cos() + p.y * angle.sin();
            (std::f64::consts::TAU * along / length + f64::from(k * k)).sin()
        })
        .sum();
    120.0 + 13.0 * waves
}

fn gray(value: f64) -> u8 {
    value.round().clamp(0.0, 255.0) as u8
}

fn face_from_edge() -> Matrix3<f64> {
    let [w, h] = SIZE.map(|side| side as f64);
    Matrix3::new(
        PIXEL,
        0.0,
        -PIXEL * w / 2.0,
        0.0,
        -PIXEL,
        PIXEL * h / 2.0,
        0.0,
        0.0,
        1.0,
    )
}

fn face(T_object_face: Isometry3<f64>) -> TrackedFace {
    let [w, h] = SIZE;
    let centre = |i: usize| Vector2::new((i % w) as f64 + 0.5, (i / w) as f64 + 0.5);
    let pixels: Vec<u8> = (0..w * h).map(|i| gray(texture(centre(i)))).collect();
    let image = GrayImage::new(w, h, &pixels).unwrap();
    let size = (w as f64 * PIXEL, h as f64 * PIXEL);
    TrackedFace::new(image, face_from_edge(), T_object_face, size).unwrap()
}

fn object() -> TrackedObject {
    let faces = vec![face(Isometry3::identity())];
    TrackedObject { faces }
}

/// A pose that looks at the camera, turned about x by an angle [rad].
fn pose(x: f64, tilt: f64) -> Isometry3<f64> {
    let facing = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI + tilt);
    Isometry3::from_parts(Translation3::new(x, 0.01, 0.8), facing)
}

/// What the camera sees of the object, with a plain area over all columns from `hidden` on.
fn frame(T: &Isometry3<f64>, hidden: usize) -> Vec<u8> {
    let H = object().faces[0].homography(T, &camera());
    let back = H.try_inverse().unwrap();
    let [w, h] = SIZE.map(|side| side as f64);
    (0..640 * 480)
        .map(|i| {
            let p = apply(&back, Vector2::new((i % 640) as f64, (i / 640) as f64));
            let inside = p.x >= 0.0 && p.y >= 0.0 && p.x <= w && p.y <= h;
            let seen = inside && i % 640 < hidden;
            gray(if seen { texture(p) } else { 90.0 })
        })
        .collect()
}

fn followed(pixels: &[u8], predicted: &Isometry3<f64>) -> Result<Followed, Lost> {
    let camera = camera();
    let sight = Sight::new(GrayImage::new(640, 480, pixels).unwrap(), None, &camera);
    let config = TrackingConfig::default();
    follow(
        &object(),
        predicted,
        &sight,
        &config,
        &mut AlignmentWorkspace::new(),
    )
}

/// Angle [rad] and distance [m] between poses.
fn error(a: &Isometry3<f64>, b: &Isometry3<f64>) -> (f64, f64) {
    let T = a.inv_mul(b);
    (T.rotation.angle(), T.translation.vector.norm())
}

#[test]
fn a_pose_is_found_from_one_beside_it() {
    let truth = pose(0.03, 0.4);
    let pixels = frame(&truth, 640);
    // 3 px and 2° off; then 20 px, where only a shift helps.
    for predicted in [pose(0.0255, 0.365), pose(0.0, 0.42)] {
        let found = followed(&pixels, &predicted).unwrap();
        let (angle, distance) = error(&found.estimate.T_camera_object, &truth);
        // Without depth and noise: rounding to grey levels, 0.29 of 25, over 100 tiles.
        assert!(angle < 2e-3 && distance < 1e-3, "{angle} rad, {distance} m");
        assert!(found.faces[0].score > 0.95);
    }
}

#[test]
fn what_is_half_hidden_is_followed_by_the_rest() {
    let truth = pose(0.0, 0.3);
    let found = followed(&frame(&truth, 320), &pose(0.002, 0.31)).unwrap();
    let (angle, distance) = error(&found.estimate.T_camera_object, &truth);
    assert!(angle < 5e-3 && distance < 3e-3, "{angle} rad, {distance} m");
    let seen = &found.faces[0];
    assert!(seen.points.len() < 6 * seen.compared / 10);
    assert!(seen.points.iter().all(|p| p.x < 0.55 * SIZE[0] as f64));
}

#[test]
fn what_is_not_there_is_lost_and_says_why() {
    let truth = pose(0.0, 0.3);
    let hidden = followed(&frame(&truth, 250), &truth);
    assert!(matches!(hidden, Err(Lost::Unlike { .. })), "{hidden:?}");
    let nothing = followed(&[90; 640 * 480], &truth);
    assert!(
        matches!(nothing, Err(Lost::Unlike { tiles: 0, .. })),
        "{nothing:?}"
    );
    let pixels = frame(&truth, 640);
    let away = Isometry3::from_parts(truth.translation, UnitQuaternion::identity());
    assert_eq!(followed(&pixels, &away), Err(Lost::TurnedAway));
    let outside = followed(&pixels, &pose(0.9, 0.3));
    assert!(
        matches!(
            outside,
            Err(Lost::Unlike { .. } | Lost::OutsideImage { .. })
        ),
        "{outside:?}"
    );
    let far = Isometry3::from_parts(Translation3::new(0.0, 0.0, 20.0), truth.rotation);
    let Err(Lost::TooSmall { side, least }) = followed(&pixels, &far) else {
        panic!("not refused");
    };
    assert!(side < least);
}

#[test]
fn two_faces_of_a_box_give_one_pose() {
    // The second face is on the right side, turned by 90° about y.
    let side = Isometry3::from_parts(
        Translation3::new(0.15, 0.0, -0.15),
        UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2),
    );
    let faces = vec![face(Isometry3::identity()), face(side)];
    let object = TrackedObject { faces };
    let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -0.7);
    let truth = pose(0.0, 0.2) * turn;
    let camera = camera();
    let mut pixels = vec![90; 640 * 480];
    for face in &object.faces {
        let back = face.homography(&truth, &camera).try_inverse().unwrap();
        for (i, pixel) in pixels.iter_mut().enumerate() {
            let p = apply(&back, Vector2::new((i % 640) as f64, (i / 640) as f64));
            if p.x >= 0.0 && p.y >= 0.0 && p.x <= SIZE[0] as f64 && p.y <= SIZE[1] as f64 {
                *pixel = gray(texture(p));
            }
        }
    }
    let sight = Sight::new(GrayImage::new(640, 480, &pixels).unwrap(), None, &camera);
    let config = TrackingConfig::default();
    let predicted = pose(0.003, 0.21) * turn;
    let found = follow(
        &object,
        &predicted,
        &sight,
        &config,
        &mut AlignmentWorkspace::new(),
    );
    let found = found.unwrap();
    assert_eq!(
        found.faces.iter().map(|f| f.face).collect::<Vec<_>>(),
        [0, 1]
    );
    let (angle, distance) = error(&found.estimate.T_camera_object, &truth);
    assert!(angle < 1e-3 && distance < 1e-3, "{angle} rad, {distance} m");
}

#[test]
fn settings_without_meaning_are_refused() {
    let default = TrackingConfig::default;
    assert_eq!(default().check(), Ok(()));
    for config in [
        TrackingConfig {
            min_tiles: 3,
            ..default()
        },
        TrackingConfig {
            min_share: 1.0,
            ..default()
        },
        TrackingConfig {
            min_score: -0.1,
            ..default()
        },
        TrackingConfig {
            max_stretch: 1.0,
            ..default()
        },
        TrackingConfig {
            min_side: f64::NAN,
            ..default()
        },
        TrackingConfig {
            max_view_angle: 1.6,
            ..default()
        },
    ] {
        assert!(config.check().is_err(), "{config:?}");
    }
}
