//! The essential matrix `E = [t]x R`: `x2' E x1 = 0` for bearings or normalised points.

use nalgebra::Matrix3;

use super::Pose;
use super::pose::skew;
use crate::Real;

/// An essential matrix, known up to scale and sign.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Essential<T: Real>(pub Matrix3<T>);

impl<T: Real> Essential<T> {
    /// `E = [t]x R` of the pose of view 2 in the frame of view 1.
    #[must_use]
    pub fn from_pose(pose: &Pose<T>) -> Self {
        Self(skew(&pose.translation.vector) * pose.rotation.to_rotation_matrix().into_inner())
    }
}
