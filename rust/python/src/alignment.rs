//! Dense refinement of homographies.

use nalgebra::Matrix3;
use numpy::{PyArray2, PyReadonlyArrayDyn};
use planegrasp_core::alignment::{self as core, AlignmentConfig, AlignmentWorkspace};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{count, gray_image, matrix3, to_numpy};
use crate::errors::from_input_error;

/// Checked settings of `AlignmentReference.align`; see `planegrasp.alignment.AlignmentConfig`.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct AlignmentSettings {
    pub core: AlignmentConfig,
}

#[pymethods]
impl AlignmentSettings {
    #[new]
    #[pyo3(signature = (
        *, max_tiles, min_tiles, min_correlation, max_motion, start_sigma, displacement_floor,
        max_iterations, renderings
    ))]
    #[allow(clippy::too_many_arguments)] // every one of them is a named setting
    fn new(
        max_tiles: i64,
        min_tiles: i64,
        min_correlation: f64,
        max_motion: f64,
        start_sigma: f64,
        displacement_floor: f64,
        max_iterations: i64,
        renderings: i64,
    ) -> PyResult<Self> {
        let core = AlignmentConfig {
            max_tiles: count("max_tiles", max_tiles)?,
            min_tiles: count("min_tiles", min_tiles)?,
            min_correlation,
            max_motion,
            start_sigma,
            displacement_floor,
            max_iterations: count("max_iterations", max_iterations)?,
            renderings: count("renderings", renderings)?,
        };
        core.check().map_err(from_input_error)?;
        Ok(Self { core })
    }

    /// The core's default settings by name.
    #[staticmethod]
    fn defaults(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let core = AlignmentConfig::default();
        let dict = PyDict::new(py);
        dict.set_item("max_tiles", core.max_tiles)?;
        dict.set_item("min_tiles", core.min_tiles)?;
        dict.set_item("min_correlation", core.min_correlation)?;
        dict.set_item("max_motion", core.max_motion)?;
        dict.set_item("start_sigma", core.start_sigma)?;
        dict.set_item("displacement_floor", core.displacement_floor)?;
        dict.set_item("max_iterations", core.max_iterations)?;
        dict.set_item("renderings", core.renderings)?;
        Ok(dict)
    }
}

/// A reference image prepared for alignment.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct AlignmentReference {
    core: core::AlignmentReference,
}

#[pymethods]
impl AlignmentReference {
    #[new]
    fn new(py: Python<'_>, gray: PyReadonlyArrayDyn<'_, u8>) -> PyResult<Self> {
        let image = gray_image(&gray, "gray")?;
        let core = py
            .detach(|| core::AlignmentReference::new(image))
            .map_err(from_input_error)?;
        Ok(Self { core })
    }

    /// Bytes that it occupies.
    #[getter]
    fn bytes(&self) -> usize {
        self.core.bytes()
    }

    /// Refines a homography on a frame; None where there is no evidence.
    fn align(
        &self,
        py: Python<'_>,
        frame: PyReadonlyArrayDyn<'_, u8>,
        start: PyReadonlyArrayDyn<'_, f64>,
        settings: PyRef<'_, AlignmentSettings>,
    ) -> PyResult<Option<Alignment>> {
        let image = gray_image(&frame, "frame")?;
        let start: Matrix3<f64> = matrix3(&start, "start")?;
        let config = &settings.core;
        let aligned = py.detach(|| {
            let mut workspace = AlignmentWorkspace::new();
            core::align(&self.core, &image, &start, config, &mut workspace)
        });
        Ok(aligned.map(|core| Alignment { core }))
    }
}

/// Where an alignment ended.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct Alignment {
    core: core::Alignment,
}

#[pymethods]
impl Alignment {
    /// The refined homography if accepted, the start otherwise.
    #[getter]
    fn homography<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        to_numpy(py, &self.core.homography)
    }

    #[getter]
    fn score_before(&self) -> f64 {
        self.core.score_before
    }

    #[getter]
    fn score_after(&self) -> f64 {
        self.core.score_after
    }

    #[getter]
    fn accepted(&self) -> bool {
        self.core.accepted
    }

    #[getter]
    fn iterations(&self) -> usize {
        self.core.iterations
    }

    #[getter]
    fn tiles(&self) -> usize {
        self.core.tiles
    }

    #[getter]
    fn compared(&self) -> usize {
        self.core.compared
    }

    /// Information of the corners' positions.
    #[getter]
    fn information<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        to_numpy(py, &self.core.information)
    }
}
