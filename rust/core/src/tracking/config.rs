//! Settings of following.

use crate::InputError;
use crate::alignment::AlignmentConfig;
use crate::fused::FusedConfig;

/// When a face counts as seen.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackingConfig {
    /// Fewer tiles that agree with the reference are no evidence.
    pub min_tiles: usize,
    /// Share of the tiles in the image that agree, at least: the rest may be hidden.
    pub min_share: f64,
    /// Mean correlation of those, at least.
    pub min_score: f64,
    /// The alignment may depart from a rigid view by this factor.
    pub max_stretch: f64,
    /// Shortest side of the outline [px], at least.
    pub min_side: f64,
    /// A face seen more obliquely is not looked at [rad].
    pub max_view_angle: f64,
    /// Of the grey values.
    pub alignment: AlignmentConfig,
    /// Of the pose.
    pub pose: FusedConfig,
}

impl Default for TrackingConfig {
    fn default() -> Self {
        Self {
            min_tiles: 12,
            min_share: 0.3,
            min_score: 0.7,
            max_stretch: 1.2,
            min_side: 12.0,
            max_view_angle: 82f64.to_radians(),
            // A prediction is farther off than matches are.
            alignment: AlignmentConfig {
                renderings: 3,
                ..AlignmentConfig::default()
            },
            pose: FusedConfig::default(),
        }
    }
}

impl TrackingConfig {
    /// Checks the ranges.
    ///
    /// # Errors
    /// [`InputError::OutOfRange`] with the name of the setting.
    pub fn check(&self) -> Result<(), InputError> {
        let shares = [("min_share", self.min_share), ("min_score", self.min_score)];
        for (name, value) in shares {
            if !(0.0..1.0).contains(&value) {
                return Err(out_of_range(name, value, "0 … 1, not 1"));
            }
        }
        if !self.max_stretch.is_finite() || self.max_stretch <= 1.0 {
            return Err(out_of_range(
                "max_stretch",
                self.max_stretch,
                "> 1 and finite",
            ));
        }
        if !self.min_side.is_finite() || self.min_side < 4.0 {
            return Err(out_of_range("min_side", self.min_side, "≥ 4 px and finite"));
        }
        if self.min_tiles < 4 {
            return Err(out_of_range("min_tiles", self.min_tiles as f64, "≥ 4"));
        }
        let angle = self.max_view_angle;
        if !(angle > 0.0 && angle < std::f64::consts::FRAC_PI_2) {
            return Err(out_of_range("max_view_angle", angle, "> 0 and < π/2 rad"));
        }
        self.alignment.check()?;
        self.pose.pnp.check()?;
        self.pose.depth.check()
    }
}

fn out_of_range(name: &'static str, value: f64, valid: &'static str) -> InputError {
    InputError::OutOfRange { name, value, valid }
}
