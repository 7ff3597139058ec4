//! Gradients of a level, packed into one word a pixel.

/// Units of a packed derivative for one grey level: differences of 8-bit grey levels fit 16 bits.
const UNITS: f32 = 128.0;
/// Added to a small number, this leaves its rounded value in the low bits of the sum: 1.5·2²³.
pub const ROUNDING: f32 = 12_582_912.0;

/// Central differences of a level: each word holds the derivative along y in its upper and that
/// along x in its lower 16 bits, in units of 1/128 grey level over two pixels. 0 at the border.
#[derive(Debug, Default)]
pub struct GradientPlane {
    /// Width [px].
    pub width: usize,
    /// Height [px].
    pub height: usize,
    /// Row by row, without gaps.
    pub values: Vec<u32>,
}

/// Fills a row of a plane from the row above, itself and the row below.
#[inline(always)]
pub fn pack_row(above: &[f32], row: &[f32], below: &[f32], out: &mut [u32]) {
    let width = out.len();
    if width < 3 {
        return;
    }
    let (left, right) = (&row[..width - 2], &row[2..width]);
    let (above, below) = (&above[1..width - 1], &below[1..width - 1]);
    for (i, word) in out[1..width - 1].iter_mut().enumerate() {
        let dx = ((right[i] - left[i]) * UNITS + ROUNDING).to_bits();
        let dy = ((below[i] - above[i]) * UNITS + ROUNDING).to_bits();
        *word = (dy << 16) | (dx & 0xffff);
    }
}

/// Derivatives along x and y of a packed word.
#[inline(always)]
pub fn unpack(word: u32) -> (f32, f32) {
    let dx = ((word << 16) as i32 >> 16) as f32;
    let dy = (word as i32 >> 16) as f32;
    (dx, dy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_has_its_slope_everywhere_but_at_the_border() {
        let row = |y: f32| -> Vec<f32> { (0..6).map(|x| 3.25 * x as f32 - 1.5 * y).collect() };
        let mut out = [0; 6];
        pack_row(&row(0.0), &row(1.0), &row(2.0), &mut out);
        assert_eq!((out[0], out[5]), (0, 0));
        for word in &out[1..5] {
            assert_eq!(unpack(*word), (6.5 * UNITS, -3.0 * UNITS));
        }
    }

    #[test]
    fn the_steepest_step_fits() {
        let mut out = [0; 3];
        pack_row(&[255.0; 3], &[0.0, 9.0, 255.0], &[0.0; 3], &mut out);
        assert_eq!(unpack(out[1]), (255.0 * UNITS, -255.0 * UNITS));
    }
}
