//! Levenberg-Marquardt on normal equations of a small, fixed size.

use nalgebra::{Const, DimMin, SMatrix, SVector};

const MAX_ITERATIONS: usize = 50;
const MAX_REJECTIONS: usize = 12;
const START_DAMPING: f64 = 1e-4;
/// Costs are squared residuals in sigmas: a change of 1e-9 moves no parameter by 1e-4 sigma.
const COST_TOLERANCE: f64 = 1e-9;

/// How exactly a minimum is approached: the change of the cost, relative to it, that ends it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Precision {
    /// For a start of a later minimisation.
    Coarse,
    /// To a hundredth of a sigma with a thousand residuals, and exactly where they vanish.
    Fine,
}

impl Precision {
    fn tolerance(self, cost: f64) -> f64 {
        let relative = match self {
            Self::Coarse => 1e-3,
            Self::Fine => 1e-7,
        };
        COST_TOLERANCE + relative * cost
    }
}

/// A robust least-squares problem in N local parameters, linearised at a state.
pub trait LeastSquares<const N: usize> {
    /// A point of the parameter space.
    type State: Clone;

    /// Sum of the losses, infinite where the state is impossible, half gradient and Gauss-Newton half
    /// Hessian with the losses' weights.
    fn linearize(&self, state: &Self::State) -> Normal<N>;

    /// Moves the state by a local step.
    fn moved(&self, state: &Self::State, step: &SVector<f64, N>) -> Self::State;
}

/// Normal equations: JᵀWr and JᵀWJ with the cost at the same state.
#[derive(Debug, Clone)]
pub struct Normal<const N: usize> {
    /// Sum of losses.
    pub cost: f64,
    /// JᵀWr.
    pub gradient: SVector<f64, N>,
    /// JᵀWJ.
    pub hessian: SMatrix<f64, N, N>,
}

/// Where minimisation ended.
#[derive(Debug, Clone)]
pub struct Minimum<S, const N: usize> {
    /// The best state.
    pub state: S,
    /// The problem there.
    pub normal: Normal<N>,
}

/// Descends from `start` to a local minimum; `None` where the cost is not finite at the start or
/// the problem determines no step.
pub fn minimize<const N: usize, P: LeastSquares<N>>(
    problem: &P,
    start: P::State,
    precision: Precision,
) -> Option<Minimum<P::State, N>>
where
    Const<N>: DimMin<Const<N>, Output = Const<N>>,
{
    let mut state = start;
    let mut normal = problem.linearize(&state);
    if !normal.cost.is_finite() {
        return None;
    }
    let mut damping = START_DAMPING;
    let mut rejections = 0;
    for _ in 0..MAX_ITERATIONS {
        let step = damped_step(&normal, damping)?;
        // Most steps are accepted: then the normal equations are needed, too.
        let trial = problem.moved(&state, &step);
        let there = problem.linearize(&trial);
        let decrease = normal.cost - there.cost;
        if decrease >= 0.0 {
            (state, normal) = (trial, there);
            damping = (damping * 0.1).max(1e-12);
            rejections = 0;
        } else {
            damping *= 10.0;
            rejections += 1;
        }
        if decrease.abs() < precision.tolerance(normal.cost) || rejections > MAX_REJECTIONS {
            break;
        }
    }
    Some(Minimum { state, normal })
}

fn damped_step<const N: usize>(normal: &Normal<N>, damping: f64) -> Option<SVector<f64, N>>
where
    Const<N>: DimMin<Const<N>, Output = Const<N>>,
{
    let mut damped = normal.hessian;
    for i in 0..N {
        damped[(i, i)] += damping * normal.hessian[(i, i)];
    }
    let step = -damped.cholesky()?.solve(&normal.gradient);
    step.iter().all(|value| value.is_finite()).then_some(step)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// Rosenbrock's valley as residuals (1 - x, 10 (y - x²)); minimum at (1, 1).
    struct Valley;

    impl LeastSquares<2> for Valley {
        type State = SVector<f64, 2>;

        fn linearize(&self, p: &Self::State) -> Normal<2> {
            let residual = SVector::<f64, 2>::new(1.0 - p.x, 10.0 * (p.y - p.x * p.x));
            let jacobian = SMatrix::<f64, 2, 2>::new(-1.0, 0.0, -20.0 * p.x, 10.0);
            Normal {
                cost: residual.norm_squared(),
                gradient: jacobian.transpose() * residual,
                hessian: jacobian.transpose() * jacobian,
            }
        }

        fn moved(&self, p: &Self::State, step: &SVector<f64, 2>) -> Self::State {
            p + step
        }
    }

    #[test]
    fn descends_a_curved_valley() {
        let minimum =
            minimize(&Valley, SVector::<f64, 2>::new(-1.2, 1.0), Precision::Fine).unwrap();
        assert!((minimum.state - SVector::<f64, 2>::new(1.0, 1.0)).norm() < 1e-6);
        assert!(minimum.normal.cost < 1e-12);
    }

    #[test]
    fn a_start_without_a_finite_cost_has_no_minimum() {
        assert!(
            minimize(
                &Valley,
                SVector::<f64, 2>::new(f64::NAN, 0.0),
                Precision::Fine
            )
            .is_none()
        );
    }
}
