//! What the index keeps of a face.

use nalgebra::Matrix2;

use super::blocks::{DescriptorBlocks, ROWS};
use super::numbers::Numbers;
use super::queries::{SIGNS, check_signs};
use crate::InputError;

/// How descriptors are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Metric {
    /// Vectors of bytes, by Euclidean distance.
    Euclidean,
    /// Strings of bits, by the number that differ.
    Hamming,
}

/// Longest descriptor [bytes]: sums of products stay far within 32 bits.
const LONGEST: usize = 4096;

/// So many descriptors of a face, the first, may take part in proposals.
pub const MOST_FILED: usize = 1000;

/// Descriptors of keypoints with the same sign, which alone may look alike.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    sign: i8,
    /// Which ones of the face they are, ascending.
    numbers: Numbers,
    blocks: DescriptorBlocks,
}

impl Group {
    fn new(sign: i8, numbers: Vec<u32>, descriptors: &[u8], length: usize) -> Self {
        let rows = numbers
            .iter()
            .flat_map(|&number| &descriptors[number as usize * length..][..length])
            .copied();
        Self {
            sign,
            blocks: DescriptorBlocks::new(&rows.collect::<Vec<u8>>(), length),
            numbers: Numbers::new(numbers),
        }
    }

    /// The descriptors as the search reads them.
    pub fn blocks(&self) -> &DescriptorBlocks {
        &self.blocks
    }

    /// Which ones of the face they are, ascending.
    pub fn numbers(&self) -> &Numbers {
        &self.numbers
    }

    /// In how many blocks, from the first on, those are that are among the face's first `count`.
    pub fn blocks_of_first(&self, count: usize) -> usize {
        self.numbers.below(count).div_ceil(ROWS)
    }
}

/// Descriptors of one face, from all its oblique views.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReferenceSet {
    points: Vec<[f32; 2]>,
    length: usize,
    /// One for each sign that occurs.
    groups: Vec<Group>,
    /// Of those that may be filed.
    frames: Vec<[f32; 4]>,
    radius: f32,
}

impl ReferenceSet {
    /// One face.
    ///
    /// `points`: reference image in edge coordinates. `frames`: 2×2 row by row, from each keypoint's own
    /// coordinates to the reference. `descriptors`: `length` bytes a point. `radius`: two points closer
    /// than this are the same place.
    ///
    /// # Errors
    /// [`InputError::DescriptorCount`] unless there is one descriptor a point,
    /// [`InputError::FrameCount`] unless there is one frame a point, [`InputError::NotFinite`] where a
    /// frame is not, [`InputError::OutOfRange`] for a length of 0 or above 4096.
    pub fn new(
        points: Vec<[f32; 2]>,
        mut frames: Vec<[f32; 4]>,
        descriptors: Vec<u8>,
        length: usize,
        radius: f32,
    ) -> Result<Self, InputError> {
        if !(1..=LONGEST).contains(&length) {
            return Err(InputError::OutOfRange {
                name: "the length of descriptors",
                value: length as f64,
                valid: "1 to 4096 bytes",
            });
        }
        if descriptors.len() != points.len() * length {
            return Err(InputError::DescriptorCount {
                points: points.len(),
                length,
                bytes: descriptors.len(),
            });
        }
        if frames.len() != points.len() {
            return Err(InputError::FrameCount {
                points: points.len(),
                frames: frames.len(),
            });
        }
        if !frames.as_flattened().iter().all(|v| v.is_finite()) {
            return Err(InputError::NotFinite { what: "frames" });
        }
        frames.truncate(MOST_FILED);
        frames.shrink_to_fit();
        let all = (0..points.len() as u32).collect();
        Ok(Self {
            points,
            length,
            groups: vec![Group::new(0, all, &descriptors, length)],
            frames,
            radius,
        })
    }

    /// The same with the signs of the keypoints, which are 0 otherwise.
    ///
    /// # Errors
    /// [`InputError::SignCount`] unless there is one a descriptor, [`InputError::OutOfRange`] where one
    /// is not -1, 0 or 1.
    pub fn with_signs(self, signs: &[i8]) -> Result<Self, InputError> {
        check_signs(signs, self.len())?;
        let descriptors = self.descriptors();
        let groups = SIGNS.into_iter().filter_map(|sign| {
            let all = 0..self.len() as u32;
            let numbers: Vec<u32> = all.filter(|&i| signs[i as usize] == sign).collect();
            let occurs = !numbers.is_empty();
            occurs.then(|| Group::new(sign, numbers, &descriptors, self.length))
        });
        Ok(Self {
            groups: groups.collect(),
            ..self
        })
    }

    /// Number of descriptors.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Bytes that it occupies.
    pub fn bytes(&self) -> usize {
        let keypoints = size_of_val(&self.points[..]) + size_of_val(&self.frames[..]);
        let groups = self.groups.iter();
        let groups = groups.map(|one| one.numbers.bytes() + one.blocks.bytes());
        keypoints + groups.sum::<usize>()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Where the descriptors were taken, reference image in edge coordinates.
    pub fn points(&self) -> &[[f32; 2]] {
        &self.points
    }

    /// From the own coordinates of one of the first [`MOST_FILED`] keypoints to the reference.
    pub(super) fn frame(&self, number: usize) -> Matrix2<f32> {
        let [a, b, c, d] = self.frames[number];
        Matrix2::new(a, b, c, d)
    }

    /// A copy of the descriptors, one after the other.
    pub fn descriptors(&self) -> Vec<u8> {
        let mut bytes = vec![0; self.len() * self.length];
        for group in &self.groups {
            for (row, number) in group.numbers.iter().enumerate() {
                let place = number as usize * self.length;
                let place = place..place + self.length;
                group.blocks.copy_to(row, &mut bytes[place]);
            }
        }
        bytes
    }

    /// Bytes of a descriptor.
    pub fn length(&self) -> usize {
        self.length
    }

    /// Those with a sign, if there are any.
    pub(super) fn with_sign(&self, sign: i8) -> Option<&Group> {
        self.groups.iter().find(|group| group.sign == sign)
    }

    /// The sign of each keypoint.
    #[cfg(test)]
    pub(super) fn signs(&self) -> Vec<i8> {
        let mut signs = vec![0; self.len()];
        for group in &self.groups {
            for number in group.numbers.iter() {
                signs[number as usize] = group.sign;
            }
        }
        signs
    }

    /// Two points closer than this [reference px] are the same place.
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// Whether two of the descriptors, by their numbers, are of the same place.
    pub fn same_place(&self, a: usize, b: usize) -> bool {
        let (a, b) = (self.points[a], self.points[b]);
        (a[0] - b[0]).hypot(a[1] - b[1]) <= self.radius
    }
}
