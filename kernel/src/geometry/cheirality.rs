//! Cheirality: whether a point lies in front of the cameras that see it, told without triangulating and without a
//! division.

use nalgebra::Vector3;

use super::Pose;
use crate::Real;

/// The signs of the depths of the midpoint triangulation along `R x1` and `x2`, as two numbers of those signs.
///
/// With `p = R x1 . t`, `q = x2 . t`, `r = R x1 . x2`: the depths that bring `d1 R x1 + t` nearest to `d2 x2` are
/// `(q r - p |x2|^2) / D` and `(q |x1|^2 - p r) / D`, `D = |R x1 x x2|^2 >= 0`.
#[inline]
pub(super) fn depth_signs<T: Real>(p: T, q: T, r: T, x1_sq: T, x2_sq: T) -> (T, T) {
    (q * r - p * x2_sq, q * x1_sq - p * r)
}

/// Whether the point that two bearings see lies in front of both cameras.
///
/// `d1 R x1 + t ~ d2 x2` with `d1 > 0`, `d2 > 0`, where the midpoint method decides for rays that do not meet.
///
/// # Input
/// The pose of view 2 in the frame of view 1 (`X2 = R X1 + t`; the length of t does not count) and the bearings in their
/// camera's frame, of any length.
///
/// # Returns
/// False, too, for parallel rays, a zero vector or a number that is not finite.
///
/// # Accuracy
/// Where the rays' angle is within a few `EPSILON` of zero the answer is that of rounding: a point at infinity has no side.
///
/// # Cost
/// About 60 floating-point operations; no division, no square root.
///
/// # References
/// R. I. Hartley, "Chirality", International Journal of Computer Vision, 1998, for the notion.
///
/// # Examples
/// ```
/// use epipole::geometry::{Pose, cheirality::in_front_of_both};
/// use epipole::nalgebra::Vector3;
/// let pose = Pose::translation(-1.0, 0.0, 0.0); // the second camera stands at x = 1
/// let (x1, x2) = (Vector3::new(0.5, 0.0, 4.0), Vector3::new(-0.5, 0.0, 4.0));
/// assert!(in_front_of_both(&pose, &x1, &x2));
/// assert!(!in_front_of_both(&pose, &x2, &x1)); // the rays diverge: they meet behind
/// ```
#[inline]
#[must_use]
pub fn in_front_of_both<T: Real>(pose: &Pose<T>, x1: &Vector3<T>, x2: &Vector3<T>) -> bool {
    let (a, t) = (pose.rotation * x1, &pose.translation.vector);
    let (d1, d2) = depth_signs(a.dot(t), x2.dot(t), a.dot(x2), a.norm_squared(), x2.norm_squared());
    d1 > T::ZERO && d2 > T::ZERO
}
