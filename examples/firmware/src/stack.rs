//! High water of the stack: the free part is painted, the call is made, and what is no longer painted was used.

const PAINT: u32 = 0xE91B_01E5;
/// Left unpainted below the frame of [`high_water`], so that painting cannot reach it.
const OWN: usize = 32;

unsafe extern "C" {
    /// End of the static data, by the linker scripts of cortex-m-rt and riscv-rt.
    #[link_name = "__sheap"]
    static FLOOR: u32;
}

fn floor() -> usize {
    &raw const FLOOR as usize
}

/// The stack pointer, about.
#[inline(never)]
fn here() -> usize {
    let marker = 0u8;
    core::hint::black_box(&raw const marker as usize)
}

/// Bytes of stack that a call used, and its answer. Painting takes a moment for a large free RAM: `most` bytes are
/// painted at the most.
#[inline(never)]
pub fn high_water<R>(most: usize, call: impl FnOnce() -> R) -> (R, usize) {
    let top = (here() - OWN) & !3;
    let bottom = core::cmp::max(floor(), top.saturating_sub(most)).next_multiple_of(4);
    let mut at = bottom;
    while at < top {
        // SAFETY: between the end of the static data and the stack pointer nothing lives.
        unsafe { (at as *mut u32).write_volatile(PAINT) };
        at += 4;
    }
    // An interrupt's frame is none of the call's.
    let answer = critical_section::with(|_| outlined(call));
    let mut at = bottom;
    // SAFETY: as above.
    while at < top && unsafe { (at as *const u32).read_volatile() } == PAINT {
        at += 4;
    }
    (answer, top + OWN - at)
}

/// In a frame of its own, so that all of the call's frames lie in the painted part.
#[inline(never)]
fn outlined<R>(call: impl FnOnce() -> R) -> R {
    call()
}
