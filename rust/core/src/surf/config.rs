//! Settings of SURF.

use crate::InputError;

/// Settings of [`Surf`](super::Surf).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfConfig {
    /// Smallest determinant of the Hessian [grey levels²], of second derivatives that are divided
    /// by the area of their filter; ≥ 0, lower finds more.
    pub hessian_threshold: f32,
    /// Octaves of the scale space, 1 to 5.
    pub octaves: usize,
    /// Scales an octave in which keypoints are sought, 1 to 4 (the paper: 2). There is a filter
    /// more at either end.
    pub octave_layers: usize,
    /// Descriptors of 128 numbers instead of 64.
    pub extended: bool,
    /// No orientation: descriptors are taken along the image's axes.
    pub upright: bool,
    /// A budget that is spread over the image; 0 = all.
    pub max_features: usize,
}

impl Default for SurfConfig {
    fn default() -> Self {
        Self {
            hessian_threshold: 4.0,
            octaves: 4,
            octave_layers: 2,
            extended: false,
            upright: false,
            max_features: 4000,
        }
    }
}

impl SurfConfig {
    /// Bytes of a descriptor.
    pub fn descriptor_length(&self) -> usize {
        if self.extended { 128 } else { 64 }
    }

    /// Whether all settings lie in their ranges.
    ///
    /// # Errors
    /// [`InputError::OutOfRange`] for the first that does not.
    pub(super) fn check(&self) -> Result<(), InputError> {
        if !(self.hessian_threshold >= 0.0 && self.hessian_threshold.is_finite()) {
            return Err(InputError::OutOfRange {
                name: "hessian_threshold",
                value: f64::from(self.hessian_threshold),
                valid: "≥ 0 and finite",
            });
        }
        check_count("octaves", self.octaves, 5, "1 to 5")?;
        check_count("octave_layers", self.octave_layers, 4, "1 to 4")
    }
}

fn check_count(
    name: &'static str,
    value: usize,
    largest: usize,
    valid: &'static str,
) -> Result<(), InputError> {
    if (1..=largest).contains(&value) {
        return Ok(());
    }
    Err(InputError::OutOfRange {
        name,
        value: value as f64,
        valid,
    })
}
