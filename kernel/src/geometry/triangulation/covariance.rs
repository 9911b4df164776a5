//! How well a point is determined.

use nalgebra::{Matrix2x3, Matrix3, Vector3};

use super::ViewPair;
use crate::Real;
use crate::geometry::pose::tangent_basis;
use crate::linalg::RowQr;
use crate::real::{abs, is_finite, lit, max, min, sqrt};

/// The 3x3 covariance of a point from the Jacobians of its pixels in every view: `sigma^2 (sum Ji' Ji)^-1`.
///
/// # Input
/// Jacobians of the pixel by the point, as
/// [`reprojection_with_jacobians`](crate::geometry::residual::reprojection_with_jacobians) gives them, and the standard
/// deviation of a pixel coordinate.
///
/// # Returns
/// None where the views do not determine the point to within rounding, or the covariance is not finite.
///
/// # Accuracy
/// By orthogonal factors, not by the sum above: relative error `EPSILON` over the parallax angle.
///
/// # Examples
/// ```
/// use epipole::geometry::triangulation::point_covariance;
/// use epipole::nalgebra::Matrix2x3;
/// let front = Matrix2x3::new(100.0_f64, 0.0, 0.0, 0.0, 100.0, 0.0);
/// let side = Matrix2x3::new(0.0, 0.0, 100.0, 0.0, 100.0, 0.0);
/// let covariance = point_covariance(&[front, side], 0.5).unwrap();
/// assert!((covariance.m11 - 2.5e-5).abs() < 1e-12 && (covariance.m22 - 1.25e-5).abs() < 1e-12);
/// assert!(point_covariance(&[front], 0.5).is_none());
/// ```
#[must_use]
pub fn point_covariance<T: Real>(jacobians: &[Matrix2x3<T>], sigma_px: T) -> Option<Matrix3<T>> {
    let mut qr = RowQr::<T, 3>::new();
    for j in jacobians {
        qr.fold([[j.m11, j.m12, j.m13], [j.m21, j.m22, j.m23]]);
    }
    from_factor(qr.r(), sigma_px)
}

/// `sigma^2 (R'R)^-1` of an upper triangle; none where it is singular to within rounding or the result not finite.
pub(super) fn from_factor<T: Real>(r: &[[T; 3]; 3], sigma: T) -> Option<Matrix3<T>> {
    let [[a, b, c], [_, d, e], [_, _, f]] = *r;
    let largest = max(abs(a), max(abs(d), abs(f)));
    let smallest = min(abs(a), min(abs(d), abs(f)));
    if !(smallest > lit::<T>(16.0) * T::EPSILON * largest) {
        return None;
    }
    let (ia, id, i_f, o) = (sigma / a, sigma / d, sigma / f, T::ZERO);
    let inverse = Matrix3::new(ia, -b / a * id, (b * e / d - c) / a * i_f, o, id, -e / d * i_f, o, o, i_f);
    let covariance = inverse * inverse.transpose();
    covariance.iter().all(|v| is_finite(*v)).then_some(covariance)
}

/// The standard deviation of a point along a unit direction: along the optical axis `(0, 0, 1)` that of its depth,
/// along its bearing that of its distance.
///
/// Zero where rounding makes the variance negative.
#[must_use]
pub fn depth_sigma<T: Real>(covariance: &Matrix3<T>, direction: &Vector3<T>) -> T {
    sqrt(max(direction.dot(&(covariance * direction)), T::ZERO))
}

impl<T: Real> ViewPair<T> {
    /// The 3x3 covariance of a point of the frame of view 1, from independent isotropic noise of the two bearings.
    ///
    /// # Input
    /// `sigma_rad`: the standard deviation of a bearing in each of two directions across, rad; about `sigma_px / f`.
    ///
    /// # Returns
    /// None where the point is at a centre or on the baseline, where the parallax is below rounding, or the covariance
    /// is not finite.
    ///
    /// # Examples
    /// The depth of a stereo pair: `sigma_Z = Z^2 / b * sqrt(2) sigma` for a point straight ahead and far away.
    /// ```
    /// use epipole::geometry::{Pose, triangulation::{ViewPair, depth_sigma}};
    /// use epipole::nalgebra::Vector3;
    /// let stereo = ViewPair::new(&Pose::<f64>::translation(-0.1, 0.0, 0.0));
    /// let covariance = stereo.covariance(&Vector3::new(0.0, 0.0, 5.0), 1e-3).unwrap();
    /// let sigma = depth_sigma(&covariance, &Vector3::z());
    /// assert!((sigma / (25.0 / 0.1 * 2.0_f64.sqrt() * 1e-3) - 1.0).abs() < 1e-3);
    /// ```
    #[must_use]
    pub fn covariance(&self, point: &Vector3<T>, sigma_rad: T) -> Option<Matrix3<T>> {
        let mut qr = RowQr::<T, 3>::new();
        let size = max(abs(point.x), max(abs(point.y), abs(point.z)));
        for centre in [Vector3::zeros(), self.centre] {
            // In units of the point's size, so that squares stay in range.
            let ray = (point - centre) / size;
            let distance = sqrt(ray.norm_squared());
            let b = tangent_basis(&(ray / distance)) / distance;
            qr.fold([[b.m11, b.m21, b.m31], [b.m12, b.m22, b.m32]]);
        }
        let covariance = from_factor(qr.r(), sigma_rad)? * size * size;
        covariance.iter().all(|v| is_finite(*v)).then_some(covariance)
    }
}
