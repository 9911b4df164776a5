//! Tells the versions of nalgebra and libm that this build uses, from the lock file.

use std::path::{Path, PathBuf};
use std::{env, fs};

fn main() {
    let lock = lock_file();
    println!("cargo:rerun-if-changed={}", lock.display());
    let text = fs::read_to_string(&lock).unwrap_or_default();
    for (name, variable) in [("nalgebra", "NALGEBRA_VERSION"), ("libm", "LIBM_VERSION")] {
        let version = text
            .split("[[package]]")
            .find_map(|package| {
                let field = |key: &str| {
                    let line = package.lines().find_map(|line| line.strip_prefix(key))?;
                    line.strip_prefix(" = \"")?.strip_suffix('"')
                };
                (field("name") == Some(name)).then(|| field("version")).flatten()
            })
            .unwrap_or("unknown");
        println!("cargo:rustc-env={variable}={version}");
    }
}

/// The lock file of the workspace that is being built: beside the target folder, or above it.
fn lock_file() -> PathBuf {
    let out = PathBuf::from(env::var("OUT_DIR").unwrap());
    let own = Path::new(&env::var("CARGO_MANIFEST_DIR").unwrap()).join("../../Cargo.lock");
    out.ancestors().map(|folder| folder.join("Cargo.lock")).find(|lock| lock.exists()).unwrap_or(own)
}
