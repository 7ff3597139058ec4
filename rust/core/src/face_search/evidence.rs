//! What the matching of a frame says about each face.

use nalgebra::{Matrix2, Matrix3, Vector2};

use super::face::SearchedFace;
use crate::InputError;
use crate::homography::PointMatch;
use crate::matching::{Candidates, NONE};

/// The features of a frame without their descriptors.
#[derive(Debug, Clone, Default)]
pub struct ImageFeatures {
    /// Undistorted pixels.
    pub points: Vec<Vector2<f64>>,
    /// Diameter of the described neighbourhood [px].
    pub scales: Vec<f32>,
    /// Orientation [rad], from x towards y.
    pub angles: Vec<f32>,
}

impl ImageFeatures {
    /// From a feature's own frame to the image: a scaled rotation.
    fn frame(&self, feature: u32) -> Matrix2<f64> {
        let scale = f64::from(self.scales[feature as usize]);
        let (sine, cosine) = f64::from(self.angles[feature as usize]).sin_cos();
        Matrix2::new(cosine, -sine, sine, cosine) * scale
    }
}

/// A feature of the frame and one of the reference keypoints that look like it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Match {
    /// Index of the feature.
    pub feature: u32,
    /// Index of the keypoint of the face.
    pub reference: u32,
    /// Whether no descriptor of any face is nearer.
    pub nearest: bool,
    /// Of the feature: nearest distance over that of the nearest elsewhere.
    pub ratio: f64,
    /// Reference (edge coordinates) and frame (undistorted pixels).
    pub points: PointMatch,
}

/// The candidates of a frame, sorted by face.
#[derive(Debug, Clone)]
pub struct Evidence {
    features: ImageFeatures,
    ratio: Vec<f32>,
    /// Entries of face f: `starts[f] .. starts[f + 1]`.
    starts: Vec<u32>,
    /// By face, then by feature, the nearer first.
    entries: Vec<Entry>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Entry {
    feature: u32,
    reference: u32,
    nearest: bool,
}

impl Evidence {
    /// Sorts the candidates of `features` by face, of which there are `faces`.
    ///
    /// # Errors
    /// [`InputError::CandidateCount`] unless there are `k` candidates and one ratio a feature,
    /// [`InputError::NotFinite`] where a point, a scale or an angle is not finite.
    pub fn new(
        candidates: &Candidates,
        features: ImageFeatures,
        faces: usize,
    ) -> Result<Self, InputError> {
        check(candidates, &features)?;
        let known = |face: &&u32| **face != NONE && (**face as usize) < faces;
        let mut starts = vec![0_u32; faces + 1];
        for face in candidates.face.iter().filter(known) {
            starts[*face as usize + 1] += 1;
        }
        for face in 0..faces {
            starts[face + 1] += starts[face];
        }
        let mut next = starts.clone();
        let mut entries = vec![Entry::default(); starts[faces] as usize];
        for (i, face) in candidates.face.iter().enumerate() {
            if known(&face) {
                let place = &mut next[*face as usize];
                entries[*place as usize] = Entry {
                    feature: (i / candidates.k) as u32,
                    reference: candidates.reference[i],
                    nearest: i % candidates.k == 0,
                };
                *place += 1;
            }
        }
        Ok(Self {
            features,
            ratio: candidates.ratio.clone(),
            starts,
            entries,
        })
    }

    /// Number of features of the frame.
    pub fn features(&self) -> usize {
        self.features.points.len()
    }

    /// How many faces there are.
    pub fn faces(&self) -> usize {
        self.starts.len() - 1
    }

    /// How many features are nearest to a face and pass a ratio test.
    pub fn count(&self, face: usize, max_ratio: f64) -> usize {
        let passes = |entry: &&Entry| {
            entry.nearest && f64::from(self.ratio[entry.feature as usize]) <= max_ratio
        };
        self.entries_of(face).iter().filter(passes).count()
    }

    /// Every candidate of a face.
    pub fn of<'a>(&'a self, number: usize, face: &'a SearchedFace) -> FaceEvidence<'a> {
        let matches = self
            .entries_of(number)
            .iter()
            .filter(|entry| (entry.reference as usize) < face.len())
            .map(|entry| Match {
                feature: entry.feature,
                reference: entry.reference,
                nearest: entry.nearest,
                ratio: f64::from(self.ratio[entry.feature as usize]),
                points: PointMatch {
                    source: face.point(entry.reference),
                    target: self.features.points[entry.feature as usize],
                },
            })
            .collect::<Vec<Match>>();
        FaceEvidence {
            evidence: self,
            face,
            keypoints: matches
                .iter()
                .map(|one| one.reference + 1)
                .max()
                .unwrap_or(0),
            matches,
        }
    }

    /// None of a face that there was not when the candidates were sorted.
    fn entries_of(&self, face: usize) -> &[Entry] {
        match self.starts.get(face..).unwrap_or_default() {
            [start, end, ..] => &self.entries[*start as usize..*end as usize],
            _ => &[],
        }
    }
}

/// The candidates of one face.
#[derive(Debug, Clone)]
pub struct FaceEvidence<'a> {
    evidence: &'a Evidence,
    face: &'a SearchedFace,
    /// Matches are with the first so many of its keypoints.
    keypoints: u32,
    matches: Vec<Match>,
}

impl FaceEvidence<'_> {
    /// The face.
    pub fn face(&self) -> &SearchedFace {
        self.face
    }

    /// All of them, by feature, the nearer first.
    pub fn all(&self) -> &[Match] {
        &self.matches
    }

    /// Features that are nearest to this face and pass the ratio test.
    pub fn passing(&self, max_ratio: f64) -> Vec<Match> {
        let passes = |one: &&Match| one.nearest && one.ratio <= max_ratio;
        self.matches.iter().filter(passes).copied().collect()
    }

    /// Matches that a homography explains, whatever the ratio test says: the nearest of each
    /// feature whose reference point it puts within `radius` [px].
    pub fn agreeing(&self, H: &Matrix3<f64>, radius: f64) -> Vec<Match> {
        // Most keypoints occur in many matches; those beyond a first look in none.
        let mapped: Vec<Vector2<f32>> = (0..self.keypoints)
            .map(|keypoint| {
                let mapped = H * self.face.point(keypoint).push(1.0);
                let depth = if mapped.z > 0.0 { mapped.z } else { f64::NAN };
                (mapped.xy() / depth).cast()
            })
            .collect();
        // Rounding to single precision is far below the tenths of a pixel of a keypoint.
        let squared = (radius * radius) as f32;
        let mut agreeing: Vec<Match> = Vec::new();
        for one in &self.matches {
            let target: Vector2<f32> = one.points.target.cast();
            if (mapped[one.reference as usize] - target).norm_squared() <= squared
                && agreeing
                    .last()
                    .is_none_or(|last| last.feature != one.feature)
            {
                agreeing.push(*one);
            }
        }
        agreeing
    }

    /// How the keypoints' own frames say that the neighbourhood of the reference point is mapped
    /// into the frame; `None` where the reference keypoint has no area.
    pub fn local_map(&self, one: &Match) -> Option<Matrix2<f64>> {
        let reference = self.face.frame(one.reference).try_inverse()?;
        Some(self.evidence.features.frame(one.feature) * reference)
    }

    /// Leaves out the matches that `unwanted` accepts.
    pub fn remove(&mut self, unwanted: impl Fn(&Match) -> bool) {
        self.matches.retain(|one| !unwanted(one));
    }
}

fn check(candidates: &Candidates, features: &ImageFeatures) -> Result<(), InputError> {
    let count = features.points.len();
    let k = candidates.k;
    let complete = k > 0
        && candidates.face.len() == count * k
        && candidates.reference.len() == count * k
        && candidates.ratio.len() == count
        && features.scales.len() == count
        && features.angles.len() == count;
    if !complete {
        return Err(InputError::CandidateCount {
            features: count,
            k,
            candidates: candidates.face.len(),
        });
    }
    let values = |list: &[f32]| list.iter().all(|v| v.is_finite());
    let points = || features.points.iter().flatten().all(|v| v.is_finite());
    if !(points() && values(&features.scales) && values(&features.angles)) {
        return Err(InputError::NotFinite { what: "features" });
    }
    Ok(())
}

#[cfg(test)]
mod tests;
