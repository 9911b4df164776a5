//! A pose server: correspondences in over a serial line, poses with verdict and covariance out.
//!
//! It is written against `embedded-io` and `embedded-hal` and needs a serial line, a data-ready pin, a clock and memory:
//! see [`Server`]. The format is that of `epipole_wire`.
//!
//! Nothing stops it. A frame that cannot be answered is refused with its reason, counted, and forgotten; an error of the
//! line or of the pin is counted.
#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod memory;
mod order;
mod server;

pub use memory::{Memory, frame_bytes};
pub use server::{Activity, Clock, Limits, Server};
