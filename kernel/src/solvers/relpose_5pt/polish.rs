//! Newton steps from matrices of the null space to the essential matrices, four side by side.
//!
//! At `E = s (u1 v1' + u2 v2')` the matrices normal to the essential matrices are spanned by `u1 v1' - u2 v2'`,
//! `u1 v2' + u2 v1'` and `u3 v3'`. A combination `c` of the four basis matrices that is orthogonal to these three is
//! the null vector of a 3x4 matrix: that is the whole step, and it converges quadratically.

use crate::Real;
use crate::linalg::four::Four;

pub(super) type V3<T> = [Four<T>; 3];

#[inline(always)]
pub(super) fn cross<T: Real>(u: &V3<T>, v: &V3<T>) -> V3<T> {
    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
}

#[inline(always)]
pub(super) fn norm_sq<T: Real>(v: &V3<T>) -> Four<T> {
    v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
}

#[inline(always)]
fn unit<T: Real>(v: &V3<T>) -> V3<T> {
    let s = Four::splat(T::ONE) / norm_sq(v).root();
    [v[0] * s, v[1] * s, v[2] * s]
}

#[inline(always)]
pub(super) fn select<T: Real, const N: usize>(
    mask: [bool; 4],
    a: &[Four<T>; N],
    b: &[Four<T>; N],
) -> [Four<T>; N] {
    let mut selected = *b;
    for (s, &a) in selected.iter_mut().zip(a) {
        *s = Four::select(mask, a, *s);
    }
    selected
}

/// One step from the unit vectors `c`: the next unit vectors, and the squared lengths of the steps.
#[inline(never)]
pub(super) fn newton_step<T: Real>(basis: &[[T; 4]; 9], c: &[Four<T>; 4]) -> ([Four<T>; 4], Four<T>) {
    let e =
        basis.map(|[b0, b1, b2, b3]| (c[0].times(b0) + c[1].times(b1)) + (c[2].times(b2) + c[3].times(b3)));
    let columns = [[e[0], e[3], e[6]], [e[1], e[4], e[7]], [e[2], e[5], e[8]]];
    // u1 along the largest column; the left null vector from it and the better of the others.
    let [mut first, mut second, mut third] = columns;
    let mut largest = norm_sq(&first);
    let [x, y, z] = &columns;
    for (a, b, d) in [(y, z, x), (z, x, y)] {
        let size = norm_sq(a);
        let mask = size.greater(largest);
        largest = Four::select(mask, size, largest);
        first = select(mask, a, &first);
        second = select(mask, b, &second);
        third = select(mask, d, &third);
    }
    let s = Four::splat(T::ONE) / largest.root();
    let u1 = first.map(|v| v * s);
    let (p, q) = (cross(&u1, &second), cross(&u1, &third));
    let u3 = unit(&select(norm_sq(&p).greater(norm_sq(&q)), &p, &q));
    let u2 = cross(&u3, &u1);
    let transposed =
        |u: &V3<T>| -> V3<T> { columns.map(|column| column[0] * u[0] + column[1] * u[1] + column[2] * u[2]) };
    let v1 = unit(&transposed(&u1));
    let v3 = unit(&cross(&v1, &transposed(&u2)));
    let v2 = cross(&v3, &v1);
    let mut a = [[Four::splat(T::ZERO); 4]; 3];
    for i in 0..3 {
        for j in 0..3 {
            let normal = [u1[i] * v1[j] - u2[i] * v2[j], u1[i] * v2[j] + u2[i] * v1[j], u3[i] * v3[j]];
            for (row, n) in a.iter_mut().zip(normal) {
                for (sum, &b) in row.iter_mut().zip(&basis[3 * i + j]) {
                    *sum = *sum + n.times(b);
                }
            }
        }
    }
    let [p, q, r] = a;
    let minor = |i: usize, j: usize| p[i] * q[j] - p[j] * q[i];
    let (m01, m02, m03) = (minor(0, 1), minor(0, 2), minor(0, 3));
    let (m12, m13, m23) = (minor(1, 2), minor(1, 3), minor(2, 3));
    let n = [
        m12 * r[3] - m13 * r[2] + m23 * r[1],
        m03 * r[2] - m02 * r[3] - m23 * r[0],
        m01 * r[3] - m03 * r[1] + m13 * r[0],
        m02 * r[1] - m01 * r[2] - m12 * r[0],
    ];
    let along = n[0] * c[0] + n[1] * c[1] + (n[2] * c[2] + n[3] * c[3]);
    let length = (n[0] * n[0] + n[1] * n[1] + (n[2] * n[2] + n[3] * n[3])).root();
    let s = Four::splat(T::ONE) / length;
    let s = Four::select(Four::splat(T::ZERO).greater(along), -s, s);
    let next = n.map(|v| v * s);
    let d = [next[0] - c[0], next[1] - c[1], next[2] - c[2], next[3] - c[3]];
    (next, d[0] * d[0] + d[1] * d[1] + (d[2] * d[2] + d[3] * d[3]))
}
