//! One index over the descriptors of all faces.

use super::{Candidates, Metric, NONE, ReferenceSet};
use crate::InputError;

/// Exact nearest-neighbour search over all faces together.
#[derive(Debug, Clone)]
pub struct ReferenceIndex {
    metric: Metric,
    length: usize,
    faces: Vec<ReferenceSet>,
}

impl ReferenceIndex {
    /// An empty index for descriptors of `length` bytes.
    pub fn new(metric: Metric, length: usize) -> Self {
        Self {
            metric,
            length,
            faces: Vec::new(),
        }
    }

    /// Adds a face, which gets the next number.
    pub fn add(&mut self, face: ReferenceSet) {
        self.faces.push(face);
    }

    /// The faces in the order in which they were added.
    pub fn faces(&self) -> &[ReferenceSet] {
        &self.faces
    }

    /// The k nearest references of each descriptor, and the ratio to the nearest elsewhere.
    ///
    /// # Errors
    /// [`InputError::DescriptorCount`] where the queries are no whole number of descriptors.
    pub fn candidates(&self, queries: &[u8], k: usize) -> Result<Candidates, InputError> {
        if !queries.len().is_multiple_of(self.length) {
            return Err(InputError::DescriptorCount {
                points: queries.len() / self.length,
                length: self.length,
                bytes: queries.len(),
            });
        }
        let mut found = Candidates {
            k,
            ..Candidates::default()
        };
        for query in queries.chunks_exact(self.length) {
            let mut all: Vec<(f32, u32, u32)> = Vec::new();
            for (number, face) in self.faces.iter().enumerate() {
                for (i, reference) in face.descriptors().chunks_exact(self.length).enumerate() {
                    all.push((self.distance(query, reference), number as u32, i as u32));
                }
            }
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
            let nearest = all.first().copied();
            let elsewhere = all.iter().find(|other| {
                nearest.is_some_and(|near| {
                    let face = &self.faces[near.1 as usize];
                    let (a, b) = (near.2 as usize, other.2 as usize);
                    near.1 != other.1
                        || distance(face.points()[a], self.faces[other.1 as usize].points()[b])
                            > face.radius()
                })
            });
            found.ratio.push(match (nearest, elsewhere) {
                (None, _) => f32::INFINITY,
                (Some(_), None) => 0.0,
                (Some(_), Some(other)) if other.0 == 0.0 => 1.0,
                (Some(near), Some(other)) => near.0 / other.0,
            });
            all.resize(k.max(all.len()), (f32::INFINITY, NONE, NONE));
            for neighbour in &all[..k] {
                found.distance.push(neighbour.0);
                found.face.push(neighbour.1);
                found.reference.push(neighbour.2);
            }
        }
        Ok(found)
    }

    fn distance(&self, a: &[u8], b: &[u8]) -> f32 {
        let pairs = a.iter().zip(b);
        match self.metric {
            Metric::Euclidean => {
                let sum: u32 = pairs.map(|(a, b)| u32::from(a.abs_diff(*b)).pow(2)).sum();
                (sum as f32).sqrt()
            }
            Metric::Hamming => pairs.map(|(a, b)| (a ^ b).count_ones()).sum::<u32>() as f32,
        }
    }
}

fn distance(a: [f32; 2], b: [f32; 2]) -> f32 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}
