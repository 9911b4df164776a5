//! Relative pose of three correspondences and the vertical.
//!
//! In upright frames `R` turns about y. With `u = z + i x` for the horizontal part of a vector, `R` multiplies `u` by
//! `e = c + i s`. The three epipolar planes' normals `R x1 x x2` are orthogonal to `t`, so their determinant is zero.
//! With `A = y1 u2`, `B = y2 u1`, `G = conj(u1) u2` it is, summed over the cyclic (i, j, k),
//! `Im(G_k / e) Im(conj(A_i - B_i e) (A_j - B_j e))`: a trigonometric polynomial of degree two, that is a conic in
//! (c, s), which meets the circle `c^2 + s^2 = 1` in up to four points. A pair of lines passes through them.

use nalgebra::{Translation3, Vector3};

use crate::geometry::Pose;
use crate::geometry::pose::rotation_about_y;
use crate::linalg::conic::{lines_of_conic, real_root_of_cubic};
use crate::real::{abs, lit, max, sqrt, with_sign_of};
use crate::{Real, Solutions};

/// The up to four relative poses of three correspondences, if both frames have the vertical as their y axis.
///
/// `d2 x2 = d1 R x1 + t` with `d1, d2 > 0`, `R` a rotation about y and |t| = 1.
///
/// # Input
/// `x1`, `x2`: bearings of any length (in `f32` from 0.01 to 100,000), each in a camera frame that has been turned until
/// gravity is along y.
///
/// # Returns
/// Poses of the (turned) frame 2 in the (turned) frame 1 that have all three points in front, in no particular order.
///
/// # Degeneracies
/// Empty for a camera that does not move, for equal bearings, and for input that is not finite. For three points of one
/// horizontal plane through the camera centres any rotation fits, and what is returned is arbitrary.
///
/// # Accuracy
/// Noise-free, depth 2 to 20 or baselines of 0.2 to 1: `f64` 100 % within 1e-6 rad; `f32` 99.98 % within 1e-3 rad, where
/// the rest are roots that all but merge.
///
/// # Cost
/// Two or three steps on a cubic, a square root for each two solutions, two more for each one. Roots that are close
/// together by the measure of the scalar's rounding (one in nine in `f32`, next to none in `f64`) are found, or refined by
/// a Newton step, on the normals themselves.
///
/// # References
/// F. Fraundorfer, P. Tanskanen, M. Pollefeys, "A minimal case solution to the calibrated relative pose problem for the
/// case of two known orientation angles", ECCV 2010. Here the quartic is never formed: it is solved as the
/// intersection of a conic with the unit circle, so that no rotation is at infinity, and the cancellation in its
/// coefficients is repaired where it matters.
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
    solve(x1, x2, &mut solutions);
    solutions
}

/// A function of its own, so that the solutions are written where the caller wants them.
#[inline]
fn solve<T: Real>(x1: &[Vector3<T>; 3], x2: &[Vector3<T>; 3], solutions: &mut Solutions<Pose<T>, 4>) {
    // 2 det = Re(S2 / e^2) + 2 Im(S1 / e) - S0, summed product by product
    let horizontal = |v: &Vector3<T>| Complex(v.z, v.x);
    let term = |i: usize, j: usize, k: usize| {
        let (a_i, a_j) = (horizontal(&x2[i]).scale(x1[i].y), horizontal(&x2[j]).scale(x1[j].y));
        let (b_i, b_j) = (horizontal(&x1[i]).scale(x2[i].y), horizontal(&x1[j]).scale(x2[j].y));
        let g = horizontal(&x1[k]).conj_mul(horizontal(&x2[k]));
        let constant = a_i.conj_mul(a_j).1 + b_i.conj_mul(b_j).1;
        (a_j.conj_mul(b_i).sub(a_i.conj_mul(b_j)), g, constant)
    };
    let ((l0, g0, c0), (l1, g1, c1), (l2, g2, c2)) = (term(1, 2, 0), term(2, 0, 1), term(0, 1, 2));
    let real = l0.0 * g0.0 + l1.0 * g1.0 + l2.0 * g2.0;
    let imaginary = l0.1 * g0.1 + l1.1 * g1.1 + l2.1 * g2.1;
    let mixed = (l0.0 * g0.1 - l0.1 * g0.0) + (l1.0 * g1.1 - l1.1 * g1.0) + (l2.0 * g2.1 - l2.1 * g2.0);
    let s2 = Complex(real + imaginary, mixed);
    let s1 = Complex(c0 * g0.0 + c1 * g1.0 + c2 * g2.0, c0 * g0.1 + c1 * g1.1 + c2 * g2.1);
    let s0 = real - imaginary;
    // Where it is zero or not a number no line below meets the circle.
    let inverse_size = T::ONE / (abs(s2.0) + abs(s2.1) + abs(s1.0) + abs(s1.1) + abs(s0));
    let (s2, s1, s0) = (s2.scale(inverse_size), s1.scale(inverse_size), s0 * inverse_size);

    // The conic minus r times the circle is degenerate.
    let n2 = s2.0 * s2.0 + s2.1 * s2.1;
    let (p, q) = (s1.0 * s1.0, s1.1 * s1.1);
    let product = s1.0 * s1.1;
    let mixed = s2.0 * (p - q) + s2.1 * (product + product);
    let r = real_root_of_cubic(-s0, p + q - n2, s0 * n2 - mixed, lit(1e-4));
    // The axis with the larger square first, for it is divided by.
    let swapped = s2.0 * r > T::ZERO;
    let (first, second, mixed_first, mixed_second) =
        if swapped { (-s2.0 - r, s2.0 - r, -s1.0, s1.1) } else { (s2.0 - r, -s2.0 - r, s1.1, -s1.0) };
    let lines = lines_of_conic([first, s2.1, mixed_first, second, mixed_second, r - s0]);
    let mut candidates = Solutions::<_, 4>::new();
    for line in lines {
        let inverse = T::ONE / (line.x * line.x + line.y * line.y);
        let k = line.z * inverse;
        let (foot_x, foot_y) = (-k * line.x, -k * line.y);
        // The square of half the chord that the circle cuts off.
        let half_sq = T::ONE - k * line.z;
        let mut reach = T::ZERO;
        let pair = if half_sq * half_sq < T::EPSILON * lit(0.0625) {
            let foot = if swapped { (foot_y, foot_x) } else { (foot_x, foot_y) };
            // Half the second derivative at the foot.
            let (product, difference) = (foot.0 * foot.1, foot.0 * foot.0 - foot.1 * foot.1);
            let curvature =
                -(s2.0 * difference + s2.1 * (product + product)) - T::HALF * (s1.1 * foot.0 - s1.0 * foot.1);
            let Some((pair, separation_sq)) = near_double_root(foot, curvature / inverse_size, x1, x2) else {
                continue;
            };
            reach = separation_sq;
            pair
        } else if half_sq > T::ZERO {
            if half_sq < T::EPSILON * lit(1_024.0) {
                reach = half_sq;
            }
            let half = sqrt(half_sq * inverse);
            let (along_x, along_y) = (half * line.y, half * line.x);
            let (u, v) = ((foot_x - along_x, foot_y + along_y), (foot_x + along_x, foot_y - along_y));
            if swapped { [(u.1, u.0), (v.1, v.0)] } else { [u, v] }
        } else {
            continue;
        };
        for root in pair {
            candidates.push((root, reach));
        }
    }
    for &(e, reach) in &candidates {
        // In radians; zero for a root that is well conditioned.
        let step = if reach > T::ZERO { newton(e, (s2, s1), inverse_size, reach, x1, x2) } else { T::ZERO };
        let e = (e.0 - step * e.1, e.1 + step * e.0);
        if !push_pose(e, x1, x2, solutions) {
            push_pose_of_other_points(e, x1, x2, solutions);
        }
    }
}

/// `x` turned about y.
#[inline(always)]
fn turned<T: Real>((c, s): (T, T), x: &Vector3<T>) -> Vector3<T> {
    Vector3::new(c * x.x + s * x.z, x.y, c * x.z - s * x.x)
}

/// A Newton step on the determinant of the small normals themselves, free of the cancellation in the polynomial's
/// coefficients; zero where it is longer than a quarter of `reach`, which is squared.
#[inline]
fn newton<T: Real>(
    e: (T, T),
    (s2, s1): (Complex<T>, Complex<T>),
    scale: T,
    reach: T,
    x1: &[Vector3<T>; 3],
    x2: &[Vector3<T>; 3],
) -> T {
    let (c, s) = e;
    let (product, difference) = (c * s, c * c - s * s);
    let slope = s2.1 * difference - s2.0 * (product + product) - (s1.1 * s + s1.0 * c);
    let ([a0, a1, a2], [z0, z1, z2]) = (x1, x2);
    let (n0, n1, n2) = (turned(e, a0).cross(z0), turned(e, a1).cross(z1), turned(e, a2).cross(z2));
    let step = -(n2.dot(&n0.cross(&n1)) * scale / slope);
    if step * step < reach * lit(0.0625) { step } else { T::ZERO }
}

/// The two roots near `e`, of the determinant's parabola there: value and slope of the small normals themselves, free of
/// the cancellation in the polynomial's coefficients. `None` where they are not real.
#[cold]
fn near_double_root<T: Real>(
    (c, s): (T, T),
    half_curvature: T,
    x1: &[Vector3<T>; 3],
    x2: &[Vector3<T>; 3],
) -> Option<([(T, T); 2], T)> {
    let scale = T::ONE / sqrt(c * c + s * s);
    let (c, s) = (c * scale, s * scale);
    let normal = |x: &Vector3<T>, z: &Vector3<T>| {
        let y = turned((c, s), x);
        // And its derivative by the angle.
        (y.cross(z), Vector3::new(y.x * z.y, -(y.x * z.x + y.z * z.z), y.z * z.y))
    };
    let ([a0, a1, a2], [z0, z1, z2]) = (x1, x2);
    let ((n0, r0), (n1, r1), (n2, r2)) = (normal(a0, z0), normal(a1, z1), normal(a2, z2));
    let t = n0.cross(&n1);
    let inverse = T::HALF / half_curvature;
    let middle = -(r2.dot(&t) + n2.dot(&(r0.cross(&n1) + n0.cross(&r1)))) * inverse;
    let discriminant = middle * middle - T::TWO * n2.dot(&t) * inverse;
    if !(discriminant >= -T::EPSILON) {
        return None;
    }
    let root = sqrt(max(discriminant, T::ZERO));
    let at = |step: T| {
        let (c, s) = (c - step * s, s + step * c);
        let scale = T::ONE / sqrt(c * c + s * s);
        (c * scale, s * scale)
    };
    Some(([at(middle - root), at(middle + root)], discriminant))
}

/// Adds the pose of the rotation by a root of the determinant, its translation from the first two points, unless a point
/// is behind a camera. False where the epipolar planes of those two coincide and say nothing.
#[inline(always)]
fn push_pose<T: Real>(
    e: (T, T),
    x1: &[Vector3<T>; 3],
    x2: &[Vector3<T>; 3],
    solutions: &mut Solutions<Pose<T>, 4>,
) -> bool {
    let [z0, z1, z2] = x2;
    let (y0, y1) = (turned(e, &x1[0]), turned(e, &x1[1]));
    let (n0, n1) = (y0.cross(z0), y1.cross(z1));
    // `d1 n = z x t`, `d2 n = y x t`, and z0 x (n0 x n1) = n0 (z0 n1): the signs of the first two points without t
    let (a0, b0) = (z0.dot(&n1), y0.dot(&n1));
    let (a1, b1) = (z1.dot(&n0), y1.dot(&n0));
    let t = n0.cross(&n1);
    let square = t.norm_squared();
    if !is_wide(square, &n0, &n1) {
        return false;
    }
    if (a0 * b0 > T::ZERO) & (a0 * a1 < T::ZERO) & (a1 * b1 > T::ZERO) {
        let y2 = turned(e, &x1[2]);
        let across = t.cross(&y2.cross(z2));
        if (a0 * across.dot(z2) > T::ZERO) & (a0 * across.dot(&y2) > T::ZERO) {
            // Over the root, without waiting for it.
            let t = t * (with_sign_of(sqrt(square), a0) * (T::ONE / square));
            solutions.push(Pose::from_parts(Translation3::from(t), rotation_about_y(e.0, e.1)));
        }
    }
    true
}

/// The same from the other two pairs of points.
#[cold]
#[inline(never)]
fn push_pose_of_other_points<T: Real>(
    e: (T, T),
    x1: &[Vector3<T>; 3],
    x2: &[Vector3<T>; 3],
    solutions: &mut Solutions<Pose<T>, 4>,
) {
    let ([a0, a1, a2], [b0, b1, b2]) = (*x1, *x2);
    if !push_pose(e, &[a1, a2, a0], &[b1, b2, b0], solutions) {
        push_pose(e, &[a2, a0, a1], &[b2, b0, b1], solutions);
    }
}

/// Whether two planes differ by more than rounding, `square` being that of their normals' cross product.
#[inline(always)]
fn is_wide<T: Real>(square: T, n0: &Vector3<T>, n1: &Vector3<T>) -> bool {
    square > T::EPSILON * lit::<T>(8.0) * (n0.norm_squared() * n1.norm_squared())
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
