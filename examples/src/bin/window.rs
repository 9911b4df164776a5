//! Bundle adjustment of a sliding window at work: over a synthetic flight, or on a file.

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use epipole::Real;
use epipole::bundle::BundleOptions;
use epipole::real::lit;
use epipole::robust::loss::Loss;
use epipole_examples::exit_code;
use epipole_examples::window::draw_paths;
use epipole_examples::window::flight::fly;
use epipole_host_tests::bundle::HeapWindow;
use epipole_host_tests::bundle::problem::{Problem, centre, read_back};

#[derive(Parser)]
#[command(name = "window", version, about = "Bundle adjustment of a sliding window")]
struct Arguments {
    /// A problem to adjust instead of the flight: tracks (`ncam npt nobs`, `fx fy cx cy R_gt t_gt R t` a camera, points,
    /// `camera point u v flag`), a synthetic window (`P L M huber`, ..) or the format of "Bundle Adjustment in the Large".
    file: Option<PathBuf>,
    /// Frames of the window.
    #[arg(long, value_name = "N", default_value_t = 8)]
    frames: usize,
    /// Points of the window (file).
    #[arg(long, value_name = "N", default_value_t = 100)]
    points: usize,
    /// Observations of the window (file).
    #[arg(long, value_name = "N", default_value_t = 700)]
    observations: usize,
    /// Length of the flight in frames, a metre apart.
    #[arg(long, value_name = "N", default_value_t = 120)]
    length: usize,
    /// Noise of the flight's pixels.
    #[arg(long, value_name = "PX", default_value_t = 1.0)]
    noise: f64,
    /// Seed of the flight.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Adjust in single precision.
    #[arg(long)]
    f32: bool,
    /// The picture of the path seen from above (SVG).
    #[arg(long, value_name = "FILE", default_value = "out/window.svg")]
    out: PathBuf,
    /// Write the chosen part of the file as text for other solvers.
    #[arg(long, value_name = "FILE")]
    export: Option<PathBuf>,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let run = if arguments.f32 { run::<f32> } else { run::<f64> };
    exit_code(run(&arguments))
}

fn run<T: Real>(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    if arguments.frames < 3 {
        return Err("a window needs three frames".into());
    }
    match &arguments.file {
        Some(file) => adjust::<T>(&Problem::read(file)?, arguments),
        None => flight::<T>(arguments),
    }
}

fn flight<T: Real>(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let steps = fly::<T>(arguments.length, arguments.frames, arguments.noise, arguments.seed)?;
    println!("frame  iterations  cost before   cost after  outliers  error, m  sigma, m  dead reckoning, m");
    for (k, step) in steps.iter().enumerate() {
        let Some(report) = step.report.filter(|_| k % 10 == 9 || k + 1 == steps.len()) else { continue };
        println!(
            "{:5}  {:10}  {:11.2}  {:11.2}  {:8}  {:8.3}  {:8.3}  {:17.3}",
            k + 1,
            report.iterations,
            report.cost_before.to_f64(),
            report.cost_after.to_f64(),
            report.outliers,
            (centre(&step.after) - centre(&step.truth)).norm(),
            step.sigma,
            (centre(&step.before) - centre(&step.truth)).norm(),
        );
    }
    let path = |pose: fn(&epipole_examples::window::flight::Step<T>) -> &epipole::geometry::Pose<f64>| {
        steps.iter().map(|s| centre(pose(s))).collect::<Vec<_>>()
    };
    let paths = [
        ("dead reckoning", path(|s| &s.before)),
        ("window", path(|s| &s.after)),
        ("truth", path(|s| &s.truth)),
    ];
    draw_paths(&arguments.out, "A sliding window over a flight", &paths)?;
    println!("path drawn to {}", arguments.out.display());
    Ok(())
}

fn adjust<T: Real>(whole: &Problem, arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let p = whole.choose(arguments.frames, arguments.points, arguments.observations);
    println!(
        "{} of {} frames, {} of {} points, {} of {} observations: the frames that share most points, the points seen by \
         most of them; the first two frames are fixed",
        p.poses.len(),
        whole.poses.len(),
        p.points.len(),
        whole.points.len(),
        p.observations.len(),
        whole.observations.len()
    );
    if let Some(file) = &arguments.export {
        std::fs::write(file, p.export())?;
    }
    let mut memory = HeapWindow::<T>::new(p.poses.len(), p.points.len(), p.observations.len());
    println!("memory of the window: {} bytes", memory.bytes());
    let mut window = memory.window();
    let (frames, points) = p.fill(&mut window)?;
    let options =
        BundleOptions { loss: Loss::Huber(lit(2.0)), max_iterations: 50, ..BundleOptions::default() };
    println!("iteration         cost   damping");
    let report = window.optimise_while(&options, |progress| {
        println!(
            "{:9}  {:11.4}  {:8.1e}",
            progress.iterations,
            progress.cost.to_f64(),
            progress.damping.to_f64()
        );
        true
    })?;
    println!(
        "{:?} after {} iterations: cost {:.4} -> {:.4}; {} observations, {} outliers beyond {} px, {} behind",
        report.termination,
        report.iterations,
        report.cost_before.to_f64(),
        report.cost_after.to_f64(),
        report.observations,
        report.outliers,
        options.outlier_sigma.to_f64(),
        report.behind
    );
    let (after, _) = read_back(&window, &frames, &points);
    for (name, poses) in [("before", &p.poses), ("after", &after)] {
        let worst = poses.iter().zip(&p.true_poses).fold([0.0f64; 2], |[turn, shift], (a, b)| {
            let angle = (a.rotation * b.rotation.inverse()).angle().to_degrees();
            [turn.max(angle), shift.max((centre(a) - centre(b)).norm())]
        });
        if !p.true_poses.is_empty() {
            println!(
                "{name:6}: largest rotation error {:.4} deg, largest centre error {:.5}",
                worst[0], worst[1]
            );
        }
    }
    let path = |poses: &[epipole::geometry::Pose<f64>]| poses.iter().map(centre).collect::<Vec<_>>();
    let mut paths = vec![("before", path(&p.poses)), ("after", path(&after))];
    if !p.true_poses.is_empty() {
        paths.push(("truth", path(&p.true_poses)));
    }
    draw_paths(&arguments.out, "Camera centres", &paths)?;
    println!("path drawn to {}", arguments.out.display());
    Ok(())
}
