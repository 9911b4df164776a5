//! The homography of four and more correspondences, by a linear system.

use nalgebra::{Matrix3, Vector3};

use crate::geometry::{Homography, Whitening};
use crate::input::{check_lengths, no_solution};
use crate::linalg::{RowQr, pieces};
use crate::real::{abs, lit, sqrt};
use crate::{InputError, Real};

/// Correspondences, of two rows each, that one set of reflections folds into the triangular factor.
const BLOCK: usize = 5;

/// The homography of four or more correspondences: `H` minimises `sum |x2 x (H x1)|^2` in whitened coordinates
/// (the normalised direct linear transform).
///
/// # Input
/// Homogeneous points: pixels `(u, v, 1)`, normalised points or bearings, of comparable length; as many in view 2 as in
/// view 1. The estimate does not depend on the unit, the origin or the direction of the axes.
///
/// # Returns
/// `H` of Frobenius norm 1 with the sign that makes `x2 = lambda H x1`, lambda > 0, on the whole; `None` in the
/// degenerate cases. Four exact points: up to scale the `H` of [`homography_4pt`](super::homography_4pt), which is 20
/// times as fast and checks the orientation of the points too.
///
/// # Errors
/// [`InputError::LengthMismatch`], [`InputError::TooFew`] (below 4), [`InputError::NotFinite`].
///
/// # Degeneracies
/// `None` where the points determine no regular `H` to within rounding: all but one on a line, or fewer than four
/// distinct points, in a view.
///
/// # Accuracy
/// By Householder QR, never through `A'A`: transfer errors of a few `EPSILON` for exact points.
///
/// # Cost
/// 360 operations a correspondence, and up to 24 inverse iterations.
///
/// # References
/// R. Hartley and A. Zisserman, "Multiple View Geometry in Computer Vision", 2nd edition, 2003, algorithm 4.2. Deviation:
/// the two equations of a point are its components perpendicular to x2, which serves any field of view.
///
/// # Examples
/// ```
/// use epipole::nalgebra::{Matrix3, Vector3};
/// use epipole::solvers::homography_npt;
/// let truth = Matrix3::new(1.1, 0.1, 20.0, -0.2, 0.9, 30.0, 1e-4, -2e-4, 1.0);
/// let x1 = [(10, 20), (600, 40), (580, 470), (30, 450), (320, 200)].map(|(u, v)| Vector3::new(u as f64, v as f64, 1.0));
/// let x2 = x1.map(|x| truth * x);
/// let h = homography_npt(&x1, &x2).unwrap().unwrap().0;
/// assert!((h / h[(2, 2)] - truth).norm() < 1e-9);
/// ```
pub fn homography_npt<T: Real>(
    x1: &[Vector3<T>],
    x2: &[Vector3<T>],
) -> Result<Option<Homography<T>>, InputError> {
    check_lengths(x1, x2, 4)?;
    match estimate(x1, x2) {
        Some(h) => Ok(Some(h)),
        None => no_solution(x1, x2),
    }
}

fn estimate<T: Real>(x1: &[Vector3<T>], x2: &[Vector3<T>]) -> Option<Homography<T>> {
    let (t1, t2) = (Whitening::new(x1)?, Whitening::new(x2)?);
    let mut qr = RowQr::new();
    for (a, b) in pieces::<_, BLOCK>(x1).zip(pieces::<_, BLOCK>(x2)) {
        let mut rows = [[T::ZERO; 9]; 2 * BLOCK];
        for ((pair, a), b) in rows.as_chunks_mut::<2>().0.iter_mut().zip(a).zip(b) {
            let a = t1.apply(a);
            for (row, p) in pair.iter_mut().zip(perpendiculars(&t2.apply(b))) {
                *row = [
                    p.x * a.x,
                    p.y * a.x,
                    p.z * a.x,
                    p.x * a.y,
                    p.y * a.y,
                    p.z * a.y,
                    p.x * a.z,
                    p.y * a.z,
                    p.z * a.z,
                ];
            }
        }
        qr.fold(rows);
    }
    let least = qr.least_singular()?;
    let tolerance = lit::<T>(16.0) * T::EPSILON;
    // Of norm 1, the whitened equations have singular values up to 1.
    if !(least.next_value > tolerance) {
        return None;
    }
    let [a, b, c, d, e, f, g, h, i] = least.vector;
    let (h0, h1, h2) = (Vector3::new(a, b, c), Vector3::new(d, e, f), Vector3::new(g, h, i));
    if !(abs(h0.cross(&h1).dot(&h2)) > tolerance) {
        return None;
    }
    let h = t2.inverse_matrix() * Matrix3::from_columns(&[h0, h1, h2]) * t1.matrix();
    let mut agreement = T::ZERO;
    for (a, b) in x1.iter().zip(x2) {
        agreement += if (h * a).dot(b) < T::ZERO { -T::ONE } else { T::ONE };
    }
    let norm = sqrt(h.norm_squared());
    let scale = T::ONE / if agreement < T::ZERO { -norm } else { norm };
    (norm > T::ZERO && norm <= T::MAX).then(|| Homography(h * scale))
}

/// Two vectors of the length of `q`, orthogonal to it and to each other: rows of the reflection that takes `q` to the
/// z axis.
#[inline]
fn perpendiculars<T: Real>(q: &Vector3<T>) -> [Vector3<T>; 2] {
    let length = sqrt(q.norm_squared());
    let sum = length + abs(q.z);
    // A point of zero length asks for nothing.
    let inverse = if sum > T::ZERO { T::ONE / sum } else { T::ZERO };
    let (x, y) = (q.x * inverse, q.y * inverse);
    let (zx, zy) = if q.z < T::ZERO { (q.x, q.y) } else { (-q.x, -q.y) };
    [Vector3::new(length - q.x * x, -q.x * y, zx), Vector3::new(-q.y * x, length - q.y * y, zy)]
}
