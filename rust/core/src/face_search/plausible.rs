//! Can a homography be a view of the face at all?

use nalgebra::{Matrix3, Vector2};

use super::face::SearchedFace;
use super::refusal::Refusal;
use super::settings::SearchSettings;
use crate::Camera;
use crate::convex_hull::hull_area;

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
    let mapped = face.corners().map(|corner| H * corner.push(1.0));
    let behind = mapped.map(|corner| corner.z <= 0.0);
    if behind.contains(&true) && !mapped.iter().all(|corner| corner.z < 0.0) {
        return Err(Refusal::BehindCamera);
    }
    let outline = mapped.map(|corner| corner.xy() / corner.z);
    let sides = [0, 1, 2, 3].map(|i| outline[(i + 1) % 4] - outline[i]);
    let turns = [0, 1, 2, 3].map(|i| sides[i].perp(&sides[(i + 1) % 4]));
    if turns.iter().all(|turn| *turn < 0.0) {
        return Err(Refusal::Mirrored);
    }
    if !turns.iter().all(|turn| *turn > 0.0) {
        return Err(Refusal::NotConvex);
    }
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

/// By which factor, ≥ 1, a view departs from a rigid one of a face of this width and height.
///
/// For H = K · (r₁ r₂ t) · edge-to-face, K⁻¹ · H · face-to-edge has columns proportional to r₁ and
/// r₂, equally long and orthogonal; the ratio of the singular values has both faults.
pub fn stretch(H: &Matrix3<f64>, face: &SearchedFace, camera: &Camera) -> f64 {
    let Some(edge_from_face) = face.face_from_edge().try_inverse() else {
        return f64::INFINITY;
    };
    let metric = camera.inverse_matrix() * H * edge_from_face;
    let (a, b) = (metric.column(0), metric.column(1));
    // Eigenvalues of the 2×2 Gram matrix are the squared singular values.
    let (aa, ab, bb) = (a.dot(&a), a.dot(&b), b.dot(&b));
    let (mean, half) = ((aa + bb) / 2.0, ((aa - bb) / 2.0).hypot(ab));
    ((mean + half) / (mean - half).max(f64::MIN_POSITIVE)).sqrt()
}

/// Area of the points' convex hull over the area of the reference, 0 … 1.
pub fn coverage(points: impl Iterator<Item = Vector2<f64>>, size: Vector2<f64>) -> f64 {
    hull_area(points.collect()) / (size.x * size.y)
}
