//! Poses and velocities filtered over time.

use nalgebra::{Matrix6, Vector3};
use numpy::{PyArray1, PyArray2, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use planegrasp_core::pose_filter::modes::{self, ModesConfig};
use planegrasp_core::pose_filter::{self as core, Measurement, PoseFilterConfig};
use pyo3::prelude::*;

use crate::arrays::{isometry, matrix, to_numpy, values};
use crate::errors::{from_input_error, invalid_input};

/// Checked settings; see `planegrasp.pose_filter.PoseFilterConfig`.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct PoseFilterSettings {
    core: PoseFilterConfig,
}

#[pymethods]
impl PoseFilterSettings {
    #[new]
    #[pyo3(signature = (
        *, linear_acceleration, angular_acceleration, linear_speed, angular_speed, tremor,
        angular_tremor, gate
    ))]
    fn new(
        linear_acceleration: f64,
        angular_acceleration: f64,
        linear_speed: f64,
        angular_speed: f64,
        tremor: f64,
        angular_tremor: f64,
        gate: f64,
    ) -> PyResult<Self> {
        let core = PoseFilterConfig {
            linear_acceleration,
            angular_acceleration,
            linear_speed,
            angular_speed,
            tremor,
            angular_tremor,
            gate,
        };
        core.check().map_err(from_input_error)?;
        Ok(Self { core })
    }
}

/// Checked settings; see `planegrasp.tracking.MotionFilterConfig`.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct MotionSettings {
    core: ModesConfig,
}

#[pymethods]
impl MotionSettings {
    #[new]
    #[pyo3(signature = (*, moving, creep, angular_creep, still_for, moving_for))]
    fn new(
        moving: PyRef<'_, PoseFilterSettings>,
        creep: f64,
        angular_creep: f64,
        still_for: f64,
        moving_for: f64,
    ) -> PyResult<Self> {
        let core = ModesConfig {
            moving: moving.core,
            creep,
            angular_creep,
            still_for,
            moving_for,
        };
        core.check().map_err(from_input_error)?;
        Ok(Self { core })
    }
}

/// Pose and velocity at one time; see `planegrasp.pose_filter.FilteredPose`.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct FilteredPose {
    core: core::FilteredPose,
}

#[pymethods]
impl FilteredPose {
    #[new]
    fn new(
        time: f64,
        T_base_object: PyReadonlyArrayDyn<'_, f64>,
        linear_velocity: PyReadonlyArrayDyn<'_, f64>,
        angular_velocity: PyReadonlyArrayDyn<'_, f64>,
        covariance: PyReadonlyArrayDyn<'_, f64>,
    ) -> PyResult<Self> {
        let core = core::FilteredPose {
            time,
            T_base_object: isometry(&T_base_object, "T_base_object")?,
            linear_velocity: vector(&linear_velocity, "linear_velocity")?,
            angular_velocity: vector(&angular_velocity, "angular_velocity")?,
            covariance: matrix(&covariance, "covariance")?,
        };
        Ok(Self { core })
    }

    /// Starts from one measurement.
    #[staticmethod]
    fn first(
        time: f64,
        T_base_object: PyReadonlyArrayDyn<'_, f64>,
        covariance: PyReadonlyArrayDyn<'_, f64>,
        settings: PyRef<'_, PoseFilterSettings>,
    ) -> PyResult<Self> {
        let measured = measurement(&T_base_object, &covariance)?;
        let core = core::FilteredPose::first(time, &measured, &settings.core);
        Ok(Self { core })
    }

    fn predicted(&self, time: f64, settings: PyRef<'_, PoseFilterSettings>) -> PyResult<Self> {
        self.core.check_time(time).map_err(from_input_error)?;
        let core = self.core.predicted(time, &settings.core);
        Ok(Self { core })
    }

    /// None where the gate refuses the measurement.
    fn corrected(
        &self,
        T_base_object: PyReadonlyArrayDyn<'_, f64>,
        covariance: PyReadonlyArrayDyn<'_, f64>,
        settings: PyRef<'_, PoseFilterSettings>,
    ) -> PyResult<Option<Self>> {
        let measured = measurement(&T_base_object, &covariance)?;
        let corrected = self.core.corrected(&measured, &settings.core);
        Ok(corrected.map(|core| Self { core }))
    }

    #[getter]
    fn time(&self) -> f64 {
        self.core.time
    }

    #[getter]
    fn T_base_object<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        to_numpy(py, &self.core.T_base_object.to_homogeneous())
    }

    #[getter]
    fn linear_velocity<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.core.linear_velocity.as_slice())
    }

    #[getter]
    fn angular_velocity<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.core.angular_velocity.as_slice())
    }

    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        to_numpy(py, &self.core.covariance)
    }
}

/// Something that stands still or moves, at one time.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct MotionState {
    core: modes::MotionState,
}

#[pymethods]
impl MotionState {
    /// Starts from one measurement.
    #[staticmethod]
    fn first(
        time: f64,
        T_base_object: PyReadonlyArrayDyn<'_, f64>,
        covariance: PyReadonlyArrayDyn<'_, f64>,
        settings: PyRef<'_, MotionSettings>,
    ) -> PyResult<Self> {
        let measured = measurement(&T_base_object, &covariance)?;
        let core = modes::MotionState::first(time, &measured, &settings.core);
        Ok(Self { core })
    }

    fn predicted(&self, time: f64, settings: PyRef<'_, MotionSettings>) -> PyResult<Self> {
        self.core
            .moving
            .check_time(time)
            .map_err(from_input_error)?;
        let core = self.core.predicted(time, &settings.core);
        Ok(Self { core })
    }

    /// None where neither hypothesis explains the measurement.
    fn measured(
        &self,
        time: f64,
        T_base_object: PyReadonlyArrayDyn<'_, f64>,
        covariance: PyReadonlyArrayDyn<'_, f64>,
        settings: PyRef<'_, MotionSettings>,
    ) -> PyResult<Option<Self>> {
        self.core
            .moving
            .check_time(time)
            .map_err(from_input_error)?;
        let measured = measurement(&T_base_object, &covariance)?;
        let state = self.core.measured(time, &measured, &settings.core);
        Ok(state.map(|core| Self { core }))
    }

    #[getter]
    fn time(&self) -> f64 {
        self.core.time()
    }

    /// Probability that it moves.
    #[getter]
    fn moves(&self) -> f64 {
        self.core.moves
    }

    /// Both hypotheses together.
    #[getter]
    fn pose(&self) -> FilteredPose {
        let core = self.core.pose();
        FilteredPose { core }
    }
}

fn measurement(
    T_base_object: &PyReadonlyArrayDyn<'_, f64>,
    covariance: &PyReadonlyArrayDyn<'_, f64>,
) -> PyResult<Measurement> {
    let finite = covariance.as_array().iter().all(|value| value.is_finite());
    if covariance.shape() != [6, 6] || !finite {
        let shape = covariance.shape();
        return Err(invalid_input(format!(
            "a pose's covariance is a finite 6×6 matrix, got shape {shape:?}"
        )));
    }
    let covariance: Matrix6<f64> = matrix(covariance, "covariance")?;
    Ok(Measurement {
        T_base_object: isometry(T_base_object, "T_base_object")?,
        covariance,
    })
}

fn vector(array: &PyReadonlyArrayDyn<'_, f64>, name: &str) -> PyResult<Vector3<f64>> {
    match values(array).as_ref() {
        [x, y, z] => Ok(Vector3::new(*x, *y, *z)),
        _ => {
            let shape = array.shape();
            Err(invalid_input(format!(
                "{name} must have 3 numbers, got shape {shape:?}"
            )))
        }
    }
}
