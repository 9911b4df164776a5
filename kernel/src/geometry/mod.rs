//! Cameras, poses and the relations between two views.

pub mod camera;
pub mod cheirality;
mod essential;
mod fundamental;
mod homography;
pub(crate) mod object_space;
pub mod pose;
pub mod residual;
pub mod triangulation;
mod whitening;

pub use camera::{BrownConrady, Camera, CameraError, CameraModel, KannalaBrandt, Pinhole, UnprojectError};
pub use essential::{CheiralPose, Essential, TwistedPair};
pub use fundamental::Fundamental;
pub use homography::{Homography, PlaneMotion};
pub use pose::Pose;
pub(crate) use whitening::Whitening;
