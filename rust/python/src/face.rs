//! What was seen of one face.

use numpy::PyReadonlyArrayDyn;
use planegrasp_core::face::Correspondence;
use pyo3::prelude::*;

use crate::arrays::{isometry, matrix3, points};
use crate::errors::{from_input_error, from_pose_error};

/// The evidence for one face; see `planegrasp.pose.FaceObservation`.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct Face {
    pub core: planegrasp_core::Face,
}

#[pymethods]
impl Face {
    #[new]
    fn new(
        T_object_face: PyReadonlyArrayDyn<'_, f64>,
        width: f64,
        height: f64,
        face_points: PyReadonlyArrayDyn<'_, f64>,
        image_points: PyReadonlyArrayDyn<'_, f64>,
        homography: PyReadonlyArrayDyn<'_, f64>,
    ) -> PyResult<Self> {
        let pose = isometry(&T_object_face, "T_object_face")?;
        let face = points(&face_points, "face_points")?;
        let image = points(&image_points, "image_points")?;
        let paired = Correspondence::pair(&face, &image).map_err(from_input_error)?;
        let homography = matrix3(&homography, "homography")?;
        planegrasp_core::Face::new(pose, (width, height), paired, homography)
            .map(|core| Self { core })
            .map_err(from_pose_error)
    }
}

/// The core's faces of a Python list.
pub fn cores(faces: &[PyRef<'_, Face>]) -> Vec<planegrasp_core::Face> {
    faces.iter().map(|face| face.core.clone()).collect()
}
