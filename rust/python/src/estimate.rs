//! A pose with its quality.

use numpy::PyArray2;
use planegrasp_core::PoseEstimate;
use pyo3::prelude::*;

use crate::arrays::to_numpy;

/// What an estimator found; see `planegrasp.pose.PoseEstimate`.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct Estimate {
    pub core: PoseEstimate,
}

#[pymethods]
impl Estimate {
    #[getter]
    fn T_camera_object<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        to_numpy(py, &self.core.T_camera_object.to_homogeneous())
    }

    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        self.core
            .covariance
            .as_ref()
            .map(|covariance| to_numpy(py, covariance))
            .transpose()
    }

    #[getter]
    fn noise_covariance<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        self.core
            .noise_covariance
            .as_ref()
            .map(|covariance| to_numpy(py, covariance))
            .transpose()
    }

    #[getter]
    fn ambiguous(&self) -> bool {
        self.core.ambiguous
    }

    #[getter]
    fn alternative<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        self.core
            .alternative
            .map(|T| to_numpy(py, &T.to_homogeneous()))
            .transpose()
    }

    #[getter]
    fn reprojection_rms(&self) -> f64 {
        self.core.reprojection_rms
    }

    #[getter]
    fn depth_pixels(&self) -> usize {
        self.core.depth_pixels
    }
}
