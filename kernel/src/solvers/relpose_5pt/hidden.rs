//! Elimination of all unknowns but one: three equations linear in (x, y, 1) with polynomials in z, and the
//! polynomial of degree 10 that is their determinant.

use super::cubics::Cubic;
use super::polish::{cross, norm_sq, select};
use crate::Real;
use crate::linalg::batch::Batch;
use crate::real::{abs, sqrt};

/// `x * row.x(z) + y * row.y(z) + row.one(z) = 0`: the coefficients of the two cubics and the quartic, each from z^0
/// upwards, one after the other.
#[derive(Clone, Copy)]
pub(super) struct HiddenRow<T>([T; 13]);

/// Gauss elimination of the ten cubics (partial pivoting), as far as the six rows that lead with
/// xxz xxw yyz yyw xyz xyw need it; then the rows that are free of these six. `None` where a pivot vanishes.
#[inline(never)]
pub(super) fn eliminate<T: Real>(m: &mut [Cubic<T>; 10], rows: &mut [HiddenRow<T>; 3]) -> Option<()> {
    // Rows change places by their addresses.
    let mut m = m.each_mut();
    let mut inverse = [T::ZERO; 10];
    // The first ten columns. The multipliers stay where they eliminate.
    for k in 0..10 {
        let (mut pivot, mut largest) = (k, abs(m[k][k]));
        for i in k + 1..10 {
            let size = abs(m[i][k]);
            if size > largest {
                (pivot, largest) = (i, size);
            }
        }
        if !(largest > T::ZERO) {
            return None;
        }
        m.swap(k, pivot);
        inverse[k] = T::ONE / m[k][k];
        // All ten whatever k, with zeros up to k: cheaper than a loop whose length varies.
        let mut top = [T::ZERO; 10];
        for c in 0..10 {
            top[c] = if c > k { m[k][c] } else { T::ZERO };
        }
        for row in m.iter_mut().skip(k + 1) {
            let f = row[k] * inverse[k];
            for c in 0..10 {
                row[c] -= f * top[c];
            }
            row[k] = f;
        }
    }
    // The last ten columns: forward, then back for the rows that are needed.
    for k in 1..10 {
        let mut row = last_ten(m[k]);
        for j in 0..k {
            subtract(&mut row, m[k][j], m[j]);
        }
        store(m[k], &row);
    }
    for k in (4..10).rev() {
        let mut row = last_ten(m[k]);
        for j in k + 1..10 {
            subtract(&mut row, m[k][j], m[j]);
        }
        row.iter_mut().for_each(|v| *v *= inverse[k]);
        store(m[k], &row);
    }
    // Row p leads with a monomial times z, row q with the same monomial times w: p - z q is free of both.
    let [.., p0, q0, p1, q1, p2, q2] = m;
    for (HiddenRow(row), [p, q]) in rows.iter_mut().zip([[p0, q0], [p1, q1], [p2, q2]]) {
        *row = [
            p[12],
            p[11] - q[12],
            p[10] - q[11],
            -q[10],
            p[15],
            p[14] - q[15],
            p[13] - q[14],
            -q[13],
            p[19],
            p[18] - q[19],
            p[17] - q[18],
            p[16] - q[17],
            -q[16],
        ];
    }
    orthonormalise(rows)
}

#[inline(always)]
fn last_ten<T: Real>(row: &Cubic<T>) -> [T; 10] {
    let mut last = [T::ZERO; 10];
    for c in 0..10 {
        last[c] = row[10 + c];
    }
    last
}

#[inline(always)]
fn store<T: Real>(row: &mut Cubic<T>, last: &[T; 10]) {
    for c in 0..10 {
        row[10 + c] = last[c];
    }
}

#[inline(always)]
fn subtract<T: Real>(row: &mut [T; 10], f: T, other: &Cubic<T>) {
    for c in 0..10 {
        row[c] -= f * other[10 + c];
    }
}

impl<T: Real> HiddenRow<T> {
    pub(super) const ZERO: Self = Self([T::ZERO; 13]);

    /// The polynomials of the row.
    #[inline(always)]
    fn polynomials(&mut self) -> [&mut [T]; 3] {
        let (cubics, quartic) = self.0.split_at_mut(8);
        let (x, y) = cubics.split_at_mut(4);
        [x, y, quartic]
    }

    /// Makes it the row in 1 / z.
    pub(super) fn reverse(&mut self) {
        let [x, y, one] = self.polynomials();
        x.reverse();
        y.reverse();
        one.reverse();
    }

    /// Makes it the row in z - s.
    pub(super) fn shift(&mut self, s: T) {
        let [x, y, one] = self.polynomials();
        shift(x, s);
        shift(y, s);
        shift(one, s);
    }

    #[cfg_attr(not(small), inline(always))]
    fn dot(&self, other: &Self) -> T {
        // Four sums, so that no addition waits for the one before it.
        let mut sum = [T::ZERO; 4];
        for i in 0..4 {
            sum[i] = self.0[i] * other.0[i];
        }
        for i in 4..12 {
            sum[i % 4] += self.0[i] * other.0[i];
        }
        (sum[0] + sum[1]) + (sum[2] + sum[3]) + self.0[12] * other.0[12]
    }

    #[inline(always)]
    fn add_scaled(&mut self, other: &Self, f: T) {
        for i in 0..13 {
            self.0[i] += f * other.0[i];
        }
    }

    #[inline(always)]
    fn scale(&mut self, f: T) {
        for i in 0..13 {
            self.0[i] *= f;
        }
    }
}

/// Makes a polynomial that in z - s (Horner's scheme, repeated).
#[cfg_attr(not(small), inline(always))]
#[cfg_attr(small, inline(never))]
fn shift<T: Real>(polynomial: &mut [T], s: T) {
    let Some((last, lower)) = polynomial.split_last_mut() else { return };
    for level in 0..lower.len() {
        let mut above = *last;
        for c in lower.iter_mut().skip(level).rev() {
            *c += s * above;
            above = *c;
        }
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
    let mut wide = [[W::ZERO; 13]; 3];
    for (wide, row) in wide.iter_mut().zip(rows) {
        for (wide, &x) in wide.iter_mut().zip(&row.0) {
            *wide = <W as Real>::from_f64(x.to_f64());
        }
    }
    let [a, b, c] = &wide;
    let mut det = [W::ZERO; 11];
    for (first, second, third) in [(a, b, c), (b, c, a), (c, a, b)] {
        let mut minor = [W::ZERO; 7];
        for p in 0..4 {
            for q in 0..4 {
                minor[p + q] += first[p] * second[4 + q] - second[p] * first[4 + q];
            }
        }
        for p in 0..7 {
            for q in 0..5 {
                det[p + q] += minor[p] * third[8 + q];
            }
        }
    }
    det
}

/// The null vectors (x, y, 1) of the rows at z = `num` / `den`, homogeneous: unit vectors of the coefficients of the four
/// basis matrices. The larger of |num|, |den| is near 1.
#[inline(always)]
pub(super) fn unknowns<T: Real, const L: usize>(
    rows: &[HiddenRow<T>; 3],
    num: Batch<T, L>,
    den: Batch<T, L>,
) -> [Batch<T, L>; 4] {
    let (n2, nd, d2) = (num * num, num * den, den * den);
    let cubics = [d2 * den, d2 * num, n2 * den, n2 * num];
    let quartics = [d2 * d2, d2 * nd, n2 * d2, n2 * nd, n2 * n2];
    let cubic = |p0, p1, p2, p3| {
        (cubics[0].times(p0) + cubics[1].times(p1)) + (cubics[2].times(p2) + cubics[3].times(p3))
    };
    let mut b = [[Batch::splat(T::ZERO); 3]; 3];
    for (b, HiddenRow(p)) in b.iter_mut().zip(rows) {
        let low = quartics[0].times(p[8]) + quartics[1].times(p[9]);
        let high = quartics[3].times(p[11]) + quartics[4].times(p[12]);
        *b = [
            cubic(p[0], p[1], p[2], p[3]),
            cubic(p[4], p[5], p[6], p[7]),
            low + quartics[2].times(p[10]) + high,
        ];
    }
    let [mut best, second, third] = [cross(&b[0], &b[1]), cross(&b[1], &b[2]), cross(&b[2], &b[0])];
    let mut largest = norm_sq(&best);
    for other in [second, third] {
        let size = norm_sq(&other);
        let mask = size.greater(largest);
        largest = Batch::select(mask, size, largest);
        best = select(mask, &other, &best);
    }
    // x and y come divided by the scale of the homogeneous z.
    let c = [best[0], best[1], best[2] * num, best[2] * den];
    let s = Batch::splat(T::ONE) / (c[0] * c[0] + c[1] * c[1] + (c[2] * c[2] + c[3] * c[3])).root();
    [c[0] * s, c[1] * s, c[2] * s, c[3] * s]
}
