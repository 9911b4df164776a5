//! A Newton step from a matrix of the null space to the essential matrices.
//!
//! At `E = s (u1 v1' + u2 v2')` the matrices normal to the essential matrices are spanned by `u1 v1' - u2 v2'`,
//! `u1 v2' + u2 v1'` and `u3 v3'`. A combination `c` of the four basis matrices that is orthogonal to these three is
//! the null vector of a 3x4 matrix: that is the whole step, and it converges quadratically.

use crate::Real;
use crate::real::sqrt;

type V3<T> = [T; 3];

#[inline(always)]
fn cross<T: Real>(u: &V3<T>, v: &V3<T>) -> V3<T> {
    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
}

#[inline(always)]
fn norm_sq<T: Real>(v: &V3<T>) -> T {
    v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
}

#[inline(always)]
fn unit<T: Real>(v: &V3<T>) -> V3<T> {
    let s = T::ONE / sqrt(norm_sq(v));
    [v[0] * s, v[1] * s, v[2] * s]
}

/// The combination of basis matrices; elements row by row.
#[inline(always)]
pub(super) fn combine<T: Real>(basis: &[[T; 4]; 9], c: &[T; 4]) -> [T; 9] {
    core::array::from_fn(|i| {
        basis[i][0] * c[0] + basis[i][1] * c[1] + basis[i][2] * c[2] + basis[i][3] * c[3]
    })
}

/// One step from the unit vector `c`: the next unit vector, and the squared length of the step.
#[inline]
pub(super) fn newton_step<T: Real>(basis: &[[T; 4]; 9], c: &[T; 4]) -> ([T; 4], T) {
    let e = combine(basis, c);
    let column = |j: usize| [e[j], e[3 + j], e[6 + j]];
    // Left null vector: the largest product of two columns; u1 lies along one of the two.
    let mut u1 = column(0);
    let mut u3 = cross(&column(0), &column(1));
    for (a, b) in [(1, 2), (2, 0)] {
        let other = cross(&column(a), &column(b));
        if norm_sq(&other) > norm_sq(&u3) {
            (u1, u3) = (column(a), other);
        }
    }
    let (u1, u3) = (unit(&u1), unit(&u3));
    let u2 = cross(&u3, &u1);
    let transposed =
        |u: &V3<T>| -> V3<T> { core::array::from_fn(|j| e[j] * u[0] + e[3 + j] * u[1] + e[6 + j] * u[2]) };
    let v1 = unit(&transposed(&u1));
    let v3 = unit(&cross(&v1, &transposed(&u2)));
    let v2 = cross(&v3, &v1);
    let mut a = [[T::ZERO; 4]; 3];
    for i in 0..3 {
        for j in 0..3 {
            let normal = [u1[i] * v1[j] - u2[i] * v2[j], u1[i] * v2[j] + u2[i] * v1[j], u3[i] * v3[j]];
            for r in 0..3 {
                for k in 0..4 {
                    a[r][k] += normal[r] * basis[3 * i + j][k];
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
    let along = n[0] * c[0] + n[1] * c[1] + n[2] * c[2] + n[3] * c[3];
    let length_sq = n[0] * n[0] + n[1] * n[1] + n[2] * n[2] + n[3] * n[3];
    let s = T::ONE / sqrt(length_sq);
    let s = if along < T::ZERO { -s } else { s };
    let next = n.map(|v| v * s);
    let mut step_sq = T::ZERO;
    for k in 0..4 {
        step_sq += (next[k] - c[k]) * (next[k] - c[k]);
    }
    (next, step_sq)
}
