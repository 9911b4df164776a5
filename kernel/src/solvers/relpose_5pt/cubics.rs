//! The ten cubic constraints on `E = x E_0 + y E_1 + z E_2 + w E_3`.
//!
//! Monomials of a quadric: xx xy xz xw yy yz yw zz zw ww. Monomials of a cubic, in the order in which they are
//! eliminated: xxx yyy xxy xyy xxz xxw yyz yyw xyz xyw | xzz xzw xww yzz yzw yww zzz zzw zww www.

use crate::Real;

type Linear<T> = [T; 4];
type Quadric<T> = [T; 10];
pub(super) type Cubic<T> = [T; 20];

#[cfg_attr(not(small), inline(always))]
#[cfg_attr(small, inline(never))]
fn add<T: Real, const N: usize>(a: &[T; N], b: &[T; N]) -> [T; N] {
    let mut sum = *a;
    sum.iter_mut().zip(b).for_each(|(x, y)| *x += *y);
    sum
}

#[cfg_attr(not(small), inline(always))]
fn sub<T: Real, const N: usize>(a: &[T; N], b: &[T; N]) -> [T; N] {
    let mut difference = *a;
    difference.iter_mut().zip(b).for_each(|(x, y)| *x -= *y);
    difference
}

#[cfg_attr(not(small), inline(always))]
fn linear_times_linear<T: Real>(a: &Linear<T>, b: &Linear<T>) -> Quadric<T> {
    let cross = |i: usize, j: usize| a[i] * b[j] + a[j] * b[i];
    [
        a[0] * b[0],
        cross(0, 1),
        cross(0, 2),
        cross(0, 3),
        a[1] * b[1],
        cross(1, 2),
        cross(1, 3),
        a[2] * b[2],
        cross(2, 3),
        a[3] * b[3],
    ]
}

#[cfg_attr(not(small), inline(always))]
fn quadric_times_linear<T: Real>(q: &Quadric<T>, l: &Linear<T>) -> Cubic<T> {
    [
        q[0] * l[0],
        q[4] * l[1],
        q[0] * l[1] + q[1] * l[0],
        q[1] * l[1] + q[4] * l[0],
        q[0] * l[2] + q[2] * l[0],
        q[0] * l[3] + q[3] * l[0],
        q[4] * l[2] + q[5] * l[1],
        q[4] * l[3] + q[6] * l[1],
        q[1] * l[2] + q[2] * l[1] + q[5] * l[0],
        q[1] * l[3] + q[3] * l[1] + q[6] * l[0],
        q[2] * l[2] + q[7] * l[0],
        q[2] * l[3] + q[3] * l[2] + q[8] * l[0],
        q[3] * l[3] + q[9] * l[0],
        q[5] * l[2] + q[7] * l[1],
        q[5] * l[3] + q[6] * l[2] + q[8] * l[1],
        q[6] * l[3] + q[9] * l[1],
        q[7] * l[2],
        q[7] * l[3] + q[8] * l[2],
        q[8] * l[3] + q[9] * l[2],
        q[9] * l[3],
    ]
}

/// `E E' E - tr(E E') E / 2 = 0` (nine cubics) and `det E = 0`, of the entries of `E` (row by row) as linear forms.
#[inline(never)]
pub(super) fn essential_cubics<T: Real>(e: &[Linear<T>; 9]) -> [Cubic<T>; 10] {
    let row_products = |r: usize, s: usize| {
        let p = linear_times_linear(&e[3 * r], &e[3 * s]);
        let q = linear_times_linear(&e[3 * r + 1], &e[3 * s + 1]);
        let t = linear_times_linear(&e[3 * r + 2], &e[3 * s + 2]);
        add(&add(&p, &q), &t)
    };
    let (a00, a11, a22) = (row_products(0, 0), row_products(1, 1), row_products(2, 2));
    let (a01, a02, a12) = (row_products(0, 1), row_products(0, 2), row_products(1, 2));
    let half_trace = add(&add(&a00, &a11), &a22).map(|v| v * T::HALF);
    // L = E E' - tr(E E') / 2, symmetric.
    let (l00, l11, l22) = (sub(&a00, &half_trace), sub(&a11, &half_trace), sub(&a22, &half_trace));
    let l = [[&l00, &a01, &a02], [&a01, &l11, &a12], [&a02, &a12, &l22]];
    let trace = |r: usize, c: usize| {
        let p = quadric_times_linear(l[r][0], &e[c]);
        let q = quadric_times_linear(l[r][1], &e[3 + c]);
        let t = quadric_times_linear(l[r][2], &e[6 + c]);
        add(&add(&p, &q), &t)
    };
    let minor = |a: usize, b: usize| {
        sub(&linear_times_linear(&e[3 + a], &e[6 + b]), &linear_times_linear(&e[3 + b], &e[6 + a]))
    };
    let det = add(
        &add(&quadric_times_linear(&minor(1, 2), &e[0]), &quadric_times_linear(&minor(2, 0), &e[1])),
        &quadric_times_linear(&minor(0, 1), &e[2]),
    );
    [
        trace(0, 0),
        trace(0, 1),
        trace(0, 2),
        trace(1, 0),
        trace(1, 1),
        trace(1, 2),
        trace(2, 0),
        trace(2, 1),
        trace(2, 2),
        det,
    ]
}
