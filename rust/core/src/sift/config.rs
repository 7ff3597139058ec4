//! Settings of SIFT.

use crate::InputError;

/// Settings of SIFT (Lowe, IJCV 2004).
#[derive(Debug, Clone, PartialEq)]
pub struct SiftConfig {
    /// A budget of keypoints, spread over the image (see [`crate::budget`]); 0 = all.
    pub max_features: usize,
    /// Scales an octave (Lowe: 3), 1 to 8.
    pub octave_layers: usize,
    /// Contrast of the extrema, in OpenCV's unit: `octave_layers` times the difference of Gaussians
    /// over the grey range. Lowe's 0.03 is 0.09 here, OpenCV's default 0.04.
    pub contrast_threshold: f64,
    /// Largest ratio of principal curvatures (Lowe: 10).
    pub edge_threshold: f64,
    /// Blur of the first scale [px of the first octave] (Lowe: 1.6), 1 to 3.2.
    pub sigma: f64,
    /// Whether the first octave has twice the resolution of the image (Lowe: yes).
    pub double_first_octave: bool,
}

impl Default for SiftConfig {
    fn default() -> Self {
        Self {
            max_features: 5000,
            octave_layers: 3,
            contrast_threshold: 0.015,
            edge_threshold: 10.0,
            sigma: 1.6,
            double_first_octave: true,
        }
    }
}

impl SiftConfig {
    /// Whether every setting lies in its range.
    ///
    /// # Errors
    /// [`InputError::OutOfRange`] for the first that does not.
    pub fn check(&self) -> Result<(), InputError> {
        let layers = self.octave_layers;
        if !(1..=8).contains(&layers) {
            return Err(out_of_range("octave_layers", layers as f64, "1 to 8"));
        }
        let ranges = [
            ("contrast_threshold", self.contrast_threshold, 0.001, 1.0),
            ("edge_threshold", self.edge_threshold, 1.0, 1e6),
            ("sigma", self.sigma, 1.0, 3.2),
        ];
        let valid = ["0.001 to 1", "1 to 1000000", "1 to 3.2 px"];
        for ((name, value, low, high), valid) in ranges.into_iter().zip(valid) {
            if !(low..=high).contains(&value) {
                return Err(out_of_range(name, value, valid));
            }
        }
        Ok(())
    }
}

fn out_of_range(name: &'static str, value: f64, valid: &'static str) -> InputError {
    InputError::OutOfRange { name, value, valid }
}
