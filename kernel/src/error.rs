//! Errors of malformed input. A function that returns one has changed nothing.

use core::fmt;

/// Why an array of measurements cannot be used. Indices count from 0 and name the first offender.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum InputError {
    /// The two arrays of a correspondence list differ in length.
    LengthMismatch {
        /// Length of the first array.
        first: usize,
        /// Length of the array that differs from it.
        second: usize,
    },
    /// Fewer correspondences than the problem needs.
    TooFew {
        /// How many were given.
        given: usize,
        /// How many are needed at the least.
        needed: usize,
    },
    /// More correspondences than the caller's workspace holds.
    TooMany {
        /// How many were given.
        given: usize,
        /// How many the workspace holds.
        capacity: usize,
    },
    /// A coordinate is NaN or infinite.
    NotFinite {
        /// Which argument: 0 for the first array, 1 for the second, ...
        array: usize,
        /// Index of the point in that array.
        index: usize,
    },
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::LengthMismatch { first, second } => {
                write!(f, "arrays differ in length: {first} and {second}")
            }
            Self::TooFew { given, needed } => write!(f, "{given} correspondences given, {needed} needed"),
            Self::TooMany { given, capacity } => {
                write!(f, "{given} correspondences given, the workspace holds {capacity}")
            }
            Self::NotFinite { array, index } => {
                write!(f, "coordinate of point {index} of array {array} is not finite")
            }
        }
    }
}

impl core::error::Error for InputError {}
