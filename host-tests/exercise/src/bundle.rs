//! `epipole::bundle`: a small window built, optimised, marginalised and taken apart.

use epipole::Real;
use epipole::bundle::{
    BundleOptions, FrameHandle, PointHandle, PosePrior, Unknowns, Window, WindowStorage, prior_len,
    scalars_len, system_len,
};
use epipole::geometry::{CameraModel, Pose};

use epipole::real::lit;

use crate::geometry::any_camera_model;
use crate::robust::any_loss;
pub(crate) use crate::window_calls::random_calls;
use crate::{Sink, Source};

const FRAMES: usize = 3;
const POINTS: usize = 8;
const OBSERVATIONS: usize = 20;
const SCALARS: usize = scalars_len(FRAMES);

pub(crate) fn window<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let mut storage = WindowStorage::<T, FRAMES, POINTS, OBSERVATIONS, SCALARS>::new();
    sink.count(system_len(FRAMES) + prior_len(FRAMES));
    sink.flag(Window::new(storage.memory()).is_ok());
    let mut window = storage.window();
    let Some(camera) = any_camera_model::<T>(source) else { return };
    let mut frames: [Option<FrameHandle>; FRAMES + 1] = [None; FRAMES + 1];
    for slot in &mut frames {
        // Mostly near the origin, so that the cameras see the points.
        let near = Pose::from_parts(source.vector3::<T>().into(), source.small_rotation());
        *slot = window.add_frame(camera, &near).ok();
    }
    let mut points: [Option<PointHandle>; POINTS + 1] = [None; POINTS + 1];
    for slot in &mut points {
        let mut position = source.vector3::<T>();
        position.z += lit(8.0);
        *slot = window.add_point(&position).ok();
    }
    for handle in frames.iter().flatten() {
        sink.count(FrameHandle::index(FrameHandle::from_bits(FrameHandle::to_bits(*handle))));
    }
    for handle in points.iter().flatten() {
        sink.count(PointHandle::index(PointHandle::from_bits(PointHandle::to_bits(*handle))));
    }
    for &point in points.iter().flatten() {
        for &frame in frames.iter().flatten() {
            let mut pixel = source.vector2::<T>() * lit::<T>(100.0);
            if let (Ok(pose), Ok(position)) = (window.pose(frame), window.position(point))
                && let Some(seen) = camera.project(&(pose.rotation * position + pose.translation.vector))
            {
                pixel = seen + source.vector2();
            }
            sink.flag(window.add_observation(frame, point, &pixel, source.scalar()).is_ok());
        }
    }
    act(&mut window, &frames, &points, source, sink);
    sink.count(window.frame_count() + window.point_count() + window.observation_count());
    for frame in window.frame_handles() {
        if let Ok(pose) = window.pose(frame) {
            sink.finite_pose(&pose);
        }
    }
    for point in window.point_handles() {
        if let Ok(position) = window.position(point) {
            sink.finite(&position);
        }
        if let Ok(observations) = window.observations_of(point) {
            for (_, pixel) in observations {
                sink.finite(&pixel);
            }
        }
    }
    window.clear();
    sink.count(window.frame_count());
}

/// A few of everything that a window can be asked, in an order that the bytes choose.
fn act<T: Real>(
    window: &mut Window<'_, T>,
    frames: &[Option<FrameHandle>],
    points: &[Option<PointHandle>],
    source: &mut Source<'_>,
    sink: &mut Sink,
) {
    for _ in 0..source.below(16) {
        let frame = frames.get(source.below(FRAMES)).copied().flatten();
        let other = frames.get(source.below(FRAMES)).copied().flatten();
        let point = points.get(source.below(POINTS)).copied().flatten();
        let (Some(frame), Some(other), Some(point)) = (frame, other, point) else { return };
        let mut options =
            BundleOptions::<T> { loss: any_loss(source), max_iterations: 4, ..Default::default() };
        options.unknowns = match source.below(3) {
            0 => Unknowns::FramesAndPoints,
            1 => Unknowns::Frames,
            _ => Unknowns::Points,
        };
        let loss = any_loss::<T>(source);
        let report = match source.below(20) {
            0 => Some(window.optimise_while(&options, |progress| progress.iterations < 2)),
            1 => Some(window.refine_frame(frame, &options)),
            2 => Some(window.refine_point(point, &options)),
            3 => {
                if let Ok(report) = window.point_report(point, source.positive()) {
                    sink.count(report.observations + report.outliers + report.behind);
                }
                None
            }
            4 => {
                sink.flag(window.fix_frame(frame, source.below(2) == 0).is_ok());
                None
            }
            5 => {
                sink.flag(window.fix_point(point, source.below(2) == 0).is_ok());
                None
            }
            6 => {
                sink.flag(window.set_pose(frame, &source.pose()).is_ok());
                None
            }
            7 => {
                sink.flag(window.set_position(point, &source.vector3()).is_ok());
                None
            }
            8 => {
                let prior = match source.below(3) {
                    0 => PosePrior::position(&source.vector3::<T>(), source.scalar()),
                    1 => PosePrior::rotation(&source.rotation::<T>(), source.scalar()),
                    _ => {
                        let root = source.matrix::<T, 6, 6>();
                        PosePrior::full(&source.pose(), &(root.transpose() * root))
                    }
                };
                sink.flag(window.set_pose_prior(frame, prior.ok()).is_ok());
                None
            }
            9 => {
                sink.flag(window.set_distance(frame, other, source.scalar(), source.scalar()).is_ok());
                None
            }
            10 => {
                sink.flag(window.remove_distance(frame).is_ok());
                None
            }
            11 => {
                sink.flag(window.remove_observation(frame, point).is_ok());
                None
            }
            12 => {
                sink.flag(window.remove_point(point).is_ok());
                None
            }
            13 => {
                sink.flag(window.remove_frame(frame).is_ok());
                None
            }
            14 => {
                if let Ok(gone) = window.marginalise_frame(frame, &loss) {
                    sink.count(gone);
                }
                sink.count(window.prior_frame_count());
                None
            }
            15 => {
                window.clear_prior();
                None
            }
            16 => {
                if let Ok(covariance) = window.frame_covariance(frame, &loss) {
                    sink.numbers(&covariance.pose);
                    sink.numbers(&covariance.centre);
                    sink.numbers(&covariance.motion);
                }
                None
            }
            17 => {
                if let Ok(covariance) = window.point_covariance(point, &loss) {
                    sink.numbers(&covariance);
                }
                None
            }
            _ => Some(window.optimise(&options)),
        };
        if let Some(Ok(report)) = report {
            sink.flag(report.changed);
            sink.numbers(&[report.cost_before, report.cost_after]);
            sink.flag(report.cost_after <= report.cost_before);
        }
    }
}
