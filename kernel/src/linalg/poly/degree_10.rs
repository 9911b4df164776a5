//! The real roots of a polynomial of degree 10 on the whole projective line.
//!
//! The line is cut at -1, 0, 1 and infinity: four quarters that a variable `t` in [0, 1] runs through. On a quarter, the
//! signs of the coefficients in Bernstein's basis change at least as often as there are roots, and by an even number
//! more (Descartes' rule in its form for an interval): no change is no root, one change is one root. Other intervals
//! are halved by de Casteljau's additions. Two roots that lie too close to be told apart by a few halvings are looked
//! for on both sides of the extremum between them. Newton's iteration, kept inside its bracket, does the rest.

use crate::Real;
use crate::linalg::batch::{BATCH, Batch};
use crate::real::{abs, from_u32, lit, sqrt};

/// Coefficients of a polynomial of degree 10.
type Coefficients<T> = [T; 11];

/// Most candidates of one chart: of true roots there are ten in both charts, candidates at extrema may be more.
const CAPACITY: usize = 12;
/// Halvings of a quarter after which two sign changes are taken for a close pair.
const PAIR_DEPTH: u32 = 4;
/// Halvings at the most.
const MAX_DEPTH: usize = 10;
/// Newton steps at the most, for a root and for an extremum.
const NEWTON: u32 = 20;

/// Candidates for the roots in [-1, 1] of a polynomial of degree 10.
#[derive(Clone, Debug)]
pub struct RealRoots10<T> {
    roots: [T; CAPACITY],
    len: usize,
    worst: LeastDetermined<T>,
}

/// The root that an error of the coefficients moves the most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeastDetermined<T> {
    /// Where it is.
    pub x: T,
    /// How far the error moves it, to first order.
    pub spread: T,
}

impl<T: Real> RealRoots10<T> {
    /// The candidates.
    #[inline]
    #[must_use]
    pub fn as_slice(&self) -> &[T] {
        self.roots.get(..self.len).unwrap_or(&[])
    }

    /// The least determined candidate (of spread 0 where there is none).
    #[inline]
    #[must_use]
    pub fn least_determined(&self) -> LeastDetermined<T> {
        self.worst
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
    worst: LeastDetermined<T>,
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

impl<T: Real> LeastDetermined<T> {
    #[inline]
    fn see(&mut self, x: T, spread: T) {
        if spread > self.spread {
            *self = Self { x, spread };
        }
    }
}

/// The real roots of a polynomial of degree 10 in [-1, 1].
///
/// # Input
/// Coefficients from the constant term upwards. `error`: how far they may be wrong, relative to the sum of their
/// magnitudes.
///
/// # Returns
/// The roots, those above 0 first. An extremum within the error of zero counts as two candidates, one on either side,
/// whether or not it crosses; so does a double root.
///
/// # Accuracy
/// A few `EPSILON` times the root's condition.
///
/// # Cost
/// At most 2^11 halvings of 55 additions, about 10 usual; 20 Newton steps a root at the most, 4 or 5 usual.
///
/// # References
/// J. M. Lane and R. F. Riesenfeld, "Bounds on a polynomial", BIT, 1981, for sign changes in Bernstein's basis; halving at
/// every step, as they do, is stopped here at a close pair, which its extremum tells apart.
///
/// # Examples
/// ```
/// use epipole::linalg::poly::real_roots_10;
/// let mut c = [0.0_f64; 11]; // (x^2 - 1/4) (x^8 + 1)
/// (c[0], c[2], c[8], c[10]) = (-0.25, 1.0, -0.25, 1.0);
/// let roots = real_roots_10(&c, 1e-15);
/// assert_eq!(roots.as_slice().len(), 2);
/// assert!((roots.as_slice()[0] - 0.5).abs() < 1e-15 && (roots.as_slice()[1] + 0.5).abs() < 1e-15);
/// ```
#[inline]
#[must_use]
pub fn real_roots_10<T: Real>(c: &[T; 11], error: T) -> RealRoots10<T> {
    roots_in_chart::<T, BATCH>(c, error, None)
}

/// The real roots on the whole projective line: those in [-1, 1], and the reciprocals of the others (0 is the root at
/// infinity). As [`real_roots_10`] otherwise.
#[inline]
#[must_use]
pub fn projective_roots_10<T: Real>(c: &[T; 11], error: T) -> [RealRoots10<T>; 2] {
    let mut reversed = *c;
    reversed.reverse();
    // Both charts must agree on the sign at 1 and -1, or a root there would be found twice or never.
    let ends = [bernstein(c, T::ONE)[10], bernstein(c, -T::ONE)[10]];
    let roots = |c: &_| roots_in_chart::<T, BATCH>(c, error, Some(ends));
    [roots(c), roots(&reversed)]
}

#[inline(never)]
fn roots_in_chart<T: Real, const L: usize>(
    c: &Coefficients<T>,
    error: T,
    ends: Option<[T; 2]>,
) -> RealRoots10<T> {
    let mut size = T::ZERO;
    for &v in c {
        size += abs(v);
    }
    let error = error * size;
    let none = Bracket { lo: T::ZERO, hi: T::ZERO, positive: false, guess: T::ZERO };
    let worst = LeastDetermined { x: T::ZERO, spread: T::ZERO };
    let mut brackets = Brackets { list: [none; CAPACITY], len: 0, worst };
    let mut waiting = [(*c, T::ZERO, T::ONE); MAX_DEPTH];
    for k in 0..2 {
        let side = if k == 0 { T::ONE } else { -T::ONE };
        let mut b = bernstein(c, side);
        if let Some(ends) = ends {
            b[10] = ends[k];
        }
        isolate(c, side, b, error, &mut waiting, &mut brackets);
    }
    polish::<T, L>(c, &brackets, error)
}

/// Bernstein coefficients on [0, 1] of the polynomial in `t = side * x`.
#[cfg_attr(not(small), inline)]
#[cfg_attr(small, inline(never))]
fn bernstein<T: Real>(c: &Coefficients<T>, side: T) -> Coefficients<T> {
    // 10 choose i; whole numbers, for a table of f64 would be converted by software on a core without them.
    const BINOMIALS: [u32; 11] = [1, 10, 45, 120, 210, 252, 210, 120, 45, 10, 1];
    let mut b = *c;
    let mut sign = T::ONE;
    for (v, choices) in b.iter_mut().zip(BINOMIALS) {
        *v = *v * (T::ONE / from_u32(choices)) * sign;
        sign *= side;
    }
    for level in 1..11 {
        for j in (level..11).rev() {
            b[j] += b[j - 1];
        }
    }
    b
}

/// Leaves the left half of an interval in `b` and writes the right one (de Casteljau, by additions; the powers of two are
/// put right at the end).
#[inline]
fn halve<T: Real>(b: &mut Coefficients<T>, right: &mut Coefficients<T>) {
    *right = *b;
    let mut scale = T::ONE;
    for level in 1..11 {
        for i in 0..11 - level {
            right[i] += right[i + 1];
        }
        scale *= T::HALF;
        b[level] = right[0] * scale;
    }
    scale = T::ONE;
    for i in (0..10).rev() {
        scale *= T::HALF;
        right[i] *= scale;
    }
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

/// Depth first; what waits is the right half of each level.
type Waiting<T> = [(Coefficients<T>, T, T); MAX_DEPTH];

#[inline]
fn isolate<T: Real>(
    c: &Coefficients<T>,
    side: T,
    mut b: Coefficients<T>,
    error: T,
    waiting: &mut Waiting<T>,
    found: &mut Brackets<T>,
) {
    let (mut lo, mut width) = (T::ZERO, T::ONE);
    let mut count = 0usize;
    for _ in 0..1usize << (MAX_DEPTH + 1) {
        let changes = sign_changes(&b);
        let positive = b[0] >= T::ZERO;
        if changes == 1 {
            let guess = lo + width * polygon_zero(&b);
            found.push(oriented(side, lo, lo + width, positive, guess));
        } else if changes > 1 {
            let narrow = width <= lit(1.0 / (1 << PAIR_DEPTH) as f64);
            if width <= lit(1.0 / (1 << MAX_DEPTH) as f64) && changes & 1 == 1 {
                found.push(oriented(side, lo, lo + width, positive, lo + width * T::HALF));
            } else if narrow
                && changes & 1 == 0
                && (width <= lit(1.0 / (1 << MAX_DEPTH) as f64) || changes == 2 && one_extremum(&b))
            {
                pair(c, side, lo, lo + width, positive, error, found);
            } else {
                width *= T::HALF;
                if let Some((right, start, length)) = waiting.get_mut(count) {
                    halve(&mut b, right);
                    (*start, *length) = (lo + width, width);
                    count += 1;
                    continue;
                }
            }
        }
        let Some(next) = count.checked_sub(1) else { return };
        let Some(slot) = waiting.get(next) else { return };
        count = next;
        (b, lo, width) = *slot;
    }
}

/// Whether the slopes of the control polygon change sign once.
#[inline]
fn one_extremum<T: Real>(b: &Coefficients<T>) -> bool {
    let mut slopes = [T::ZERO; 10];
    for (slope, (u, v)) in slopes.iter_mut().zip(b.iter().zip(b.iter().skip(1))) {
        *slope = *v - *u;
    }
    sign_changes(&slopes) == 1
}

/// Where the control polygon with one sign change crosses zero, in [0, 1].
#[inline]
fn polygon_zero<T: Real>(b: &Coefficients<T>) -> T {
    let (mut u, mut v, mut at) = (b[0], b[1], T::ZERO);
    for i in 1..10 {
        // The pair whose first member still has the sign of b[0] and whose second has not: the last such first member.
        if (b[i] < T::ZERO) == (b[0] < T::ZERO) {
            (u, v, at) = (b[i], b[i + 1], from_u32(i as u32));
        }
    }
    (at + u / (u - v)) * lit(0.1)
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
    let (mut f, mut d, mut h) = (T::ZERO, T::ZERO, T::ZERO);
    for _ in 0..NEWTON {
        (f, d, h) = value_and_derivatives(c, x);
        // Across the axis: the two roots are told apart.
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
        if abs(next - x) <= lit::<T>(4.0) * T::EPSILON {
            break;
        }
        x = next;
    }
    // The parabola at x: its extremum, and how far from it the parabola is zero (or as far below zero as it is above).
    let middle = -d / (h + h);
    let reach = sqrt(abs(middle * middle - f / h));
    if abs(f) <= lit::<T>(16.0) * error {
        found.worst.see(x, reach + sqrt(abs(error / h)));
    }
    if (f >= T::ZERO) != positive {
        found.push(Bracket { lo, hi: x, positive, guess: x + (middle - reach) });
        found.push(Bracket { lo: x, hi, positive: !positive, guess: x + (middle + reach) });
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

/// Newton's iteration, `L` roots side by side, halving a bracket wherever Newton leaves it.
#[inline]
fn polish<T: Real, const L: usize>(c: &Coefficients<T>, brackets: &Brackets<T>, error: T) -> RealRoots10<T> {
    let (mut roots, mut worst) = ([T::ZERO; CAPACITY], brackets.worst);
    let groups = roots.as_chunks_mut::<L>().0.iter_mut().zip(brackets.list.as_chunks::<L>().0);
    let mut left = brackets.len;
    for (out, group) in groups.take(brackets.len.div_ceil(L)) {
        let (mut x, mut slope) = ([T::ZERO; L], [T::ONE; L]);
        let (mut lo, mut hi, mut arrived) = ([T::ZERO; L], [T::ZERO; L], [false; L]);
        for k in 0..L {
            (x[k], lo[k], hi[k]) = (group[k].guess, group[k].lo, group[k].hi);
        }
        for _ in 0..NEWTON {
            let at = Batch(x);
            let (mut f, mut d) = (Batch::splat(c[10]), Batch::splat(T::ZERO));
            for i in (0..10).rev() {
                d = d * at + f;
                f = f * at + Batch::splat(c[i]);
            }
            let newton = (at - f / d).0;
            let mut all = true;
            for k in 0..L {
                let before = (f.0[k] >= T::ZERO) == group[k].positive;
                lo[k] = if before { x[k] } else { lo[k] };
                hi[k] = if before { hi[k] } else { x[k] };
                let inside = newton[k] >= lo[k] && newton[k] <= hi[k];
                let next = if inside { newton[k] } else { (lo[k] + hi[k]) * T::HALF };
                let step = next - x[k];
                // A root that has arrived waits for the others of its group: it must not depend on them.
                x[k] = if arrived[k] { x[k] } else { next };
                slope[k] = if arrived[k] { slope[k] } else { d.0[k] };
                // The next step would be of the order of the square.
                arrived[k] |= step * step <= T::EPSILON * lit(0.25);
                all &= arrived[k];
            }
            if all {
                break;
            }
        }
        for ((slot, x), d) in out.iter_mut().zip(x).zip(slope).take(left) {
            *slot = x;
            worst.see(x, error / abs(d));
        }
        left = left.saturating_sub(L);
    }
    RealRoots10 { roots, len: brackets.len, worst }
}

#[cfg(test)]
mod tests {
    use super::roots_in_chart;

    #[test]
    fn roots_have_the_same_bits_one_and_four_at_a_time() {
        let mut word = 1u64;
        let mut several = 0;
        for _ in 0..2000 {
            let c = core::array::from_fn(|_| {
                word = word.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                (word >> 40) as f32 / (1u32 << 23) as f32 - 1.0
            });
            let one = roots_in_chart::<f32, 1>(&c, 1e-6, None);
            let four = roots_in_chart::<f32, 4>(&c, 1e-6, None);
            let bits =
                |roots: &[f32]| roots.iter().fold(0u64, |h, x| h.rotate_left(7) ^ u64::from(x.to_bits()));
            assert_eq!(one.as_slice().len(), four.as_slice().len());
            assert_eq!(bits(one.as_slice()), bits(four.as_slice()), "{c:?}");
            several += usize::from(one.as_slice().len() > 1);
        }
        assert!(several > 200, "{several}");
    }
}
