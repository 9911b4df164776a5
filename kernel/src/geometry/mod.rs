//! Cameras, poses and the relations between two views.

mod essential;
mod fundamental;
mod homography;
pub mod pose;

pub use essential::Essential;
pub use fundamental::Fundamental;
pub use homography::Homography;
pub use pose::Pose;
