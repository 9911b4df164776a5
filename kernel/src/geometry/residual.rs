//! How far measurements are from a model: Sampson, symmetric epipolar, homography transfer, reprojection.
//!
//! Every function answers none where the value is not finite (a point mapped to infinity, an epipole), never garbage.

use nalgebra::{Matrix2x3, Matrix2x6, Matrix3, Matrix3x2, SMatrix, Vector2, Vector3};

use super::pose::{rotation_matrix, skew};
use super::{CameraModel, Pose};
use crate::Real;
use crate::real::{is_finite, sqrt};

/// The first-order distance of a correspondence from the epipolar constraint `x2' M x1 = 0`, signed:
///
/// ```text
/// r = x2' M x1 / sqrt(|J1' M' x2|^2 + |J2' M x1|^2)
/// ```
///
/// # Input
/// `M` is an essential or fundamental matrix of any scale. For plane points `x = (x, y, 1)` see [`sampson`]. Here `x`
/// are bearings and `j1`, `j2` their Jacobians by the pixel, from
/// [`unproject_with_jacobian`](CameraModel::unproject_with_jacobian): then `r` is in pixels, for any camera, wherever
/// in the image the point lies.
///
/// # Returns
/// The length of the smallest change of the four pixel coordinates that meets the linearised constraint; none where it
/// is not finite.
///
/// # References
/// M. Terekhov, V. Larsson, "Tangent Sampson Error: Fast Approximate Two-view Reprojection Error for Central Camera
/// Models", ICCV, 2023.
///
/// # Examples
/// ```
/// use epipole::geometry::{CameraModel, Pinhole, residual::{sampson, sampson_bearing}};
/// use epipole::nalgebra::{Matrix3, Vector2};
/// let camera = Pinhole::new(500.0_f64, 500.0, 320.0, 240.0)?;
/// let essential = Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0); // t along x, no rotation
/// let (b1, j1) = camera.unproject_with_jacobian(&Vector2::new(400.0, 300.0)).unwrap();
/// let (b2, j2) = camera.unproject_with_jacobian(&Vector2::new(380.0, 302.0)).unwrap();
/// let r = sampson_bearing(&essential, &b1, &b2, &j1, &j2).unwrap();
/// assert!((r.abs() - 2.0 / 2.0_f64.sqrt()).abs() < 1e-3); // two rows apart, shared by the two images
/// # Ok::<(), epipole::geometry::CameraError>(())
/// ```
#[inline]
#[must_use]
pub fn sampson_bearing<T: Real>(
    m: &Matrix3<T>,
    x1: &Vector3<T>,
    x2: &Vector3<T>,
    j1: &Matrix3x2<T>,
    j2: &Matrix3x2<T>,
) -> Option<T> {
    let line2 = m * x1;
    let gradient1 = (m * j1).tr_mul(x2);
    let gradient2 = j2.tr_mul(&line2);
    over_gradient(x2.dot(&line2), gradient1.norm_squared() + gradient2.norm_squared())
}

/// The Sampson distance of plane points `x = (x, y, 1)`, signed, in their unit:
///
/// ```text
/// r = x2' M x1 / sqrt((M x1)_x^2 + (M x1)_y^2 + (M' x2)_x^2 + (M' x2)_y^2)
/// ```
///
/// # Input
/// Pixels with a fundamental matrix, normalised points with an essential matrix; any scale of the matrix.
///
/// # Returns
/// None where the value is not finite: both points at the epipoles.
///
/// # References
/// P. D. Sampson, "Fitting conic sections to 'very scattered' data", Computer Graphics and Image Processing 18, 1982;
/// Q.-T. Luong, O. Faugeras, "The fundamental matrix", International Journal of Computer Vision 17, 1996.
///
/// # Examples
/// ```
/// use epipole::geometry::residual::sampson;
/// use epipole::nalgebra::{Vector2, Vector3};
/// // A camera that moves to the right: points stay in their row. Half of a row's error falls to either view.
/// let e = Vector3::new(-1.0_f64, 0.0, 0.0).cross_matrix();
/// let r = sampson(&e, &Vector2::new(0.1, 0.2), &Vector2::new(0.0, 0.202)).unwrap();
/// assert!((r.abs() - 0.002 / 2f64.sqrt()).abs() < 1e-15);
/// ```
#[inline]
#[must_use]
pub fn sampson<T: Real>(m: &Matrix3<T>, x1: &Vector2<T>, x2: &Vector2<T>) -> Option<T> {
    let e = Epipolar::new(m, x1, x2);
    over_gradient(e.constraint, e.gradient_sq())
}

/// [`sampson`], and its Jacobian by the entries of `M`, arranged as `M`.
#[must_use]
pub fn sampson_with_jacobian<T: Real>(
    m: &Matrix3<T>,
    x1: &Vector2<T>,
    x2: &Vector2<T>,
) -> Option<(T, Matrix3<T>)> {
    let e = Epipolar::new(m, x1, x2);
    let r = over_gradient(e.constraint, e.gradient_sq())?;
    let inverse = T::ONE / sqrt(e.gradient_sq());
    // r = c / sqrt(d): dr = (dc - r/sqrt(d) dd/2) / sqrt(d)
    let (h1, h2) = (x1.push(T::ONE), x2.push(T::ONE));
    let half_gradient = Vector3::new(e.line2.x, e.line2.y, T::ZERO) * h1.transpose()
        + h2 * Vector3::new(e.line1.x, e.line1.y, T::ZERO).transpose();
    let jacobian = (h2 * h1.transpose() - half_gradient * (r * inverse)) * inverse;
    jacobian.iter().all(|v| is_finite(*v)).then_some((r, jacobian))
}

/// The sum of the squared distances of either point from the epipolar line of the other, in the points' unit squared:
///
/// ```text
/// (x2' M x1)^2 (1 / ((M x1)_x^2 + (M x1)_y^2) + 1 / ((M' x2)_x^2 + (M' x2)_y^2))
/// ```
///
/// Input as of [`sampson`]. None where the value is not finite: a point at its epipole.
///
/// # References
/// Q.-T. Luong, O. Faugeras, "The fundamental matrix", International Journal of Computer Vision 17, 1996.
#[inline]
#[must_use]
pub fn symmetric_epipolar_sq<T: Real>(m: &Matrix3<T>, x1: &Vector2<T>, x2: &Vector2<T>) -> Option<T> {
    let e = Epipolar::new(m, x1, x2);
    let distance = |line: &Vector3<T>| over_gradient(e.constraint, line.x * line.x + line.y * line.y);
    let (d1, d2) = (distance(&e.line1)?, distance(&e.line2)?);
    let sum = d1 * d1 + d2 * d2;
    is_finite(sum).then_some(sum)
}

/// The constraint over the length of its gradient. A gradient whose square overflows must not pass for a residual of 0.
#[inline]
fn over_gradient<T: Real>(constraint: T, gradient_sq: T) -> Option<T> {
    let r = constraint / sqrt(gradient_sq);
    (is_finite(r) && is_finite(gradient_sq)).then_some(r)
}

/// The epipolar lines of a correspondence and the value of the constraint.
struct Epipolar<T: Real> {
    line1: Vector3<T>,
    line2: Vector3<T>,
    constraint: T,
}

impl<T: Real> Epipolar<T> {
    #[inline]
    fn new(m: &Matrix3<T>, x1: &Vector2<T>, x2: &Vector2<T>) -> Self {
        let (h1, h2) = (x1.push(T::ONE), x2.push(T::ONE));
        let line2 = m * h1;
        Self { line1: m.tr_mul(&h2), line2, constraint: h2.dot(&line2) }
    }

    #[inline]
    fn gradient_sq(&self) -> T {
        let (a, b) = (&self.line1, &self.line2);
        a.x * a.x + a.y * a.y + b.x * b.x + b.y * b.y
    }
}

/// The transfer error of a homography, `H x1 - x2` on the plane, in the points' unit.
///
/// # Returns
/// None where the value is not finite: `H` takes `x1` to infinity. The sign of `H` is not known here: a point taken
/// through infinity is not noticed.
///
/// # Examples
/// ```
/// use epipole::geometry::residual::transfer;
/// use epipole::nalgebra::{Matrix3, Vector2};
/// let error = transfer(&Matrix3::identity(), &Vector2::new(1.0_f32, 2.0), &Vector2::new(1.0, 1.5)).unwrap();
/// assert_eq!(error, Vector2::new(0.0, 0.5));
/// ```
#[inline]
#[must_use]
pub fn transfer<T: Real>(h: &Matrix3<T>, x1: &Vector2<T>, x2: &Vector2<T>) -> Option<Vector2<T>> {
    let y = h * x1.push(T::ONE);
    let error = Vector2::new(y.x / y.z, y.y / y.z) - x2;
    (is_finite(error.x) && is_finite(error.y) && is_finite(y.z)).then_some(error)
}

/// [`transfer`], and its Jacobian by the entries of `H`, row by row: `h11 h12 h13 h21 .. h33`.
#[must_use]
pub fn transfer_with_jacobian<T: Real>(
    h: &Matrix3<T>,
    x1: &Vector2<T>,
    x2: &Vector2<T>,
) -> Option<(Vector2<T>, SMatrix<T, 2, 9>)> {
    let error = transfer(h, x1, x2)?;
    let x = x1.push(T::ONE);
    let w = T::ONE / (h * x).z;
    let mapped = error + x2;
    let (a, b, o) = (x * w, x * (-w), Vector3::zeros());
    let row = |first: Vector3<T>, second: Vector3<T>, y: T| {
        let third = b * y;
        SMatrix::<T, 1, 9>::from([
            [first.x],
            [first.y],
            [first.z],
            [second.x],
            [second.y],
            [second.z],
            [third.x],
            [third.y],
            [third.z],
        ])
    };
    let jacobian = SMatrix::<T, 2, 9>::from_rows(&[row(a, o, mapped.x), row(o, a, mapped.y)]);
    jacobian.iter().all(|v| is_finite(*v)).then_some((error, jacobian))
}

/// `|H x1 - x2|^2 + |H^-1 x2 - x1|^2` on the planes, in the points' unit squared; `h_inverse` of any scale, as `h`.
///
/// None where the value is not finite.
#[inline]
#[must_use]
pub fn symmetric_transfer_sq<T: Real>(
    h: &Matrix3<T>,
    h_inverse: &Matrix3<T>,
    x1: &Vector2<T>,
    x2: &Vector2<T>,
) -> Option<T> {
    let sum = transfer(h, x1, x2)?.norm_squared() + transfer(h_inverse, x2, x1)?.norm_squared();
    is_finite(sum).then_some(sum)
}

/// A reprojection residual with its derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reprojection<T: Real> {
    /// Projected minus measured, px.
    pub residual: Vector2<T>,
    /// By the perturbation `(w, dt)` of the pose, `R <- Exp(w) R`, `t <- t + dt`.
    pub by_pose: Matrix2x6<T>,
    /// By the point in the world.
    pub by_point: Matrix2x3<T>,
}

/// The reprojection residual: the pixel of the world point `X`, minus the measured one.
///
/// None where the camera does not see `R X + t`.
#[inline]
#[must_use]
pub fn reprojection<T: Real, C: CameraModel<T> + ?Sized>(
    camera: &C,
    pose: &Pose<T>,
    point: &Vector3<T>,
    pixel: &Vector2<T>,
) -> Option<Vector2<T>> {
    let residual = camera.project(&(pose.rotation * point + pose.translation.vector))? - pixel;
    (is_finite(residual.x) && is_finite(residual.y)).then_some(residual)
}

/// [`reprojection`] with its derivatives by the pose and by the point.
///
/// # Examples
/// ```
/// use epipole::geometry::{Pinhole, Pose, residual::reprojection_with_jacobians};
/// use epipole::nalgebra::{Vector2, Vector3};
/// let camera = Pinhole::new(100.0_f32, 100.0, 0.0, 0.0)?;
/// let (point, pixel) = (Vector3::new(1.0, 0.0, 2.0), Vector2::new(49.0, 0.0));
/// let r = reprojection_with_jacobians(&camera, &Pose::identity(), &point, &pixel).unwrap();
/// assert_eq!((r.residual.x, r.by_pose[(0, 3)], r.by_point[(0, 0)]), (1.0, 50.0, 50.0));
/// # Ok::<(), epipole::geometry::CameraError>(())
/// ```
#[inline]
#[must_use]
pub fn reprojection_with_jacobians<T: Real, C: CameraModel<T> + ?Sized>(
    camera: &C,
    pose: &Pose<T>,
    point: &Vector3<T>,
    pixel: &Vector2<T>,
) -> Option<Reprojection<T>> {
    let rotation = rotation_matrix(&pose.rotation);
    let rotated = rotation * point;
    let (projected, j) = camera.project_with_jacobian(&(rotated + pose.translation.vector))?;
    let residual = projected - pixel;
    let by_rotation = -(j * skew(&rotated));
    let by_point = j * rotation;
    let by_pose = Matrix2x6::new(
        by_rotation.m11,
        by_rotation.m12,
        by_rotation.m13,
        j.m11,
        j.m12,
        j.m13,
        by_rotation.m21,
        by_rotation.m22,
        by_rotation.m23,
        j.m21,
        j.m22,
        j.m23,
    );
    let numbers = residual.iter().chain(by_pose.iter()).chain(by_point.iter());
    let mut finite = true;
    for v in numbers {
        finite &= is_finite(*v);
    }
    finite.then_some(Reprojection { residual, by_pose, by_point })
}
