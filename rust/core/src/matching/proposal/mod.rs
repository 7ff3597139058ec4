//! Which faces of a large library to look at closely: an inverted file proposes them (Sivic and
//! Zisserman, ICCV 2003), the exact search decides.

mod codebook;
mod inverted;
mod signature;
mod votes;

pub use inverted::InvertedFile;

/// How faces are proposed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProposalSettings {
    /// Libraries of more descriptors than this propose faces; smaller ones look at all.
    pub exhaustive: usize,
    /// Descriptors of each face that take part: the first, which are the most useful ones.
    pub first: usize,
    /// Most faces that are proposed.
    pub faces: usize,
    /// Words of the codebook.
    pub words: usize,
    /// Nearest words of each query that are looked up.
    pub probes: usize,
    /// Most differing bits, of 64, between the signatures of a query and a reference that votes.
    pub bits: u32,
}

impl Default for ProposalSettings {
    fn default() -> Self {
        Self {
            exhaustive: 50_000,
            first: 1000,
            faces: 12,
            words: 4096,
            probes: 4,
            bits: 20,
        }
    }
}
