//! SURF features.

use std::sync::{Mutex, PoisonError};

use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArrayDyn};
use planegrasp_core::surf::{self as core, SurfConfig};
use pyo3::prelude::*;

use crate::arrays::{count, gray_image};
use crate::errors::{from_input_error, invalid_input};

/// Points N×2, scales, angles and responses N, descriptors N×D.
type Features<'py> = (
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray2<u8>>,
);

/// SURF with its working memory; images of several threads wait for each other.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct Surf {
    extractor: Mutex<core::Surf>,
    length: usize,
}

#[pymethods]
impl Surf {
    #[new]
    #[pyo3(signature = (*, hessian_threshold, octaves, octave_layers, extended, upright, max_features))]
    fn new(
        hessian_threshold: f32,
        octaves: i64,
        octave_layers: i64,
        extended: bool,
        upright: bool,
        max_features: i64,
    ) -> PyResult<Self> {
        let config = SurfConfig {
            hessian_threshold,
            octaves: count("octaves", octaves)?,
            octave_layers: count("octave_layers", octave_layers)?,
            extended,
            upright,
            max_features: count("max_features", max_features)?,
        };
        Ok(Self {
            extractor: Mutex::new(core::Surf::new(config).map_err(from_input_error)?),
            length: config.descriptor_length(),
        })
    }

    /// Features of an H×W image.
    fn extract<'py>(
        &self,
        py: Python<'py>,
        image: PyReadonlyArrayDyn<'_, u8>,
    ) -> PyResult<Features<'py>> {
        let image = gray_image(&image, "the image")?;
        let features = py.detach(|| {
            let mut extractor = self
                .extractor
                .lock()
                .unwrap_or_else(PoisonError::into_inner);
            extractor.extract(image).clone()
        });
        let keypoints = &features.keypoints;
        let column = |value: fn(&planegrasp_core::Keypoint) -> f32| {
            let values: Vec<f32> = keypoints.iter().map(value).collect();
            values.into_pyarray(py)
        };
        let points = keypoints.iter().flat_map(|k| [k.x, k.y]).collect();
        let points = Array2::from_shape_vec((keypoints.len(), 2), points).map_err(invalid_input)?;
        let shape = (keypoints.len(), self.length);
        let (scales, angles) = (column(|k| k.scale), column(|k| k.angle));
        let responses = column(|k| k.response);
        let descriptors =
            Array2::from_shape_vec(shape, features.descriptors).map_err(invalid_input)?;
        Ok((
            points.into_pyarray(py),
            scales,
            angles,
            responses,
            descriptors.into_pyarray(py),
        ))
    }
}
