//! What an absolute-pose estimation is asked, and what is wrong with it.

use core::fmt;

use nalgebra::Vector3;

use crate::robust::{OptionsError, RansacOptions};
use crate::{InputError, Real};

/// Gravity as an inertial unit knows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GravityPrior<T: Real> {
    /// Its direction in the world's frame, of any length.
    pub world: Vector3<T>,
    /// Its direction in the camera's frame, of any length.
    pub camera: Vector3<T>,
    /// Standard deviation of the angle between the two, rad.
    pub sigma_rad: T,
}

/// Options of [`absolute_pose`](super::absolute_pose()).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct AbsolutePoseOptions<T: Real> {
    /// Largest reprojection error of an inlier, pixels. Default 2.
    pub max_error_px: T,
    /// Standard deviation of the noise of one image coordinate, pixels. Default: half of `max_error_px`.
    pub sigma_px: Option<T>,
    /// Gravity, if known: then samples are of two correspondences instead of three, and it enters the refinement. A
    /// prior that contradicts the correspondences is left aside and reported. Default none.
    pub gravity: Option<GravityPrior<T>>,
    /// Confidence, iterations, budgets and seed.
    pub ransac: RansacOptions<T>,
}

impl<T: Real> Default for AbsolutePoseOptions<T> {
    fn default() -> Self {
        Self { max_error_px: T::TWO, sigma_px: None, gravity: None, ransac: RansacOptions::default() }
    }
}

/// Malformed input or options. Outputs are untouched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum AbsolutePoseError {
    /// The correspondences cannot be used.
    Input(InputError),
    /// An option is out of its range.
    Options(OptionsError),
    /// A direction of the gravity prior has no length or is not finite, or its uncertainty is not positive and finite.
    Gravity,
}

impl fmt::Display for AbsolutePoseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Input(error) => error.fmt(f),
            Self::Options(error) => error.fmt(f),
            Self::Gravity => f.write_str("the gravity prior needs two directions and a positive uncertainty"),
        }
    }
}

impl core::error::Error for AbsolutePoseError {}

impl From<InputError> for AbsolutePoseError {
    fn from(error: InputError) -> Self {
        Self::Input(error)
    }
}

impl From<OptionsError> for AbsolutePoseError {
    fn from(error: OptionsError) -> Self {
        Self::Options(error)
    }
}
