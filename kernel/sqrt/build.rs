//! Stable compilers hide unstable target features such as RISC-V's `f` from `cfg`; the target's name tells them.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(riscv_f, riscv_d)");
    let target = std::env::var("TARGET").unwrap_or_default();
    let isa = target.split('-').next().unwrap_or_default();
    if let Some(extensions) = isa.strip_prefix("riscv32").or_else(|| isa.strip_prefix("riscv64")) {
        let general = extensions.contains('g');
        let double = general || extensions.contains('d');
        if double || extensions.contains('f') {
            println!("cargo::rustc-cfg=riscv_f");
        }
        if double {
            println!("cargo::rustc-cfg=riscv_d");
        }
    }
}
