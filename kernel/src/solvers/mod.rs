//! Minimal and linear solvers, one a file.

mod absolute_orientation;
mod abspose_npt;
mod abspose_planar;
mod abspose_upright_2pt;
mod homography_4pt;
mod homography_npt;
mod p3p;
mod relpose_5pt;
mod relpose_7pt;
mod relpose_8pt;
mod relpose_upright_3pt;
mod resection_dlt;
mod rotation;
mod translation;

pub use absolute_orientation::{absolute_orientation_npt, absolute_orientation_with_scale_npt};
pub use abspose_npt::abspose_npt;
pub use abspose_planar::{PlanarTargetPose, abspose_planar};
pub use abspose_upright_2pt::abspose_upright_2pt;
pub use homography_4pt::homography_4pt;
pub use homography_npt::homography_npt;
pub use p3p::p3p;
pub use relpose_5pt::{relpose_5pt, relpose_5pt_poses, relpose_5pt_wide};
pub use relpose_7pt::relpose_7pt;
pub use relpose_8pt::{fundamental_8pt, relpose_8pt};
pub use relpose_upright_3pt::relpose_upright_3pt;
pub use resection_dlt::{ProjectionParts, decompose_projection, resection_dlt};
pub use rotation::{rotation_2pt, rotation_npt};
pub use translation::{translation_2pt, translation_npt};
