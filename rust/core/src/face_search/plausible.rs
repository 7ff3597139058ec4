//! Can a homography be a view of the face at all?

use nalgebra::{Matrix3, Vector2};

use super::face::SearchedFace;
use super::refusal::Refusal;
use super::settings::SearchSettings;
use crate::Camera;
use crate::convex_hull::hull_area;
use crate::homography::Rigidity;

/// The corners of a face in the frame (undistorted pixels), if they can be the outline of a view.
///
/// # Errors
/// Why they cannot.
pub fn outline(
    H: &Matrix3<f64>,
    face: &SearchedFace,
    camera: &Camera,
    settings: &SearchSettings,
) -> Result<[Vector2<f64>; 4], Refusal> {
    let outline = convex_outline(H, face)?;
    let sides = sides(&outline);
    let shortest = sides.iter().map(|s| s.norm()).fold(f64::INFINITY, f64::min);
    if shortest < settings.min_side {
        return Err(Refusal::ShortSide {
            side: shortest,
            least: settings.min_side,
        });
    }
    let [a, b, c, d] = outline;
    let (low, high) = (a.inf(&b).inf(&c).inf(&d), a.sup(&b).sup(&c).sup(&d));
    let (width, height) = (camera.width as f64, camera.height as f64);
    if high.x < 0.0 || high.y < 0.0 || low.x > width || low.y > height {
        return Err(Refusal::OutsideImage);
    }
    Ok(outline)
}

/// The corners of a face in the frame (undistorted pixels), if they are those of a plane seen from
/// its front.
///
/// # Errors
/// Why they are not.
pub fn convex_outline(H: &Matrix3<f64>, face: &SearchedFace) -> Result<[Vector2<f64>; 4], Refusal> {
    let mapped = face.corners().map(|corner| H * corner.push(1.0));
    let behind = mapped.map(|corner| corner.z <= 0.0);
    if behind.contains(&true) && !mapped.iter().all(|corner| corner.z < 0.0) {
        return Err(Refusal::BehindCamera);
    }
    let outline = mapped.map(|corner| corner.xy() / corner.z);
    let sides = sides(&outline);
    let turns = [0, 1, 2, 3].map(|i| sides[i].perp(&sides[(i + 1) % 4]));
    if turns.iter().all(|turn| *turn < 0.0) {
        return Err(Refusal::Mirrored);
    }
    if !turns.iter().all(|turn| *turn > 0.0) {
        return Err(Refusal::NotConvex);
    }
    Ok(outline)
}

fn sides(outline: &[Vector2<f64>; 4]) -> [Vector2<f64>; 4] {
    [0, 1, 2, 3].map(|i| outline[(i + 1) % 4] - outline[i])
}

/// What is known of a view of the face; `None` where the face's map to metres has no inverse.
pub fn rigidity(face: &SearchedFace, camera: &Camera) -> Option<Rigidity> {
    Rigidity::new(camera.inverse_matrix(), face.face_from_edge())
}

/// By which factor, ≥ 1, a homography departs from a rigid view of the face.
pub fn stretch(H: &Matrix3<f64>, face: &SearchedFace, camera: &Camera) -> f64 {
    rigidity(face, camera).map_or(f64::INFINITY, |rigidity| rigidity.stretch(H))
}

/// Area of the points' convex hull over the area of the reference, 0 … 1.
pub fn coverage(points: impl Iterator<Item = Vector2<f64>>, size: Vector2<f64>) -> f64 {
    hull_area(points.collect()) / (size.x * size.y)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::{SMatrix, SVector};

    use super::*;
    use crate::face_search::scenes::{HEIGHT, WIDTH, camera, plain_face, settings, view};

    fn checked(H: &Matrix3<f64>) -> Result<[Vector2<f64>; 4], Refusal> {
        outline(H, &plain_face(&[]), &camera(), &settings())
    }

    fn stretched(H: &Matrix3<f64>) -> f64 {
        stretch(H, &plain_face(&[]), &camera())
    }

    /// The homography with H[2, 2] = 1 that puts the corners of the face there.
    fn onto(corners: [[f64; 2]; 4]) -> Matrix3<f64> {
        let (mut A, mut b) = (SMatrix::<f64, 8, 8>::zeros(), SVector::<f64, 8>::zeros());
        for (i, (p, [u, v])) in plain_face(&[]).corners().iter().zip(corners).enumerate() {
            let (x, y) = (p.x, p.y);
            A.set_row(2 * i, &[x, y, 1.0, 0.0, 0.0, 0.0, -u * x, -u * y].into());
            A.set_row(
                2 * i + 1,
                &[0.0, 0.0, 0.0, x, y, 1.0, -v * x, -v * y].into(),
            );
            (b[2 * i], b[2 * i + 1]) = (u, v);
        }
        let h = A.lu().solve(&b).unwrap();
        Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0)
    }

    fn box_at(x: f64, y: f64, width: f64, height: f64) -> Matrix3<f64> {
        let (right, bottom) = (x + width, y + height);
        onto([[x, y], [right, y], [right, bottom], [x, bottom]])
    }

    #[test]
    fn true_views_pass_and_are_not_stretched() {
        for tilt in [0.0, 30.0, 70.0] {
            for roll in [0.0, 90.0, 180.0, -45.0] {
                let H = view(tilt, roll);
                let outline = checked(&H).unwrap();
                let centre = outline.iter().sum::<Vector2<f64>>() / 4.0;
                assert!(
                    (centre - Vector2::new(337.0, 230.0)).norm() < 30.0,
                    "{centre}"
                );
                assert!((stretched(&H) - 1.0).abs() < 1e-6, "{tilt}° {roll}°");
                // The sign of a homography says nothing.
                assert_eq!(checked(&-H), Ok(outline));
            }
        }
    }

    #[test]
    fn the_outline_is_where_the_corners_lie() {
        let corners = [[100.0, 100.0], [310.0, 90.0], [300.0, 250.0], [90.0, 260.0]];
        for (seen, expected) in checked(&onto(corners)).unwrap().iter().zip(corners) {
            assert!((seen - Vector2::from(expected)).norm() < 1e-9);
        }
    }

    #[test]
    fn a_mirrored_outline_is_refused() {
        let H = onto([
            [300.0, 100.0],
            [100.0, 100.0],
            [100.0, 250.0],
            [300.0, 250.0],
        ]);
        assert_eq!(checked(&H), Err(Refusal::Mirrored));
    }

    #[test]
    fn crossed_and_dented_outlines_have_a_part_behind_the_camera() {
        // A homography makes such outlines only where its horizon cuts through the face.
        for corners in [
            [
                [100.0, 100.0],
                [300.0, 100.0],
                [100.0, 250.0],
                [300.0, 250.0],
            ],
            [
                [100.0, 100.0],
                [300.0, 100.0],
                [150.0, 140.0],
                [100.0, 250.0],
            ],
        ] {
            assert_eq!(checked(&onto(corners)), Err(Refusal::BehindCamera));
        }
        let mut H = view(30.0, 15.0);
        // w is 1 at the left edge and -0.5 at the right one.
        H[(2, 0)] = -1.5 / WIDTH as f64;
        assert_eq!(checked(&H), Err(Refusal::BehindCamera));
        assert_eq!(checked(&Matrix3::zeros()), Err(Refusal::BehindCamera));
    }

    #[test]
    fn outlines_without_area_are_refused() {
        let onto_a_line = Matrix3::new(1.0, 0.0, 100.0, 0.5, 0.0, 100.0, 0.0, 0.0, 1.0);
        assert_eq!(checked(&onto_a_line), Err(Refusal::NotConvex));
        assert_eq!(checked(&Matrix3::repeat(f64::NAN)), Err(Refusal::NotConvex));
    }

    #[test]
    fn short_outlines_are_refused_with_their_shortest_side() {
        for (width, height, expected) in [(4.0, 3.0, 3.0), (200.0, 7.0, 7.0)] {
            let Err(Refusal::ShortSide { side, least }) =
                checked(&box_at(100.0, 100.0, width, height))
            else {
                panic!("{width}×{height} is accepted");
            };
            assert!((side - expected).abs() < 1e-9);
            assert_eq!(least, 8.0);
        }
        let mut generous = settings();
        generous.min_side = 5.0;
        let H = box_at(100.0, 100.0, 200.0, 7.0);
        assert!(outline(&H, &plain_face(&[]), &camera(), &generous).is_ok());
    }

    #[test]
    fn outlines_outside_of_the_image_are_refused_on_every_side() {
        for (x, y) in [
            (-300.0, 100.0),
            (700.0, 100.0),
            (100.0, -200.0),
            (100.0, 500.0),
        ] {
            let H = box_at(x, y, 200.0, 150.0);
            assert_eq!(checked(&H), Err(Refusal::OutsideImage), "({x}, {y})");
        }
    }

    #[test]
    fn an_outline_that_leaves_the_image_partly_is_accepted() {
        assert!(checked(&box_at(-100.0, 100.0, 200.0, 150.0)).is_ok());
        assert!(checked(&box_at(500.0, 400.0, 200.0, 150.0)).is_ok());
    }

    #[test]
    fn a_wrong_aspect_ratio_stretches_by_its_factor() {
        // About the face's centre, seen straight on.
        let centre = Vector2::new(WIDTH as f64, HEIGHT as f64) / 2.0;
        let (there, back) = (
            Matrix3::new_translation(&-centre),
            Matrix3::new_translation(&centre),
        );
        for factor in [1.7, 2.5] {
            for scale in [Vector2::new(factor, 1.0), Vector2::new(1.0, factor)] {
                let wider = back * Matrix3::new_nonuniform_scaling(&scale) * there;
                let found = stretched(&(view(0.0, 15.0) * wider));
                assert!((found - factor).abs() < 1e-9, "{found} for {factor}");
            }
        }
    }

    #[test]
    fn skew_is_a_stretch_too() {
        // The singular values of [1 s; 0 1] have the ratio (s + √(s² + 4))² / 4.
        let s: f64 = 0.8;
        let skew = Matrix3::new(1.0, s, -120.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        let expected = (s + s.hypot(2.0)).powi(2) / 4.0;
        let found = stretched(&(view(0.0, 15.0) * skew));
        assert!((found - expected).abs() < 1e-9);
        assert!(found > settings().max_stretch);
    }

    #[test]
    fn what_has_no_second_direction_is_stretched_beyond_all_bounds() {
        let onto_a_line = Matrix3::new(1.0, 0.0, 100.0, 0.5, 0.0, 100.0, 0.0, 0.0, 1.0);
        assert!(stretched(&onto_a_line) > 1e6);
    }

    #[test]
    fn coverage_is_the_share_of_the_hull() {
        let size = Vector2::new(400.0, 300.0);
        let of = |points: &[[f64; 2]]| coverage(points.iter().map(|p| Vector2::from(*p)), size);
        let square = [
            [100.0, 100.0],
            [200.0, 100.0],
            [200.0, 200.0],
            [100.0, 200.0],
            [150.0, 150.0],
        ];
        assert_eq!(of(&square), 100.0 * 100.0 / (400.0 * 300.0));
        assert_eq!(of(&square[..2]), 0.0);
        assert_eq!(of(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [7.0, 7.0]]), 0.0);
        assert_eq!(of(&plain_face(&[]).corners().map(<[f64; 2]>::from)), 1.0);
    }
}
