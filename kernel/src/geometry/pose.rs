//! The rigid motion that maps world points into a camera: `x_cam = R X + t`.

use nalgebra::{Isometry3, Matrix3, Quaternion, Translation3, UnitQuaternion, Vector3};

use crate::Real;
use crate::real::sqrt;

/// A pose maps into the camera: `x_cam = R X + t`. Of two views, the pose of view 2 in the frame of view 1:
/// `X2 = R X1 + t`, |t| = 1 where scale is unobservable.
pub type Pose<T> = Isometry3<T>;

/// The pose of a rotation matrix and a translation. `r` must be a rotation; it is not checked.
#[must_use]
pub fn from_parts<T: Real>(r: &Matrix3<T>, t: &Vector3<T>) -> Pose<T> {
    Pose::from_parts(Translation3::from(*t), quaternion_from_matrix(r))
}

/// The unit quaternion of a rotation matrix, by the largest of its four components (Shepperd 1978).
/// `r` must be a rotation to within rounding; it is not checked, and the result is normalised.
#[must_use]
pub fn quaternion_from_matrix<T: Real>(r: &Matrix3<T>) -> UnitQuaternion<T> {
    let (a, b, c) = (r[(0, 0)], r[(1, 1)], r[(2, 2)]);
    let one = T::ONE;
    let (w, x, y, z);
    if a + b + c > T::ZERO {
        w = one + a + b + c;
        x = r[(2, 1)] - r[(1, 2)];
        y = r[(0, 2)] - r[(2, 0)];
        z = r[(1, 0)] - r[(0, 1)];
    } else if a > b && a > c {
        w = r[(2, 1)] - r[(1, 2)];
        x = one + a - b - c;
        y = r[(0, 1)] + r[(1, 0)];
        z = r[(0, 2)] + r[(2, 0)];
    } else if b > c {
        w = r[(0, 2)] - r[(2, 0)];
        x = r[(0, 1)] + r[(1, 0)];
        y = one + b - a - c;
        z = r[(1, 2)] + r[(2, 1)];
    } else {
        w = r[(1, 0)] - r[(0, 1)];
        x = r[(0, 2)] + r[(2, 0)];
        y = r[(1, 2)] + r[(2, 1)];
        z = one + c - a - b;
    }
    let scale = one / sqrt(w * w + x * x + y * y + z * z);
    UnitQuaternion::new_unchecked(Quaternion::new(w * scale, x * scale, y * scale, z * scale))
}

/// The cross-product matrix `[v]x`, with `[v]x u = v x u`.
#[must_use]
pub fn skew<T: Real>(v: &Vector3<T>) -> Matrix3<T> {
    let o = T::ZERO;
    Matrix3::new(o, -v.z, v.y, v.z, o, -v.x, -v.y, v.x, o)
}
