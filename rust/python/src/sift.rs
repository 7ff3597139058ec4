//! SIFT.

use std::sync::{Mutex, PoisonError};

use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArrayDyn};
use planegrasp_core::sift::{LENGTH, Sift as Core, SiftConfig, SiftFeatures};
use planegrasp_core::{GrayImage, InputError, Keypoint};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{count, gray_image};
use crate::errors::{from_input_error, invalid_input};

type Arrays<'py> = (
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray2<u8>>,
    Bound<'py, PyArray1<i8>>,
);

/// More are no processor's, and starting them would take minutes.
const MOST_THREADS: usize = 1024;

/// Finds and describes keypoints; see `planegrasp.features.SIFT`.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct Sift {
    // The extractor's memory serves one image at a time.
    core: Mutex<Core>,
    pool: Option<rayon::ThreadPool>,
}

#[pymethods]
impl Sift {
    #[new]
    #[pyo3(signature = (
        *, max_features, octave_layers, contrast_threshold, edge_threshold, sigma,
        double_first_octave, threads
    ))]
    fn new(
        max_features: i64,
        octave_layers: i64,
        contrast_threshold: f64,
        edge_threshold: f64,
        sigma: f64,
        double_first_octave: bool,
        threads: i64,
    ) -> PyResult<Self> {
        let threads = count("threads", threads)?;
        if threads > MOST_THREADS {
            return Err(invalid_input(format!(
                "threads must be 0 to {MOST_THREADS}, got {threads}"
            )));
        }
        let core = Core::new(SiftConfig {
            max_features: count("max_features", max_features)?,
            octave_layers: count("octave_layers", octave_layers)?,
            contrast_threshold,
            edge_threshold,
            sigma,
            double_first_octave,
        })
        .map_err(from_input_error)?;
        let pool = (threads > 0)
            .then(|| rayon::ThreadPoolBuilder::new().num_threads(threads).build())
            .transpose()
            .map_err(|error| invalid_input(format!("{threads} threads: {error}")))?;
        Ok(Self {
            core: Mutex::new(core),
            pool,
        })
    }

    /// The core's default settings by name.
    #[staticmethod]
    fn defaults(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let config = SiftConfig::default();
        let dict = PyDict::new(py);
        dict.set_item("max_features", config.max_features)?;
        dict.set_item("octave_layers", config.octave_layers)?;
        dict.set_item("contrast_threshold", config.contrast_threshold)?;
        dict.set_item("edge_threshold", config.edge_threshold)?;
        dict.set_item("sigma", config.sigma)?;
        dict.set_item("double_first_octave", config.double_first_octave)?;
        Ok(dict)
    }

    /// Points, scales, angles, responses, descriptors and signs of an image.
    fn extract<'py>(
        &self,
        py: Python<'py>,
        image: PyReadonlyArrayDyn<'_, u8>,
    ) -> PyResult<Arrays<'py>> {
        let image = gray_image(&image, "image")?;
        let columns = py
            .detach(|| self.columns(image))
            .map_err(from_input_error)?;
        let [points, scales, angles, responses] = columns.numbers;
        Ok((
            points.into_pyarray(py).reshape((scales.len(), 2))?,
            scales.into_pyarray(py),
            angles.into_pyarray(py),
            responses.into_pyarray(py),
            columns
                .descriptors
                .into_pyarray(py)
                .reshape((columns.count, LENGTH))?,
            columns.signs.into_pyarray(py),
        ))
    }
}

impl Sift {
    fn columns(&self, image: GrayImage) -> Result<Columns, InputError> {
        // A panic would have left no more than the results of another image behind.
        let mut core = self.core.lock().unwrap_or_else(PoisonError::into_inner);
        let core: &mut Core = &mut core;
        let mut extract = move || core.extract(image).map(Columns::new);
        match &self.pool {
            Some(pool) => pool.install(extract),
            None => rayon::scope(|_| extract()),
        }
    }
}

/// Features by column.
struct Columns {
    count: usize,
    numbers: [Vec<f32>; 4],
    descriptors: Vec<u8>,
    signs: Vec<i8>,
}

impl Columns {
    fn new(features: &SiftFeatures) -> Self {
        let column = |value: fn(&Keypoint) -> f32| features.keypoints.iter().map(value).collect();
        Self {
            count: features.keypoints.len(),
            numbers: [
                features.keypoints.iter().flat_map(|k| [k.x, k.y]).collect(),
                column(|k| k.scale),
                column(|k| k.angle),
                column(|k| k.response),
            ],
            descriptors: features.descriptors.as_flattened().to_vec(),
            signs: features.keypoints.iter().map(|k| k.sign).collect(),
        }
    }
}
