//! Non-linear refinement of one model on many correspondences.

mod absolute_pose;
pub(crate) mod blocks;
pub(crate) mod fundamental;
pub(crate) mod homography;
pub(crate) mod lm;
pub(crate) mod relative_pose;
mod relative_pose_jacobian;
pub(crate) mod reprojection;
mod two_view;

pub use absolute_pose::{PosePrior, RefineAbsolutePoseOptions, RefinedAbsolutePose, absolute_pose};
pub use relative_pose_jacobian::relative_pose_jacobian;
pub use two_view::{RefineTwoViewOptions, RefinedTwoView, fundamental, homography, relative_pose};
