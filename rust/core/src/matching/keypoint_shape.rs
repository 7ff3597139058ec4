//! How a keypoint is turned and how large it is.

use std::f64::consts::TAU;

/// Steps of an octave.
const OCTAVE: f64 = 8.0;
/// Steps of a turn.
const TURN: f64 = 256.0;

/// Angle and scale of a keypoint in whole steps; both begin anew after 256.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct KeypointShape {
    turn: u8,
    size: u8,
}

impl KeypointShape {
    /// Not turned, of unit size.
    pub const UPRIGHT: Self = Self { turn: 0, size: 0 };

    /// Of a keypoint in an image, its angle in radians.
    pub fn new(scale: f64, angle: f64) -> Self {
        // Conversions from float to integer saturate, and not a number is 0.
        Self {
            turn: (angle.rem_euclid(TAU) / TAU * TURN).round() as i64 as u8,
            size: (scale.log2() * OCTAVE).round() as i64 as u8,
        }
    }

    /// Of a frame: 2×2 row by row, from the keypoint's own coordinates to the reference.
    ///
    /// An oblique view of the reference has compressed it. The angle is that of the rotation next to
    /// the frame, the scale the mean of all directions.
    pub fn of_frame(frame: [f32; 4]) -> Self {
        let [a, b, c, d] = frame.map(f64::from);
        Self::new((a * d - b * c).abs().sqrt(), (c - b).atan2(a + d))
    }

    /// By how much a reference is turned and enlarged where a frame shows its keypoint as this.
    pub fn seen_from(self, reference: Self) -> Self {
        Self {
            turn: self.turn.wrapping_sub(reference.turn),
            size: self.size.wrapping_sub(reference.size),
        }
    }

    /// Angle \[rad\].
    pub fn angle(self) -> f32 {
        f32::from(self.turn) * (TAU / TURN) as f32
    }

    /// Scale, from 1 / 65536 to 65536.
    pub fn scale(self) -> f32 {
        (f32::from(self.size as i8) / OCTAVE as f32).exp2()
    }

    /// How far it is turned either way, in 256ths of a turn.
    pub fn steps_of_turn(self) -> u8 {
        (self.turn as i8).unsigned_abs()
    }

    /// How much larger or smaller it is than one, in eighths of an octave.
    pub fn steps_of_size(self) -> u8 {
        (self.size as i8).unsigned_abs()
    }
}

/// A keypoint of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QueryKeypoint {
    /// Where it is \[px\].
    pub point: [f32; 2],
    /// How it is turned and how large it is.
    pub shape: KeypointShape,
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Rotation2};

    use super::*;

    fn frame(matrix: Matrix2<f64>) -> KeypointShape {
        let m = matrix.map(|v| v as f32);
        KeypointShape::of_frame([m[(0, 0)], m[(0, 1)], m[(1, 0)], m[(1, 1)]])
    }

    #[test]
    fn a_frame_of_an_upright_view_has_the_keypoints_angle_and_scale() {
        for (angle, scale) in [(0.0, 1.0), (1.0, 4.0), (3.0, 0.5), (-2.0, 13.0)] {
            let matrix = Rotation2::new(angle).into_inner() * scale;
            assert_eq!(frame(matrix), KeypointShape::new(scale, angle));
        }
    }

    #[test]
    fn what_is_seen_is_turned_and_enlarged_alike_for_all_keypoints_of_a_view() {
        // An oblique view, which compresses one direction, and the same turned and enlarged.
        let squeeze = Rotation2::new(0.6).into_inner() * Matrix2::new(0.4, 0.0, 0.0, 1.0);
        let enlarged = 2.5;
        let expected = KeypointShape::new(enlarged * 0.4_f64.sqrt(), 0.6 + 1.1);
        for (angle, scale) in [(0.2, 3.0), (2.2, 7.0), (-1.4, 1.5)] {
            let own = Rotation2::new(angle).into_inner() * scale;
            let reference = frame(squeeze.try_inverse().unwrap_or_default() * own);
            let image = KeypointShape::new(enlarged * scale, angle + 1.1);
            let seen = image.seen_from(reference);
            let off = seen.seen_from(expected);
            assert!(off.steps_of_turn() <= 1, "{seen:?} {expected:?}");
            assert!(off.steps_of_size() <= 1, "{seen:?} {expected:?}");
        }
    }

    #[test]
    fn what_is_no_shape_is_some_shape() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -1.0] {
            let _ = KeypointShape::new(bad, bad);
            let _ = KeypointShape::of_frame([bad as f32; 4]);
        }
    }
}
