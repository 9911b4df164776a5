//! Independent numbers side by side, as many as pay on the target: four where there are vector registers, so that no
//! operation waits for the one before it; one where there are none, so that no lane is worked on in vain and a step's
//! numbers stay in registers. No lane sees another, so the bits of each are the same whatever the count.

use core::ops::{Add, Div, Mul, Neg, Sub};

use crate::Real;
use crate::real;

/// Lanes that pay on this target.
pub(crate) const BATCH: usize =
    if cfg!(any(target_feature = "sse2", target_feature = "neon", target_feature = "simd128")) {
        4
    } else {
        1
    };

/// `L` numbers; every operation is element by element.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Batch<T, const L: usize>(pub(crate) [T; L]);

macro_rules! operator {
    ($trait:ident, $method:ident, $op:tt) => {
        impl<T: Real, const L: usize> $trait for Batch<T, L> {
            type Output = Self;
            #[inline(always)]
            fn $method(mut self, o: Self) -> Self {
                for k in 0..L {
                    self.0[k] $op o.0[k];
                }
                self
            }
        }
    };
}
operator!(Add, add, +=);
operator!(Sub, sub, -=);
operator!(Mul, mul, *=);
operator!(Div, div, /=);

impl<T: Real, const L: usize> Neg for Batch<T, L> {
    type Output = Self;
    #[inline(always)]
    fn neg(mut self) -> Self {
        for k in 0..L {
            self.0[k] = -self.0[k];
        }
        self
    }
}

impl<T: Real, const L: usize> Batch<T, L> {
    /// The same number in all lanes. Not `[v; L]`, of which code for size keeps a loop even for one lane.
    #[inline(always)]
    pub(crate) fn splat(v: T) -> Self {
        Self(core::array::from_fn(|_| v))
    }

    /// `self` times a number common to all lanes.
    #[inline(always)]
    pub(crate) fn times(mut self, f: T) -> Self {
        for x in &mut self.0 {
            *x *= f;
        }
        self
    }

    /// Square roots (`sqrt` is a name that the numeric policy forbids as a method).
    #[inline(always)]
    pub(crate) fn root(mut self) -> Self {
        for k in 0..L {
            self.0[k] = real::sqrt(self.0[k]);
        }
        self
    }

    /// In which lanes `self` is greater; false for NaN.
    #[inline(always)]
    pub(crate) fn greater(self, o: Self) -> [bool; L] {
        let mut greater = [false; L];
        for k in 0..L {
            greater[k] = self.0[k] > o.0[k];
        }
        greater
    }

    /// `a` where `mask`, `b` elsewhere.
    #[inline(always)]
    pub(crate) fn select(mask: [bool; L], a: Self, mut b: Self) -> Self {
        for k in 0..L {
            b.0[k] = if mask[k] { a.0[k] } else { b.0[k] };
        }
        b
    }
}
