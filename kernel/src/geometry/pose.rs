//! The rigid motion that maps world points into a camera: `x_cam = R X + t`.

use nalgebra::{
    ArrayStorage, Isometry3, Matrix3, Matrix3x2, Quaternion, Translation3, UnitQuaternion, Vector3, Vector6,
};

use crate::Real;
use crate::linalg::vec3::{cross, dot, less, scaled};
use crate::linalg::{Svd3, product, svd3};
use crate::real::{abs, atan2, is_finite, lit, max, sin_cos, sqrt, with_sign_of};

/// A pose maps into the camera: `x_cam = R X + t`. Of two views, the pose of view 2 in the frame of view 1:
/// `X2 = R X1 + t`, |t| = 1 where scale is unobservable.
pub type Pose<T> = Isometry3<T>;

/// The pose of a rotation matrix and a translation. `r` must be a rotation; it is not checked.
#[must_use]
pub fn from_parts<T: Real>(r: &Matrix3<T>, t: &Vector3<T>) -> Pose<T> {
    Pose::from_parts(Translation3::from(*t), quaternion_from_matrix(r))
}

/// The unit quaternion of a rotation matrix, with w >= 0.
///
/// `r` must be a rotation to within rounding; it is not checked, and the result is normalised.
#[must_use]
pub fn quaternion_from_matrix<T: Real>(r: &Matrix3<T>) -> UnitQuaternion<T> {
    let (a, b, c) = (r[(0, 0)], r[(1, 1)], r[(2, 2)]);
    let (wx, wy, wz) = (r[(2, 1)] - r[(1, 2)], r[(0, 2)] - r[(2, 0)], r[(1, 0)] - r[(0, 1)]);
    let (xy, xz, yz) = (r[(0, 1)] + r[(1, 0)], r[(0, 2)] + r[(2, 0)], r[(1, 2)] + r[(2, 1)]);
    let (sum, difference) = (b + c, b - c);
    // The columns of 4 q q' are q times 4 q_k. Of two of them, added with the sign that lets them add up, the sum is q times
    // four times |w| + |x| (or |y| + |z|): nothing cancels. The first two serve unless both are small: 4 (w^2 + x^2) is
    // 2 (1 + a), below 1/2 for one in eight rotations at random.
    let [w, x, y, z] = if a > lit(-0.75) {
        let s = with_sign_of(T::ONE, wx);
        let plus = T::ONE + a;
        [plus + sum + abs(wx), wx + s * (plus - sum), wy + s * xy, wz + s * xz]
    } else {
        let s = with_sign_of(T::ONE, yz);
        let minus = T::ONE - a;
        [wy + s * wz, xy + s * xz, minus + difference + abs(yz), yz + s * (minus - difference)]
    };
    let square = (w * w + x * x) + (y * y + z * z);
    // Over the root, without waiting for it.
    let scale = with_sign_of(sqrt(square) * (T::ONE / square), w);
    UnitQuaternion::new_unchecked(Quaternion::new(w * scale, x * scale, y * scale, z * scale))
}

/// The pose, if all its numbers, and their sum, are finite.
pub(crate) fn finite<T: Real>(pose: Pose<T>) -> Option<Pose<T>> {
    let (q, t) = (&pose.rotation.coords, &pose.translation.vector);
    is_finite((q.x + q.y) + (q.z + q.w) + (t.x + t.y + t.z)).then_some(pose)
}

/// The cross-product matrix `[v]x`, with `[v]x u = v x u`.
#[must_use]
pub fn skew<T: Real>(v: &Vector3<T>) -> Matrix3<T> {
    let o = T::ZERO;
    Matrix3::new(o, -v.z, v.y, v.z, o, -v.x, -v.y, v.x, o)
}

/// Taylor's coefficients (-1)^k / (2k + first)! with which the functions of an angle up to 1 rad are exact to rounding.
const COSINE: [f64; 9] = alternating_inverse_factorials(0);
const SINE_OVER_ANGLE: [f64; 9] = alternating_inverse_factorials(1);
const ONE_MINUS_COSINE: [f64; 9] = alternating_inverse_factorials(2);
const ANGLE_MINUS_SINE: [f64; 9] = alternating_inverse_factorials(3);

const fn alternating_inverse_factorials(first: u32) -> [f64; 9] {
    let mut c = [0.0; 9];
    let mut term = 1.0;
    let mut n = 1;
    while n <= first {
        term /= n as f64;
        n += 1;
    }
    let mut k = 0;
    while k < 9 {
        c[k] = term;
        term = -term / (n as f64 * (n + 1) as f64);
        n += 2;
        k += 1;
    }
    c
}

/// `c[0] + c[1] s + c[2] s^2 + ..`
#[inline]
fn series<T: Real>(c: &[f64; 9], s: T) -> T {
    c.iter().rev().fold(T::ZERO, |sum, &k| sum * s + lit(k))
}

/// The length of a vector whose squares may overflow or underflow.
fn length<T: Real>(v: &Vector3<T>) -> T {
    let size = max(abs(v.x), max(abs(v.y), abs(v.z)));
    if size > T::ZERO { sqrt((v / size).norm_squared()) * size } else { T::ZERO }
}

/// `Exp(w)`: the rotation by the angle |w| (rad) about the axis w.
///
/// `q = (cos |w|/2, sin(|w|/2) w/|w|)`. For |w| up to 1 by series, without a call of `sin` or `cos`.
///
/// # Accuracy
/// To rounding at any angle, near 0 and near pi too. A vector that is not finite gives a quaternion that is not.
///
/// # Examples
/// ```
/// use epipole::geometry::pose::{exp, log};
/// use epipole::nalgebra::Vector3;
/// let w = Vector3::new(0.3_f64, -0.2, 3.0);
/// assert!((log(&exp(&w)) - w).norm() < 1e-14);
/// ```
#[must_use]
pub fn exp<T: Real>(w: &Vector3<T>) -> UnitQuaternion<T> {
    let square = w.norm_squared();
    let (cosine, factor) = if square <= T::ONE {
        let half_sq = square * lit(0.25);
        (series(&COSINE, half_sq), T::HALF * series(&SINE_OVER_ANGLE, half_sq))
    } else {
        let angle = length(w);
        let (sine, cosine) = sin_cos(angle * T::HALF);
        (cosine, sine / angle)
    };
    UnitQuaternion::new_unchecked(Quaternion::new(cosine, w.x * factor, w.y * factor, w.z * factor))
}

/// `Log(q)`: the rotation vector of a rotation, angle in [0, pi].
///
/// At pi the axis has two signs; the one of the quaternion with `w >= 0` is given.
///
/// # Accuracy
/// To rounding at any angle, near 0 and near pi too (the logarithm of a rotation matrix is not: give a quaternion).
#[must_use]
pub fn log<T: Real>(q: &UnitQuaternion<T>) -> Vector3<T> {
    let (q, w) = (q.as_ref(), q.w);
    let v = Vector3::new(q.i, q.j, q.k);
    let (v, w) = if w < T::ZERO { (-v, -w) } else { (v, w) };
    let sine_sq = v.norm_squared();
    // 2 atan(|v| / w) / |v|, whose next term is smaller by the square of the sine.
    if sine_sq <= T::EPSILON {
        return v * (T::TWO / w * (T::ONE - sine_sq / (w * w) / lit(3.0)));
    }
    let sine = sqrt(sine_sq);
    v * (T::TWO * atan2(sine, w) / sine)
}

/// The left Jacobian of SO(3): `Exp(w + d) = Exp(J d) Exp(w)` to first order in d.
///
/// `J = I + (1 - cos a)/a^2 [w]x + (a - sin a)/a^3 [w]x^2`, a = |w|. By series up to 1 rad.
///
/// # Examples
/// ```
/// use epipole::geometry::pose::left_jacobian;
/// use epipole::nalgebra::{Matrix3, Vector3};
/// assert_eq!(left_jacobian(&Vector3::<f32>::zeros()), Matrix3::identity());
/// ```
#[must_use]
pub fn left_jacobian<T: Real>(w: &Vector3<T>) -> Matrix3<T> {
    let square = w.norm_squared();
    let (a, b) = if square <= T::ONE {
        (series(&ONE_MINUS_COSINE, square), series(&ANGLE_MINUS_SINE, square))
    } else {
        let angle = length(w);
        let (sine, _) = sin_cos(angle * T::HALF);
        let half = sine / angle;
        (T::TWO * half * half, (T::ONE - sin_cos(angle).0 / angle) / angle / angle)
    };
    let k = skew(w);
    Matrix3::identity() + k * a + k * k * b
}

/// The pose moved by `(w, dt)`: `R <- Exp(w) R`, `t <- t + dt`. The order of every covariance of a pose.
///
/// The quaternion is normalised anew, so that a long sequence of steps does not drift.
///
/// # Examples
/// ```
/// use epipole::geometry::{Pose, pose::retract};
/// use epipole::nalgebra::Vector6;
/// let moved = retract(&Pose::<f32>::identity(), &Vector6::new(0.0, 0.0, 0.0, 1.0, 2.0, 3.0));
/// assert_eq!(moved.translation.vector.z, 3.0);
/// ```
#[must_use]
pub fn retract<T: Real>(pose: &Pose<T>, delta: &Vector6<T>) -> Pose<T> {
    let w = Vector3::new(delta.x, delta.y, delta.z);
    let q = exp(&w).into_inner() * pose.rotation.into_inner();
    let rotation = UnitQuaternion::new_unchecked(q * (T::ONE / sqrt(q.coords.norm_squared())));
    let t = pose.translation.vector + Vector3::new(delta.w, delta.a, delta.b);
    Pose::from_parts(Translation3::from(t), rotation)
}

/// The centre of the camera in the world: `-R' t`.
#[must_use]
pub fn centre<T: Real>(pose: &Pose<T>) -> Vector3<T> {
    -(pose.rotation.inverse() * pose.translation.vector)
}

/// The pose of view 2 in the frame of view 1, of two world-to-camera poses: `R = R2 R1'`, `t = t2 - R t1`.
///
/// # Examples
/// ```
/// use epipole::geometry::{Pose, pose::relative};
/// let (first, second) = (Pose::translation(1.0, 0.0, 0.0), Pose::<f64>::translation(0.0, 0.0, 2.0));
/// assert_eq!(relative(&first, &second), Pose::translation(-1.0, 0.0, 2.0));
/// ```
#[must_use]
pub fn relative<T: Real>(first: &Pose<T>, second: &Pose<T>) -> Pose<T> {
    let rotation = second.rotation * first.rotation.inverse();
    let t = second.translation.vector - rotation * first.translation.vector;
    Pose::from_parts(Translation3::from(t), rotation)
}

/// The angle between two rotations in [0, pi], rad; the same for q and -q.
///
/// By the chords: `4 atan2(|a - b|, |a + b|)`, exact to rounding at any angle, where the arc cosine of the trace is
/// good to no better than sqrt(EPSILON) near 0 and pi.
///
/// # Examples
/// ```
/// use epipole::geometry::pose::{exp, rotation_angle};
/// use epipole::nalgebra::Vector3;
/// let (a, b) = (exp(&Vector3::new(0.0_f32, 0.0, 1.0)), exp(&Vector3::new(0.0, 0.0, 1.0001)));
/// assert!((rotation_angle(&a, &b) - 1e-4).abs() < 1e-6);
/// ```
#[must_use]
pub fn rotation_angle<T: Real>(a: &UnitQuaternion<T>, b: &UnitQuaternion<T>) -> T {
    let near = (a.coords - b.coords).norm_squared();
    let far = (a.coords + b.coords).norm_squared();
    let (near, far) = if near <= far { (near, far) } else { (far, near) };
    lit::<T>(4.0) * atan2(sqrt(near), sqrt(far))
}

/// The angle between two vectors of any length in [0, pi], rad: `atan2(|a x b|, a . b)`.
#[must_use]
pub fn vector_angle<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> T {
    atan2(sqrt(a.cross(b).norm_squared()), a.dot(b))
}

/// An orthonormal basis `[e1, e2]` of the plane tangent to the sphere at the unit vector `n`, `e1 x e2 = n`.
///
/// `e1` is `(2, -2, -1)/3` reflected by the reflection that takes `n` to `-(2, 1, 2)/3`, made orthogonal to `n` again
/// to rounding, and `e2 = n x e1`. No basis is continuous on the whole sphere; this one is but at `n = -(2, 1, 2)/3`,
/// chosen away from the directions in which cameras move. Covariances of a direction refer to it.
///
/// `n` must be a unit vector; it is not checked.
///
/// # Examples
/// ```
/// use epipole::geometry::pose::tangent_basis;
/// use epipole::nalgebra::{Matrix2, Vector3};
/// let n = Vector3::new(0.6_f64, 0.0, -0.8);
/// let basis = tangent_basis(&n);
/// assert!((basis.transpose() * basis - Matrix2::identity()).norm() < 1e-15);
/// assert!((basis.transpose() * n).norm() < 1e-15);
/// ```
#[must_use]
pub fn tangent_basis<T: Real>(n: &Vector3<T>) -> Matrix3x2<T> {
    let third = T::ONE / lit(3.0);
    let (two, one) = (T::TWO * third, T::ONE * third);
    let n = &n.data.0[0];
    let v = [n[0] + two, n[1] + one, n[2] + two];
    let start = [two, -two, -one];
    let square = dot(&v, &v);
    // Of a difference of a few roundings not even the direction is known; `start` is orthogonal to such an `n` as it is.
    let known = square > T::EPSILON * T::EPSILON * lit(256.0);
    let reflected = if known { less(&start, &v, T::TWO * dot(&v, &start) / square) } else { start };
    let e1 = less(&reflected, n, dot(n, &reflected));
    let e1 = scaled(&e1, T::ONE / sqrt(dot(&e1, &e1)));
    Matrix3x2::from_data(ArrayStorage([e1, cross(n, &e1)]))
}

/// The matrix of a rotation, by a call where code is to be small.
#[cfg_attr(not(small), inline(always))]
#[cfg_attr(small, inline(never))]
pub(crate) fn rotation_matrix<T: Real>(rotation: &UnitQuaternion<T>) -> Matrix3<T> {
    rotation.to_rotation_matrix().into_inner()
}

/// The rotation nearest to a matrix in the Frobenius norm: `U diag(1, 1, det(U V')) V'` of `M = U S V'`.
///
/// # Returns
/// None where it is not unique or the matrix is not finite: to within `16 EPSILON` of the largest singular value, the
/// rank is below 2, or the determinant is negative and the two smaller singular values are equal.
///
/// # References
/// P. H. Schönemann, "A generalized solution of the orthogonal Procrustes problem", Psychometrika 31, 1966; G. Wahba, "A
/// least squares estimate of satellite attitude", SIAM Review 7, 1965, for the sign.
///
/// # Examples
/// ```
/// use epipole::geometry::pose::nearest_rotation;
/// use epipole::nalgebra::Matrix3;
/// let r = nearest_rotation(&(Matrix3::<f64>::identity() * 3.0)).unwrap();
/// assert!((r - Matrix3::identity()).norm() < 1e-15);
/// assert!(nearest_rotation(&Matrix3::<f64>::zeros()).is_none());
/// ```
#[must_use]
pub fn nearest_rotation<T: Real>(m: &Matrix3<T>) -> Option<Matrix3<T>> {
    let Svd3 { u, s, v } = svd3(m)?;
    let sign = if u.determinant() < T::ZERO { -T::ONE } else { T::ONE };
    let unique = s.y + sign * s.z > lit::<T>(16.0) * T::EPSILON * s.x;
    let mut u = u;
    u.data.0[2] = scaled(&u.data.0[2], sign);
    unique.then(|| product(&u, &v.transpose()))
}

/// The rotation that turns a frame until the direction `gravity` of it lies along +y: `R gravity ~ (0, 1, 0)`, by the
/// smallest angle. It makes the upright frames that the upright solvers want.
///
/// None for a vector of length zero or one that is not finite.
///
/// # Examples
/// ```
/// use epipole::geometry::pose::upright;
/// use epipole::nalgebra::Vector3;
/// let gravity = Vector3::new(0.1, 0.9, -0.4);
/// let turned = upright(&gravity).unwrap() * gravity.normalize();
/// assert!((turned - Vector3::y()).norm() < 1e-15);
/// ```
#[must_use]
pub fn upright<T: Real>(gravity: &Vector3<T>) -> Option<Matrix3<T>> {
    let largest = max(max(abs(gravity.x), abs(gravity.y)), abs(gravity.z));
    // The sum is not finite where a component is not.
    let sum = gravity.x + gravity.y + gravity.z;
    if !(largest > T::ZERO && abs(sum) <= T::MAX && largest <= T::MAX) {
        return None;
    }
    let g = gravity / largest;
    let mut g = g * (T::ONE / sqrt(g.norm_squared()));
    // Half a turn about x first where the angle is obtuse.
    let obtuse = g.y < T::ZERO;
    if obtuse {
        g = Vector3::new(g.x, -g.y, -g.z);
    }
    // I + [v]x + [v]x^2 / (1 + c) with v = g x y = (-g.z, 0, g.x)
    let k = T::ONE / (T::ONE + g.y);
    let (x, z) = (g.x, g.z);
    let mut r =
        Matrix3::new(T::ONE - k * x * x, -x, -k * x * z, x, g.y, z, -k * x * z, -z, T::ONE - k * z * z);
    if obtuse {
        for i in 0..3 {
            r[(i, 1)] = -r[(i, 1)];
            r[(i, 2)] = -r[(i, 2)];
        }
    }
    Some(r)
}

/// The rotation about the y axis by the angle whose cosine and sine are `c` and `s`: `x' = c x + s z`,
/// `z' = c z - s x`. `(c, s)` must be a unit vector; it is not checked.
#[inline]
pub(crate) fn rotation_about_y<T: Real>(c: T, s: T) -> UnitQuaternion<T> {
    // (1 + c, s) and (s, 1 - c) are along the half angle's (cos, sin); one of them is not short.
    let (w, y) = if c > T::ZERO {
        (T::ONE + c, s)
    } else if s > T::ZERO {
        (s, T::ONE - c)
    } else {
        (-s, c - T::ONE)
    };
    let square = w * w + y * y;
    let scale = sqrt(square) * (T::ONE / square);
    let (w, y) = (w * scale, y * scale);
    UnitQuaternion::new_unchecked(Quaternion::new(w, T::ZERO, y, T::ZERO))
}
