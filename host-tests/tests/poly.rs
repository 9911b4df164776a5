//! Real roots of polynomials of degree 10.

use epipole::Real;
use epipole::linalg::poly::{projective_roots_10, real_roots_10};
use epipole::real::lit;
use epipole_host_tests::cases::{for_each_case, share_of};
use epipole_host_tests::in_both_scalars;
use epipole_host_tests::tolerances::ROOT;

/// The polynomial with these real roots and a pair u +- iv for each of the others, scaled to a largest coefficient of 1.
fn expand(real: &[f64], pairs: &[(f64, f64)]) -> [f64; 11] {
    let mut c = [0.0; 11];
    c[0] = 1.0;
    let mut multiply = |factor: [f64; 3]| {
        for k in (0..11).rev() {
            let below = |n: usize| if k >= n { c[k - n] } else { 0.0 };
            c[k] = c[k] * factor[0] + below(1) * factor[1] + below(2) * factor[2];
        }
    };
    real.iter().for_each(|&r| multiply([-r, 1.0, 0.0]));
    pairs.iter().for_each(|&(u, v)| multiply([u * u + v * v, -2.0 * u, 1.0]));
    let largest = c.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    c.map(|v| v / largest)
}

fn all_roots<T: Real>(c: &[T; 11]) -> Vec<f64> {
    let [inside, outside] = projective_roots_10(c, T::EPSILON);
    let mut roots: Vec<f64> = inside.as_slice().iter().map(|x| x.to_f64()).collect();
    roots.extend(outside.as_slice().iter().map(|x| 1.0 / x.to_f64()));
    roots.sort_by(f64::total_cmp);
    roots
}

in_both_scalars! {
    /// Well separated roots: each is found once, to the accuracy that its slope allows.
    fn finds_separated_roots<T>() {
        for_each_case(2000, |_, rng| {
            // Angles on the projective line, at least 8 degrees apart.
            let count = 2 * rng.index(3);
            let mut angles: Vec<f64> = Vec::new();
            while angles.len() < count {
                let a = rng.range(-1.5, 1.5);
                if angles.iter().all(|b| (a - b).abs() > 0.14) {
                    angles.push(a);
                }
            }
            let mut real: Vec<f64> = angles.iter().map(|a| a.tan()).collect();
            real.sort_by(f64::total_cmp);
            let pairs: Vec<_> =
                (0..(10 - count) / 2).map(|_| (rng.range(-2.0, 2.0), rng.range(0.7, 2.0))).collect();
            let c = expand(&real, &pairs).map(|v| lit::<T>(v));
            let exact = c.map(T::to_f64);
            let found = all_roots(&c);
            assert_eq!(found.len(), count, "{real:?} {found:?}");
            for (&x, &r) in found.iter().zip(&real) {
                // The error of the value over the slope, at the root.
                let (mut size, mut slope) = (0.0, 0.0);
                for k in 0..11 {
                    size += exact[k].abs() * r.abs().powi(k as i32);
                    slope += k as f64 * exact[k] * r.powi(k as i32 - 1);
                }
                let bound = 32.0 * T::EPSILON.to_f64() * size / slope.abs() + ROOT.of::<T>() * r.abs();
                assert!((x - r).abs() < bound, "{x} {r} {bound}");
            }
        });
    }

    fn zero_infinity_and_the_seams<T>() {
        for root in [0.0, 1.0, -1.0, 0.5, -0.5, 0.25, 2.0, -2.0] {
            let c = expand(&[root, -3.3], &[(0.1, 1.0), (-0.4, 1.5), (1.0, 1.0), (0.0, 2.0)]).map(|v| lit::<T>(v));
            let found = all_roots(&c);
            assert_eq!(found.len(), 2, "{root}: {found:?}");
            assert!(found.iter().any(|x| (x - root).abs() < ROOT.of::<T>()), "{root}: {found:?}");
        }
        // Degree 9: one root at infinity.
        let mut c = expand(&[0.3], &[(0.1, 1.0), (-0.4, 1.5), (1.0, 1.0), (0.0, 2.0)]).map(|v| lit::<T>(v));
        c[10] = T::ZERO;
        let [inside, outside] = projective_roots_10(&c, T::EPSILON);
        assert_eq!((inside.as_slice().len(), outside.as_slice()), (1, &[T::ZERO][..]));
    }

    fn a_double_root_gives_candidates_on_both_sides<T>() {
        let c = expand(&[0.3, 0.3], &[(0.1, 1.0), (-0.4, 1.5), (1.0, 1.0), (0.0, 2.0)]).map(|v| lit::<T>(v));
        let roots = real_roots_10(&c, lit::<T>(4.0) * T::EPSILON);
        assert_eq!(roots.as_slice().len(), 2);
        let reach = 100.0 * T::EPSILON.to_f64().sqrt();
        assert!(roots.as_slice().iter().all(|x| (x.to_f64() - 0.3).abs() < reach));
        let least = roots.least_determined();
        assert!((least.x.to_f64() - 0.3).abs() < reach && least.spread > T::EPSILON);
    }

    fn malformed_polynomials_end<T>() {
        for bad in [f64::NAN, f64::INFINITY, 0.0, 1e30] {
            for k in 0..11 {
                let mut c = expand(&[0.3, 0.6], &[(0.1, 1.0), (-0.4, 1.5), (1.0, 1.0), (0.0, 2.0)]).map(|v| lit::<T>(v));
                c[k] = lit(bad);
                assert!(projective_roots_10(&c, T::EPSILON).iter().all(|r| r.as_slice().len() <= 12));
            }
        }
        assert!(projective_roots_10(&[T::ZERO; 11], T::EPSILON).iter().all(|r| r.as_slice().len() <= 12));
    }
}

/// Close pairs: two roots 1e-3 down to 1e-6 apart are told apart in double precision, a pair of complex roots as near the
/// axis is not taken for real ones.
#[test]
fn close_pairs() {
    share_of(1000, |_, rng| {
        let (x, gap) = (rng.range(-0.95, 0.95), 10f64.powf(rng.range(-6.0, -3.0)));
        let others = [(0.1, 1.0), (-0.4, 1.5), (1.0, 1.0), (0.0, 2.0)];
        let two = real_roots_10(&expand(&[x, x + gap], &others), f64::EPSILON);
        let mut pairs = others.to_vec();
        pairs.push((x, gap));
        let none = real_roots_10(&expand(&[], &pairs), f64::EPSILON);
        two.as_slice().len() == 2
            && two.as_slice().iter().any(|r| (r - x).abs() < 0.1 * gap)
            && two.as_slice().iter().any(|r| (r - x - gap).abs() < 0.1 * gap)
            && none.as_slice().is_empty()
    })
    .assert_at_least(0.999);
}
