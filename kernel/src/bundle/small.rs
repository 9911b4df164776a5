//! Products of 3-vectors and 3x3 matrices as plain arrays: the inner loops of the window are made of these alone.

use crate::Real;
use crate::real::sqrt;

pub(super) type V3<T> = [T; 3];
/// Row by row.
pub(super) type M3<T> = [[T; 3]; 3];
/// Upper triangle of a symmetric 3x3 matrix: 00 01 02 11 12 22.
pub(super) type S3<T> = [T; 6];

#[inline(always)]
pub(super) fn dot<T: Real>(a: &V3<T>, b: &V3<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(super) fn cross<T: Real>(a: &V3<T>, b: &V3<T>) -> V3<T> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
pub(super) fn add<T: Real>(a: &V3<T>, b: &V3<T>) -> V3<T> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
pub(super) fn sub<T: Real>(a: &V3<T>, b: &V3<T>) -> V3<T> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `a += b s`
#[inline(always)]
pub(super) fn add_scaled<T: Real>(a: &mut V3<T>, b: &V3<T>, s: T) {
    for k in 0..3 {
        a[k] += b[k] * s;
    }
}

/// `M v`
#[inline(always)]
pub(super) fn mul<T: Real>(m: &M3<T>, v: &V3<T>) -> V3<T> {
    [dot(&m[0], v), dot(&m[1], v), dot(&m[2], v)]
}

/// `M' v`
#[inline(always)]
pub(super) fn mul_transposed<T: Real>(m: &M3<T>, v: &V3<T>) -> V3<T> {
    [
        m[0][0] * v[0] + m[1][0] * v[1] + m[2][0] * v[2],
        m[0][1] * v[0] + m[1][1] * v[1] + m[2][1] * v[2],
        m[0][2] * v[0] + m[1][2] * v[1] + m[2][2] * v[2],
    ]
}

/// `A B'`
#[inline(always)]
pub(super) fn product_transposed<T: Real>(a: &M3<T>, b: &M3<T>) -> M3<T> {
    [mul(b, &a[0]), mul(b, &a[1]), mul(b, &a[2])]
}

/// The inverse `[l00 l10 l11 l20 l21 l22]` of the Cholesky factor of a symmetric matrix, `S^-1 = L^-T L^-1`; none where
/// a pivot is not above `floor` times its diagonal.
#[inline(always)]
pub(super) fn inverse_factor<T: Real>(s: &S3<T>, floor: T) -> Option<[T; 6]> {
    let p0 = s[0];
    if !(p0 > T::ZERO) {
        return None;
    }
    let i0 = T::ONE / sqrt(p0);
    let (l10, l20) = (s[1] * i0, s[2] * i0);
    let p1 = s[3] - l10 * l10;
    if !(p1 > floor * s[3]) {
        return None;
    }
    let i1 = T::ONE / sqrt(p1);
    let l21 = (s[4] - l20 * l10) * i1;
    let p2 = s[5] - l20 * l20 - l21 * l21;
    if !(p2 > floor * s[5]) {
        return None;
    }
    let i2 = T::ONE / sqrt(p2);
    let m10 = -l10 * i0 * i1;
    let m21 = -l21 * i1 * i2;
    let m20 = -(l20 * i0 + l21 * m10) * i2;
    let all = [i0, m10, i1, m20, m21, i2];
    (all[5] <= T::MAX && all[2] <= T::MAX && all[0] <= T::MAX).then_some(all)
}

/// `L^-1 v` for the packed inverse factor of [`inverse_factor`].
#[inline(always)]
pub(super) fn lower<T: Real>(l: &[T; 6], v: &V3<T>) -> V3<T> {
    [l[0] * v[0], l[1] * v[0] + l[2] * v[1], l[3] * v[0] + l[4] * v[1] + l[5] * v[2]]
}

/// `L^-T v`
#[inline(always)]
pub(super) fn upper<T: Real>(l: &[T; 6], v: &V3<T>) -> V3<T> {
    [l[0] * v[0] + l[1] * v[1] + l[3] * v[2], l[2] * v[1] + l[4] * v[2], l[5] * v[2]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_factor_solves() {
        let s = [4.0_f64, 1.0, -0.5, 3.0, 0.25, 2.0];
        let m = [[s[0], s[1], s[2]], [s[1], s[3], s[4]], [s[2], s[4], s[5]]];
        let l = inverse_factor(&s, 1e-12).unwrap();
        let b = [1.0, -2.0, 0.5];
        let x = upper(&l, &lower(&l, &b));
        let r = sub(&mul(&m, &x), &b);
        assert!(dot(&r, &r) < 1e-28);
        assert!(inverse_factor(&[1.0_f64, 1.0, 0.0, 1.0, 0.0, 1.0], 1e-12).is_none());
    }
}
