//! A Rust library that can panic, has its own panic handler, and shares an image with the C interface of epipole.
#![no_std]

// Its functions are exported by being linked.
pub extern crate epipole_capi;

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

/// The sum of `count` numbers.
///
/// # Safety
/// `numbers` points to as many.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn other_sum(numbers: *const i32, count: u32) -> i32 {
    // SAFETY: the caller's promise.
    let numbers = unsafe { core::slice::from_raw_parts(numbers, count as usize) };
    // Panics on overflow, so that the handler is needed.
    numbers.iter().try_fold(0i32, |sum, &x| sum.checked_add(x)).unwrap()
}
