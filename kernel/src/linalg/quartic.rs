//! Real roots of quartics, isolated by their extrema.

use super::cubic_roots;
use crate::real::{abs, cbrt, is_finite, lit, max, sqrt};
use crate::{Real, Solutions};

/// Steps at the most for one root: each at least halves the last step or the interval.
const MAX_STEPS: usize = 80;

/// The real roots of `c[0] + c[1] x + .. + c[4] x^4`.
///
/// # Input
/// `c[4]` not much smaller than the others: where it vanishes a root goes to infinity and is lost. Any scale.
///
/// # Returns
/// None to four roots, ascending. Roots that coincide to within rounding count once. Nothing where a coefficient is not
/// finite, `c[4]` is zero or their quotients overflow.
///
/// # Accuracy
/// The residual of each root is a few `EPSILON` times the sum of the sizes of the quartic's terms there.
///
/// # Cost
/// The roots of the derivative ([`cubic_roots`]) and at most 80 safeguarded Newton steps a root, 4 to 8 as a rule.
///
/// # References
/// M. Fujiwara, "Über die obere Schranke des absoluten Betrages der Wurzeln einer algebraischen Gleichung", Tôhoku
/// Mathematical Journal, 1916 (the bound). Between neighbouring extrema a polynomial is monotone.
///
/// # Examples
/// ```
/// use epipole::linalg::quartic_roots;
/// let roots = quartic_roots(&[24.0_f64, -50.0, 35.0, -10.0, 1.0]);
/// assert!(roots.len() == 4 && roots.iter().zip([1.0, 2.0, 3.0, 4.0]).all(|(r, x)| (r - x).abs() < 1e-13));
/// assert!(quartic_roots(&[1.0_f32, 0.0, 0.0, 0.0, 1.0]).is_empty());
/// ```
#[inline]
pub fn quartic_roots<T: Real>(c: &[T; 5]) -> Solutions<T, 4> {
    let mut roots = Solutions::new();
    let inverse = T::ONE / c[4];
    let (p0, p1, p2, p3) = (c[0] * inverse, c[1] * inverse, c[2] * inverse, c[3] * inverse);
    let finite = is_finite(c[4]) && is_finite(p0) && is_finite(p1) && is_finite(p2) && is_finite(p3);
    if !finite {
        return roots;
    }
    // With x = size y every coefficient is at most 1 and every root lies in [-2, 2] (Fujiwara).
    let size = max(max(abs(p3), sqrt(abs(p2))), max(cbrt(abs(p1)), sqrt(sqrt(abs(p0)))));
    if !(size > T::ZERO) {
        roots.push(T::ZERO);
        return roots;
    }
    let q3 = p3 / size;
    let q2 = p2 / size / size;
    let q1 = p1 / size / size / size;
    let q0 = p0 / size / size / size / size;
    let value = |y: T| (((y + q3) * y + q2) * y + q1) * y + q0;
    let slope = |y: T| ((lit::<T>(4.0) * y + lit::<T>(3.0) * q3) * y + q2 + q2) * y + q1;
    let rounding = |y: T| {
        let a = abs(y);
        lit::<T>(4.0) * T::EPSILON * ((((a + abs(q3)) * a + abs(q2)) * a + abs(q1)) * a + abs(q0))
    };

    let mut low = -lit::<T>(2.0);
    let mut at_low = value(low);
    let mut touches = abs(at_low) <= rounding(low);
    if touches {
        roots.push(low * size);
    }
    let extrema = sorted(cubic_roots(&[q1, q2 + q2, lit::<T>(3.0) * q3, lit(4.0)]));
    for high in extrema.into_iter().chain([lit::<T>(2.0)]) {
        if !(high > low && high <= lit(2.0)) {
            continue;
        }
        let at_high = value(high);
        let touched = touches;
        touches = abs(at_high) <= rounding(high);
        if touches {
            // A multiple root; of two neighbours that both touch, the same one.
            if !touched {
                roots.push(high * size);
            }
        } else if !touched && (at_low > T::ZERO) != (at_high > T::ZERO) {
            roots.push(bracketed(low, high, at_high > T::ZERO, value, slope) * size);
        }
        (low, at_low) = (high, at_high);
    }
    roots
}

/// The root between `low` and `high`, where the values differ in sign: Newton's method, and bisection where it leaves the
/// interval or does not halve its step.
fn bracketed<T: Real>(
    mut low: T,
    mut high: T,
    rising: bool,
    value: impl Fn(T) -> T,
    slope: impl Fn(T) -> T,
) -> T {
    let mut x = (low + high) * T::HALF;
    let mut last = high - low;
    for _ in 0..MAX_STEPS {
        let v = value(x);
        if (v > T::ZERO) == rising {
            high = x;
        } else {
            low = x;
        }
        let mut step = v / slope(x);
        // Written so that a step that is not a number is replaced too.
        if !(x - step > low && x - step < high && abs(step) <= last * T::HALF) {
            step = x - (low + high) * T::HALF;
        }
        x -= step;
        last = abs(step);
        if last <= T::EPSILON * abs(x) {
            break;
        }
    }
    x
}

/// The roots of a cubic, ascending; the largest number where there are fewer than three.
fn sorted<T: Real>(roots: Solutions<T, 3>) -> [T; 3] {
    let mut x = [T::MAX; 3];
    for (slot, &root) in x.iter_mut().zip(&roots) {
        *slot = root;
    }
    let in_order = |a: T, b: T| if a > b { (b, a) } else { (a, b) };
    let [a, b, c] = x;
    let (a, b) = in_order(a, b);
    let (b, c) = in_order(b, c);
    let (a, b) = in_order(a, b);
    [a, b, c]
}
