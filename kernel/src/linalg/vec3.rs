//! Products of three numbers each, written out: code for size keeps loops, and a loop over three numbers is longer than
//! they are.

use crate::Real;

#[cfg_attr(not(small), inline(always))]
pub(crate) fn dot<T: Real>(a: &[T; 3], b: &[T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg_attr(not(small), inline(always))]
pub(crate) fn cross<T: Real>(a: &[T; 3], b: &[T; 3]) -> [T; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `|a - b|^2`
#[cfg_attr(not(small), inline(always))]
pub(crate) fn apart_sq<T: Real>(a: &[T; 3], b: &[T; 3]) -> T {
    let d = less(a, b, T::ONE);
    dot(&d, &d)
}

/// `s a`
#[cfg_attr(not(small), inline(always))]
pub(crate) fn scaled<T: Real>(a: &[T; 3], s: T) -> [T; 3] {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// `a / s`
#[cfg_attr(not(small), inline(always))]
pub(crate) fn over<T: Real>(a: &[T; 3], s: T) -> [T; 3] {
    [a[0] / s, a[1] / s, a[2] / s]
}

/// `a - s b`
#[cfg_attr(not(small), inline(always))]
pub(crate) fn less<T: Real>(a: &[T; 3], b: &[T; 3], s: T) -> [T; 3] {
    [a[0] - b[0] * s, a[1] - b[1] * s, a[2] - b[2] * s]
}
