//! The search for faces among the matches of a frame.

use nalgebra::Matrix3;
use numpy::{PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use planegrasp_core::face_search::{self as core, Match, SearchSettings as CoreSettings};
use planegrasp_core::matching::Candidates;
use planegrasp_core::{GrayImage, InputError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{gray_image, matrix3, points, points_to_numpy, rows, to_numpy, values};
use crate::camera::Camera;
use crate::errors::{from_input_error, invalid_input};

/// Settings of the search; see `planegrasp.homography.HomographyConfig`.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct SearchSettings {
    core: CoreSettings,
}

#[pymethods]
impl SearchSettings {
    #[new]
    #[pyo3(signature = (
        *, min_matches, max_ratio, max_loose_ratio, threshold, iterations, min_inliers, min_coverage,
        min_side, max_stretch, aspect_sigma, min_agreement,
        min_doubtful_tiles
    ))]
    #[allow(clippy::too_many_arguments)] // every one of them is a named setting
    fn new(
        min_matches: usize,
        max_ratio: f64,
        max_loose_ratio: f64,
        threshold: f64,
        iterations: usize,
        min_inliers: usize,
        min_coverage: f64,
        min_side: f64,
        max_stretch: f64,
        aspect_sigma: f64,
        min_agreement: f64,
        min_doubtful_tiles: f64,
    ) -> Self {
        Self {
            core: CoreSettings {
                min_matches,
                max_ratio,
                max_loose_ratio,
                threshold,
                iterations,
                min_inliers,
                min_coverage,
                min_side,
                max_stretch,
                aspect_sigma,
                min_agreement,
                min_doubtful_tiles,
            },
        }
    }
}

/// What a face looks like, for comparison with a frame.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct Appearance {
    core: core::Appearance,
}

#[pymethods]
impl Appearance {
    #[new]
    fn new(gray: PyReadonlyArrayDyn<'_, u8>) -> PyResult<Self> {
        core::Appearance::new(gray_image(&gray, "gray")?)
            .map(|core| Self { core })
            .map_err(from_input_error)
    }

    /// Share of the reference's textured cells that the frame shows where a homography says.
    fn agreement(
        &self,
        py: Python<'_>,
        frame: PyReadonlyArrayDyn<'_, u8>,
        homography: PyReadonlyArrayDyn<'_, f64>,
    ) -> PyResult<f64> {
        let frame = gray_image(&frame, "frame")?;
        let homography = matrix3(&homography, "homography")?;
        Ok(py.detach(|| self.core.agreement(frame, &homography)))
    }
}

/// The candidates of one frame, sorted by face.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct Evidence {
    core: core::Evidence,
}

#[pymethods]
impl Evidence {
    fn __len__(&self) -> usize {
        self.core.features()
    }
}

/// Matches of one face: features of the frame, N×2 reference points, N×2 image points, ratios.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct Matches {
    core: Vec<Match>,
}

#[pymethods]
impl Matches {
    fn __len__(&self) -> usize {
        self.core.len()
    }

    #[getter]
    fn query<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        PyArray1::from_iter(py, self.core.iter().map(|one| one.feature))
    }

    #[getter]
    fn ratio<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.core.iter().map(|one| one.ratio))
    }

    #[getter]
    fn reference_points<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        points_to_numpy(py, self.core.iter().map(|one| one.points.source))
    }

    #[getter]
    fn image_points<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        points_to_numpy(py, self.core.iter().map(|one| one.points.target))
    }
}

/// A homography of one face, not verified.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct HomographyEstimate {
    core: core::HomographyEstimate,
}

#[pymethods]
impl HomographyEstimate {
    #[getter]
    fn matrix<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        to_numpy(py, &self.core.matrix)
    }

    #[getter]
    fn inliers(&self) -> Matches {
        Matches {
            core: self.core.inliers.clone(),
        }
    }
}

/// A face where it was found.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct FoundFace {
    core: core::FoundFace,
}

#[pymethods]
impl FoundFace {
    #[getter]
    fn homography<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        to_numpy(py, &self.core.homography)
    }

    #[getter]
    fn matched_homography<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        to_numpy(py, &self.core.matched_homography)
    }

    #[getter]
    fn is_aligned(&self) -> bool {
        self.core.homography != self.core.matched_homography
    }

    #[getter]
    fn outline<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        points_to_numpy(py, self.core.outline.iter().copied())
    }

    #[getter]
    fn inliers(&self) -> Matches {
        Matches {
            core: self.core.inliers.clone(),
        }
    }

    #[getter]
    fn coverage(&self) -> f64 {
        self.core.coverage
    }

    #[getter]
    fn agreement(&self) -> f64 {
        self.core.agreement
    }

    #[getter]
    fn is_evident(&self) -> bool {
        self.core.is_evident
    }
}

/// One attempt at one face.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct Attempt {
    core: core::Attempt,
}

#[pymethods]
impl Attempt {
    #[getter]
    fn face(&self) -> usize {
        self.core.face
    }

    #[getter]
    fn instance(&self) -> usize {
        self.core.instance
    }

    #[getter]
    fn stage(&self) -> &'static str {
        match &self.core.outcome {
            Ok(_) => "found",
            Err(refusal) => refusal.stage(),
        }
    }

    #[getter]
    fn reason(&self) -> String {
        let refusal = self.core.outcome.as_ref().err();
        refusal.map(ToString::to_string).unwrap_or_default()
    }

    #[getter]
    fn found(&self) -> Option<FoundFace> {
        let core = self.core.outcome.as_ref().ok()?.clone();
        Some(FoundFace { core })
    }

    #[getter]
    fn figures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let core::Figures {
            matches,
            inliers,
            stretch,
            coverage,
            agreement,
            tiles,
        } = self.core.figures;
        let counts = [("matches", matches), ("inliers", inliers)]
            .map(|(name, count)| (name, count.map(|count| count as f64)));
        let measures = [
            ("stretch", stretch),
            ("coverage", coverage),
            ("agreement", agreement),
            ("tiles", tiles),
        ];
        let dict = PyDict::new(py);
        for (name, value) in counts.into_iter().chain(measures) {
            if let Some(value) = value {
                dict.set_item(name, value)?;
            }
        }
        Ok(dict)
    }
}

/// Finds the faces that were added to it.
#[pyclass(module = "planegrasp._core")]
pub struct FaceSearch {
    faces: Vec<core::SearchedFace>,
    settings: CoreSettings,
}

#[pymethods]
impl FaceSearch {
    #[new]
    fn new(settings: PyRef<'_, SearchSettings>) -> Self {
        Self {
            faces: Vec::new(),
            settings: settings.core.clone(),
        }
    }

    fn __len__(&self) -> usize {
        self.faces.len()
    }

    /// Bytes that the faces occupy.
    #[getter]
    fn nbytes(&self) -> usize {
        self.faces.iter().map(core::SearchedFace::bytes).sum()
    }

    /// Adds a face, which gets the next number.
    fn add(
        &mut self,
        face_from_edge: PyReadonlyArrayDyn<'_, f64>,
        points: PyReadonlyArrayDyn<'_, f32>,
        frames: PyReadonlyArrayDyn<'_, f32>,
        gray: PyReadonlyArrayDyn<'_, u8>,
    ) -> PyResult<()> {
        let gray = gray_image(&gray, "gray")?;
        let face = core::SearchedFace::new(
            gray,
            matrix3(&face_from_edge, "face_from_edge")?,
            rows::<2>(&points, "points")?,
            rows::<4>(&frames, "frames")?,
        );
        self.faces.push(face.map_err(from_input_error)?);
        Ok(())
    }

    /// Sorts the candidates of a frame by face.
    #[allow(clippy::too_many_arguments)] // one array each
    fn evidence(
        &self,
        py: Python<'_>,
        face: PyReadonlyArrayDyn<'_, i32>,
        reference: PyReadonlyArrayDyn<'_, i32>,
        ratio: PyReadonlyArrayDyn<'_, f32>,
        image_points: PyReadonlyArrayDyn<'_, f64>,
        scales: PyReadonlyArrayDyn<'_, f32>,
        angles: PyReadonlyArrayDyn<'_, f32>,
    ) -> PyResult<Evidence> {
        let k = match face.shape() {
            [_, k] => *k,
            shape => return Err(invalid_input(format!("face must be N×k, got {shape:?}"))),
        };
        if reference.shape() != face.shape() {
            let (faces, references) = (face.shape(), reference.shape());
            return Err(invalid_input(format!(
                "face and reference must have one shape, got {faces:?} and {references:?}"
            )));
        }
        // -1, no neighbour, becomes the core's NONE.
        let unsigned = |array: &PyReadonlyArrayDyn<'_, i32>| -> Vec<u32> {
            values(array).iter().map(|&i| i as u32).collect()
        };
        let floats = |array: &PyReadonlyArrayDyn<'_, f32>| values(array).into_owned();
        let candidates = Candidates {
            k,
            face: unsigned(&face),
            reference: unsigned(&reference),
            distance: Vec::new(),
            ratio: floats(&ratio),
        };
        let features = core::ImageFeatures {
            points: points(&image_points, "image_points")?,
            scales: floats(&scales),
            angles: floats(&angles),
        };
        py.detach(|| core::Evidence::new(&candidates, features, self.faces.len()))
            .map(|core| Evidence { core })
            .map_err(from_input_error)
    }

    /// Finds every instance of some faces.
    #[pyo3(signature = (evidence, gray, camera, *, among, max_instances, refused = true))]
    #[allow(clippy::too_many_arguments)] // the frame, and what is asked of it
    fn find(
        &self,
        py: Python<'_>,
        evidence: PyRef<'_, Evidence>,
        gray: PyReadonlyArrayDyn<'_, u8>,
        camera: PyRef<'_, Camera>,
        among: PyReadonlyArray1<'_, u32>,
        max_instances: usize,
        refused: bool,
    ) -> PyResult<Vec<Attempt>> {
        self.fits(&evidence)?;
        let view = view(&evidence, &gray, &camera)?;
        let among: Vec<usize> = among.as_array().iter().map(|&face| face as usize).collect();
        let attempts =
            py.detach(|| core::find(&self.faces, &among, &view, &self.settings, max_instances));
        Ok(attempts
            .into_iter()
            .filter(|attempt| refused || attempt.outcome.is_ok())
            .map(|core| Attempt { core })
            .collect())
    }

    /// Verifies one face where a homography predicts it.
    fn look_where(
        &self,
        py: Python<'_>,
        number: isize,
        predicted: PyReadonlyArrayDyn<'_, f64>,
        evidence: PyRef<'_, Evidence>,
        gray: PyReadonlyArrayDyn<'_, u8>,
        camera: PyRef<'_, Camera>,
    ) -> PyResult<Option<FoundFace>> {
        self.fits(&evidence)?;
        let (number, face) = self.face(number)?;
        let predicted: Matrix3<f64> = matrix3(&predicted, "predicted")?;
        let view = view(&evidence, &gray, &camera)?;
        let found = py.detach(|| core::look_where(number, face, &predicted, &view, &self.settings));
        Ok(found.map(|core| FoundFace { core }))
    }

    /// Matches with one face that pass a ratio test.
    fn matches(
        &self,
        evidence: PyRef<'_, Evidence>,
        number: isize,
        max_ratio: f64,
    ) -> PyResult<Matches> {
        self.fits(&evidence)?;
        let (number, face) = self.face(number)?;
        let core = evidence.core.of(number, face).passing(max_ratio);
        Ok(Matches { core })
    }

    /// Homographies of one face that would be verified, in their order.
    fn hypotheses(
        &self,
        py: Python<'_>,
        evidence: PyRef<'_, Evidence>,
        number: isize,
        camera: PyRef<'_, Camera>,
    ) -> PyResult<Vec<HomographyEstimate>> {
        self.fits(&evidence)?;
        let ((number, face), evidence) = (self.face(number)?, &evidence.core);
        let camera = &camera.core;
        let found = py.detach(|| {
            let of_face = evidence.of(number, face);
            [core::from_strict, core::from_supported]
                .map(|from| from(&of_face, camera, &self.settings))
        });
        Ok(found
            .into_iter()
            .flatten()
            .map(|core| HomographyEstimate { core })
            .collect())
    }

    /// A homography refined over all matches that agree with it, or None.
    fn refine(
        &self,
        py: Python<'_>,
        start: PyReadonlyArrayDyn<'_, f64>,
        evidence: PyRef<'_, Evidence>,
        number: isize,
        camera: PyRef<'_, Camera>,
    ) -> PyResult<Option<HomographyEstimate>> {
        self.fits(&evidence)?;
        let ((number, face), evidence) = (self.face(number)?, &evidence.core);
        let start = matrix3(&start, "start")?;
        let camera = &camera.core;
        let refined =
            py.detach(|| core::refine(&start, &evidence.of(number, face), camera, &self.settings));
        Ok(refined.map(|core| HomographyEstimate { core }))
    }
}

impl FaceSearch {
    fn face(&self, number: isize) -> PyResult<(usize, &core::SearchedFace)> {
        let known = usize::try_from(number).ok();
        known
            .and_then(|number| Some((number, self.faces.get(number)?)))
            .ok_or_else(|| {
                let count = self.faces.len();
                invalid_input(format!("there are {count} faces, got the number {number}"))
            })
    }

    /// Faces that were added after the evidence was sorted are not in it.
    fn fits(&self, evidence: &Evidence) -> PyResult<()> {
        let (sorted, faces) = (evidence.core.faces(), self.faces.len());
        if sorted == faces {
            return Ok(());
        }
        Err(invalid_input(format!(
            "the evidence is sorted for {sorted} faces, there are {faces}"
        )))
    }
}

fn view<'a>(
    evidence: &'a Evidence,
    gray: &'a PyReadonlyArrayDyn<'_, u8>,
    camera: &'a Camera,
) -> PyResult<core::View<'a>> {
    let gray: GrayImage<'a> = gray_image(gray, "gray")?;
    let camera = &camera.core;
    if (gray.width(), gray.height()) != (camera.width, camera.height) {
        return Err(from_input_error(InputError::ImageSize {
            width: camera.width,
            height: camera.height,
            pixels: gray.pixels().len(),
        }));
    }
    Ok(core::View {
        evidence: &evidence.core,
        gray,
        camera,
    })
}
