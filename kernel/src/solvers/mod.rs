//! Minimal and linear solvers, one a file.
