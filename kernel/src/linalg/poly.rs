//! Real roots of polynomials. Coefficients stand from the constant term upwards: `c[0] + c[1] x + ...`.

use crate::real::{abs, lit};
use crate::{Real, Solutions};

/// Cells into which [-1, 1] is divided; one more on either side sees extrema at the ends.
const CELLS: usize = 128;
const SAMPLES: usize = CELLS + 3;

/// The real roots of a polynomial of degree 10 on the whole projective line, as pairs `[p, q]` for the root `p / q`,
/// with the larger of |p|, |q| equal to 1 (a root at infinity is `[1, 0]`).
///
/// # Returns
/// The roots in ascending order within |x| <= 1, then those beyond, in ascending order of 1 / x. A pair of roots that rounding
/// has lifted off the axis counts as one root at the extremum.
#[inline]
pub fn projective_roots_10<T: Real>(c: &[T; 11]) -> Solutions<[T; 2], 10> {
    let mut roots = Solutions::new();
    let mut reversed = *c;
    reversed.reverse();
    let inside = samples(c);
    let mut outside = samples(&reversed);
    // Both charts must agree on the sign at -1 and 1, or a root there would be found twice or never.
    outside[1] = inside[1];
    outside[SAMPLES - 2] = inside[SAMPLES - 2];
    roots_in_chart(c, &inside, |x| {
        roots.push([x, T::ONE]);
    });
    roots_in_chart(&reversed, &outside, |x| {
        roots.push([T::ONE, x]);
    });
    roots
}

fn abscissa<T: Real>(i: usize) -> T {
    lit::<T>((i as i32 - 1 - CELLS as i32 / 2) as f64) * lit::<T>(2.0 / CELLS as f64)
}

fn samples<T: Real>(c: &[T; 11]) -> [T; SAMPLES] {
    core::array::from_fn(|i| value(c, abscissa(i)))
}

fn value<T: Real>(c: &[T; 11], x: T) -> T {
    c.iter().rev().fold(T::ZERO, |f, &a| f * x + a)
}

/// Value and first two derivatives (the second halved).
fn value_and_derivatives<T: Real>(c: &[T; 11], x: T) -> (T, T, T) {
    let (mut f, mut d, mut h) = (T::ZERO, T::ZERO, T::ZERO);
    for &a in c.iter().rev() {
        h = h * x + d;
        d = d * x + f;
        f = f * x + a;
    }
    (f, d, h)
}

fn roots_in_chart<T: Real>(c: &[T; 11], f: &[T; SAMPLES], mut found: impl FnMut(T)) {
    let positive = |v: T| v >= T::ZERO;
    for i in 1..SAMPLES - 2 {
        let (a, b) = (abscissa::<T>(i), abscissa::<T>(i + 1));
        if positive(f[i]) != positive(f[i + 1]) {
            found(refine(c, a, b, positive(f[i])));
        }
        // An extremum towards the axis around sample i.
        let (l, m, r) = (f[i - 1], f[i], f[i + 1]);
        if positive(l) == positive(m) && positive(m) == positive(r) && abs(m) <= abs(l) && abs(m) < abs(r) {
            let left = abscissa::<T>(i - 1);
            let (mut x, mut lo, mut hi) = (a, left, b);
            for _ in 0..8 {
                let (_, d, h) = value_and_derivatives(c, x);
                // The side on which |p| still falls.
                if (d < T::ZERO) == positive(m) {
                    lo = x
                } else {
                    hi = x
                }
                let step = d / (h + h);
                let next = x - step;
                x = if next >= lo && next <= hi { next } else { (lo + hi) * T::HALF };
            }
            let v = value(c, x);
            if x < -T::ONE || x >= T::ONE {
                continue;
            }
            if positive(v) != positive(m) {
                found(refine(c, left, x, positive(m)));
                found(refine(c, x, b, !positive(m)));
            } else {
                let size = c.iter().fold(T::ZERO, |s, &a| s + abs(a));
                if abs(v) <= lit::<T>(64.0) * T::EPSILON * size {
                    found(x);
                }
            }
        }
    }
}

/// Newton from the middle, halving the bracket wherever Newton leaves it.
fn refine<T: Real>(c: &[T; 11], mut lo: T, mut hi: T, positive_at_lo: bool) -> T {
    let mut x = (lo + hi) * T::HALF;
    for _ in 0..16 {
        let (f, d, _) = value_and_derivatives(c, x);
        if (f >= T::ZERO) == positive_at_lo {
            lo = x
        } else {
            hi = x
        }
        let next = x - f / d;
        x = if next >= lo && next <= hi { next } else { (lo + hi) * T::HALF };
    }
    x
}
