//! Progressive sampling: from the best matches to all of them.

use crate::random::SplitMix64;

/// Samples after which progressive sampling is as good as uniform sampling (Chum & Matas: T_N).
const UNIFORM_AFTER: f64 = 200_000.0;

/// Draws four of the first n matches, n growing as in Chum & Matas 2005, section 2.
#[derive(Debug)]
pub struct ProgressiveSampler {
    random: SplitMix64,
    count: usize,
    pool: usize,
    drawn: f64,
    /// Mean number of samples from the first `pool` matches among `UNIFORM_AFTER` uniform ones.
    expected: f64,
    /// Samples after which the pool grows.
    grow_at: f64,
}

impl ProgressiveSampler {
    /// Over `count` ≥ 4 matches, the best first.
    pub fn new(count: usize, seed: u64) -> Self {
        let expected = (0..4).fold(UNIFORM_AFTER, |product, i| {
            product * (4 - i) as f64 / (count - i) as f64
        });
        Self {
            random: SplitMix64::new(seed),
            count,
            pool: 4,
            drawn: 0.0,
            expected,
            grow_at: 1.0,
        }
    }

    /// Four different indices.
    pub fn draw(&mut self) -> [usize; 4] {
        self.drawn += 1.0;
        while self.drawn > self.grow_at && self.pool < self.count {
            let grown = self.expected * (self.pool + 1) as f64 / (self.pool - 3) as f64;
            self.grow_at += (grown - self.expected).ceil();
            self.expected = grown;
            self.pool += 1;
        }
        // The newest match of the pool is in every sample until the whole set is in use.
        let newest = self.drawn <= self.grow_at;
        let mut sample = [self.pool - 1; 4];
        for i in usize::from(newest)..4 {
            sample[i] = loop {
                let drawn = self.random.index(self.pool - usize::from(newest));
                if !sample[..i].contains(&drawn) {
                    break drawn;
                }
            };
        }
        sample
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_different_indices_that_start_with_the_best() {
        let mut sampler = ProgressiveSampler::new(50, 1);
        assert_eq!(
            {
                let mut first = sampler.draw();
                first.sort_unstable();
                first
            },
            [0, 1, 2, 3]
        );
        let mut largest = 0;
        for _ in 0..5000 {
            let mut sample = sampler.draw();
            sample.sort_unstable();
            assert!(sample.windows(2).all(|pair| pair[0] < pair[1]));
            largest = largest.max(sample[3]);
        }
        assert!(largest > 10, "the pool grows: {largest}");
    }

    #[test]
    fn four_matches_give_the_only_sample() {
        let mut sampler = ProgressiveSampler::new(4, 0);
        for _ in 0..10 {
            let mut sample = sampler.draw();
            sample.sort_unstable();
            assert_eq!(sample, [0, 1, 2, 3]);
        }
    }
}
