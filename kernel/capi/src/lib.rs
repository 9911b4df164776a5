#![no_std]
#![deny(missing_docs)]
#![deny(clippy::undocumented_unsafe_blocks)]
// The files of `api` are written for one scalar and compiled for each.
#![allow(clippy::duplicate_mod)]
// The unit tests are those of `raw.rs`: without the API they are compiled in a moment.
#![cfg_attr(test, allow(dead_code, unused_imports, unused_macros))]
//! The C ABI of `epipole`. C programs read `include/epipole.h`; its rules stand in `kernel/CONVENTIONS.md`.
//!
//! | file | holds |
//! |---|---|
//! | `raw.rs` | pointers into slices and values: every check that can be made of a pointer, and all of the `unsafe` but the calls to it |
//! | `status.rs`, `enums.rs`, `types.rs`, `options.rs`, `estimates.rs`, `limits.rs` | what C sees: codes, enumerations, structs with their conversions, capacities |
//! | `workspace.rs`, `window.rs` | the caller's memory cut into the slices of an estimator, of a window |
//! | `api/` | the functions, written for one scalar and compiled for `f32` and `f64` |
//!
//! # Safety
//! One contract for every function. A pointer is null or points to as many elements as its documentation says, which
//! nothing else writes during the call (nor reads, where the function writes). What can be told from a pointer's bits is
//! checked: null, alignment, size, overlap of what is written with anything else. A callback returns; it neither throws
//! nor jumps.

#[cfg(not(target_os = "none"))]
extern crate std;

pub mod enums;
pub mod estimates;
mod layout;
pub mod limits;
pub mod options;
mod raw;
pub mod status;
pub mod types;
#[cfg(feature = "bundle")]
pub mod window;
mod workspace;

pub use status::{ABI_VERSION, Status, abi_version, status_string};
pub use workspace::{
    ABSOLUTE_POSE_NUMBERS, ABSOLUTE_POSE_WIDE_NUMBERS, TWO_VIEW_NUMBERS, TWO_VIEW_WIDE_NUMBERS,
    WORKSPACE_ALIGN, workspace_align,
};

/// The functions that end in `_f32`.
#[cfg(all(feature = "f32", not(test)))]
#[path = "api"]
pub mod f32 {
    macro_rules! name {
        ($name:literal) => {
            concat!("epi_", $name, "_f32")
        };
    }
    pub(crate) type Scalar = f32;
    pub mod camera;
    pub mod estimate;
    pub mod geometry;
    pub mod refine;
    pub mod residual;
    pub mod solvers;
    pub mod triangulation;
    #[cfg(feature = "bundle")]
    pub mod window;
}

/// The functions that end in `_f64`.
#[cfg(all(feature = "f64", not(test)))]
#[path = "api"]
pub mod f64 {
    macro_rules! name {
        ($name:literal) => {
            concat!("epi_", $name, "_f64")
        };
    }
    pub(crate) type Scalar = f64;
    pub mod camera;
    pub mod estimate;
    pub mod geometry;
    pub mod refine;
    pub mod residual;
    pub mod solvers;
    pub mod triangulation;
    #[cfg(feature = "bundle")]
    pub mod window;
}

#[cfg(all(target_os = "none", feature = "panic-handler"))]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
