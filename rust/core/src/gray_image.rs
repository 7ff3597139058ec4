//! A grey image, borrowed.

use crate::InputError;

/// Rows of 8-bit pixels without gaps; pixel centres lie at integer coordinates.
#[derive(Debug, Clone, Copy)]
pub struct GrayImage<'a> {
    width: usize,
    height: usize,
    pixels: &'a [u8],
}

impl<'a> GrayImage<'a> {
    /// An image of `width` × `height` pixels, row by row.
    ///
    /// # Errors
    /// [`InputError::ImageSize`] where the number of pixels is not width × height.
    pub fn new(width: usize, height: usize, pixels: &'a [u8]) -> Result<Self, InputError> {
        if width.checked_mul(height) != Some(pixels.len()) {
            return Err(InputError::ImageSize {
                width,
                height,
                pixels: pixels.len(),
            });
        }
        Ok(Self {
            width,
            height,
            pixels,
        })
    }

    /// Width [px].
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height [px].
    pub fn height(&self) -> usize {
        self.height
    }

    /// All pixels, row by row.
    pub fn pixels(&self) -> &'a [u8] {
        self.pixels
    }

    /// One row of pixels.
    pub fn row(&self, y: usize) -> &'a [u8] {
        &self.pixels[y * self.width..(y + 1) * self.width]
    }
}

#[cfg(test)]
#[allow(clippy::expect_used)]
mod tests {
    use super::*;

    #[test]
    fn rows_follow_each_other() {
        let image = GrayImage::new(3, 2, &[0, 1, 2, 3, 4, 5]).expect("six pixels");
        assert_eq!(image.row(1), [3, 4, 5]);
    }

    #[test]
    fn a_wrong_number_of_pixels_is_refused() {
        for (width, height) in [(2, 2), (4, 2), (usize::MAX, 2), (0, 1)] {
            assert!(GrayImage::new(width, height, &[0, 1, 2, 3, 4, 5]).is_err());
        }
    }
}
