//! The real roots of a polynomial of degree 10 on the whole projective line.
//!
//! The line is cut at -1, 0, 1 and infinity: four quarters that a variable `t` in [0, 1] runs through. On a quarter, the
//! signs of the coefficients in Bernstein's basis change at least as often as there are roots, and by an even number
//! more (Descartes' rule in its form for an interval): no change is no root, one change is one root. Other intervals
//! are halved by de Casteljau's additions. Two roots that lie too close to be told apart by a few halvings are looked
//! for on both sides of the extremum between them. Newton's iteration, kept inside its bracket, does the rest.

use crate::Real;
use crate::real::{abs, lit, sqrt};

/// Coefficients of a polynomial of degree 10.
type Coefficients<T> = [T; 11];

/// Most roots of one chart that are kept: a true polynomial has ten in both, candidates at extrema may be more.
const CAPACITY: usize = 12;
/// Halvings of a quarter after which two sign changes are taken for a close pair.
const PAIR_DEPTH: u32 = 4;
/// Halvings at the most.
const MAX_DEPTH: usize = 10;
/// Newton steps at the most, for a root and for an extremum.
const NEWTON: u32 = 12;

/// Where a root stands on the projective line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chart {
    /// `x` itself, |x| <= 1.
    Inside,
    /// `1 / x`, |x| >= 1.
    Outside,
}

/// The roots of one chart.
#[derive(Clone, Debug)]
pub struct Roots10<T> {
    roots: [T; CAPACITY],
    len: usize,
}

impl<T: Real> Roots10<T> {
    /// The roots.
    #[inline]
    #[must_use]
    pub fn as_slice(&self) -> &[T] {
        self.roots.get(..self.len).unwrap_or(&[])
    }
}

/// A bracket of one root.
#[derive(Clone, Copy)]
struct Bracket<T> {
    lo: T,
    hi: T,
    /// Whether the polynomial is positive (or zero) at `lo`.
    positive: bool,
    guess: T,
}

struct Brackets<T> {
    list: [Bracket<T>; CAPACITY],
    len: usize,
}

impl<T: Real> Brackets<T> {
    #[inline]
    fn push(&mut self, bracket: Bracket<T>) {
        if let Some(slot) = self.list.get_mut(self.len) {
            *slot = bracket;
            self.len += 1;
        }
    }
}

/// The real roots, as those of |x| <= 1 and as the reciprocals of those of |x| > 1 (infinity is 0 there).
///
/// # Input
/// Coefficients from the constant term upwards. `near`: the polynomial is known no better than to this error, relative to the
/// sum of the magnitudes of its coefficients; an extremum that comes as near to zero as that gives two
/// candidates, the ends of the interval in which the parabola of the extremum stays below the error.
///
/// # Returns
/// Simple roots to a few `EPSILON` of their condition.
///
/// # Cost
/// At most 2^10 halvings of 55 additions, 10 usual; 4 to 6 Newton steps a root usual, 12 at the most.
#[inline]
pub fn real_roots_10<T: Real>(c: &Coefficients<T>, near: T) -> [Roots10<T>; 2] {
    let mut reversed = *c;
    reversed.reverse();
    let mut size = T::ZERO;
    for &v in c {
        size += abs(v);
    }
    let mut ends = [T::ZERO; 2];
    let mut inside = true;
    [c, &reversed].map(|c| {
        let none = Bracket { lo: T::ZERO, hi: T::ZERO, positive: false, guess: T::ZERO };
        let mut brackets = Brackets { list: [none; CAPACITY], len: 0 };
        for (side, end) in [T::ONE, -T::ONE].into_iter().zip(&mut ends) {
            let mut b = bernstein(c, side);
            // Both charts must agree on the sign at -1 and 1, or a root there would be found twice or never.
            if inside {
                *end = b[10];
            } else {
                b[10] = *end;
            }
            isolate(c, side, b, near * size, &mut brackets);
        }
        inside = false;
        polish(c, &brackets)
    })
}

/// Bernstein coefficients on [0, 1] of the polynomial in `t = side * x`.
#[inline]
fn bernstein<T: Real>(c: &Coefficients<T>, side: T) -> Coefficients<T> {
    // 1 / (10 choose i)
    const WEIGHTS: [f64; 11] = [
        1.0,
        1.0 / 10.0,
        1.0 / 45.0,
        1.0 / 120.0,
        1.0 / 210.0,
        1.0 / 252.0,
        1.0 / 210.0,
        1.0 / 120.0,
        1.0 / 45.0,
        1.0 / 10.0,
        1.0,
    ];
    let mut b: Coefficients<T> = core::array::from_fn(|i| {
        let v = c[i] * lit(WEIGHTS[i]);
        if i % 2 == 1 { v * side } else { v }
    });
    for level in 1..11 {
        for j in (level..11).rev() {
            b[j] += b[j - 1];
        }
    }
    b
}

/// The halves of an interval (de Casteljau, by additions; the powers of two are put right at the end).
#[inline]
fn halves<T: Real>(b: &Coefficients<T>) -> [Coefficients<T>; 2] {
    let (mut v, mut left, mut right) = (*b, *b, *b);
    let mut scale = T::ONE;
    for level in 1..11 {
        for i in 0..11 - level {
            v[i] += v[i + 1];
        }
        scale *= T::HALF;
        left[level] = v[0] * scale;
        right[10 - level] = v[10 - level] * scale;
    }
    [left, right]
}

/// How often neighbours differ in sign; zero counts as positive.
#[inline]
fn sign_changes<T: Real>(b: &[T]) -> u32 {
    let mut changes = 0;
    for (u, v) in b.iter().zip(b.iter().skip(1)) {
        changes += u32::from((*u < T::ZERO) != (*v < T::ZERO));
    }
    changes
}

#[inline]
fn isolate<T: Real>(c: &Coefficients<T>, side: T, b: Coefficients<T>, error: T, found: &mut Brackets<T>) {
    // Depth first; what waits is the right half of each level.
    let mut waiting = [(b, T::ZERO, T::ONE); MAX_DEPTH + 1];
    let mut count = 1usize;
    for _ in 0..1usize << (MAX_DEPTH + 1) {
        let Some(next) = count.checked_sub(1) else { return };
        let Some(&(b, lo, width)) = waiting.get(next) else { return };
        count = next;
        let changes = sign_changes(&b);
        if changes == 0 {
            continue;
        }
        let positive = b[0] >= T::ZERO;
        if changes == 1 {
            // Where the control polygon crosses zero.
            let mut at = T::HALF;
            for i in 0..10 {
                if (b[i] < T::ZERO) != (b[i + 1] < T::ZERO) {
                    at = (lit::<T>(i as f64) + b[i] / (b[i] - b[i + 1])) * lit(0.1);
                }
            }
            found.push(oriented(side, lo, lo + width, positive, lo + width * at));
            continue;
        }
        let narrow = width <= lit(1.0 / (1 << PAIR_DEPTH) as f64);
        let last = width <= lit(1.0 / (1 << MAX_DEPTH) as f64);
        let slopes: [T; 10] = core::array::from_fn(|i| b[i + 1] - b[i]);
        if last || narrow && changes == 2 && sign_changes(&slopes) == 1 {
            if changes % 2 == 1 {
                found.push(oriented(side, lo, lo + width, positive, lo + width * T::HALF));
            } else {
                pair(c, side, lo, lo + width, positive, error, found);
            }
            continue;
        }
        let [left, right] = halves(&b);
        let half = width * T::HALF;
        if let Some(slot) = waiting.get_mut(count) {
            *slot = (right, lo + half, half);
            count += 1;
        }
        if let Some(slot) = waiting.get_mut(count) {
            *slot = (left, lo, half);
            count += 1;
        }
    }
}

/// The bracket in `x = side * t`.
#[inline]
fn oriented<T: Real>(side: T, lo: T, hi: T, positive: bool, guess: T) -> Bracket<T> {
    if side > T::ZERO {
        Bracket { lo, hi, positive, guess }
    } else {
        // An odd number of roots between: the sign at the other end is the opposite.
        Bracket { lo: -hi, hi: -lo, positive: !positive, guess: -guess }
    }
}

/// Two roots or none between `lo` and `hi` (of t), where the polynomial has the same sign: those on either side of the
/// extremum.
#[inline]
fn pair<T: Real>(
    c: &Coefficients<T>,
    side: T,
    lo: T,
    hi: T,
    positive: bool,
    error: T,
    found: &mut Brackets<T>,
) {
    let (lo, hi) = if side > T::ZERO { (lo, hi) } else { (-hi, -lo) };
    let (mut a, mut b) = (lo, hi);
    let mut x = (lo + hi) * T::HALF;
    let (mut f, mut h) = (T::ZERO, T::ZERO);
    for _ in 0..NEWTON {
        let d;
        (f, d, h) = value_and_derivatives(c, x);
        if (f >= T::ZERO) != positive {
            break;
        }
        // The side on which the polynomial still falls towards the axis.
        if (d < T::ZERO) == positive {
            a = x;
        } else {
            b = x;
        }
        let mut next = x - d / (h + h);
        if !(next >= a && next <= b) {
            next = (a + b) * T::HALF;
        }
        let step = abs(next - x);
        x = next;
        if step <= lit::<T>(4.0) * T::EPSILON {
            break;
        }
    }
    let reach = sqrt(abs(f / h));
    if (f >= T::ZERO) != positive {
        found.push(Bracket { lo, hi: x, positive, guess: x - reach });
        found.push(Bracket { lo: x, hi, positive: !positive, guess: x + reach });
    } else if abs(f) <= error {
        for x in [x - reach, x + reach] {
            // A bracket of no width: a candidate that is not to be moved.
            found.push(Bracket { lo: x, hi: x, positive, guess: x });
        }
    }
}

/// Value, derivative and half the second derivative.
#[inline]
fn value_and_derivatives<T: Real>(c: &Coefficients<T>, x: T) -> (T, T, T) {
    let (mut f, mut d, mut h) = (c[10], T::ZERO, T::ZERO);
    for i in (0..10).rev() {
        h = h * x + d;
        d = d * x + f;
        f = f * x + c[i];
    }
    (f, d, h)
}

const LANES: usize = 4;

/// Newton's iteration, four roots side by side, halving a bracket wherever Newton leaves it.
#[inline]
fn polish<T: Real>(c: &Coefficients<T>, brackets: &Brackets<T>) -> Roots10<T> {
    let mut roots = [T::ZERO; CAPACITY];
    for (out, group) in roots
        .chunks_exact_mut(LANES)
        .zip(brackets.list.chunks_exact(LANES))
        .take(brackets.len.div_ceil(LANES))
    {
        let &[g0, g1, g2, g3] = group else { continue };
        let group = [g0, g1, g2, g3];
        let (mut lo, mut hi) = (group.map(|g| g.lo), group.map(|g| g.hi));
        let positive = group.map(|g| g.positive);
        let mut x = group.map(|g| g.guess);
        for _ in 0..NEWTON {
            let (mut f, mut d) = ([c[10]; LANES], [T::ZERO; LANES]);
            for i in (0..10).rev() {
                for k in 0..LANES {
                    d[k] = d[k] * x[k] + f[k];
                }
                for k in 0..LANES {
                    f[k] = f[k] * x[k] + c[i];
                }
            }
            let mut moved = T::ZERO;
            for k in 0..LANES {
                let left = (f[k] >= T::ZERO) == positive[k];
                lo[k] = if left { x[k] } else { lo[k] };
                hi[k] = if left { hi[k] } else { x[k] };
                let newton = x[k] - f[k] / d[k];
                let inside = newton >= lo[k] && newton <= hi[k];
                let next = if inside { newton } else { (lo[k] + hi[k]) * T::HALF };
                let step = abs(next - x[k]);
                moved = if step > moved { step } else { moved };
                x[k] = next;
            }
            // The next step would be of the order of the square.
            if moved * moved <= T::EPSILON * lit(0.25) {
                break;
            }
        }
        for (slot, x) in out.iter_mut().zip(x) {
            *slot = x;
        }
    }
    Roots10 { roots, len: brackets.len }
}
