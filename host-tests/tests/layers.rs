//! Arrows between the kernel's folders point down only (kernel/DESIGN.md, "Layers").

use std::collections::HashMap;

use epipole_host_tests::source::{SourceFile, absolute_paths, flatten, kernel_source, read_folder};

/// Folders and files of the crate's root, each with what it may use beside itself.
const LAYERS: &[(&str, &[&str])] = &[
    ("real", &[]),
    ("error", &["real"]),
    ("solutions", &["real"]),
    ("input", &["real", "error"]),
    ("linalg", &["real", "error", "solutions"]),
    ("geometry", &["real", "error", "solutions", "linalg"]),
    ("solvers", &["real", "error", "input", "solutions", "linalg", "geometry"]),
    ("robust", &["real", "error", "solutions", "linalg", "geometry"]),
    ("refine", &["real", "error", "input", "solutions", "linalg", "geometry", "robust::loss"]),
    ("bundle", &["real", "error", "solutions", "linalg", "geometry", "robust::loss"]),
    (
        "estimate",
        &[
            "real",
            "error",
            "input",
            "solutions",
            "linalg",
            "geometry",
            "solvers",
            "robust",
            "refine",
            "bundle",
        ],
    ),
];

/// What is wrong with the paths of these files: one sentence an upward arrow.
fn violations(files: &[SourceFile]) -> Vec<String> {
    // The root re-exports names of its modules: `crate::Real` is `crate::real::Real`.
    let mut exports = HashMap::new();
    for file in files.iter().filter(|file| file.module.is_empty()) {
        let tokens = flatten(file);
        for (k, token) in tokens.iter().enumerate() {
            let is_export = token.text == "pub" && tokens.get(k + 1).is_some_and(|next| next.text == "use");
            let Some(origin) = tokens.get(k + 2).filter(|_| is_export) else { continue };
            for name in tokens[k + 3..].iter().take_while(|name| name.text != ";") {
                exports.insert(name.text.clone(), origin.text.clone());
            }
            exports.insert(origin.text.clone(), origin.text.clone());
        }
    }
    let mut wrong = Vec::new();
    for file in files {
        let Some(layer) = file.module.first() else { continue };
        let Some((_, allowed)) = LAYERS.iter().find(|(name, _)| name == layer) else {
            wrong.push(format!("{}: `{layer}` has no layer", file.name));
            continue;
        };
        for path in absolute_paths(&flatten(file)) {
            let mut segments = path.segments.clone();
            let is_module = LAYERS.iter().any(|(name, _)| *name == segments[0]);
            if let Some(origin) = exports.get(&segments[0]).filter(|_| !is_module) {
                if origin == "nalgebra" {
                    continue;
                }
                segments.insert(0, origin.clone());
            }
            let full = segments.join("::");
            let same_layer = segments[0] == *layer;
            let below = allowed.iter().any(|name| full == **name || full.starts_with(&format!("{name}::")));
            // A solver never uses another solver.
            let other_solver = layer == "solvers"
                && same_layer
                && segments.len() > 1
                && path.module.len() > 1
                && segments[1] != path.module[1];
            if !(same_layer || below) || other_solver {
                wrong.push(format!("{}:{}: `{layer}` may not use `{full}`", file.name, path.line));
            }
        }
    }
    wrong
}

#[test]
fn arrows_point_down() {
    let wrong = violations(&read_folder(&kernel_source()));
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The scan bites: every form of an upward path is found, the same form downward is not.
#[test]
fn upward_arrows_are_found_in_every_form() {
    let root = SourceFile::parse(
        "lib.rs",
        "pub mod real; pub use real::Real; pub use estimate::{relative_pose, Verdict};",
    );
    let upward = [
        ("linalg/lu.rs", "use crate::geometry::Pose;"),
        ("linalg/lu.rs", "use crate::{Real, geometry::Pose};"),
        ("linalg/lu.rs", "use crate::{Real, solvers::{self, relpose_5pt}};"),
        ("linalg/lu.rs", "use super::super::geometry as g;"),
        ("linalg/lu.rs", "use super::super::{real, robust::loss};"),
        ("linalg/lu.rs", "use self::super::super::geometry::Pose;"),
        ("linalg/mod.rs", "use super::geometry::Pose;"),
        ("linalg/lu.rs", "fn f() { let x = crate::geometry::pose::identity::<f32>(); }"),
        ("linalg/lu.rs", "fn f() { let x = crate :: /* far */ geometry\n::pose(); }"),
        ("linalg/lu.rs", "macro_rules! m { () => { $crate::geometry::Pose } }"),
        ("linalg/lu.rs", "use crate as epipole; "),
        ("linalg/lu.rs", "use crate::*;"),
        ("linalg/lu.rs", "use crate::Verdict;"),
        ("linalg/lu.rs", "mod inner { use super::super::super::geometry::Pose; }"),
        ("linalg/lu.rs", "pub use crate::estimate::relative_pose;"),
        ("robust/ransac.rs", "use crate::solvers::relpose_5pt;"),
        ("refine/homography.rs", "use crate::robust::ransac::run;"),
        ("solvers/relpose_5pt.rs", "use super::relpose_7pt::solve;"),
        ("solvers/relpose_5pt/roots.rs", "use crate::solvers::relpose_7pt;"),
        ("newcomer/file.rs", ""),
    ];
    for (name, text) in upward {
        let files = [SourceFile::parse("lib.rs", &root.tokens.to_string()), SourceFile::parse(name, text)];
        assert!(!violations(&files).is_empty(), "{name}: {text}");
    }
    let downward = [
        (
            "linalg/lu.rs",
            "use crate::{Real, real::sqrt}; use super::ldlt; pub(crate) fn f() {} pub(super) fn g() {}",
        ),
        (
            "linalg/lu.rs",
            "// use crate::geometry::Pose;\n/// See [`crate::geometry`].\nconst S: &str = \"crate::geometry\";",
        ),
        ("linalg/lu.rs", "#[cfg(test)] mod tests { use super::*; use crate::geometry::Pose; }"),
        ("refine/homography.rs", "use crate::robust::loss::Huber;"),
        ("solvers/relpose_5pt/mod.rs", "mod roots; use self::roots::find; use super::relpose_5pt::roots;"),
        ("solvers/relpose_5pt/roots.rs", "use super::matrix; use crate::geometry::Essential;"),
        (
            "estimate/relative_pose.rs",
            "use crate::{solvers::relpose_5pt, robust::ransac, refine::relative_pose as r};",
        ),
        ("geometry/pose.rs", "mod inner { use super::skew; } use crate::linalg;"),
    ];
    for (name, text) in downward {
        let files = [SourceFile::parse("lib.rs", &root.tokens.to_string()), SourceFile::parse(name, text)];
        assert_eq!(violations(&files), Vec::<String>::new(), "{name}: {text}");
    }
}
