//! Null vectors of a short, wide matrix by Householder reflections.
//!
//! The rows `A` of a minimal epipolar problem are factored as `A = L Q'` by reflections from the right; the last
//! columns of `Q` are an orthonormal basis of what every row is orthogonal to. Never through `A'A`, which squares the
//! condition number: in single precision that costs half of the digits.

use crate::Real;
use crate::real::{lit, sqrt};

/// An orthonormal basis of the null space of `M` linearly independent rows of length `N`: `K = N - M` vectors.
///
/// `A n_k = 0`, `n_j . n_k = 1` where j = k and 0 elsewhere.
///
/// # Input
/// The rows of `A`. Their scales may differ from one another; the squares of the elements must neither overflow nor
/// underflow. `K` other than `N - M` does not compile.
///
/// # Returns
/// The basis, or `None` where the rows are linearly dependent to within rounding (the part of a row that is orthogonal
/// to the rows before it is below `16 EPSILON` of the row) or an element is not finite.
///
/// # Accuracy
/// Backward stable: the basis is that of a matrix within a few `EPSILON` of each row's norm.
///
/// # Cost
/// `M` reflections: no iteration. 5x9: about 900 floating-point operations, 5 square roots, 5 divisions.
///
/// # References
/// A. S. Householder, "Unitary triangularization of a nonsymmetric matrix", Journal of the ACM, 1958.
///
/// # Examples
/// ```
/// use epipole::linalg::null_space;
/// let [n] = null_space(&[[1.0_f64, 2.0, 2.0], [0.0, 1.0, -1.0]]).unwrap();
/// assert!((n[0] + 2.0 * n[1] + 2.0 * n[2]).abs() < 1e-15 && (n[1] - n[2]).abs() < 1e-15);
/// assert!(null_space::<f64, 2, 3, 1>(&[[1.0, 2.0, 2.0], [2.0, 4.0, 4.0]]).is_none());
/// ```
#[inline]
#[must_use]
pub fn null_space<T: Real, const M: usize, const N: usize, const K: usize>(
    rows: &[[T; N]; M],
) -> Option<[[T; N]; K]> {
    reflect::<T, M, N, K, false>(rows)
}

/// [`null_space`] with one step of iterative refinement: about half of its error, for a quarter more of its time.
///
/// What `A` makes of the basis is taken out again by the shortest correction, with the same factors. For solvers that have
/// no step of their own that repairs the basis.
///
/// # Examples
/// ```
/// use epipole::linalg::null_space_refined;
/// let [n] = null_space_refined(&[[1.0_f32, 2.0, 2.0], [0.0, 1.0, -1.0]]).unwrap();
/// assert!((n[0] + 2.0 * n[1] + 2.0 * n[2]).abs() < 2e-7 && (n[1] - n[2]).abs() < 1e-7);
/// ```
#[inline]
#[must_use]
pub fn null_space_refined<T: Real, const M: usize, const N: usize, const K: usize>(
    rows: &[[T; N]; M],
) -> Option<[[T; N]; K]> {
    reflect::<T, M, N, K, true>(rows)
}

#[inline]
fn reflect<T: Real, const M: usize, const N: usize, const K: usize, const REFINE: bool>(
    rows: &[[T; N]; M],
) -> Option<[[T; N]; K]> {
    let mut a = [[T::ZERO; M]; N];
    for r in 0..M {
        for c in 0..N {
            a[c][r] = rows[r][c];
        }
    }
    let scale = factor(&mut a)?;
    let mut q: [[T; K]; N] = last_columns(&a, &scale);
    if REFINE {
        // A = L Q': the correction is Q L^-1 of the residual.
        let mut y = [[T::ZERO; K]; N];
        for k in 0..M {
            let mut sum = [T::ZERO; K];
            for c in 0..N {
                for j in 0..K {
                    sum[j] += rows[k][c] * q[c][j];
                }
            }
            // Element (c, k) is that of L for c < k; scale v_kk is the reciprocal of its diagonal.
            for c in 0..k {
                for j in 0..K {
                    sum[j] -= a[c][k] * y[c][j];
                }
            }
            for j in 0..K {
                y[k][j] = sum[j] * (scale[k] * a[k][k]);
            }
        }
        reflect_back(&a, &scale, &mut y);
        for c in 0..N {
            for j in 0..K {
                q[c][j] -= y[c][j];
            }
        }
    }
    let mut basis = [[T::ZERO; N]; K];
    for j in 0..K {
        for c in 0..N {
            basis[j][c] = q[c][j];
        }
    }
    Some(basis)
}

/// [`null_space`] of a matrix column by column, its vectors element by element.
#[inline]
pub(crate) fn null_space_of_columns<T: Real, const M: usize, const N: usize, const K: usize>(
    mut columns: [[T; M]; N],
) -> Option<[[T; K]; N]> {
    let scale = factor(&mut columns)?;
    Some(last_columns(&columns, &scale))
}

/// The reflections of a matrix column by column, left in its place, and their scales; none where rows are dependent.
#[inline]
fn factor<T: Real, const M: usize, const N: usize>(a: &mut [[T; M]; N]) -> Option<[T; M]> {
    // Element (c, r) is element c of row r: the loops over r are independent of one another.
    let tolerance = lit::<T>(16.0) * T::EPSILON;
    let mut norm_sq = [T::ZERO; M];
    for c in 0..N {
        for r in 0..M {
            norm_sq[r] += a[c][r] * a[c][r];
        }
    }
    // Reflection k is I - v_k v_k' / (alpha_k v_kk), v_k stored in column k from row k downwards.
    let mut scale = [T::ZERO; M];
    let mut full_rank = true;
    for k in 0..M {
        // Products of what is left of row k with itself and with the rows after it, in one pass.
        // Two sums, so that additions do not wait for one another.
        let (mut dot, mut odd) = ([T::ZERO; M], [T::ZERO; M]);
        for c in k..N {
            let (v, sum) = (a[c][k], if (c - k) & 1 == 0 { &mut dot } else { &mut odd });
            for r in 0..M {
                sum[r] += v * a[c][r];
            }
        }
        for r in 0..M {
            dot[r] += odd[r];
        }
        let head = a[k][k];
        let length = sqrt(dot[k]);
        full_rank &= dot[k] > tolerance * tolerance * norm_sq[k];
        // The sign that adds: v_kk = head - alpha without cancellation.
        let alpha = if head > T::ZERO { -length } else { length };
        let v_kk = head - alpha;
        a[k][k] = v_kk;
        scale[k] = T::ONE / (alpha * v_kk);
        for r in 0..M {
            // v' a_r = (what is left of row k)' a_r - alpha a_kr; no step for the rows before, by a loop that knows its length.
            dot[r] = if r > k { (dot[r] - alpha * a[k][r]) * scale[k] } else { T::ZERO };
        }
        for c in k..N {
            let v = a[c][k];
            for r in 0..M {
                a[c][r] += v * dot[r];
            }
        }
    }
    full_rank.then_some(scale)
}

/// The last K columns of Q: the reflections applied, the last first, to the last K unit vectors.
#[inline]
fn last_columns<T: Real, const M: usize, const N: usize, const K: usize>(
    a: &[[T; M]; N],
    scale: &[T; M],
) -> [[T; K]; N] {
    const { assert!(M + K == N, "the null space of M rows of length N has K = N - M vectors") };
    let mut q = [[T::ZERO; K]; N];
    for j in 0..K {
        q[M + j][j] = T::ONE;
    }
    reflect_back(a, scale, &mut q);
    q
}

/// Applies the reflections, the last first, to K columns.
#[inline]
fn reflect_back<T: Real, const M: usize, const N: usize, const K: usize>(
    a: &[[T; M]; N],
    scale: &[T; M],
    q: &mut [[T; K]; N],
) {
    for k in (0..M).rev() {
        let (mut dot, mut odd) = ([T::ZERO; K], [T::ZERO; K]);
        for c in k..N {
            let sum = if (c - k) & 1 == 0 { &mut dot } else { &mut odd };
            for j in 0..K {
                sum[j] += a[c][k] * q[c][j];
            }
        }
        for j in 0..K {
            dot[j] = (dot[j] + odd[j]) * scale[k];
        }
        for c in k..N {
            for j in 0..K {
                q[c][j] += a[c][k] * dot[j];
            }
        }
    }
}
