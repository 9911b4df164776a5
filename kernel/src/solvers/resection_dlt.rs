//! Resection: the projection matrix of an uncalibrated camera, and its parts.

use nalgebra::{Matrix3, Matrix3x4, Vector2, Vector3};

use crate::geometry::Pose;
use crate::geometry::pose::{finite, from_parts};
use crate::input::check_finite;
use crate::linalg::RowQr;
use crate::real::{from_u32, is_finite, lit, sqrt};
use crate::{InputError, Real};

/// What a projection matrix is made of: `P ~ K [R | t]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProjectionParts<T: Real> {
    /// The calibration matrix: upper triangular, positive diagonal, last entry 1. The skew is its entry (0, 1).
    pub calibration: Matrix3<T>,
    /// World to camera.
    pub pose: Pose<T>,
}

/// The projection matrix of `N >= 6` points: `x ~ P (X, 1)`, by the direct linear transformation.
///
/// # Input
/// `pixels[i]` shows `points[i]`; any units. No outliers.
///
/// # Returns
/// `P` with the sign that gives points in front positive depth. None where it is not determined.
///
/// # Errors
/// Different lengths, fewer than six, a coordinate that is not finite (array 0 the pixels).
///
/// # Degeneracies
/// None for points on a plane, for a camera centre on a twisted cubic with the points, and for points on both sides of
/// the camera.
///
/// # Accuracy
/// Noise-free: about a hundred roundings.
///
/// # Cost
/// Four passes; an orthogonal factor of twelve columns, never the squares.
///
/// # References
/// R. Hartley, A. Zisserman, "Multiple View Geometry in Computer Vision", 2nd edition, 2004, section 7.1.
///
/// # Examples
/// ```
/// use epipole::nalgebra::{Matrix3, Vector2, Vector3};
/// use epipole::solvers::{decompose_projection, resection_dlt};
/// let k = Matrix3::new(500.0, 0.0, 320.0, 0.0, 510.0, 240.0, 0.0, 0.0, 1.0);
/// let points = core::array::from_fn::<_, 8, _>(|i| {
///     let i = i as f64;
///     Vector3::new((1.7 * i).sin(), (2.3 * i).cos(), 5.0 + (0.9 * i).sin())
/// });
/// let pixels = points.map(|x| k * x).map(|x| Vector2::new(x.x / x.z, x.y / x.z));
/// let p = resection_dlt(&pixels, &points)?.unwrap();
/// let parts = decompose_projection(&p).unwrap();
/// assert!((parts.calibration - k).norm() < 1e-6 && parts.pose.translation.vector.norm() < 1e-8);
/// # Ok::<(), epipole::InputError>(())
/// ```
pub fn resection_dlt<T: Real>(
    pixels: &[Vector2<T>],
    points: &[Vector3<T>],
) -> Result<Option<Matrix3x4<T>>, InputError> {
    if pixels.len() != points.len() {
        return Err(InputError::LengthMismatch { first: pixels.len(), second: points.len() });
    }
    if pixels.len() < 6 {
        return Err(InputError::TooFew { given: pixels.len(), needed: 6 });
    }
    check_finite(pixels, 0)?;
    check_finite(points, 1)?;
    Ok(solve(pixels, points))
}

fn solve<T: Real>(pixels: &[Vector2<T>], points: &[Vector3<T>]) -> Option<Matrix3x4<T>> {
    // About their means, at an RMS distance of sqrt 2 and sqrt 3.
    let share = T::ONE / from_u32(points.len() as u32);
    let (mut mean_x, mut mean_p) = (Vector2::zeros(), Vector3::zeros());
    for (x, p) in pixels.iter().zip(points) {
        mean_x += x * share;
        mean_p += p * share;
    }
    let (mut spread_x, mut spread_p) = (T::ZERO, T::ZERO);
    for (x, p) in pixels.iter().zip(points) {
        spread_x += (x - mean_x).norm_squared() * share;
        spread_p += (p - mean_p).norm_squared() * share;
    }
    let scale_x = sqrt(T::TWO / spread_x);
    let scale_p = sqrt(lit::<T>(3.0) / spread_p);
    let mut factor = RowQr::<T, 12>::new();
    let o = T::ZERO;
    for (x, p) in pixels.iter().zip(points) {
        let (x, p) = ((x - mean_x) * scale_x, (p - mean_p) * scale_p);
        let (u, v) = (x.x, x.y);
        factor.fold([
            [p.x, p.y, p.z, T::ONE, o, o, o, o, -u * p.x, -u * p.y, -u * p.z, -u],
            [o, o, o, o, p.x, p.y, p.z, T::ONE, -v * p.x, -v * p.y, -v * p.z, -v],
        ]);
    }
    let least = factor.least_singular()?;
    let rows = sqrt(from_u32::<T>(points.len() as u32));
    if !(least.next_value > rows * T::EPSILON * lit::<T>(64.0)) || !(least.next_value > least.value * T::TWO)
    {
        return None;
    }
    let v = &least.vector;
    let q = Matrix3x4::new(v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8], v[9], v[10], v[11]);
    // x = T^-1 Q U X with U X = scale_p (X - mean_p), T x = scale_x (x - mean_x)
    let m = q.fixed_columns::<3>(0) * scale_p;
    let last = q.column(3) - m * mean_p;
    let inverse = T::ONE / scale_x;
    let back = Matrix3::new(inverse, o, mean_x.x, o, inverse, mean_x.y, o, o, T::ONE);
    let mut p = Matrix3x4::zeros();
    p.fixed_columns_mut::<3>(0).copy_from(&(back * m));
    p.set_column(3, &(back * last));
    let depth = |x: &Vector3<T>| p[(2, 0)] * x.x + p[(2, 1)] * x.y + p[(2, 2)] * x.z + p[(2, 3)];
    let (mut front, mut behind) = (false, false);
    for x in points {
        let w = depth(x);
        front |= w > T::ZERO;
        behind |= !(w > T::ZERO);
    }
    match (front, behind) {
        (true, false) => Some(p),
        (false, true) => Some(-p),
        _ => None,
    }
}

/// Calibration, rotation and translation of a projection matrix `P ~ K [R | t]`.
///
/// # Input
/// Any scale and sign; the last row's sign says which side of the camera is in front.
///
/// # Returns
/// None where the left 3x3 block is singular (a camera at infinity) or `P` is not finite. A mirrored image (negative
/// determinant of `K R` with points in front) has no rotation: None.
///
/// # Degeneracies
/// A camera nearly at infinity: focal lengths and distance are large and uncertain, their ratio is not.
///
/// # Accuracy
/// A few roundings times the condition of the left block.
///
/// # Cost
/// Three square roots: an RQ factorisation by orthogonalising rows, last row first.
///
/// # References
/// R. Hartley, A. Zisserman, "Multiple View Geometry in Computer Vision", 2nd edition, 2004, section 6.2.4.
///
/// # Examples
/// ```
/// use epipole::nalgebra::Matrix3x4;
/// use epipole::solvers::decompose_projection;
/// let p = Matrix3x4::new(1000.0, 0.0, 640.0, 2.0, 0.0, 1000.0, 480.0, 0.0, 0.0, 0.0, 2.0, 4.0);
/// let parts = decompose_projection(&p).unwrap();
/// assert_eq!((parts.calibration[(0, 0)], parts.calibration[(0, 2)]), (500.0, 320.0));
/// assert_eq!(parts.pose.translation.vector.z, 2.0);
/// ```
#[must_use]
pub fn decompose_projection<T: Real>(p: &Matrix3x4<T>) -> Option<ProjectionParts<T>> {
    let row = |i: usize| Vector3::new(p[(i, 0)], p[(i, 1)], p[(i, 2)]);
    let (m1, m2, m3) = (row(0), row(1), row(2));
    let k33 = sqrt(m3.norm_squared());
    let r3 = m3 * (T::ONE / k33);
    let k23 = m2.dot(&r3);
    let rest2 = m2 - r3 * k23;
    let k22 = sqrt(rest2.norm_squared());
    let r2 = rest2 * (T::ONE / k22);
    let (k13, k12) = (m1.dot(&r3), m1.dot(&r2));
    let rest1 = m1 - r3 * k13 - r2 * k12;
    let r1 = r2.cross(&r3);
    let k11 = rest1.dot(&r1);
    let tiny = T::EPSILON * lit::<T>(8.0);
    let size = sqrt(m1.norm_squared()) + sqrt(m2.norm_squared());
    if !(k33 > T::ZERO && k22 > size * tiny && k11 > size * tiny && size <= T::MAX) {
        return None;
    }
    let inverse = T::ONE / k33;
    let o = T::ZERO;
    let calibration = Matrix3::new(k11, k12, k13, o, k22, k23, o, o, k33) * inverse;
    // K t = p4 by back substitution
    let t3 = p[(2, 3)] * inverse;
    let t2 = (p[(1, 3)] - k23 * t3) / k22;
    let t1 = (p[(0, 3)] - k12 * t2 - k13 * t3) / k11;
    let rotation = Matrix3::from_rows(&[r1.transpose(), r2.transpose(), r3.transpose()]);
    let pose = finite(from_parts(&rotation, &Vector3::new(t1, t2, t3)))?;
    calibration.iter().all(|&x| is_finite(x)).then_some(ProjectionParts { calibration, pose })
}
