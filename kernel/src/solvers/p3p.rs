//! P3P: the poses of a calibrated camera that sees three known points.
//!
//! `d_i x_i = R X_i + t` with unit bearings `x_i`. The distances alone satisfy, for each pair,
//! `|d_i x_i - d_j x_j|^2 = |X_i - X_j|^2 =: a_ij`. Two of the three differences that have no constant are conics in
//! (d0, d1, d2); the degenerate conic of their pencil is two lines, on each of which a quadratic remains.

use nalgebra::Vector3;

use crate::geometry::{Pose, pose};
use crate::linalg::conic::{lines_of_conic, real_root_of_cubic};
use crate::real::{abs, lit, max, min, sqrt, with_sign_of};
use crate::{Real, Solutions};

/// Newton steps on the three distances. After a step what remains of a residual is the square of the step.
const MAX_REFINEMENTS: usize = 5;

/// The up to four poses of a camera that sees three known points along given bearings.
///
/// `d_i x_i = R X_i + t` with distances `d_i > 0`, i = 0..2.
///
/// # Input
/// `bearings`: unit vectors in the camera's frame. `points`: the points in the world's frame, in any unit.
///
/// # Returns
/// Poses world to camera, in the unit of the points; 1.7 on average, in no particular order. Empty where there is no
/// real solution or the input is degenerate.
///
/// # Degeneracies
/// Empty for collinear or coinciding points and for input that is not finite. Near the danger cylinder (the circular
/// cylinder through the points, camera centre on it) two solutions merge and lose half their digits. Two equal bearings
/// are admitted: one point hides the other.
///
/// # Accuracy
/// Noise-free, any pose, depth 2 to 20: `f64` 100 % within 1e-6 rad (99th percentile 1e-13); `f32` 99.75 to 100 %
/// within 1e-3 rad, where an exact solver of the rounded input reaches 99.99 %.
///
/// # Cost
/// Two or three steps on a cubic, two quadratics, of which one as a rule has real roots, and for its two candidates side by
/// side one or two Newton steps of at most five.
///
/// # References
/// Y. Ding, J. Yang, V. Larsson, C. Olsson, K. Astrom, "Revisiting the P3P Problem", CVPR 2023. Here the cubic's best
/// conditioned root is found without trigonometry, positions on each line are counted from the foot of a perpendicular,
/// so that no coordinate need be divided by, angles enter as chords, which keeps their digits in `f32`, and the distances
/// are refined on the original equations.
///
/// # Examples
/// ```
/// use epipole::geometry::Pose;
/// use epipole::nalgebra::{Point3, Vector3};
/// use epipole::solvers::p3p;
/// let truth = Pose::new(Vector3::new(0.1, -0.2, 1.0), Vector3::new(0.0, 0.3, 0.1));
/// let points = [Vector3::new(1.0, 0.0, 4.0), Vector3::new(-1.0, 0.5, 5.0), Vector3::new(0.2, -1.0, 3.0)];
/// let bearings = points.map(|p| (truth * Point3::from(p)).coords.normalize());
/// let poses = p3p(&bearings, &points);
/// assert!(poses.iter().any(|pose| (pose.to_homogeneous() - truth.to_homogeneous()).norm() < 1e-9));
/// ```
pub fn p3p<T: Real>(bearings: &[Vector3<T>; 3], points: &[Vector3<T>; 3]) -> Solutions<Pose<T>, 4> {
    let mut solutions = Solutions::new();
    solve(bearings, points, &mut solutions);
    solutions
}

/// A function of its own, so that the solutions are written where the caller wants them.
#[inline]
fn solve<T: Real>(
    bearings: &[Vector3<T>; 3],
    points: &[Vector3<T>; 3],
    solutions: &mut Solutions<Pose<T>, 4>,
) {
    let [x0, x1, x2] = bearings;
    let [p0, p1, p2] = points;
    let (f1, f2) = (p1 - p0, p2 - p0);
    let (a01, a02, a12) = (f1.norm_squared(), f2.norm_squared(), (p2 - p1).norm_squared());

    // 1 - cos of the angle between two bearings: from the chord, it keeps its digits when the angle is small.
    let u01 = (x0 - x1).norm_squared() * T::HALF;
    let u02 = (x0 - x2).norm_squared() * T::HALF;
    let u12 = (x1 - x2).norm_squared() * T::HALF;
    let (m01, m02, m12) = (T::ONE - u01, T::ONE - u02, T::ONE - u12);
    let (s01, s02, s12) = ((T::TWO - u01) * u01, (T::TWO - u02) * u02, (T::TWO - u12) * u12);
    // 2 (m01 m02 m12 - 1)
    let w = T::TWO * ((u01 * u02 - u01 - u02) * m12 - u12);

    // det(D01 + s D02) = k3 s^3 + k2 s^2 + k1 s + k0, D0i the conic of c |d0 x0 - di xi|^2 = a0i |d1 x1 - d2 x2|^2, and the
    // squared sides divided by their sum, so that no power below overflows.
    let total = a01 + a02 + a12;
    let inverse = T::ONE / total;
    let (a, b, c) = (a01 * inverse, a02 * inverse, a12 * inverse);
    let (as12, bs12, cw) = (a * s12, b * s12, c * w);
    let (cs01, cs02) = (c * s01, c * s02);
    let k3 = b * (bs12 - cs02);
    let k2 = (c - a) * cs02 + b * (T::TWO * as12 + bs12 + cw);
    let k1 = (c - b) * cs01 + a * (T::TWO * bs12 + as12 + cw);
    let k0 = a * (as12 - cs01);
    // Of y = 3 k3 s the cubic has no leading coefficient to divide by: a root at infinity (an isosceles triangle seen as
    // one) is no other case.
    let k33 = lit::<T>(3.0) * k3;
    let y = real_root_of_cubic(
        lit::<T>(3.0) * k2,
        k33 * lit::<T>(3.0) * k1,
        k33 * k33 * lit::<T>(3.0) * k0,
        lit(0.01),
    );
    // The pair of lines s1 D01 + s2 D02; what follows takes fourth powers.
    let inverse = T::ONE / k33;
    let (s1, s2) = if abs(y) < lit::<T>(1e3) * abs(k33) { (T::ONE, y * inverse) } else { (k33 / y, T::ONE) };
    let (cs1, cs2) = (c * s1, c * s2);
    let (c01, c02) = (-cs1 * m01, -cs2 * m02);
    let ab = s1 * a + s2 * b;
    let lines = lines_of_conic([cs1 + cs2, c01, c02, cs1 - ab, ab * m12, cs2 - ab]);

    // R maps (f1, f2, f1 x f2) to the same of the camera's points: R = [e1 e2 e1 x e2] [g1 g2 g3]'
    let normal = f1.cross(&f2);
    let area = normal.norm_squared();
    let inverse = T::ONE / area;
    let g3 = normal * inverse;
    let (g1, g2) = (f2.cross(&g3), g3.cross(&f1));
    if !(area > total * total * (T::EPSILON * T::EPSILON * lit::<T>(64.0))) {
        return;
    }

    // The points of the two lines on the conic s2 D01 - s1 D02, the farthest from the pair: n / m, the coordinates along a
    // line of direction (ly, -lx, 0) from its point (fx, fy, fz), are the roots of t2 n^2 + 2 t1 n m + t0 m^2.
    let ba = s2 * a - s1 * b;
    let (q00, q11, q22) = (cs2 - cs1, cs2 - ba, -cs1 - ba);
    let (q01, q02, q12) = (-cs2 * m01, cs1 * m02, ba * m12);
    let [first, second] = lines.map(|line| {
        let (lx, ly) = (line.x, line.y);
        let (fx, fy, fz) = (-line.z * lx, -line.z * ly, lx * lx + ly * ly);
        let (e0, e1, e2) = (q00 * ly - q01 * lx, q01 * ly - q11 * lx, q02 * ly - q12 * lx);
        let t2 = e0 * ly - e1 * lx;
        let t1 = (e0 * fx + e1 * fy) + e2 * fz;
        let half = q01 * fy + q02 * fz;
        let t0 = fx * (q00 * fx + (half + half)) + (fy * (q11 * fy + T::TWO * q12 * fz) + q22 * fz * fz);
        let (square, product) = (t1 * t1, t2 * t0);
        let discriminant = square - product;
        let root = sqrt(max(discriminant, T::ZERO));
        let q = -(t1 + with_sign_of(root, t1));
        // A double root may fall on either side of zero by rounding.
        let rounding = (square + abs(product)) * (T::EPSILON * lit::<T>(64.0));
        let inverse = T::ONE / fz;
        [t2, q, t0, fx * inverse, fy * inverse, lx * inverse, ly * inverse, discriminant + rounding]
    });

    let side = sqrt(a12);
    let heights = Vector3::new(g1.dot(p0), g2.dot(p0), g3.dot(p0));
    let converged = total * T::EPSILON;
    // As a rule one line of the two has real points: chosen by its place in memory, for what a branch would do here cannot be
    // foreseen.
    let [on_first, on_second] = [first, second].map(|[.., real]| real >= T::ZERO);
    let of_lines = [first, second];
    for line in usize::from(!on_first)..1 + usize::from(on_second) {
        let [t2, q, t0, fx, fy, lx, ly, _] = of_lines[line & 1];
        // Both candidates side by side, whether their distances are positive or not.
        let (n, m) = ([q, t0], [t2, q]);
        let mut d = [[T::ZERO; 2]; 3];
        let mut wanted = [false; 2];
        for i in 0..2 {
            let (d0, d1, d2) = (m[i] * fx + n[i] * ly, m[i] * fy - n[i] * lx, m[i]);
            let e12 = d1 - d2;
            let square = e12 * e12 + T::TWO * u12 * (d1 * d2);
            let scale = with_sign_of(sqrt(square) * (side * (T::ONE / square)), d2);
            (d[0][i], d[1][i], d[2][i]) = (d0 * scale, d1 * scale, d2 * scale);
            wanted[i] = (d[0][i] > T::ZERO) & (d[1][i] > T::ZERO);
        }
        let mut found = [false; 2];
        for _ in 0..MAX_REFINEMENTS {
            for i in 0..2 {
                if !cfg!(scalar) || wanted[i] {
                    let at = [d[0][i], d[1][i], d[2][i]];
                    let (to, step_sq) = newton(at, [u01, u02, u12], [a01, a02, a12]);
                    [d[0][i], d[1][i], d[2][i]] = to;
                    found[i] = step_sq < converged;
                }
            }
            if (found[0] | !wanted[0]) & (found[1] | !wanted[1]) {
                break;
            }
        }
        for i in 0..2 {
            let [d0, d1, d2] = [d[0][i], d[1][i], d[2][i]];
            if !(wanted[i] && found[i] && min(min(d0, d1), d2) > T::ZERO) {
                continue;
            }
            let y0 = x0 * d0;
            let (e1, e2) = (x1 * d1 - y0, x2 * d2 - y0);
            let e3 = e1.cross(&e2);
            let rotation = e1 * g1.transpose() + e2 * g2.transpose() + e3 * g3.transpose();
            let translation = y0 - (e1 * heights.x + e2 * heights.y + e3 * heights.z);
            if let Some(pose) = pose::finite(pose::from_parts(&rotation, &translation)) {
                solutions.push(pose);
            }
        }
    }
}

/// Where a Newton step leads from the distances; the square of its length.
#[inline(always)]
fn newton<T: Real>([d0, d1, d2]: [T; 3], [u01, u02, u12]: [T; 3], [a01, a02, a12]: [T; 3]) -> ([T; 3], T) {
    // |d0 x0 - d1 x1|^2 = (d0 - d1)^2 + 2 u01 d0 d1: no cancellation before the difference from a01
    let (e01, e02, e12) = (d0 - d1, d0 - d2, d1 - d2);
    let (v01, v10) = (u01 * d0, u01 * d1);
    let (v02, v20) = (u02 * d0, u02 * d2);
    let (v12, v21) = (u12 * d1, u12 * d2);
    let r01 = (e01 * e01 - a01) * T::HALF + v01 * d1;
    let r02 = (e02 * e02 - a02) * T::HALF + v02 * d2;
    let r12 = (e12 * e12 - a12) * T::HALF + v12 * d2;
    // J = [p q 0; r 0 s; 0 u v] by its adjugate
    let (p, q) = (e01 + v10, v01 - e01);
    let (r, s) = (e02 + v20, v02 - e02);
    let (u, v) = (e12 + v21, v12 - e12);
    let (su, rv) = (s * u, r * v);
    let inverse = T::ONE / (p * su + q * rv);
    let w = v * r02 - s * r12;
    let step0 = (su * r01 + q * w) * inverse;
    let step1 = (rv * r01 - p * w) * inverse;
    let step2 = (u * (p * r02 - r * r01) + q * r * r12) * inverse;
    ([d0 - step0, d1 - step1, d2 - step2], step0 * step0 + step1 * step1 + step2 * step2)
}
