//! What functions of any number of correspondences ask of their input.

use nalgebra::SVector;

use crate::real::is_finite;
use crate::{InputError, Real};

/// As many points in both views, and no fewer than `needed`.
pub(crate) fn check_lengths<T: Real, const N: usize>(
    x1: &[SVector<T, N>],
    x2: &[SVector<T, N>],
    needed: usize,
) -> Result<(), InputError> {
    if x1.len() != x2.len() {
        return Err(InputError::LengthMismatch { first: x1.len(), second: x2.len() });
    }
    if x1.len() < needed {
        return Err(InputError::TooFew { given: x1.len(), needed });
    }
    Ok(())
}

/// [`check_lengths`], and every coordinate finite: for solvers that would not fail by themselves.
pub(crate) fn check<T: Real, const N: usize>(
    x1: &[SVector<T, N>],
    x2: &[SVector<T, N>],
    needed: usize,
) -> Result<(), InputError> {
    check_lengths(x1, x2, needed)?;
    check_finite(x1, 0)?;
    check_finite(x2, 1)
}

/// No NaN and no infinity in the array of that number.
#[cfg_attr(small, inline(never))]
pub(crate) fn check_finite<T: Real, const N: usize>(
    vectors: &[SVector<T, N>],
    array: usize,
) -> Result<(), InputError> {
    for (index, vector) in vectors.iter().enumerate() {
        if !vector.iter().all(|&x| is_finite(x)) {
            return Err(InputError::NotFinite { array, index });
        }
    }
    Ok(())
}

/// Why a solver has no solution: an error where a coordinate is not finite, else degenerate points. Asked only after the
/// solver has failed, as it does where a coordinate is not finite.
#[cold]
pub(crate) fn no_solution<T: Real, const N: usize, S>(
    x1: &[SVector<T, N>],
    x2: &[SVector<T, N>],
) -> Result<Option<S>, InputError> {
    check_finite(x1, 0)?;
    check_finite(x2, 1)?;
    Ok(None)
}
