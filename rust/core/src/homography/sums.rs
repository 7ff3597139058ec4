//! Normal equations of the eight entries of a homography, over several points at a time.

use nalgebra::{Matrix3, SMatrix, SVector};

use super::PointMatch;
use crate::robust::LogSum;

/// Eight parameters: all entries but the last, which is held at its value of the start.
pub const PARAMETERS: usize = 8;
/// Points side by side: what a 256-bit register holds.
const LANES: usize = 4;
/// Products of a vector with itself: xx, xy, xz, yy, yz, zz.
const PRODUCTS: usize = 6;

/// Sums over points of Jᵀ·r and Jᵀ·J.
///
/// The derivative of an image point (u, v) by the rows of H is (p, 0, -u·p) and (0, p, -v·p), with p
/// the source over its depth. So JᵀJ consists of p·pᵀ times 1, u, v and u² + v²: a quarter of the
/// products.
#[derive(Debug, Clone)]
pub struct Sums {
    /// Sum of the losses ln(1 + ‖r‖²/scale²); infinite where a point is not in front.
    pub cost: f64,
    /// Of p·pᵀ times each of 1, u, v, u² + v².
    products: [[f64; PRODUCTS]; 4],
    /// Of p times each component of the residual, and times their products with -u and -v together.
    residuals: [[f64; 3]; 3],
}

impl Sums {
    /// Over the points with Cauchy's weights at a homography.
    pub fn at(H: &Matrix3<f64>, points: &[PointMatch], inverse_scale: f64) -> Self {
        pulp::Arch::new().dispatch(Task {
            H,
            points,
            information: inverse_scale * inverse_scale,
        })
    }

    /// Gradient and Hessian by the first eight entries of H, row by row.
    pub fn normal(
        &self,
    ) -> (
        SVector<f64, PARAMETERS>,
        SMatrix<f64, PARAMETERS, PARAMETERS>,
    ) {
        const INDEX: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];
        let [one, u, v, both] = &self.products;
        let zero = &[0.0; PRODUCTS];
        let blocks = [[one, zero, u], [zero, one, v], [u, v, both]];
        let sign = |i: usize, j: usize| match (i == 2) ^ (j == 2) {
            true => -1.0,
            false => 1.0,
        };
        let hessian = SMatrix::from_fn(|row, column| {
            let (i, j) = (row / 3, column / 3);
            sign(i, j) * blocks[i][j][INDEX[row % 3][column % 3]]
        });
        let gradient = SVector::from_fn(|row, _| self.residuals[row / 3][row % 3]);
        (gradient, hessian)
    }
}

/// A sum to be compiled for each instruction set.
struct Task<'a> {
    H: &'a Matrix3<f64>,
    points: &'a [PointMatch],
    /// Inverse of the squared scale.
    information: f64,
}

impl pulp::NullaryFnOnce for Task<'_> {
    type Output = Sums;

    #[inline(always)]
    fn call(self) -> Sums {
        let mut lanes = LaneSums::default();
        let (whole, rest) = self.points.as_chunks::<LANES>();
        for points in whole {
            lanes.add(self.H, points, &[1.0; LANES], self.information);
        }
        if let Some(first) = rest.first() {
            let mut last = [*first; LANES];
            last[..rest.len()].copy_from_slice(rest);
            let counts = std::array::from_fn(|i| if i < rest.len() { 1.0 } else { 0.0 });
            lanes.add(self.H, &last, &counts, self.information);
        }
        lanes.total()
    }
}

#[derive(Default)]
struct LaneSums {
    losses: LogSum,
    is_behind: bool,
    products: [[[f64; LANES]; PRODUCTS]; 4],
    residuals: [[[f64; LANES]; 3]; 3],
}

impl LaneSums {
    /// Adds points that each count so often: once, or never to fill up the lanes.
    #[inline(always)]
    fn add(
        &mut self,
        H: &Matrix3<f64>,
        points: &[PointMatch; LANES],
        counts: &[f64; LANES],
        information: f64,
    ) {
        let mut factors = [0.0; LANES];
        let mut depths = [0.0; LANES];
        for i in 0..LANES {
            let (x, y) = (points[i].source.x, points[i].source.y);
            let depth = H.m31 * x + H.m32 * y + H.m33;
            let inverse = 1.0 / depth;
            let u = (H.m11 * x + H.m12 * y + H.m13) * inverse;
            let v = (H.m21 * x + H.m22 * y + H.m23) * inverse;
            let (du, dv) = (u - points[i].target.x, v - points[i].target.y);
            let factor = 1.0 + counts[i] * information * (du * du + dv * dv);
            let weight = counts[i] * information / factor;
            let p = [x * inverse, y * inverse, inverse];
            let [a, b, c] = p.map(|value| weight * value);
            let products = [a * p[0], a * p[1], a * p[2], b * p[1], b * p[2], c * p[2]];
            let scales = [1.0, u, v, u * u + v * v];
            for (sums, scale) in self.products.iter_mut().zip(scales) {
                for (sum, product) in sums.iter_mut().zip(products) {
                    sum[i] += scale * product;
                }
            }
            let scales = [du, dv, -(u * du + v * dv)];
            for (sums, scale) in self.residuals.iter_mut().zip(scales) {
                for (sum, value) in sums.iter_mut().zip([a, b, c]) {
                    sum[i] += scale * value;
                }
            }
            (factors[i], depths[i]) = (factor, depth);
        }
        self.is_behind |= depths.iter().any(|&depth| depth <= 0.0);
        for factor in factors {
            self.losses.add(factor);
        }
    }

    #[inline(always)]
    fn total(self) -> Sums {
        let added = |lanes: [f64; LANES]| lanes.iter().sum();
        Sums {
            cost: match self.is_behind {
                true => f64::INFINITY,
                false => self.losses.total(),
            },
            products: self.products.map(|sums| sums.map(added)),
            residuals: self.residuals.map(|sums| sums.map(added)),
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::*;
    use crate::random::SplitMix64;

    const TRUTH: Matrix3<f64> = Matrix3::new(0.6, -0.1, 200.0, 0.15, 0.5, 150.0, 1e-3, -3e-4, 1.0);
    const SCALE: f64 = 0.7;

    fn points(count: usize) -> Vec<PointMatch> {
        let mut random = SplitMix64::new(3);
        let mut point = || Vector2::new(400.0 * random.uniform(), 300.0 * random.uniform());
        (0..count)
            .map(|_| PointMatch {
                source: point(),
                target: point(),
            })
            .collect()
    }

    #[test]
    fn the_cost_is_the_sum_of_the_losses_of_any_number_of_points() {
        for count in 0..10 {
            let points = points(count);
            let losses = points
                .iter()
                .map(|p| (1.0 + p.squared_error(&TRUTH) / SCALE.powi(2)).ln());
            let expected: f64 = losses.sum();
            let sums = Sums::at(&TRUTH, &points, 1.0 / SCALE);
            assert!((sums.cost - expected).abs() <= 1e-12 * expected);
            let weights = points
                .iter()
                .map(|p| 1.0 / (SCALE.powi(2) + p.squared_error(&TRUTH)));
            let expected = weights.zip(&points).map(|(weight, p)| {
                let depth = (TRUTH * p.source.push(1.0)).z;
                weight / (depth * depth)
            });
            let expected: f64 = expected.sum();
            let found = sums.normal().1[(2, 2)];
            assert!((found - expected).abs() <= 1e-12 * expected, "{count}");
        }
    }

    #[test]
    fn a_point_that_is_not_in_front_costs_infinitely_much() {
        for count in 1..10 {
            for behind in 0..count {
                let mut points = points(count);
                points[behind].source = Vector2::new(-2000.0, 0.0);
                assert!(points[behind].squared_error(&TRUTH).is_infinite());
                assert_eq!(Sums::at(&TRUTH, &points, 1.0).cost, f64::INFINITY);
            }
        }
    }
}
