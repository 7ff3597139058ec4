//! The default estimator.

use numpy::PyReadonlyArrayDyn;
use planegrasp_core::PoseError;
use planegrasp_core::depth_plane::DepthConfig;
use planegrasp_core::fused::{self as core, FusedConfig};
use planegrasp_core::pnp::PnPConfig;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{count, depth_image};
use crate::camera::Camera;
use crate::errors::{from_input_error, from_pose_error};
use crate::estimate::Estimate;
use crate::face::{Face, cores};
use crate::pnp::insert_settings;

/// Checked settings of `fused`; see `planegrasp.pose.FusedConfig`.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct FusedSettings {
    pub core: FusedConfig,
}

#[pymethods]
impl FusedSettings {
    #[new]
    #[pyo3(signature = (
        *, pixel_sigma, pixel_sigma_floor, size_sigma, ambiguity_odds, depth_sigma, depth_sigma_floor,
        depth_bias_sigma, correlation_area, depth_gate, erosion, max_depth_pixels,
        min_depth_pixels, max_view_angle
    ))]
    #[allow(clippy::too_many_arguments)] // every one of them is a named setting
    fn new(
        pixel_sigma: Option<f64>,
        pixel_sigma_floor: f64,
        size_sigma: f64,
        ambiguity_odds: f64,
        depth_sigma: Option<f64>,
        depth_sigma_floor: f64,
        depth_bias_sigma: f64,
        correlation_area: f64,
        depth_gate: f64,
        erosion: f64,
        max_depth_pixels: i64,
        min_depth_pixels: i64,
        max_view_angle: f64,
    ) -> PyResult<Self> {
        let pnp = PnPConfig {
            pixel_sigma,
            pixel_sigma_floor,
            size_sigma,
            ambiguity_odds,
        };
        let depth = DepthConfig {
            sigma: depth_sigma,
            sigma_floor: depth_sigma_floor,
            bias_sigma: depth_bias_sigma,
            correlation_area,
            gate: depth_gate,
            erosion,
            max_pixels: count("max_depth_pixels", max_depth_pixels)?,
            min_pixels: count("min_depth_pixels", min_depth_pixels)?,
            max_view_angle,
        };
        pnp.check()
            .and_then(|()| depth.check())
            .map_err(from_input_error)?;
        Ok(Self {
            core: FusedConfig { pnp, depth },
        })
    }

    /// The core's default settings by name.
    #[staticmethod]
    fn defaults(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let FusedConfig { pnp, depth } = FusedConfig::default();
        let dict = PyDict::new(py);
        insert_settings(&dict, &pnp)?;
        dict.set_item("depth_sigma", depth.sigma)?;
        dict.set_item("depth_sigma_floor", depth.sigma_floor)?;
        dict.set_item("depth_bias_sigma", depth.bias_sigma)?;
        dict.set_item("correlation_area", depth.correlation_area)?;
        dict.set_item("depth_gate", depth.gate)?;
        dict.set_item("erosion", depth.erosion)?;
        dict.set_item("max_depth_pixels", depth.max_pixels)?;
        dict.set_item("min_depth_pixels", depth.min_pixels)?;
        dict.set_item("max_view_angle", depth.max_view_angle)?;
        Ok(dict)
    }
}

/// Pose of each object from the correspondences and the depth of all its faces: an estimate, or the
/// `PoseError` that says why there is none.
#[pyfunction]
pub fn fused<'py>(
    py: Python<'py>,
    objects: Vec<Vec<PyRef<'_, Face>>>,
    camera: PyRef<'_, Camera>,
    depth: Option<PyReadonlyArrayDyn<'_, f32>>,
    settings: PyRef<'_, FusedSettings>,
) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let objects: Vec<_> = objects.iter().map(|faces| cores(faces)).collect();
    let (camera, config) = (&camera.core, &settings.core);
    let depth = depth
        .as_ref()
        .map(|array| depth_image(array, camera))
        .transpose()?;
    let found = py.detach(|| core::estimate_each(&objects, camera, depth.as_ref(), config));
    found
        .into_iter()
        .map(|one| match one {
            Ok(core) => Ok(Bound::new(py, Estimate { core })?.into_any()),
            Err(PoseError::Input(error)) => Err(from_input_error(error)),
            Err(error) => Ok(from_pose_error(error)
                .into_value(py)
                .into_bound(py)
                .into_any()),
        })
        .collect()
}
