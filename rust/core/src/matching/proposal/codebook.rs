//! Words that descriptors are sorted by: the centres of k-means clusters.

use rayon::prelude::*;

use crate::matching::Metric;
use crate::matching::blocks::DescriptorBlocks;
use crate::matching::kernel::Kernel;
use crate::matching::nearest::Nearest;
use crate::matching::scan::Tiles;
use crate::random::SplitMix64;

/// Lloyd's iterations: more change the words, not what they are good for.
const ITERATIONS: usize = 6;
/// Descriptors that a thread assigns at once.
const SHARE: usize = 32;

/// The words of a codebook.
#[derive(Debug, Clone)]
pub struct Codebook {
    metric: Metric,
    kernel: Kernel,
    words: DescriptorBlocks,
}

impl Codebook {
    /// Clusters descriptors of `length` bytes; there are at least as many as words.
    pub fn train(
        (metric, kernel): (Metric, Kernel),
        sample: &[u8],
        length: usize,
        count: usize,
        random: &mut SplitMix64,
    ) -> Self {
        let chosen = distinct(sample.len() / length, count, random);
        let mut centres: Vec<u8> = chosen
            .into_iter()
            .flat_map(|row| &sample[row * length..][..length])
            .copied()
            .collect();
        let mut codebook = Self {
            metric,
            kernel,
            words: DescriptorBlocks::new(&centres, length),
        };
        for _ in 0..ITERATIONS {
            let assigned = codebook.nearest(sample, 1);
            move_centres(&mut centres, sample, length, &assigned, metric);
            codebook.words = DescriptorBlocks::new(&centres, length);
        }
        codebook
    }

    /// The words, one after the other.
    pub fn words(&self) -> Vec<u8> {
        self.words.to_bytes()
    }

    /// N×m numbers of the m nearest words of each descriptor; there are at least m.
    pub fn nearest(&self, descriptors: &[u8], m: usize) -> Vec<u32> {
        let length = self.words.length();
        let mut found = vec![0; descriptors.len() / length * m];
        found
            .par_chunks_mut(SHARE * m)
            .zip(descriptors.par_chunks(SHARE * length))
            .for_each_init(
                || (Tiles::default(), vec![Nearest::new(m, i32::MAX); SHARE]),
                |(tiles, nearest), (found, descriptors)| {
                    tiles.fill(descriptors.chunks_exact(length), length, i32::MAX);
                    for nearest in nearest.iter_mut() {
                        nearest.clear();
                    }
                    tiles.scan(
                        (self.kernel, self.metric),
                        (0, &self.words, usize::MAX),
                        |query, word| {
                            nearest[query].insert(word);
                            nearest[query].limit()
                        },
                    );
                    for (found, nearest) in found.chunks_exact_mut(m).zip(nearest) {
                        for (found, word) in found.iter_mut().zip(nearest.found()) {
                            *found = word.reference;
                        }
                    }
                },
            );
        found
    }
}

/// `count` different numbers below `range`, in random order.
fn distinct(range: usize, count: usize, random: &mut SplitMix64) -> Vec<usize> {
    let mut all: Vec<usize> = (0..range).collect();
    for i in 0..count.min(range) {
        let other = i + random.index(range - i);
        all.swap(i, other);
    }
    all.truncate(count);
    all
}

/// Puts each centre into the middle of what was assigned to it; without any it stays.
fn move_centres(
    centres: &mut [u8],
    sample: &[u8],
    length: usize,
    assigned: &[u32],
    metric: Metric,
) {
    let components = match metric {
        Metric::Euclidean => length,
        Metric::Hamming => 8 * length,
    };
    let count = centres.len() / length;
    let mut sums = vec![0u32; count * components];
    let mut members = vec![0u32; count];
    for (descriptor, &word) in sample.chunks_exact(length).zip(assigned) {
        let word = word as usize;
        members[word] += 1;
        let sums = &mut sums[word * components..][..components];
        for (sum, value) in sums.iter_mut().zip(components_of(descriptor, metric)) {
            *sum += u32::from(value);
        }
    }
    for ((centre, sums), members) in centres
        .chunks_exact_mut(length)
        .zip(sums.chunks_exact(components))
        .zip(members)
        .filter(|(_, members)| *members > 0)
    {
        for (i, &sum) in sums.iter().enumerate() {
            let middle = (sum + members / 2) / members;
            match metric {
                Metric::Euclidean => centre[i] = middle as u8,
                Metric::Hamming if i % 8 == 0 => centre[i / 8] = middle as u8,
                Metric::Hamming => centre[i / 8] |= (middle as u8) << (i % 8),
            }
        }
    }
}

/// The numbers that a descriptor consists of: its bytes or its bits.
pub fn components_of(descriptor: &[u8], metric: Metric) -> impl Iterator<Item = u8> {
    let bits = if metric == Metric::Hamming { 8 } else { 1 };
    descriptor.iter().flat_map(move |&byte| {
        (0..bits).map(move |bit| if bits == 8 { byte >> bit & 1 } else { byte })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Eight far centres with small noise around them.
    fn clusters(metric: Metric, random: &mut SplitMix64) -> (Vec<u8>, Vec<u8>) {
        let centres: Vec<u8> = (0..8 * 32).map(|_| random.index(256) as u8).collect();
        let mut sample = Vec::new();
        for _ in 0..800 {
            let centre = &centres[random.index(8) * 32..][..32];
            sample.extend(centre.iter().map(|&byte| match metric {
                Metric::Euclidean => byte.saturating_add(random.index(5) as u8).saturating_sub(2),
                Metric::Hamming if random.index(10) == 0 => byte ^ 1 << random.index(8),
                Metric::Hamming => byte,
            }));
        }
        (centres, sample)
    }

    #[test]
    fn members_of_a_cluster_share_their_word() {
        for metric in [Metric::Euclidean, Metric::Hamming] {
            let mut random = SplitMix64::new(4);
            let (centres, sample) = clusters(metric, &mut random);
            let how = (metric, Kernel::best());
            let codebook = Codebook::train(how, &sample, 32, 40, &mut random);
            let words = codebook.words();
            let nearest = codebook.nearest(&centres, 1);
            for (centre, word) in centres.chunks_exact(32).zip(nearest) {
                let word = &words[word as usize * 32..][..32];
                let apart = components_of(centre, metric)
                    .zip(components_of(word, metric))
                    .map(|(a, b)| u32::from(a.abs_diff(b)))
                    .sum::<u32>();
                // Noise of 32 bytes of at most 2, or 32 bits of which one in ten: centres chosen at
                // random are about 2700 and 128 apart.
                assert!(apart < 40, "{metric:?} {apart}");
            }
        }
    }

    #[test]
    fn chosen_numbers_are_distinct() {
        let mut chosen = distinct(50, 50, &mut SplitMix64::new(0));
        chosen.sort_unstable();
        assert_eq!(chosen, (0..50).collect::<Vec<_>>());
    }
}
