//! The estimator without depth.

use numpy::PyArray2;
use planegrasp_core::ippe;
use planegrasp_core::pnp::{self as core, PnPConfig};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::to_numpy;
use crate::camera::Camera;
use crate::errors::{from_input_error, from_pose_error};
use crate::estimate::Estimate;
use crate::face::{Face, cores};

/// Checked settings of `pnp`; see `planegrasp.pose.PnPConfig`.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct PnPSettings {
    pub core: PnPConfig,
}

#[pymethods]
impl PnPSettings {
    #[new]
    #[pyo3(signature = (*, pixel_sigma, pixel_sigma_floor, size_sigma, ambiguity_odds))]
    fn new(
        pixel_sigma: Option<f64>,
        pixel_sigma_floor: f64,
        size_sigma: f64,
        ambiguity_odds: f64,
    ) -> PyResult<Self> {
        let core = PnPConfig {
            pixel_sigma,
            pixel_sigma_floor,
            size_sigma,
            ambiguity_odds,
        };
        core.check().map_err(from_input_error)?;
        Ok(Self { core })
    }

    /// The core's default settings by name.
    #[staticmethod]
    fn defaults(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let dict = PyDict::new(py);
        insert_settings(&dict, &PnPConfig::default())?;
        Ok(dict)
    }
}

pub fn insert_settings(dict: &Bound<'_, PyDict>, config: &PnPConfig) -> PyResult<()> {
    dict.set_item("pixel_sigma", config.pixel_sigma)?;
    dict.set_item("pixel_sigma_floor", config.pixel_sigma_floor)?;
    dict.set_item("size_sigma", config.size_sigma)?;
    dict.set_item("ambiguity_odds", config.ambiguity_odds)
}

/// Pose from the correspondences of all faces.
#[pyfunction]
pub fn pnp(
    py: Python<'_>,
    faces: Vec<PyRef<'_, Face>>,
    camera: PyRef<'_, Camera>,
    settings: PyRef<'_, PnPSettings>,
) -> PyResult<Estimate> {
    let (faces, camera, config) = (cores(&faces), &camera.core, &settings.core);
    py.detach(|| core::estimate(&faces, camera, config))
        .map(|core| Estimate { core })
        .map_err(from_pose_error)
}

/// Both planar solutions T_camera_face of one face before refinement, the better one first.
#[pyfunction]
pub fn planar_poses<'py>(
    py: Python<'py>,
    face: PyRef<'_, Face>,
    camera: PyRef<'_, Camera>,
) -> PyResult<Vec<Bound<'py, PyArray2<f64>>>> {
    let poses = ippe::planar_poses(&face.core, &camera.core).map_err(from_pose_error)?;
    poses
        .iter()
        .map(|T| to_numpy(py, &T.to_homogeneous()))
        .collect()
}
