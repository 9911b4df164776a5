//! Links only if no public function of `epipole`, and no function of its C interface, has a panic path left after optimisation, in either scalar: the panic
//! handler calls a function that exists nowhere. It has no allocator either, so nothing in it allocates.
#![no_std]
#![no_main]

use core::hint::black_box;
use core::panic::PanicInfo;

#[cfg(not(feature = "negative"))]
use epipole_capi as _;
#[cfg(not(feature = "negative"))]
use epipole_exercise::{CAPABILITIES, Sink, Source};

unsafe extern "C" {
    /// Defined nowhere.
    fn a_panic_path_is_left() -> !;
}

#[cfg(not(feature = "negative"))]
include!(concat!(env!("OUT_DIR"), "/c_functions.rs"));

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    // SAFETY: an image with this call does not link, so it never runs.
    unsafe { a_panic_path_is_left() }
}

/// The entry point of the image: every capability in both scalars, and every C function as a root.
#[cfg(not(feature = "negative"))]
#[unsafe(no_mangle)]
pub extern "C" fn _start() -> u64 {
    let mut sink = Sink::default();
    black_box(&C_FUNCTIONS);
    let mut source = Source::seeded(black_box(1));
    // Through a pointer that the compiler cannot see through, so that all of the table stays.
    for capability in black_box(CAPABILITIES) {
        (capability.f32)(&mut source, &mut sink);
        (capability.f64)(&mut source, &mut sink);
    }
    sink.hash()
}

/// One call that can panic, a bounds check: must not link.
#[cfg(feature = "negative")]
#[unsafe(no_mangle)]
pub extern "C" fn _start() -> u64 {
    let table = [1u64, 2, 3];
    table[black_box(2)]
}
