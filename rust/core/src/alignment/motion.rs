//! The homography of the frame that most tiles agree with.

use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

use super::displacement::Displacement;
use super::view::{Centred, PARAMETERS};
use crate::robust::{self, median};

/// Rounds of iteratively reweighted least squares an iteration.
const REWEIGHTINGS: usize = 2;
/// The median of the squared norm of a whitened 2-vector: 2·ln 2.
const MEDIAN_SQUARED: f64 = 1.386;

/// Normal equations of the eight parameters.
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

    /// A point that the frame shows displaced by `offset`, with this information.
    pub fn add(
        &mut self,
        jacobian: &SMatrix<f64, 2, PARAMETERS>,
        offset: &Vector2<f64>,
        information: &Matrix2<f64>,
    ) {
        let weighted = jacobian.transpose() * information;
        self.matrix += weighted * jacobian;
        self.vector += weighted * offset;
    }

    /// The parameters; `None` where they are undetermined.
    pub fn solve(&self) -> Option<SVector<f64, PARAMETERS>> {
        let parameters = self.matrix.cholesky()?.solve(&self.vector);
        parameters
            .iter()
            .all(|v| v.is_finite())
            .then_some(parameters)
    }
}

/// A tile's displacement as it enters the normal equations.
#[derive(Debug, Clone)]
pub struct Observation {
    jacobian: SMatrix<f64, 2, PARAMETERS>,
    offset: Vector2<f64>,
    information: Matrix2<f64>,
    weight: f64,
}

impl Observation {
    /// `floor` is the standard deviation of errors that the grey values do not show \[px\]; `None`
    /// where the covariance is singular.
    pub fn new(displacement: &Displacement, centred: &Centred, floor: f64) -> Option<Self> {
        let covariance = displacement.covariance + Matrix2::identity() * floor.powi(2);
        Some(Self {
            jacobian: centred.jacobian(displacement.predicted),
            offset: displacement.offset,
            information: covariance.try_inverse()?,
            weight: 1.0,
        })
    }

    fn squared_residual(&self, parameters: &SVector<f64, PARAMETERS>) -> f64 {
        let residual = self.offset - self.jacobian * parameters;
        residual.dot(&(self.information * residual))
    }
}

/// The parameters that most observations agree with, under Cauchy's loss at their own scale.
///
/// `prior` is what is known without them. `squares` is scratch. Returns the parameters and the
/// information of all; `None` where they are undetermined.
pub fn solve(
    observations: &mut [Observation],
    prior: &Information,
    squares: &mut Vec<f64>,
) -> Option<(SVector<f64, PARAMETERS>, Information)> {
    let mut information = weighted(observations, prior);
    let mut parameters = information.solve()?;
    for _ in 0..REWEIGHTINGS {
        squares.clear();
        squares.extend(observations.iter().map(|o| o.squared_residual(&parameters)));
        let scale = (median(squares)? / MEDIAN_SQUARED).max(1.0);
        for observation in observations.iter_mut() {
            let squared = observation.squared_residual(&parameters) / scale;
            observation.weight = robust::cauchy(squared).1 / scale;
        }
        information = weighted(observations, prior);
        parameters = information.solve()?;
    }
    Some((parameters, information))
}

fn weighted(observations: &[Observation], prior: &Information) -> Information {
    let mut information = prior.clone();
    for observation in observations {
        information.add(
            &observation.jacobian,
            &observation.offset,
            &(observation.information * observation.weight),
        );
    }
    information
}
