//! A convex quadrilateral in the image.

use nalgebra::{Vector2, Vector3};

/// Four half-planes that point inwards.
#[derive(Debug, Clone)]
pub struct Quadrilateral {
    corners: [Vector2<f64>; 4],
    /// (a, b, c): a·x + b·y + c is the distance [px] inside of an edge.
    edges: [Vector3<f64>; 4],
}

impl Quadrilateral {
    /// Of corners in either sense of rotation; `None` unless they are strictly convex.
    pub fn new(corners: [Vector2<f64>; 4]) -> Option<Self> {
        let side = |i: usize| corners[(i + 1) % 4] - corners[i];
        let turns = [0, 1, 2, 3].map(|i| side(i).perp(&side((i + 1) % 4)));
        let sense = turns[0].signum();
        if !turns
            .iter()
            .all(|turn| turn.is_finite() && turn * sense > 0.0)
        {
            return None;
        }
        let edges = [0, 1, 2, 3].map(|i| {
            let direction = side(i).normalize() * sense;
            let inward = Vector2::new(-direction.y, direction.x);
            inward.push(-inward.dot(&corners[i]))
        });
        Some(Self { corners, edges })
    }

    /// Its corners [px].
    pub fn corners(&self) -> &[Vector2<f64>; 4] {
        &self.corners
    }

    /// Distance [px] from the nearest edge line; negative outside.
    pub fn depth_inside(&self, p: Vector2<f64>) -> f64 {
        let homogeneous = p.push(1.0);
        self.edges
            .iter()
            .map(|edge| edge.dot(&homogeneous))
            .fold(f64::INFINITY, f64::min)
    }

    /// Area [px²].
    pub fn area(&self) -> f64 {
        let [a, b, c, d] = self.corners;
        ((c - a).perp(&(d - b)) / 2.0).abs()
    }

    /// Smallest and largest coordinates.
    pub fn bounds(&self) -> (Vector2<f64>, Vector2<f64>) {
        let [a, b, c, d] = self.corners;
        (a.inf(&b).inf(&c).inf(&d), a.sup(&b).sup(&c).sup(&d))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn square() -> [Vector2<f64>; 4] {
        [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]].map(Vector2::from)
    }

    #[test]
    fn depth_inside_is_the_distance_from_the_edge_in_both_senses() {
        let mut reversed = square();
        reversed.reverse();
        for corners in [square(), reversed] {
            let quadrilateral = Quadrilateral::new(corners).unwrap();
            assert_eq!(quadrilateral.depth_inside(Vector2::new(2.0, 5.0)), 2.0);
            assert_eq!(quadrilateral.depth_inside(Vector2::new(5.0, 13.0)), -3.0);
            assert_eq!(quadrilateral.area(), 100.0);
            let bounds = (Vector2::new(0.0, 0.0), Vector2::new(10.0, 10.0));
            assert_eq!(quadrilateral.bounds(), bounds);
        }
    }

    #[test]
    fn only_convex_quadrilaterals_are_made() {
        let mut crossed = square();
        crossed.swap(0, 1);
        assert!(Quadrilateral::new(crossed).is_none());
        let mut dented = square();
        dented[2] = Vector2::new(2.0, 2.0);
        assert!(Quadrilateral::new(dented).is_none());
        assert!(Quadrilateral::new([Vector2::zeros(); 4]).is_none());
        let mut nan = square();
        nan[1].x = f64::NAN;
        assert!(Quadrilateral::new(nan).is_none());
    }
}
