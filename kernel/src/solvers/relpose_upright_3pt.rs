//! Relative pose of three correspondences and the vertical.
//!
//! In upright frames `R` turns about y. With `u = z + i x` for the horizontal part of a vector, `R` multiplies `u` by
//! `e = c + i s`. The three epipolar planes' normals `R x1 x x2` are orthogonal to `t`, so their determinant is zero.
//! With `A = y1 u2`, `B = y2 u1`, `G = conj(u1) u2` it is, summed over the cyclic (i, j, k),
//! `Im(G_k / e) Im(conj(A_i - B_i e) (A_j - B_j e))`: a trigonometric polynomial of degree two, that is a conic in
//! (c, s), which meets the circle `c^2 + s^2 = 1` in up to four points. A pair of lines passes through them.

use nalgebra::{Matrix3, Translation3, Vector3};

use crate::geometry::Pose;
use crate::geometry::pose::rotation_about_y;
use crate::linalg::conic::{lines_of_conic, real_root_of_cubic};
use crate::real::{abs, copysign, lit, max, min, sqrt};
use crate::{Real, Solutions};

/// The up to four relative poses of three correspondences, if both frames have the vertical as their y axis.
///
/// `d2 x2 = d1 R x1 + t` with `d1, d2 > 0`, `R` a rotation about y and |t| = 1.
///
/// # Input
/// `x1`, `x2`: bearings of any length, each in a camera frame that has been turned until gravity is along y.
///
/// # Returns
/// Poses of the (turned) frame 2 in the (turned) frame 1 that have all three points in front, in no particular order.
///
/// # Degeneracies
/// Empty for a camera that does not move, for equal bearings, and for input that is not finite. For three points of one
/// horizontal plane through the camera centres any rotation fits, and what is returned is arbitrary.
///
/// # Accuracy
/// Noise-free, depth 2 to 20: `f64` 100 % within 1e-6 rad; `f32` 99.8 to 100 % within 1e-3 rad, 99.4 % for baselines of
/// 0.2 to 1.
///
/// # Cost
/// Two or three steps on a cubic, then a square root, one Newton step and the signs of six distances for each solution.
///
/// # References
/// F. Fraundorfer, P. Tanskanen, M. Pollefeys, "A minimal case solution to the calibrated relative pose problem for the
/// case of two known orientation angles", ECCV 2010. Here the quartic is never formed: it is solved as the
/// intersection of a conic with the unit circle, so that no rotation is at infinity.
///
/// # Examples
/// ```
/// use epipole::geometry::Pose;
/// use epipole::nalgebra::{Point3, Vector3};
/// use epipole::solvers::relpose_upright_3pt;
/// let truth = Pose::new(Vector3::new(0.6, 0.0, 0.8), Vector3::new(0.0, 0.3, 0.0));
/// let x1 = [Vector3::new(1.0, 0.3, 4.0), Vector3::new(-1.0, 0.5, 5.0), Vector3::new(0.2, -1.0, 3.0)];
/// let x2 = x1.map(|x| (truth * Point3::from(x)).coords);
/// let poses = relpose_upright_3pt(&x1, &x2);
/// assert!(poses.iter().any(|pose| (pose.to_homogeneous() - truth.to_homogeneous()).norm() < 1e-9));
/// ```
pub fn relpose_upright_3pt<T: Real>(x1: &[Vector3<T>; 3], x2: &[Vector3<T>; 3]) -> Solutions<Pose<T>, 4> {
    let mut solutions = Solutions::new();

    // 2 det = Re(S2 / e^2) + 2 Im(S1 / e) - S0
    let horizontal = |v: &Vector3<T>| Complex(v.z, v.x);
    let term = |i: usize, j: usize, k: usize| {
        let (a_i, a_j) = (horizontal(&x2[i]).scale(x1[i].y), horizontal(&x2[j]).scale(x1[j].y));
        let (b_i, b_j) = (horizontal(&x1[i]).scale(x2[i].y), horizontal(&x1[j]).scale(x2[j].y));
        let g = horizontal(&x1[k]).conj_mul(horizontal(&x2[k]));
        let constant = a_i.conj_mul(a_j).1 + b_i.conj_mul(b_j).1;
        let linear = a_j.conj_mul(b_i).sub(a_i.conj_mul(b_j));
        let product = g.0 * linear.0 - g.1 * linear.1;
        (linear.conj_mul(g), g.scale(constant), product)
    };
    let (t0, t1, t2) = (term(1, 2, 0), term(2, 0, 1), term(0, 1, 2));
    let s2 = Complex(t0.0.0 + t1.0.0 + t2.0.0, t0.0.1 + t1.0.1 + t2.0.1);
    let s1 = Complex(t0.1.0 + t1.1.0 + t2.1.0, t0.1.1 + t1.1.1 + t2.1.1);
    let s0 = t0.2 + t1.2 + t2.2;
    let size = abs(s2.0) + abs(s2.1) + abs(s1.0) + abs(s1.1) + abs(s0);
    let inverse = T::ONE / size;
    if !(size > T::MIN_POSITIVE && inverse > T::ZERO) {
        return solutions;
    }
    let (s2, s1, s0) = (s2.scale(inverse), s1.scale(inverse), s0 * inverse);

    // The conic minus r times the circle is degenerate.
    let n2 = s2.0 * s2.0 + s2.1 * s2.1;
    let n1 = s1.0 * s1.0 + s1.1 * s1.1;
    let mixed = s2.0 * (s1.0 * s1.0 - s1.1 * s1.1) + T::TWO * s2.1 * s1.0 * s1.1;
    let r = real_root_of_cubic(-s0, n1 - n2, s0 * n2 - mixed);
    let (cc, ss) = (s2.0 - r, -s2.0 - r);
    // The axis with the larger square first, for it is divided by.
    let swapped = abs(ss) > abs(cc);
    let lines = if swapped {
        lines_of_conic(&Matrix3::new(ss, s2.1, -s1.0, s2.1, cc, s1.1, -s1.0, s1.1, r - s0))
    } else {
        lines_of_conic(&Matrix3::new(cc, s2.1, s1.1, s2.1, ss, -s1.0, s1.1, -s1.0, r - s0))
    };
    for line in lines {
        let (l0, l1) = if swapped { (line.y, line.x) } else { (line.x, line.y) };
        let square = l0 * l0 + l1 * l1;
        let off = line.z * line.z;
        let discriminant = square - off;
        // A tangent may miss the circle by rounding.
        let rounding = (square + off) * T::EPSILON * lit::<T>(64.0);
        let root = sqrt(max(discriminant, min(discriminant + rounding, T::ZERO)));
        let inverse = T::ONE / square;
        for root in [root, -root] {
            let c = (-line.z * l0 - l1 * root) * inverse;
            let s = (-line.z * l1 + l0 * root) * inverse;
            // One Newton step on the angle.
            let (cos2, sin2) = (c * c - s * s, T::TWO * c * s);
            let f = s2.0 * cos2 + s2.1 * sin2 + T::TWO * (s1.1 * c - s1.0 * s) - s0;
            let half_slope = s2.1 * cos2 - s2.0 * sin2 - s1.1 * s - s1.0 * c;
            let step = -T::HALF * f / half_slope;
            let step = if abs(step) < lit::<T>(0.1) { step } else { T::ZERO };
            let (c, s) = (c - step * s, s + step * c);
            // A unit vector but for the square of the step: a step of the reciprocal square root.
            let scale = lit::<T>(1.5) - T::HALF * (c * c + s * s);
            if let Some(pose) = pose_of_angle(c * scale, s * scale, x1, x2) {
                solutions.push(pose);
            }
        }
    }
    solutions
}

/// The pose of the rotation by a root of the determinant; `None` where a point is behind a camera.
#[inline]
fn pose_of_angle<T: Real>(c: T, s: T, x1: &[Vector3<T>; 3], x2: &[Vector3<T>; 3]) -> Option<Pose<T>> {
    let turn = |v: &Vector3<T>| Vector3::new(c * v.x + s * v.z, v.y, c * v.z - s * v.x);
    let ([a0, a1, a2], [z0, z1, z2]) = (x1, x2);
    let (y0, y1) = (turn(a0), turn(a1));
    let (n0, n1) = (y0.cross(z0), y1.cross(z1));
    // Of the three planes two make a wide enough angle.
    let wide = |t: &Vector3<T>, n0: &Vector3<T>, n1: &Vector3<T>| {
        t.norm_squared() > lit::<T>(0.05) * n0.norm_squared() * n1.norm_squared()
    };
    let t01 = n0.cross(&n1);
    let t = if wide(&t01, &n0, &n1) {
        in_front(t01, [&y0, z0, &n0], [&y1, z1, &n1], &|| turn(a2), z2)?
    } else {
        let y2 = turn(a2);
        let n2 = y2.cross(z2);
        let t12 = n1.cross(&n2);
        if wide(&t12, &n1, &n2) {
            in_front(t12, [&y1, z1, &n1], [&y2, z2, &n2], &|| y0, z0)?
        } else {
            in_front(n2.cross(&n0), [&y2, z2, &n2], [&y0, z0, &n0], &|| y1, z1)?
        }
    };
    Some(Pose::from_parts(Translation3::from(t), rotation_about_y(c, s)))
}

/// The unit translation `t = +-n0 x n1` that has three points in front, two of them given by the turned first bearing `y`,
/// the second `z` and the normal `n = y x z`.
#[inline]
fn in_front<T: Real>(
    t: Vector3<T>,
    [y0, z0, n0]: [&Vector3<T>; 3],
    [y1, z1, n1]: [&Vector3<T>; 3],
    y2: &impl Fn() -> Vector3<T>,
    z2: &Vector3<T>,
) -> Option<Vector3<T>> {
    // `d1 n = z x t`, `d2 n = y x t`, and z0 x (n0 x n1) = n0 (z0 n1): the signs of the first two points without t
    let (a, b) = (z0.dot(n1), y0.dot(n1));
    let (c, d) = (z1.dot(n0), y1.dot(n0));
    let sign = copysign(T::ONE, a);
    if !((a * sign > T::ZERO) & (b * sign > T::ZERO) & (c * sign < T::ZERO) & (d * sign < T::ZERO)) {
        return None;
    }
    let y2 = y2();
    let n2 = y2.cross(z2);
    let t = t * (sign / sqrt(t.norm_squared()));
    let along = n2.cross(z2);
    let across = n2.cross(&y2);
    ((along.dot(&t) > T::ZERO) & (across.dot(&t) > T::ZERO)).then_some(t)
}

#[derive(Clone, Copy)]
struct Complex<T>(T, T);

impl<T: Real> Complex<T> {
    #[inline]
    fn scale(self, k: T) -> Self {
        Self(self.0 * k, self.1 * k)
    }

    #[inline]
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0, self.1 - other.1)
    }

    /// `conj(self) other`
    #[inline]
    fn conj_mul(self, other: Self) -> Self {
        Self(self.0 * other.0 + self.1 * other.1, self.0 * other.1 - self.1 * other.0)
    }
}
