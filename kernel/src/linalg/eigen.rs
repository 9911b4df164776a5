//! Eigenvalues and eigenvectors of a small symmetric matrix.

use nalgebra::{SMatrix, SVector};

use crate::Real;
use crate::real::{abs, sqrt};

/// Sweeps of Jacobi rotations at the most. Convergence is quadratic: a 3x3 matrix takes 3 to 5, a 9x9 6 to 8.
const MAX_SWEEPS: usize = 15;

/// `A = V diag(values) V'` of a symmetric matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SymmetricEigen<T: Real, const N: usize> {
    /// The eigenvalues, largest first.
    pub values: SVector<T, N>,
    /// Column i is the unit eigenvector of value i. The columns are orthonormal; their signs and the determinant's are
    /// not specified.
    pub vectors: SMatrix<T, N, N>,
}

/// The eigenvalues and eigenvectors of a symmetric matrix, by cyclic Jacobi rotations.
///
/// # Input
/// The upper triangle of `a` alone is read. Any scale.
///
/// # Returns
/// Values in descending order. `None` where `a` holds a NaN or an infinity, or after 15 sweeps without convergence (not
/// observed).
///
/// # Accuracy
/// Values to a few `EPSILON` times the largest; vectors orthonormal to a few `EPSILON`.
///
/// # Cost
/// At most 15 sweeps of N (N - 1) / 2 rotations; 3 to 5 sweeps for N = 3.
///
/// # References
/// G. H. Golub and C. F. Van Loan, "Matrix Computations", 4th edition, 2013, section 8.5.
///
/// # Examples
/// ```
/// use epipole::linalg::symmetric_eigen;
/// use epipole::nalgebra::{Matrix2, Vector2};
/// let eigen = symmetric_eigen(&Matrix2::new(2.0, 1.0, 1.0, 2.0)).unwrap();
/// assert!((eigen.values - Vector2::new(3.0_f64, 1.0)).norm_squared() < 1e-30);
/// ```
#[must_use]
pub fn symmetric_eigen<T: Real, const N: usize>(a: &SMatrix<T, N, N>) -> Option<SymmetricEigen<T, N>> {
    // Column-major storage: m[q][p] with p < q is the upper triangle.
    let mut m = a.data.0;
    let largest =
        super::largest_magnitude(m.iter().enumerate().flat_map(|(q, column)| column.iter().take(q + 1)))?;
    let mut v = super::identity::<T, N>().data.0;
    if largest > T::ZERO {
        m.iter_mut().flatten().for_each(|x| *x /= largest);
    }
    let mut converged = false;
    for _ in 0..MAX_SWEEPS {
        let (mut diagonal, mut off) = (T::ZERO, T::ZERO);
        for q in 0..N {
            diagonal += m[q][q] * m[q][q];
            for p in 0..q {
                off += m[q][p] * m[q][p];
            }
        }
        if off <= T::EPSILON * T::EPSILON * T::HALF * diagonal {
            converged = true;
            break;
        }
        for q in 1..N {
            for p in 0..q {
                rotate(&mut m, &mut v, p, q);
            }
        }
    }
    if !converged {
        return None;
    }
    let mut values = [T::ZERO; N];
    for i in 0..N {
        values[i] = m[i][i] * largest;
    }
    for end in (1..N).rev() {
        for i in 0..end {
            if values[i + 1] > values[i] {
                values.swap(i, i + 1);
                v.swap(i, i + 1);
            }
        }
    }
    Some(SymmetricEigen {
        values: SVector::from(values),
        vectors: SMatrix::from_data(nalgebra::ArrayStorage(v)),
    })
}

/// The rotation of the plane (p, q), p < q, that makes element (p, q) zero.
#[inline]
fn rotate<T: Real, const N: usize>(m: &mut [[T; N]; N], v: &mut [[T; N]; N], p: usize, q: usize) {
    let apq = m[q][p];
    if apq == T::ZERO {
        return;
    }
    let (sine, tangent, cosine) = jacobi_angle(m[p][p], apq, m[q][q]);
    m[p][p] -= tangent * apq;
    m[q][q] += tangent * apq;
    m[q][p] = T::ZERO;
    for k in 0..p {
        let (x, y) = (m[p][k], m[q][k]);
        m[p][k] = cosine * x - sine * y;
        m[q][k] = sine * x + cosine * y;
    }
    for k in p + 1..q {
        let (x, y) = (m[k][p], m[q][k]);
        m[k][p] = cosine * x - sine * y;
        m[q][k] = sine * x + cosine * y;
    }
    for k in q + 1..N {
        let (x, y) = (m[k][p], m[k][q]);
        m[k][p] = cosine * x - sine * y;
        m[k][q] = sine * x + cosine * y;
    }
    for k in 0..N {
        let (x, y) = (v[p][k], v[q][k]);
        v[p][k] = cosine * x - sine * y;
        v[q][k] = sine * x + cosine * y;
    }
}

/// Sine, tangent and cosine of the smaller angle that makes `[[app, apq], [apq, aqq]]` diagonal. `apq` is not zero.
#[inline]
pub(super) fn jacobi_angle<T: Real>(app: T, apq: T, aqq: T) -> (T, T, T) {
    let theta = T::HALF * (aqq - app) / apq;
    // An overflow of theta^2 gives a zero angle, as it should.
    let magnitude = T::ONE / (abs(theta) + sqrt(theta * theta + T::ONE));
    let tangent = if theta < T::ZERO { -magnitude } else { magnitude };
    let cosine = T::ONE / sqrt(tangent * tangent + T::ONE);
    (tangent * cosine, tangent, cosine)
}
