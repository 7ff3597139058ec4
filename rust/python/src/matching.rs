//! The index of reference descriptors.

use std::borrow::Cow;

use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use numpy::{PyReadonlyArray1, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use planegrasp_core::matching::{self as core, Metric, NONE, Queries, QueryKeypoint};
use pyo3::prelude::*;

use crate::arrays::values;
use crate::errors::{from_input_error, invalid_input};

type Found<'py> = (
    Bound<'py, PyArray2<i32>>,
    Bound<'py, PyArray2<i32>>,
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray1<f32>>,
);

/// One index over the descriptors of all faces; grows and shrinks by a face at a time.
#[pyclass(module = "planegrasp._core")]
pub struct ReferenceIndex {
    index: core::ReferenceIndex,
    length: usize,
}

#[pymethods]
impl ReferenceIndex {
    /// An empty index of descriptors of `length` bytes.
    #[new]
    #[pyo3(signature = (length, *, is_binary, farthest = f32::INFINITY))]
    fn new(length: usize, is_binary: bool, farthest: f32) -> PyResult<Self> {
        if length == 0 {
            return Err(invalid_input("descriptors have at least 1 byte, got 0"));
        }
        let metric = match is_binary {
            true => Metric::Hamming,
            false => Metric::Euclidean,
        };
        let index = core::ReferenceIndex::new(metric, length)
            .with_farthest(farthest)
            .map_err(from_input_error)?;
        Ok(Self { index, length })
    }

    /// Number of faces that were added, those that were removed too.
    fn __len__(&self) -> usize {
        self.index.faces().len()
    }

    /// Bytes that it occupies.
    #[getter]
    fn nbytes(&self) -> usize {
        self.index.bytes()
    }

    /// Adds a face and returns its number.
    #[pyo3(signature = (points, frames, descriptors, radius, signs = None))]
    #[allow(clippy::too_many_arguments)] // one array each
    fn add(
        &mut self,
        py: Python<'_>,
        points: PyReadonlyArrayDyn<'_, f32>,
        frames: PyReadonlyArrayDyn<'_, f32>,
        descriptors: PyReadonlyArrayDyn<'_, u8>,
        radius: f32,
        signs: Option<PyReadonlyArray1<'_, i8>>,
    ) -> PyResult<usize> {
        let points = rows(&points, &[2], "points")?;
        let frames = rows(&frames, &[2, 2], "frames")?;
        let descriptors = self.descriptors(&descriptors)?.into_owned();
        let signs = signs.map(|signs| signs.as_array().to_vec());
        py.detach(|| {
            let mut set =
                core::ReferenceSet::new(points, frames, descriptors, self.length, radius)?;
            if let Some(signs) = signs {
                set = set.with_signs(&signs)?;
            }
            self.index.add(set)
        })
        .map_err(from_input_error)
    }

    /// Removes a face; the others keep their numbers.
    fn remove(&mut self, py: Python<'_>, face: usize) -> PyResult<()> {
        py.detach(|| self.index.remove(face))
            .map_err(from_input_error)
    }

    /// Faces that are worth looking at for these descriptors: all where these are few, perhaps none
    /// of many.
    #[pyo3(signature = (descriptors, points, scales, angles, *, among = None))]
    #[allow(clippy::too_many_arguments)] // one array each
    fn propose<'py>(
        &self,
        py: Python<'py>,
        descriptors: PyReadonlyArrayDyn<'_, u8>,
        points: PyReadonlyArrayDyn<'_, f32>,
        scales: PyReadonlyArrayDyn<'_, f32>,
        angles: PyReadonlyArrayDyn<'_, f32>,
        among: Option<PyReadonlyArray1<'_, u32>>,
    ) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let queries = self.descriptors(&descriptors)?;
        let keypoints = keypoints(&points, &scales, &angles)?;
        let among = among.map(|among| among.as_array().to_vec());
        py.detach(|| self.index.propose(&queries, &keypoints, among.as_deref()))
            .map(|faces| PyArray1::from_vec(py, faces))
            .map_err(from_input_error)
    }

    /// The k nearest references of each descriptor: face, reference, distance, and the ratio.
    #[pyo3(signature = (descriptors, k, *, among, first = None, signs = None))]
    #[allow(clippy::too_many_arguments)] // one array each
    fn candidates<'py>(
        &self,
        py: Python<'py>,
        descriptors: PyReadonlyArrayDyn<'_, u8>,
        k: usize,
        among: PyReadonlyArray1<'_, u32>,
        first: Option<PyReadonlyArray1<'_, u32>>,
        signs: Option<PyReadonlyArray1<'_, i8>>,
    ) -> PyResult<Found<'py>> {
        let descriptors = self.descriptors(&descriptors)?;
        let count = descriptors.len() / self.length;
        let signs = signs.map(|signs| signs.as_array().to_vec());
        let queries = Queries {
            descriptors: &descriptors,
            signs: signs.as_deref(),
        };
        let among = scope(&among, first.as_ref())?;
        let mut found = core::Candidates::default();
        py.detach(|| self.index.candidates_into(queries, k, &among, &mut found))
            .map_err(from_input_error)?;
        let shape = [count, k];
        Ok((
            numbers(found.face).into_pyarray(py).reshape(shape)?,
            numbers(found.reference).into_pyarray(py).reshape(shape)?,
            found.distance.into_pyarray(py).reshape(shape)?,
            found.ratio.into_pyarray(py),
        ))
    }
}

impl ReferenceIndex {
    /// The descriptors row by row, copied only where they do not lie so.
    fn descriptors<'a>(&self, array: &'a PyReadonlyArrayDyn<'_, u8>) -> PyResult<Cow<'a, [u8]>> {
        match array.shape() {
            [_, length] if *length == self.length => Ok(values(array)),
            shape => Err(invalid_input(format!(
                "descriptors must be N×{}, got shape {shape:?}",
                self.length
            ))),
        }
    }
}

/// N×2 points, N scales and N angles as keypoints.
fn keypoints(
    points: &PyReadonlyArrayDyn<'_, f32>,
    scales: &PyReadonlyArrayDyn<'_, f32>,
    angles: &PyReadonlyArrayDyn<'_, f32>,
) -> PyResult<Vec<QueryKeypoint>> {
    let points = rows(points, &[2], "points")?;
    let scales = rows(scales, &[], "scales")?;
    let angles = rows(angles, &[], "angles")?;
    if [scales.len(), angles.len()] != [points.len(); 2] {
        return Err(invalid_input(format!(
            "each point needs a scale and an angle, got {} points, {} scales and {} angles",
            points.len(),
            scales.len(),
            angles.len()
        )));
    }
    let shapes = scales.into_iter().zip(angles);
    let keypoints = points.into_iter().zip(shapes);
    Ok(keypoints
        .map(|(point, ([scale], [angle]))| QueryKeypoint {
            point,
            scale,
            angle,
        })
        .collect())
}

/// Each face once, ascending, and how many of its descriptors to look at: all without `first`.
fn scope(
    among: &PyReadonlyArray1<'_, u32>,
    first: Option<&PyReadonlyArray1<'_, u32>>,
) -> PyResult<Vec<(u32, usize)>> {
    let faces = among.as_array();
    let mut scope: Vec<(u32, usize)> = match first {
        None => faces.iter().map(|&face| (face, usize::MAX)).collect(),
        Some(first) if first.len() == faces.len() => {
            let first = first.as_array();
            let pairs = faces.iter().zip(&first);
            pairs
                .map(|(&face, &first)| (face, first as usize))
                .collect()
        }
        Some(first) => {
            return Err(invalid_input(format!(
                "first must say a number for each of the {} faces, got {}",
                faces.len(),
                first.len()
            )));
        }
    };
    scope.sort_unstable();
    scope.dedup_by_key(|one| one.0);
    Ok(scope)
}

/// An array of N rows of a certain shape, of `LENGTH` values each.
fn rows<const LENGTH: usize>(
    array: &PyReadonlyArrayDyn<'_, f32>,
    row: &[usize],
    name: &str,
) -> PyResult<Vec<[f32; LENGTH]>> {
    match array.shape() {
        [_, rest @ ..] if rest == row => {}
        shape => {
            return Err(invalid_input(format!(
                "{name} must be N rows of shape {row:?}, got shape {shape:?}"
            )));
        }
    }
    Ok(values(array).as_chunks().0.to_vec())
}

/// Numbers of faces or references, -1 for none.
fn numbers(values: Vec<u32>) -> Vec<i32> {
    let number = |value| match value {
        NONE => -1,
        value => value as i32,
    };
    values.into_iter().map(number).collect()
}
