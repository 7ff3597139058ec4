//! Descriptors in the layout that the search reads them in.

/// Descriptors in a block: what two 512-bit, four 256-bit or eight 128-bit registers hold of them.
pub const ROWS: usize = 32;

/// Four bytes of each descriptor of a block.
#[repr(C, align(64))]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lanes(pub [u32; ROWS]);

/// Bytes are stored as b - 128, signed, because integer dot products multiply an unsigned with a
/// signed byte.
pub const SIGN: u32 = 0x8080_8080;

/// Descriptors of bytes, interleaved: a block has [`ROWS`] of them, first four bytes of each, then
/// the next four of each and so on. One register then adds up that many distances, without sums
/// across its lanes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DescriptorBlocks {
    length: usize,
    count: usize,
    lanes: Vec<Lanes>,
    norms: Vec<Lanes>,
}

impl DescriptorBlocks {
    /// Bytes that they occupy.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.lanes[..]) + size_of_val(&self.norms[..])
    }

    /// Packs descriptors of `length` bytes that lie one after the other; an incomplete last one is
    /// left out.
    pub fn new(descriptors: &[u8], length: usize) -> Self {
        let count = descriptors.len().checked_div(length).unwrap_or(0);
        let (blocks, columns) = (count.div_ceil(ROWS), length.div_ceil(4));
        let mut lanes = vec![Lanes([SIGN; ROWS]); blocks * columns];
        let mut norms = vec![Lanes([0; ROWS]); blocks];
        for (row, descriptor) in descriptors
            .chunks_exact(length.max(1))
            .take(count)
            .enumerate()
        {
            let (block, lane) = (row / ROWS, row % ROWS);
            for (column, word) in words(descriptor).enumerate() {
                lanes[block * columns + column].0[lane] = word ^ SIGN;
            }
            norms[block].0[lane] = squared_norm(descriptor) as u32;
        }
        Self {
            length,
            count,
            lanes,
            norms,
        }
    }

    /// Bytes of a descriptor.
    pub fn length(&self) -> usize {
        self.length
    }

    /// Number of blocks.
    pub fn blocks(&self) -> usize {
        self.norms.len()
    }

    /// One block's columns of four bytes each, and its descriptors' squared norms.
    pub fn block(&self, block: usize) -> (&[Lanes], &Lanes) {
        let columns = self.length.div_ceil(4);
        let lanes = &self.lanes[block * columns..(block + 1) * columns];
        (lanes, &self.norms[block])
    }

    /// Which rows of a block are descriptors, as bits; the last block may have fewer than others.
    pub fn valid(&self, block: usize) -> u32 {
        match self.count.saturating_sub(block * ROWS) {
            ROWS.. => u32::MAX,
            rows => (1 << rows) - 1,
        }
    }

    /// Writes one descriptor to `bytes`, which is as long as a descriptor.
    pub fn copy_to(&self, row: usize, bytes: &mut [u8]) {
        let columns = self.length.div_ceil(4);
        let first = row / ROWS * columns;
        let column = self.lanes[first..first + columns].iter();
        for (bytes, lanes) in bytes.chunks_mut(4).zip(column) {
            let word = (lanes.0[row % ROWS] ^ SIGN).to_le_bytes();
            bytes.copy_from_slice(&word[..bytes.len()]);
        }
    }

    /// All descriptors, one after the other.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = vec![0; self.count * self.length];
        for (row, bytes) in bytes.chunks_exact_mut(self.length.max(1)).enumerate() {
            self.copy_to(row, bytes);
        }
        bytes
    }
}

/// Four bytes at a time, little-endian, the last padded with zeros.
pub fn words(descriptor: &[u8]) -> impl Iterator<Item = u32> {
    let (whole, rest) = descriptor.as_chunks();
    let last = (!rest.is_empty()).then(|| {
        let mut word = [0; 4];
        word[..rest.len()].copy_from_slice(rest);
        word
    });
    let words = whole.iter().copied().chain(last);
    words.map(u32::from_le_bytes)
}

/// Sum of the squared bytes.
pub fn squared_norm(descriptor: &[u8]) -> i32 {
    descriptor.iter().map(|&b| i32::from(b).pow(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::SplitMix64;

    #[test]
    fn bytes_come_back_as_they_were_packed() {
        let mut random = SplitMix64::new(1);
        for (length, count) in [(1, 1), (3, 31), (32, 32), (61, 33), (128, 70), (5, 0)] {
            let bytes: Vec<u8> = (0..length * count)
                .map(|_| random.index(256) as u8)
                .collect();
            let blocks = DescriptorBlocks::new(&bytes, length);
            assert_eq!(blocks.count, count);
            assert_eq!(blocks.to_bytes(), bytes);
            let valid: u32 = (0..blocks.blocks())
                .map(|b| blocks.valid(b).count_ones())
                .sum();
            assert_eq!(valid as usize, count);
        }
    }

    #[test]
    fn descriptors_without_bytes_are_none() {
        assert!(DescriptorBlocks::new(&[], 0).to_bytes().is_empty());
        assert_eq!(DescriptorBlocks::new(&[1, 2], 0).count, 0);
    }
}
