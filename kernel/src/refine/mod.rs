//! Non-linear refinement of one model on many correspondences.

pub(crate) mod blocks;
pub(crate) mod fundamental;
pub(crate) mod homography;
pub(crate) mod lm;
pub(crate) mod relative_pose;
pub(crate) mod reprojection;
