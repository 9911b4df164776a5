//! Minimal and linear solvers, one a file.

mod abspose_upright_2pt;
mod homography_4pt;
mod homography_npt;
mod input;
mod p3p;
mod relpose_5pt;
mod relpose_7pt;
mod relpose_8pt;
mod relpose_upright_3pt;

pub use abspose_upright_2pt::abspose_upright_2pt;
pub use homography_4pt::homography_4pt;
pub use homography_npt::homography_npt;
pub use p3p::p3p;
pub use relpose_5pt::{relpose_5pt, relpose_5pt_poses, relpose_5pt_wide};
pub use relpose_7pt::relpose_7pt;
pub use relpose_8pt::{fundamental_8pt, relpose_8pt};
pub use relpose_upright_3pt::relpose_upright_3pt;
