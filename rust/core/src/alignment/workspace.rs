//! Memory that alignments reuse.

use nalgebra::Vector2;

use super::motion::Observation;
use super::template::Template;
use super::tiles::Tile;

/// Buffers of an alignment, to be reused for the next: then nothing is allocated.
#[derive(Debug, Default)]
pub struct AlignmentWorkspace {
    pub(super) tiles: Vec<Tile>,
    pub(super) templates: Vec<Template>,
    pub(super) observations: Vec<Observation>,
    /// Which template each observation is of.
    pub(super) observed: Vec<usize>,
    pub(super) agreeing: Vec<Vector2<f64>>,
    pub(super) squares: Vec<f64>,
    /// Correlations of the tiles by their number, of the first rendering and of the last.
    pub(super) before: Vec<f64>,
    pub(super) after: Vec<f64>,
}

impl AlignmentWorkspace {
    /// Empty buffers.
    pub fn new() -> Self {
        Self::default()
    }

    /// Number of tiles that the last alignment compared.
    pub fn compared(&self) -> usize {
        self.tiles.len()
    }

    /// Centres of the tiles that the last alignment's homography is of, in edge coordinates of the
    /// reference.
    pub fn agreeing(&self) -> &[Vector2<f64>] {
        &self.agreeing
    }
}
