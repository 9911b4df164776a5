//! The point of least reprojection error in two views.

use nalgebra::{Matrix3x2, Vector3};

use super::{Triangulation, ViewPair};
use crate::Real;
use crate::geometry::pose::skew;
use crate::real::{abs, max, sqrt};

impl<T: Real> ViewPair<T> {
    /// The point whose images on the planes z = 1 are nearest to the measured ones (least sum of squares), in the frame
    /// of view 1.
    ///
    /// The measured points are moved by the least distance onto corresponding epipolar lines; the rays of the moved
    /// points meet.
    ///
    /// # Input
    /// Bearings with `z > 0` of any length; noise alike in x and y. For other cameras, or focal lengths that differ,
    /// give the bearings' Jacobians: [`ViewPair::triangulate_optimal_bearings`].
    ///
    /// # Returns
    /// [`Triangulation`]; the parallax angle of a point is [`ViewPair::parallax`]. `Undetermined` for a bearing with
    /// `z <= 0`.
    ///
    /// # Degeneracies
    /// As [`ViewPair::triangulate_midpoint`].
    ///
    /// # Accuracy
    /// Two iterations leave an epipolar error at rounding for image errors up to several percent of the focal length.
    ///
    /// # Cost
    /// About 250 operations, two iterations, no loop.
    ///
    /// # References
    /// P. Lindstrom, "Triangulation made easy", CVPR, 2010 (`niter2`).
    #[inline]
    pub fn triangulate_optimal(&self, x1: &Vector3<T>, x2: &Vector3<T>) -> Triangulation<T> {
        if !(x1.z > T::ZERO && x2.z > T::ZERO) {
            return Triangulation::Undetermined;
        }
        let plane = |x: &Vector3<T>| Vector3::new(x.x / x.z, x.y / x.z, T::ONE);
        let (i, o) = (T::ONE, T::ZERO);
        let s = Matrix3x2::new(i, o, o, i, o, o);
        self.triangulate_optimal_bearings(&plane(x1), &plane(x2), &s, &s)
    }

    /// As [`ViewPair::triangulate_optimal`], for bearings of any camera: least sum of squares in pixels, the image
    /// being linearised by the Jacobians `j1`, `j2` of the bearings by the pixel.
    ///
    /// Bearings and Jacobians as [`unproject_with_jacobian`](crate::geometry::CameraModel::unproject_with_jacobian)
    /// gives them; on the planes z = 1 with the Jacobian `[1 0; 0 1; 0 0]` nothing is approximated.
    ///
    /// # Returns
    /// As [`ViewPair::triangulate_optimal`].
    ///
    /// # Cost
    /// About 300 operations, two iterations, no loop.
    ///
    /// # Examples
    /// ```
    /// use epipole::geometry::triangulation::ViewPair;
    /// use epipole::geometry::{CameraModel, KannalaBrandt, Pinhole, Pose};
    /// use epipole::nalgebra::Vector3;
    /// let pinhole = Pinhole::new(300.0_f64, 300.0, 320.0, 240.0)?;
    /// let fisheye = KannalaBrandt::new(pinhole, [3e-3, 7e-4, -2e-3, 2e-4])?;
    /// let pose = Pose::translation(-1.0, 0.0, 0.0);
    /// let point = Vector3::new(3.0, 0.5, 2.0);
    /// let [(x1, j1), (x2, j2)] = [point, point + pose.translation.vector]
    ///     .map(|x| fisheye.unproject_with_jacobian(&fisheye.project(&x).unwrap()).unwrap());
    /// let found = ViewPair::new(&pose).triangulate_optimal_bearings(&x1, &x2, &j1, &j2).point().unwrap();
    /// assert!((found - point).norm() < 1e-9);
    /// # Ok::<(), epipole::geometry::CameraError>(())
    /// ```
    #[inline]
    pub fn triangulate_optimal_bearings(
        &self,
        x1: &Vector3<T>,
        x2: &Vector3<T>,
        j1: &Matrix3x2<T>,
        j2: &Matrix3x2<T>,
    ) -> Triangulation<T> {
        let c = &self.centre;
        // The scale of E does not matter; fourth powers of its entries must stay in range.
        let c = c * (T::ONE / max(abs(c.x), max(abs(c.y), abs(c.z))));
        let e = -(self.rotation * skew(&c)); // [t]x R with t = -R c
        let line2 = e * x1;
        let e_j1 = e * j1;
        let m = j2.tr_mul(&e_j1);
        let (g1, g2) = (e_j1.tr_mul(x2), j2.tr_mul(&line2));
        // The displacements are lambda (g1 - m' d2) and lambda (g2 - m d1): with the gradients of the measured points
        // lambda solves a lambda^2 - 2 b lambda + c = 0, of which the smaller root is wanted.
        let (a, b) = (g2.dot(&(m * g1)), (g1.norm_squared() + g2.norm_squared()) * T::HALF);
        let constraint = x2.dot(&line2);
        let d = sqrt(max(b * b - a * constraint, T::ZERO));
        let lambda = constraint / (b + d);
        // Gradients at the moved points; with them the same equation, of which all but the root is known.
        let (h1, h2) = (g1 - m.tr_mul(&g2) * lambda, g2 - m * g1 * lambda);
        let lambda = lambda * (T::TWO * d / (h1.norm_squared() + h2.norm_squared()));
        self.triangulate_midpoint(&(x1 - j1 * h1 * lambda), &(x2 - j2 * h2 * lambda))
    }
}
