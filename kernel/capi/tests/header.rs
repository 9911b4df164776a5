//! `include/epipole.h` is what cbindgen makes of the source. `EPIPOLE_WRITE_HEADER=1 cargo test -p epipole-capi --test
//! header` writes it.
//!
//! The files of `api` are written once for `Scalar`, and their exported names come from a macro; cbindgen, which reads
//! source and no macros, is given the text that the compiler sees for each scalar.

use std::fmt::Write as _;
use std::path::Path;

const SCALARS: [&str; 2] = ["f32", "f64"];

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The text of a file of `api` for one scalar.
fn for_scalar(text: &str, scalar: &str) -> String {
    let mut out = String::new();
    let mut name = None;
    for line in text.lines() {
        if let Some(rest) = line.strip_prefix("#[unsafe(export_name = name!(\"") {
            name = rest.strip_suffix("\"))]").map(|name| format!("epi_{name}_{scalar}"));
            assert!(name.is_some(), "not understood: {line}");
            out.push_str("#[unsafe(no_mangle)]\n");
            continue;
        }
        // The function's own name becomes the exported one.
        match (&name, line.split_once(" extern \"C\" fn ")) {
            (Some(exported), Some((before, after))) => {
                let (_, arguments) = after.split_once('(').expect("a function");
                let arguments = arguments.replace("Scalar", scalar);
                writeln!(out, "{before} extern \"C\" fn {exported}({arguments}").unwrap();
                name = None;
            }
            _ => writeln!(out, "{}", line.replace("Scalar", scalar)).unwrap(),
        }
    }
    out
}

/// `RelativePoseOptions` as `relative_pose_options`.
fn snake(name: &str) -> String {
    let mut out = String::new();
    for (k, c) in name.chars().enumerate() {
        if c.is_ascii_uppercase() && k > 0 {
            out.push('_');
        }
        out.push(c.to_ascii_lowercase());
    }
    out
}

/// Names of public items that a line starts with, such as `pub struct `.
fn declared(text: &str, keyword: &str) -> Vec<String> {
    let name = |rest: &str| rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    text.lines().filter_map(|line| line.strip_prefix(keyword)).map(name).collect()
}

fn header(root: &Path) -> String {
    let source = root.join("src");
    let plain = [
        "status.rs",
        "limits.rs",
        "workspace.rs",
        "enums.rs",
        "types.rs",
        "options.rs",
        "estimates.rs",
        "window.rs",
    ]
    .map(|file| read(&source.join(file)));
    let mut text = plain.concat().replace("#[unsafe(export_name = \"epi_", "#[unsafe(no_mangle)] // ");
    // Functions without a scalar.
    for name in ["abi_version", "status_string", "workspace_align"] {
        text = text.replace(&format!("fn {name}("), &format!("fn epi_{name}("));
    }
    let lib = read(&source.join("lib.rs"));
    let (_, modules) = lib.split_once("pub mod f32 {").expect("the module of f32");
    let (modules, _) = modules.split_once("\n}").expect("its end");
    let modules = declared(&modules.replace("\n    ", "\n"), "pub mod ");
    assert!(modules.len() > 2);
    for scalar in SCALARS {
        for module in &modules {
            text += &for_scalar(&read(&source.join("api").join(format!("{module}.rs"))), scalar);
        }
    }

    // The documentation of a file has no place behind its items.
    let text = text
        .lines()
        .filter(|line| !line.starts_with("//!"))
        .fold(String::new(), |out, line| out + line + "\n");

    let mut config = cbindgen::Config::from_root_or_default(root);
    let (structs, enums) = (declared(&text, "pub struct "), declared(&text, "pub enum "));
    for name in &structs {
        for scalar in SCALARS {
            let exported = format!("epi_{}_{scalar}", snake(name));
            config.export.rename.insert(format!("{name}_{scalar}"), exported);
        }
        config.export.rename.insert(name.clone(), format!("epi_{}", snake(name)));
    }
    for name in enums.iter().chain(&declared(&text, "pub type ")) {
        config.export.rename.insert(name.clone(), format!("epi_{}", snake(name)));
        config.export.include.push(name.clone());
    }
    for name in declared(&text, "pub const ") {
        config.export.rename.insert(name.clone(), format!("EPI_{name}"));
        config.export.include.push(name);
    }
    config.after_includes = Some(read(&root.join("include/macros.h.in")));

    let file = std::env::temp_dir().join(format!("epipole-capi-{}.rs", std::process::id()));
    std::fs::write(&file, &text).unwrap();
    let bindings = cbindgen::Builder::new().with_config(config).with_src(&file).generate();
    let _ = std::fs::remove_file(&file);
    let mut out = Vec::new();
    bindings.expect("cbindgen reads the source").write(&mut out);
    // What a Rust reader is told of the contract stands in the conventions for a reader of C.
    String::from_utf8(out).unwrap().replace("//\n// # Safety\n// See the crate.\n", "")
}

#[test]
fn the_committed_header_is_that_of_the_source() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (made, committed) = (header(root), root.join("include/epipole.h"));
    if std::env::var_os("EPIPOLE_WRITE_HEADER").is_some() {
        std::fs::write(&committed, &made).unwrap();
    }
    let committed = read(&committed);
    for (number, (a, b)) in (1..).zip(made.lines().zip(committed.lines())) {
        assert_eq!(a, b, "epipole.h:{number} is not what the source says; EPIPOLE_WRITE_HEADER=1 writes it");
    }
    assert_eq!(made, committed);
}
