//! What the index keeps of a face.

use nalgebra::Matrix2;

use super::blocks::DescriptorBlocks;
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

/// Descriptors of one face, from all its oblique views.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReferenceSet {
    points: Vec<[f32; 2]>,
    descriptors: DescriptorBlocks,
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
        Ok(Self {
            points,
            frames,
            descriptors: DescriptorBlocks::new(&descriptors, length),
            radius,
        })
    }

    /// Number of descriptors.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Bytes that it occupies.
    pub fn bytes(&self) -> usize {
        let keypoints = size_of_val(&self.points[..]) + size_of_val(&self.frames[..]);
        keypoints + self.descriptors.bytes()
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
        self.descriptors.to_bytes()
    }

    /// Bytes of a descriptor.
    pub fn length(&self) -> usize {
        self.descriptors.length()
    }

    /// The descriptors as the search reads them.
    pub(super) fn blocks(&self) -> &DescriptorBlocks {
        &self.descriptors
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
