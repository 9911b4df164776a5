//! Elimination of all unknowns but one: three equations linear in (x, y, 1) with polynomials in z, and the
//! polynomial of degree 10 that is their determinant.

use super::cubics::Cubic;
use super::polish::{cross, norm_sq, select};
use crate::Real;
use crate::linalg::four::Four;
use crate::real::{abs, sqrt};

/// `x * row.x(z) + y * row.y(z) + row.one(z) = 0`, coefficients from z^0 upwards.
#[derive(Clone, Copy)]
pub(super) struct HiddenRow<T> {
    pub(super) x: [T; 4],
    pub(super) y: [T; 4],
    pub(super) one: [T; 5],
}

/// Gauss elimination of the ten cubics (partial pivoting), as far as the six rows that lead with
/// xxz xxw yyz yyw xyz xyw need it. `None` where a pivot vanishes.
#[inline(never)]
pub(super) fn eliminate<T: Real>(m: &mut [Cubic<T>; 10]) -> Option<[HiddenRow<T>; 3]> {
    let mut inverse = [T::ZERO; 10];
    inverse[0] = column::<T, 0>(m)?;
    inverse[1] = column::<T, 1>(m)?;
    inverse[2] = column::<T, 2>(m)?;
    inverse[3] = column::<T, 3>(m)?;
    inverse[4] = column::<T, 4>(m)?;
    inverse[5] = column::<T, 5>(m)?;
    inverse[6] = column::<T, 6>(m)?;
    inverse[7] = column::<T, 7>(m)?;
    inverse[8] = column::<T, 8>(m)?;
    inverse[9] = column::<T, 9>(m)?;
    // Back substitution of rows 4 to 9 in the last ten columns.
    for k in (4..10).rev() {
        let mut row = m[k];
        for j in k + 1..10 {
            let f = row[j];
            for c in 10..20 {
                row[c] -= f * m[j][c];
            }
        }
        for c in 10..20 {
            m[k][c] = row[c] * inverse[k];
        }
    }
    // Row p leads with a monomial times z, row q with the same monomial times w: p - z q is free of both.
    let hidden = |p: &Cubic<T>, q: &Cubic<T>| HiddenRow {
        x: [p[12], p[11] - q[12], p[10] - q[11], -q[10]],
        y: [p[15], p[14] - q[15], p[13] - q[14], -q[13]],
        one: [p[19], p[18] - q[19], p[17] - q[18], p[16] - q[17], -q[16]],
    };
    let mut rows = [hidden(&m[4], &m[5]), hidden(&m[6], &m[7]), hidden(&m[8], &m[9])];
    orthonormalise(&mut rows)?;
    Some(rows)
}

/// Brings the largest element of column `K`, from row `K` down, into row `K` and eliminates the column below it. The
/// inverse of the pivot.
#[inline(always)]
fn column<T: Real, const K: usize>(m: &mut [Cubic<T>; 10]) -> Option<T> {
    let (mut pivot, mut largest) = (K, abs(m[K][K]));
    for i in K + 1..10 {
        let size = abs(m[i][K]);
        if size > largest {
            (pivot, largest) = (i, size);
        }
    }
    if !(largest > T::ZERO) {
        return None;
    }
    // Row K goes where the pivot's row was; no branch, for which of the two happens is a coin's toss.
    let mut row = [T::ZERO; 20];
    for c in K..20 {
        row[c] = m[pivot][c];
        m[pivot][c] = m[K][c];
    }
    let inverse = T::ONE / row[K];
    m[K] = row;
    for i in K + 1..10 {
        let f = m[i][K] * inverse;
        for c in K + 1..20 {
            m[i][c] -= f * row[c];
        }
    }
    Some(inverse)
}

impl<T: Real> HiddenRow<T> {
    /// The row in 1 / z.
    pub(super) fn reversed(mut self) -> Self {
        self.x.reverse();
        self.y.reverse();
        self.one.reverse();
        self
    }

    /// The row in z - s (Horner's scheme, repeated).
    pub(super) fn shifted(mut self, s: T) -> Self {
        for level in 0..3 {
            for i in (level..3).rev() {
                self.x[i] += s * self.x[i + 1];
                self.y[i] += s * self.y[i + 1];
            }
        }
        for level in 0..4 {
            for i in (level..4).rev() {
                self.one[i] += s * self.one[i + 1];
            }
        }
        self
    }

    #[inline(always)]
    fn dot(&self, other: &Self) -> T {
        // Four sums, so that no addition waits for the one before it.
        let mut sum = self.x;
        for i in 0..4 {
            sum[i] *= other.x[i];
        }
        for i in 0..4 {
            sum[i] += self.y[i] * other.y[i];
        }
        for i in 0..4 {
            sum[i] += self.one[i] * other.one[i];
        }
        (sum[0] + sum[1]) + (sum[2] + sum[3]) + self.one[4] * other.one[4]
    }

    #[inline(always)]
    fn add_scaled(&mut self, other: &Self, f: T) {
        for i in 0..4 {
            self.x[i] += f * other.x[i];
            self.y[i] += f * other.y[i];
        }
        for i in 0..5 {
            self.one[i] += f * other.one[i];
        }
    }

    #[inline(always)]
    fn scale(&mut self, f: T) {
        self.x = self.x.map(|v| v * f);
        self.y = self.y.map(|v| v * f);
        self.one = self.one.map(|v| v * f);
    }
}

/// Gram-Schmidt on the rows: the determinant changes by a factor only, and its coefficients keep their digits.
#[inline(always)]
fn orthonormalise<T: Real>([a, b, c]: &mut [HiddenRow<T>; 3]) -> Option<()> {
    let s = T::ONE / a.dot(a);
    b.add_scaled(a, -(a.dot(b) * s));
    c.add_scaled(a, -(a.dot(c) * s));
    c.add_scaled(b, -(b.dot(c) / b.dot(b)));
    let norms = [a.dot(a), b.dot(b), c.dot(c)];
    for (row, n) in [a, b, c].into_iter().zip(norms) {
        // False for NaN, too.
        if !(n > T::ZERO && n <= T::MAX) {
            return None;
        }
        row.scale(T::ONE / sqrt(n));
    }
    Some(())
}

/// The determinant of the three rows, coefficients from z^0 to z^10, in the scalar `W`.
#[inline]
pub(super) fn determinant<T: Real, W: Real>(rows: &[HiddenRow<T>; 3]) -> [W; 11] {
    let wide4 = |v: &[T; 4]| v.map(|x| <W as Real>::from_f64(x.to_f64()));
    let [a, b, c] =
        rows.each_ref().map(|r| (wide4(&r.x), wide4(&r.y), r.one.map(|x| <W as Real>::from_f64(x.to_f64()))));
    let mut det = [W::ZERO; 11];
    for (first, second, third) in [(&a, &b, &c), (&b, &c, &a), (&c, &a, &b)] {
        let mut minor = [W::ZERO; 7];
        for p in 0..4 {
            for q in 0..4 {
                minor[p + q] += first.0[p] * second.1[q] - second.0[p] * first.1[q];
            }
        }
        for p in 0..7 {
            for q in 0..5 {
                det[p + q] += minor[p] * third.2[q];
            }
        }
    }
    det
}

/// The null vectors (x, y, 1) of the rows at z = `num` / `den`, homogeneous: unit vectors of the coefficients of the four
/// basis matrices. The larger of |num|, |den| is near 1.
#[inline(always)]
pub(super) fn unknowns<T: Real>(rows: &[HiddenRow<T>; 3], num: Four<T>, den: Four<T>) -> [Four<T>; 4] {
    let (n2, nd, d2) = (num * num, num * den, den * den);
    let cubics = [d2 * den, d2 * num, n2 * den, n2 * num];
    let quartics = [d2 * d2, d2 * nd, n2 * d2, n2 * nd, n2 * n2];
    let b = rows.map(|r| {
        let cubic = |p: &[T; 4]| {
            (cubics[0].times(p[0]) + cubics[1].times(p[1])) + (cubics[2].times(p[2]) + cubics[3].times(p[3]))
        };
        let p = r.one;
        let low = quartics[0].times(p[0]) + quartics[1].times(p[1]);
        let high = quartics[3].times(p[3]) + quartics[4].times(p[4]);
        [cubic(&r.x), cubic(&r.y), low + quartics[2].times(p[2]) + high]
    });
    let [mut best, second, third] = [cross(&b[0], &b[1]), cross(&b[1], &b[2]), cross(&b[2], &b[0])];
    let mut largest = norm_sq(&best);
    for other in [second, third] {
        let size = norm_sq(&other);
        let mask = size.greater(largest);
        largest = Four::select(mask, size, largest);
        best = select(mask, &other, &best);
    }
    // x and y come divided by the scale of the homogeneous z.
    let c = [best[0], best[1], best[2] * num, best[2] * den];
    let s = Four::splat(T::ONE) / (c[0] * c[0] + c[1] * c[1] + (c[2] * c[2] + c[3] * c[3])).root();
    c.map(|v| v * s)
}
