//! Arithmetic of planegrasp. Knows nothing of Python.
