//! The correctly rounded square root for `no_std`, by the core's own instruction where the target surely has one
//! and by `libm` elsewhere.
//!
//! IEEE 754 fixes the result of a square root to the last bit, so every path returns the same value; only the time
//! differs (`libm::sqrtf` is about 64 integer instructions on a core whose `vsqrt.f32` is one). A NaN comes out as a
//! NaN whose payload is not defined. The instruction is used on x86-64 and x86 with SSE2, AArch64 with NEON,
//! Arm hard-float targets (`f32`; `f64` on Linux only, for a bare-metal core may be single-precision) and RISC-V with
//! F or D in the target's name.
#![no_std]
#![deny(missing_docs)]

/// The square root of `x`; NaN for a negative `x`, -0 for -0.
#[inline(always)]
#[must_use]
pub fn sqrt_f32(x: f32) -> f32 {
    #[cfg(any(target_arch = "x86_64", all(target_arch = "x86", target_feature = "sse2")))]
    {
        #[cfg(target_arch = "x86")]
        use core::arch::x86::{_mm_cvtss_f32, _mm_set_ss, _mm_sqrt_ss};
        #[cfg(target_arch = "x86_64")]
        use core::arch::x86_64::{_mm_cvtss_f32, _mm_set_ss, _mm_sqrt_ss};
        // SAFETY: SSE is part of the target, as the cfg above says.
        #[allow(unused_unsafe)]
        unsafe {
            _mm_cvtss_f32(_mm_sqrt_ss(_mm_set_ss(x)))
        }
    }
    #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
    {
        let y: f32;
        // SAFETY: one register in, one out, no memory, no flags.
        unsafe {
            core::arch::asm!("fsqrt {0:s}, {1:s}", out(vreg) y, in(vreg) x, options(pure, nomem, nostack))
        };
        y
    }
    #[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
    {
        let y: u32;
        // A stable compiler takes `sreg` operands on cores with a double-precision unit only, so the value passes
        // through core registers.
        // SAFETY: a hard-float target has this instruction; one register in, one out, s0 declared as overwritten.
        unsafe {
            core::arch::asm!(
                "vmov s0, {x}", "vsqrt.f32 s0, s0", "vmov {y}, s0",
                x = in(reg) x.to_bits(), y = lateout(reg) y, out("s0") _, options(pure, nomem, nostack)
            );
        }
        f32::from_bits(y)
    }
    #[cfg(riscv_f)]
    {
        let y: f32;
        // SAFETY: the target's name has F; one register in, one out.
        unsafe {
            core::arch::asm!("fsqrt.s {0}, {1}", out(freg) y, in(freg) x, options(pure, nomem, nostack))
        };
        y
    }
    #[cfg(not(any(
        target_arch = "x86_64",
        all(target_arch = "x86", target_feature = "sse2"),
        all(target_arch = "aarch64", target_feature = "neon"),
        all(target_arch = "arm", target_abi = "eabihf"),
        riscv_f
    )))]
    libm::sqrtf(x)
}

/// The square root of `x`; NaN for a negative `x`, -0 for -0.
#[inline(always)]
#[must_use]
pub fn sqrt_f64(x: f64) -> f64 {
    #[cfg(any(target_arch = "x86_64", all(target_arch = "x86", target_feature = "sse2")))]
    {
        #[cfg(target_arch = "x86")]
        use core::arch::x86::{_mm_cvtsd_f64, _mm_set_sd, _mm_sqrt_sd};
        #[cfg(target_arch = "x86_64")]
        use core::arch::x86_64::{_mm_cvtsd_f64, _mm_set_sd, _mm_sqrt_sd};
        // SAFETY: SSE2 is part of the target, as the cfg above says.
        #[allow(unused_unsafe)]
        unsafe {
            let v = _mm_set_sd(x);
            _mm_cvtsd_f64(_mm_sqrt_sd(v, v))
        }
    }
    #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
    {
        let y: f64;
        // SAFETY: one register in, one out, no memory, no flags.
        unsafe {
            core::arch::asm!("fsqrt {0:d}, {1:d}", out(vreg) y, in(vreg) x, options(pure, nomem, nostack))
        };
        y
    }
    #[cfg(all(target_arch = "arm", target_abi = "eabihf", target_os = "linux"))]
    {
        let y: f64;
        // SAFETY: every Linux hard-float target has the double-precision unit; one register in, one out.
        unsafe {
            core::arch::asm!("vsqrt.f64 {0}, {1}", out(dreg) y, in(dreg) x, options(pure, nomem, nostack))
        };
        y
    }
    #[cfg(riscv_d)]
    {
        let y: f64;
        // SAFETY: the target's name has D; one register in, one out.
        unsafe {
            core::arch::asm!("fsqrt.d {0}, {1}", out(freg) y, in(freg) x, options(pure, nomem, nostack))
        };
        y
    }
    #[cfg(not(any(
        target_arch = "x86_64",
        all(target_arch = "x86", target_feature = "sse2"),
        all(target_arch = "aarch64", target_feature = "neon"),
        all(target_arch = "arm", target_abi = "eabihf", target_os = "linux"),
        riscv_d
    )))]
    libm::sqrt(x)
}

#[cfg(test)]
mod tests {
    use super::{sqrt_f32, sqrt_f64};

    #[test]
    fn equals_libm_bit_by_bit() {
        let mut s = 1u64;
        for _ in 0..100_000 {
            s = s.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let (x, y) = (f32::from_bits((s >> 33) as u32), f64::from_bits(s >> 1));
            if !x.is_nan() {
                assert_eq!(sqrt_f32(x).to_bits(), libm::sqrtf(x).to_bits(), "{x:e}");
            }
            if !y.is_nan() {
                assert_eq!(sqrt_f64(y).to_bits(), libm::sqrt(y).to_bits(), "{y:e}");
            }
        }
    }

    #[test]
    fn edges() {
        assert!(sqrt_f32(-1.0).is_nan() && sqrt_f64(-1.0).is_nan());
        assert!(sqrt_f32(f32::NAN).is_nan() && sqrt_f64(f64::NAN).is_nan());
        assert_eq!(sqrt_f32(-0.0).to_bits(), (-0.0f32).to_bits());
        assert_eq!(sqrt_f64(f64::INFINITY), f64::INFINITY);
    }
}
