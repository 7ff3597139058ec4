//! Which few of many descriptors serve best.

use numpy::{PyArray1, PyReadonlyArray1};
use planegrasp_core::coverage as core;
use pyo3::prelude::*;

use crate::errors::{from_input_error, invalid_input};

/// Descriptors in the order of their use for the features that they serve, the most useful first.
#[pyfunction]
pub fn by_usefulness<'py>(
    py: Python<'py>,
    descriptors: usize,
    descriptor: PyReadonlyArray1<'_, u32>,
    feature: PyReadonlyArray1<'_, u32>,
    view: PyReadonlyArray1<'_, u32>,
) -> PyResult<Bound<'py, PyArray1<u32>>> {
    let (descriptor, feature) = (descriptor.as_array(), feature.as_array());
    if descriptor.len() != feature.len() {
        return Err(invalid_input(format!(
            "descriptor and feature must pair up, got {} and {}",
            descriptor.len(),
            feature.len()
        )));
    }
    let serves: Vec<(u32, u32)> = descriptor
        .iter()
        .copied()
        .zip(feature.iter().copied())
        .collect();
    let view: Vec<u32> = view.as_array().to_vec();
    py.detach(|| core::by_usefulness(descriptors, &serves, &view))
        .map(|order| PyArray1::from_vec(py, order))
        .map_err(from_input_error)
}
