//! `epipole::bundle`: a window of 8 frames of a synthetic flight, about 100 points.

use epipole::Real;
use epipole::bundle::{BundleOptions, FrameHandle, PointHandle, Window};
use epipole::nalgebra::{Vector2, Vector3};
use epipole::real::lit;
use epipole::robust::loss::Loss;
use epipole_host_tests::Rng;
use epipole_host_tests::bundle::HeapWindow;
use epipole_host_tests::bundle::flight::{CAMERA, Flight};
use epipole_host_tests::bundle::problem::{Problem, cast_pose, pinhole};

use crate::Run;

crate::both_scalars! { window_iteration, window_refine_frame, window_refine_point, window_marginalise_frame }

const FRAMES: usize = 8;

/// Frames and points of a flight a little off the truth; the first two frames are fixed.
fn problem() -> Problem {
    let flight = Flight::new(FRAMES, 60, 1.0, 1);
    let mut rng = Rng::new(2);
    // A point that one frame saw has no depth.
    let mut seen_by = vec![0; flight.landmarks.len()];
    flight.seen.iter().flatten().for_each(|(track, _)| seen_by[*track] += 1);
    let kept: Vec<usize> = (0..seen_by.len()).filter(|track| seen_by[*track] > 1).collect();
    let observations = flight.seen.iter().enumerate().flat_map(|(frame, seen)| {
        let kept = &kept;
        seen.iter().filter_map(move |(track, pixel)| Some((frame, kept.binary_search(track).ok()?, *pixel)))
    });
    Problem {
        cameras: vec![pinhole(CAMERA).expect("a camera"); FRAMES],
        observations: observations.collect::<Vec<(usize, usize, Vector2<f64>)>>(),
        poses: flight.poses.clone(),
        points: kept.iter().map(|track| flight.landmarks[*track] + 0.05 * rng.normal3()).collect(),
        true_poses: flight.poses.clone(),
        true_points: kept.iter().map(|track| flight.landmarks[*track]).collect(),
        fixed: 2,
    }
}

/// A filled window that `body` works on; it also restores what it changed, so that each run is the same.
fn window<T: Real>(
    body: impl Fn(&mut Window<'_, T>, &[FrameHandle], &[PointHandle], &[Vector3<T>]) + 'static,
) -> Run {
    let problem = problem();
    let starts: Vec<Vector3<T>> = problem.points.iter().map(|x| x.map(lit)).collect();
    let mut memory = HeapWindow::<T>::new(FRAMES, problem.points.len(), problem.observations.len());
    let (frames, points) = problem.fill(&mut memory.window()).expect("the window has room");
    Run { calls: 1, body: Box::new(move || body(&mut memory.window(), &frames, &points, &starts)) }
}

fn options<T: Real>(max_iterations: u32) -> BundleOptions<T> {
    BundleOptions { loss: Loss::Huber(T::ONE), max_iterations, ..BundleOptions::default() }
}

fn window_iteration<T: Real>() -> Run {
    window::<T>(|window, _, points, starts| {
        for (point, start) in points.iter().zip(starts) {
            let _ = window.set_position(*point, start);
        }
        std::hint::black_box(&window.optimise(&options(1)));
    })
}

fn window_refine_frame<T: Real>() -> Run {
    let start = cast_pose(&problem().poses[5]);
    window::<T>(move |window, frames, _, _| {
        let _ = window.set_pose(frames[5], &start);
        std::hint::black_box(&window.refine_frame(frames[5], &options(5)));
    })
}

fn window_refine_point<T: Real>() -> Run {
    window::<T>(|window, _, points, starts| {
        let _ = window.set_position(points[10], &starts[10]);
        std::hint::black_box(&window.refine_point(points[10], &options(5)));
    })
}

/// The window is filled anew in each run, for a frame can be marginalised only once.
fn window_marginalise_frame<T: Real>() -> Run {
    let problem = problem();
    let mut memory = HeapWindow::<T>::new(FRAMES, problem.points.len(), problem.observations.len());
    Run {
        calls: 1,
        body: Box::new(move || {
            let mut window = memory.window();
            window.clear();
            let (frames, _) = problem.fill(&mut window).expect("the window has room");
            std::hint::black_box(&window.marginalise_frame(frames[0], &Loss::Huber(T::ONE)));
        }),
    }
}
