//! Something that stands still or moves: two hypotheses at once.
//!
//! A filter that follows a hand cannot smooth the pose of what stands still, and the other way round.
//! Both run side by side, as the interacting multiple model filter (Blom and Bar-Shalom, IEEE
//! Transactions on Automatic Control 33(8), 1988): at each measurement they are mixed by how probable
//! a change from one to the other is, go on by their own model, and are weighted by how well each
//! foresaw the measurement.

use nalgebra::{SMatrix, SVector, Vector3};

use super::{ERRORS, FilteredPose, Measurement, PoseFilterConfig};
use crate::InputError;

/// Neither hypothesis is ever given up: evidence for it may come.
const LEAST_PROBABILITY: f64 = 1e-6;

/// Settings; `planegrasp.tracking.MotionFilterConfig` has the defaults and says why.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModesConfig {
    /// Of something that moves.
    pub moving: PoseFilterConfig,
    /// Standard deviation by which the position of something still changes in a second [m].
    pub creep: f64,
    /// The same for its rotation [rad].
    pub angular_creep: f64,
    /// How long something still stays so, about [s].
    pub still_for: f64,
    /// How long something that moves goes on moving, about [s].
    pub moving_for: f64,
}

impl ModesConfig {
    /// Checks the ranges.
    ///
    /// # Errors
    /// [`InputError::OutOfRange`] with the name of the setting.
    pub fn check(&self) -> Result<(), InputError> {
        self.moving.check()?;
        let settings = [
            ("creep", self.creep),
            ("angular_creep", self.angular_creep),
            ("still_for", self.still_for),
            ("moving_for", self.moving_for),
        ];
        for (name, value) in settings {
            if !(value > 0.0 && value.is_finite()) {
                let valid = "> 0 and finite";
                return Err(InputError::OutOfRange { name, value, valid });
            }
        }
        Ok(())
    }

    /// Of something still: no velocity, and none gained.
    fn still(&self) -> PoseFilterConfig {
        PoseFilterConfig {
            linear_acceleration: 0.0,
            angular_acceleration: 0.0,
            linear_speed: 0.0,
            angular_speed: 0.0,
            ..self.moving
        }
    }
}

/// Both hypotheses at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionState {
    /// Where it is if it stands still.
    pub still: FilteredPose,
    /// Where it is, and how fast, if it moves.
    pub moving: FilteredPose,
    /// Probability that it moves, 0 … 1.
    pub moves: f64,
}

impl MotionState {
    /// Starts from one measurement: either may be the case.
    pub fn first(time: f64, measured: &Measurement, config: &ModesConfig) -> Self {
        Self {
            still: FilteredPose::first(time, measured, &config.still()),
            moving: FilteredPose::first(time, measured, &config.moving),
            moves: 0.5,
        }
    }

    /// Of the state [s].
    pub fn time(&self) -> f64 {
        self.moving.time
    }

    /// Pose, velocity and their covariance, of both hypotheses together.
    pub fn pose(&self) -> FilteredPose {
        mixed([&self.still, &self.moving], [1.0 - self.moves, self.moves])
    }

    /// Both hypotheses at a time that is not before the state's, each by its own model.
    pub fn predicted(&self, time: f64, config: &ModesConfig) -> Self {
        let dt = time - self.time();
        let mut still = at_rest(&self.still).predicted(time, &config.still());
        for i in 0..3 {
            still.covariance[(i, i)] += config.creep.powi(2) * dt;
            still.covariance[(3 + i, 3 + i)] += config.angular_creep.powi(2) * dt;
        }
        Self {
            still,
            moving: self.moving.predicted(time, &config.moving),
            moves: self.moves,
        }
    }

    /// The state with a measurement of a time that is not before its own taken in; `None` where
    /// neither hypothesis can explain it.
    pub fn measured(
        &self,
        time: f64,
        measured: &Measurement,
        config: &ModesConfig,
    ) -> Option<Self> {
        let expected = self.after_changes(time, config).predicted(time, config);
        let weigh = |hypothesis: &FilteredPose, settings: &PoseFilterConfig, prior: f64| {
            let corrected = hypothesis.corrected(measured, settings)?;
            let weight = prior.ln() + hypothesis.log_likelihood(measured, settings);
            Some((corrected, weight))
        };
        let still = weigh(&expected.still, &config.still(), 1.0 - expected.moves);
        let moving = weigh(&expected.moving, &config.moving, expected.moves);
        let moves = match (&still, &moving) {
            (None, None) => return None,
            (Some((_, a)), Some((_, b))) => 1.0 / (1.0 + (a - b).exp()),
            (still, _) => f64::from(u8::from(still.is_none())),
        };
        Some(Self {
            still: still.map_or(expected.still, |(state, _)| state),
            moving: moving.map_or(expected.moving, |(state, _)| state),
            moves: moves.clamp(LEAST_PROBABILITY, 1.0 - LEAST_PROBABILITY),
        })
    }

    /// What each hypothesis starts from where the object may have changed to it by a time.
    fn after_changes(&self, time: f64, config: &ModesConfig) -> Self {
        let dt = time - self.time();
        let starts = -(-dt / config.still_for).exp_m1();
        let stops = -(-dt / config.moving_for).exp_m1();
        let both = [&self.still, &self.moving];
        let (still, moving) = (1.0 - self.moves, self.moves);
        Self {
            still: mixed(both, [still * (1.0 - starts), moving * stops]),
            moving: mixed(both, [still * starts, moving * (1.0 - stops)]),
            moves: still * starts + moving * (1.0 - stops),
        }
    }
}

/// One state with the mean and the covariance of two.
fn mixed(states: [&FilteredPose; 2], weights: [f64; 2]) -> FilteredPose {
    let total = weights[0] + weights[1];
    let shares = if total > 0.0 {
        weights.map(|weight| weight / total)
    } else {
        [0.5; 2]
    };
    let origin = states[usize::from(shares[1] > shares[0])];
    let errors = states.map(|state| state.difference(origin));
    let mean: SVector<f64, ERRORS> = errors[0] * shares[0] + errors[1] * shares[1];
    let mut covariance = SMatrix::<f64, ERRORS, ERRORS>::zeros();
    for ((state, error), share) in states.iter().zip(&errors).zip(shares) {
        let spread = error - mean;
        covariance += (state.covariance + spread * spread.transpose()) * share;
    }
    FilteredPose {
        covariance,
        ..origin.moved(&mean)
    }
}

/// The state without velocity.
fn at_rest(state: &FilteredPose) -> FilteredPose {
    let mut covariance = SMatrix::<f64, ERRORS, ERRORS>::zeros();
    let pose = state.covariance.fixed_view::<6, 6>(0, 0);
    covariance.fixed_view_mut::<6, 6>(0, 0).copy_from(&pose);
    FilteredPose {
        linear_velocity: Vector3::zeros(),
        angular_velocity: Vector3::zeros(),
        covariance,
        ..state.clone()
    }
}
