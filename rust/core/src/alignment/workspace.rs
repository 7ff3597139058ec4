//! Memory that alignments reuse.

use super::motion::Observation;
use super::template::Template;
use super::tiles::Tile;

/// Buffers of an alignment, to be reused for the next: then nothing is allocated.
#[derive(Debug, Default)]
pub struct AlignmentWorkspace {
    pub(super) tiles: Vec<Tile>,
    pub(super) templates: Vec<Template>,
    pub(super) observations: Vec<Observation>,
    pub(super) squares: Vec<f64>,
    pub(super) correlations: Vec<f64>,
}

impl AlignmentWorkspace {
    /// Empty buffers.
    pub fn new() -> Self {
        Self::default()
    }
}
