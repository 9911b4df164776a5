//! The scalar's functions, the list of solutions and the errors of malformed input.

use epipole::{InputError, Real, Solutions, real};
use epipole_host_tests::tolerances::ROUNDING;
use epipole_host_tests::{for_each_case, in_both_scalars};

/// Relative to the value, absolute below 1.
fn close<T: Real>(a: T, b: f64) -> bool {
    (a.to_f64() - b).abs() <= ROUNDING.of::<T>() * b.abs().max(1.0)
}

in_both_scalars! {
    fn elementary_functions_agree_with_the_standard_library<T>() {
        for_each_case(2000, |_, rng| {
            let x: T = real::lit(rng.range(-4.0, 4.0));
            let y: T = real::lit(rng.range(-4.0, 4.0));
            let (xf, yf) = (x.to_f64(), y.to_f64());
            let (sin, cos) = real::sin_cos(x);
            assert!(close(sin, xf.sin()) && close(cos, xf.cos()), "{xf}");
            assert!(close(real::atan2(y, x), yf.atan2(xf)), "{yf} {xf}");
            assert!(close(real::exp(x), xf.exp()), "{xf}");
            assert!(close(real::cbrt(x), xf.cbrt()), "{xf}");
            assert!(close(real::ln(real::abs(x)), xf.abs().ln()), "{xf}");
            assert!(close(real::sqrt(real::abs(x)), xf.abs().sqrt()), "{xf}");
            assert_eq!(real::abs(x).to_f64(), xf.abs());
            assert_eq!(real::max(x, y).to_f64(), xf.max(yf));
            assert_eq!(real::min(x, y).to_f64(), xf.min(yf));
        });
    }

    fn constants_and_conversions<T>() {
        assert_eq!((T::ZERO, T::ONE, T::TWO, T::HALF), (real::lit(0.0), real::lit(1.0), real::lit(2.0), real::lit(0.5)));
        assert!(T::ONE + T::EPSILON > T::ONE && T::ONE + T::EPSILON * T::HALF == T::ONE);
        assert!(!real::is_finite(T::MAX * T::TWO) && real::is_finite(T::MAX));
        assert!(T::MIN_POSITIVE > T::ZERO && T::MIN_POSITIVE * T::EPSILON * T::HALF == T::ZERO);
        assert_eq!(real::from_u32::<T>(1 << 24).to_f64(), f64::from(1u32 << 24));
        assert_eq!(real::lit::<T>(0.1).to_f64(), real::lit::<T>(real::lit::<T>(0.1).to_f64()).to_f64());
    }

    fn edges_of_the_elementary_functions<T>() {
        let (nan, infinity) = (real::lit::<T>(f64::NAN), real::lit::<T>(f64::INFINITY));
        assert!(real::sqrt(-T::ONE).to_f64().is_nan() && real::ln(-T::ONE).to_f64().is_nan());
        assert_eq!(real::ln(T::ZERO).to_f64(), f64::NEG_INFINITY);
        assert!(!real::is_finite(nan) && !real::is_finite(infinity) && !real::is_finite(-infinity));
        // What does not compare gives the second argument, in both.
        assert_eq!((real::max(nan, T::ONE), real::min(nan, T::ONE)), (T::ONE, T::ONE));
        assert!(real::max(T::ONE, nan).to_f64().is_nan() && real::min(T::ONE, nan).to_f64().is_nan());
        assert_eq!(real::atan2(T::ZERO, -T::ONE).to_f64(), real::lit::<T>(std::f64::consts::PI).to_f64());
    }
}

#[test]
fn a_list_of_solutions_holds_what_fits() {
    let mut list = Solutions::<u8, 2>::default();
    assert!(list.is_empty() && list == Solutions::new());
    assert!(list.push(1) && list.push(2));
    assert!(!list.push(3), "full");
    assert_eq!(list.as_slice(), &[1, 2]);
    assert_eq!((&list).into_iter().copied().sum::<u8>(), 3);
    assert_eq!(format!("{list:?}"), "[1, 2]");
    assert_eq!(list.into_iter().collect::<Vec<_>>(), [1, 2]);
}

#[test]
fn errors_of_input_say_what_and_where() {
    fn text(error: InputError) -> String {
        let error: Box<dyn std::error::Error> = Box::new(error);
        error.to_string()
    }
    assert!(text(InputError::NotFinite { array: 1, index: 7 }).contains("point 7 of array 1"));
    assert!(text(InputError::TooFew { given: 4, needed: 5 }).contains("4 correspondences given, 5 needed"));
    assert!(text(InputError::TooMany { given: 9, capacity: 8 }).contains("holds 8"));
    assert!(text(InputError::LengthMismatch { first: 3, second: 2 }).contains("3 and 2"));
}
