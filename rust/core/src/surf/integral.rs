//! Integral images (Viola & Jones, CVPR 2001): the sum of any box from four look-ups.

use crate::GrayImage;

/// Sums of all pixels above and to the left of each pixel corner.
///
/// Corner (x, y) is the upper left one of pixel (x, y): in pixel coordinates it lies at
/// (x - ½, y - ½). Sums wrap around at 2³², and so do their differences: the sum of a box is right
/// as long as it is below 2³¹ itself.
#[derive(Debug, Clone, Default)]
pub struct Integral {
    width: usize,
    height: usize,
    sums: Vec<i32>,
}

impl Integral {
    /// Takes the sums of another image; memory is kept.
    pub fn compute(&mut self, image: GrayImage<'_>) {
        (self.width, self.height) = (image.width(), image.height());
        let stride = self.width + 1;
        self.sums.resize(stride * (self.height + 1), 0);
        self.sums[..stride].fill(0);
        for y in 0..self.height {
            let (above, below) = self.sums[y * stride..(y + 2) * stride].split_at_mut(stride);
            let mut sum = 0_i32;
            below[0] = 0;
            let sums = below[1..].iter_mut().zip(&above[1..]);
            for ((below, above), &pixel) in sums.zip(image.row(y)) {
                sum = sum.wrapping_add(i32::from(pixel));
                *below = above.wrapping_add(sum);
            }
        }
    }

    /// Width of the image [px].
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height of the image [px].
    pub fn height(&self) -> usize {
        self.height
    }

    /// The sums at the width + 1 corners of row y, 0 ≤ y ≤ height.
    #[inline(always)]
    pub fn row(&self, y: usize) -> &[i32] {
        let stride = self.width + 1;
        &self.sums[y * stride..(y + 1) * stride]
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn box_sum(integral: &Integral, (x0, y0): (usize, usize), (x1, y1): (usize, usize)) -> i32 {
        let (top, bottom) = (integral.row(y0), integral.row(y1));
        (bottom[x1].wrapping_sub(bottom[x0])).wrapping_sub(top[x1].wrapping_sub(top[x0]))
    }

    #[test]
    fn the_sum_of_any_box_is_that_of_its_pixels() {
        let pixels: Vec<u8> = (0..35_u32).map(|i| (i * i * 37 % 251) as u8).collect();
        let mut integral = Integral::default();
        // A larger image before must leave nothing behind.
        integral.compute(GrayImage::new(9, 8, &[255; 72]).unwrap());
        integral.compute(GrayImage::new(7, 5, &pixels).unwrap());
        for y0 in 0..5 {
            for y1 in y0..=5 {
                for x0 in 0..7 {
                    for x1 in x0..=7 {
                        let rows = (y0..y1).map(|y| &pixels[y * 7 + x0..y * 7 + x1]);
                        let expected: i32 = rows.flatten().map(|&p| i32::from(p)).sum();
                        assert_eq!(box_sum(&integral, (x0, y0), (x1, y1)), expected);
                    }
                }
            }
        }
    }

    #[test]
    fn boxes_stay_right_where_the_sums_wrap_around() {
        let (width, height) = (4500, 4500);
        let pixels = vec![255; width * height];
        let mut integral = Integral::default();
        integral.compute(GrayImage::new(width, height, &pixels).unwrap());
        assert!(width * height * 255 > u32::MAX as usize);
        let sum = box_sum(&integral, (4300, 4300), (4500, 4500));
        assert_eq!(sum, 200 * 200 * 255);
    }

    #[test]
    fn an_image_without_pixels_has_sums_of_zero() {
        let mut integral = Integral::default();
        integral.compute(GrayImage::new(0, 0, &[]).unwrap());
        assert_eq!(integral.row(0), [0]);
        integral.compute(GrayImage::new(0, 3, &[]).unwrap());
        assert_eq!(integral.row(3), [0]);
    }
}
