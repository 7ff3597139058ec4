//! Following objects from frame to frame.

use nalgebra::Isometry3;
use numpy::{PyArray2, PyReadonlyArrayDyn};
use planegrasp_core::InputError;
use planegrasp_core::alignment::{AlignmentWorkspace, apply};
use planegrasp_core::tracking::{self as core, Sight, TrackingConfig};
use pyo3::prelude::*;

use crate::alignment::AlignmentSettings;
use crate::arrays::{count, depth_image, gray_image, isometry, matrix3, points_to_numpy, to_numpy};
use crate::camera::Camera;
use crate::errors::from_input_error;
use crate::estimate::Estimate;
use crate::fused::FusedSettings;

/// Checked settings of `Follower`; see `planegrasp.tracking.FollowConfig`.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct FollowSettings {
    core: TrackingConfig,
}

#[pymethods]
impl FollowSettings {
    #[new]
    #[pyo3(signature = (
        *, min_tiles, min_share, min_score, max_stretch, min_side, max_view_angle, alignment, pose
    ))]
    #[allow(clippy::too_many_arguments)] // every one of them is a named setting
    fn new(
        min_tiles: i64,
        min_share: f64,
        min_score: f64,
        max_stretch: f64,
        min_side: f64,
        max_view_angle: f64,
        alignment: PyRef<'_, AlignmentSettings>,
        pose: PyRef<'_, FusedSettings>,
    ) -> PyResult<Self> {
        let core = TrackingConfig {
            min_tiles: count("min_tiles", min_tiles)?,
            min_share,
            min_score,
            max_stretch,
            min_side,
            max_view_angle,
            alignment: alignment.core,
            pose: pose.core.clone(),
        };
        core.check().map_err(from_input_error)?;
        Ok(Self { core })
    }
}

/// What is kept of an object to follow it.
#[pyclass(module = "planegrasp._core")]
pub struct TrackedObject {
    core: core::TrackedObject,
}

#[pymethods]
impl TrackedObject {
    #[new]
    fn new() -> Self {
        let faces = Vec::new();
        Self {
            core: core::TrackedObject { faces },
        }
    }

    /// Adds a face, which gets the next number.
    fn add(
        &mut self,
        gray: PyReadonlyArrayDyn<'_, u8>,
        face_from_edge: PyReadonlyArrayDyn<'_, f64>,
        T_object_face: PyReadonlyArrayDyn<'_, f64>,
        width: f64,
        height: f64,
    ) -> PyResult<()> {
        let face = core::TrackedFace::new(
            gray_image(&gray, "gray")?,
            matrix3(&face_from_edge, "face_from_edge")?,
            isometry(&T_object_face, "T_object_face")?,
            (width, height),
        );
        self.core.faces.push(face.map_err(from_input_error)?);
        Ok(())
    }
}

/// A face where it is seen.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct FollowedFace {
    core: core::FollowedFace,
}

#[pymethods]
impl FollowedFace {
    /// Its number among the object's faces.
    #[getter]
    fn face(&self) -> usize {
        self.core.face
    }

    /// From edge coordinates of the reference to undistorted pixels.
    #[getter]
    fn homography<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        to_numpy(py, &self.core.homography)
    }

    /// Tiles that agree, in edge coordinates of the reference.
    #[getter]
    fn reference_points<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        points_to_numpy(py, self.core.points.iter().copied())
    }

    /// The same in undistorted pixels.
    #[getter]
    fn image_points<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let H = &self.core.homography;
        points_to_numpy(py, self.core.points.iter().map(|&point| apply(H, point)))
    }

    /// Area of the convex hull of those that agree, in the reference.
    #[getter]
    fn hull_area(&self) -> f64 {
        self.core.hull_area()
    }

    /// Tiles of the face in the image.
    #[getter]
    fn compared(&self) -> usize {
        self.core.compared
    }

    /// Mean correlation of the tiles that agree.
    #[getter]
    fn score(&self) -> f64 {
        self.core.score
    }
}

/// An object where it is seen.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct Followed {
    core: core::Followed,
}

#[pymethods]
impl Followed {
    #[getter]
    fn estimate(&self) -> Estimate {
        let core = self.core.estimate.clone();
        Estimate { core }
    }

    #[getter]
    fn faces(&self) -> Vec<FollowedFace> {
        let faces = self.core.faces.iter().cloned();
        faces.map(|core| FollowedFace { core }).collect()
    }
}

/// Follows objects from frame to frame.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct Follower {
    config: TrackingConfig,
}

#[pymethods]
impl Follower {
    #[new]
    fn new(settings: PyRef<'_, FollowSettings>) -> Self {
        Self {
            config: settings.core.clone(),
        }
    }

    /// Follows objects from their predicted poses T_camera_object (4×4) into a frame.
    ///
    /// For each of them where it is seen, or in words why it is not.
    fn follow<'py>(
        &self,
        py: Python<'py>,
        objects: Vec<PyRef<'_, TrackedObject>>,
        predicted: Vec<PyReadonlyArrayDyn<'_, f64>>,
        gray: PyReadonlyArrayDyn<'_, u8>,
        depth: Option<PyReadonlyArrayDyn<'_, f32>>,
        camera: PyRef<'_, Camera>,
    ) -> PyResult<Vec<Bound<'py, PyAny>>> {
        if objects.len() != predicted.len() {
            let (objects, poses) = (objects.len(), predicted.len());
            return Err(from_input_error(InputError::PoseCount { objects, poses }));
        }
        let poses = predicted
            .iter()
            .map(|T| isometry(T, "predicted"))
            .collect::<PyResult<Vec<Isometry3<f64>>>>()?;
        let camera = &camera.core;
        let gray = gray_image(&gray, "gray")?;
        if (gray.width(), gray.height()) != (camera.width, camera.height) {
            return Err(from_input_error(InputError::ImageSize {
                width: camera.width,
                height: camera.height,
                pixels: gray.pixels().len(),
            }));
        }
        let depth = depth
            .as_ref()
            .map(|array| depth_image(array, camera))
            .transpose()?;
        let cores: Vec<_> = objects
            .iter()
            .map(|object| &object.core)
            .zip(poses)
            .collect();
        let followed = py.detach(|| self.in_sight(&cores, &Sight::new(gray, depth, camera)));
        followed
            .into_iter()
            .map(|one| match one {
                Ok(core) => Ok(Bound::new(py, Followed { core })?.into_any()),
                Err(lost) => Ok(lost.to_string().into_pyobject(py)?.into_any()),
            })
            .collect()
    }
}

impl Follower {
    fn in_sight(
        &self,
        objects: &[(&core::TrackedObject, Isometry3<f64>)],
        sight: &Sight<'_>,
    ) -> Vec<Result<core::Followed, core::Lost>> {
        match objects {
            // One is followed sooner than another thread wakes up.
            [(object, predicted)] => {
                let mut workspace = AlignmentWorkspace::new();
                vec![core::follow(
                    object,
                    predicted,
                    sight,
                    &self.config,
                    &mut workspace,
                )]
            }
            several => core::follow_each(several, sight, &self.config),
        }
    }
}
