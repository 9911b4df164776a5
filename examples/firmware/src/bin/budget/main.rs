//! What the entry points cost on this core: instructions in QEMU, cycles on a board, and the stack.
//!
//! A line is `name | problems | mean | p99 | worst | solved % | without an answer | median error | stack`.
//! A board's lines are ready to paste into the table of `kernel/DESIGN.md`.
#![no_std]
#![no_main]

mod minimal;
mod robust;
mod row;
mod window;

use epipole_firmware::{BOARD, TARGET, count, entry, println};

entry!(main);

fn main() -> i32 {
    count::init();
    println!("board {BOARD} target {TARGET} unit {}", count::UNIT);
    println!("name | problems | mean | p99 | worst | solved % | none | median error | stack");
    minimal::run();
    robust::run();
    window::run();
    0
}
