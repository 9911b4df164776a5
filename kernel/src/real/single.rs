//! Sine, cosine and cube root in single precision, by nothing wider. Those of `libm` compute in double precision: on a
//! core whose FPU has single precision alone that is software, six kilobytes of it.

use super::{abs, with_sign_of};

/// 2 / pi: 32 bits before the point, 224 after it.
const TWO_OVER_PI: [u32; 8] =
    [0, 0xA2F9_836E, 0x4E44_1529, 0xFC27_57D1, 0xF534_DDC0, 0xDB62_9599, 0x3C43_9041, 0xFE51_63AB];

/// `sin(r) / r` and `cos(r)` by powers of `r^2`, to rounding up to pi/4.
const SINE: [f32; 5] = [1.0, -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362_880.0];
const COSINE: [f32; 6] = [1.0, -0.5, 1.0 / 24.0, -1.0 / 720.0, 1.0 / 40_320.0, -1.0 / 3_628_800.0];

fn series(coefficients: &[f32], x: f32) -> f32 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// `(sin x, cos x)`, to 3.2 units in the last place for any finite number; NaN for others.
///
/// # References
/// M. Payne, R. Hanek, "Radian reduction for trigonometric functions", ACM SIGNUM Newsletter, 1983.
pub(super) fn sin_cos(x: f32) -> (f32, f32) {
    if !x.is_finite() {
        return (f32::NAN, f32::NAN);
    }
    let size = abs(x);
    let (quarter, r) = if size < core::f32::consts::FRAC_PI_4 { (0, size) } else { reduce(size) };
    let square = r * r;
    let (sine, cosine) = (r * series(&SINE, square), series(&COSINE, square));
    let (sine, cosine) = match quarter {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    };
    (sine * with_sign_of(1.0, x), cosine)
}

/// How many quarter turns, modulo 4, are nearest to `x >= pi/4`, and the angle from there.
fn reduce(x: f32) -> (u32, f32) {
    let bits = x.to_bits();
    // x = mantissa 2^(exponent - 150).
    let (mantissa, exponent) = (u64::from(bits & 0x7F_FFFF | 0x80_0000), bits >> 23);
    // Of the product with 2 / pi the bits from 2 on are whole turns: those of 2 / pi that make no others are left out.
    let first = exponent.saturating_sub(120);
    let (word, shift) = (first / 32, first % 32);
    let at = |k: u32| u64::from(TWO_OVER_PI.get((word + k) as usize).copied().unwrap_or(0));
    let window = |k: u32| ((at(k) << 32 | at(k + 1)) << shift) >> 32;
    let product = mantissa
        .wrapping_mul(window(0) << 32 | window(1))
        .wrapping_add(mantissa.wrapping_mul(window(2)) >> 32);
    // Two bits of quarter turns, rounded, and 62 of their fraction.
    let quarter = product.wrapping_add(1 << 61) >> 62;
    let fraction = product.wrapping_sub(quarter << 62) as i64;
    const UNIT: f32 = core::f32::consts::FRAC_PI_2 / (1u64 << 62) as f32;
    (quarter as u32, fraction as f32 * UNIT)
}

/// The real cube root, to one unit in the last place; zeros, infinities and NaN as they are.
///
/// # References
/// W. Kahan, "Computing a real cube root", 1991 (the start from a third of the exponent; then Halley's steps).
pub(super) fn cbrt(x: f32) -> f32 {
    if !(x.is_finite() && x != 0.0) {
        return x;
    }
    let size = abs(x);
    let tiny = size < f32::MIN_POSITIVE;
    let size = if tiny { size * (1u32 << 24) as f32 } else { size };
    // The bits of a number are its logarithm, but for a few percent.
    let mut root = f32::from_bits(size.to_bits() / 3 + 709_958_130);
    for _ in 0..2 {
        let other = size / (root * root);
        root += root * ((other - root) / (root + root + other));
    }
    with_sign_of(if tiny { root / 256.0 } else { root }, x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Units in the last place between a result and the truth.
    fn ulps(a: f32, truth: f64) -> f64 {
        let unit =
            f64::from(f32::from_bits((truth.abs() as f32).to_bits() + 1)) - f64::from(truth.abs() as f32);
        (f64::from(a) - truth).abs() / unit
    }

    /// Numbers of all sizes, signs and mantissas.
    fn numbers() -> impl Iterator<Item = f32> {
        (0..2_000_000u32).map(|i| f32::from_bits(i.wrapping_mul(2_654_435_769))).filter(|x| x.is_finite())
    }

    #[test]
    fn sines_and_cosines_are_good_to_three_units_in_the_last_place() {
        let turns = (1..20_000).map(|k| (f64::from(k) * core::f64::consts::FRAC_PI_4) as f32);
        for x in numbers().chain(turns) {
            let (sine, cosine) = sin_cos(x);
            let (s, c) = f64::from(x).sin_cos();
            assert!(ulps(sine, s) < 3.0 && ulps(cosine, c) < 3.0, "{x:e}: {sine} {s}, {cosine} {c}");
        }
    }

    #[test]
    fn cube_roots_are_good_to_one_unit_in_the_last_place() {
        for x in numbers().filter(|x| *x != 0.0) {
            assert!(ulps(cbrt(x), f64::from(x).cbrt()) < 1.0, "{x:e}: {}", cbrt(x));
        }
    }

    #[test]
    fn edges() {
        for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert!(sin_cos(x).0.is_nan() && sin_cos(x).1.is_nan());
        }
        assert_eq!(sin_cos(-0.0), (0.0, 1.0));
        assert!(sin_cos(-0.0).0.is_sign_negative() && cbrt(-0.0).is_sign_negative());
        assert!(cbrt(f32::NAN).is_nan());
        assert_eq!([cbrt(f32::INFINITY), cbrt(-8.0), cbrt(27.0)], [f32::INFINITY, -2.0, 3.0]);
    }
}
