//! Threads of their own for a caller that must not take those of others.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// Threads apart from the shared ones; what runs in them is parallel in them alone.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct ThreadPool {
    pool: rayon::ThreadPool,
}

#[pymethods]
impl ThreadPool {
    /// As many threads as the machine has; `begin` is called in each of them.
    #[new]
    fn new(py: Python<'_>, begin: Py<PyAny>) -> PyResult<Self> {
        let begin_one = move |_| {
            Python::attach(|py| {
                if let Err(error) = begin.call0(py) {
                    error.write_unraisable(py, None);
                }
            });
        };
        let pool = py.detach(|| {
            rayon::ThreadPoolBuilder::new()
                .thread_name(|number| format!("planegrasp-{number}"))
                .start_handler(begin_one)
                .build()
        });
        pool.map(|pool| Self { pool })
            .map_err(|error| PyRuntimeError::new_err(format!("no threads: {error}")))
    }

    /// Calls something in one of the threads, waits for it, and returns what it returned.
    fn run(&self, py: Python<'_>, call: Py<PyAny>) -> PyResult<Py<PyAny>> {
        py.detach(|| self.pool.install(|| Python::attach(|py| call.call0(py))))
    }
}
