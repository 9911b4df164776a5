//! The Kannala-Brandt fisheye: the radius in the image is an odd polynomial of the angle off the axis.

use nalgebra::{Matrix2x3, Matrix3x2, SMatrix, Vector2, Vector3};

use super::{CameraError, CameraModel, Pinhole, UnprojectError, finite, first_root};
use crate::Real;
use crate::real::{abs, atan2, is_finite, lit, max, sin_cos, sqrt};

/// A fisheye camera with coefficients `k1 k2 k3 k4` (equidistant where they are zero).
///
/// With `r = sqrt(X^2 + Y^2)` and the angle off the axis `a = atan2(r, Z)`:
///
/// ```text
/// d = a (1 + k1 a^2 + k2 a^4 + k3 a^6 + k4 a^8)        u = fx d X/r + cx        v = fy d Y/r + cy
/// ```
///
/// The order and the meaning are those of OpenCV's `fisheye`, but points at and beyond 90 degrees (`Z <= 0`) have a
/// pixel too: the domain is `a` up to the first maximum of `d`, and below 180 degrees, where the direction of the
/// pixel is lost.
///
/// # Cost
/// Unprojection is Newton's iteration kept between bounds by bisection, at most 64 evaluations of the polynomial;
/// three or four are usual.
///
/// # References
/// J. Kannala, S. S. Brandt, "A Generic Camera Model and Calibration Method for Conventional, Wide-Angle, and Fish-Eye
/// Lenses", IEEE Transactions on Pattern Analysis and Machine Intelligence 28(8), 2006.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct KannalaBrandt<T: Real> {
    pinhole: Pinhole<T>,
    k: [T; 4],
    /// The angle up to which the distortion is one-to-one, and the distorted angle there.
    max_angle: T,
    max_distorted: T,
}

/// A point in polar form: the unit direction of its pixel from the principal point, its distance, angles and slope.
struct Polar<T: Real> {
    direction: Vector2<T>,
    /// Radius and height of the point divided by its distance, and the inverse of that distance.
    sine: T,
    cosine: T,
    inverse_distance: T,
    angle: T,
    distorted: T,
    slope: T,
}

impl<T: Real> KannalaBrandt<T> {
    /// A camera of this pinhole part and the coefficients `[k1, k2, k3, k4]`.
    ///
    /// # Errors
    /// [`CameraError`] names the first coefficient that is not finite.
    ///
    /// # Examples
    /// ```
    /// use epipole::geometry::{CameraModel, KannalaBrandt, Pinhole};
    /// use epipole::nalgebra::Vector3;
    /// let camera = KannalaBrandt::new(Pinhole::new(190.0, 190.0, 255.0, 257.0)?, [0.0035, 0.0008, -0.002, 0.0002])?;
    /// let sideways = Vector3::new(1.0, 0.0, -0.1_f64); // 95.7 degrees off the axis
    /// let bearing = camera.unproject(&camera.project(&sideways).unwrap()).unwrap();
    /// assert!((bearing - sideways.normalize()).norm() < 1e-12);
    /// # Ok::<(), epipole::geometry::CameraError>(())
    /// ```
    pub fn new(pinhole: Pinhole<T>, k: [T; 4]) -> Result<Self, CameraError> {
        CameraError::check_finite(&["k1", "k2", "k3", "k4"], &k)?;
        let [k1, k2, k3, k4] = k;
        let pi: T = lit(core::f64::consts::PI);
        let slope = [T::ONE, lit::<T>(3.0) * k1, lit::<T>(5.0) * k2, lit::<T>(7.0) * k3, lit::<T>(9.0) * k4];
        let max_angle = first_root(&slope, pi * pi).map_or(pi, |s| sqrt(s));
        let mut camera = Self { pinhole, k, max_angle, max_distorted: T::ZERO };
        camera.max_distorted = camera.distort(max_angle).0;
        Ok(camera)
    }

    /// The focal lengths and the principal point.
    #[must_use]
    pub fn pinhole(&self) -> Pinhole<T> {
        self.pinhole
    }

    /// `[k1, k2, k3, k4]`
    #[must_use]
    pub fn coefficients(&self) -> [T; 4] {
        self.k
    }

    /// The largest angle off the axis that has a pixel, rad.
    #[must_use]
    pub fn max_angle(&self) -> T {
        self.max_angle
    }

    /// The distorted angle and its derivative.
    #[inline]
    fn distort(&self, a: T) -> (T, T) {
        let [k1, k2, k3, k4] = self.k;
        let s = a * a;
        let g = T::ONE + s * (k1 + s * (k2 + s * (k3 + s * k4)));
        let slope = T::ONE
            + s * (lit::<T>(3.0) * k1
                + s * (lit::<T>(5.0) * k2 + s * (lit::<T>(7.0) * k3 + s * lit::<T>(9.0) * k4)));
        (a * g, slope)
    }

    /// The polar form of a point, or none outside the domain.
    fn polar(&self, point: &Vector3<T>) -> Option<Polar<T>> {
        // Scaled to a largest coordinate of 1, so that squares neither overflow nor vanish together.
        let size = max(abs(point.x), max(abs(point.y), abs(point.z)));
        if !(size > T::ZERO && is_finite(point.x) && is_finite(point.y) && is_finite(point.z)) {
            return None;
        }
        let p = point / size;
        let radius = sqrt(p.x * p.x + p.y * p.y);
        let inverse = T::ONE / sqrt(p.norm_squared());
        let angle = atan2(radius, p.z);
        if !(angle <= self.max_angle) || (radius <= T::ZERO && p.z < T::ZERO) {
            return None;
        }
        let (distorted, slope) = self.distort(angle);
        let direction = if radius > T::ZERO {
            Vector2::new(p.x / radius, p.y / radius)
        } else {
            Vector2::new(T::ONE, T::ZERO)
        };
        Some(Polar {
            direction,
            sine: radius * inverse,
            cosine: p.z * inverse,
            inverse_distance: inverse / size,
            angle,
            distorted,
            slope,
        })
    }

    /// The angle off the axis of a distorted angle.
    fn undistort(&self, target: T) -> Result<T, UnprojectError> {
        if !is_finite(target) {
            return Err(UnprojectError::NotFinite);
        }
        if !(target <= self.max_distorted) {
            return Err(UnprojectError::OutsideDomain);
        }
        let (mut low, mut high) = (T::ZERO, self.max_angle);
        let mut a = if target < high { target } else { high * T::HALF };
        for _ in 0..64 {
            let (value, slope) = self.distort(a);
            let residual = target - value;
            if residual > T::ZERO {
                low = a;
            } else {
                high = a;
            }
            let step = residual / slope;
            if abs(step) <= T::TWO * T::EPSILON * a || high - low <= T::EPSILON * a {
                return Ok(a);
            }
            // Not inside the bounds also where the slope vanishes and `step` is not finite.
            let newton = a + step;
            a = if newton > low && newton < high { newton } else { (low + high) * T::HALF };
        }
        Err(UnprojectError::NotConverged)
    }

    /// The Jacobian of the pixel by `(fx, fy, cx, cy, k1, k2, k3, k4)`; none where the point has no pixel.
    #[must_use]
    pub fn intrinsics_jacobian(&self, point: &Vector3<T>) -> Option<SMatrix<T, 2, 8>> {
        self.project(point)?;
        let p = self.polar(point)?;
        let (o, i) = (T::ZERO, T::ONE);
        let s = p.angle * p.angle;
        let a3 = p.angle * s;
        let (u, v) = (self.pinhole.fx() * p.direction.x, self.pinhole.fy() * p.direction.y);
        let powers = [a3, a3 * s, a3 * s * s, a3 * s * s * s];
        let [q1, q2, q3, q4] = powers;
        let (x, y) = (p.distorted * p.direction.x, p.distorted * p.direction.y);
        let j = SMatrix::from([
            [x, o],
            [o, y],
            [i, o],
            [o, i],
            [u * q1, v * q1],
            [u * q2, v * q2],
            [u * q3, v * q3],
            [u * q4, v * q4],
        ]);
        finite(j, j.as_slice())
    }
}

impl<T: Real> CameraModel<T> for KannalaBrandt<T> {
    fn project(&self, point: &Vector3<T>) -> Option<Vector2<T>> {
        let p = self.polar(point)?;
        let pixel = self.pinhole.to_pixel(&(p.direction * p.distorted));
        finite(pixel, pixel.as_slice())
    }

    fn project_with_jacobian(&self, point: &Vector3<T>) -> Option<(Vector2<T>, Matrix2x3<T>)> {
        let p = self.polar(point)?;
        let pixel = self.pinhole.to_pixel(&(p.direction * p.distorted));
        // Along the meridian the angle turns by cos/|X| for a step outward and -sin/|X| for a step forward; across
        // it the pixel turns about the principal point: d/r, whose limit on the axis is 1/Z.
        let (c, s) = (p.direction.x, p.direction.y);
        let outward = p.slope * p.cosine * p.inverse_distance;
        let forward = -p.slope * p.sine * p.inverse_distance;
        let across = if p.sine > T::ZERO { p.distorted / p.sine } else { T::ONE } * p.inverse_distance;
        let jacobian = self.pinhole.scale_rows(&Matrix2x3::new(
            outward * c * c + across * s * s,
            (outward - across) * c * s,
            forward * c,
            (outward - across) * c * s,
            outward * s * s + across * c * c,
            forward * s,
        ));
        finite((pixel, jacobian), pixel.as_slice()).and_then(|both| finite(both, jacobian.as_slice()))
    }

    fn unproject(&self, pixel: &Vector2<T>) -> Result<Vector3<T>, UnprojectError> {
        self.unproject_with_jacobian(pixel).map(|(bearing, _)| bearing)
    }

    fn unproject_with_jacobian(
        &self,
        pixel: &Vector2<T>,
    ) -> Result<(Vector3<T>, Matrix3x2<T>), UnprojectError> {
        let p = self.pinhole.to_plane(pixel);
        let distorted = sqrt(p.norm_squared());
        let angle = self.undistort(distorted)?;
        let (sine, cosine) = sin_cos(angle);
        let (direction, across) = if distorted > T::ZERO {
            (Vector2::new(p.x / distorted, p.y / distorted), sine / distorted)
        } else {
            (Vector2::new(T::ONE, T::ZERO), T::ONE)
        };
        let (c, s) = (direction.x, direction.y);
        let bearing = Vector3::new(sine * c, sine * s, cosine);
        let inverse_slope = T::ONE / self.distort(angle).1;
        let outward = cosine * inverse_slope;
        let forward = -sine * inverse_slope;
        let jacobian = self.pinhole.unscale_columns(&Matrix3x2::new(
            outward * c * c + across * s * s,
            (outward - across) * c * s,
            (outward - across) * c * s,
            outward * s * s + across * c * c,
            forward * c,
            forward * s,
        ));
        finite((bearing, jacobian), jacobian.as_slice()).ok_or(UnprojectError::NotFinite)
    }

    fn focal(&self) -> T {
        self.pinhole.focal()
    }
}
