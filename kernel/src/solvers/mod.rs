//! Minimal and linear solvers, one a file.

mod relpose_5pt;

pub use relpose_5pt::{relpose_5pt, relpose_5pt_wide};
