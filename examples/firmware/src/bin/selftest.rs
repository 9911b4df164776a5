//! The golden problems of every public capability on this core, compared bit by bit with the host's committed hashes.
//! The exit code is 0 where all are equal; otherwise the capability is named and the code is 1.
//!
//! A core with little memory is asked the solvers and the geometry in `f32` alone.
#![no_std]
#![no_main]

use epipole_firmware::{BOARD, TARGET, entry, println};
use epipole_problems::golden::{self, Answer, VERSIONS};

entry!(main);

fn main() -> i32 {
    let (mut right, mut wrong, mut all) = (0u32, 0u32, 0xCBF2_9CE4_8422_2325u64);
    let mut take = |answer: Answer| {
        all = (all ^ answer.hash).wrapping_mul(0x0100_0000_01B3);
        println!("{} {} {} {:016x}", answer.kind, answer.name, answer.scalar, answer.hash);
        if answer.is_right() {
            right += 1;
        } else {
            wrong += 1;
            println!("WRONG: {} {} {}", answer.kind, answer.name, answer.scalar);
        }
    };
    #[cfg(small_ram)]
    golden::run_small(&mut take);
    #[cfg(not(small_ram))]
    {
        golden::run(&mut take);
        golden::run_any_bits(&mut take);
    }
    println!("{BOARD} {TARGET}, {VERSIONS}: {right} right, {wrong} wrong, all together {all:016x}");
    i32::from(wrong > 0 || right == 0)
}
