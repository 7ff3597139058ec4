//! Ascending numbers, in half of the memory where they are small.

/// Numbers of the descriptors of a face; hardly one has more than 65 536.
#[derive(Debug, Clone, PartialEq)]
pub enum Numbers {
    /// All of them fit.
    Short(Vec<u16>),
    /// Not all do.
    Long(Vec<u32>),
}

impl Numbers {
    /// Of ascending numbers.
    pub fn new(numbers: Vec<u32>) -> Self {
        match numbers.last() {
            Some(&last) if last > u32::from(u16::MAX) => Self::Long(numbers),
            _ => Self::Short(numbers.into_iter().map(|number| number as u16).collect()),
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Self::Short(numbers) => numbers.len(),
            Self::Long(numbers) => numbers.len(),
        }
    }

    /// One of them.
    pub fn get(&self, index: usize) -> u32 {
        match self {
            Self::Short(numbers) => u32::from(numbers[index]),
            Self::Long(numbers) => numbers[index],
        }
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = u32> {
        (0..self.len()).map(|index| self.get(index))
    }

    /// How many are below a limit.
    pub fn below(&self, limit: usize) -> usize {
        match self {
            Self::Short(numbers) => numbers.partition_point(|&n| usize::from(n) < limit),
            Self::Long(numbers) => numbers.partition_point(|&n| (n as usize) < limit),
        }
    }

    /// Bytes that they occupy.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Short(numbers) => size_of_val(&numbers[..]),
            Self::Long(numbers) => size_of_val(&numbers[..]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_numbers_are_kept_as_well_as_small_ones() {
        for (last, bytes) in [(65_535, 6), (65_536, 12)] {
            let numbers = Numbers::new(vec![3, 700, last]);
            assert_eq!(numbers.iter().collect::<Vec<_>>(), [3, 700, last]);
            assert_eq!(
                [0, 4, 701, usize::MAX].map(|n| numbers.below(n)),
                [0, 1, 2, 3]
            );
            assert_eq!(numbers.bytes(), bytes);
        }
        assert_eq!(Numbers::new(vec![]).len(), 0);
    }
}
