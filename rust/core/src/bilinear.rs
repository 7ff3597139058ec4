//! Grey values between pixels of a byte each.

/// Two neighbouring pixels of a row, the left one in the low byte.
#[inline(always)]
pub fn pair(pixels: &[u8], first: usize) -> u16 {
    let pair = &pixels[first..first + 2];
    u16::from_le_bytes([pair[0], pair[1]])
}

/// Between the two of a pair: at 0 the left one, at 1 the right one.
#[inline(always)]
pub fn blend(pair: u16, fraction: f32) -> f32 {
    let (left, right) = (f32::from(pair & 0xff), f32::from(pair >> 8));
    left + fraction * (right - left)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_lie_on_the_line_between_the_pixels() {
        let row = [7, 250, 10];
        let expected = [250.0, 190.0, 130.0, 70.0, 10.0];
        for (quarter, value) in expected.into_iter().enumerate() {
            assert_eq!(blend(pair(&row, 1), 0.25 * quarter as f32), value);
        }
    }
}
