//! `epipole::bundle`: a window driven by random calls in random order, with handles that may be stale.

use epipole::bundle::{
    BundleOptions, BundleReport, FrameHandle, PointHandle, PosePrior, Unknowns, WindowStorage, scalars_len,
};
use epipole::geometry::{Camera, Pinhole};
use epipole::nalgebra::Matrix6;
use epipole::robust::loss::Loss;
use epipole::{Real, real::lit};

use crate::{Sink, Source};

const FRAMES: usize = 4;
const POINTS: usize = 8;
const SCALARS: usize = scalars_len(FRAMES);

fn camera<T: Real>(source: &mut Source<'_>) -> Option<Camera<T>> {
    let focal = lit::<T>(100.0) * source.positive();
    Some(Pinhole::new(focal, focal, source.moderate(), source.moderate()).ok()?.into())
}

fn loss<T: Real>(source: &mut Source<'_>) -> Loss<T> {
    let scale = source.positive();
    match source.below(5) {
        0 => Loss::Squared,
        1 => Loss::Cauchy(scale),
        2 => Loss::Tukey(scale),
        3 => Loss::GemanMcClure(scale),
        _ => Loss::Huber(scale),
    }
}

fn report<T: Real>(report: &BundleReport<T>, sink: &mut Sink) {
    sink.flag(report.changed);
    sink.count(report.iterations as usize);
    sink.number(report.cost_before);
    sink.number(report.cost_after);
}

pub(crate) fn random_calls<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let mut storage = WindowStorage::<T, FRAMES, POINTS, 24, SCALARS>::new();
    let mut window = storage.window();
    let mut frames: [Option<FrameHandle>; 6] = [None; 6];
    let mut points: [Option<PointHandle>; 12] = [None; 12];
    for _ in 0..48 {
        let (action, f, p) = (source.below(22), source.below(6), source.below(12));
        let frame = frames.get(f).copied().flatten();
        let point = points.get(p).copied().flatten();
        let options = BundleOptions {
            loss: loss(source),
            max_iterations: 3,
            unknowns: match source.below(3) {
                0 => Unknowns::Frames,
                1 => Unknowns::Points,
                _ => Unknowns::FramesAndPoints,
            },
            ..BundleOptions::default()
        };
        match (action, frame, point) {
            (0..=2, ..) => {
                if let Some(camera) = camera(source)
                    && let Some(slot) = frames.get_mut(f)
                {
                    *slot = window.add_frame(camera, &source.pose()).ok().or(*slot);
                }
            }
            (3..=5, ..) => {
                if let Some(slot) = points.get_mut(p) {
                    *slot = window.add_point(&source.vector3()).ok().or(*slot);
                }
            }
            (6..=10, Some(frame), Some(point)) => {
                let sigma = source.positive();
                sink.flag(window.add_observation(frame, point, &source.vector2(), sigma).is_ok());
            }
            (11, Some(frame), _) => sink.flag(window.remove_frame(frame).is_ok()),
            (12, _, Some(point)) => sink.flag(window.remove_point(point).is_ok()),
            (13, Some(frame), Some(point)) => sink.flag(window.remove_observation(frame, point).is_ok()),
            (14, Some(frame), _) => {
                sink.flag(window.fix_frame(frame, source.byte() & 1 == 0).is_ok());
                sink.flag(window.set_pose(frame, &source.pose()).is_ok());
            }
            (15, _, Some(point)) => {
                sink.flag(window.fix_point(point, source.byte() & 1 == 0).is_ok());
                sink.flag(window.set_position(point, &source.vector3()).is_ok());
                if let Ok(told) = window.point_report(point, lit(3.0)) {
                    sink.count(told.outliers);
                }
                if let Ok(told) = window.refine_point(point, &options) {
                    report(&told, sink);
                }
            }
            (16, Some(frame), _) => {
                let prior = match source.below(3) {
                    0 => PosePrior::position(&source.vector3(), source.positive()),
                    1 => PosePrior::rotation(&source.rotation(), source.positive()),
                    _ => PosePrior::full(&source.pose(), &Matrix6::from_diagonal_element(source.positive())),
                };
                sink.flag(window.set_pose_prior(frame, prior.ok()).is_ok());
                if let Some(Some(other)) = frames.first().copied() {
                    sink.flag(
                        window.set_distance(frame, other, source.positive(), source.positive()).is_ok(),
                    );
                }
            }
            (17, Some(frame), _) => sink.flag(window.marginalise_frame(frame, &options.loss).is_ok()),
            (18, Some(frame), Some(point)) => {
                sink.flag(window.marginalise_point(point, &options.loss).is_ok());
                sink.flag(window.remove_distance(frame).is_ok());
            }
            (19, Some(frame), Some(point)) => {
                if let Ok(told) = window.frame_covariance(frame, &options.loss) {
                    sink.numbers(&told.pose);
                }
                if let Ok(told) = window.point_covariance(point, &options.loss) {
                    sink.numbers(&told);
                }
            }
            (20, Some(frame), _) => {
                if let Ok(told) = window.refine_frame(frame, &options) {
                    report(&told, sink);
                }
            }
            _ => {
                if let Ok(told) = window.optimise_while(&options, |progress| progress.iterations < 2) {
                    report(&told, sink);
                }
            }
        }
        if action == 21 && source.byte() == 0 {
            window.clear_prior();
            window.clear();
        }
    }
    sink.count(window.frame_count() + window.point_count() + window.observation_count());
    sink.count(window.prior_frame_count() + window.frame_handles().count() + window.point_handles().count());
    // Whatever the calls, poses and positions stay finite.
    for frame in window.frame_handles() {
        if let Ok(pose) = window.pose(frame) {
            sink.finite(&pose.rotation.coords);
        }
    }
    for point in window.point_handles() {
        if let (Ok(x), Ok(seen)) = (window.position(point), window.observations_of(point)) {
            sink.finite(&x);
            sink.count(seen.count());
        }
    }
}
