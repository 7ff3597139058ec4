//! The baseline estimator.

use numpy::PyReadonlyArrayDyn;
use planegrasp_core::three_point as core;
use pyo3::prelude::*;

use crate::arrays::depth_image;
use crate::camera::Camera;
use crate::errors::from_pose_error;
use crate::estimate::Estimate;
use crate::face::{Face, cores};

/// Pose of the first face from three depth look-ups.
#[pyfunction]
pub fn three_point(
    py: Python<'_>,
    faces: Vec<PyRef<'_, Face>>,
    camera: PyRef<'_, Camera>,
    depth: Option<PyReadonlyArrayDyn<'_, f32>>,
) -> PyResult<Estimate> {
    let (faces, camera) = (cores(&faces), &camera.core);
    let depth = depth
        .as_ref()
        .map(|array| depth_image(array, camera))
        .transpose()?;
    py.detach(|| core::estimate(&faces, camera, depth.as_ref()))
        .map(|core| Estimate { core })
        .map_err(from_pose_error)
}
