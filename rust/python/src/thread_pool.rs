//! Who works on what a thread of Python starts in parallel.
//!
//! The thread that calls takes part itself. Where it only waits for a pool of as many threads as there
//! are processors, that is one thread more for the operating system to place, and two that work often
//! share a processor while the other one is idle.

use std::sync::OnceLock;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// Lets the thread that imports the module take part in what it starts. What other threads start is
/// done by rayon's global pool, unless they have a [`ThreadPool`].
pub fn take_part() {
    static POOL: OnceLock<Option<rayon::ThreadPool>> = OnceLock::new();
    // A thread that is in a pool already stays there.
    POOL.get_or_init(|| builder().use_current_thread().build().ok());
}

/// Threads apart from those of others, for the thread that makes it: what that starts in parallel is
/// done by these, and by itself. They end with the object; some kilobytes of rayon's bookkeeping stay
/// (14 measured), so it is for threads that last.
#[pyclass(frozen, module = "planegrasp._core")]
pub struct ThreadPool {
    _pool: rayon::ThreadPool,
}

#[pymethods]
impl ThreadPool {
    /// As many as the machine has, the calling one included; `begin` is called in each of them.
    #[new]
    fn new(py: Python<'_>, begin: Py<PyAny>) -> PyResult<Self> {
        begin.call0(py)?;
        let begin_one = move |_| {
            Python::attach(|py| {
                if let Err(error) = begin.call0(py) {
                    error.write_unraisable(py, None);
                }
            });
        };
        let pool = py.detach(|| {
            builder()
                .use_current_thread()
                .start_handler(begin_one)
                .build()
        });
        pool.map(|pool| Self { _pool: pool })
            .map_err(|error| PyRuntimeError::new_err(format!("no threads: {error}")))
    }
}

fn builder() -> rayon::ThreadPoolBuilder {
    rayon::ThreadPoolBuilder::new().thread_name(|number| format!("planegrasp-{number}"))
}
