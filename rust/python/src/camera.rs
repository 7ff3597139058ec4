//! The camera.

use pyo3::prelude::*;

use crate::errors::from_input_error;

/// Intrinsics of a camera; see `planegrasp.PinholeCamera`.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct Camera {
    pub core: planegrasp_core::Camera,
}

#[pymethods]
impl Camera {
    #[new]
    #[pyo3(signature = (width, height, fx, fy, cx, cy, distortion))]
    fn new(
        width: usize,
        height: usize,
        fx: f64,
        fy: f64,
        cx: f64,
        cy: f64,
        distortion: [f64; 5],
    ) -> PyResult<Self> {
        planegrasp_core::Camera::new((width, height), (fx, fy), (cx, cy), distortion)
            .map(|core| Self { core })
            .map_err(from_input_error)
    }
}
