//! The triangular factor of a tall matrix whose rows come in blocks, and the vector that the rows least stretch.

use crate::Real;
use crate::real::{abs, is_finite, lit, max, sqrt};

/// The factor `R` of `A = Q R`, for a matrix `A` of any number of rows of length `N` that are folded in block by block.
///
/// `R'R = A'A` without ever forming the squares, in `N * N` numbers of memory whatever the number of rows.
///
/// # Examples
/// ```
/// use epipole::linalg::RowQr;
/// let mut qr = RowQr::<f64, 3>::new();
/// qr.fold([[1.0, 2.0, 2.0], [0.0, 1.0, -1.0]]);
/// qr.fold([[1.0, 3.0, 1.0], [0.0; 3]]); // a row of zeros counts for nothing
/// let least = qr.least_singular().unwrap();
/// let n = least.vector;
/// assert!((n[1] - n[2]).abs() < 1e-14 && (n[0] + 4.0 * n[1]).abs() < 1e-14);
/// assert!(least.value < 1e-14 && least.next_value > 1.0);
/// ```
#[derive(Clone, Debug)]
pub struct RowQr<T: Real, const N: usize> {
    /// Upper triangle; below the diagonal zeros.
    r: [[T; N]; N],
}

/// The smallest singular value of a matrix, its right singular vector, and the next larger value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeastSingular<T: Real, const N: usize> {
    /// The unit vector `x` for which `|A x|` is least; its sign is arbitrary but reproducible.
    pub vector: [T; N],
    /// `|A x|`, the smallest singular value. Rounding leaves about `EPSILON` times the largest one of an exact zero.
    pub value: T,
    /// An estimate of the second smallest singular value: a value comparable to `value` says that `vector` is not
    /// determined (degenerate data).
    pub next_value: T,
}

impl<T: Real, const N: usize> Default for RowQr<T, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real, const N: usize> RowQr<T, N> {
    /// The factor of a matrix without rows.
    #[must_use]
    pub const fn new() -> Self {
        Self { r: [[T::ZERO; N]; N] }
    }

    /// The upper triangular factor.
    #[must_use]
    pub const fn r(&self) -> &[[T; N]; N] {
        &self.r
    }

    /// Folds `B` more rows in, by `N` Householder reflections of length `B + 1`. A last incomplete block is filled
    /// with rows of zeros.
    ///
    /// A larger block spends fewer square roots and divisions on a row: 4 to 8 is a good choice. A NaN or infinity
    /// among the rows spoils `r` and shows as `None` in [`Self::least_singular`].
    #[inline]
    pub fn fold<const B: usize>(&mut self, mut rows: [[T; N]; B]) {
        for k in 0..N {
            let mut below = T::ZERO;
            for row in &rows {
                below += row[k] * row[k];
            }
            if below == T::ZERO {
                continue;
            }
            // v = (head - alpha, column k of the block), alpha of the sign that adds.
            let head = self.r[k][k];
            let length = sqrt(head * head + below);
            let alpha = if head > T::ZERO { -length } else { length };
            let v0 = head - alpha;
            let scale = T::ONE / (alpha * v0);
            self.r[k][k] = alpha;
            let mut dot = [T::ZERO; N];
            for j in k + 1..N {
                dot[j] = v0 * self.r[k][j];
            }
            for row in &rows {
                let v = row[k];
                for j in k + 1..N {
                    dot[j] += v * row[j];
                }
            }
            for j in k + 1..N {
                dot[j] *= scale;
                self.r[k][j] += v0 * dot[j];
            }
            for row in &mut rows {
                let v = row[k];
                for j in k + 1..N {
                    row[j] += v * dot[j];
                }
            }
        }
    }

    /// The right singular vector of the smallest singular value, by inverse iteration on a plane.
    ///
    /// Two vectors are iterated with `(R'R)^-1`, so the error falls by the squared ratio of the smallest to the third
    /// smallest singular value each time, and the smaller Ritz value of the plane is taken.
    ///
    /// # Returns
    /// `None` where `r` is zero, not finite, or so large that its squares are not. Compare `value` and `next_value` to judge the rank.
    ///
    /// # Cost
    /// Four iterations of four triangular solves.
    #[inline]
    #[must_use]
    pub fn least_singular(&self) -> Option<LeastSingular<T, N>> {
        let mut largest = T::ZERO;
        for k in 0..N {
            for j in k..N {
                if !is_finite(self.r[k][j]) {
                    return None;
                }
                largest = max(largest, abs(self.r[k][j]));
            }
        }
        if !(largest > T::ZERO) {
            return None;
        }
        // Inverse iteration does not ask for the exact pivot of a singular factor, only for one that is not zero.
        let floor = largest * T::EPSILON;
        let mut inverse = [T::ZERO; N];
        for k in 0..N {
            let d = self.r[k][k];
            inverse[k] = T::ONE / if abs(d) > floor { d } else { floor };
        }
        // Columns of [x0, x1]: a start without symmetry, so that no likely null vector is orthogonal to it.
        let mut x = [[T::ZERO; 2]; N];
        for k in 0..N {
            let f: T = lit(k as f64);
            let sign: T = if k % 2 == 0 { T::ONE } else { -T::ONE };
            x[k] = [T::ONE + lit::<T>(0.17) * f, sign - lit::<T>(0.11) * f];
        }
        orthonormalise(&mut x)?;
        for _ in 0..ITERATIONS {
            // R' y = x, forwards, then R x = y, backwards.
            for k in 0..N {
                let y = x[k].map(|v| v * inverse[k]);
                x[k] = y;
                for j in k + 1..N {
                    x[j] = [x[j][0] - self.r[k][j] * y[0], x[j][1] - self.r[k][j] * y[1]];
                }
            }
            orthonormalise(&mut x)?;
            for k in (0..N).rev() {
                let mut y = x[k];
                for j in k + 1..N {
                    y = [y[0] - self.r[k][j] * x[j][0], y[1] - self.r[k][j] * x[j][1]];
                }
                x[k] = y.map(|v| v * inverse[k]);
            }
            orthonormalise(&mut x)?;
        }
        // Ritz: the 2x2 matrix of R on the plane, its right singular vectors by one rotation.
        let (mut a, mut b, mut c) = (T::ZERO, T::ZERO, T::ZERO);
        for k in 0..N {
            let mut y = [T::ZERO; 2];
            for j in k..N {
                y = [y[0] + self.r[k][j] * x[j][0], y[1] + self.r[k][j] * x[j][1]];
            }
            a += y[0] * y[0];
            b += y[0] * y[1];
            c += y[1] * y[1];
        }
        let half = (c - a) * T::HALF;
        let root = sqrt(half * half + b * b);
        // tan of the rotation, the smaller of the two angles.
        let t = if root > T::ZERO { b / (abs(half) + root) } else { T::ZERO };
        let cos = T::ONE / sqrt(T::ONE + t * t);
        let sin = t * cos;
        let mut vectors = [[T::ZERO; N]; 2];
        let sin = if half > T::ZERO { -sin } else { sin };
        for k in 0..N {
            vectors[0][k] = cos * x[k][0] + sin * x[k][1];
            vectors[1][k] = cos * x[k][1] - sin * x[k][0];
        }
        let value = [self.stretch(&vectors[0]), self.stretch(&vectors[1])];
        let least = if value[0] <= value[1] { 0 } else { 1 };
        let finite = is_finite(value[0]) && is_finite(value[1]);
        finite.then_some(LeastSingular {
            vector: vectors[least],
            value: value[least],
            next_value: value[1 - least],
        })
    }

    /// `|R x|`
    fn stretch(&self, x: &[T; N]) -> T {
        let mut sum = T::ZERO;
        for k in 0..N {
            let mut y = T::ZERO;
            for j in k..N {
                y += self.r[k][j] * x[j];
            }
            sum += y * y;
        }
        sqrt(sum)
    }
}

const ITERATIONS: u32 = 4;

/// Gram-Schmidt on two columns, the second twice (it may lie almost along the first).
fn orthonormalise<T: Real, const N: usize>(x: &mut [[T; 2]; N]) -> Option<()> {
    // Scaled first: the solves may have made the elements as large as 1 / EPSILON^2.
    let mut largest = [T::ZERO; 2];
    for row in x.iter() {
        largest = [max(largest[0], abs(row[0])), max(largest[1], abs(row[1]))];
    }
    if !(largest[0] > T::ZERO && largest[1] > T::ZERO && largest[0] <= T::MAX && largest[1] <= T::MAX) {
        return None;
    }
    let scale = [T::ONE / largest[0], T::ONE / largest[1]];
    let mut norm_sq = T::ZERO;
    for row in x.iter_mut() {
        *row = [row[0] * scale[0], row[1] * scale[1]];
        norm_sq += row[0] * row[0];
    }
    let inverse = T::ONE / sqrt(norm_sq);
    for row in x.iter_mut() {
        row[0] *= inverse;
    }
    for _ in 0..2 {
        let (mut dot, mut norm_sq) = (T::ZERO, T::ZERO);
        for row in x.iter() {
            dot += row[0] * row[1];
        }
        for row in x.iter_mut() {
            row[1] -= dot * row[0];
            norm_sq += row[1] * row[1];
        }
        if !(norm_sq > T::ZERO) {
            return None;
        }
        let inverse = T::ONE / sqrt(norm_sq);
        for row in x.iter_mut() {
            row[1] *= inverse;
        }
    }
    Some(())
}
