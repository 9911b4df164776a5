//! Newton steps from matrices of the null space to the essential matrices, `L` side by side.
//!
//! At `E = s (u1 v1' + u2 v2')` the matrices normal to the essential matrices are spanned by `u1 v1' - u2 v2'`,
//! `u1 v2' + u2 v1'` and `u3 v3'`. A combination `c` of the four basis matrices that is orthogonal to these three is
//! the null vector of a 3x4 matrix: that is the whole step, and it converges quadratically.

use crate::Real;
use crate::linalg::batch::Batch;

pub(super) type V3<T, const L: usize> = [Batch<T, L>; 3];

#[inline(always)]
pub(super) fn cross<T: Real, const L: usize>(u: &V3<T, L>, v: &V3<T, L>) -> V3<T, L> {
    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
}

#[inline(always)]
fn dot<T: Real, const L: usize>(u: &V3<T, L>, v: &V3<T, L>) -> Batch<T, L> {
    u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
}

#[inline(always)]
pub(super) fn norm_sq<T: Real, const L: usize>(v: &V3<T, L>) -> Batch<T, L> {
    dot(v, v)
}

#[inline(always)]
pub(super) fn select<T: Real, const L: usize, const N: usize>(
    mask: [bool; L],
    a: &[Batch<T, L>; N],
    b: &[Batch<T, L>; N],
) -> [Batch<T, L>; N] {
    let mut selected = *b;
    for (s, &a) in selected.iter_mut().zip(a) {
        *s = Batch::select(mask, a, *s);
    }
    selected
}

/// Two unit vectors that are orthogonal to the unit vector `n` and to one another, `t1 x t2 = n` (T. Duff et al.,
/// "Building an orthonormal basis, revisited", Journal of Computer Graphics Techniques, 2017).
#[inline(always)]
fn tangents<T: Real, const L: usize>([x, y, z]: &V3<T, L>) -> [V3<T, L>; 2] {
    let (zero, one) = (Batch::splat(T::ZERO), Batch::splat(T::ONE));
    let s = Batch::select(zero.greater(*z), -one, one);
    let a = -one / (s + *z);
    let (xa, ya) = (*x * a, *y * a);
    let b = *x * ya;
    [[one + s * *x * xa, s * b, -(s * *x)], [b, s + *y * ya, -*y]]
}

/// One step from the unit vectors `c`: the next unit vectors, and the squared lengths of the steps.
#[inline(never)]
pub(super) fn newton_step<T: Real, const L: usize>(
    basis: &[[T; 4]; 9],
    c: &[Batch<T, L>; 4],
) -> ([Batch<T, L>; 4], Batch<T, L>) {
    let (zero, one) = (Batch::splat(T::ZERO), Batch::splat(T::ONE));
    let mut e = [zero; 9];
    for (e, b) in e.iter_mut().zip(basis) {
        *e = (c[0].times(b[0]) + c[1].times(b[1])) + (c[2].times(b[2]) + c[3].times(b[3]));
    }
    // The cofactors of E are s1 s2 u3 v3'. Their largest column is along u3, and u3 tells v3; u1, u2 and v1, v2 may be
    // turned about them, which mixes the two normals of the plane.
    let [p, q, r] = [[e[0], e[3], e[6]], [e[1], e[4], e[7]], [e[2], e[5], e[8]]];
    let cofactors = [cross(&q, &r), cross(&r, &p), cross(&p, &q)];
    let [mut u3, second, third] = cofactors;
    let mut largest = norm_sq(&u3);
    for other in [second, third] {
        let size = norm_sq(&other);
        let mask = size.greater(largest);
        largest = Batch::select(mask, size, largest);
        u3 = select(mask, &other, &u3);
    }
    let s = one / largest.root();
    u3 = [u3[0] * s, u3[1] * s, u3[2] * s];
    let [p, q, r] = &cofactors;
    let mut v3 = [dot(p, &u3), dot(q, &u3), dot(r, &u3)];
    let s = one / norm_sq(&v3).root();
    v3 = [v3[0] * s, v3[1] * s, v3[2] * s];
    let ([u1, u2], [v1, v2]) = (tangents(&u3), tangents(&v3));
    let mut a = [[zero; 4]; 3];
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
    let s = one / length;
    let s = Batch::select(zero.greater(along), -s, s);
    let next = [n[0] * s, n[1] * s, n[2] * s, n[3] * s];
    let d = [next[0] - c[0], next[1] - c[1], next[2] - c[2], next[3] - c[3]];
    (next, d[0] * d[0] + d[1] * d[1] + (d[2] * d[2] + d[3] * d[3]))
}
