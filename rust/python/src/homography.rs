//! Robust homographies.

use nalgebra::Matrix3;
use numpy::{PyArray2, PyReadonlyArrayDyn};
use planegrasp_core::homography::{self as core, PointMatch, RansacConfig};
use pyo3::prelude::*;

use crate::arrays::{matrix3, points, to_numpy};
use crate::errors::{from_input_error, invalid_input};

/// Homography (3×3) that most matches agree with and how many do; None where there is none.
#[pyfunction]
#[pyo3(signature = (source, target, *, threshold, max_iterations, seed = 0))]
pub fn estimate_homography<'py>(
    py: Python<'py>,
    source: PyReadonlyArrayDyn<'_, f64>,
    target: PyReadonlyArrayDyn<'_, f64>,
    threshold: f64,
    max_iterations: usize,
    seed: u64,
) -> PyResult<Option<(Bound<'py, PyArray2<f64>>, usize)>> {
    let matches = matches(&source, &target)?;
    let config = RansacConfig {
        threshold,
        max_iterations,
        seed,
        ..RansacConfig::default()
    };
    let found = py
        .detach(|| core::estimate(&matches, &config, |_| true))
        .map_err(from_input_error)?;
    found
        .map(|found| Ok((to_numpy(py, &found.matrix)?, found.inliers)))
        .transpose()
}

/// A homography refined on all matches under Cauchy's loss; None where they determine none.
#[pyfunction]
pub fn refine_homography<'py>(
    py: Python<'py>,
    source: PyReadonlyArrayDyn<'_, f64>,
    target: PyReadonlyArrayDyn<'_, f64>,
    start: PyReadonlyArrayDyn<'_, f64>,
    scale: f64,
) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
    let matches = matches(&source, &target)?;
    let start: Matrix3<f64> = matrix3(&start, "start")?;
    if !(scale > 0.0 && scale.is_finite()) {
        return Err(invalid_input(format!(
            "scale must be > 0 and finite, got {scale}"
        )));
    }
    py.detach(|| core::refine(&matches, &start, scale, None))
        .map(|refined| to_numpy(py, &refined))
        .transpose()
}

fn matches(
    source: &PyReadonlyArrayDyn<'_, f64>,
    target: &PyReadonlyArrayDyn<'_, f64>,
) -> PyResult<Vec<PointMatch>> {
    let (source, target) = (points(source, "source")?, points(target, "target")?);
    if source.len() != target.len() {
        return Err(invalid_input(format!(
            "source and target must pair up, got {} and {} points",
            source.len(),
            target.len()
        )));
    }
    Ok(source
        .into_iter()
        .zip(target)
        .map(|(source, target)| PointMatch { source, target })
        .collect())
}
