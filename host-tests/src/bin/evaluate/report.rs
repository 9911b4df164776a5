//! The table a scene, the pooled line and the CSV file.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::file::Problem;
use crate::score::{Outcome, auc_percent, median, share_above};

/// How a problem's errors are named and judged.
pub(crate) struct Scale {
    pub(crate) unit: &'static str,
    /// Thresholds of the areas under the curve.
    pub(crate) thresholds: [f64; 3],
    /// Above it a file counts as a failure.
    pub(crate) fail: f64,
    /// Names of the medians.
    pub(crate) medians: &'static [&'static str],
}

pub(crate) fn scale(problem: Problem) -> Scale {
    match problem {
        Problem::Homography => {
            Scale { unit: "px", thresholds: [3.0, 5.0, 10.0], fail: 10.0, medians: &["median_px"] }
        }
        Problem::AbsolutePose => Scale {
            unit: "deg or percent",
            thresholds: [0.5, 1.0, 5.0],
            fail: 5.0,
            medians: &["median_r_deg", "median_position_percent"],
        },
        Problem::RelativePose | Problem::Fundamental => Scale {
            unit: "deg",
            thresholds: [5.0, 10.0, 20.0],
            fail: 5.0,
            medians: &["median_r_deg", "median_t_deg"],
        },
    }
}

/// The scene of a file: its folder, and its detector where the name ends in `_NAME`.
pub(crate) fn scene(path: &Path) -> String {
    let folder = path.parent().and_then(Path::file_name).map(|f| f.to_string_lossy().into_owned());
    let stem = path.file_stem().map(|f| f.to_string_lossy().into_owned()).unwrap_or_default();
    let folder = folder.filter(|f| !f.is_empty()).unwrap_or_else(|| ".".into());
    match stem.rsplit_once('_') {
        Some((_, detector)) if detector.chars().all(char::is_alphabetic) => format!("{folder} {detector}"),
        _ => folder,
    }
}

struct Summary {
    files: usize,
    aucs: [f64; 3],
    medians: Vec<f64>,
    fail: f64,
    milliseconds: f64,
}

fn summarise(problem: Problem, outcomes: &[&Outcome]) -> Summary {
    let scale = scale(problem);
    let worst: Vec<f64> = outcomes.iter().map(|o| o.worst()).collect();
    Summary {
        files: outcomes.len(),
        aucs: scale.thresholds.map(|t| auc_percent(&worst, t)),
        medians: (0..scale.medians.len()).map(|k| median(outcomes.iter().map(|o| o.errors[k]))).collect(),
        fail: share_above(&worst, scale.fail),
        milliseconds: median(outcomes.iter().map(|o| o.milliseconds)),
    }
}

/// Prints a line a scene and the pooled line, whose keys are stable.
pub(crate) fn print(problem: Problem, outcomes: &[(PathBuf, Outcome)]) {
    let scale = scale(problem);
    let mut scenes = BTreeMap::<String, Vec<&Outcome>>::new();
    for (path, outcome) in outcomes {
        scenes.entry(scene(path)).or_default().push(outcome);
    }
    let width = scenes.keys().map(String::len).max().unwrap_or(0).max("scene".len());
    print!("{:width$}  files", "scene");
    for t in scale.thresholds {
        print!("  {:>7}", format!("auc@{t}"));
    }
    for name in scale.medians {
        print!("  {name:>12}");
    }
    println!("  {:>6}  {:>9}", "fail", "ms_median");
    for (name, members) in &scenes {
        let s = summarise(problem, members);
        print!("{name:width$}  {:>5}", s.files);
        s.aucs.iter().for_each(|a| print!("  {a:>7.2}"));
        s.medians.iter().for_each(|m| print!("  {m:>12.4}"));
        println!("  {:>6.3}  {:>9.3}", s.fail, s.milliseconds);
    }
    let s = summarise(problem, &outcomes.iter().map(|(_, o)| o).collect::<Vec<_>>());
    let mut line = format!("pooled files={}", s.files);
    for (t, auc) in scale.thresholds.iter().zip(s.aucs) {
        let _ = write!(line, " auc{t}={auc:.2}");
    }
    for (name, value) in scale.medians.iter().zip(s.medians) {
        let _ = write!(line, " {name}={value:.4}");
    }
    println!("{line} fail={:.4} ms_median={:.3}", s.fail, s.milliseconds);
}

/// What runs with a time budget reached.
pub(crate) struct Timed {
    /// The budget asked, ms.
    pub(crate) budget: f64,
    /// The mean time taken, ms.
    pub(crate) milliseconds: f64,
    pub(crate) aucs: [f64; 3],
}

impl Timed {
    pub(crate) fn new(problem: Problem, budget: f64, outcomes: &[Outcome]) -> Self {
        let worst: Vec<f64> = outcomes.iter().map(Outcome::worst).collect();
        let milliseconds = outcomes.iter().map(|o| o.milliseconds).sum::<f64>() / outcomes.len() as f64;
        Self { budget, milliseconds, aucs: scale(problem).thresholds.map(|t| auc_percent(&worst, t)) }
    }

    pub(crate) fn print(&self, problem: Problem) {
        print!("budget_ms={} ms_mean={:.3}", self.budget, self.milliseconds);
        for (t, auc) in scale(problem).thresholds.iter().zip(self.aucs) {
            print!(" auc{t}={auc:.2}");
        }
        println!();
    }
}

/// One line a file.
pub(crate) fn write_csv(path: &Path, problem: Problem, outcomes: &[(PathBuf, Outcome)]) -> io::Result<()> {
    let errors = match problem {
        Problem::Homography => "error_px",
        Problem::AbsolutePose => "r_deg,position_percent",
        _ => "r_deg,t_deg",
    };
    let mut out = format!("file,{errors},correspondences,inliers,iterations,ms,doubt,refusal\n");
    for (file, o) in outcomes {
        let errors: Vec<String> =
            o.errors.iter().take(scale(problem).medians.len()).map(|e| format!("{e:.6}")).collect();
        let _ = writeln!(
            out,
            "{},{},{},{},{},{:.4},{:.3e},{}",
            quoted(&file.to_string_lossy()),
            errors.join(","),
            o.correspondences,
            o.inliers,
            o.iterations,
            o.milliseconds,
            o.doubt,
            quoted(&o.refusal)
        );
    }
    fs::write(path, out)
}

/// A field of a CSV file, in quotes where it needs them (RFC 4180).
fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.into()
    }
}
