//! Real roots of quadratics and cubics.

use epipole::Real;
use epipole::linalg::{cubic_roots, quadratic_roots};
use epipole::real::lit;
use epipole_host_tests::cases::for_each_case;
use epipole_host_tests::in_both_scalars;
use epipole_host_tests::tolerances::{ROOT, ROUNDING};

/// `|p(x)|` over the sum of the sizes of its terms, in f64 on the rounded coefficients.
fn backward_error<T: Real, const N: usize>(c: &[T; N], x: T) -> f64 {
    let x = x.to_f64();
    let (mut value, mut size) = (0.0, 0.0);
    for c in c.iter().rev() {
        value = value * x + c.to_f64();
        size = size * x.abs() + c.to_f64().abs();
    }
    value.abs() / size
}

/// Coefficients of the monic polynomial with these roots, times `lead`, upwards.
fn from_roots<const N: usize, const M: usize>(roots: [f64; N], lead: f64) -> [f64; M] {
    let mut c = [0.0; M];
    c[0] = lead;
    for (degree, root) in roots.into_iter().enumerate() {
        for k in (0..=degree).rev() {
            c[k + 1] += c[k];
            c[k] *= -root;
        }
    }
    c
}

in_both_scalars! {
    fn three_roots_are_found<T>() {
        for_each_case(5000, |_, rng| {
            let scale = 10f64.powf(rng.range(-6.0, 6.0));
            let truth = [0; 3].map(|_| rng.normal() * scale);
            let c: [T; 4] = from_roots(truth, rng.normal()).map(lit);
            let roots = cubic_roots(&c);
            let separation = [(0, 1), (1, 2), (2, 0)].map(|(i, j)| (truth[i] - truth[j]).abs()).into_iter().fold(f64::INFINITY, f64::min) / scale;
            for &x in &roots {
                assert!(backward_error(&c, x) < ROUNDING.of::<T>(), "{c:?} {x}");
            }
            if separation > 0.5 {
                assert_eq!(roots.len(), 3);
                for t in truth {
                    let error = roots.iter().map(|x| (x.to_f64() - t).abs()).fold(f64::INFINITY, f64::min);
                    assert!(error < ROOT.of::<T>() * scale, "{truth:?} {roots:?}");
                }
            }
        });
    }

    fn the_number_of_roots_is_that_of_the_discriminant<T>() {
        for_each_case(5000, |_, rng| {
            let c = [0; 4].map(|_| lit::<T>(rng.normal()));
            let [d, e, b, a] = c.map(T::to_f64);
            let terms = [18.0 * a * b * e * d, -4.0 * b * b * b * d, b * b * e * e, -4.0 * a * e * e * e, -27.0 * a * a * d * d];
            let (discriminant, size) = (terms.iter().sum::<f64>(), terms.iter().map(|t| t.abs()).sum::<f64>());
            let roots = cubic_roots(&c);
            if discriminant.abs() > 1e-3 * size {
                assert_eq!(roots.len(), if discriminant > 0.0 { 3 } else { 1 }, "{c:?}");
            }
            for &x in &roots {
                assert!(backward_error(&c, x) < ROUNDING.of::<T>(), "{c:?} {x}");
            }
        });
    }

    fn multiple_roots_and_special_forms<T>() {
        let roots = |c: [f64; 4]| cubic_roots(&c.map(lit::<T>)).iter().map(|x| x.to_f64()).collect::<Vec<_>>();
        assert_eq!(roots([0.0, 0.0, 0.0, 2.0]), [0.0, 0.0]); // the double root of a triple one counts once
        assert_eq!(roots([8.0, 0.0, 0.0, 1.0]), [-2.0]);
        assert_eq!(roots([0.0, 1.0, 0.0, 1.0]), [0.0]);
        assert_eq!(roots([0.0, -1.0, 0.0, 1.0]).len(), 3);
        // (x - 1)^2 (x + 2): the double root once or twice, near 1.
        let double = roots([2.0, -3.0, 0.0, 1.0]);
        assert_eq!(double[0], -2.0);
        assert!(double.len() > 1 && double[1..].iter().all(|x| (x - 1.0).abs() < 2.0 * T::EPSILON.to_f64().sqrt()));
        // (x - 1)^3: a triple root is known to the cube root of EPSILON.
        let triple = roots([-1.0, 3.0, -3.0, 1.0]);
        assert!(!triple.is_empty() && triple.iter().all(|x| (x - 1.0).abs() < 4.0 * T::EPSILON.to_f64().cbrt()));
        for c in [[1.0, 2.0, 3.0, 0.0], [f64::NAN, 0.0, 0.0, 1.0], [1.0, f64::INFINITY, 0.0, 1.0], [1.0, 1.0, 1.0, f64::NAN]] {
            assert!(roots(c).is_empty(), "{c:?}");
        }
    }

    fn quadratics<T>() {
        for_each_case(3000, |_, rng| {
            // Roots up to eight orders of magnitude apart: the smaller keeps its digits.
            let truth = [rng.normal(), rng.normal() * 10f64.powf(-8.0 * rng.unit())];
            let c: [T; 3] = from_roots(truth, rng.normal()).map(lit);
            let roots = quadratic_roots(&c);
            for &x in &roots {
                assert!(backward_error(&c, x) < ROUNDING.of::<T>());
            }
            if (truth[0] - truth[1]).abs() > 0.1 {
                assert_eq!(roots.len(), 2);
                assert!(roots[0].to_f64().abs() >= roots[1].to_f64().abs());
            }
        });
        let roots = |c: [f64; 3]| quadratic_roots(&c.map(lit::<T>)).iter().map(|x| x.to_f64()).collect::<Vec<_>>();
        assert!(roots([1.0, 1.0, 1.0]).is_empty());
        assert_eq!(roots([0.0, 0.0, 1.0]), [0.0]);
        assert_eq!(roots([0.0, 1.0, 1.0]), [-1.0, 0.0]);
        assert_eq!(roots([3.0, 2.0, 0.0]), [-1.5]);
        assert!(roots([1.0, 0.0, 0.0]).is_empty() && roots([0.0, 0.0, 0.0]).is_empty());
        assert!(roots([f64::NAN, 1.0, 1.0]).is_empty() && roots([1.0, f64::INFINITY, 1.0]).is_empty());
    }
}
