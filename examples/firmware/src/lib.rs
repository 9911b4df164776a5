//! What every image shares: start, exit, text, counters, stack.
//!
//! An image is
//! ```ignore
//! #![no_std]
//! #![no_main]
//! epipole_firmware::entry!(main);
//! fn main() -> i32 { 0 } // the exit code of `cargo run`
//! ```
#![no_std]

pub mod count;
pub mod stack;
pub mod worst_case;

use defmt_semihosting as _;
pub use semihosting::{print, println};

/// The board that the image is linked for, and its target.
pub const BOARD: &str = env!("BOARD_NAME");
/// The compiler's name of the core.
pub const TARGET: &str = env!("TARGET_NAME");

/// Names the function that runs after start-up; what it returns is the exit code.
#[macro_export]
macro_rules! entry {
    ($main:path) => {
        #[unsafe(export_name = "main")]
        extern "C" fn start() -> ! {
            let main: fn() -> i32 = $main;
            $crate::exit(main())
        }
    };
}

/// Ends the image: QEMU, or the debugger of a board, gets the code.
pub fn exit(code: i32) -> ! {
    semihosting::process::exit(code)
}

/// A fault ends the image with a code of its own, rather than in an endless loop.
pub const FAULT: i32 = 3;

#[cfg(target_arch = "arm")]
#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    exit(FAULT)
}

#[cfg(target_arch = "riscv32")]
use riscv_rt as _;

#[cfg(target_arch = "riscv32")]
#[unsafe(export_name = "ExceptionHandler")]
extern "C" fn fault() -> ! {
    exit(FAULT)
}
