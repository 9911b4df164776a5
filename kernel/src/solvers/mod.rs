//! Minimal and linear solvers, one a file.

mod homography_4pt;
mod relpose_5pt;
mod relpose_7pt;

pub use homography_4pt::homography_4pt;
pub use relpose_5pt::{relpose_5pt, relpose_5pt_poses, relpose_5pt_wide};
pub use relpose_7pt::relpose_7pt;
