//! The homography `x2 ~ H x1` between two images of a plane, or of a purely rotating camera, and the motions it allows.

use nalgebra::{ArrayStorage, Matrix3, Vector2, Vector3};

use super::Pose;
use super::pose::{from_parts, rotation_matrix};
use crate::linalg::vec3::{cross, dot, scaled};
use crate::linalg::{product, svd3, times};
use crate::real::{abs, is_finite, lit, sqrt};
use crate::{Real, Solutions};

/// A homography, known up to scale and sign.
///
/// Between normalised points or bearings of a plane `n' X1 = d`: `H = R + t n' / d`. Between pixels: `K2 H K1^-1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Homography<T: Real>(pub Matrix3<T>);

/// A camera motion and a plane that together make a homography `R + t n'`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneMotion<T: Real> {
    /// Pose of view 2 in the frame of view 1, its translation in units of the plane's distance from camera 1: `t / d`.
    /// Zero for a pure rotation.
    pub pose: Pose<T>,
    /// The unit normal of the plane in the frame of view 1, away from the camera where the plane lies in front: `n' X1
    /// = d > 0`. The zero vector for a pure rotation, of which no plane is seen.
    pub normal: Vector3<T>,
}

impl<T: Real> PlaneMotion<T> {
    /// `H = R + t n'`, between normalised points.
    ///
    /// # Examples
    /// ```
    /// use epipole::geometry::{PlaneMotion, Pose};
    /// use epipole::nalgebra::Vector3;
    /// // A step of a tenth of the distance towards a plane in front: its image grows.
    /// let motion = PlaneMotion { pose: Pose::translation(0.0, 0.0, -0.1_f64), normal: Vector3::z() };
    /// let x2 = motion.homography().0 * Vector3::new(0.2, 0.0, 1.0);
    /// assert!((x2.x / x2.z - 0.2 / 0.9).abs() < 1e-15);
    /// ```
    #[must_use]
    pub fn homography(&self) -> Homography<T> {
        let r = rotation_matrix(&self.pose.rotation);
        Homography(r + self.pose.translation.vector * self.normal.transpose())
    }
}

impl<T: Real> Homography<T> {
    /// The homography between pixels, `K2 H K1^-1`, of this one between normalised points. `None` where `K1` is
    /// singular.
    ///
    /// # Input
    /// Calibration matrices that take normalised points to pixels; any scale of H.
    ///
    /// # Examples
    /// ```
    /// use epipole::geometry::{Homography, Pinhole};
    /// use epipole::nalgebra::{Matrix3, Vector2};
    /// let k = Pinhole::new(500.0_f64, 500.0, 320.0, 240.0)?.matrix();
    /// let h = Homography(Matrix3::new(1.0, 0.0, 0.1, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)).to_pixels(&k, &k).unwrap();
    /// assert_eq!(h.transfer(&Vector2::new(320.0, 240.0)).unwrap(), Vector2::new(370.0, 240.0));
    /// # Ok::<(), epipole::geometry::CameraError>(())
    /// ```
    #[must_use]
    pub fn to_pixels(&self, k1: &Matrix3<T>, k2: &Matrix3<T>) -> Option<Self> {
        Some(Self(k2 * self.0 * k1.try_inverse()?))
    }

    /// The homography between normalised points, `K2^-1 H K1`, of this one between pixels. `None` where `K2` is
    /// singular.
    ///
    /// Input as of [`Self::to_pixels`], whose inverse it is.
    #[must_use]
    pub fn to_normalised(&self, k1: &Matrix3<T>, k2: &Matrix3<T>) -> Option<Self> {
        Some(Self(k2.try_inverse()? * self.0 * k1))
    }

    /// The point of view 2 to which a point of view 1 goes. `None` where that is at infinity or not finite.
    ///
    /// ```
    /// use epipole::geometry::Homography;
    /// use epipole::nalgebra::{Matrix3, Vector2};
    /// let h = Homography(Matrix3::new(2.0, 0.0, 1.0, 0.0, 2.0, 3.0, 0.0, 0.0, 1.0));
    /// assert_eq!(h.transfer(&Vector2::new(1.0, 1.0)), Some(Vector2::new(3.0, 5.0)));
    /// ```
    #[must_use]
    pub fn transfer(&self, x1: &Vector2<T>) -> Option<Vector2<T>> {
        let x2 = self.0 * Vector3::new(x1.x, x1.y, T::ONE);
        let point = Vector2::new(x2.x / x2.z, x2.y / x2.z);
        (is_finite(point.x) && is_finite(point.y)).then_some(point)
    }

    /// The homography from view 2 to view 1. `None` where H is singular to within the rounding of its determinant, or
    /// determinant or inverse leave the range of `T`.
    ///
    /// # Examples
    /// ```
    /// use epipole::geometry::Homography;
    /// use epipole::nalgebra::{Matrix3, Vector2};
    /// let h = Homography(Matrix3::new(2.0_f64, 0.0, 1.0, 0.0, 2.0, 3.0, 0.0, 0.0, 1.0));
    /// assert_eq!(h.inverse().unwrap().transfer(&Vector2::new(3.0, 5.0)), Some(Vector2::new(1.0, 1.0)));
    /// assert!(Homography(Matrix3::<f64>::repeat(1.0)).inverse().is_none());
    /// ```
    #[must_use]
    pub fn inverse(&self) -> Option<Self> {
        let [a, b, c] = self.0.data.0.map(Vector3::from);
        let (bc, ca, ab) = (b.cross(&c), c.cross(&a), a.cross(&b));
        let terms = a.component_mul(&bc);
        let determinant = terms.x + terms.y + terms.z;
        let size = abs(terms.x) + abs(terms.y) + abs(terms.z);
        // Written so that NaN fails too.
        if !(abs(determinant) > lit::<T>(8.0) * T::EPSILON * size && size <= T::MAX) {
            return None;
        }
        let inverse = Matrix3::from_columns(&[bc, ca, ab]).transpose() / determinant;
        is_finite(inverse.norm_squared()).then_some(Self(inverse))
    }

    /// The up to four motions and planes `H ~ R + t n'` of a homography between normalised points.
    ///
    /// With `H` scaled so that its second singular value is 1 and `det H > 0` (both cameras on one side of the plane),
    /// `H` keeps the length of the vectors of two planes through `v2`; each gives a rotation, and with it `t` and `n` up to
    /// a common sign.
    ///
    /// # Input
    /// A homography between normalised points or bearings (pixels first through [`Self::to_normalised`]), any scale and
    /// sign.
    ///
    /// # Returns
    /// Four motions: two twins, each with (t, n) and (-t, -n), one after the other; [`Self::visible_motions`] keeps
    /// what the points allow. Two where the twins coincide (the translation is along the normal). One, with zero
    /// translation and normal, where H is a rotation to within `8 EPSILON`. None where H is singular or not finite.
    ///
    /// # Accuracy
    /// The rotation to a few `EPSILON` near a pure rotation too; `n` to `EPSILON / |t|`. Where the twins nearly coincide they
    /// differ by the square root of the rounding, all three.
    ///
    /// # Cost
    /// One 3x3 singular value decomposition.
    ///
    /// # References
    /// Y. Ma, S. Soatto, J. Kosecka and S. S. Sastry, "An Invitation to 3-D Vision", 2004, section 5.3.3;
    /// O. D. Faugeras and F. Lustman, "Motion and structure from motion in a piecewise planar environment", International
    /// Journal of Pattern Recognition and Artificial Intelligence, 1988; E. Malis and M. Vargas, "Deeper understanding
    /// of the homography decomposition for vision-based control", INRIA research report 6303, 2007.
    ///
    /// # Examples
    /// ```
    /// use epipole::geometry::{Homography, PlaneMotion, Pose};
    /// use epipole::nalgebra::{UnitQuaternion, Vector3};
    /// let truth = PlaneMotion {
    ///     pose: Pose::from_parts(Vector3::new(0.2, 0.0, 0.1).into(), UnitQuaternion::from_euler_angles(0.1, 0.2, 0.0)),
    ///     normal: Vector3::new(0.0, 0.6, 0.8),
    /// };
    /// let motions = Homography(truth.homography().0 * -3.0).motions();
    /// assert_eq!(motions.len(), 4);
    /// assert!(motions.iter().any(|m: &PlaneMotion<f64>| (m.normal - truth.normal).norm() < 1e-12
    ///     && (m.pose.translation.vector - truth.pose.translation.vector).norm() < 1e-12));
    /// ```
    pub fn motions(&self) -> Solutions<PlaneMotion<T>, 4> {
        let mut motions = Solutions::new();
        let Some(svd) = svd3(&self.0) else { return motions };
        let (s1, s2, s3) = (svd.s.x, svd.s.y, svd.s.z);
        if !(s3 > lit::<T>(16.0) * T::EPSILON * s1) {
            return motions;
        }
        let [c0, c1, c2] = &self.0.data.0;
        let determinant = dot(&cross(c0, c1), c2);
        let h = self.0 / if determinant < T::ZERO { -s2 } else { s2 };
        let [v1, v2, v3] = &svd.v.data.0;
        // (s1^2 - 1), (1 - s3^2) of the scaled H, without the cancellation of squares.
        // What rounding leaves of a double singular value is zero: its square root would not be small.
        let snap = |x: T| if x > lit::<T>(16.0) * T::EPSILON { x } else { T::ZERO };
        let stretch = snap((s1 - s2) / s2 * ((s1 + s2) / s2));
        let shrink = snap((s2 - s3) / s2 * ((s2 + s3) / s2));
        let sum = stretch + shrink;
        if !(sum > T::ZERO) {
            // U V' with the sign of the scaled H is the nearest rotation.
            let r = product(&svd.u, &svd.v.transpose());
            let r = if determinant < T::ZERO { -r } else { r };
            motions.push(PlaneMotion { pose: from_parts(&r, &Vector3::zeros()), normal: Vector3::zeros() });
            return motions;
        }
        let (p, q) = (sqrt(shrink / sum), sqrt(stretch / sum));
        let h2 = times(&h, &Vector3::from(*v2)).data.0[0];
        for sign in [T::ONE, -T::ONE] {
            // u and v2 span a plane whose vectors H does not stretch.
            let (p, q) = (p, q * sign);
            let u = [v1[0] * p + v3[0] * q, v1[1] * p + v3[1] * q, v1[2] * p + v3[2] * q];
            let hu = times(&h, &Vector3::from(u)).data.0[0];
            let normal = cross(v2, &u);
            let normal_in_2 = cross(&h2, &hu);
            let before = Matrix3::from_data(ArrayStorage([*v2, u, normal]));
            let after = Matrix3::from_data(ArrayStorage([h2, hu, normal_in_2]));
            let r = product(&after, &before.transpose());
            let t = times(&h, &Vector3::from(normal)) - Vector3::from(normal_in_2);
            for side in [T::ONE, -T::ONE] {
                let pose = from_parts(&r, &(t * side));
                motions.push(PlaneMotion { pose, normal: Vector3::from(scaled(&normal, side)) });
            }
            // u = v1 or v3: the other sign gives the same plane.
            if stretch == T::ZERO || shrink == T::ZERO {
                break;
            }
        }
        motions
    }

    /// Of [`Self::motions`], those whose plane lies in front of camera 1 along the most of the bearings `x1`: of each
    /// twin the sign of (t, n) that the points agree with, and of the twins the better, or both where the points allow both.
    ///
    /// # Input
    /// Bearings or normalised points of view 1 that lie on the plane.
    ///
    /// # Returns
    /// One motion or two (a plane seen in a narrow field of view has two motions that no point can tell apart), or none
    /// where there are no motions. The list of a pure rotation is returned as it is.
    pub fn visible_motions(&self, x1: &[Vector3<T>]) -> Solutions<PlaneMotion<T>, 4> {
        let motions = self.motions();
        let votes = |m: &PlaneMotion<T>| x1.iter().filter(|x| m.normal.dot(x) > T::ZERO).count();
        let best = motions.iter().map(votes).fold(0, |a, b| if b > a { b } else { a });
        let mut visible = Solutions::new();
        for motion in motions.into_iter().filter(|m| votes(m) == best) {
            visible.push(motion);
        }
        visible
    }
}
