//! The latest rows of an image that is computed from top to bottom.

/// Floats of a 64-byte cache line: rows begin on multiples of it.
const LINE: usize = 16;

/// A ring of rows: row y is kept until row y + capacity is written.
#[derive(Debug, Default)]
pub struct RowRing {
    capacity: usize,
    stride: usize,
    values: Vec<f32>,
}

impl RowRing {
    /// Room for `capacity` rows of at least `length` values.
    pub fn new(capacity: usize, length: usize) -> Self {
        let stride = row_stride(length);
        Self {
            capacity,
            stride,
            values: vec![0.0; capacity * stride],
        }
    }

    /// Row y, which must be among the latest.
    #[inline(always)]
    pub fn row(&self, y: usize) -> &[f32] {
        let start = (y % self.capacity) * self.stride;
        &self.values[start..start + self.stride]
    }

    /// Row y, to be written.
    #[inline(always)]
    pub fn row_mut(&mut self, y: usize) -> &mut [f32] {
        let start = (y % self.capacity) * self.stride;
        &mut self.values[start..start + self.stride]
    }
}

/// Distance between rows of at least `length` values: an odd number of cache lines, so that
/// values below each other do not compete for the same places in the cache.
pub fn row_stride(length: usize) -> usize {
    (length.div_ceil(LINE) | 1) * LINE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_lasts_for_as_many_rows_as_there_is_room_for() {
        let mut ring = RowRing::new(3, 5);
        for y in 0..7 {
            ring.row_mut(y)[4] = y as f32;
        }
        let kept: Vec<f32> = (4..7).map(|y| ring.row(y)[4]).collect();
        assert_eq!(kept, [4.0, 5.0, 6.0]);
    }

    #[test]
    fn strides_are_odd_numbers_of_cache_lines() {
        for length in [1, 16, 17, 640, 1280] {
            let stride = row_stride(length);
            assert!(stride >= length && stride < length + 32);
            assert_eq!((stride / 16) % 2, 1);
        }
    }
}
