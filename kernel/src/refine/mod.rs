//! Non-linear refinement of one model on many correspondences.

mod absolute_pose;
pub(crate) mod blocks;
pub(crate) mod fundamental;
pub(crate) mod homography;
pub(crate) mod lm;
pub(crate) mod relative_pose;
pub(crate) mod reprojection;

pub use absolute_pose::{PosePrior, RefineAbsolutePoseOptions, RefinedAbsolutePose, absolute_pose};
