//! 64 bits that say where about its word a descriptor lies (Hamming embedding: Jégou, Douze and
//! Schmid, ECCV 2008, with a randomised Hadamard transform for the projection).

use super::codebook::components_of;
use crate::matching::Metric;
use crate::random::SplitMix64;

/// Bits of a signature.
pub const BITS: usize = 64;

/// Projections of a descriptor, or their mean over those of a word.
pub type Projection = [i32; BITS];

/// Random projections of descriptors.
#[derive(Debug, Clone)]
pub struct Projector {
    metric: Metric,
    /// ±1 for each component of a descriptor, zeros up to a power of two.
    signs: Vec<i32>,
}

impl Projector {
    /// For descriptors of `length` bytes.
    pub fn new(metric: Metric, length: usize, random: &mut SplitMix64) -> Self {
        let components = match metric {
            Metric::Euclidean => length,
            Metric::Hamming => 8 * length,
        };
        let size = components.next_power_of_two().max(2 * BITS);
        let sign = |i| match i < components {
            true => 1 - 2 * random.index(2) as i32,
            false => 0,
        };
        Self {
            metric,
            signs: (0..size).map(sign).collect(),
        }
    }

    /// Projects one descriptor.
    pub fn project(&self, descriptor: &[u8]) -> Projection {
        let mut values = self.signs.clone();
        for (value, component) in values
            .iter_mut()
            .zip(components_of(descriptor, self.metric))
        {
            *value *= i32::from(component);
        }
        let size = values.len();
        let mut half = 1;
        while half < size {
            for pair in values.chunks_exact_mut(2 * half) {
                let (a, b) = pair.split_at_mut(half);
                for (a, b) in a.iter_mut().zip(b) {
                    (*a, *b) = (*a + *b, *a - *b);
                }
            }
            half *= 2;
        }
        std::array::from_fn(|i| values[i])
    }
}

/// On which side of its word's mean a descriptor lies in each projection.
pub fn signature(descriptor: &Projection, word: &Projection) -> u64 {
    let sides = descriptor.iter().zip(word).enumerate();
    sides.fold(0, |bits, (i, (d, w))| bits | u64::from(d > w) << i)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_descriptors_differ_in_fewer_bits_than_far_ones() {
        for (metric, length) in [(Metric::Euclidean, 128), (Metric::Hamming, 61)] {
            let mut random = SplitMix64::new(6);
            let projector = Projector::new(metric, length, &mut random);
            let mut draw = || -> Vec<u8> { (0..length).map(|_| random.index(256) as u8).collect() };
            let mut word = [0; BITS];
            for _ in 0..400 {
                for (mean, value) in word.iter_mut().zip(projector.project(&draw())) {
                    *mean += value;
                }
            }
            let word = word.map(|sum| sum / 400);
            let (mut near, mut far) = (0, 0);
            for _ in 0..100 {
                let (a, other) = (draw(), draw());
                let mut like = a.clone();
                for i in 0..length / 10 {
                    like[i * 10] = other[i * 10];
                }
                let [a, like, other] =
                    [a, like, other].map(|d| signature(&projector.project(&d), &word));
                near += (a ^ like).count_ones();
                far += (a ^ other).count_ones();
            }
            // Unrelated ones differ in half of 64 bits; a tenth of the components turns by
            // acos(0.9) / π ≈ 0.14 of them on average.
            assert!((2900..3500).contains(&far), "{metric:?} {far}");
            assert!((500..1300).contains(&near), "{metric:?} {near}");
        }
    }
}
