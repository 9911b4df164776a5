//! Real roots of quartics.

use epipole::linalg::quartic_roots;
use epipole::real::lit;
use epipole_host_tests::cases::for_each_case;
use epipole_host_tests::in_both_scalars;
use epipole_host_tests::tolerances::{ROOT, ROUNDING};

/// `|p(x)|` over the sum of the sizes of its terms, in f64 on the rounded coefficients.
fn backward_error<T: epipole::Real>(c: &[T; 5], x: T) -> f64 {
    let x = x.to_f64();
    let (mut value, mut size) = (0.0, 0.0);
    for c in c.iter().rev() {
        value = value * x + c.to_f64();
        size = size * x.abs() + c.to_f64().abs();
    }
    value.abs() / size
}

/// The product of two polynomials, coefficients upwards.
fn times<const A: usize, const B: usize>(a: [f64; A], b: [f64; B]) -> [f64; 5] {
    let mut c = [0.0; 5];
    for (i, x) in a.into_iter().enumerate() {
        for (j, y) in b.into_iter().enumerate() {
            c[i + j] += x * y;
        }
    }
    c
}

in_both_scalars! {
    fn four_roots_are_found_in_order<T>() {
        for_each_case(5000, |_, rng| {
            let scale = 10f64.powf(rng.range(-6.0, 6.0));
            let mut truth = [0; 4].map(|_| rng.normal());
            truth.sort_by(f64::total_cmp);
            let [a, b, d, e] = truth.map(|x| x * scale);
            let lead = rng.normal();
            let c = times([a * b * lead, -(a + b) * lead, lead], [d * e, -(d + e), 1.0]).map(lit::<T>);
            let roots = quartic_roots(&c);
            assert!(roots.windows(2).all(|pair| pair[0] < pair[1]), "{roots:?}");
            for &x in &roots {
                assert!(backward_error(&c, x) < ROUNDING.of::<T>(), "{c:?} {x}");
            }
            if truth.windows(2).all(|pair| pair[1] - pair[0] > 0.5) {
                assert_eq!(roots.len(), 4, "{truth:?}");
                for (x, t) in roots.iter().zip(truth) {
                    assert!((x.to_f64() - t * scale).abs() < ROOT.of::<T>() * scale, "{truth:?} {roots:?}");
                }
            }
        });
    }

    fn complex_pairs_are_no_roots<T>() {
        for_each_case(2000, |_, rng| {
            let (re, im) = (rng.normal(), rng.range(0.5, 3.0));
            let pair = [re * re + im * im, -2.0 * re, 1.0];
            let (re, im) = (rng.normal(), rng.range(0.5, 3.0));
            assert!(quartic_roots(&times(pair, [re * re + im * im, -2.0 * re, 1.0]).map(lit::<T>)).is_empty());
            let (a, b) = (rng.normal(), rng.range(1.0, 2.0));
            let roots = quartic_roots(&times(pair, [a * (a + b), -(2.0 * a + b), 1.0]).map(lit::<T>));
            assert_eq!(roots.len(), 2, "{roots:?}");
        });
    }

    fn multiple_roots_and_special_forms<T>() {
        let roots = |c: [f64; 5]| quartic_roots(&c.map(lit::<T>)).iter().map(|x| x.to_f64()).collect::<Vec<_>>();
        assert_eq!(roots([0.0, 0.0, 0.0, 0.0, 3.0]), [0.0]);
        let near = |found: Vec<f64>, truth: &[f64]| {
            let bound = 4.0 * T::EPSILON.to_f64().sqrt();
            assert!(found.len() == truth.len() && found.iter().zip(truth).all(|(x, t)| (x - t).abs() < bound), "{found:?} {truth:?}");
        };
        near(roots([1.0, 0.0, -2.0, 0.0, 1.0]), &[-1.0, 1.0]); // both double
        near(roots([0.0, 0.0, -1.0, 0.0, 1.0]), &[-1.0, 0.0, 1.0]);
        near(roots([-16.0, 0.0, 0.0, 0.0, 1.0]), &[-2.0, 2.0]);
        near(roots([1.0, -4.0, 6.0, -4.0, 1.0]), &[1.0]);
    }

    fn malformed_coefficients_have_no_roots<T>() {
        for k in 0..5 {
            for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let mut c = [lit::<T>(1.0); 5];
                c[k] = lit(bad);
                assert!(quartic_roots(&c).is_empty());
            }
        }
        assert!(quartic_roots(&[1.0, 1.0, 1.0, 1.0, 0.0].map(lit::<T>)).is_empty());
        for_each_case(5000, |_, rng| {
            let c = [0; 5].map(|_| lit::<T>(rng.normal() * 10f64.powf(rng.range(-45.0, 38.0))));
            assert!(quartic_roots(&c).iter().all(|x| epipole::real::is_finite(*x)), "{c:?}");
        });
    }
}
