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
fn add<T: Real, const N: usize>(sum: &mut [T; N], b: &[T; N]) {
    sum.iter_mut().zip(b).for_each(|(x, y)| *x += *y);
}

#[cfg_attr(not(small), inline(always))]
#[cfg_attr(small, inline(never))]
fn subtract<T: Real, const N: usize>(difference: &mut [T; N], b: &[T; N]) {
    difference.iter_mut().zip(b).for_each(|(x, y)| *x -= *y);
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

/// The sum of three products.
#[cfg_attr(not(small), inline(always))]
#[cfg_attr(small, inline(never))]
fn linear_dot<T: Real>(a: &[&Linear<T>; 3], b: &[&Linear<T>; 3]) -> Quadric<T> {
    let mut sum = linear_times_linear(a[0], b[0]);
    add(&mut sum, &linear_times_linear(a[1], b[1]));
    add(&mut sum, &linear_times_linear(a[2], b[2]));
    sum
}

/// The sum of three products.
#[cfg_attr(not(small), inline(always))]
#[cfg_attr(small, inline(never))]
fn quadric_dot<T: Real>(q: &[&Quadric<T>; 3], l: &[&Linear<T>; 3]) -> Cubic<T> {
    let mut sum = quadric_times_linear(q[0], l[0]);
    add(&mut sum, &quadric_times_linear(q[1], l[1]));
    add(&mut sum, &quadric_times_linear(q[2], l[2]));
    sum
}

/// Writes `E E' E - tr(E E') E / 2 = 0` (nine cubics) and `det E = 0`, of the entries of `E` (row by row) as linear forms.
#[inline(never)]
pub(super) fn essential_cubics<T: Real>(e: &[Linear<T>; 9], cubics: &mut [Cubic<T>; 10]) {
    let [e0, e1, e2, e3, e4, e5, e6, e7, e8] = e;
    let rows = [[e0, e1, e2], [e3, e4, e5], [e6, e7, e8]];
    let product = |r: usize, s: usize| linear_dot(&rows[r], &rows[s]);
    let (mut l00, mut l11, mut l22) = (product(0, 0), product(1, 1), product(2, 2));
    let (a01, a02, a12) = (product(0, 1), product(0, 2), product(1, 2));
    // L = E E' - tr(E E') / 2, symmetric.
    let mut half_trace = l00;
    add(&mut half_trace, &l11);
    add(&mut half_trace, &l22);
    half_trace.iter_mut().for_each(|v| *v *= T::HALF);
    for diagonal in [&mut l00, &mut l11, &mut l22] {
        subtract(diagonal, &half_trace);
    }
    let l = [[&l00, &a01, &a02], [&a01, &l11, &a12], [&a02, &a12, &l22]];
    let columns = [[e0, e3, e6], [e1, e4, e7], [e2, e5, e8]];
    let minor = |a: usize, b: usize| {
        let mut minor = linear_times_linear(rows[1][a], rows[2][b]);
        subtract(&mut minor, &linear_times_linear(rows[1][b], rows[2][a]));
        minor
    };
    cubics[9] = quadric_dot(&[&minor(1, 2), &minor(2, 0), &minor(0, 1)], &rows[0]);
    for (traces, l) in cubics.as_chunks_mut::<3>().0.iter_mut().zip(&l) {
        for (trace, column) in traces.iter_mut().zip(&columns) {
            *trace = quadric_dot(l, column);
        }
    }
}
