//! One index over the descriptors of all faces.

use rayon::prelude::*;

use super::exhaustive::Search;
use super::kernel::Kernel;
use super::proposal::{InvertedFile, ProposalSettings};
use super::queries::{SIGNS, check_signs};
use super::{Candidates, Metric, Queries, QueryKeypoint, ReferenceSet};
use crate::InputError;

/// Most neighbours of one query: memory for as many is taken before there are any.
const MOST_NEIGHBOURS: usize = 4096;

/// Nearest-neighbour search over all faces together.
///
/// The search is exact: [`Self::candidates`] looks at all faces, [`Self::candidates_into`] at some.
/// [`Self::propose`] says which of a large library are worth it, see [`ProposalSettings`].
#[derive(Debug, Clone)]
pub struct ReferenceIndex {
    kernel: Kernel,
    metric: Metric,
    length: usize,
    faces: Vec<ReferenceSet>,
    present: Vec<u32>,
    descriptors: usize,
    farthest: i32,
    settings: ProposalSettings,
    inverted: Option<InvertedFile>,
}

impl ReferenceIndex {
    /// An empty index for descriptors of `length` bytes.
    pub fn new(metric: Metric, length: usize) -> Self {
        Self::with_kernel(metric, length, Kernel::best())
    }

    /// The same on a certain instruction set; the results are equal.
    pub fn with_kernel(metric: Metric, length: usize, kernel: Kernel) -> Self {
        Self {
            kernel,
            metric,
            length,
            faces: Vec::new(),
            present: Vec::new(),
            descriptors: 0,
            farthest: i32::MAX,
            settings: ProposalSettings::default(),
            inverted: None,
        }
    }

    /// The same with other settings of the proposal; for an index that is still empty.
    ///
    /// # Errors
    /// [`InputError::OutOfRange`] for settings out of their ranges.
    pub fn with_settings(self, settings: ProposalSettings) -> Result<Self, InputError> {
        let settings = settings.checked()?;
        Ok(Self { settings, ..self })
    }

    /// The same with neighbours nearer than a distance only: others are not alike, and looking for
    /// them costs time. For an index that is still empty.
    ///
    /// # Errors
    /// [`InputError::OutOfRange`] unless it is > 0; infinity is no limit.
    pub fn with_farthest(self, distance: f32) -> Result<Self, InputError> {
        if distance.is_nan() || distance <= 0.0 {
            return Err(InputError::OutOfRange {
                name: "the farthest distance",
                value: f64::from(distance),
                valid: "> 0",
            });
        }
        let farthest = match self.metric {
            Metric::Euclidean => distance * distance,
            Metric::Hamming => distance,
        };
        // A conversion from float to integer saturates.
        let farthest = farthest.ceil() as i32;
        Ok(Self { farthest, ..self })
    }

    /// Adds a face and returns its number: the next one, counting those that were removed.
    ///
    /// # Errors
    /// [`InputError::DescriptorLength`] where its descriptors are not of the index's length.
    pub fn add(&mut self, face: ReferenceSet) -> Result<usize, InputError> {
        if face.length() != self.length {
            return Err(InputError::DescriptorLength {
                length: face.length(),
                expected: self.length,
            });
        }
        let number = self.faces.len();
        self.faces.push(face);
        self.present.push(number as u32);
        self.descriptors += self.faces[number].len();
        self.file(number);
        Ok(number)
    }

    /// Whether some of these faces, of so many descriptors, are to be proposed.
    fn are_many(&self, faces: usize, descriptors: usize) -> bool {
        descriptors > self.settings.exhaustive && faces > self.settings.faces
    }

    /// Enters a new face into the inverted file, or makes that where the library needs one.
    fn file(&mut self, number: usize) {
        let are_many = self.are_many(self.present.len(), self.descriptors);
        match &mut self.inverted {
            Some(inverted) if !inverted.is_outgrown(self.descriptors) => {
                inverted.add(number as u32, &self.faces[number]);
            }
            None if !are_many => {}
            _ => {
                let how = (self.metric, self.kernel);
                let file = InvertedFile::build(how, &self.faces, self.length, self.settings);
                self.inverted = Some(file);
            }
        }
    }

    /// Removes a face. The others keep their numbers; this one's stays empty.
    ///
    /// # Errors
    /// [`InputError::NoSuchFace`] where no face has the number, or it was removed already.
    pub fn remove(&mut self, face: usize) -> Result<(), InputError> {
        let place = self.present.iter().position(|&f| f as usize == face);
        let Some(place) = place else {
            return Err(InputError::NoSuchFace {
                face,
                count: self.faces.len(),
            });
        };
        self.present.remove(place);
        self.descriptors -= self.faces[face].len();
        self.faces[face] = ReferenceSet::default();
        if let Some(inverted) = &mut self.inverted {
            inverted.remove(face as u32);
        }
        Ok(())
    }

    /// Bytes that the descriptors, their points and the inverted file occupy.
    pub fn bytes(&self) -> usize {
        let sets: usize = self.faces.iter().map(ReferenceSet::bytes).sum();
        sets + self.inverted.as_ref().map_or(0, InvertedFile::bytes)
    }

    /// The faces in the order in which they were added; removed ones are empty.
    pub fn faces(&self) -> &[ReferenceSet] {
        &self.faces
    }

    /// The faces that are worth looking at for these descriptors, ascending: all where these are few, and
    /// perhaps none of many.
    ///
    /// The keypoints' points may be those of the distorted image: what agrees is not that exact.
    /// `among`: numbers of the faces that are asked for, all where `None`.
    ///
    /// # Errors
    /// [`InputError::DescriptorCount`] where there is no whole descriptor a keypoint,
    /// [`InputError::NoSuchFace`] for numbers that are not in the index.
    pub fn propose(
        &self,
        queries: &[u8],
        keypoints: &[QueryKeypoint],
        among: Option<&[u32]>,
    ) -> Result<Vec<u32>, InputError> {
        if keypoints.len().checked_mul(self.length) != Some(queries.len()) {
            return Err(InputError::DescriptorCount {
                points: keypoints.len(),
                length: self.length,
                bytes: queries.len(),
            });
        }
        let mut among = among.unwrap_or(&self.present).to_vec();
        self.check_faces(among.iter().copied())?;
        among.sort_unstable();
        among.dedup();
        let descriptors = among.iter().map(|&face| self.faces[face as usize].len());
        let are_many = self.are_many(among.len(), descriptors.sum());
        Ok(match &self.inverted {
            Some(file) if are_many => {
                file.propose(queries, keypoints, self.length, &self.faces, &among)
            }
            _ => among,
        })
    }

    /// The k nearest references of each descriptor among all faces, and the ratio to the nearest
    /// elsewhere.
    ///
    /// Only keypoints of one sign are compared. The result does not depend on the number of threads
    /// nor on the processor.
    ///
    /// # Errors
    /// Those of [`Self::candidates_into`].
    pub fn candidates<'a>(
        &self,
        queries: impl Into<Queries<'a>>,
        k: usize,
    ) -> Result<Candidates, InputError> {
        let mut found = Candidates::default();
        let present = self.present.iter();
        let among: Vec<(u32, usize)> = present.map(|&face| (face, usize::MAX)).collect();
        self.candidates_into(queries, k, &among, &mut found)?;
        Ok(found)
    }

    /// The same among certain faces, into memory that is used again.
    ///
    /// `among`: their numbers, ascending, and how many of the first descriptors of each to look at,
    /// those of each sign rounded up to whole blocks of 32.
    ///
    /// # Errors
    /// [`InputError::DescriptorCount`] where the queries are no whole number of descriptors,
    /// [`InputError::SignCount`] where they have another number of signs,
    /// [`InputError::OutOfRange`] for another sign than -1, 0 and 1, for k = 0 or above 4096,
    /// [`InputError::NoSuchFace`] for numbers that are not in the index; `found` is as it was then.
    pub fn candidates_into<'a>(
        &self,
        queries: impl Into<Queries<'a>>,
        k: usize,
        among: &[(u32, usize)],
        found: &mut Candidates,
    ) -> Result<(), InputError> {
        let queries = queries.into();
        self.check(&queries)?;
        if !(1..=MOST_NEIGHBOURS).contains(&k) {
            return Err(InputError::OutOfRange {
                name: "k",
                value: k as f64,
                valid: "at least 1 and at most 4096",
            });
        }
        self.check_faces(among.iter().map(|one| one.0))?;
        let length = self.length.max(1);
        let of_sign = |sign| {
            let numbers = queries.with_sign(sign, length);
            let search = Search {
                queries,
                numbers: &numbers,
                sign,
                kernel: self.kernel,
                metric: self.metric,
                length,
                faces: &self.faces,
                among,
                farthest: self.farthest,
            };
            let some = search.candidates(k);
            (numbers, some)
        };
        // Side by side, so that no thread waits for the last queries of each sign.
        let parts: Vec<_> = SIGNS.into_par_iter().map(of_sign).collect();
        found.reset(queries.count(length), k);
        for (numbers, some) in &parts {
            found.take_over(some, numbers);
        }
        Ok(())
    }

    fn check_faces(&self, mut numbers: impl Iterator<Item = u32>) -> Result<(), InputError> {
        let count = self.faces.len();
        match numbers.find(|&number| number as usize >= count) {
            None => Ok(()),
            Some(number) => Err(InputError::NoSuchFace {
                face: number as usize,
                count,
            }),
        }
    }

    fn check(&self, queries: &Queries<'_>) -> Result<(), InputError> {
        let (bytes, length) = (queries.descriptors.len(), self.length);
        let points = bytes / length.max(1);
        if !bytes.is_multiple_of(length) {
            return Err(InputError::DescriptorCount {
                points,
                length,
                bytes,
            });
        }
        queries
            .signs
            .map_or(Ok(()), |signs| check_signs(signs, points))
    }
}
