//! Malformed input or options of a two-view estimator.

use core::fmt;

use crate::InputError;
use crate::robust::OptionsError;

/// Malformed input or options. Outputs are untouched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum TwoViewError {
    /// The correspondences cannot be used.
    Input(InputError),
    /// An option is out of its range.
    Options(OptionsError),
    /// The pose to start from is not finite, or its translation is zero.
    Pose,
    /// Of a prior of the relative pose: a direction without length, an uncertainty that is not positive definite, or a
    /// number that is not finite.
    Prior,
}

impl fmt::Display for TwoViewError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Input(error) => error.fmt(f),
            Self::Options(error) => error.fmt(f),
            Self::Pose => f.write_str("the pose to start from is not finite, or its translation is zero"),
            Self::Prior => {
                f.write_str("the prior needs finite directions or a rotation, and a positive uncertainty")
            }
        }
    }
}

impl core::error::Error for TwoViewError {}

impl From<InputError> for TwoViewError {
    fn from(error: InputError) -> Self {
        Self::Input(error)
    }
}

impl From<OptionsError> for TwoViewError {
    fn from(error: OptionsError) -> Self {
        Self::Options(error)
    }
}
