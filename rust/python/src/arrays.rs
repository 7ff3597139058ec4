//! NumPy arrays to and from the core's types, with their shapes checked.

use std::borrow::Cow;

use nalgebra::{Isometry3, Matrix3, Matrix4, SMatrix, Vector2};
use numpy::ndarray::Array2;
use numpy::{Element, PyArray2, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use planegrasp_core::{Camera, DepthImage, GrayImage, rigid};
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

/// An N×N array.
pub fn matrix<const N: usize>(
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
    let values = row_by_row(array, "depth")?;
    DepthImage::new(size, values, camera).map_err(from_input_error)
}

/// An H×W array as a grey image. It must be contiguous, as no copy is made.
pub fn gray_image<'a>(
    array: &'a PyReadonlyArrayDyn<'_, u8>,
    name: &str,
) -> PyResult<GrayImage<'a>> {
    let (width, height) = match array.shape() {
        [height, width] => (*width, *height),
        shape => {
            return Err(invalid_input(format!(
                "{name} must be H×W, got shape {shape:?}"
            )));
        }
    };
    let pixels = row_by_row(array, name)?;
    GrayImage::new(width, height, pixels).map_err(from_input_error)
}

/// The values of an array in C order, copied only where they do not lie so.
pub fn values<'a, T: Element + Copy>(array: &'a PyReadonlyArrayDyn<'_, T>) -> Cow<'a, [T]> {
    match array.as_slice() {
        Ok(values) if array.is_c_contiguous() => Cow::Borrowed(values),
        _ => Cow::Owned(array.as_array().iter().copied().collect()),
    }
}

/// The values of an array in C order, which it must have: `as_slice` alone takes either order.
fn row_by_row<'a, T: Element>(
    array: &'a PyReadonlyArrayDyn<'_, T>,
    name: &str,
) -> PyResult<&'a [T]> {
    if !array.is_c_contiguous() {
        return Err(invalid_input(format!("{name} must be C-contiguous")));
    }
    Ok(array.as_slice()?)
}

/// An array of N rows of M numbers, whatever its shape beyond the first axis.
pub fn rows<const M: usize>(
    array: &PyReadonlyArrayDyn<'_, f32>,
    name: &str,
) -> PyResult<Vec<[f32; M]>> {
    let shape = array.shape();
    if shape.is_empty() || shape[1..].iter().product::<usize>() != M {
        return Err(invalid_input(format!(
            "{name} must have {M} numbers a row, got shape {shape:?}"
        )));
    }
    Ok(values(array).as_chunks::<M>().0.to_vec())
}

/// Points as an N×2 array.
pub fn points_to_numpy(
    py: Python<'_>,
    points: impl Iterator<Item = Vector2<f64>>,
) -> Bound<'_, PyArray2<f64>> {
    let points: Vec<Vector2<f64>> = points.collect();
    let array = Array2::from_shape_fn((points.len(), 2), |(i, axis)| points[i][axis]);
    PyArray2::from_owned_array(py, array)
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
