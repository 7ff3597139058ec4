//! Which faces of a large library to look at closely: an inverted file proposes them (Sivic and
//! Zisserman, ICCV 2003), the exact search decides.

mod codebook;
mod inverted;
mod signature;
#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests;
mod votes;

pub use inverted::InvertedFile;

use super::reference::MOST_FILED;
use crate::InputError;

/// How faces are proposed.
///
/// A face is proposed only where two of its places at least agree where it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProposalSettings {
    /// Of faces with more descriptors than this in all some are proposed; fewer are all looked at.
    pub exhaustive: usize,
    /// Descriptors of each face that take part: the first, which are the most useful ones.
    pub first: usize,
    /// Most faces that are proposed; no more than these are all looked at.
    pub faces: usize,
    /// Most words of the codebook: small libraries have fewer.
    pub words: usize,
    /// Nearest words of each query that are looked up.
    pub probes: usize,
    /// Most differing bits, of 64, between the signatures of a query and a reference that votes.
    pub bits: u32,
}

impl ProposalSettings {
    /// Checks the ranges.
    ///
    /// # Errors
    /// [`InputError::OutOfRange`] for no descriptors, faces, words or probes, and for more than
    /// [`MOST_FILED`] descriptors.
    pub fn checked(self) -> Result<Self, InputError> {
        let counts = [
            ("first", self.first),
            ("faces", self.faces),
            ("words", self.words),
            ("probes", self.probes),
        ];
        if self.first > MOST_FILED {
            return Err(InputError::OutOfRange {
                name: "first",
                value: self.first as f64,
                valid: "at most 1000",
            });
        }
        match counts.into_iter().find(|(_, count)| *count == 0) {
            None => Ok(self),
            Some((name, _)) => Err(InputError::OutOfRange {
                name,
                value: 0.0,
                valid: "at least 1",
            }),
        }
    }
}

impl Default for ProposalSettings {
    fn default() -> Self {
        Self {
            exhaustive: 40_000,
            first: MOST_FILED,
            faces: 12,
            words: 4096,
            probes: 4,
            bits: 14,
        }
    }
}
