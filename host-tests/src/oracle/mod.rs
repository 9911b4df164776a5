//! Slow solvers of high precision that tell what the right answer is.

mod double_double;
mod relpose_5pt;

pub use double_double::Dd;
pub use relpose_5pt::essential_matrices;
