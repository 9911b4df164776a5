//! The linear change of coordinates before a linear estimate.

use nalgebra::{Matrix3, Vector3};

use crate::Real;
use crate::real::{lit, sqrt};

/// A linear map `T`, lower triangular in the order z, x, y, after which homogeneous points have unit second moments:
/// `sum (T x)(T x)' = I`.
///
/// It does what Hartley's normalisation does for pixels (origin to the centroid, sizes to one) and goes on to equal
/// second moments in every direction. So it serves bearings of any field of view too, and the estimate that
/// minimises an algebraic error after it does not depend on the frame or on the calibration: another linear map of
/// the points before it changes `T x` by a rotation only.
///
/// # References
/// R. I. Hartley, "In defense of the eight-point algorithm", IEEE Transactions on Pattern Analysis and Machine
/// Intelligence, 1997 (section 5.2, the non-isotropic scaling).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Whitening<T: Real> {
    /// z' = iz z, x' = ix (x - a z), y' = iy (y - b z - c x)
    iz: T,
    ix: T,
    iy: T,
    a: T,
    b: T,
    c: T,
}

impl<T: Real> Whitening<T> {
    /// `None` where the points lie on one line of the image (their vectors in a plane), to within rounding, or are not
    /// finite.
    #[inline]
    pub(crate) fn new(points: &[Vector3<T>]) -> Option<Self> {
        let (mut zz, mut xz, mut yz) = (T::ZERO, T::ZERO, T::ZERO);
        for p in points {
            zz += p.z * p.z;
            xz += p.x * p.z;
            yz += p.y * p.z;
        }
        let inverse = T::ONE / zz;
        let (a, b) = (xz * inverse, yz * inverse);
        // Moments about the centroid, not differences of moments: points far from the origin keep their digits.
        let (mut xx, mut xy, mut yy) = (T::ZERO, T::ZERO, T::ZERO);
        for p in points {
            let (x, y) = (p.x - a * p.z, p.y - b * p.z);
            xx += x * x;
            xy += x * y;
            yy += y * y;
        }
        let c = xy / xx;
        let mut rest = T::ZERO;
        for p in points {
            let y = p.y - b * p.z - c * (p.x - a * p.z);
            rest += y * y;
        }
        // The squared width of a line, against what rounding of the coordinates leaves of it. Written so that NaN fails
        // too; an infinite coordinate leaves NaN in the centred moments.
        let width = xx * (rest / (xx + yy));
        let rounding = lit::<T>(8.0) * T::EPSILON;
        let floor = rounding * rounding * (xx + yy + (a * a + b * b + T::ONE) * zz);
        if !(width > floor && zz > T::ZERO) {
            return None;
        }
        Some(Self {
            iz: T::ONE / sqrt(zz),
            ix: T::ONE / sqrt(xx),
            iy: T::ONE / sqrt(rest),
            a,
            b: b - c * a,
            c,
        })
    }

    /// `T x`
    #[inline]
    pub(crate) fn apply(&self, p: &Vector3<T>) -> Vector3<T> {
        Vector3::new(
            (p.x - self.a * p.z) * self.ix,
            (p.y - self.b * p.z - self.c * p.x) * self.iy,
            p.z * self.iz,
        )
    }

    /// `T`
    #[inline]
    pub(crate) fn matrix(&self) -> Matrix3<T> {
        let o = T::ZERO;
        Matrix3::new(
            self.ix,
            o,
            -self.a * self.ix,
            -self.c * self.iy,
            self.iy,
            -self.b * self.iy,
            o,
            o,
            self.iz,
        )
    }

    /// `T^-1`
    #[inline]
    pub(crate) fn inverse_matrix(&self) -> Matrix3<T> {
        let o = T::ZERO;
        let (x, y, z) = (T::ONE / self.ix, T::ONE / self.iy, T::ONE / self.iz);
        Matrix3::new(x, o, self.a * z, self.c * x, y, (self.b + self.c * self.a) * z, o, o, z)
    }
}
