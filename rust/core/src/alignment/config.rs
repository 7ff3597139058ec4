//! Settings of the alignment.

use crate::InputError;

/// Settings; the defaults suit a start from keypoint matches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AlignmentConfig {
    /// At most so many tiles of 8×8 pixels are compared.
    pub max_tiles: usize,
    /// Fewer tiles than this that agree with the reference are no evidence.
    pub min_tiles: usize,
    /// Tiles whose correlation with the reference is lower than this show something else.
    pub min_correlation: f64,
    /// A corner may move this far from the start \[px\].
    pub max_motion: f64,
    /// Standard deviation of the start's corners \[px\], the prior of the refinement.
    pub start_sigma: f64,
    /// Errors of a tile's displacement that its grey values do not show \[px\], for example because
    /// the face is not quite flat.
    pub displacement_floor: f64,
    /// At most so many iterations on one rendering; on the first, of a third of the tiles and of all.
    pub max_iterations: usize,
    /// At most so many times the reference is rendered, each by the homography found on the one
    /// before: interpolating the frame at fractions of a pixel blurs and shifts it a little. At
    /// least 2.
    pub renderings: usize,
}

impl Default for AlignmentConfig {
    fn default() -> Self {
        Self {
            max_tiles: 128,
            min_tiles: 8,
            min_correlation: 0.5,
            max_motion: 20.0,
            start_sigma: 2.0,
            displacement_floor: 0.03,
            max_iterations: 10,
            renderings: 2,
        }
    }
}

impl AlignmentConfig {
    /// Checks the ranges.
    ///
    /// # Errors
    /// [`InputError::OutOfRange`] with the name of the setting.
    pub fn check(&self) -> Result<(), InputError> {
        let positive = [
            ("max_motion", self.max_motion),
            ("start_sigma", self.start_sigma),
            ("displacement_floor", self.displacement_floor),
        ];
        for (name, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(out_of_range(name, value, "> 0 and finite"));
            }
        }
        let counts = [
            ("max_tiles", self.max_tiles, 4),
            ("min_tiles", self.min_tiles, 4),
            ("max_iterations", self.max_iterations, 1),
            ("renderings", self.renderings, 2),
        ];
        for (name, value, least) in counts {
            if value < least {
                let valid = match least {
                    1 => "≥ 1",
                    2 => "≥ 2",
                    _ => "≥ 4",
                };
                return Err(out_of_range(name, value as f64, valid));
            }
        }
        if !(0.0..1.0).contains(&self.min_correlation) {
            return Err(out_of_range(
                "min_correlation",
                self.min_correlation,
                "0 … 1, not 1",
            ));
        }
        Ok(())
    }
}

fn out_of_range(name: &'static str, value: f64, valid: &'static str) -> InputError {
    InputError::OutOfRange { name, value, valid }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_out_of_range_are_refused() {
        let good = AlignmentConfig::default();
        assert!(good.check().is_ok());
        let bad = [
            AlignmentConfig {
                max_tiles: 0,
                ..good
            },
            AlignmentConfig {
                min_tiles: 3,
                ..good
            },
            AlignmentConfig {
                max_iterations: 0,
                ..good
            },
            AlignmentConfig {
                max_motion: 0.0,
                ..good
            },
            AlignmentConfig {
                start_sigma: f64::NAN,
                ..good
            },
            AlignmentConfig {
                displacement_floor: f64::INFINITY,
                ..good
            },
            AlignmentConfig {
                renderings: 1,
                ..good
            },
            AlignmentConfig {
                min_correlation: 1.0,
                ..good
            },
        ];
        for config in bad {
            assert!(config.check().is_err(), "{config:?}");
        }
    }
}
