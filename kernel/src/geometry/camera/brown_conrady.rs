//! The Brown-Conrady lens: radial polynomial and tangential (decentring) distortion of the plane z = 1.

use nalgebra::{Matrix2, Matrix2x3, Matrix3x2, SMatrix, Vector2, Vector3};

use super::pinhole::{plane_jacobian, plane_point};
use super::{CameraError, CameraModel, Pinhole, UnprojectError, bearing_of_plane_point, finite, first_root};
use crate::Real;
use crate::real::{is_finite, lit, sqrt};

/// A pinhole camera behind a lens with distortion `k1 k2 p1 p2 k3`.
///
/// With `x = X/Z, y = Y/Z, s = x^2 + y^2` and `g = 1 + k1 s + k2 s^2 + k3 s^3`:
///
/// ```text
/// xd = x g + 2 p1 x y + p2 (s + 2 x^2)        u = fx xd + cx
/// yd = y g + p1 (s + 2 y^2) + 2 p2 x y        v = fy yd + cy
/// ```
///
/// The order and the meaning are OpenCV's. The domain is `Z > 0` and `s` up to the first maximum of `sqrt(s) g`, where
/// the image folds back on itself, and no more than 10^4 (89.4 degrees off the axis): a point beyond has no pixel.
///
/// # Cost
/// Unprojection is Newton's iteration with step halving, at most 32 evaluations of the distortion; three or four are
/// usual.
///
/// # References
/// D. C. Brown, "Decentering Distortion of Lenses", Photogrammetric Engineering 32(3), 1966.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BrownConrady<T: Real> {
    pinhole: Pinhole<T>,
    k: [T; 3],
    p: [T; 2],
    /// The square of the largest undistorted radius at which the radial distortion is still one-to-one.
    max_radius_sq: T,
    /// No point of the domain is distorted to a larger radius.
    max_distorted: T,
}

/// A distorted plane point with its Jacobian by the undistorted one.
struct Distorted<T: Real> {
    point: Vector2<T>,
    jacobian: Matrix2<T>,
}

impl<T: Real> BrownConrady<T> {
    /// A camera of this pinhole part and the distortion `[k1, k2, p1, p2, k3]`.
    ///
    /// # Errors
    /// [`CameraError`] names the first coefficient that is not finite.
    ///
    /// # Examples
    /// ```
    /// use epipole::geometry::{BrownConrady, CameraModel, Pinhole};
    /// use epipole::nalgebra::Vector3;
    /// let pinhole = Pinhole::new(458.654, 457.296, 367.215, 248.375)?;
    /// let camera = BrownConrady::new(pinhole, [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0.0])?;
    /// let point = Vector3::new(0.5, -0.25, 2.0_f64);
    /// let bearing = camera.unproject(&camera.project(&point).unwrap()).unwrap();
    /// assert!((bearing - point.normalize()).norm() < 1e-12);
    /// # Ok::<(), epipole::geometry::CameraError>(())
    /// ```
    pub fn new(pinhole: Pinhole<T>, distortion: [T; 5]) -> Result<Self, CameraError> {
        CameraError::check_finite(&["k1", "k2", "p1", "p2", "k3"], &distortion)?;
        let [k1, k2, p1, p2, k3] = distortion;
        let slope = [T::ONE, lit::<T>(3.0) * k1, lit::<T>(5.0) * k2, lit::<T>(7.0) * k3, T::ZERO];
        let end: T = lit(1e4);
        let max_radius_sq = first_root(&slope, end).unwrap_or(end);
        let mut camera = Self { pinhole, k: [k1, k2, k3], p: [p1, p2], max_radius_sq, max_distorted: T::MAX };
        // Decentring moves a point by at most 3 s |p|.
        let radial = sqrt(max_radius_sq) * camera.radial(max_radius_sq);
        let reach = radial + lit::<T>(3.0) * max_radius_sq * sqrt(p1 * p1 + p2 * p2);
        if is_finite(reach) {
            camera.max_distorted = reach * (T::ONE + lit::<T>(64.0) * T::EPSILON);
        }
        Ok(camera)
    }

    /// The focal lengths and the principal point.
    #[must_use]
    pub fn pinhole(&self) -> Pinhole<T> {
        self.pinhole
    }

    /// `[k1, k2, p1, p2, k3]`
    #[must_use]
    pub fn distortion(&self) -> [T; 5] {
        let ([k1, k2, k3], [p1, p2]) = (self.k, self.p);
        [k1, k2, p1, p2, k3]
    }

    /// The largest undistorted radius `sqrt(x^2 + y^2)` on the plane z = 1 that has a pixel.
    #[must_use]
    pub fn max_radius(&self) -> T {
        sqrt(self.max_radius_sq)
    }

    #[inline]
    fn radial(&self, s: T) -> T {
        let [k1, k2, k3] = self.k;
        T::ONE + s * (k1 + s * (k2 + s * k3))
    }

    /// The distorted point, or none outside the domain.
    #[inline]
    fn distort(&self, x: &Vector2<T>) -> Option<Vector2<T>> {
        let s = x.norm_squared();
        // A negated comparison would let NaN through.
        if !(s <= self.max_radius_sq) {
            return None;
        }
        let [p1, p2] = self.p;
        let along = T::TWO * (p1 * x.y + p2 * x.x);
        let g = self.radial(s) + along;
        Some(Vector2::new(x.x * g + p2 * s, x.y * g + p1 * s))
    }

    /// [`distort`](Self::distort) with its Jacobian.
    #[inline]
    fn distort_with_jacobian(&self, x: &Vector2<T>) -> Option<Distorted<T>> {
        let point = self.distort(x)?;
        let s = x.norm_squared();
        let ([k1, k2, k3], [p1, p2]) = (self.k, self.p);
        let along = T::TWO * (p1 * x.y + p2 * x.x);
        let g = self.radial(s) + along;
        let dg = T::TWO * (k1 + s * (T::TWO * k2 + s * lit::<T>(3.0) * k3));
        let gx = dg * x.x + T::TWO * p2;
        let gy = dg * x.y + T::TWO * p1;
        let jacobian = Matrix2::new(
            g + x.x * gx + T::TWO * p2 * x.x,
            x.x * gy + T::TWO * p2 * x.y,
            x.y * gx + T::TWO * p1 * x.x,
            g + x.y * gy + T::TWO * p1 * x.y,
        );
        Some(Distorted { point, jacobian })
    }

    /// The undistorted point with the inverse of the distortion's Jacobian there.
    fn undistort(&self, target: &Vector2<T>) -> Result<(Vector2<T>, Matrix2<T>), UnprojectError> {
        let length_sq = target.norm_squared();
        if !is_finite(length_sq) {
            return Err(UnprojectError::NotFinite);
        }
        if length_sq > self.max_distorted * self.max_distorted {
            return Err(UnprojectError::OutsideDomain);
        }
        let tolerance = lit::<T>(64.0) * T::EPSILON;
        let tolerance_sq = tolerance * tolerance * (T::ONE + length_sq);
        // `best` is inside the domain with the smallest residual so far, from which `step` leads to the next trial.
        let (mut best, mut inverse) = (Vector2::zeros(), Matrix2::identity());
        let (mut step, mut best_sq) = (*target, T::MAX);
        for _ in 0..32 {
            let trial = best + step;
            let evaluated = self.distort_with_jacobian(&trial).and_then(|d| {
                let det = d.jacobian.m11 * d.jacobian.m22 - d.jacobian.m12 * d.jacobian.m21;
                let residual = target - d.point;
                let square = residual.norm_squared();
                (det > T::ZERO && square < best_sq).then_some((d.jacobian, det, residual, square))
            });
            let Some((j, det, residual, square)) = evaluated else {
                if best_sq <= tolerance_sq {
                    break;
                }
                step *= T::HALF;
                continue;
            };
            (best, best_sq) = (trial, square);
            inverse = Matrix2::new(j.m22 / det, -j.m12 / det, -j.m21 / det, j.m11 / det);
            step = inverse * residual;
            if step.norm_squared() <= T::EPSILON * T::EPSILON * (T::ONE + best.norm_squared()) {
                break;
            }
        }
        if best_sq <= tolerance_sq { Ok((best, inverse)) } else { Err(UnprojectError::NotConverged) }
    }

    /// The Jacobian of the pixel by `(fx, fy, cx, cy, k1, k2, p1, p2, k3)`; none where the point has no pixel.
    #[must_use]
    pub fn intrinsics_jacobian(&self, point: &Vector3<T>) -> Option<SMatrix<T, 2, 9>> {
        self.project(point)?;
        let (x, _) = plane_point(point)?;
        let d = self.distort(&x)?;
        let (s, o, i) = (x.norm_squared(), T::ZERO, T::ONE);
        let (fx, fy) = (self.pinhole.fx(), self.pinhole.fy());
        let (u, v) = (fx * x.x, fy * x.y);
        let xy = T::TWO * x.x * x.y;
        let j = SMatrix::from([
            [d.x, o],
            [o, d.y],
            [i, o],
            [o, i],
            [u * s, v * s],
            [u * s * s, v * s * s],
            [fx * xy, fy * (s + T::TWO * x.y * x.y)],
            [fx * (s + T::TWO * x.x * x.x), fy * xy],
            [u * s * s * s, v * s * s * s],
        ]);
        finite(j, j.as_slice())
    }
}

impl<T: Real> CameraModel<T> for BrownConrady<T> {
    #[inline]
    fn project(&self, point: &Vector3<T>) -> Option<Vector2<T>> {
        let (x, _) = plane_point(point)?;
        let pixel = self.pinhole.to_pixel(&self.distort(&x)?);
        finite(pixel, pixel.as_slice())
    }

    #[inline]
    fn project_with_jacobian(&self, point: &Vector3<T>) -> Option<(Vector2<T>, Matrix2x3<T>)> {
        let (x, w) = plane_point(point)?;
        let d = self.distort_with_jacobian(&x)?;
        let pixel = self.pinhole.to_pixel(&d.point);
        let jacobian = self.pinhole.scale_rows(&(d.jacobian * plane_jacobian(&x, w)));
        finite(pixel, pixel.as_slice())?;
        finite((pixel, jacobian), jacobian.as_slice())
    }

    #[inline]
    fn unproject(&self, pixel: &Vector2<T>) -> Result<Vector3<T>, UnprojectError> {
        self.unproject_with_jacobian(pixel).map(|(bearing, _)| bearing)
    }

    fn unproject_with_jacobian(
        &self,
        pixel: &Vector2<T>,
    ) -> Result<(Vector3<T>, Matrix3x2<T>), UnprojectError> {
        let (x, inverse) = self.undistort(&self.pinhole.to_plane(pixel))?;
        let (bearing, by_plane) = bearing_of_plane_point(&x);
        let jacobian = self.pinhole.unscale_columns(&(by_plane * inverse));
        finite((bearing, jacobian), jacobian.as_slice()).ok_or(UnprojectError::NotFinite)
    }

    fn focal(&self) -> T {
        self.pinhole.focal()
    }

    fn rectilinear(&self) -> Option<(T, T)> {
        self.pinhole.rectilinear()
    }
}
