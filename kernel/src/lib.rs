#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]
//! Camera pose from point correspondences, in fixed memory, in bounded time, with the same bits on every machine.

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
