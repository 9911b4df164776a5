//! The fundamental matrix `F = K2^-T E K1^-1`: `x2' F x1 = 0` for homogeneous pixels.

use nalgebra::{Matrix3, Vector3};

use crate::Real;
use crate::linalg::least_singular3;
use crate::real::{is_finite, lit, sqrt};

/// A fundamental matrix, known up to scale and sign.
///
/// From an essential matrix and back: [`Essential::to_fundamental`](super::Essential::to_fundamental),
/// [`Essential::from_fundamental`](super::Essential::from_fundamental).
///
/// ```
/// use epipole::geometry::Fundamental;
/// use epipole::nalgebra::Vector3;
/// // A camera that moves to the right: epipolar lines are rows of the image, the epipole is at infinity.
/// let f = Fundamental(Vector3::new(-1.0_f64, 0.0, 0.0).cross_matrix());
/// let line = f.line2(&Vector3::new(12.0, 34.0, 1.0));
/// assert_eq!(line.dot(&Vector3::new(99.0, 34.0, 1.0)), 0.0);
/// assert_eq!(f.epipole2().unwrap().map(f64::abs), Vector3::x());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fundamental<T: Real>(pub Matrix3<T>);

impl<T: Real> Fundamental<T> {
    /// The epipolar line `F x1` in view 2: homogeneous, `(a, b, c)` for `a u + b v + c = 0`.
    ///
    /// # Input
    /// A homogeneous pixel (a bearing or normalised point, of an essential matrix), of any scale.
    ///
    /// # Examples
    /// See [`Fundamental`].
    #[must_use]
    pub fn line2(&self, x1: &Vector3<T>) -> Vector3<T> {
        self.0 * x1
    }

    /// The epipolar line `F' x2` in view 1.
    ///
    /// Input and result as of [`Self::line2`].
    #[must_use]
    pub fn line1(&self, x2: &Vector3<T>) -> Vector3<T> {
        self.0.tr_mul(x2)
    }

    /// The epipole of view 1, the image of camera 2: the unit vector with `F e1 = 0`, of arbitrary sign. Its third
    /// coordinate is 0 for an epipole at infinity.
    ///
    /// # Returns
    /// `None` where F has a rank below 2 or is not finite. Of a matrix of rank 3, the point where the epipolar lines of
    /// two directions meet, which is the epipole as far as F is fundamental; see [`Self::nearest`].
    ///
    /// # Accuracy
    /// A few `EPSILON` over the sine of the angle between the two columns of F that are least parallel: about 1e-4 rad in
    /// `f32` for a matrix between pixels, `EPSILON` in normalised coordinates.
    ///
    /// # Cost
    /// About 80 floating-point operations and seven square roots.
    #[must_use]
    pub fn epipole1(&self) -> Option<Vector3<T>> {
        null_of_columns(&self.0.transpose())
    }

    /// The epipole of view 2, the image of camera 1: the unit vector with `F' e2 = 0`. As [`Self::epipole1`].
    #[must_use]
    pub fn epipole2(&self) -> Option<Vector3<T>> {
        null_of_columns(&self.0)
    }

    /// The matrix of rank 2 nearest to any 3x3 matrix in the Frobenius norm: its smallest singular value becomes 0.
    ///
    /// Nearest means little in pixels, where the elements of F differ by many orders of magnitude: use it in normalised
    /// coordinates.
    ///
    /// # Returns
    /// `None` where the matrix is not finite or has no two singular values above `16 EPSILON` of the largest.
    ///
    /// # Accuracy
    /// A few `EPSILON` of the largest element.
    ///
    /// # References
    /// R. Hartley, "In defense of the eight-point algorithm", IEEE Transactions on Pattern Analysis and Machine
    /// Intelligence 19, 1997 (section 2.2, the singularity constraint).
    ///
    /// # Examples
    /// ```
    /// use epipole::geometry::Fundamental;
    /// use epipole::nalgebra::{Matrix3, Vector3};
    /// let f = Fundamental(Matrix3::from_diagonal(&Vector3::new(3.0_f64, 1.0, 0.1))).nearest().unwrap();
    /// assert!((f.0 - Matrix3::from_diagonal(&Vector3::new(3.0, 1.0, 0.0))).norm() < 1e-14);
    /// ```
    #[must_use]
    pub fn nearest(&self) -> Option<Self> {
        let (u3, v3) = least_singular3(&self.0)?;
        Some(Self(self.0 - (u3 * u3.dot(&(self.0 * v3))) * v3.transpose()))
    }
}

/// The unit vector perpendicular to the columns of a matrix of rank 2.
fn null_of_columns<T: Real>(m: &Matrix3<T>) -> Option<Vector3<T>> {
    if !m.iter().all(|&x| is_finite(x)) {
        return None;
    }
    let [a, b, c] = m.data.0.map(Vector3::from);
    let (mut best, mut best_sine_sq) = (Vector3::zeros(), T::ZERO);
    // The two columns that are least parallel: a measure that their lengths, in pixels of all sizes, do not change.
    for (p, q) in [(a, b), (b, c), (c, a)] {
        let (p_sq, q_sq) = (p.norm_squared(), q.norm_squared());
        if !(p_sq > T::ZERO && q_sq > T::ZERO) {
            continue;
        }
        let normal = (p / sqrt(p_sq)).cross(&(q / sqrt(q_sq)));
        let sine_sq = normal.norm_squared();
        if sine_sq > best_sine_sq {
            (best, best_sine_sq) = (normal, sine_sq);
        }
    }
    let floor = lit::<T>(16.0) * T::EPSILON;
    (best_sine_sq > floor * floor).then(|| best / sqrt(best_sine_sq))
}
