//! What is assumed of a motion.

use crate::InputError;

/// Settings of the filter; `planegrasp.pose_filter.PoseFilterConfig` has the defaults and says why.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseFilterConfig {
    /// Standard deviation of what changes the velocity in a second [m/s²].
    pub linear_acceleration: f64,
    /// The same for the rotation [rad/s²].
    pub angular_acceleration: f64,
    /// Standard deviation of the velocity before it was ever measured [m/s].
    pub linear_speed: f64,
    /// The same for the rotation [rad/s].
    pub angular_speed: f64,
    /// Standard deviation of a motion too fast to follow, beside a measurement's own error [m].
    pub tremor: f64,
    /// The same for the rotation [rad].
    pub angular_tremor: f64,
    /// Measurements whose squared Mahalanobis distance is more than its square above 6 are refused.
    pub gate: f64,
}

impl PoseFilterConfig {
    /// Checks the ranges.
    ///
    /// # Errors
    /// [`InputError::OutOfRange`] with the name of the setting.
    pub fn check(&self) -> Result<(), InputError> {
        let settings = [
            (
                "linear_acceleration of the pose filter",
                self.linear_acceleration,
            ),
            (
                "angular_acceleration of the pose filter",
                self.angular_acceleration,
            ),
            ("linear_speed of the pose filter", self.linear_speed),
            ("angular_speed of the pose filter", self.angular_speed),
            ("tremor of the pose filter", self.tremor),
            ("angular_tremor of the pose filter", self.angular_tremor),
        ];
        for (name, value) in settings {
            if !(value >= 0.0 && value.is_finite()) {
                let valid = "≥ 0 and finite";
                return Err(InputError::OutOfRange { name, value, valid });
            }
        }
        let value = self.gate;
        if !(value > 0.0 && value.is_finite()) {
            return Err(InputError::OutOfRange {
                name: "gate of the pose filter",
                value,
                valid: "> 0 and finite",
            });
        }
        Ok(())
    }
}
