//! What a window forgets and keeps, and how much a workspace over slices holds.

use epipole::bundle::{BundleOptions, FrameHandle, PointHandle, Window, WindowStorage, scalars_len};
use epipole::estimate::{AbsolutePoseWorkspace, TwoViewWorkspace};
use epipole::geometry::{BrownConrady, CameraModel, KannalaBrandt, Pinhole, Pose};
use epipole::nalgebra::Vector3;
use epipole::robust::loss::Loss;
use epipole_host_tests::in_both_scalars;

const FRAMES: usize = 3;
type Storage = WindowStorage<f64, FRAMES, 8, 24, { scalars_len(FRAMES) }>;

/// Three frames a metre apart of which the first two are fixed, eight points, exact pixels.
fn fill(window: &mut Window<'_, f64>) -> (Vec<FrameHandle>, Vec<PointHandle>) {
    let camera = Pinhole::new(500.0, 500.0, 320.0, 240.0).unwrap();
    let truth = [0.0, 1.0, 2.0].map(|x| Pose::translation(-x, 0.0, 0.0));
    let frames: Vec<_> = truth.iter().map(|pose| window.add_frame(camera.into(), pose).unwrap()).collect();
    for &frame in &frames[..2] {
        window.fix_frame(frame, true).unwrap();
    }
    let points = (0..8)
        .map(|k| {
            let k = f64::from(k);
            let x = Vector3::new(k - 3.0, (k * 1.7).sin(), 6.0 + (k * 2.3).cos());
            let point = window.add_point(&x).unwrap();
            for (&frame, pose) in frames.iter().zip(&truth) {
                let pixel = camera.project(&(x + pose.translation.vector)).unwrap();
                window.add_observation(frame, point, &pixel, 1.0).unwrap();
            }
            point
        })
        .collect();
    (frames, points)
}

/// How far the third frame is from the truth.
fn error(window: &Window<'_, f64>, frame: FrameHandle) -> f64 {
    (window.pose(frame).unwrap().translation.vector - Vector3::new(-2.0, 0.0, 0.0)).norm()
}

#[test]
fn marginalised_points_leave_what_they_said_and_a_cleared_prior_does_not() {
    let mut storage = Storage::new();
    let mut window = storage.window();
    let (frames, points) = fill(&mut window);
    let full = window.frame_covariance(frames[2], &Loss::Squared).unwrap().motion.trace();
    for &point in &points[2..] {
        window.marginalise_point(point, &Loss::Squared).unwrap();
        assert!(window.position(point).is_err(), "the handle is stale");
    }
    assert_eq!((window.point_count(), window.observation_count()), (2, 6));
    assert!(window.prior_frame_count() > 0);
    // The prior knows what the six points said.
    let kept = window.frame_covariance(frames[2], &Loss::Squared).unwrap().motion.trace();
    assert!((kept / full - 1.0).abs() < 1e-6, "{kept} {full}");
    window.set_pose(frames[2], &Pose::translation(-1.98, 0.01, 0.0)).unwrap();
    let report = window.optimise(&BundleOptions { loss: Loss::Squared, ..Default::default() }).unwrap();
    assert!(report.changed && error(&window, frames[2]) < 1e-3, "{}", error(&window, frames[2]));

    window.clear_prior();
    assert_eq!(window.prior_frame_count(), 0);
    assert!(window.frame_covariance(frames[2], &Loss::Squared).is_err(), "two points fix no pose");
}

#[test]
fn a_distance_pulls_until_it_is_removed() {
    let mut storage = Storage::new();
    let mut window = storage.window();
    let (frames, _) = fill(&mut window);
    window.set_distance(frames[2], frames[0], 2.5, 1e-4).unwrap();
    assert!(window.optimise(&BundleOptions::default()).unwrap().changed);
    assert!(error(&window, frames[2]) > 0.1);
    window.remove_distance(frames[2]).unwrap();
    assert!(window.optimise(&BundleOptions::default()).unwrap().changed);
    assert!(error(&window, frames[2]) < 1e-4, "{}", error(&window, frames[2]));
}

#[test]
fn handles_count_slots() {
    let mut storage = Storage::new();
    let mut window = storage.window();
    let (frames, points) = fill(&mut window);
    assert!(frames.iter().map(|frame| frame.index()).eq(0..3));
    assert!(points.iter().map(|point| point.index()).eq(0..8));
    // As numbers and back.
    assert!(frames.iter().all(|frame| FrameHandle::from_bits(frame.to_bits()) == *frame));
    assert!(points.iter().all(|point| PointHandle::from_bits(point.to_bits()) == *point));
    assert!(window.pose(FrameHandle::from_bits(frames[0].to_bits() ^ 1 << 16)).is_err());
}

in_both_scalars! {
    fn a_workspace_holds_what_its_shortest_slice_holds<T>() {
        let (mut numbers, mut order, mut inliers) = (vec![T::ZERO; 18 * 8], vec![0; 30], vec![false; 25]);
        let two = TwoViewWorkspace::from_slices(&mut numbers, &mut order, &mut inliers);
        assert_eq!((two.capacity(), two.wide_capacity()), (25, 8));
        assert!(two.inliers().is_empty());
        let one = AbsolutePoseWorkspace::from_slices(&mut numbers, &mut order, &mut inliers);
        assert!(one.wide_capacity() <= one.capacity() && one.capacity() <= 25 && one.wide_capacity() > 0);
        assert!(one.inliers().is_empty());
    }

    fn distorted_cameras_know_their_pinhole<T>() {
        let number = |x: f64| epipole::real::lit::<T>(x);
        let pinhole = Pinhole::new(number(500.0), number(510.0), number(320.0), number(240.0)).unwrap();
        let radial = BrownConrady::new(pinhole, [number(0.01), T::ZERO, T::ZERO, T::ZERO, T::ZERO]).unwrap();
        let fisheye = KannalaBrandt::new(pinhole, [number(0.01), T::ZERO, T::ZERO, T::ZERO]).unwrap();
        assert_eq!((radial.pinhole(), fisheye.pinhole()), (pinhole, pinhole));
    }
}
