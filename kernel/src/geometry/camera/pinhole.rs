//! The pinhole camera: `u = fx x/z + cx`, `v = fy y/z + cy`.

use nalgebra::{Matrix2x3, Matrix2x4, Matrix3, Matrix3x2, Vector2, Vector3};

use super::{CameraError, CameraModel, UnprojectError, bearing_of_plane_point, finite};
use crate::Real;
use crate::real::is_finite;

/// Focal lengths and principal point in pixels; points in front of the camera, `z > 0`.
///
/// # References
/// R. Hartley, A. Zisserman, "Multiple View Geometry in Computer Vision", 2nd edition, Cambridge University Press,
/// 2003, chapter 6.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pinhole<T: Real> {
    fx: T,
    fy: T,
    cx: T,
    cy: T,
}

impl<T: Real> Pinhole<T> {
    /// A camera of these focal lengths and this principal point, in pixels.
    ///
    /// # Errors
    /// [`CameraError`] names the first parameter that is not finite, or the focal length that is not positive.
    ///
    /// # Examples
    /// ```
    /// use epipole::geometry::{CameraError, Pinhole};
    /// let error = Pinhole::new(500.0_f32, 0.0, 320.0, 240.0).unwrap_err();
    /// assert_eq!(error, CameraError::NotPositive { parameter: "fy" });
    /// ```
    pub fn new(fx: T, fy: T, cx: T, cy: T) -> Result<Self, CameraError> {
        CameraError::check_finite(&["fx", "fy", "cx", "cy"], &[fx, fy, cx, cy])?;
        for (parameter, f) in [("fx", fx), ("fy", fy)] {
            if f <= T::ZERO {
                return Err(CameraError::NotPositive { parameter });
            }
        }
        Ok(Self { fx, fy, cx, cy })
    }

    /// Horizontal focal length, px.
    #[inline]
    #[must_use]
    pub fn fx(&self) -> T {
        self.fx
    }

    /// Vertical focal length, px.
    #[inline]
    #[must_use]
    pub fn fy(&self) -> T {
        self.fy
    }

    /// Principal point, px from the left.
    #[inline]
    #[must_use]
    pub fn cx(&self) -> T {
        self.cx
    }

    /// Principal point, px from the top.
    #[inline]
    #[must_use]
    pub fn cy(&self) -> T {
        self.cy
    }

    /// `K = [fx 0 cx; 0 fy cy; 0 0 1]`: pixels `x ~ K X`.
    #[must_use]
    pub fn matrix(&self) -> Matrix3<T> {
        let (o, i) = (T::ZERO, T::ONE);
        Matrix3::new(self.fx, o, self.cx, o, self.fy, self.cy, o, o, i)
    }

    /// `K^-1`: normalised coordinates of pixels. Not finite for a focal length whose inverse is not.
    #[must_use]
    pub fn inverse_matrix(&self) -> Matrix3<T> {
        let (o, i) = (T::ZERO, T::ONE);
        let (a, b) = (i / self.fx, i / self.fy);
        Matrix3::new(a, o, -self.cx * a, o, b, -self.cy * b, o, o, i)
    }

    /// The pixel of a point of the plane z = 1.
    #[inline]
    pub(super) fn to_pixel(self, p: &Vector2<T>) -> Vector2<T> {
        Vector2::new(self.fx * p.x + self.cx, self.fy * p.y + self.cy)
    }

    /// The point of the plane z = 1 at a pixel.
    #[inline]
    pub(super) fn to_plane(self, pixel: &Vector2<T>) -> Vector2<T> {
        Vector2::new((pixel.x - self.cx) / self.fx, (pixel.y - self.cy) / self.fy)
    }

    /// Rows scaled by the focal lengths: the Jacobian of the pixel from that of the plane point.
    #[inline]
    pub(super) fn scale_rows(self, j: &Matrix2x3<T>) -> Matrix2x3<T> {
        let (a, b) = (self.fx, self.fy);
        Matrix2x3::new(a * j.m11, a * j.m12, a * j.m13, b * j.m21, b * j.m22, b * j.m23)
    }

    /// Columns divided by the focal lengths: the Jacobian by the pixel from that by the plane point.
    #[inline]
    pub(super) fn unscale_columns(self, j: &Matrix3x2<T>) -> Matrix3x2<T> {
        let (a, b) = (T::ONE / self.fx, T::ONE / self.fy);
        Matrix3x2::new(j.m11 * a, j.m12 * b, j.m21 * a, j.m22 * b, j.m31 * a, j.m32 * b)
    }

    /// The Jacobian of the pixel by `(fx, fy, cx, cy)`; none where the point has no pixel.
    #[must_use]
    pub fn intrinsics_jacobian(&self, point: &Vector3<T>) -> Option<Matrix2x4<T>> {
        self.project(point)?;
        let (p, _) = plane_point(point)?;
        let (o, i) = (T::ZERO, T::ONE);
        let j = Matrix2x4::new(p.x, o, i, o, o, p.y, o, i);
        finite(j, j.as_slice())
    }
}

/// The point of the plane z = 1 and 1/z; none behind the camera. One division: it is the slowest operation of a small
/// core.
#[inline]
pub(super) fn plane_point<T: Real>(point: &Vector3<T>) -> Option<(Vector2<T>, T)> {
    // Also false for NaN and infinity.
    if !(point.z > T::ZERO && point.z <= T::MAX) {
        return None;
    }
    let w = T::ONE / point.z;
    Some((Vector2::new(point.x * w, point.y * w), w))
}

/// The Jacobian of the point `p` of the plane z = 1 by the point in space, `w = 1/z`.
#[inline]
pub(super) fn plane_jacobian<T: Real>(p: &Vector2<T>, w: T) -> Matrix2x3<T> {
    Matrix2x3::new(w, T::ZERO, -p.x * w, T::ZERO, w, -p.y * w)
}

impl<T: Real> CameraModel<T> for Pinhole<T> {
    #[inline]
    fn project(&self, point: &Vector3<T>) -> Option<Vector2<T>> {
        let (p, _) = plane_point(point)?;
        let pixel = self.to_pixel(&p);
        finite(pixel, pixel.as_slice())
    }

    #[inline]
    fn project_with_jacobian(&self, point: &Vector3<T>) -> Option<(Vector2<T>, Matrix2x3<T>)> {
        let (p, w) = plane_point(point)?;
        let pixel = self.to_pixel(&p);
        let jacobian = self.scale_rows(&plane_jacobian(&p, w));
        finite(pixel, pixel.as_slice())?;
        finite((pixel, jacobian), jacobian.as_slice())
    }

    #[cfg_attr(not(small), inline)]
    #[cfg_attr(small, inline(never))]
    fn unproject(&self, pixel: &Vector2<T>) -> Result<Vector3<T>, UnprojectError> {
        let p = self.to_plane(pixel);
        // The square of the distance must not overflow, or the bearing would be (0, 0, 0).
        if is_finite(p.norm_squared()) {
            Ok(bearing_of_plane_point(&p).0)
        } else {
            Err(UnprojectError::NotFinite)
        }
    }

    #[inline]
    fn unproject_with_jacobian(
        &self,
        pixel: &Vector2<T>,
    ) -> Result<(Vector3<T>, Matrix3x2<T>), UnprojectError> {
        let p = self.to_plane(pixel);
        if !is_finite(p.norm_squared()) {
            return Err(UnprojectError::NotFinite);
        }
        let (bearing, jacobian) = bearing_of_plane_point(&p);
        let jacobian = self.unscale_columns(&jacobian);
        finite((bearing, jacobian), jacobian.as_slice()).ok_or(UnprojectError::NotFinite)
    }

    fn focal(&self) -> T {
        self.fx * T::HALF + self.fy * T::HALF
    }

    fn rectilinear(&self) -> Option<(T, T)> {
        Some((self.fx, self.fy))
    }
}
