//! `bundle_bench REPEATS OUT.csv problem.txt ...`: optimises the window problems of the comparison with Ceres and
//! writes the columns of `ceres_ba`. Times are CPU time of the thread: of filling the window and optimising it
//! (`total`), and of optimising alone (`solve`). The cost of an `f32` result is evaluated in `f64`.

use std::io::Write;
use std::path::Path;

use cpu_time::ThreadTime;
use epipole::Real;
use epipole::bundle::BundleOptions;
use epipole::robust::loss::Loss;
use epipole_host_tests::bundle::HeapWindow;
use epipole_host_tests::bundle::problem::{Problem, read_back};

struct Row {
    total: Vec<f64>,
    solve: Vec<f64>,
    iterations: u32,
    cost: f64,
    rotation_deg: f64,
}

fn run<T: Real>(problem: &Problem, repeats: usize, options: &BundleOptions<T>) -> Row {
    let mut memory =
        HeapWindow::<T>::new(problem.poses.len(), problem.points.len(), problem.observations.len());
    let mut row = Row { total: vec![], solve: vec![], iterations: 0, cost: 0.0, rotation_deg: 0.0 };
    for _ in 0..repeats {
        let start = ThreadTime::now();
        let mut window = memory.window();
        window.clear();
        let (frames, points) = problem.fill(&mut window).expect("the window has room");
        let filled = ThreadTime::now();
        let report = window.optimise(options).expect("a solvable problem");
        row.solve.push(filled.elapsed().as_nanos() as f64 * 1e-3);
        row.total.push(start.elapsed().as_nanos() as f64 * 1e-3);
        row.iterations = report.iterations;
        let (poses, points) = read_back(&window, &frames, &points);
        row.cost = problem.cost(&poses, &points, &Loss::Huber(1.0));
        row.rotation_deg = poses
            .iter()
            .zip(&problem.true_poses)
            .fold(0.0, |m: f64, (a, b)| m.max((a.rotation * b.rotation.inverse()).angle().to_degrees()));
    }
    row.total.sort_by(f64::total_cmp);
    row.solve.sort_by(f64::total_cmp);
    row
}

fn options<T: Real>(max_iterations: u32) -> BundleOptions<T> {
    BundleOptions { loss: Loss::Huber(T::ONE), max_iterations, ..BundleOptions::default() }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, repeats, out, files @ ..] = arguments.as_slice() else {
        eprintln!("bundle_bench REPEATS OUT.csv problem.txt ...");
        std::process::exit(2);
    };
    let repeats: usize = repeats.parse().expect("a number of repeats");
    let mut out = std::fs::File::create(out)?;
    writeln!(
        out,
        "problem,peer,poses,points,obs,us_total_min,us_total_median,us_solve_min,us_solve_median,iterations,cost_start,\
         cost_final,cost_truth,max_rot_err_deg"
    )?;
    for file in files {
        let problem = Problem::read(Path::new(file))?;
        let loss = Loss::Huber(1.0);
        let start = problem.cost(&problem.poses, &problem.points, &loss);
        let truth = problem.cost(&problem.true_poses, &problem.true_points, &loss);
        let rows = [
            ("ours", run::<f64>(&problem, repeats, &options(50))),
            ("ours 5 it", run::<f64>(&problem, repeats, &options(5))),
            ("ours f32", run::<f32>(&problem, repeats, &options(50))),
            ("ours f32 5 it", run::<f32>(&problem, repeats, &options(5))),
        ];
        let name = Path::new(file).file_name().unwrap_or_default().to_string_lossy();
        for (peer, row) in rows {
            writeln!(
                out,
                "{name},{peer},{},{},{},{:.1},{:.1},{:.1},{:.1},{},{start:.4},{:.6},{truth:.4},{:.5}",
                problem.poses.len(),
                problem.points.len(),
                problem.observations.len(),
                row.total[0],
                row.total[repeats / 2],
                row.solve[0],
                row.solve[repeats / 2],
                row.iterations,
                row.cost,
                row.rotation_deg,
            )?;
        }
    }
    Ok(())
}
