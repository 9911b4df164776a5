//! The fundamental matrices of seven correspondences.

use nalgebra::{Matrix3, Vector3};

use crate::geometry::{Fundamental, Whitening};
use crate::linalg::{cubic_roots, null_space_refined};
use crate::real::{abs, lit, sqrt};
use crate::{Real, Solutions};

/// The one to three fundamental matrices of seven correspondences: `x2' F x1 = 0`, `det F = 0`.
///
/// The seven equations leave a pencil `a A + b B`; its singular members are the roots of a cubic.
///
/// # Input
/// Homogeneous points of comparable length: bearings, normalised points `(x, y, 1)` or pixels `(u, v, 1)`. They are
/// brought to unit second moments, so that single precision serves pixels too.
///
/// # Returns
/// One, two or three matrices of Frobenius norm 1, in no particular order. Two that coincide to within rounding are
/// returned once or twice.
///
/// # Degeneracies
/// An empty list where the equations are linearly dependent (repeated points, points on one plane, a camera that does
/// not move) or every member of the pencil is singular, to within rounding; where the points of a view lie on a line;
/// and where a coordinate is NaN or infinite.
///
/// # Accuracy
/// The epipolar constraint of the seven points and `det F` to a few `EPSILON`.
///
/// # Cost
/// One 7x9 null space; at most 40 Newton steps, 4 to 6 as a rule.
///
/// # References
/// R. Hartley and A. Zisserman, "Multiple View Geometry in Computer Vision", 2nd edition, 2003, section 11.1.2. The
/// members of the pencil are taken on the projective line, so that no root at infinity is lost.
///
/// # Examples
/// ```
/// use epipole::nalgebra::Vector3;
/// use epipole::solvers::relpose_7pt;
/// // A camera that moves to the right by 1.
/// let x = [(0.1, 0.2, 2.0), (-0.3, 0.1, 5.0), (0.4, -0.2, 3.0), (-0.2, -0.4, 7.0), (0.5, 0.3, 4.0), (0.0, 0.0, 9.0), (0.2, -0.5, 2.5)];
/// let x1 = x.map(|(u, v, _)| Vector3::new(u, v, 1.0));
/// let x2 = x.map(|(u, v, z)| Vector3::new(u - 1.0 / z, v, 1.0));
/// let truth = Vector3::new(-1.0, 0.0, 0.0).cross_matrix() / 2f64.sqrt();
/// let solutions = relpose_7pt(&x1, &x2);
/// assert!(solutions.iter().any(|f| (f.0 - truth).norm() < 1e-12 || (f.0 + truth).norm() < 1e-12));
/// ```
pub fn relpose_7pt<T: Real>(x1: &[Vector3<T>; 7], x2: &[Vector3<T>; 7]) -> Solutions<Fundamental<T>, 3> {
    let mut solutions = Solutions::new();
    let (Some(t1), Some(t2)) = (Whitening::new(x1), Whitening::new(x2)) else { return solutions };
    let mut rows = [[T::ZERO; 9]; 7];
    for ((row, a), b) in rows.iter_mut().zip(x1).zip(x2) {
        let (a, b) = (t1.apply(a), t2.apply(b));
        *row = [
            b.z * a.z,
            b.x * a.z,
            b.y * a.z,
            b.z * a.x,
            b.z * a.y,
            b.x * a.x,
            b.y * a.x,
            b.x * a.y,
            b.y * a.y,
        ];
    }
    let Some([a, b]) = null_space_refined(&rows) else { return solutions };
    let (mut a, mut b) = (matrix(&a), matrix(&b));
    let mut c = determinant_of_pencil(&a, &b);
    // A member far from singular becomes A, so that no root is near infinity. A cubic form that is small at all four
    // of these members is zero.
    let four = lit::<T>(4.0);
    let half_sqrt = lit::<T>(core::f64::consts::FRAC_1_SQRT_2);
    let at_sum = (c[3] + c[2] + c[1] + c[0]) * half_sqrt * T::HALF;
    let at_difference = (c[3] - c[2] + c[1] - c[0]) * half_sqrt * T::HALF;
    if abs(c[3]) * four < abs(at_sum) || abs(c[3]) * four < abs(at_difference) || abs(c[3]) * four < abs(c[0])
    {
        if abs(c[0]) >= abs(at_sum) && abs(c[0]) >= abs(at_difference) {
            (a, b) = (b, a);
            c = [c[3], c[2], c[1], c[0]];
        } else {
            if abs(at_sum) >= abs(at_difference) {
                (a, b) = ((a + b) * half_sqrt, (a - b) * half_sqrt);
            } else {
                (a, b) = ((a - b) * half_sqrt, (a + b) * half_sqrt);
            }
            c = determinant_of_pencil(&a, &b);
        }
    }
    if !(abs(c[3]) > lit::<T>(16.0) * T::EPSILON) {
        return solutions;
    }
    let (t1, t2) = (t1.matrix(), t2.matrix().transpose());
    let (a, b) = (t2 * a * t1, t2 * b * t1);
    for &x in &cubic_roots(&c) {
        let f = a * x + b;
        let norm = sqrt(f.norm_squared());
        if norm > T::ZERO && norm <= T::MAX {
            solutions.push(Fundamental(f / norm));
        }
    }
    solutions
}

fn matrix<T: Real>(columns: &[T; 9]) -> Matrix3<T> {
    let [zz, xz, yz, zx, zy, xx, yx, xy, yy] = *columns;
    Matrix3::new(xx, xy, xz, yx, yy, yz, zx, zy, zz)
}

/// The coefficients of `det(x A + B)`, from the constant term upwards.
#[inline]
fn determinant_of_pencil<T: Real>(a: &Matrix3<T>, b: &Matrix3<T>) -> [T; 4] {
    let [a0, a1, a2] = a.data.0.map(Vector3::from);
    let [b0, b1, b2] = b.data.0.map(Vector3::from);
    let (ca, cb) =
        ([a1.cross(&a2), a2.cross(&a0), a0.cross(&a1)], [b1.cross(&b2), b2.cross(&b0), b0.cross(&b1)]);
    [
        cb[0].dot(&b0),
        cb[0].dot(&a0) + cb[1].dot(&a1) + cb[2].dot(&a2),
        ca[0].dot(&b0) + ca[1].dot(&b1) + ca[2].dot(&b2),
        ca[0].dot(&a0),
    ]
}
