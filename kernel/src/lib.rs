#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]
//! Camera pose from point correspondences, in fixed memory, in bounded time, with the same bits on every machine.
//!
//! From matched image points to a pose that firmware can trust: `no_std`, no allocation, no `unsafe`, in `f32` and `f64`
//! from one source.
//!
//! # Where to start
//! [`estimate`] is what most programs call: pixels and cameras in, a typed verdict out, the inlier mask in memory that the
//! caller owns. [`bundle`] refines a sliding window of poses and points. Everything below them is public too.
//!
//! # Layers
//! A module uses those below it alone; a test reads every path of the source.
//!
//! | layer | module | holds |
//! |---|---|---|
//! | 6 | [`estimate`] | solver, engine, refinement and verdict together |
//! | 5 | [`refine`], [`bundle`] | non-linear refinement of one model; of a window of poses and points |
//! | 4 | [`robust`] | RANSAC over an [`Estimator`](robust::Estimator): samples, scores, losses, stopping, budgets |
//! | 3 | [`solvers`] | minimal and linear solvers, `<problem>_<n>pt`, none using another |
//! | 2 | [`geometry`] | cameras, poses, E, F and H, cheirality, triangulation, residuals with Jacobians |
//! | 1 | [`linalg`] | small factorisations and roots of polynomials without panics or unbounded loops |
//! | 0 | [`real`] | the scalar [`Real`] and its functions, [`InputError`], [`Solutions`] |
//!
//! # Memory
//! The caller owns all of it. Storage has `const` capacities, an impossible one does not compile; the work is done on
//! slices, and a full capacity is an error value.
//!
//! # Errors and verdicts
//! Malformed input (NaN, lengths that differ, too few points) is an error that names the first offender, and nothing has
//! changed. "No solution", "not converged" and "degenerate" are results: an estimate says what it is worth.
//!
//! # The same bits
//! The same input, options and seed give the same bits on every target. Hot code is IEEE `+ - * /` and the correctly
//! rounded square root; the few other functions come from one software library, through [`real`] alone.
//!
//! # Features
//! `defmt` adds `Format` to errors, reports, options and cameras. It changes no number.

pub use nalgebra;

pub mod bundle;
pub mod estimate;
pub mod geometry;
pub mod linalg;
pub mod real;
pub mod refine;
pub mod robust;
pub mod solvers;

mod error;
mod input;
mod solutions;

pub use error::InputError;
pub use real::Real;
pub use solutions::Solutions;
