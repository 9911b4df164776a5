//! Bundle adjustment of a window.

use core::hint::black_box;

use epipole::bundle::{BundleOptions, WindowStorage, scalars_len};
use epipole::nalgebra::{Vector2, Vector3};
use epipole_problems::Flight;

use crate::row::{row, trial, workspace};

const FRAMES: usize = if cfg!(small_ram) { 3 } else { 8 };
const POINTS: usize = if cfg!(small_ram) { 20 } else { 100 };
const SCALARS: usize = scalars_len(FRAMES);

pub fn run() {
    workspace::<WindowStorage<f32, FRAMES, POINTS, { FRAMES * POINTS }, SCALARS>>("window");
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
    let mut storage = WindowStorage::<f32, FRAMES, POINTS, { FRAMES * POINTS }, SCALARS>::new();
    row("window_fill", "a frame, a point, a pixel", 0..8, 1.0, |k| {
        let mut window = storage.window();
        window.clear();
        let flight = Flight { seed: u64::from(k) };
        let Some(camera) = flight.camera::<f32>() else { epipole_firmware::exit(1) };
        let start = flight.guess(k);
        let fill = || {
            let frame = window.add_frame(black_box(camera), black_box(&start)).ok()?;
            let point = window.add_point(&black_box(Vector3::z())).ok()?;
            window.add_observation(frame, point, &Vector2::zeros(), 1.0).ok()
        };
        trial(fill, |done| if done.is_some() { 0.0 } else { f64::INFINITY })
    });
    row("window_marginalise", "flight", 0..8, 1.0, |k| {
        let mut window = storage.window();
        window.clear();
        if (Flight { seed: u64::from(k) }).fill::<f32, FRAMES, POINTS>(&mut window).is_err() {
            epipole_firmware::exit(1);
        }
        let marginalise = || {
            let oldest = window.frame_handles().next()?;
            window.marginalise_frame(oldest, &BundleOptions::default().loss).ok()
        };
        trial(marginalise, |done| if done.is_some() { 0.0 } else { f64::INFINITY })
    });
}
