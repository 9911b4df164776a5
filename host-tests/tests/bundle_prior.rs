//! Marginalisation: the prior says what the frames and points said that it replaces.

use epipole::Real;
use epipole::bundle::{BundleOptions, FrameHandle, Window};
use epipole::geometry::{Camera, Pinhole, Pose};
use epipole::nalgebra::{UnitQuaternion, Vector2, Vector3};
use epipole::real::lit;
use epipole::robust::loss::Loss;
use epipole_host_tests::Rng;
use epipole_host_tests::bundle::HeapWindow;
use epipole_host_tests::bundle::problem::cast_pose;

/// Six frames in a row. Points are seen by three neighbouring frames each, so that none of frame 0's reaches frame 5.
fn fill<T: Real>(window: &mut Window<'_, T>, seed: u64, sigma_px: f64) -> Vec<FrameHandle> {
    let mut rng = Rng::new(seed);
    let camera: Camera<T> = Pinhole::new(lit(400.0), lit(400.0), lit(320.0), lit(240.0)).unwrap().into();
    let poses: Vec<Pose<f64>> = (0..6)
        .map(|k| {
            let rotation: UnitQuaternion<f64> = rng.rotation(0.1);
            let centre = Vector3::new(0.5 * k as f64, 0.1 * rng.normal(), 0.1 * rng.normal());
            Pose::from_parts((-(rotation * centre)).into(), rotation)
        })
        .collect();
    let frames: Vec<FrameHandle> =
        poses.iter().map(|p| window.add_frame(camera, &cast_pose(p)).unwrap()).collect();
    window.fix_frame(frames[0], true).unwrap();
    window.fix_frame(frames[1], true).unwrap();
    for first in 0..4 {
        for _ in 0..15 {
            let x = Vector3::new(
                0.5 * (first + 1) as f64 + rng.range(-2.0, 2.0),
                rng.range(-1.5, 1.5),
                rng.range(4.0, 8.0),
            );
            let point = window.add_point(&x.map(lit)).unwrap();
            for k in first..first + 3 {
                let y = poses[k].rotation * x + poses[k].translation.vector;
                let pixel = Vector2::new(400.0 * y.x / y.z + 320.0, 400.0 * y.y / y.z + 240.0);
                let noise = Vector2::new(rng.normal(), rng.normal()) * sigma_px;
                window.add_observation(frames[k], point, &(pixel + noise).map(lit), T::ONE).unwrap();
            }
        }
    }
    frames
}

fn the_prior_keeps_estimate_and_covariance<T: Real>(tolerance: f64) {
    for seed in 0..5 {
        let mut memory = HeapWindow::<T>::new(6, 60, 200);
        let mut window = memory.window();
        let frames = fill(&mut window, seed, 0.5);
        let options = BundleOptions {
            loss: Loss::Squared,
            cost_tolerance: T::EPSILON,
            max_iterations: 50,
            ..BundleOptions::default()
        };
        let _ = window.optimise(&options).unwrap();
        let last = frames[5];
        let before = window.frame_covariance(last, &Loss::Squared).unwrap().motion;
        let pose = window.pose(last).unwrap();
        for (k, frame) in frames.iter().enumerate().take(3) {
            let gone = window.marginalise_frame(*frame, &Loss::Squared).unwrap();
            // The points of frames 0 to 2 have their last observation in frame 2.
            assert_eq!((gone, window.frame_count()), (if k == 2 { 15 } else { 0 }, 5 - k), "seed {seed}");
        }
        assert_eq!(window.prior_frame_count(), 2);
        let after = window.frame_covariance(last, &Loss::Squared).unwrap().motion;
        for i in 0..6 {
            for j in 0..6 {
                let scale = (before[(i, i)] * before[(j, j)]).to_f64().sqrt();
                let difference = (before[(i, j)] - after[(i, j)]).to_f64().abs() / scale;
                assert!(difference < tolerance, "seed {seed}, {i} {j}: {before} {after}");
            }
        }
        // The minimum is nearly where it was: points with fewer observations left are free to bend the linearisation.
        let _ = window.optimise(&options).unwrap();
        let now = window.pose(last).unwrap();
        let moved = (now.translation.vector - pose.translation.vector).map(|x| x.to_f64()).norm();
        let sigma = before[(3, 3)].to_f64().sqrt();
        assert!(moved < 0.02 * sigma, "seed {seed}: moved {moved}, sigma {sigma}");
    }
}

#[test]
fn the_prior_keeps_estimate_and_covariance_f64() {
    the_prior_keeps_estimate_and_covariance::<f64>(1e-6);
}

#[test]
fn the_prior_keeps_estimate_and_covariance_f32() {
    the_prior_keeps_estimate_and_covariance::<f32>(2e-2);
}

fn a_prior_of_relative_measurements_holds_nothing_in_the_world<T: Real>(tolerance: f64) {
    for seed in 0..5 {
        let mut memory = HeapWindow::<T>::new(6, 60, 200);
        let mut window = memory.window();
        let frames = fill(&mut window, seed, 0.5);
        for frame in &frames {
            window.fix_frame(*frame, false).unwrap();
        }
        let options = BundleOptions { loss: Loss::Squared, max_iterations: 0, ..BundleOptions::default() };
        for frame in frames.iter().take(2) {
            window.marginalise_frame(*frame, &Loss::Squared).unwrap();
        }
        let cost = window.optimise(&options).unwrap().cost_before.to_f64();
        // The whole window carried somewhere else.
        let mut rng = Rng::new(seed + 77);
        let turn: UnitQuaternion<f64> = rng.rotation(0.8);
        let carry = Pose::from_parts(Vector3::new(2.0, -3.0, 1.5).into(), turn);
        for frame in frames.iter().skip(2) {
            let pose: Pose<f64> = cast_pose(&window.pose(*frame).unwrap());
            window.set_pose(*frame, &cast_pose(&(pose * carry.inverse()))).unwrap();
        }
        for point in window.point_handles().collect::<Vec<_>>() {
            let x = window.position(point).unwrap().map(|x| x.to_f64());
            let carried = carry.rotation * x + carry.translation.vector;
            window.set_position(point, &carried.map(lit)).unwrap();
        }
        let carried = window.optimise(&options).unwrap().cost_before.to_f64();
        assert!(cost > 1.0 && (carried / cost - 1.0).abs() < tolerance, "seed {seed}: {cost} {carried}");
    }
}

#[test]
fn a_prior_of_relative_measurements_holds_nothing_in_the_world_f64() {
    a_prior_of_relative_measurements_holds_nothing_in_the_world::<f64>(1e-9);
}

#[test]
fn a_prior_of_relative_measurements_holds_nothing_in_the_world_f32() {
    a_prior_of_relative_measurements_holds_nothing_in_the_world::<f32>(1e-3);
}
