//! Judges epipole's robust estimators on correspondence files with ground truth, and its bundle adjustment on problem
//! files.
//!
//! `cargo run --release --bin evaluate -- relative-pose PATH...`, where a path is a file, or a folder that is searched
//! for `.txt` files. The format of the files is described in `file.rs` and by `--help`.

mod absolute;
mod bundle;
mod file;
mod plot;
mod report;
mod run;
mod score;

use std::error::Error;
use std::fs;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::{Parser, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};

use absolute::AbsoluteFile;
use file::{BrokenFile, CorrespondenceFile, Problem};
use report::Timed;
use run::Settings;
use score::Outcome;

const FORMAT: &str = "\
Format of a file, one item a line; lines that start with `#` are skipped, but `# size W H` gives the size of image 1:
  K1 fx fy cx cy        relative-pose and fundamental: intrinsics in pixels, no distortion
  K2 fx fy cx cy
  R_gt r11 r12 .. r33   the true pose, row-major: x2 ~ K2 (R_gt X1 + t_gt); only the direction of t_gt counts
  t_gt tx ty tz
  H_gt h11 h12 .. h33   homography instead of the four above: x2 ~ H_gt x1
  n N                   then N lines:
  x1 y1 x2 y2 score     pixels, the centre of the top-left pixel being (0, 0); a lower score is better, and it may be
                        left out
For absolute-pose: K fx fy cx cy, R_gt and t_gt (x ~ K (R_gt X + t_gt)), n N, then lines X Y Z u v score.
The correspondences are shuffled before they are used.
For bundle, a problem with its start, one of
  P L M huber           then P poses (R row-major, t), L points, M observations `pose point x y` on the plane z = 1,
                        the true poses and points; the focal length is 718, the first two poses are exact
  ncam npt nobs         then cameras `fx fy cx cy R_true t_true R t`, points, observations `camera point u v flag`
  ncam npt nobs         then of Bundle Adjustment in the Large: observations, cameras `w t f k1 k2`, points
All of it is adjusted with the first two frames fixed, Huber's loss at --threshold [default: 2] and at most
--max-iterations [default: 50]; --plot draws the cost by iteration; the other options do not apply.

Errors: relative-pose and fundamental (by its essential matrix), rotation and direction of translation in degrees, by
the chord; homography, the mean distance in pixels over the part of image 1 that the truth sends into image 2;
absolute-pose, the position in percent of the distance from the middle of the points. A file
fails above 5 degrees or 10 pixels; a refusal is a failure.

Exit code: 0; 1 if nothing could be evaluated; 2 for a wrong command line; 3 if some file was broken and skipped.";

#[derive(Parser)]
#[command(name = "evaluate", version, about = "Judge the robust estimators and bundle adjustment on files", after_help = FORMAT)]
struct Arguments {
    /// What to estimate.
    task: Task,
    /// Files, or folders searched for .txt files.
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,
    /// Scalar of the estimation.
    #[arg(long, default_value = "f64")]
    scalar: Scalar,
    /// Use only the best N correspondences by score.
    #[arg(long, value_name = "N")]
    max_corr: Option<usize>,
    /// Largest error of an inlier in pixels [default: 3 for homographies; else 1, or 2 for images wider than 2000]
    #[arg(long, value_name = "PX", allow_negative_numbers = true)]
    threshold: Option<f64>,
    /// Probability that a sample of inliers only is drawn [default: the estimator's].
    #[arg(long, value_name = "P", allow_negative_numbers = true)]
    confidence: Option<f64>,
    /// Most samples drawn [default: the estimator's].
    #[arg(long, value_name = "N")]
    max_iterations: Option<u32>,
    /// Seed of the shuffling and of the estimator.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Write one line a file.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Draw the cumulative error curves, or the falling costs of bundle adjustment (SVG).
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// Draw the share of failures among the answers that the estimate trusts most (SVG).
    #[arg(long, value_name = "FILE")]
    plot_risk: Option<PathBuf>,
    /// Run all again with time budgets of 0.1 to 20 ms, and draw the areas under the curve by the time (SVG).
    #[arg(long, value_name = "FILE")]
    plot_time: Option<PathBuf>,
    /// Milliseconds after which no sample is drawn any more.
    #[arg(long, value_name = "MS", value_parser = milliseconds)]
    time_budget: Option<Duration>,
}

/// What can be judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Task {
    RelativePose,
    Homography,
    Fundamental,
    AbsolutePose,
    Bundle,
}

impl Task {
    /// The estimation; none for bundle adjustment.
    fn problem(self) -> Option<Problem> {
        match self {
            Self::RelativePose => Some(Problem::RelativePose),
            Self::Homography => Some(Problem::Homography),
            Self::Fundamental => Some(Problem::Fundamental),
            Self::AbsolutePose => Some(Problem::AbsolutePose),
            Self::Bundle => None,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Scalar {
    F32,
    F64,
}

fn milliseconds(text: &str) -> Result<Duration, String> {
    let number = text.parse::<f64>().map_err(|e| e.to_string())?;
    Duration::try_from_secs_f64(1e-3 * number).map_err(|e| e.to_string())
}

/// Time budgets of the curve, milliseconds.
const BUDGETS: [f64; 8] = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0];

/// A file as read.
enum Input {
    TwoViews(CorrespondenceFile),
    Absolute(AbsoluteFile),
}

impl Input {
    fn read(path: &Path, problem: Problem) -> Result<Self, BrokenFile> {
        match problem {
            Problem::AbsolutePose => absolute::read(path).map(Self::Absolute),
            _ => file::read(path, problem).map(Self::TwoViews),
        }
    }

    fn run(&self, problem: Problem, scalar: Scalar, settings: &Settings) -> Outcome {
        match (self, scalar) {
            (Self::TwoViews(file), Scalar::F32) => run::run::<f32>(problem, file, settings),
            (Self::TwoViews(file), Scalar::F64) => run::run::<f64>(problem, file, settings),
            (Self::Absolute(file), Scalar::F32) => absolute::run::<f32>(file, settings),
            (Self::Absolute(file), Scalar::F64) => absolute::run::<f64>(file, settings),
        }
    }
}

fn main() -> ExitCode {
    match evaluate(&Arguments::parse()) {
        Ok(code) => code,
        Err(reason) => {
            eprintln!("error: {reason}");
            ExitCode::from(1)
        }
    }
}

fn evaluate(arguments: &Arguments) -> Result<ExitCode, String> {
    let settings = Settings {
        threshold_px: arguments.threshold,
        confidence: arguments.confidence,
        max_iterations: arguments.max_iterations,
        max_correspondences: arguments.max_corr,
        seed: arguments.seed,
        time_budget: arguments.time_budget,
    };
    let plots = [&arguments.plot, &arguments.plot_risk, &arguments.plot_time];
    let is_svg = |path: &&PathBuf| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("svg"));
    if let Some(path) = plots.into_iter().flatten().find(|path| !is_svg(path)) {
        return Err(format!("{}: the plot is an SVG, name it .svg", path.display()));
    }
    let mut paths = Vec::new();
    for path in &arguments.paths {
        collect(path, &mut paths).map_err(|e| format!("{}: {e}", path.display()))?;
    }
    if paths.is_empty() {
        return Err("no .txt file in the folders given".into());
    }
    let Some(problem) = arguments.task.problem() else {
        return bundle::evaluate(arguments, &paths);
    };

    let passes = 1 + if arguments.plot_time.is_some() { BUDGETS.len() } else { 0 };
    let progress = ProgressBar::new((passes * paths.len()) as u64);
    let style = "{bar:40.green/black} {pos}/{len} {eta} {msg}";
    progress.set_style(ProgressStyle::with_template(style).map_err(|e| e.to_string())?);
    if !io::stderr().is_terminal() {
        progress.set_draw_target(indicatif::ProgressDrawTarget::hidden());
    }
    let (mut inputs, mut outcomes, mut broken) = (Vec::new(), Vec::new(), 0);
    for path in &paths {
        progress.set_message(report::scene(path));
        match Input::read(path, problem) {
            Ok(input) => {
                outcomes.push((path.clone(), input.run(problem, arguments.scalar, &settings)));
                inputs.push(input);
            }
            Err(why) => {
                broken += 1;
                progress.suspend(|| eprintln!("skipped {why}"));
            }
        }
        progress.inc(1);
    }
    let mut timed = Vec::new();
    for budget in BUDGETS.into_iter().take(passes - 1) {
        progress.set_message(format!("{budget} ms"));
        let settings = Settings { time_budget: Some(Duration::from_secs_f64(1e-3 * budget)), ..settings };
        let run = |input: &Input| {
            progress.inc(1);
            input.run(problem, arguments.scalar, &settings)
        };
        timed.push(Timed::new(problem, budget, &inputs.iter().map(run).collect::<Vec<_>>()));
    }
    progress.finish_and_clear();

    if outcomes.is_empty() {
        return Err("no file could be evaluated".into());
    }
    let named = |path: &Path, e: io::Error| format!("{}: {e}", path.display());
    if let Some(path) = &arguments.csv {
        report::write_csv(path, problem, &outcomes).map_err(|e| named(path, e))?;
    }
    let drawn = |path: &Path, result: Result<(), Box<dyn Error>>| {
        result.map_err(|e| format!("{}: {e}", path.display()))
    };
    if let Some(path) = &arguments.plot {
        drawn(path, plot::cumulative_error(path, problem, &outcomes))?;
    }
    if let Some(path) = &arguments.plot_risk {
        drawn(path, plot::risk(path, problem, &outcomes))?;
    }
    if let Some(path) = &arguments.plot_time {
        drawn(path, plot::area_by_time(path, problem, &timed))?;
        timed.iter().for_each(|t| t.print(problem));
    }
    report::print(problem, &outcomes);
    Ok(ExitCode::from(if broken > 0 { 3 } else { 0 }))
}

/// The file itself, or every `.txt` file below a folder, in order of their names.
fn collect(path: &Path, out: &mut Vec<PathBuf>) -> io::Result<()> {
    if !path.is_dir() {
        fs::metadata(path)?;
        out.push(path.into());
        return Ok(());
    }
    let mut entries = fs::read_dir(path)?.map(|e| e.map(|e| e.path())).collect::<io::Result<Vec<_>>>()?;
    entries.sort();
    for entry in entries {
        if entry.is_dir() {
            collect(&entry, out)?;
        } else if entry.extension().is_some_and(|e| e == "txt") {
            out.push(entry);
        }
    }
    Ok(())
}
