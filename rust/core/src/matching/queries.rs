//! What is looked for in the index.

use crate::InputError;

/// The signs that a keypoint may have, see [`Keypoint::sign`](crate::Keypoint::sign).
pub const SIGNS: [i8; 3] = [-1, 0, 1];

/// Descriptors of a frame, one after the other, and the signs of their keypoints.
#[derive(Debug, Clone, Copy)]
pub struct Queries<'a> {
    /// As many bytes each as those of the index.
    pub descriptors: &'a [u8],
    /// One a descriptor; all 0 where `None`.
    pub signs: Option<&'a [i8]>,
}

/// Descriptors without signs.
impl<'a, T: AsRef<[u8]> + ?Sized> From<&'a T> for Queries<'a> {
    fn from(descriptors: &'a T) -> Self {
        Self {
            descriptors: descriptors.as_ref(),
            signs: None,
        }
    }
}

impl<'a> Queries<'a> {
    /// Their number.
    pub(super) fn count(&self, length: usize) -> usize {
        self.descriptors.len() / length
    }

    /// One of them.
    pub(super) fn of(&self, number: u32, length: usize) -> &'a [u8] {
        &self.descriptors[number as usize * length..][..length]
    }

    /// The numbers of those with a sign, ascending.
    pub(super) fn with_sign(&self, sign: i8, length: usize) -> Vec<u32> {
        let all = 0..self.count(length) as u32;
        match self.signs {
            None if sign == 0 => all.collect(),
            None => Vec::new(),
            Some(signs) => all.filter(|&i| signs[i as usize] == sign).collect(),
        }
    }
}

/// Checks that there is one sign for each of `count` descriptors.
pub fn check_signs(signs: &[i8], count: usize) -> Result<(), InputError> {
    if signs.len() != count {
        return Err(InputError::SignCount {
            descriptors: count,
            signs: signs.len(),
        });
    }
    match signs.iter().find(|sign| !SIGNS.contains(sign)) {
        None => Ok(()),
        Some(sign) => Err(InputError::OutOfRange {
            name: "a keypoint's sign",
            value: f64::from(*sign),
            valid: "-1, 0 or 1",
        }),
    }
}
