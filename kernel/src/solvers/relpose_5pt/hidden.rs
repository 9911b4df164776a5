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
#[inline]
pub(super) fn eliminate<T: Real>(mut m: [Cubic<T>; 10]) -> Option<[HiddenRow<T>; 3]> {
    for k in 0..10 {
        let (mut pivot, mut largest) = (k, abs(m[k][k]));
        for i in k + 1..10 {
            if abs(m[i][k]) > largest {
                (pivot, largest) = (i, abs(m[i][k]));
            }
        }
        if !(largest > T::ZERO) {
            return None;
        }
        if pivot != k {
            m.swap(k, pivot);
        }
        let inverse = T::ONE / m[k][k];
        let row = m[k].map(|v| v * inverse);
        m[k] = row;
        for i in k + 1..10 {
            let f = m[i][k];
            for c in k + 1..20 {
                m[i][c] -= f * row[c];
            }
        }
    }
    // Back substitution of rows 4 to 8 in the last ten columns.
    for k in (5..10).rev() {
        let row = m[k];
        for i in 4..k {
            let f = m[i][k];
            for c in 10..20 {
                m[i][c] -= f * row[c];
            }
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

    fn dot(&self, other: &Self) -> T {
        let mut sum = T::ZERO;
        for i in 0..4 {
            sum += self.x[i] * other.x[i] + self.y[i] * other.y[i];
        }
        for i in 0..5 {
            sum += self.one[i] * other.one[i];
        }
        sum
    }

    fn add_scaled(&mut self, other: &Self, f: T) {
        for i in 0..4 {
            self.x[i] += f * other.x[i];
            self.y[i] += f * other.y[i];
        }
        for i in 0..5 {
            self.one[i] += f * other.one[i];
        }
    }

    fn scale(&mut self, f: T) {
        self.x = self.x.map(|v| v * f);
        self.y = self.y.map(|v| v * f);
        self.one = self.one.map(|v| v * f);
    }
}

/// Gram-Schmidt on the rows: the determinant changes by a factor only, and its coefficients keep their digits.
fn orthonormalise<T: Real>(rows: &mut [HiddenRow<T>; 3]) -> Option<()> {
    let [a, b, c] = rows;
    let unit = |r: &mut HiddenRow<T>| {
        let n = r.dot(r);
        r.scale(T::ONE / sqrt(n));
        (n > T::ZERO).then_some(())
    };
    unit(a)?;
    unit(b)?;
    unit(c)?;
    b.add_scaled(a, -a.dot(b));
    unit(b)?;
    c.add_scaled(a, -a.dot(c));
    c.add_scaled(b, -b.dot(c));
    unit(c)
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
    let s = Four::splat(T::ONE) / (c[0] * c[0] + c[1] * c[1] + (c[2] * c[2] + c[3] * c[3])).sqrt();
    c.map(|v| v * s)
}
