//! Bundle adjustment of a window.

use epipole::bundle::{BundleOptions, WindowStorage, scalars_len};
use epipole_problems::Flight;

use crate::row::{row, trial};

const FRAMES: usize = if cfg!(small_ram) { 3 } else { 8 };
const POINTS: usize = if cfg!(small_ram) { 20 } else { 100 };
const SCALARS: usize = scalars_len(FRAMES);

pub fn run() {
    for iterations in [1, 5] {
        let mut storage = WindowStorage::<f32, FRAMES, POINTS, { FRAMES * POINTS }, SCALARS>::new();
        let name =
            if iterations == 1 { "window_optimise, 1 iteration" } else { "window_optimise, 5 iterations" };
        row(name, "flight", 0..8, 1.0, |k| {
            let mut window = storage.window();
            window.clear();
            let flight = Flight { seed: u64::from(k) };
            if flight.fill::<f32, FRAMES, POINTS>(&mut window).is_err() {
                epipole_firmware::exit(1);
            }
            let options = BundleOptions { max_iterations: iterations, ..BundleOptions::default() };
            let observations = window.observation_count();
            if k == 0 {
                epipole_firmware::println!("{FRAMES} frames, {POINTS} points, {observations} observations");
            }
            // Root mean square of the residuals over what noise would leave.
            trial(
                || window.optimise(&options),
                |report| {
                    report.as_ref().map_or(f64::INFINITY, |r| f64::from(r.cost_after) / observations as f64)
                },
            )
        });
    }
}
