//! The robust plane in inverse depth.

use nalgebra::Vector3;
use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use planegrasp_core::depth_region::DepthPixel;
use planegrasp_core::plane::{self, Noise};
use planegrasp_core::plane_consensus::least_median;
use pyo3::prelude::*;

use crate::errors::invalid_input;

/// Seed of the consensus: the same pixels always give the same plane.
const SEED: u64 = 0x51;
/// The noise is estimated from the residuals, but never taken for less than this [1/m].
const SIGMA_FLOOR: f64 = 1e-6;

/// Plane (a, b, c) with 1/z = (a, b, c) · ray and the standard deviation of the residuals [1/m];
/// None where the pixels span no plane.
#[pyfunction]
pub fn fit_plane(
    py: Python<'_>,
    rays: PyReadonlyArrayDyn<'_, f64>,
    inverse_depth: PyReadonlyArrayDyn<'_, f64>,
) -> PyResult<Option<([f64; 3], f64)>> {
    let pixels = match (rays.shape(), inverse_depth.shape()) {
        ([n, 3], [m]) if n == m => rays.as_array(),
        (rays, depths) => {
            return Err(invalid_input(format!(
                "rays must be N×3 and inverse_depth N, got shapes {rays:?} and {depths:?}"
            )));
        }
    };
    let pixels: Vec<DepthPixel> = pixels
        .rows()
        .into_iter()
        .zip(inverse_depth.as_array().iter())
        .map(|(ray, &inverse_depth)| DepthPixel {
            ray: Vector3::new(ray[0], ray[1], ray[2]),
            inverse_depth,
            near_match: false,
        })
        .collect();
    Ok(py.detach(|| {
        let (start, sigma) = least_median(&pixels, SEED)?;
        let fitted = plane::fit(&pixels, start, sigma, Noise::AtLeast(SIGMA_FLOOR))?;
        Some((fitted.inverse_plane.into(), fitted.sigma))
    }))
}
