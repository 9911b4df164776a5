//! Chooses the memory layout: `memory/BOARD.x`, by default that of the QEMU machine which runs the target.

use std::path::PathBuf;
use std::{env, fs};

fn main() {
    let target = env::var("TARGET").unwrap();
    let board = env::var("BOARD").unwrap_or_else(|_| default_board(&target).into());
    // The CMSDK machines with a Cortex-M3, M4 and M7 have one memory map.
    let layout = match &*board {
        "mps2-an385" | "mps2-an500" => "mps2-an386",
        other => other,
    };
    let out = PathBuf::from(env::var("OUT_DIR").unwrap());
    let source = format!("memory/{layout}.x");
    let script = fs::read(&source).unwrap_or_else(|_| panic!("BOARD={board}: there is no {source}"));
    fs::write(out.join("memory.x"), script).unwrap();
    fs::copy("memory/riscv-regions.x", out.join("riscv-regions.x")).unwrap();
    println!("cargo:rustc-link-search={}", out.display());
    if target.starts_with("riscv") {
        println!("cargo:rustc-link-arg-bins=-Tmemory.x");
    }
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
    println!("cargo:rustc-link-arg-bins=--nmagic");

    // Nanoseconds of a SysTick tick of the QEMU machines; a real board counts cycles instead.
    let tick_ns = match &*board {
        "mps2-an385" | "mps2-an386" | "mps2-an500" => Some("40.0"),
        "mps2-an505" => Some("50.0"),
        "microbit" => Some("62.5"),
        _ => None,
    };
    println!("cargo:rustc-check-cfg=cfg(qemu_arm, small_ram)");
    // The compiler does not tell of the F extension.
    println!("cargo:rustc-check-cfg=cfg(fpu, values(\"arm\", \"riscv\"))");
    match &*target {
        hard if hard.ends_with("eabihf") => println!("cargo:rustc-cfg=fpu=\"arm\""),
        "riscv32imafc-unknown-none-elf" => println!("cargo:rustc-cfg=fpu=\"riscv\""),
        _ => (),
    }
    println!("cargo:rustc-check-cfg=cfg(uart, values(\"cmsdk\", \"ns16550\"))");
    match layout {
        "mps2-an386" => println!("cargo:rustc-cfg=uart=\"cmsdk\""),
        "virt" => println!("cargo:rustc-cfg=uart=\"ns16550\""),
        _ => (),
    }
    if board == "microbit" {
        println!("cargo:rustc-cfg=small_ram");
    }
    if let Some(tick_ns) = tick_ns {
        println!("cargo:rustc-cfg=qemu_arm");
        println!("cargo:rustc-env=TICK_NS={tick_ns}");
    }
    println!("cargo:rustc-env=BOARD_NAME={board}");
    println!("cargo:rustc-env=TARGET_NAME={target}");
    println!("cargo:rerun-if-env-changed=BOARD");
    println!("cargo:rerun-if-changed=memory");
}

fn default_board(target: &str) -> &'static str {
    match target {
        "thumbv6m-none-eabi" => "microbit",
        "thumbv7m-none-eabi" => "mps2-an385",
        "thumbv7em-none-eabihf" => "mps2-an386",
        "thumbv8m.main-none-eabihf" => "mps2-an505",
        _ => "virt",
    }
}
