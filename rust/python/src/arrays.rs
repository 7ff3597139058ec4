//! NumPy arrays to and from the core's types, with their shapes checked.

use nalgebra::{Isometry3, Matrix3, Matrix4, SMatrix, Vector2};
use numpy::{PyArray2, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use planegrasp_core::{Camera, DepthImage, rigid};
use pyo3::prelude::*;

use crate::errors::{from_input_error, invalid_input};

/// An N×2 array as points; `name` is said in the error.
pub fn points(array: &PyReadonlyArrayDyn<'_, f64>, name: &str) -> PyResult<Vec<Vector2<f64>>> {
    match array.shape() {
        [_, 2] => {}
        shape => {
            return Err(invalid_input(format!(
                "{name} must be N×2, got shape {shape:?}"
            )));
        }
    }
    let view = array.as_array();
    Ok(view
        .rows()
        .into_iter()
        .map(|row| Vector2::new(row[0], row[1]))
        .collect())
}

/// A 3×3 array.
pub fn matrix3(array: &PyReadonlyArrayDyn<'_, f64>, name: &str) -> PyResult<Matrix3<f64>> {
    matrix::<3>(array, name)
}

/// A 4×4 array as a rigid transform.
pub fn isometry(
    array: &PyReadonlyArrayDyn<'_, f64>,
    name: &'static str,
) -> PyResult<Isometry3<f64>> {
    let matrix: Matrix4<f64> = matrix::<4>(array, name)?;
    rigid::from_matrix(&matrix, name).map_err(from_input_error)
}

fn matrix<const N: usize>(
    array: &PyReadonlyArrayDyn<'_, f64>,
    name: &str,
) -> PyResult<SMatrix<f64, N, N>> {
    if array.shape() != [N, N] {
        let shape = array.shape();
        return Err(invalid_input(format!(
            "{name} must be {N}×{N}, got shape {shape:?}"
        )));
    }
    let view = array.as_array();
    Ok(SMatrix::from_row_iterator(view.iter().copied()))
}

/// An H×W array as depth [m] for a camera. It must be contiguous, as no copy is made.
pub fn depth_image<'a>(
    array: &'a PyReadonlyArrayDyn<'_, f32>,
    camera: &Camera,
) -> PyResult<DepthImage<'a>> {
    let size = match array.shape() {
        [height, width] => (*width, *height),
        shape => {
            return Err(invalid_input(format!(
                "depth must be H×W, got shape {shape:?}"
            )));
        }
    };
    let values = array
        .as_slice()
        .map_err(|_| invalid_input("depth must be C-contiguous"))?;
    DepthImage::new(size, values, camera).map_err(from_input_error)
}

/// A fixed-size matrix as a NumPy array.
pub fn to_numpy<'py, const N: usize>(
    py: Python<'py>,
    matrix: &SMatrix<f64, N, N>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let rows: Vec<Vec<f64>> = matrix
        .row_iter()
        .map(|row| row.iter().copied().collect())
        .collect();
    Ok(PyArray2::from_vec2(py, &rows)?)
}

/// A setting that counts something.
pub fn count(name: &str, value: i64) -> PyResult<usize> {
    usize::try_from(value).map_err(|_| invalid_input(format!("{name} must be ≥ 0, got {value}")))
}
