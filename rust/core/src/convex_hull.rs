//! The convex hull of points in the plane.

use nalgebra::Vector2;

/// Area of the convex hull; 0 for fewer than three points and for points on a line.
///
/// Monotone chain (Andrew, Information Processing Letters 1979).
pub fn hull_area(mut points: Vec<Vector2<f64>>) -> f64 {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let below = chain(points.iter());
    let above = chain(points.iter().rev());
    let hull: Vec<Vector2<f64>> = below.into_iter().chain(above).collect();
    let doubled: f64 = (0..hull.len())
        .map(|i| hull[i].perp(&hull[(i + 1) % hull.len()]))
        .sum();
    (doubled / 2.0).abs()
}

/// The corners on one side of sorted points, without the last one.
fn chain<'a>(points: impl Iterator<Item = &'a Vector2<f64>>) -> Vec<Vector2<f64>> {
    let mut chain: Vec<Vector2<f64>> = Vec::new();
    for point in points {
        while let [.., a, b] = chain[..]
            && (b - a).perp(&(point - a)) <= 0.0
        {
            chain.pop();
        }
        chain.push(*point);
    }
    chain.pop();
    chain
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(points: &[[f64; 2]]) -> f64 {
        hull_area(points.iter().map(|p| Vector2::from(*p)).collect())
    }

    #[test]
    fn points_inside_and_on_the_edge_change_nothing() {
        let square = [
            [100.0, 100.0],
            [200.0, 100.0],
            [200.0, 200.0],
            [100.0, 200.0],
        ];
        assert_eq!(area(&square), 1e4);
        let more = [
            &square[..],
            &[[150.0, 150.0], [150.0, 100.0], [100.0, 100.0]],
        ]
        .concat();
        assert_eq!(area(&more), 1e4);
    }

    #[test]
    fn a_triangle_has_half_its_rectangle() {
        assert_eq!(area(&[[0.0, 0.0], [4.0, 0.0], [1.0, 3.0]]), 6.0);
    }

    #[test]
    fn lines_and_points_have_no_area() {
        assert_eq!(area(&[]), 0.0);
        assert_eq!(area(&[[1.0, 2.0]]), 0.0);
        assert_eq!(area(&[[1.0, 2.0], [3.0, 5.0]]), 0.0);
        assert_eq!(area(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [5.0, 5.0]]), 0.0);
    }
}
