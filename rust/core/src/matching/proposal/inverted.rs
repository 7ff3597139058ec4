//! For each word, which faces have descriptors there.

use rayon::prelude::*;

use super::ProposalSettings;
use super::codebook::Codebook;
use super::signature::{BITS, Projection, Projector, signature};
use super::votes;
use crate::matching::kernel::Kernel;
use crate::matching::{Metric, QueryKeypoint, ReferenceSet};
use crate::random::SplitMix64;

/// Descriptors that each of the most words is trained with, on average.
const SAMPLE: usize = 16;
/// Descriptors of a word, on average, when the words are trained (later there are more): with fewer, what
/// looks alike is in different words too often.
const FEWEST_OF_A_WORD: usize = 32;
/// The words are trained again when the library has grown by this factor.
const GROWTH: usize = 8;
const SEED: u64 = 0x5eed;

/// The descriptors of one word.
#[derive(Debug, Clone, Default)]
pub struct Postings {
    /// Where about the word each lies.
    pub signatures: Vec<u64>,
    /// The face of each.
    pub faces: Vec<u32>,
    /// Which one of the face it is.
    pub references: Vec<u32>,
}

/// Descriptors of all faces, sorted by words; as signatures, not in full.
#[derive(Debug, Clone)]
pub struct InvertedFile {
    settings: ProposalSettings,
    codebook: Codebook,
    projector: Projector,
    centres: Vec<Projection>,
    lists: Vec<Postings>,
    /// Number of descriptors in the library that the words were trained on.
    trained_on: usize,
}

impl InvertedFile {
    /// Trains the words on the library, which is not empty, and adds all its faces.
    pub fn build(
        how: (Metric, Kernel),
        faces: &[ReferenceSet],
        length: usize,
        settings: ProposalSettings,
    ) -> Self {
        let mut random = SplitMix64::new(SEED);
        let sample = sample(faces, length, &settings);
        let filed: usize = faces
            .iter()
            .map(|face| face.len().min(settings.first))
            .sum();
        let words = settings.words.min(filed.div_ceil(FEWEST_OF_A_WORD));
        let codebook = Codebook::train(how, &sample, length, words, &mut random);
        let projector = Projector::new(how.0, length, &mut random);
        let mut file = Self {
            settings,
            centres: centres(&codebook, &projector, &sample, length),
            codebook,
            projector,
            lists: vec![Postings::default(); words],
            trained_on: faces.iter().map(ReferenceSet::len).sum(),
        };
        for (number, face) in faces.iter().enumerate() {
            file.add(number as u32, face);
        }
        file
    }

    /// Bytes that the lists of the words occupy.
    pub fn bytes(&self) -> usize {
        let lists = self.lists.iter();
        lists
            .map(|list| {
                size_of_val(&list.signatures[..])
                    + size_of_val(&list.faces[..])
                    + size_of_val(&list.references[..])
            })
            .sum()
    }

    /// Whether the words were trained on a library that is small against one of this size.
    pub fn is_outgrown(&self, descriptors: usize) -> bool {
        descriptors >= GROWTH * self.trained_on
    }

    /// Adds a face; the words stay as they are.
    pub fn add(&mut self, number: u32, face: &ReferenceSet) {
        let (mut descriptors, length) = (face.descriptors(), face.length().max(1));
        descriptors.truncate(self.settings.first.saturating_mul(length));
        let words = self.codebook.nearest(&descriptors, 1);
        let descriptors = descriptors.chunks_exact(length);
        for (reference, (descriptor, word)) in descriptors.zip(words).enumerate() {
            let word = word as usize;
            let projection = self.projector.project(descriptor);
            let list = &mut self.lists[word];
            list.signatures
                .push(signature(&projection, &self.centres[word]));
            list.faces.push(number);
            list.references.push(reference as u32);
        }
    }

    /// Removes a face.
    pub fn remove(&mut self, number: u32) {
        self.lists.par_iter_mut().for_each(|list| {
            let mut faces = list.faces.iter();
            list.signatures.retain(|_| faces.next() != Some(&number));
            let mut faces = list.faces.iter();
            list.references.retain(|_| faces.next() != Some(&number));
            list.faces.retain(|&face| face != number);
        });
    }

    /// The faces with most votes of the queries that agree where the face is, ascending.
    ///
    /// `keypoints`: of the queries. `faces`: all that were added, by their numbers. `among`: the numbers
    /// of those that are asked for, ascending. The result does not depend on the number of threads.
    pub fn propose(
        &self,
        queries: &[u8],
        keypoints: &[QueryKeypoint],
        length: usize,
        faces: &[ReferenceSet],
        among: &[u32],
    ) -> Vec<u32> {
        let probes = self.settings.probes.min(self.lists.len());
        let words = self.codebook.nearest(queries, probes);
        let mut votes = queries
            .par_chunks_exact(length)
            .zip(words.par_chunks_exact(probes))
            .zip(keypoints)
            .with_min_len(16)
            .fold(
                || votes::Ballot::new(faces),
                |mut ballot, ((query, words), &keypoint)| {
                    let projection = self.projector.project(query);
                    for &word in words {
                        let word = word as usize;
                        let bits = signature(&projection, &self.centres[word]);
                        ballot.mark(bits, &self.lists[word], self.settings.bits);
                    }
                    ballot.cast(keypoint);
                    ballot
                },
            )
            .map(votes::Ballot::into_votes)
            // Pieces are put together in their order.
            .reduce(Vec::new, |mut votes, next| {
                votes.extend(next);
                votes
            });
        votes.retain(|vote| among.binary_search(&vote.face).is_ok());
        votes::most(votes, faces, self.settings.faces)
    }
}

/// Mean projection of each word and the descriptors nearest to it.
fn centres(
    codebook: &Codebook,
    projector: &Projector,
    sample: &[u8],
    length: usize,
) -> Vec<Projection> {
    let words = codebook.words();
    let words = words.chunks_exact(length);
    let mut sums: Vec<[i64; BITS]> = words
        .map(|word| projector.project(word).map(i64::from))
        .collect();
    let mut members = vec![1; sums.len()];
    let assigned = codebook.nearest(sample, 1);
    for (descriptor, word) in sample.chunks_exact(length).zip(assigned) {
        let projection = projector.project(descriptor);
        members[word as usize] += 1;
        for (sum, value) in sums[word as usize].iter_mut().zip(projection) {
            *sum += i64::from(value);
        }
    }
    let means = sums.into_iter().zip(members);
    means
        .map(|(sums, members)| sums.map(|sum| (sum / members) as i32))
        .collect()
}

/// Enough descriptors to train the words with, evenly from all faces.
fn sample(faces: &[ReferenceSet], length: usize, settings: &ProposalSettings) -> Vec<u8> {
    let used = |face: &ReferenceSet| face.len().min(settings.first);
    let total: usize = faces.iter().map(used).sum();
    let step = total.div_ceil(SAMPLE.saturating_mul(settings.words)).max(1);
    let mut bytes = Vec::with_capacity(total.div_ceil(step) * length);
    let mut next = 0;
    for face in faces {
        let descriptors = face.descriptors();
        while next < used(face) {
            bytes.extend_from_slice(&descriptors[next * length..][..length]);
            next += step;
        }
        next -= used(face);
    }
    bytes
}
