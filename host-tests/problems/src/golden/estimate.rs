//! `epipole::estimate` and `epipole::refine` on noisy scenes with wrong matches.

use epipole::estimate::{
    AbsolutePoseOptions, AbsolutePoseStorage, AbsolutePoseVerdict, FundamentalOptions, GravityPrior,
    HomographyOptions, RelativePoseEstimate, RelativePoseOptions, RelativePoseVerdict, TwoViewStorage,
    WideTwoViewStorage, absolute_pose, fundamental, homography, refine_relative_pose, relative_pose,
};
use epipole::geometry::{Camera, CameraModel, Pinhole};
use epipole::nalgebra::{Vector2, Vector3};
use epipole::refine::{RefineAbsolutePoseOptions, absolute_pose as refine_absolute_pose};
use epipole::robust::RansacOptions;
use epipole::{Real, real::lit};
use epipole_exercise::Sink;

use super::geometry::models;
use crate::two_view::FOCAL;
use crate::{Geometry, TwoView};

const N: usize = 60;

/// So few samples that a core without an FPU ends in seconds.
fn few_samples<T: Real>() -> RansacOptions<T> {
    let mut options = RansacOptions::default();
    options.budget.max_iterations = 60;
    options
}

fn pinhole<T: Real>() -> Option<Camera<T>> {
    let focal = lit::<T>(FOCAL);
    Some(Pinhole::new(focal, focal, T::ZERO, T::ZERO).ok()?.into())
}

/// Pixels of both views in a camera of any model.
fn pixels<T: Real>(scene: &TwoView<N>, camera: &Camera<T>) -> [[Vector2<T>; N]; 2] {
    let pixel = |x: &Vector2<f64>| {
        let ray = Vector3::new(lit(x.x), lit(x.y), T::ONE);
        camera.project(&ray).unwrap_or_else(Vector2::zeros)
    };
    [&scene.x1, &scene.x2].map(|x| x.map(|x| pixel(&x)))
}

fn verdict<T: Real>(estimate: &RelativePoseEstimate<T>, sink: &mut Sink) {
    match &estimate.verdict {
        RelativePoseVerdict::General(motion) | RelativePoseVerdict::GeneralOrPlanar(motion) => {
            sink.finite_pose(&motion.pose);
            sink.finite(motion.covariance.iter().flatten());
        }
        RelativePoseVerdict::Planar(poses) => {
            for planar in poses {
                sink.finite_pose(&planar.pose);
                sink.finite(&planar.normal);
                sink.finite(planar.covariance.iter().flatten());
            }
        }
        RelativePoseVerdict::PureRotation(rotation) => {
            sink.finite(&rotation.rotation.coords);
            sink.finite(rotation.covariance.iter().flatten());
        }
        _ => sink.count(9),
    }
    if let Some(motion) = &estimate.general {
        sink.finite_pose(&motion.pose);
        sink.finite(motion.covariance.iter().flatten());
    }
    sink.finite(&[estimate.noise_px]);
    sink.count(estimate.report.inliers as usize);
    sink.count(estimate.report.spent.iterations as usize);
}

pub(super) fn relative_pose_of_views<T: Real>(sink: &mut Sink) {
    let mut options = RelativePoseOptions::default();
    options.max_error_px = T::TWO;
    options.ransac = few_samples();
    for geometry in [Geometry::Ransac, Geometry::Upright, Geometry::Planar] {
        let scene = TwoView::new(geometry, 0);
        for camera in models::<T>().iter().flatten() {
            let [x1, x2] = pixels(&scene, camera);
            let mut storage = WideTwoViewStorage::<T, N>::new();
            let mut workspace = storage.workspace();
            if let Ok(estimate) = relative_pose(camera, camera, &x1, &x2, &options, &mut workspace) {
                verdict(&estimate, sink);
            }
            for &inlier in workspace.inliers() {
                sink.flag(inlier);
            }
        }
    }
    // A camera that only turned, and one that stood still.
    let (scene, Some(camera)) = (TwoView::<N>::new(Geometry::Ransac, 1), pinhole::<T>()) else { return };
    let [x1, _] = scene.pixels::<T>();
    let rotation = scene.pose::<T>().rotation;
    let turned =
        x1.map(|x| camera.project(&(rotation * Vector3::new(x.x / lit(FOCAL), x.y / lit(FOCAL), T::ONE))));
    let turned = turned.map(|x| x.unwrap_or_else(Vector2::zeros));
    let mut storage = TwoViewStorage::<T, N>::new();
    for x2 in [turned, x1] {
        if let Ok(found) = relative_pose(&camera, &camera, &x1, &x2, &options, &mut storage.workspace()) {
            verdict(&found, sink);
        }
    }
}

pub(super) fn homography_of_plane<T: Real>(sink: &mut Sink) {
    let mut options = HomographyOptions::default();
    options.ransac = few_samples();
    for k in 0..4 {
        let scene = TwoView::<N>::new(Geometry::Planar, k).spoiled();
        let [x1, x2] = scene.pixels::<T>();
        let mut storage = TwoViewStorage::<T, N>::new();
        let found = homography(&x1, &x2, &options, &mut storage.workspace());
        if let Ok(found) = found {
            sink.finite(found.homography().iter().flat_map(|h| &h.0));
            sink.finite(&[found.noise_px]);
            sink.count(found.report.inliers as usize);
        }
    }
}

pub(super) fn fundamental_of_views<T: Real>(sink: &mut Sink) {
    let mut options = FundamentalOptions::default();
    options.ransac = few_samples();
    for k in 0..4 {
        let scene = TwoView::<N>::new(Geometry::Ransac, k);
        let [x1, x2] = scene.pixels::<T>();
        let mut storage = TwoViewStorage::<T, N>::new();
        let found = fundamental(&x1, &x2, &options, &mut storage.workspace());
        if let Ok(found) = found {
            sink.finite(found.fundamental().iter().flat_map(|f| &f.0));
            sink.finite(&[found.noise_px]);
            sink.count(found.report.inliers as usize);
        }
    }
}

pub(super) fn absolute_pose_of_points<T: Real>(sink: &mut Sink) {
    let Some(camera) = pinhole::<T>() else { return };
    for k in 0..4 {
        let scene = TwoView::<N>::new(Geometry::Ransac, k);
        let [_, x2] = scene.pixels::<T>();
        let mut options = AbsolutePoseOptions::default();
        if k % 2 == 1 {
            let world = Vector3::y();
            options.gravity = Some(GravityPrior {
                world,
                camera: scene.pose::<T>().rotation * world,
                sigma_rad: lit(0.01),
            });
        }
        let mut storage = AbsolutePoseStorage::<T, N>::new();
        let found = absolute_pose(&camera, &x2, &scene.points::<T, N>(), &options, &mut storage.workspace());
        if let Ok(found) = found {
            if let AbsolutePoseVerdict::Pose(pose) = &found.verdict {
                sink.finite(pose.covariance.iter().flatten());
                sink.finite(&[pose.rms_px]);
            }
            sink.finite_pose(&found.pose().unwrap_or_default());
            sink.count(found.report.inliers as usize);
        }
    }
}

pub(super) fn refine<T: Real>(sink: &mut Sink) {
    let Some(camera) = pinhole::<T>() else { return };
    for k in 0..4 {
        let scene = TwoView::<N>::new(Geometry::Ransac, k);
        let [x1, x2] = scene.pixels::<T>();
        let start = epipole::geometry::pose::retract(
            &scene.pose::<T>(),
            &epipole::nalgebra::Vector6::from([0.004, -0.003, 0.005, 0.01, 0.02, -0.01].map(lit::<T>)),
        );
        let mut storage = TwoViewStorage::<T, N>::new();
        let mut options = RelativePoseOptions::default();
        options.max_error_px = T::TWO + T::TWO;
        let found =
            refine_relative_pose(&camera, &camera, &x1, &x2, &start, &options, &mut storage.workspace());
        for motion in found.iter().flatten() {
            sink.finite_pose(&motion.pose);
            sink.finite(motion.covariance.iter().flatten());
        }
        let points = scene.points::<T, N>();
        let found =
            refine_absolute_pose(&camera, &x2, &points, &start, &RefineAbsolutePoseOptions::default());
        if let Ok(found) = found {
            sink.finite_pose(&found.pose);
            sink.finite(found.covariance.iter().flatten());
            sink.finite(&[found.cost]);
        }
    }
}
