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
            // Products of column k of the block with itself and with the columns after it, in one pass. Here and below all
            // columns are worked on, whatever k, by zeros where nothing is to be done: a loop whose length is known is
            // short code, and vectors that begin where others began need not wait for two stores.
            let mut dot = [T::ZERO; N];
            for row in &rows {
                let v = row[k];
                for j in 0..N {
                    dot[j] += v * row[j];
                }
            }
            // What rounding has left of a dependent block shrinks from column to column, until squares underflow.
            let below = dot[k];
            if below <= T::MIN_POSITIVE / T::EPSILON {
                continue;
            }
            // v = (head - alpha, column k of the block), alpha of the sign that adds.
            let head = self.r[k][k];
            let length = sqrt(head * head + below);
            let alpha = if head > T::ZERO { -length } else { length };
            let v0 = head - alpha;
            let scale = T::ONE / (alpha * v0);
            self.r[k][k] = alpha;
            for j in 0..N {
                dot[j] = if j > k { (dot[j] + v0 * self.r[k][j]) * scale } else { T::ZERO };
                self.r[k][j] += v0 * dot[j];
            }
            for row in &mut rows {
                let v = row[k];
                for j in 0..N {
                    row[j] += v * dot[j];
                }
            }
        }
    }

    /// The right singular vector of the smallest singular value, by inverse iteration.
    ///
    /// The error falls by the square of the ratio of the two smallest singular values each time: one or two iterations
    /// where the matrix is nearly rank deficient.
    ///
    /// # Returns
    /// `None` where `r` is zero, not finite, or so large that its squares are not. Compare `value` and `next_value` to
    /// judge the rank.
    ///
    /// # Cost
    /// At most 24 iterations, and one for `next_value`; two triangular solves each.
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
        let mut solver = Self { r: self.r };
        let scale = T::ONE / largest;
        // Inverse iteration does not ask for the exact pivot of a singular factor, only for one that is not zero. The
        // reciprocals of the pivots stand on the diagonal.
        for k in 0..N {
            for j in k..N {
                solver.r[k][j] *= scale;
            }
            let d = solver.r[k][k];
            solver.r[k][k] = T::ONE / if abs(d) > T::EPSILON { d } else { T::EPSILON };
        }
        // Starts without symmetry, so that no likely null vector is orthogonal to them.
        let mut x = [T::ZERO; N];
        let mut y = [T::ZERO; N];
        for k in 0..N {
            let f: T = lit(k as f64);
            x[k] = T::ONE + lit::<T>(0.17) * f;
            y[k] = if k % 2 == 0 { T::ONE } else { lit::<T>(0.11) * f - T::ONE };
        }
        x = unit(&x)?;
        let mut left = x;
        let mut last_change = lit::<T>(4.0);
        for iteration in 1..=MAX_ITERATIONS {
            left = solver.solve_transposed(&x);
            let mut next = unit(&solver.solve(&left))?;
            let mut step = next;
            for (s, a) in step.iter_mut().zip(&x) {
                *s -= *a;
            }
            let change = sqrt(dot(&step, &step));
            // The change shrinks by the same factor each time: the next one would be below rounding.
            if change * change <= lit::<T>(4.0) * T::EPSILON * last_change {
                x = next;
                break;
            }
            // Now and then the whole series of changes to come is taken at once (Aitken).
            if iteration % 3 == 0 && change < last_change * lit(0.99) {
                let series = change / (last_change - change);
                for (a, s) in next.iter_mut().zip(&step) {
                    *a += series * *s;
                }
                next = unit(&next)?;
                last_change = lit(4.0);
            } else {
                last_change = change;
            }
            x = next;
        }
        // The same on what is orthogonal to both singular vectors found.
        let left = unit(&left)?;
        y = unit(&without(&y, &x))?;
        y = unit(&without(&solver.solve_transposed(&y), &left))?;
        y = unit(&without(&solver.solve(&y), &x))?;
        let (value, next_value) = (self.stretch(&x), self.stretch(&y));
        (is_finite(value) && is_finite(next_value)).then_some(LeastSingular { vector: x, value, next_value })
    }

    /// `R^-T x`, where the reciprocals of the pivots stand on the diagonal of `r`.
    #[inline]
    fn solve_transposed(&self, x: &[T; N]) -> [T; N] {
        let mut x = *x;
        for k in 0..N {
            let y = x[k] * self.r[k][k];
            x[k] = y;
            for j in k + 1..N {
                x[j] -= self.r[k][j] * y;
            }
        }
        x
    }

    /// `R^-1 x`, where the reciprocals of the pivots stand on the diagonal of `r`.
    #[inline]
    fn solve(&self, x: &[T; N]) -> [T; N] {
        let mut x = *x;
        for k in (0..N).rev() {
            let y = x[k] * self.r[k][k];
            x[k] = y;
            for j in 0..k {
                x[j] -= self.r[j][k] * y;
            }
        }
        x
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

const MAX_ITERATIONS: u32 = 24;

fn dot<T: Real, const N: usize>(a: &[T; N], b: &[T; N]) -> T {
    let mut sum = T::ZERO;
    for (a, b) in a.iter().zip(b) {
        sum += *a * *b;
    }
    sum
}

/// `None` for a vector of length zero or one that is not finite.
fn unit<T: Real, const N: usize>(x: &[T; N]) -> Option<[T; N]> {
    let norm = sqrt(dot(x, x));
    let inverse = T::ONE / norm;
    (norm > T::ZERO && norm <= T::MAX).then(|| x.map(|v| v * inverse))
}

/// The part of `y` that is orthogonal to the unit vector `x`.
fn without<T: Real, const N: usize>(y: &[T; N], x: &[T; N]) -> [T; N] {
    let along = dot(x, y);
    let mut result = *y;
    for (y, x) in result.iter_mut().zip(x) {
        *y -= along * *x;
    }
    result
}
