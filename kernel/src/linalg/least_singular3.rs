//! The singular vectors of the smallest singular value of a 3x3 matrix, without a decomposition.

use nalgebra::{Matrix3, Vector3};

use super::svd3;
use crate::Real;
use crate::real::{lit, sqrt};

/// Squarings of the Gram matrix at the most; after them the decomposition answers.
const MAX_SQUARINGS: usize = 5;

/// The unit vectors `u3`, `v3` with `A v3 = s3 u3` and `A' u3 = s3 v3` for the smallest singular value s3, with the signs
/// that make `det U det V = 1`: s3 has the sign of `det A`.
///
/// The cofactor matrix of A has the same singular vectors with the values s2 s3, s1 s3, s1 s2, the last by far the
/// largest where A is near rank 2; powers of its Gram matrix tend to `v3 v3'`.
///
/// # Returns
/// `None` where A has no two singular values above `16 EPSILON` of the largest, or is not finite. Where s2 = s3 the
/// vectors are not unique.
///
/// # Cost
/// About 80 operations and two square roots; 40 more for each squaring, of which a matrix near rank 2 takes none.
#[inline]
#[must_use]
pub(crate) fn least_singular3<T: Real>(a: &Matrix3<T>) -> Option<(Vector3<T>, Vector3<T>)> {
    let largest = super::largest_magnitude(a.data.0.iter().flatten())?;
    if !(largest > T::ZERO) {
        return None;
    }
    let inverse = T::ONE / largest;
    let [a0, a1, a2] = a.data.0.map(|c| Vector3::from(c) * inverse);
    let c = Matrix3::from_columns(&[a1.cross(&a2), a2.cross(&a0), a0.cross(&a1)]);
    let square = a0.norm_squared() + a1.norm_squared() + a2.norm_squared();
    let [c0, c1, c2] = c.data.0.map(Vector3::from);
    let trace = c0.norm_squared() + c1.norm_squared() + c2.norm_squared();
    let floor = lit::<T>(16.0) * T::EPSILON;
    // (s1 s2)^2 against s1^4. Written so that NaN fails too.
    if !(trace > floor * floor * square * square) {
        return None;
    }
    // The Gram matrix of the cofactors, of trace 1: xx, yy, zz, xy, xz, yz.
    let mut g =
        [c0.norm_squared(), c1.norm_squared(), c2.norm_squared(), c0.dot(&c1), c0.dot(&c2), c1.dot(&c2)]
            .map(|x| x / trace);
    let mut converged = false;
    for _ in 0..=MAX_SQUARINGS {
        let [xx, yy, zz, xy, xz, yz] = g;
        let (xy2, xz2, yz2) = (xy * xy, xz * xz, yz * yz);
        let squared = [
            xx * xx + xy2 + xz2,
            xy2 + yy * yy + yz2,
            xz2 + yz2 + zz * zz,
            xx * xy + xy * yy + xz * yz,
            xx * xz + xy * yz + xz * zz,
            xy * xz + yy * yz + yz * zz,
        ];
        let trace = squared[0] + squared[1] + squared[2];
        // 1 - trace is twice the second eigenvalue's share: below rounding, G is of rank 1.
        if T::ONE - trace <= T::EPSILON {
            converged = true;
            break;
        }
        g = squared.map(|x| x / trace);
    }
    let [xx, yy, zz, xy, xz, yz] = g;
    let v3 = if xx >= yy && xx >= zz {
        Vector3::new(xx, xy, xz)
    } else if yy >= zz {
        Vector3::new(xy, yy, yz)
    } else {
        Vector3::new(xz, yz, zz)
    };
    if converged {
        let v3 = v3 / sqrt(v3.norm_squared());
        let u3 = c0 * v3.x + c1 * v3.y + c2 * v3.z;
        return Some((u3 / sqrt(u3.norm_squared()), v3));
    }
    let svd = svd3(a)?;
    // det V = 1, and this makes det U = 1.
    Some((svd.u.column(0).cross(&svd.u.column(1)), svd.v.column(2).into_owned()))
}
