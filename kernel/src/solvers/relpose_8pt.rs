//! The essential or fundamental matrix of eight and more correspondences, by a linear system.

use nalgebra::{Matrix3, Vector3};

use crate::geometry::{Essential, Fundamental, Whitening};
use crate::input::{check_lengths, no_solution};
use crate::linalg::{Elimination, RowQr, pieces};
use crate::real::{abs, lit, max, sqrt};
use crate::{InputError, Real};

/// Rows that one set of reflections folds into the triangular factor.
const BLOCK: usize = 10;

/// The essential matrix of eight or more correspondences: `E` minimises `sum (x2' E x1)^2` in whitened coordinates and
/// is then moved to the nearest essential matrix.
///
/// # Input
/// Bearings, or normalised points `(x, y, 1)`, of comparable length; as many in view 2 as in view 1. Any field of view:
/// the points are brought to unit second moments, which makes the estimate independent of the frame.
///
/// # Returns
/// `E` of Frobenius norm 1 and arbitrary sign; `None` in the degenerate cases.
///
/// # Errors
/// [`InputError::LengthMismatch`], [`InputError::TooFew`] (below 8), [`InputError::NotFinite`].
///
/// # Degeneracies
/// `None` where the equations have rank below 8 to within rounding: a camera that does not move or rotates only, points
/// on one plane, on a line, or repeated. With noise these cases give a matrix without meaning.
///
/// # Accuracy
/// Never through `A'A`. 8 exact points rounded to `f32`: the distance of the unit-norm `E` from what `f64` gives for the
/// same points has a 99th percentile of 4e-6; that which rounding the points makes, 1.2e-4. `f64`: rotation within 1e-14
/// rad in the median.
///
/// # Cost
/// 8 points: elimination and a step of refinement, about 2000 operations in all. N points: 330 N operations and up to
/// 24 inverse iterations, of which 2 to 6 are usual.
///
/// # References
/// H. C. Longuet-Higgins, "A computer algorithm for reconstructing a scene from two projections", Nature, 1981;
/// R. I. Hartley, "In defense of the eight-point algorithm", IEEE Transactions on Pattern Analysis and Machine
/// Intelligence, 1997.
///
/// # Examples
/// ```
/// use epipole::geometry::{Essential, Pose};
/// use epipole::nalgebra::{Point3, UnitQuaternion, Vector3};
/// use epipole::solvers::relpose_8pt;
/// let pose = Pose::from_parts(Vector3::new(1.0, 0.2, -0.3).into(), UnitQuaternion::from_euler_angles(0.1, -0.2, 0.05));
/// let points = [(1, 2, 9), (-3, 1, 7), (2, -2, 5), (-1, -1, 6), (3, 1, 8), (0, 3, 10), (-2, 2, 4), (1, -3, 11)];
/// let points = points.map(|(x, y, z)| Point3::new(x as f64, y as f64, z as f64));
/// let x1 = points.map(|p| p.coords.normalize());
/// let x2 = points.map(|p| (pose * p).coords.normalize());
/// let e = relpose_8pt(&x1, &x2).unwrap().unwrap().0;
/// let truth = Essential::from_pose(&pose).0.normalize();
/// assert!((e - truth).norm() < 1e-12 || (e + truth).norm() < 1e-12);
/// ```
pub fn relpose_8pt<T: Real>(
    x1: &[Vector3<T>],
    x2: &[Vector3<T>],
) -> Result<Option<Essential<T>>, InputError> {
    check_lengths(x1, x2, 8)?;
    let estimate =
        linear_estimate(x1, x2).and_then(|(f, t1, t2)| Essential(unwhitened(&f, &t1, &t2)).nearest());
    match estimate {
        Some(Essential(e)) => Ok(unit(&e).map(Essential)),
        None => no_solution(x1, x2),
    }
}

/// The fundamental matrix of eight or more correspondences: `F` minimises `sum (x2' F x1)^2` in whitened coordinates,
/// where it is then moved to the nearest matrix of rank 2.
///
/// # Input
/// Homogeneous points of comparable length, such as pixels `(u, v, 1)`; as many in view 2 as in view 1. The estimate
/// does not depend on the unit or the origin of the coordinates.
///
/// # Returns
/// `F` of Frobenius norm 1 and arbitrary sign; `None` in the degenerate cases.
///
/// # Errors
/// As [`relpose_8pt`].
///
/// # Degeneracies
/// As [`relpose_8pt`].
///
/// # Accuracy
/// As [`relpose_8pt`], in whitened coordinates, for points no farther from the origin than some ten times their spread;
/// beyond that `f32` loses digits by the square of the ratio.
///
/// # Cost
/// As [`relpose_8pt`].
///
/// # References
/// R. I. Hartley, "In defense of the eight-point algorithm", IEEE Transactions on Pattern Analysis and Machine
/// Intelligence, 1997.
///
/// # Examples
/// ```
/// use epipole::nalgebra::Vector3;
/// use epipole::solvers::fundamental_8pt;
/// // A camera with f = 500 that moves to the right by 1.
/// let x = [(10, 20, 2), (-30, 10, 5), (40, -20, 3), (-20, -40, 7), (50, 30, 4), (0, 0, 9), (20, -50, 6), (-9, 35, 8)];
/// let x = x.map(|(u, v, z)| (u as f64, v as f64, z as f64));
/// let x1 = x.map(|(u, v, _)| Vector3::new(u, v, 1.0));
/// let x2 = x.map(|(u, v, z)| Vector3::new(u - 500.0 / z, v, 1.0));
/// let f = fundamental_8pt(&x1, &x2).unwrap().unwrap().0;
/// let truth = Vector3::new(1.0, 0.0, 0.0).cross_matrix() / 2f64.sqrt();
/// assert!((f - truth).norm() < 1e-11 || (f + truth).norm() < 1e-11);
/// ```
pub fn fundamental_8pt<T: Real>(
    x1: &[Vector3<T>],
    x2: &[Vector3<T>],
) -> Result<Option<Fundamental<T>>, InputError> {
    check_lengths(x1, x2, 8)?;
    let estimate = linear_estimate(x1, x2).and_then(|(f, t1, t2)| {
        let f = Fundamental(f).nearest()?.0;
        unit(&unwhitened(&f, &t1, &t2))
    });
    match estimate {
        Some(f) => Ok(Some(Fundamental(f))),
        None => no_solution(x1, x2),
    }
}

/// The solution of the whitened equations as a matrix, and the two maps.
#[inline]
fn linear_estimate<T: Real>(
    x1: &[Vector3<T>],
    x2: &[Vector3<T>],
) -> Option<(Matrix3<T>, Whitening<T>, Whitening<T>)> {
    let (t1, t2) = (Whitening::new(x1)?, Whitening::new(x2)?);
    let f = match (x1.try_into(), x2.try_into()) {
        (Ok(x1), Ok(x2)) => of_eight(x1, x2, &t1, &t2)?,
        _ => of_many(x1, x2, &t1, &t2)?,
    };
    Some((f, t1, t2))
}

/// By the singular vector that the equations least stretch.
#[inline]
fn of_many<T: Real>(
    x1: &[Vector3<T>],
    x2: &[Vector3<T>],
    t1: &Whitening<T>,
    t2: &Whitening<T>,
) -> Option<Matrix3<T>> {
    let mut qr = RowQr::new();
    for (a, b) in pieces::<_, BLOCK>(x1).zip(pieces::<_, BLOCK>(x2)) {
        let mut rows = [[T::ZERO; 9]; BLOCK];
        for ((row, a), b) in rows.iter_mut().zip(a).zip(b) {
            *row = equation(&t1.apply(a), &t2.apply(b));
        }
        qr.fold(rows);
    }
    let least = qr.least_singular()?;
    // Of norm 1, the whitened equations have singular values up to 1.
    (least.next_value > lit::<T>(16.0) * T::EPSILON).then(|| matrix(&least.vector))
}

/// By elimination. One step of refinement, on what the points as they are leave of their equations, takes out what
/// rounding has done since: in the whitened coordinates, too.
#[inline]
fn of_eight<T: Real>(
    x1: &[Vector3<T>; 8],
    x2: &[Vector3<T>; 8],
    t1: &Whitening<T>,
    t2: &Whitening<T>,
) -> Option<Matrix3<T>> {
    let mut equations = Elimination::new();
    for k in 0..8 {
        let row = equation(&t1.apply(&x1[k]), &t2.apply(&x2[k]));
        for (column, element) in equations.columns.iter_mut().zip(row) {
            column[k] = element;
        }
    }
    // Rows of equal lengths would be of norm 3/8; of degenerate points rounding leaves less than this in all but one in
    // 1,000.
    if !equations.factor(lit::<T>(16.0) * T::EPSILON) {
        return None;
    }
    let f = matrix(&equations.null_vector());
    let left = residuals(&unwhitened(&f, t1, t2), x1, x2);
    Some(f - matrix(&equations.solve(left)))
}

/// `x2' M x1` of each correspondence, to seven binary digits more than a plain sum of products has.
///
/// Each factor is split into its first digits, seven counted from the sum of the sizes of its kind, and the rest. The
/// products of the former and their sums have no rounding error unless one point is larger than all others together;
/// those with a rest are smaller by seven digits.
#[inline]
fn residuals<T: Real>(m: &Matrix3<T>, x1: &[Vector3<T>; 8], x2: &[Vector3<T>; 8]) -> [T; 8] {
    // A sum with a number so much larger keeps the seven digits.
    let larger = T::ONE / (lit::<T>(128.0) * T::EPSILON);
    let first = |v: T, large: T| (v + large) - large;
    let sizes = |x: &[Vector3<T>; 8]| x.iter().fold(Vector3::repeat(T::ZERO), |s, x| s + x.map(abs)) * larger;
    let (s1, s2) = (sizes(x1), sizes(x2));
    let products = s2 * s1.transpose();
    let largest = m.zip_fold(&products, T::ZERO, |l, m, s| max(l, abs(m) * s)) * larger;
    let m_first = m.zip_map(&products, |m, s| first(m, largest / s));
    let m_rest = m - m_first;
    let mut result = [T::ZERO; 8];
    for k in 0..8 {
        let (a, b) = (x1[k], x2[k]);
        let (a_first, b_first) = (a.zip_map(&s1, first), b.zip_map(&s2, first));
        let y_first = m_first * a_first;
        let y_rest = m_first * (a - a_first) + m_rest * a;
        let rest = b_first.dot(&y_rest) + (b - b_first).dot(&(y_first + y_rest));
        result[k] = b_first.dot(&y_first) + rest;
    }
    result
}

/// The matrix for the points themselves: `T2' M T1`.
#[inline]
fn unwhitened<T: Real>(m: &Matrix3<T>, t1: &Whitening<T>, t2: &Whitening<T>) -> Matrix3<T> {
    t2.matrix().transpose() * m * t1.matrix()
}

/// The equation of a correspondence: what multiplies the elements that [`matrix`] puts in their places.
#[inline]
fn equation<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> [T; 9] {
    [b.z * a.z, b.x * a.z, b.y * a.z, b.z * a.x, b.z * a.y, b.x * a.x, b.y * a.x, b.x * a.y, b.y * a.y]
}

#[inline]
fn matrix<T: Real>(&[zz, xz, yz, zx, zy, xx, yx, xy, yy]: &[T; 9]) -> Matrix3<T> {
    Matrix3::new(xx, xy, xz, yx, yy, yz, zx, zy, zz)
}

/// The matrix scaled to Frobenius norm 1.
#[inline]
fn unit<T: Real>(m: &Matrix3<T>) -> Option<Matrix3<T>> {
    let norm = sqrt(m.norm_squared());
    (norm > T::ZERO && norm <= T::MAX).then(|| m / norm)
}
