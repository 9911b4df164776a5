//! The essential matrix `E = [t]x R`: `x2' E x1 = 0` for bearings or normalised points.

use nalgebra::{Matrix3, Vector3};

use super::cheirality::depth_signs;
use super::pose::{from_parts, rotation_matrix, skew};
use super::{Fundamental, Pose};
use crate::Real;
use crate::linalg::least_singular3;
use crate::real::{abs, is_finite, lit, max, sqrt};

/// An essential matrix, known up to scale and sign.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Essential<T: Real>(pub Matrix3<T>);

/// The rotations and the baseline of an essential matrix: `E ~ [t]x R` for both rotations and both signs of `t`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwistedPair<T: Real> {
    /// The two rotations; they differ by half a turn about the baseline.
    pub rotations: [Matrix3<T>; 2],
    /// The unit direction of the baseline, of arbitrary sign, in the frame of view 2.
    pub t: Vector3<T>,
}

/// The pose that [`Essential::pose_by_cheirality`] chose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CheiralPose<T: Real> {
    /// Pose of view 2 in the frame of view 1, `|t| = 1`.
    pub pose: Pose<T>,
    /// How many of the points lie in front of both cameras.
    pub in_front: usize,
    /// How many the second best of the four poses has in front. As many as `in_front`: the points do not tell the poses apart.
    pub runner_up: usize,
}

impl<T: Real> Essential<T> {
    /// `E = [t]x R` of the pose of view 2 in the frame of view 1.
    ///
    /// # Returns
    /// The matrix of norm `sqrt(2) |t|`; zero for a pure rotation, of which there is no essential matrix.
    ///
    /// # Examples
    /// ```
    /// use epipole::geometry::{Essential, Pose};
    /// use epipole::nalgebra::Vector3;
    /// let pose = Pose::new(Vector3::new(1.0_f64, 0.0, 0.2), Vector3::new(0.0, 0.3, 0.0));
    /// let e = Essential::from_pose(&pose);
    /// let x1 = Vector3::new(0.2, -0.1, 1.0) * 4.0;
    /// let x2 = pose.rotation * x1 + pose.translation.vector;
    /// assert!(x2.dot(&(e.0 * x1)).abs() < 1e-14);
    /// ```
    #[must_use]
    pub fn from_pose(pose: &Pose<T>) -> Self {
        Self(skew(&pose.translation.vector) * rotation_matrix(&pose.rotation))
    }

    /// `E = K2' F K1`, for calibration matrices that take normalised points to pixels.
    ///
    /// The product is essential only as far as F and the calibrations are exact; see [`Self::nearest`].
    ///
    /// # Examples
    /// ```
    /// use epipole::geometry::{Essential, Pinhole, Pose};
    /// let k = Pinhole::new(500.0_f64, 500.0, 320.0, 240.0)?.matrix();
    /// let e = Essential::from_pose(&Pose::translation(1.0, 0.0, 0.5));
    /// let f = e.to_fundamental(&k, &k).unwrap();
    /// assert!((Essential::from_fundamental(&f, &k, &k).0 - e.0).norm() < 1e-12);
    /// # Ok::<(), epipole::geometry::CameraError>(())
    /// ```
    #[must_use]
    pub fn from_fundamental(f: &Fundamental<T>, k1: &Matrix3<T>, k2: &Matrix3<T>) -> Self {
        Self(k2.transpose() * f.0 * k1)
    }

    /// `F = K2^-T E K1^-1`; `None` where a calibration matrix is singular.
    #[must_use]
    pub fn to_fundamental(&self, k1: &Matrix3<T>, k2: &Matrix3<T>) -> Option<Fundamental<T>> {
        let (k1, k2) = (k1.try_inverse()?, k2.try_inverse()?);
        Some(Fundamental(k2.transpose() * self.0 * k1))
    }

    /// The essential matrix nearest to any 3x3 matrix in the Frobenius norm: its singular values s1, s2, s3 become
    /// (s1 + s2) / 2, (s1 + s2) / 2, 0.
    ///
    /// # Returns
    /// `None` where the matrix or the result is not finite, or it has no two singular values above `16 EPSILON` of the
    /// largest. Where s2 = s3 the nearest matrix is not unique and one of them is returned.
    ///
    /// # References
    /// R. Hartley, "Estimation of relative camera positions for uncalibrated cameras", ECCV 1992.
    ///
    /// # Examples
    /// ```
    /// use epipole::geometry::Essential;
    /// use epipole::nalgebra::{Matrix3, Vector3};
    /// let e = Essential(Matrix3::from_diagonal(&Vector3::new(3.0_f64, 1.0, 0.1))).nearest().unwrap();
    /// assert!((e.0 - Matrix3::from_diagonal(&Vector3::new(2.0, 2.0, 0.0))).norm() < 1e-14);
    /// ```
    ///
    /// # Accuracy
    /// A few `EPSILON` of the largest element.
    ///
    /// # Cost
    /// About 700 instructions near an essential matrix; at most five squarings of a 3x3 matrix and its SVD far from one.
    #[must_use]
    pub fn nearest(&self) -> Option<Self> {
        let (u3, v3) = least_singular3(&self.0)?;
        // Without its third part, E is s1 u1 v1' + s2 u2 v2', and a quarter turn of both frames swaps s1 and s2.
        let e = self.0 - (u3 * u3.dot(&(self.0 * v3))) * v3.transpose();
        let [e0, e1, e2] = e.data.0.map(|c| u3.cross(&Vector3::from(c)));
        let turned =
            Matrix3::from_columns(&[e2 * v3.y - e1 * v3.z, e0 * v3.z - e2 * v3.x, e1 * v3.x - e0 * v3.y]);
        let nearest = (e + turned) * T::HALF;
        nearest.iter().all(|&x| is_finite(x)).then_some(Self(nearest))
    }

    /// The two rotations and the baseline, without a singular value decomposition.
    ///
    /// With `E = s1 u1 v1' + s2 u2 v2'` in right-handed orthonormal frames, `t = u3` and
    /// `R = u3 v3' +- (u1 v2' - u2 v1')`. `u3 v3'` comes from the cofactors of E, the rest from E turned by a quarter about
    /// `u3` and about `v3`: no frame is formed.
    ///
    /// # Returns
    /// `None` where E is not finite or its rank is below 2. The rotations are orthogonal to a few `EPSILON`
    /// where the third singular value is zero to rounding, whatever the first two; else off by its share of them (take
    /// [`Self::nearest`] first).
    ///
    /// # Accuracy
    /// A few `EPSILON` radians, `f32` and `f64`.
    ///
    /// # Cost
    /// Four square roots, three divisions, about 180 other floating-point operations.
    #[inline]
    #[must_use]
    pub fn twisted_pair(&self) -> Option<TwistedPair<T>> {
        let m = in_range(&self.0)?;
        let [a, b, c] = m.data.0.map(Vector3::from);
        // The cofactors of E are s1 s2 u3 v3', their columns along u3.
        let cofactors = [b.cross(&c), c.cross(&a), a.cross(&b)];
        let squares = cofactors.map(|c| c.norm_squared());
        let (mut u, mut u_sq) = (cofactors[0], squares[0]);
        for (column, square) in [(cofactors[1], squares[1]), (cofactors[2], squares[2])] {
            let larger = square > u_sq;
            u = Vector3::from_fn(|i, _| if larger { column[i] } else { u[i] });
            u_sq = if larger { square } else { u_sq };
        }
        let v = Vector3::new(cofactors[0].dot(&u), cofactors[1].dot(&u), cofactors[2].dot(&u));
        let v_sq = v.norm_squared();
        // Divisions that do not wait for a root: 1 / sqrt x = sqrt x / x.
        let (u3, v3) = (u * (sqrt(u_sq) * (T::ONE / u_sq)), v * (sqrt(v_sq) * (T::ONE / v_sq)));
        // (s1 + s2)^2 = s1^2 + s2^2 + 2 s1 s2
        let size = m.norm_squared();
        let sum_sq = size + T::TWO * sqrt(squares[0] + squares[1] + squares[2]);
        let scale = sqrt(sum_sq) * (T::ONE / sum_sq);
        // -[u3]x E - E [v3]x = (s1 + s2) (u1 v2' - u2 v1'), whatever s1 and s2.
        let turn = Matrix3::from_columns(&[
            a.cross(&u3) - b * v3.z + c * v3.y,
            b.cross(&u3) - c * v3.x + a * v3.z,
            c.cross(&u3) - a * v3.y + b * v3.x,
        ]);
        let turn = turn * scale;
        let axis = u3 * v3.transpose();
        let rotations = [axis + turn, axis - turn];
        // What rounding leaves of a second singular value that is zero; false for NaN, too.
        let tolerance = lit::<T>(16.0) * T::EPSILON;
        let full = u_sq > tolerance * tolerance * size * size && v_sq > T::MIN_POSITIVE;
        full.then_some(TwistedPair { rotations, t: u3 })
    }

    /// The four poses that have this essential matrix: (R1, t), (R1, -t), (R2, t), (R2, -t), `|t| = 1`.
    ///
    /// # Returns
    /// `None` as [`Self::twisted_pair`]. R1 and R2 differ by half a turn about t; which is the first has no meaning.
    ///
    /// # Examples
    /// ```
    /// use epipole::geometry::{Essential, Pose};
    /// use epipole::nalgebra::{UnitQuaternion, Vector3};
    /// let truth = Pose::from_parts(Vector3::new(0.6, 0.0, 0.8).into(), UnitQuaternion::from_euler_angles(0.1, 0.2, 0.3));
    /// let poses = Essential::from_pose(&truth).poses().unwrap();
    /// let error = poses.map(|p| (p.inverse() * truth).to_homogeneous() - epipole::nalgebra::Matrix4::<f64>::identity());
    /// assert!(error.iter().any(|e| e.norm() < 1e-14));
    /// ```
    #[must_use]
    pub fn poses(&self) -> Option<[Pose<T>; 4]> {
        let TwistedPair { rotations: [a, b], t } = self.twisted_pair()?;
        let (a, b) = (from_parts(&a, &t), from_parts(&b, &t));
        let reversed = |p: &Pose<T>| Pose::from_parts((-p.translation.vector).into(), p.rotation);
        Some([a, reversed(&a), b, reversed(&b)])
    }

    /// Of the four poses, the one that has most points in front of both cameras.
    ///
    /// # Input
    /// Bearings in the frames of cameras 1 and 2, of any length, pairs by index; the surplus of the longer slice is not
    /// used.
    ///
    /// # Returns
    /// `None` where E is not finite or of rank below 2, or no pose has a point in front. Of poses with as many points,
    /// the first in the order of [`Self::poses`].
    ///
    /// # Degeneracies
    /// A point at infinity, or on the baseline, has no side of its own and counts for either; compare `runner_up`.
    ///
    /// # Cost
    /// One decomposition, then about 45 floating-point operations a point: one product of the first rotation with the
    /// bearing serves all four poses. No division in the loop.
    ///
    /// # References
    /// The decomposition of Horn, "Recovering baseline and orientation from essential matrix", 1990, answers the same
    /// without frames but gives rotations only of exactly essential matrices; hence the frames.
    ///
    /// # Examples
    /// ```
    /// use epipole::geometry::{Essential, Pose};
    /// use epipole::nalgebra::{UnitQuaternion, Vector3};
    /// let truth = Pose::from_parts(Vector3::new(0.6, 0.0, 0.8).into(), UnitQuaternion::from_euler_angles(0.1, 0.2, 0.3));
    /// let x1 = [Vector3::new(0.1, 0.2, 4.0), Vector3::new(-1.0, 0.5, 6.0)];
    /// let x2 = x1.map(|x| (truth * epipole::nalgebra::Point3::from(x)).coords);
    /// let found = Essential::from_pose(&truth).pose_by_cheirality(&x1, &x2).unwrap();
    /// assert_eq!((found.in_front, found.runner_up < 2), (2, true));
    /// assert!((found.pose.translation.vector - truth.translation.vector).norm() < 1e-14);
    /// ```
    #[inline]
    #[must_use]
    pub fn pose_by_cheirality(&self, x1: &[Vector3<T>], x2: &[Vector3<T>]) -> Option<CheiralPose<T>> {
        let pair = self.twisted_pair()?;
        let mut votes = [0usize; 4];
        for (a, b) in x1.iter().zip(x2) {
            let sides = pair.sides(a, b);
            for (vote, side) in votes.iter_mut().zip(sides) {
                *vote += usize::from(side);
            }
        }
        let (mut best, mut in_front, mut runner_up) = (0, 0, 0);
        for (k, &vote) in votes.iter().enumerate() {
            let more = vote > in_front;
            runner_up = core::cmp::max(runner_up, core::cmp::min(vote, in_front));
            best = if more { k } else { best };
            in_front = if more { vote } else { in_front };
        }
        (in_front > 0).then(|| CheiralPose { pose: pair.pose(best), in_front, runner_up })
    }
}

impl<T: Real> TwistedPair<T> {
    /// Pose `k` of 0 to 3, in the order of [`Essential::poses`].
    #[inline]
    fn pose(&self, k: usize) -> Pose<T> {
        let [a, b] = &self.rotations;
        let sign = if k & 1 == 0 { T::ONE } else { -T::ONE };
        from_parts(if k < 2 { a } else { b }, &(self.t * sign))
    }

    /// The pose, if any, that has every point in front of both cameras.
    #[inline]
    #[must_use]
    pub fn pose_with_all_in_front(&self, x1: &[Vector3<T>], x2: &[Vector3<T>]) -> Option<Pose<T>> {
        let mut all = [true; 4];
        for (a, b) in x1.iter().zip(x2) {
            let sides = self.sides(a, b);
            all.iter_mut().zip(sides).for_each(|(all, side)| *all &= side);
            if all == [false; 4] {
                return None;
            }
        }
        all.iter().position(|&a| a).map(|k| self.pose(k))
    }

    /// For which of the four poses the point of two bearings lies in front of both cameras.
    #[inline]
    fn sides(&self, x1: &Vector3<T>, x2: &Vector3<T>) -> [bool; 4] {
        let a = self.rotations[0] * x1;
        let (p, q, r) = (a.dot(&self.t), x2.dot(&self.t), a.dot(x2));
        let (x1_sq, x2_sq) = (x1.norm_squared(), x2.norm_squared());
        // The second rotation is half a turn about t after the first: p and q stay, r becomes 2 p q - r.
        let (d1, d2) = depth_signs(p, q, r, x1_sq, x2_sq);
        let (e1, e2) = depth_signs(p, q, T::TWO * p * q - r, x1_sq, x2_sq);
        let o = T::ZERO;
        [(d1 > o) & (d2 > o), (d1 < o) & (d2 < o), (e1 > o) & (e2 > o), (e1 < o) & (e2 < o)]
    }
}

/// The matrix, rescaled where the eighth powers of its elements would overflow or underflow; `None` where it is zero or
/// not finite.
#[inline]
fn in_range<T: Real>(m: &Matrix3<T>) -> Option<Matrix3<T>> {
    let size = m.norm_squared();
    if size > lit(1e-6) && size < lit(1e6) {
        return Some(*m);
    }
    let largest = m.iter().fold(T::ZERO, |s, &v| max(s, abs(v)));
    if !m.iter().all(|&v| is_finite(v)) || largest == T::ZERO {
        return None;
    }
    Some(m.map(|v| v / largest))
}
