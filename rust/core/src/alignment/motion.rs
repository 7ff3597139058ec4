//! The homography of the frame that most tiles agree with.

use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

use super::view::{Centred, PARAMETERS};
use crate::robust::{cauchy_weight, median, tukey_weight};

/// The median of the squared norm of a whitened 2-vector: 2·ln 2.
const MEDIAN_SQUARED: f64 = 1.386;

/// Normal equations of the eight parameters of [`Centred::homography`].
#[derive(Debug, Clone)]
pub struct Information {
    /// Information of the parameters.
    pub matrix: SMatrix<f64, PARAMETERS, PARAMETERS>,
    /// Information times parameters.
    pub vector: SVector<f64, PARAMETERS>,
}

impl Information {
    /// None yet.
    pub fn none() -> Self {
        Self {
            matrix: SMatrix::zeros(),
            vector: SVector::zeros(),
        }
    }

    /// Adds JᵀWJ and JᵀWd of one observation, W its information times its weight.
    ///
    /// J = \[hᵀ, 0, -x·qᵀ; 0, hᵀ, -y·qᵀ\] for h = (x, y, 1) and q = (x, y), so that the blocks are
    /// products of W's entries with h·hᵀ, h·qᵀ and q·qᵀ. Only the upper triangle is filled.
    #[inline(always)]
    fn add(&mut self, observation: &Observation, weight: f64) {
        let [x, y] = observation.point;
        let [a, b, c] = observation.information.map(|entry| weight * entry);
        let [u, v] = observation.offset;
        let (h, q) = ([x, y, 1.0], [x, y]);
        let (ax_by, bx_cy) = (a * x + b * y, b * x + c * y);
        let (au_bv, bu_cv) = (a * u + b * v, b * u + c * v);
        let N = &mut self.matrix;
        for i in 0..3 {
            for j in i..3 {
                let hh = h[i] * h[j];
                N[(i, j)] += a * hh;
                N[(3 + i, 3 + j)] += c * hh;
            }
            for (j, h_j) in h.iter().enumerate() {
                N[(i, 3 + j)] += b * h[i] * h_j;
            }
            for j in 0..2 {
                let hq = h[i] * q[j];
                N[(i, 6 + j)] -= ax_by * hq;
                N[(3 + i, 6 + j)] -= bx_cy * hq;
            }
            self.vector[i] += au_bv * h[i];
            self.vector[3 + i] += bu_cv * h[i];
        }
        let along = x * ax_by + y * bx_cy;
        let pull = x * au_bv + y * bu_cv;
        for i in 0..2 {
            for j in i..2 {
                N[(6 + i, 6 + j)] += along * q[i] * q[j];
            }
            self.vector[6 + i] -= pull * q[i];
        }
    }

    /// The same with both triangles.
    fn filled(mut self) -> Self {
        self.matrix.fill_lower_triangle_with_upper_triangle();
        self
    }

    /// The parameters; `None` where they are undetermined.
    fn solve(&self) -> Option<SVector<f64, PARAMETERS>> {
        let parameters = self.matrix.cholesky()?.solve(&self.vector);
        (parameters.iter().all(|v| v.is_finite())).then_some(parameters)
    }
}

/// A point that the frame shows displaced, in the coordinates of [`Centred`].
#[derive(Debug, Clone)]
pub struct Observation {
    point: [f64; 2],
    offset: [f64; 2],
    /// Entries xx, xy and yy.
    information: [f64; 3],
    weight: f64,
}

impl Observation {
    /// A point that is displaced by `offset`, all in pixels; `None` where the covariance is singular.
    #[inline(always)]
    pub fn new(
        point: Vector2<f64>,
        offset: Vector2<f64>,
        covariance: Matrix2<f64>,
        centred: &Centred,
    ) -> Option<Self> {
        let information = covariance.try_inverse()? * centred.scale().powi(2);
        Some(Self {
            point: centred.point(point).into(),
            offset: (offset / centred.scale()).into(),
            information: [information.m11, information.m12, information.m22],
            weight: 1.0,
        })
    }

    /// How much it counted at last.
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// Squared distance from where the parameters put the point, in sigmas.
    #[inline(always)]
    fn squared_residual(&self, p: &SVector<f64, PARAMETERS>) -> f64 {
        let [x, y] = self.point;
        let projective = p[6] * x + p[7] * y;
        let u = self.offset[0] - (p[0] * x + p[1] * y + p[2] - x * projective);
        let v = self.offset[1] - (p[3] * x + p[4] * y + p[5] - y * projective);
        let [a, b, c] = self.information;
        a * u * u + 2.0 * b * u * v + c * v * v
    }
}

/// What observations of certain weight say.
pub fn certain(observations: impl Iterator<Item = Observation>) -> Information {
    let mut information = Information::none();
    observations.for_each(|observation| information.add(&observation, 1.0));
    information
}

/// The parameters that most observations agree with, at their own scale: from least squares over
/// Cauchy's weights to Tukey's, which leave what is far off out.
/// `prior` is what is known without them. `squares` is scratch. Returns the parameters and the
/// information of all; `None` where they are undetermined.
#[inline(always)]
pub fn solve(
    observations: &mut [Observation],
    prior: &Information,
    squares: &mut Vec<f64>,
) -> Option<(SVector<f64, PARAMETERS>, Information)> {
    let mut information = weighted(observations, prior);
    let mut parameters = information.solve()?;
    for weight in [cauchy_weight, biweight] {
        squares.clear();
        squares.extend(observations.iter().map(|o| o.squared_residual(&parameters)));
        let scale = (median(squares)? / MEDIAN_SQUARED).max(1.0);
        for observation in observations.iter_mut() {
            let squared = observation.squared_residual(&parameters) / scale;
            observation.weight = weight(squared) / scale;
        }
        information = weighted(observations, prior);
        parameters = information.solve()?;
    }
    Some((parameters, information))
}

fn biweight(squared: f64) -> f64 {
    tukey_weight(squared.sqrt())
}

#[inline(always)]
fn weighted(observations: &[Observation], prior: &Information) -> Information {
    let mut information = prior.clone();
    for observation in observations {
        information.add(observation, observation.weight);
    }
    information.filled()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::random::SplitMix64;

    const OUTLINE: [Vector2<f64>; 4] = [
        Vector2::new(100.0, 80.0),
        Vector2::new(300.0, 90.0),
        Vector2::new(280.0, 260.0),
        Vector2::new(120.0, 240.0),
    ];
    const COVARIANCE: Matrix2<f64> = Matrix2::new(0.04, 0.01, 0.01, 0.02);

    #[test]
    fn the_normal_equations_are_those_of_the_jacobian() {
        let centred = Centred::about(&OUTLINE);
        let (point, offset) = (Vector2::new(150.0, 100.0), Vector2::new(0.3, -0.2));
        let observation = Observation::new(point, offset, COVARIANCE, &centred).unwrap();
        let information = certain([observation].into_iter()).filled();
        let J = centred.jacobian(point);
        let W = COVARIANCE.try_inverse().unwrap();
        let expected = J.transpose() * W * J;
        assert!((information.matrix - expected).amax() < 1e-9 * expected.amax());
        let expected = J.transpose() * W * offset;
        assert!((information.vector - expected).amax() < 1e-9 * expected.amax());
    }

    #[test]
    fn a_third_of_wrong_displacements_does_not_pull() {
        let centred = Centred::about(&OUTLINE);
        let truth = SVector::from([0.01, -0.02, 0.005, 0.015, 0.0, -0.01, 0.01, -0.005]);
        let mut random = SplitMix64::new(1);
        let mut observations: Vec<_> = (0..90)
            .map(|i| {
                let mut draw = |low: f64, high: f64| low + (high - low) * random.uniform();
                let point = Vector2::new(draw(120.0, 290.0), draw(90.0, 250.0));
                let mut offset = centred.jacobian(point) * truth;
                if i % 3 == 0 {
                    offset += Vector2::new(draw(1.0, 3.0), draw(-3.0, 3.0));
                } else {
                    offset += Vector2::new(random.normal(), random.normal()) * 0.14;
                }
                Observation::new(point, offset, COVARIANCE, &centred).unwrap()
            })
            .collect();
        let (found, _) = solve(&mut observations, &Information::none(), &mut Vec::new()).unwrap();
        for corner in OUTLINE {
            let error = centred.jacobian(corner) * (found - truth);
            // 60 points of 0.14 px: 0.14·√(8/60) ≈ 0.05 px inside, about three times that at the
            // corners, outside of the points.
            assert!(error.norm() < 0.25, "{error}");
        }
    }

    #[test]
    fn too_few_points_determine_nothing() {
        let centred = Centred::about(&OUTLINE);
        let observation =
            Observation::new(OUTLINE[0], Vector2::zeros(), COVARIANCE, &centred).unwrap();
        let mut observations = vec![observation; 5];
        let solved = solve(&mut observations, &Information::none(), &mut Vec::new());
        assert!(solved.is_none());
        assert!(solve(&mut [], &Information::none(), &mut Vec::new()).is_none());
    }
}
