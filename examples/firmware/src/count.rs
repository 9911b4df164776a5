//! How long a call takes: instructions in QEMU (`-icount shift=7`), cycles on a board.

use core::sync::atomic::{AtomicU32, Ordering};

/// What [`measure`] counts.
pub const UNIT: &str = if cfg!(any(qemu_arm, target_arch = "riscv32")) { "instructions" } else { "cycles" };

/// The answer of a call, and what it cost.
pub fn measure<R>(call: impl FnOnce() -> R) -> (R, u64) {
    let start = now();
    let answer = call();
    let end = now();
    (answer, cost(start, end).saturating_sub(u64::from(EMPTY.load(Ordering::Relaxed))))
}

/// What [`measure`] itself costs.
static EMPTY: AtomicU32 = AtomicU32::new(0);

/// Microseconds since the machine started, by its own clock; [`init`] comes first.
#[cfg(any(qemu_arm, uart = "ns16550"))]
pub fn micros() -> u64 {
    counter::micros()
}

#[cfg(target_arch = "riscv32")]
mod counter {
    /// QEMU's virt counts time at 10 MHz.
    #[cfg(uart = "ns16550")]
    pub(super) fn micros() -> u64 {
        riscv::register::time::read64() / 10
    }

    /// Instructions retired since reset.
    pub(super) fn now() -> u64 {
        riscv::register::minstret::read64()
    }

    pub(super) fn cost(start: u64, end: u64) -> u64 {
        end - start
    }

    pub(super) fn init() {}
}

#[cfg(all(target_arch = "arm", qemu_arm))]
mod counter {
    use core::sync::atomic::{AtomicU32, Ordering};
    use cortex_m::peripheral::{SYST, syst::SystClkSource};

    /// Ticks of SysTick before it starts again from the top.
    const PERIOD: u32 = 1 << 24;
    static WRAPS: AtomicU32 = AtomicU32::new(0);

    #[cortex_m_rt::exception]
    fn SysTick() {
        // An ARMv6-M core has no atomic read-modify-write; nothing else writes here.
        WRAPS.store(WRAPS.load(Ordering::Relaxed) + 1, Ordering::Relaxed);
    }

    /// Starts the counter.
    pub(super) fn init() {
        // SAFETY: the only user of SysTick in an image.
        let mut syst = unsafe { cortex_m::Peripherals::steal() }.SYST;
        syst.set_clock_source(SystClkSource::Core);
        syst.set_reload(PERIOD - 1);
        syst.clear_current();
        syst.enable_counter();
        syst.enable_interrupt();
    }

    /// Ticks since [`init`].
    pub(super) fn now() -> u64 {
        loop {
            let wraps = WRAPS.load(Ordering::Relaxed);
            let left = SYST::get_current();
            cortex_m::asm::isb();
            if wraps == WRAPS.load(Ordering::Relaxed) {
                return u64::from(wraps) * u64::from(PERIOD) + u64::from(PERIOD - 1 - left);
            }
        }
    }

    /// Every instruction takes 128 ns of QEMU's virtual time.
    pub(super) fn cost(start: u64, end: u64) -> u64 {
        const TENTHS_NS: u64 = tenths(env!("TICK_NS"));
        ((end - start) * TENTHS_NS + 640) / 1280
    }

    pub(super) fn micros() -> u64 {
        now() * tenths(env!("TICK_NS")) / 10_000
    }

    /// Tenths of a number like "62.5".
    const fn tenths(number: &str) -> u64 {
        let mut value = 0;
        let mut k = 0;
        while k < number.len() {
            let byte = number.as_bytes()[k];
            if byte != b'.' {
                value = 10 * value + (byte - b'0') as u64;
            }
            k += 1;
        }
        value
    }
}

#[cfg(all(target_arch = "arm", not(qemu_arm)))]
mod counter {
    use cortex_m::peripheral::DWT;

    /// Starts the counter of cycles.
    pub(super) fn init() {
        // SAFETY: nothing else in an image uses the trace unit.
        let mut peripherals = unsafe { cortex_m::Peripherals::steal() };
        peripherals.DCB.enable_trace();
        peripherals.DWT.enable_cycle_counter();
    }

    /// Cycles, modulo 2^32: 25 s at 168 MHz.
    pub(super) fn now() -> u64 {
        u64::from(DWT::cycle_count())
    }

    pub(super) fn cost(start: u64, end: u64) -> u64 {
        u64::from((end as u32).wrapping_sub(start as u32))
    }
}

use counter::{cost, now};

/// Starts the counter. Once, before the first [`measure`].
pub fn init() {
    counter::init();
    let empty = (0..8).map(|_| measure(|| ()).1).min().unwrap_or(0);
    EMPTY.store(empty as u32, Ordering::Relaxed);
}
