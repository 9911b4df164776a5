//! Four independent numbers side by side. The lane count is fixed in source, so that bits do not depend on the width of
//! the target's registers; a compiler with vector registers uses them, and without them four chains still overlap.

use core::ops::{Add, Div, Mul, Neg, Sub};

use crate::Real;
use crate::real;

/// Four numbers; every operation is element by element.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Four<T>(pub(crate) [T; 4]);

macro_rules! operator {
    ($trait:ident, $method:ident, $op:tt) => {
        impl<T: Real> $trait for Four<T> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                let ([a, b, c, d], [e, f, g, h]) = (self.0, o.0);
                Self([a $op e, b $op f, c $op g, d $op h])
            }
        }
    };
}
operator!(Add, add, +);
operator!(Sub, sub, -);
operator!(Mul, mul, *);
operator!(Div, div, /);

impl<T: Real> Neg for Four<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(|v| -v))
    }
}

impl<T: Real> Four<T> {
    /// The same number in all lanes.
    #[inline(always)]
    pub(crate) fn splat(v: T) -> Self {
        Self([v; 4])
    }

    /// `self` times a number common to all lanes.
    #[inline(always)]
    pub(crate) fn times(self, f: T) -> Self {
        self * Self::splat(f)
    }

    /// Square roots (`sqrt` is a name that the numeric policy forbids as a method).
    #[inline(always)]
    pub(crate) fn root(self) -> Self {
        let [a, b, c, d] = self.0;
        Self([real::sqrt(a), real::sqrt(b), real::sqrt(c), real::sqrt(d)])
    }

    /// In which lanes `self` is greater; false for NaN.
    #[inline(always)]
    pub(crate) fn greater(self, o: Self) -> [bool; 4] {
        let ([a, b, c, d], [e, f, g, h]) = (self.0, o.0);
        [a > e, b > f, c > g, d > h]
    }

    /// `a` where `mask`, `b` elsewhere.
    #[inline(always)]
    pub(crate) fn select(mask: [bool; 4], a: Self, b: Self) -> Self {
        let ([a0, a1, a2, a3], [b0, b1, b2, b3]) = (a.0, b.0);
        Self([
            if mask[0] { a0 } else { b0 },
            if mask[1] { a1 } else { b1 },
            if mask[2] { a2 } else { b2 },
            if mask[3] { a3 } else { b3 },
        ])
    }
}
