//! The scalar of every algorithm: `f32` or `f64`, and the elementary functions by which results stay equal to the bit
//! on every target.
//!
//! This is the only file that calls `libm` and `epipole-sqrt`. `RealField` has methods of the same names (`sqrt`,
//! `sin`, `max`, ...); the kernel does not use them, because what they call depends on the target and on features.

mod single;

use nalgebra::RealField;

mod sealed {
    /// Elementary functions, reached through the free functions of the parent module.
    pub trait Sealed: Sized {
        fn raw_sqrt(self) -> Self;
        fn raw_sin_cos(self) -> (Self, Self);
        fn raw_atan2(self, x: Self) -> Self;
        fn raw_ln(self) -> Self;
        fn raw_exp(self) -> Self;
        fn raw_cbrt(self) -> Self;
        fn raw_is_finite(self) -> bool;
        fn raw_abs(self) -> Self;
        fn raw_copysign(self, sign: Self) -> Self;
    }
}

/// A floating-point scalar: `f32` or `f64`. Sealed: no other type implements it.
pub trait Real: RealField + Copy + sealed::Sealed {
    /// 0
    const ZERO: Self;
    /// 1
    const ONE: Self;
    /// 2
    const TWO: Self;
    /// 1/2
    const HALF: Self;
    /// The difference between 1 and the next larger number: 2^-23 for `f32`, 2^-52 for `f64`.
    const EPSILON: Self;
    /// The largest finite number.
    const MAX: Self;
    /// The smallest positive normal number.
    const MIN_POSITIVE: Self;

    /// The nearest value of this type to `x` (a constant of a formula, a figure of a table).
    fn from_f64(x: f64) -> Self;
    /// The value as `f64`, exactly.
    fn to_f64(self) -> f64;
    /// The nearest value of this type to the integer `n`.
    fn from_u32(n: u32) -> Self;
    /// The integer part, the nearest 32-bit number where that is out of range, 0 for NaN.
    fn to_u32(self) -> u32;
}

macro_rules! impl_real {
    ($t:ident, $sqrt:path, $sin_cos:path, $atan2:path, $ln:path, $exp:path, $cbrt:path) => {
        impl sealed::Sealed for $t {
            // Small code for Arm calls it: the instruction is reached through core registers.
            #[cfg_attr(not(all(small, target_arch = "arm")), inline(always))]
            #[cfg_attr(all(small, target_arch = "arm"), inline(never))]
            fn raw_sqrt(self) -> Self {
                $sqrt(self)
            }
            #[inline]
            fn raw_sin_cos(self) -> (Self, Self) {
                $sin_cos(self)
            }
            #[inline]
            fn raw_atan2(self, x: Self) -> Self {
                $atan2(self, x)
            }
            #[inline]
            fn raw_ln(self) -> Self {
                $ln(self)
            }
            #[inline]
            fn raw_exp(self) -> Self {
                $exp(self)
            }
            #[inline]
            fn raw_cbrt(self) -> Self {
                $cbrt(self)
            }
            #[inline(always)]
            fn raw_is_finite(self) -> bool {
                $t::is_finite(self)
            }
            #[inline(always)]
            fn raw_abs(self) -> Self {
                $t::abs(self)
            }
            #[inline(always)]
            fn raw_copysign(self, sign: Self) -> Self {
                $t::copysign(self, sign)
            }
        }

        impl Real for $t {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const TWO: Self = 2.0;
            const HALF: Self = 0.5;
            const EPSILON: Self = $t::EPSILON;
            const MAX: Self = $t::MAX;
            const MIN_POSITIVE: Self = $t::MIN_POSITIVE;

            #[inline(always)]
            fn from_f64(x: f64) -> Self {
                x as $t
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                self as f64
            }
            #[inline(always)]
            fn from_u32(n: u32) -> Self {
                n as $t
            }
            #[inline(always)]
            fn to_u32(self) -> u32 {
                self as u32
            }
        }
    };
}

impl_real!(f32, epipole_sqrt::sqrt_f32, single::sin_cos, libm::atan2f, libm::logf, libm::expf, single::cbrt);
impl_real!(f64, epipole_sqrt::sqrt_f64, libm::sincos, libm::atan2, libm::log, libm::exp, libm::cbrt);

/// The nearest value of `T` to a constant. (`T::from_f64` is ambiguous: `RealField` has a method of that name.)
#[inline(always)]
#[must_use]
pub fn lit<T: Real>(x: f64) -> T {
    <T as Real>::from_f64(x)
}

/// The square root, correctly rounded; NaN for a negative `x`.
#[inline(always)]
pub fn sqrt<T: Real>(x: T) -> T {
    x.raw_sqrt()
}

/// `(sin x, cos x)`, `x` in radians.
#[inline]
pub fn sin_cos<T: Real>(x: T) -> (T, T) {
    x.raw_sin_cos()
}

/// The angle of the point `(x, y)`, in (-pi, pi].
#[inline]
pub fn atan2<T: Real>(y: T, x: T) -> T {
    y.raw_atan2(x)
}

/// The natural logarithm; NaN for a negative `x`, minus infinity for 0.
#[inline]
pub fn ln<T: Real>(x: T) -> T {
    x.raw_ln()
}

/// `e^x`.
#[inline]
pub fn exp<T: Real>(x: T) -> T {
    x.raw_exp()
}

/// The real cube root.
#[inline]
pub fn cbrt<T: Real>(x: T) -> T {
    x.raw_cbrt()
}

/// The absolute value: the sign bit cleared, without a comparison.
#[inline(always)]
pub fn abs<T: Real>(x: T) -> T {
    x.raw_abs()
}

/// The magnitude of `x` with the sign of `sign`. NaN's sign bit is the target's choice: only for a `sign` that is none, or
/// where the result is then NaN too, or not used.
#[inline(always)]
pub(crate) fn with_sign_of<T: Real>(x: T, sign: T) -> T {
    x.raw_copysign(sign)
}

/// The larger of two numbers; `b` where they do not compare.
#[inline(always)]
pub fn max<T: Real>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

/// The smaller of two numbers; `b` where they do not compare.
#[inline(always)]
pub fn min<T: Real>(a: T, b: T) -> T {
    if a < b { a } else { b }
}

/// False for NaN and the infinities.
#[inline(always)]
pub fn is_finite<T: Real>(x: T) -> bool {
    x.raw_is_finite()
}

/// The nearest value of `T` to the integer `n`.
#[inline(always)]
pub fn from_u32<T: Real>(n: u32) -> T {
    <T as Real>::from_u32(n)
}
