//! `epipole::bundle` on a flight: filled, optimised, slid on by one frame, optimised again.

use epipole::Real;
use epipole::bundle::{BundleOptions, BundleReport, WindowStorage, scalars_len};
use epipole_exercise::Sink;

use crate::Flight;

const FRAMES: usize = 4;
const POINTS: usize = 24;
const SCALARS: usize = scalars_len(FRAMES);

pub(super) fn bundle<T: Real>(sink: &mut Sink) {
    let mut storage = WindowStorage::<T, FRAMES, POINTS, { FRAMES * POINTS }, SCALARS>::new();
    let mut window = storage.window();
    let flight = Flight { seed: 1 };
    let Ok((frames, points)) = flight.fill::<T, FRAMES, POINTS>(&mut window) else { return };
    let options = BundleOptions::<T> { max_iterations: 6, ..BundleOptions::default() };
    let report = |told: &BundleReport<T>, sink: &mut Sink| {
        sink.finite(&[told.cost_before, told.cost_after]);
        sink.count(told.iterations as usize);
    };
    if let Ok(told) = window.optimise(&options) {
        report(&told, sink);
    }
    for frame in frames.iter().flatten() {
        if let Ok(told) = window.frame_covariance(*frame, &options.loss) {
            sink.finite(&told.pose);
        }
    }
    for point in points.iter().flatten().take(4) {
        if let Ok(covariance) = window.point_covariance(*point, &options.loss) {
            sink.finite(&covariance);
        }
    }
    let [_, _, Some(oldest), _] = frames else { return };
    sink.flag(window.marginalise_frame(oldest, &options.loss).is_ok());
    if let (Some(camera), Ok(pose)) = (flight.camera(), window.pose(frames[3].unwrap_or(oldest))) {
        let newest = window.add_frame(camera, &pose);
        if let Ok(newest) = newest {
            for (point, j) in points.iter().zip(0u32..) {
                let pixel = flight.pixel(4, j, &flight.point(j, POINTS as u32));
                if let (Some(point), Some(pixel)) = (point, pixel) {
                    let pixel = pixel.map(epipole::real::lit::<T>);
                    sink.flag(window.add_observation(newest, *point, &pixel, T::ONE).is_ok());
                }
            }
        }
    }
    if let Ok(told) = window.optimise(&options) {
        report(&told, sink);
    }
    for frame in window.frame_handles() {
        if let Ok(pose) = window.pose(frame) {
            sink.finite_pose(&pose);
        }
    }
    for point in window.point_handles() {
        if let Ok(position) = window.position(point) {
            sink.finite(&position);
        }
    }
}
