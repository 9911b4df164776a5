//! The homography `x2 ~ H x1` between two images of a plane, or of a purely rotating camera.

use nalgebra::Matrix3;

use crate::Real;

/// A homography, known up to scale and sign.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Homography<T: Real>(pub Matrix3<T>);
