//! The homography through four matches.

use nalgebra::{Matrix3, Vector3};

use super::PointMatch;

/// Triangles of conditioned points with less than this doubled area are lines.
const MIN_AREA: f64 = 1e-4;

/// Maps the four sources exactly to the four targets; `None` where three of them lie on a line, or
/// where no view of a plane from its front does so: then some triangle changes its orientation.
pub fn through(matches: &[PointMatch; 4]) -> Option<Matrix3<f64>> {
    let source = matches.map(|point| point.source.push(1.0));
    let target = matches.map(|point| point.target.push(1.0));
    for (i, j, k) in [(0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)] {
        let a = doubled_area(&source[i], &source[j], &source[k]);
        let b = doubled_area(&target[i], &target[j], &target[k]);
        if a.abs() < MIN_AREA || b.abs() < MIN_AREA || (a > 0.0) != (b > 0.0) {
            return None;
        }
    }
    let H = projective_basis(&target)? * projective_basis(&source)?.try_inverse()?;
    // H is defined up to its sign: the points lie in front of the camera.
    let sign = (H * source[0]).z.signum();
    H.iter().all(|value| value.is_finite()).then_some(H * sign)
}

/// The matrix that maps e₁, e₂, e₃ and e₁ + e₂ + e₃ to the four points.
fn projective_basis(points: &[Vector3<f64>; 4]) -> Option<Matrix3<f64>> {
    let columns = Matrix3::from_columns(&[points[0], points[1], points[2]]);
    let weights = columns.try_inverse()? * points[3];
    Some(columns * Matrix3::from_diagonal(&weights))
}

fn doubled_area(a: &Vector3<f64>, b: &Vector3<f64>, c: &Vector3<f64>) -> f64 {
    (b - a).xy().perp(&(c - a).xy())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::Vector2;

    use super::*;

    const SQUARE: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

    fn matches(targets: [[f64; 2]; 4]) -> [PointMatch; 4] {
        std::array::from_fn(|i| PointMatch {
            source: Vector2::from(SQUARE[i]),
            target: Vector2::from(targets[i]),
        })
    }

    #[test]
    fn four_points_are_mapped_exactly() {
        let quad = matches([[-0.9, -0.7], [1.2, -1.1], [0.8, 0.9], [-1.0, 1.3]]);
        let H = through(&quad).unwrap();
        for point in &quad {
            assert!(point.squared_error(&H) < 1e-24);
        }
    }

    #[test]
    fn what_no_view_from_the_front_shows_is_refused() {
        let mirrored = matches([[1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]]);
        let crossed = matches([[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]]);
        let line = matches([[-1.0, 0.0], [0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
        let point = matches([[0.5, 0.5]; 4]);
        for refused in [mirrored, crossed, line, point] {
            assert_eq!(through(&refused), None);
        }
    }
}
