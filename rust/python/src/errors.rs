//! Errors of the core as Python exceptions.

use planegrasp_core::{InputError, PoseError};
use pyo3::PyErr;

mod python {
    // Imported when first raised: planegrasp.errors does not need this module.
    pyo3::import_exception!(planegrasp.errors, InvalidInputError);
    pyo3::import_exception!(planegrasp.errors, PoseError);
}

/// `InvalidInputError` with this message.
pub fn invalid_input(message: impl ToString) -> PyErr {
    python::InvalidInputError::new_err(message.to_string())
}

/// Bad arguments.
pub fn from_input_error(error: InputError) -> PyErr {
    invalid_input(error)
}

/// Bad arguments or no pose.
pub fn from_pose_error(error: PoseError) -> PyErr {
    match error {
        PoseError::Input(error) => from_input_error(error),
        error => python::PoseError::new_err(error.to_string()),
    }
}
