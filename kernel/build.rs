//! `cfg(small)` where the compiler is asked for small code: a few functions are then called where they are inlined for
//! speed; `cfg(scalar)` where the target has no vectors of floating-point numbers: four correspondences are then worked on
//! one after the other. No number changes.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(small)");
    if matches!(std::env::var("OPT_LEVEL").as_deref(), Ok("s" | "z")) {
        println!("cargo::rustc-cfg=small");
    }
    println!("cargo::rustc-check-cfg=cfg(scalar)");
    let features = std::env::var("CARGO_CFG_TARGET_FEATURE").unwrap_or_default();
    if !features
        .split(',')
        .any(|feature| matches!(feature, "sse" | "neon" | "simd128" | "v" | "altivec" | "vector"))
    {
        println!("cargo::rustc-cfg=scalar");
    }
}
