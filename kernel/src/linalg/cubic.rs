//! Real roots of quadratics and cubics, without trigonometric functions.

use crate::real::{abs, cbrt, is_finite, lit, min, sqrt};
use crate::{Real, Solutions};

/// Newton steps at the most for the first root of a cubic: they close in from one side, 3 to 6 are usual.
const MAX_STEPS: usize = 40;

/// The real roots of `c[0] + c[1] x + c[2] x^2`.
///
/// # Returns
/// No root, one (of a linear equation, or a double one) or two, the larger in magnitude first. A pair that rounding may
/// have lifted off the axis is one double root. Nothing where a coefficient is not finite or its square
/// overflows, or both `c[1]` and `c[2]` are zero.
///
/// # Accuracy
/// Each simple root to a few `EPSILON`, without cancellation.
///
/// # Examples
/// ```
/// use epipole::linalg::quadratic_roots;
/// assert_eq!(quadratic_roots(&[6.0, -5.0, 1.0]).as_slice(), [3.0, 2.0]);
/// assert_eq!(quadratic_roots(&[1.0_f32, -2.0, 1.0]).as_slice(), [1.0]);
/// assert!(quadratic_roots(&[1.0, 0.0, 1.0]).is_empty());
/// ```
#[inline]
pub fn quadratic_roots<T: Real>(c: &[T; 3]) -> Solutions<T, 2> {
    let mut roots = Solutions::new();
    let [constant, linear, square] = *c;
    let half = -linear * T::HALF;
    let discriminant = half * half - constant * square;
    let rounding = lit::<T>(4.0) * T::EPSILON * (half * half + abs(constant * square));
    // Written so that NaN and overflow fail too.
    if !(discriminant >= -rounding && discriminant <= T::MAX) {
        return roots;
    }
    let root = if discriminant > rounding { sqrt(discriminant) } else { T::ZERO };
    // Same signs are added: the sum is exact to rounding, and the product of the roots gives the other one.
    let sum = if half < T::ZERO { half - root } else { half + root };
    let larger = sum / square;
    if is_finite(larger) {
        roots.push(larger);
    }
    if root > T::ZERO {
        let smaller = constant / sum;
        if is_finite(smaller) {
            roots.push(smaller);
        }
    }
    roots
}

/// The real roots of the cubic `c[0] + c[1] x + c[2] x^2 + c[3] x^3`.
///
/// # Input
/// `c[3]` not much smaller than the others: where it vanishes a root goes to infinity and is lost. Any scale.
///
/// # Returns
/// One root or three (two where two of them coincide to within rounding); the one farthest from the inflection first.
/// Nothing where a coefficient is not finite, `c[3]` is zero or their quotients overflow.
///
/// # Accuracy
/// The residual of each root is a few `EPSILON` times the sum of the sizes of the cubic's terms there.
///
/// # Cost
/// At most 40 Newton steps, 3 to 6 as a rule, and two steps for the other two roots.
///
/// # References
/// R. W. D. Nickalls, "A new approach to solving the cubic: Cardan's solution revealed", The Mathematical Gazette, 1993
/// (where the outer roots lie); W. Kahan, "To Solve a Real Cubic Equation", University of California, Berkeley, 1986
/// (deflation). Newton's method replaces the trigonometric and cube-root formulas.
///
/// # Examples
/// ```
/// use epipole::linalg::cubic_roots;
/// let roots = cubic_roots(&[-6.0_f64, 11.0, -6.0, 1.0]);
/// assert!([1.0, 2.0, 3.0].iter().all(|x| roots.iter().any(|r| (r - x).abs() < 1e-14)));
/// assert_eq!(cubic_roots(&[-8.0_f32, 0.0, 0.0, 1.0]).as_slice(), [2.0]);
/// ```
#[inline]
pub fn cubic_roots<T: Real>(c: &[T; 4]) -> Solutions<T, 3> {
    let mut roots = Solutions::new();
    let inverse = T::ONE / c[3];
    let (p0, p1, p2) = (c[0] * inverse, c[1] * inverse, c[2] * inverse);
    if !(is_finite(p0) && is_finite(p1) && is_finite(p2)) {
        return roots;
    }
    let value = |x: T| ((x + p2) * x + p1) * x + p0;
    let slope = |x: T| (lit::<T>(3.0) * x + p2 + p2) * x + p1;

    // With x = centre + t: t^3 - 3 d t + q, symmetric about the inflection but for the sign of q.
    let third = lit::<T>(1.0 / 3.0);
    let centre = -p2 * third;
    let d = -(p2 * centre + p1) * third;
    let q = value(centre);
    let size = abs(q);
    let reach = if d > T::ZERO { sqrt(d) } else { T::ZERO };
    let limit = T::TWO * d * reach;
    let start = if size <= limit && limit > T::ZERO {
        // Three roots: the outer one lies between sqrt 3 and 2 times `reach`, almost linear in q.
        reach * (lit::<T>(1.732_050_8) + lit::<T>(0.267_949_2) * (size / limit))
    } else {
        // One root: a bound beyond it.
        let root = cbrt(size);
        if d > T::ZERO {
            root + d / root
        } else if d < T::ZERO {
            min(size / (lit::<T>(-3.0) * d), root)
        } else {
            root
        }
    };
    let mut x = if q > T::ZERO { centre - start } else { centre + start };
    for _ in 0..MAX_STEPS {
        let step = value(x) / slope(x);
        // Not a number where the root is triple: the centre is the root.
        if !(abs(step) <= T::MAX) {
            break;
        }
        x -= step;
        if abs(step) <= T::TWO * T::EPSILON * abs(x) {
            break;
        }
    }
    if !is_finite(x) {
        return roots;
    }
    roots.push(x);

    // Division of the cubic by x - root: from the constant term where the root is large beside the others, which would
    // else drown in its rounding (Kahan).
    let (linear, constant) = if abs(x * x * x) > abs(p0) {
        let constant = -p0 / x;
        ((constant - p1) / x, constant)
    } else {
        (p2 + x, (p2 + x) * x + p1)
    };
    let rest = quadratic_roots(&[constant, linear, T::ONE]);
    let gap = if let [a, b] = *rest.as_slice() { abs(a - b) } else { T::ZERO };
    for &root in &rest {
        // The deflated quadratic has the first root's error: one step on the cubic takes it out of a simple root.
        let step = value(root) / slope(root);
        roots.push(if abs(step) < gap * lit(0.25) { root - step } else { root });
    }
    roots
}
