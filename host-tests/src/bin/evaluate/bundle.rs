//! Bundle problems: what adjusting a whole file does to its cost.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use epipole::Real;
use epipole::bundle::{BundleOptions, Termination};
use epipole::geometry::Pose;
use epipole::real::lit;
use epipole::robust::loss::Loss;
use epipole_host_tests::bundle::HeapWindow;
use epipole_host_tests::bundle::problem::{Problem, centre, read_back};

use crate::{Arguments, Scalar, plot};

/// What became of a file.
struct Adjusted {
    size: [usize; 3],
    termination: Termination,
    /// The cost before each iteration, and after the last.
    costs: Vec<f64>,
    /// Root mean square of the residuals before and after, px, of those not behind their camera.
    rms_px: [f64; 2],
    outliers: usize,
    behind: usize,
    /// Largest error of a rotation, degrees, and of a camera centre, before and after; none without the truth.
    errors: Option<[[f64; 2]; 2]>,
    milliseconds: f64,
}

/// Adjusts every file and prints a line about each.
pub(crate) fn evaluate(arguments: &Arguments, paths: &[PathBuf]) -> Result<ExitCode, String> {
    let (mut done, mut broken) = (Vec::new(), 0);
    for path in paths {
        let adjusted = Problem::read(path).map_err(|e| e.to_string()).and_then(|p| match arguments.scalar {
            Scalar::F32 => adjust::<f32>(&p, arguments),
            Scalar::F64 => adjust::<f64>(&p, arguments),
        });
        match adjusted {
            Ok(adjusted) => done.push((path.clone(), adjusted)),
            Err(why) => {
                broken += 1;
                eprintln!("skipped {}: {why}", path.display());
            }
        }
    }
    if done.is_empty() {
        return Err("no file could be evaluated".into());
    }
    if let Some(path) = &arguments.csv {
        fs::write(path, csv(&done)).map_err(|e| format!("{}: {e}", path.display()))?;
    }
    if let Some(path) = &arguments.plot {
        let curves = done.iter().map(|(file, a)| (name(file), relative(&a.costs))).collect();
        plot::falling_cost(path, curves).map_err(|e| format!("{}: {e}", path.display()))?;
    }
    print(&done);
    Ok(ExitCode::from(if broken > 0 { 3 } else { 0 }))
}

fn adjust<T: Real>(problem: &Problem, arguments: &Arguments) -> Result<Adjusted, String> {
    let size = [problem.poses.len(), problem.points.len(), problem.observations.len()];
    let [frames, points, observations] = size;
    if frames.max(points) >= usize::from(u16::MAX) {
        return Err("more frames or points than a window holds".into());
    }
    let mut memory = HeapWindow::<T>::new(frames, points, observations);
    let mut window = memory.window();
    let (frames, points) = problem.fill(&mut window).map_err(|e| e.to_string())?;
    let options = BundleOptions {
        loss: Loss::Huber(lit(arguments.threshold.unwrap_or(2.0))),
        max_iterations: arguments.max_iterations.unwrap_or(50),
        ..BundleOptions::default()
    };
    let mut costs = Vec::new();
    let start = Instant::now();
    let report = window
        .optimise_while(&options, |progress| {
            costs.push(progress.cost.to_f64());
            true
        })
        .map_err(|e| e.to_string())?;
    let milliseconds = start.elapsed().as_secs_f64() * 1e3;
    costs.push(report.cost_after.to_f64());
    let (poses, positions) = read_back(&window, &frames, &points);
    let rms = |poses: &[Pose<f64>], points: &[_]| {
        let squares: Vec<f64> = problem.squared_residuals(poses, points).flatten().collect();
        (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
    };
    let worst = |poses: &[Pose<f64>]| {
        poses.iter().zip(&problem.true_poses).fold([0.0f64; 2], |[turn, shift], (a, b)| {
            let angle = (a.rotation * b.rotation.inverse()).angle().to_degrees();
            [turn.max(angle), shift.max((centre(a) - centre(b)).norm())]
        })
    };
    Ok(Adjusted {
        size,
        termination: report.termination,
        costs,
        rms_px: [rms(&problem.poses, &problem.points), rms(&poses, &positions)],
        outliers: report.outliers,
        behind: report.behind,
        errors: (!problem.true_poses.is_empty()).then(|| [worst(&problem.poses), worst(&poses)]),
        milliseconds,
    })
}

fn name(path: &Path) -> String {
    path.file_stem().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}

/// Iteration and the logarithm of the cost as a share of the first.
fn relative(costs: &[f64]) -> Vec<(f64, f64)> {
    let first = costs.first().copied().unwrap_or(1.0);
    (0..).zip(costs).map(|(k, cost)| (f64::from(k), (cost / first).log10())).collect()
}

fn print(done: &[(PathBuf, Adjusted)]) {
    println!(
        "{:24} frames points observations iterations         cost before -> after         rms px          \
         outliers behind        ms  rotation deg        centre               end",
        "file"
    );
    for (path, a) in done {
        let [frames, points, observations] = a.size;
        let errors = a.errors.map_or_else(String::new, |[[r0, c0], [r1, c1]]| {
            format!("{r0:7.4} -> {r1:7.4}  {c0:8.5} -> {c1:8.5}")
        });
        println!(
            "{:24} {frames:6} {points:6} {observations:12} {:10} {:15.4} -> {:13.4}  {:8.3} -> {:8.3} {:8} {:6} {:9.2}  \
             {errors:40} {:?}",
            name(path),
            a.costs.len() - 1,
            a.costs[0],
            a.costs[a.costs.len() - 1],
            a.rms_px[0],
            a.rms_px[1],
            a.outliers,
            a.behind,
            a.milliseconds,
            a.termination
        );
    }
}

fn csv(done: &[(PathBuf, Adjusted)]) -> String {
    let mut text = String::from(
        "file,frames,points,observations,iterations,cost_before,cost_after,rms_px_before,rms_px_after,outliers,behind,ms,\
         r_deg_before,r_deg_after,centre_before,centre_after,end\n",
    );
    for (path, a) in done {
        let [frames, points, observations] = a.size;
        let [[r0, c0], [r1, c1]] = a.errors.unwrap_or([[f64::NAN; 2]; 2]);
        let _ = writeln!(
            text,
            "{},{frames},{points},{observations},{},{:.6},{:.6},{:.4},{:.4},{},{},{:.3},{r0:.5},{r1:.5},{c0:.6},{c1:.6},{:?}",
            name(path),
            a.costs.len() - 1,
            a.costs[0],
            a.costs[a.costs.len() - 1],
            a.rms_px[0],
            a.rms_px[1],
            a.outliers,
            a.behind,
            a.milliseconds,
            a.termination
        );
    }
    text
}
