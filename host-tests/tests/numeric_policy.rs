//! What kernel/DESIGN.md's numeric policy forbids does not stand in the kernel: functions whose bits or speed depend on
//! the target or on features, and calls that leave a panic in the binary.

use epipole_host_tests::source::{SourceFile, Token, flatten, kernel_source, read_folder};

/// Methods of nalgebra and of its `RealField` for which `crate::real` or `crate::linalg` has the right function.
const FORBIDDEN_METHODS: &[&str] = &[
    // Elementary functions: `real::*`.
    "sqrt",
    "try_sqrt",
    "abs",
    "max",
    "min",
    "clamp",
    "powi",
    "powf",
    "powc",
    "hypot",
    "cbrt",
    "recip",
    "mul_add",
    "exp",
    "exp2",
    "exp_m1",
    "ln",
    "ln_1p",
    "log",
    "log2",
    "log10",
    "sin",
    "cos",
    "tan",
    "sin_cos",
    "asin",
    "acos",
    "atan",
    "atan2",
    "sinh",
    "cosh",
    "tanh",
    "asinh",
    "acosh",
    "atanh",
    "floor",
    "ceil",
    "round",
    "trunc",
    "fract",
    "signum",
    "copysign",
    "modulus",
    "argument",
    "is_sign_negative",
    // Norms: `norm_squared` and `real::sqrt`.
    "norm",
    "magnitude",
    "normalize",
    "normalize_mut",
    "try_normalize",
    "try_normalize_mut",
    "cap_magnitude",
    "metric_distance",
    "renormalize",
    "new_normalize",
    "new_and_get",
    "try_new_and_get",
    // Rotations by trigonometric functions: `geometry::pose`.
    "from_axis_angle",
    "from_scaled_axis",
    "from_euler_angles",
    "from_rotation_matrix",
    "from_matrix",
    "scaled_axis",
    "axis_angle",
    "angle",
    "angle_to",
    "rotation_to",
    "rotation_between",
    "euler_angles",
    "slerp",
    "try_slerp",
    "nlerp",
    // Decompositions that panic, or loop without a bound: `linalg`.
    "svd",
    "svd_unordered",
    "symmetric_eigen",
    "symmetric_eigenvalues",
    "lu",
    "full_piv_lu",
    "schur",
    "hessenberg",
    "eigenvalues",
    "complex_eigenvalues",
    "bidiagonalize",
    "col_piv_qr",
    "pseudo_inverse",
    "singular_values",
    "solve_mut",
    "udu",
    "lblt",
    // Panics.
    "unwrap",
    "expect",
    "unwrap_err",
    "expect_err",
];

/// Integers and `core::cmp` have exact functions of these names, `linalg` and `geometry::pose` bounded ones, `real::single` its
/// own.
const EXACT_OWNERS: &[&str] = &[
    "linalg", "pose", "real", "single", "libm", "cmp", "u8", "u16", "u32", "u64", "u128", "usize", "i8",
    "i16", "i32", "i64", "i128", "isize", "Ord",
];

const FORBIDDEN_MACROS: &[&str] =
    &["panic", "unreachable", "todo", "unimplemented", "vec", "format", "println"];

/// Crates and keywords that belong elsewhere.
const FORBIDDEN_WORDS: &[&str] =
    &["unsafe", "std", "alloc", "Dyn", "DMatrix", "DVector", "OMatrix", "static"];

fn violations(file: &SourceFile) -> Vec<String> {
    let tokens = flatten(file);
    let text = |k: usize| tokens.get(k).map_or("", |token: &Token| token.text.as_str());
    let mut wrong = Vec::new();
    for (k, token) in tokens.iter().enumerate() {
        let name = token.text.as_str();
        let before = k.checked_sub(1).map_or("", &text);
        let after_path = before == ":" && k >= 3 && text(k - 2) == ":";
        let owner = if after_path { text(k - 3) } else { "" };
        let is_called =
            text(k + 1) == "(" || (text(k + 1) == ":" && text(k + 2) == ":" && text(k + 3) == "<");
        let method = before == "." && is_called;
        // `core`'s functions of a sign bit: no arithmetic, and `real` is what gives them to the rest of the kernel.
        let sign_bit = file.name == "real.rs" && owner == "t" && ["abs", "copysign"].contains(&name);
        let function = after_path && !EXACT_OWNERS.contains(&owner) && !sign_bit;
        let reason = if FORBIDDEN_METHODS.contains(&name) && (method || function) {
            "`real`, `linalg` or `geometry::pose` has the function to use"
        } else if FORBIDDEN_MACROS.contains(&name) && text(k + 1) == "!" {
            "the kernel neither panics nor allocates"
        } else if FORBIDDEN_WORDS.contains(&name) && before != "'" {
            "not in the kernel"
        } else if (name == "libm" || name == "epipole_sqrt") && file.name != "real.rs" {
            "only real.rs calls it"
        } else {
            continue;
        };
        wrong.push(format!("kernel/src/{}:{}: `{name}`: {reason}", file.name, token.line));
    }
    wrong
}

#[test]
fn the_kernel_obeys_the_numeric_policy() {
    let wrong: Vec<String> = read_folder(&kernel_source()).iter().flat_map(violations).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The scan bites.
#[test]
fn offences_are_found_and_lookalikes_are_not() {
    let offences = [
        "fn f<T: Real>(x: T) -> T { x.sqrt() }",
        "fn f<T: Real>(x: T) -> T { x\n    . /* root */ sqrt ( ) }",
        "fn f<T: Real>(x: T) -> T { T::sqrt(x) }",
        "fn f<T: Real>(x: T) -> T { ComplexField::sqrt(x) }",
        "fn f<T: Real>(x: T) -> T { <T as RealField>::max(x, x) }",
        "fn f<T: Real>(x: &[T]) -> T { x.iter().copied().map(T::abs).next() }",
        "fn f(x: f32) -> f32 { f32::max(x, 1.0) }",
        "fn f(v: Vector3<f32>) -> f32 { v.norm() }",
        "fn f(m: Matrix3<f32>) { m.svd(true, true); }",
        "fn f(x: Option<u8>) -> u8 { x.unwrap() }",
        "fn f() { panic!(\"no\") }",
        "fn f(x: f32) -> f32 { libm::sqrtf(x) }",
        "use libm::sqrtf;",
        "fn f() { unsafe { g() } }",
        "use std::vec::Vec;",
        "extern crate alloc;",
    ];
    for text in offences {
        assert!(!violations(&SourceFile::parse("linalg/lu.rs", text)).is_empty(), "{text}");
    }
    let lookalikes = [
        "use crate::real::{sqrt, max}; fn f<T: Real>(x: T) -> T { real::sqrt(sqrt(max(x, x))) }",
        "fn f(n: usize) -> usize { usize::min(n, 4).max_value() }",
        "fn f(n: usize) -> usize { core::cmp::min(n, 4) }",
        "/// x.sqrt() and std\nfn f() -> &'static str { \"x.sqrt() unwrap()\" } // x.sqrt()",
        "#[cfg(test)] mod tests { #[test] fn t() { assert!(2f64.sqrt() > 1.0); std::thread::yield_now(); } }",
        "fn f(s: Options) -> f32 { s.norm + s.max }",
    ];
    for text in lookalikes {
        assert_eq!(violations(&SourceFile::parse("linalg/lu.rs", text)), Vec::<String>::new(), "{text}");
    }
    assert_eq!(violations(&SourceFile::parse("real.rs", "use libm::sqrtf;")), Vec::<String>::new());
}
