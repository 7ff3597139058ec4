//! Shrinking images by averaging over areas, so that edge coordinates scale without an offset.

/// Rows of 8-bit pixels that it owns.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Width \[px\].
    pub width: usize,
    /// Height \[px\].
    pub height: usize,
    /// All pixels, row by row.
    pub pixels: Vec<u8>,
}

impl Level {
    /// Each pixel of the result is the mean over the area that it covers.
    pub fn shrunk(&self, width: usize, height: usize) -> Self {
        let (columns, rows) = (shares(self.width, width), shares(self.height, height));
        let mut sums = vec![0.0f32; width];
        let mut pixels = Vec::with_capacity(width * height);
        for row in &rows {
            sums.fill(0.0);
            for (y, across) in row.weights() {
                let source = &self.pixels[y * self.width..(y + 1) * self.width];
                for (sum, column) in sums.iter_mut().zip(&columns) {
                    let mean: f32 = column
                        .weights()
                        .map(|(x, weight)| weight * f32::from(source[x]))
                        .sum();
                    *sum += across * mean;
                }
            }
            pixels.extend(sums.iter().map(|&sum| (sum + 0.5) as u8));
        }
        Self {
            width,
            height,
            pixels,
        }
    }

    /// Every pixel the mean of 2×2; a last odd row or column is left out.
    pub fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            let (above, below) =
                self.pixels[2 * y * self.width..(2 * y + 2) * self.width].split_at(self.width);
            pixels.extend(
                above
                    .chunks_exact(2)
                    .zip(below.chunks_exact(2))
                    .map(|(a, b)| {
                        let sum =
                            u16::from(a[0]) + u16::from(a[1]) + u16::from(b[0]) + u16::from(b[1]);
                        ((sum + 2) / 4) as u8
                    }),
            );
        }
        Self {
            width,
            height,
            pixels,
        }
    }
}

/// The part of a row that one pixel of a shorter row covers.
struct Share {
    low: f64,
    high: f64,
}

impl Share {
    /// Source pixels with their weights, which sum to one.
    fn weights(&self) -> impl Iterator<Item = (usize, f32)> {
        let (first, last) = (self.low as usize, (self.high - 1e-9) as usize);
        (first..=last).map(move |i| {
            let covered = self.high.min(i as f64 + 1.0) - self.low.max(i as f64);
            (i, (covered / (self.high - self.low)) as f32)
        })
    }
}

fn shares(source: usize, target: usize) -> Vec<Share> {
    let step = source as f64 / target as f64;
    (0..target)
        .map(|i| Share {
            low: i as f64 * step,
            high: ((i + 1) as f64 * step).min(source as f64),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(width: usize, height: usize) -> Level {
        let value = |i: usize| (3 * (i % width) + 2 * (i / width)) as u8;
        Level {
            width,
            height,
            pixels: (0..width * height).map(value).collect(),
        }
    }

    #[test]
    fn a_ramp_stays_a_ramp_in_edge_coordinates() {
        // The mean of a linear function over an area is its value at the area's centre.
        let shrunk = ramp(40, 30).shrunk(17, 11);
        for y in 0..11 {
            for x in 0..17 {
                let (u, v) = (
                    (x as f64 + 0.5) * 40.0 / 17.0 - 0.5,
                    (y as f64 + 0.5) * 30.0 / 11.0 - 0.5,
                );
                let expected = 3.0 * u + 2.0 * v;
                let error = f64::from(shrunk.pixels[y * 17 + x]) - expected;
                // Rounding: 0.5. A pixel of which a share f is covered counts with its centre, (1 - f)/2
                // off: at most 1/8 px over the 2.35 px and 2.7 px that are averaged, so 0.26.
                assert!(error.abs() <= 0.76, "{error} at {x}, {y}");
            }
        }
    }

    #[test]
    fn halving_is_shrinking_to_the_half() {
        assert_eq!(ramp(40, 30).halved(), ramp(40, 30).shrunk(20, 15));
        assert_eq!(ramp(41, 31).halved(), ramp(41, 31).halved());
        assert_eq!(ramp(41, 31).halved().pixels.len(), 20 * 15);
    }
}
