//! Python bindings of `planegrasp-core`: validation and conversion, no arithmetic.
//!
//! Every function releases the interpreter's lock while it computes, and raises
//! `planegrasp.errors.InvalidInputError` for arguments that cannot be worked with and
//! `planegrasp.errors.PoseError` where there is no pose.

// Transforms are named by their two frames, T_camera_object, in code and documents alike.
#![allow(non_snake_case)]

mod alignment;
mod arrays;
mod camera;
mod coverage;
mod errors;
mod estimate;
mod face;
mod face_search;
mod fused;
mod homography;
mod matching;
mod plane;
mod pnp;
mod pose_filter;
mod sift;
#[cfg(feature = "surf")]
mod surf;
mod thread_pool;
mod three_point;
mod tracking;

use pyo3::prelude::*;

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    thread_pool::take_part();
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<alignment::AlignmentReference>()?;
    module.add_class::<alignment::AlignmentSettings>()?;
    module.add_class::<alignment::Alignment>()?;
    module.add_class::<camera::Camera>()?;
    module.add_class::<face::Face>()?;
    module.add_class::<estimate::Estimate>()?;
    module.add_class::<pnp::PnPSettings>()?;
    module.add_class::<fused::FusedSettings>()?;
    module.add_class::<face_search::SearchSettings>()?;
    module.add_class::<face_search::Appearance>()?;
    module.add_class::<face_search::Evidence>()?;
    module.add_class::<face_search::Matches>()?;
    module.add_class::<face_search::HomographyEstimate>()?;
    module.add_class::<face_search::FoundFace>()?;
    module.add_class::<face_search::Attempt>()?;
    module.add_class::<face_search::FaceSearch>()?;
    module.add_class::<matching::ReferenceIndex>()?;
    module.add_function(wrap_pyfunction!(coverage::by_usefulness, module)?)?;
    module.add_class::<pose_filter::PoseFilterSettings>()?;
    module.add_class::<pose_filter::FilteredPose>()?;
    module.add_class::<pose_filter::MotionSettings>()?;
    module.add_class::<pose_filter::MotionState>()?;
    module.add_class::<thread_pool::ThreadPool>()?;
    module.add_class::<tracking::FollowSettings>()?;
    module.add_class::<tracking::TrackedObject>()?;
    module.add_class::<tracking::FollowedFace>()?;
    module.add_class::<tracking::Followed>()?;
    module.add_class::<tracking::Follower>()?;
    module.add_class::<sift::Sift>()?;
    #[cfg(feature = "surf")]
    module.add_class::<surf::Surf>()?;
    module.add_function(wrap_pyfunction!(three_point::three_point, module)?)?;
    module.add_function(wrap_pyfunction!(pnp::pnp, module)?)?;
    module.add_function(wrap_pyfunction!(pnp::planar_poses, module)?)?;
    module.add_function(wrap_pyfunction!(fused::fused, module)?)?;
    module.add_function(wrap_pyfunction!(plane::fit_plane, module)?)?;
    module.add_function(wrap_pyfunction!(homography::estimate_homography, module)?)?;
    module.add_function(wrap_pyfunction!(homography::refine_homography, module)?)?;
    Ok(())
}
