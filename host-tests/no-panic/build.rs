//! The C functions, from the header: all of them are roots of the image.

use std::fmt::Write;
use std::{env, fs};

fn main() {
    let header = "../../kernel/capi/include/epipole.h";
    println!("cargo:rerun-if-changed={header}");
    let text = fs::read_to_string(header).expect("the header");
    // Prototypes stand outside comments, and no macro of the header calls a function.
    let mut names: Vec<&str> = text
        .split_inclusive('(')
        .filter_map(|piece| {
            let name =
                piece.strip_suffix('(')?.rsplit(|c: char| !c.is_ascii_alphanumeric() && c != '_').next()?;
            let line = piece.rsplit('\n').next()?;
            (name.starts_with("epi_") && !line.starts_with([' ', '*', '/', '#'])).then_some(name)
        })
        .collect();
    names.sort_unstable();
    names.dedup();
    assert!(names.len() > 20, "the header's functions");
    let mut code = String::from("unsafe extern \"C\" {\n");
    for name in &names {
        writeln!(code, "    fn {name}();").unwrap();
    }
    writeln!(code, "}}\nstatic C_FUNCTIONS: [unsafe extern \"C\" fn(); {}] = [", names.len()).unwrap();
    for name in &names {
        writeln!(code, "    {name},").unwrap();
    }
    code.push_str("];\n");
    fs::write(format!("{}/c_functions.rs", env::var("OUT_DIR").unwrap()), code).unwrap();
}
