//! The fundamental matrix `F = K2^-T E K1^-1`: `x2' F x1 = 0` for homogeneous pixels.

use nalgebra::Matrix3;

use crate::Real;

/// A fundamental matrix, known up to scale and sign.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fundamental<T: Real>(pub Matrix3<T>);
