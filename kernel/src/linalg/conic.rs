//! The two lines of a degenerate conic, and the root of a cubic that finds a degenerate conic in a pencil.
//!
//! Two conics `C1`, `C2` meet in up to four points. `C1 + s C2` passes through the same points for every `s`, and for
//! a root of the cubic `det(C1 + s C2) = 0` it is a pair of lines: two intersections of a line with a conic remain. If
//! the conics meet in real points, each real root gives real lines.

use nalgebra::Vector3;

use crate::Real;
use crate::real::{abs, lit, max, sqrt, with_sign_of};

/// Newton steps allowed for a root; five are usual, a start far from a triple root gains a factor 2/3 a step.
const MAX_STEPS: usize = 40;

/// One real root of `x^3 + c2 x^2 + c1 x + c0`: where there are three, the one farthest from the other two, which is
/// the best conditioned.
///
/// Householder's method of order three from beyond that root, where the cubic is convex: the steps only approach it,
/// without trigonometry or cube roots. The start is where the parabola that touches the cubic at its extremum has its root,
/// or above the root of a monotone cubic. The error after a step is of the order of its fourth power; the last step is
/// below `last_step` of the distance to the inflection.
///
/// Time is a chain of operations that wait for each other, so sums and products are paired to be short rather than few.
#[inline]
pub(crate) fn real_root_of_cubic<T: Real>(c2: T, c1: T, c0: T, last_step: T) -> T {
    let (third, three) = (lit::<T>(1.0 / 3.0), lit::<T>(3.0));
    // With x = centre -+ t, the inflection and the distance from it: t^3 - 3 p t - q, q >= 0.
    let centre = -c2 * third;
    let square = centre * centre;
    let p = square - c1 * third;
    let at_centre = c0 + centre * (c1 - (square + square));
    let q = abs(at_centre);
    // Beyond the root: for p > 0 the root of the parabola that touches at the extremum, else (mean inequality)
    // t^3 - 3 p t >= 2 sqrt(-3 p) t^2 > 3 sqrt(-p) t^2. One formula for both, without a branch.
    let size = abs(p);
    // The floor keeps the start of a nearly triple root within some steps of it.
    let floored = max(size, T::EPSILON * (c2 * c2 + abs(c0)) + T::MIN_POSITIVE);
    let extremum = sqrt(floored);
    let above = if p > T::ZERO { extremum } else { T::ZERO };
    let mut t = above + sqrt(q * (third / floored) * extremum + (size + p) * third);
    let p3 = three * p;
    let step = |t: T| {
        let square = t * t;
        let f = square * t - (p3 * t + q);
        let slope = three * square - p3;
        let square = slope * slope;
        // f times half the curvature
        let product = f * (three * t);
        f * (square - product) / (slope * (square - (product + product)) + f * f)
    };
    t -= step(t);
    for _ in 0..MAX_STEPS {
        let step = step(t);
        t -= step;
        if !(abs(step) > last_step * t) {
            break;
        }
    }
    centre - with_sign_of(t, at_centre)
}

/// Lines `p`, `q` with `c ~ p q' + q p'`, for a symmetric `c` (its upper triangle) of rank two whose lines are real;
/// where they are not, the nearest double line.
#[inline]
pub(crate) fn lines_of_conic<T: Real>([c00, c01, c02, c11, c12, c22]: [T; 6]) -> [Vector3<T>; 2] {
    // The adjugate is -v v' with v = p x q (up to a factor); the first entry of v is not needed, and of the others the
    // larger gives the smaller without cancellation.
    let a11 = c02 * c02 - c00 * c22;
    let a22 = c01 * c01 - c00 * c11;
    let larger = max(max(a11, a22), T::MIN_POSITIVE);
    let root = sqrt(larger);
    // Over the root, without waiting for it.
    let other = (c12 * c00 - c01 * c02) * (T::ONE / larger) * root;
    let v1 = if a22 > a11 { other } else { root };
    let v2 = if a11 >= a22 { other } else { root };
    // c + [v]x = 2 q p': rank one, its first row and first column are the lines.
    [Vector3::new(c00, c01 - v2, c02 + v1), Vector3::new(c00, c01 + v2, c02 - v1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The value of the cubic at the root, over what its terms round to.
    fn misses<T: Real>([c2, c1, c0]: [f64; 3]) -> f64 {
        let x = real_root_of_cubic::<T>(lit(c2), lit(c1), lit(c0), T::EPSILON).to_f64();
        let terms = x.abs().powi(3) + (c2 * x * x).abs() + (c1 * x).abs() + c0.abs();
        (((x + c2) * x + c1) * x + c0).abs() / (terms * T::EPSILON.to_f64())
    }

    #[test]
    fn roots_of_any_cubic() {
        let nearly_triple = [
            [0.0, 0.0, -1.0],
            [0.0, 0.0, 1.0],
            [1e-8, 0.0, -1.0],
            [0.0, 1e-12, -1.0],
            [0.0, 0.0, 1e-9],
            [0.0, 0.0, -1e9],
            [3.0, 3.0, 2.0],
            [-3.0, 3.0, -1.0 + 1e-3],
        ];
        let plain = [[0.0, -1.0, 0.0], [-6.0, 11.0, -6.0], [2.0, -5.0, 1.0], [-1e3, 1.0, 5.0]];
        for cubic in nearly_triple.into_iter().chain(plain) {
            assert!(misses::<f32>(cubic) < 16.0, "f32 {cubic:?}");
            assert!(misses::<f64>(cubic) < 16.0, "f64 {cubic:?}");
        }
    }
}
