//! What the index finds for a frame.

/// Face of a neighbour that does not exist.
pub const NONE: u32 = u32::MAX;

/// The k nearest reference descriptors of each feature of a frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Candidates {
    /// Neighbours a feature.
    pub k: usize,
    /// N×k index of the face, [`NONE`] where fewer were found; nearest first, equally near ones in
    /// the order of faces and references.
    pub face: Vec<u32>,
    /// N×k index within the face's [`ReferenceSet`](super::ReferenceSet).
    pub reference: Vec<u32>,
    /// N×k distance: Euclidean, or number of differing bits; infinite where there is none.
    pub distance: Vec<f32>,
    /// N: nearest distance over that of the nearest elsewhere, on the face or on another one, also
    /// if that is not among the k nearest. 0 where there is none elsewhere, 1 where two places are
    /// exactly alike, infinite without any.
    pub ratio: Vec<f32>,
}

impl Candidates {
    /// No neighbours for this many features yet; keeps the memory that it has.
    pub(super) fn reset(&mut self, features: usize, k: usize) {
        self.k = k;
        refill(&mut self.face, features * k, NONE);
        refill(&mut self.reference, features * k, NONE);
        refill(&mut self.distance, features * k, f32::INFINITY);
        refill(&mut self.ratio, features, f32::INFINITY);
    }

    /// Takes over what was found for some of the features, by their numbers.
    pub(super) fn take_over(&mut self, some: &Candidates, numbers: &[u32]) {
        let k = self.k;
        for (i, &number) in numbers.iter().enumerate() {
            let (from, to) = (i * k..(i + 1) * k, number as usize * k);
            self.face[to..to + k].copy_from_slice(&some.face[from.clone()]);
            self.reference[to..to + k].copy_from_slice(&some.reference[from.clone()]);
            self.distance[to..to + k].copy_from_slice(&some.distance[from]);
            self.ratio[number as usize] = some.ratio[i];
        }
    }
}

fn refill<T: Clone>(values: &mut Vec<T>, count: usize, value: T) {
    values.clear();
    values.resize(count, value);
}
