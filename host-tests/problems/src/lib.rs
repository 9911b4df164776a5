//! Problems with known answers, made by arithmetic that is the same on every machine, and the hash of what epipole
//! answers to them: for the budgets of `examples/firmware` and for the bits that every target must equal.
#![no_std]
#![forbid(unsafe_code)]

pub mod golden;
pub mod random;
pub mod two_view;
pub mod window;

pub use two_view::{Geometry, TwoView};
pub use window::Flight;
