//! Gradients of a level, packed into one word a pixel.

/// Units of a packed derivative for one grey level: differences of 8-bit grey levels fit 16 bits.
const UNITS: f32 = 128.0;
/// Added to a small number, this leaves its rounded value in the low bits of the sum: 1.5·2²³.
pub const ROUNDING: f32 = 12_582_912.0;

/// Central differences of a level at every second pixel of every second row: so smooth a level has
/// little between them, and a quarter of the memory is read and written. Each word holds the derivative along y in its upper and that
/// along x in its lower 16 bits, in units of 1/128 grey level over two pixels.
/// 0 at the border.
#[derive(Debug, Default)]
pub struct GradientPlane {
    /// Number of columns; column i is that of the level's pixels 2i.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// Row by row, without gaps.
    pub values: Vec<u32>,
}

/// Fills a row of a plane from the level's row above, itself and the row below.
#[inline(always)]
pub fn pack_row(above: &[f32], row: &[f32], below: &[f32], out: &mut [u32]) {
    let Some(last) = out.len().checked_sub(1) else {
        return;
    };
    // Pixel 2i is the first of the i-th pair, and its left neighbour the second of the one before.
    let (pairs, above, below) = (
        row.as_chunks::<2>().0,
        above.as_chunks::<2>().0,
        below.as_chunks::<2>().0,
    );
    for i in 1..last {
        let dx = ((pairs[i][1] - pairs[i - 1][1]) * UNITS + ROUNDING).to_bits();
        let dy = ((below[i][0] - above[i][0]) * UNITS + ROUNDING).to_bits();
        out[i] = (dy << 16) | (dx & 0xffff);
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
        let row = |y: f32| -> Vec<f32> { (0..12).map(|x| 3.25 * x as f32 - 1.5 * y).collect() };
        let mut out = [0; 6];
        pack_row(&row(1.0), &row(2.0), &row(3.0), &mut out);
        assert_eq!((out[0], out[5]), (0, 0));
        for word in &out[1..5] {
            assert_eq!(unpack(*word), (6.5 * UNITS, -3.0 * UNITS));
        }
    }

    #[test]
    fn the_steepest_step_fits() {
        let mut out = [0; 3];
        pack_row(
            &[255.0; 6],
            &[9.0, 0.0, 9.0, 255.0, 9.0, 9.0],
            &[0.0; 6],
            &mut out,
        );
        assert_eq!(unpack(out[1]), (255.0 * UNITS, -255.0 * UNITS));
    }
}
