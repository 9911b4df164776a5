//! `epipole::estimate`.

use epipole::Real;
use epipole::estimate::{
    AbsolutePoseEstimate, AbsolutePoseOptions, AbsolutePoseStorage, AbsolutePoseVerdict,
    AbsolutePoseWorkspace, FundamentalEstimate, FundamentalOptions, GravityPrior, HomographyEstimate,
    HomographyOptions, HomographyVerdict, PriorFit, RelativePoseEstimate, RelativePoseOptions,
    RelativePosePrior, RelativePoseVerdict, TwoViewStorage, TwoViewWorkspace, WideAbsolutePoseStorage,
    WideTwoViewStorage, absolute_pose, absolute_pose_guided, fundamental, fundamental_guided, homography,
    homography_guided, refine_relative_pose, relative_pose, relative_pose_guided,
};
use epipole::geometry::{Camera, CameraModel};
use epipole::nalgebra::{Matrix3, Vector2};
use epipole::real::lit;
use epipole::robust::Guide;

use crate::geometry::any_camera_model;
use crate::robust::any_options;
use crate::{Sink, Source};

const N: usize = 24;

/// Pixels of two cameras: any numbers, or images of points under a motion with a few wrong ones, so that the whole way
/// to a verdict is gone.
fn pixels<T: Real>(
    source: &mut Source<'_>,
    camera1: &Camera<T>,
    camera2: &Camera<T>,
) -> ([Vector2<T>; N], [Vector2<T>; N]) {
    let hundred = lit::<T>(100.0);
    let any = |source: &mut Source<'_>| source.vector2::<T>() * hundred;
    let (mut x1, mut x2) = ([Vector2::zeros(); N], [Vector2::zeros(); N]);
    let pose = source.pose::<T>();
    let exact = source.below(4) > 0;
    for (a, b) in x1.iter_mut().zip(&mut x2) {
        (*a, *b) = (any(source), any(source));
        let mut point = epipole::nalgebra::Vector3::from(core::array::from_fn(|_| source.moderate::<T>()));
        point.z += lit(6.0);
        let wrong = source.below(8) == 0;
        if exact
            && !wrong
            && let Some(first) = camera1.project(&point)
            && let Some(second) = camera2.project(&(pose.rotation * point + pose.translation.vector))
        {
            (*a, *b) = (first, second);
        }
    }
    (x1, x2)
}

fn take<T: Real>(estimate: &RelativePoseEstimate<T>, sink: &mut Sink) {
    match &estimate.verdict {
        RelativePoseVerdict::General(motion) | RelativePoseVerdict::GeneralOrPlanar(motion) => {
            sink.count(0);
            sink.finite_pose(&motion.pose);
            sink.finite(motion.covariance.iter().flatten());
        }
        RelativePoseVerdict::Planar(poses) => {
            sink.count(1);
            for planar in poses {
                sink.finite_pose(&planar.pose);
                sink.finite(&planar.normal);
                sink.finite(&[planar.baseline_over_distance]);
                sink.finite(planar.covariance.iter().flatten());
            }
        }
        RelativePoseVerdict::PureRotation(rotation) => {
            sink.count(2);
            sink.finite(&rotation.rotation.coords);
            sink.finite(rotation.covariance.iter().flatten());
        }
        _ => sink.count(3),
    }
    if let Some(motion) = &estimate.general {
        sink.finite_pose(&motion.pose);
        sink.finite(motion.covariance.iter().flatten());
    }
    sink.flag(estimate.pose().is_some());
    sink.finite(&[estimate.noise_px, estimate.report.rival_share]);
    sink.count(estimate.report.inliers as usize);
    match estimate.prior {
        Some(PriorFit::Fits(by)) => sink.finite(&[by]),
        Some(PriorFit::Contradicted(by)) => sink.finite(&[by]),
        _ => sink.flag(false),
    }
}

fn relative<T: Real>(source: &mut Source<'_>, sink: &mut Sink, workspace: &mut TwoViewWorkspace<'_, T>) {
    let (Some(camera1), Some(camera2)) = (any_camera_model::<T>(source), any_camera_model::<T>(source))
    else {
        return;
    };
    let (x1, x2) = pixels(source, &camera1, &camera2);
    let n = source.below(N + 4);
    let (x1, x2) = (x1.get(..n).unwrap_or(&x1), x2.get(..n).unwrap_or(&x2));
    let mut options = RelativePoseOptions::default();
    options.ransac = any_options(source);
    if source.below(8) == 0 {
        options.max_error_px = source.scalar();
        options.sigma_px = Some(source.scalar());
    }
    options.prior = match source.below(4) {
        0 => {
            let [view1, view2] = source.vectors();
            Some(RelativePosePrior::Gravity { view1, view2, sigma_rad: source.positive() })
        }
        1 => {
            let spread: T = source.positive();
            Some(RelativePosePrior::Rotation {
                rotation: source.small_rotation(),
                covariance: Matrix3::identity() * (spread * spread * lit(1e-3))
                    + source.matrix() * lit::<T>(1e-3),
            })
        }
        _ => None,
    };
    options.planes = source.below(4) != 0;
    sink.count(workspace.capacity());
    sink.count(workspace.wide_capacity());
    if let Ok(estimate) = relative_pose(&camera1, &camera2, x1, x2, &options, workspace) {
        take(&estimate, sink);
    }
    let scores = source.array::<T, N>();
    let mut asked = 0;
    let mut keep_going = |_: &epipole::robust::Progress| {
        asked += 1;
        asked < 3
    };
    let guide = Guide { scores: scores.get(..x1.len()), keep_going: Some(&mut keep_going) };
    if let Ok(estimate) = relative_pose_guided(&camera1, &camera2, x1, x2, &options, guide, workspace) {
        take(&estimate, sink);
    }
    let start = source.pose();
    if let Ok(Some(motion)) = refine_relative_pose(&camera1, &camera2, x1, x2, &start, &options, workspace) {
        sink.finite_pose(&motion.pose);
        sink.finite(motion.covariance.iter().flatten());
    }
    for &inlier in workspace.inliers() {
        sink.flag(inlier);
    }
}

pub(crate) fn two_view_relative_pose<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    match source.below(3) {
        0 => relative(source, sink, &mut TwoViewStorage::<T, N>::new().workspace()),
        1 => relative(source, sink, &mut WideTwoViewStorage::<T, N>::new().workspace()),
        _ => {
            let (mut numbers, mut order, mut inliers) = ([T::ZERO; 100], [0; 30], [false; 25]);
            let n = source.below(100);
            let numbers = numbers.get_mut(..n).unwrap_or(&mut []);
            relative(source, sink, &mut TwoViewWorkspace::from_slices(numbers, &mut order, &mut inliers));
        }
    }
}

pub(crate) fn two_view_matrices<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let (Some(camera1), Some(camera2)) = (any_camera_model::<T>(source), any_camera_model::<T>(source))
    else {
        return;
    };
    let (x1, x2) = pixels(source, &camera1, &camera2);
    let n = source.below(N + 4);
    let (x1, x2) = (x1.get(..n).unwrap_or(&x1), x2.get(..n).unwrap_or(&x2));
    let mut storage = TwoViewStorage::<T, N>::new();
    let mut workspace = storage.workspace();
    let mut options = FundamentalOptions::default();
    options.ransac = any_options(source);
    let scores = source.array::<T, N>();
    let guide = || Guide { scores: scores.get(..x1.len()), keep_going: None };
    for estimate in [
        fundamental(x1, x2, &options, &mut workspace),
        fundamental_guided(x1, x2, &options, guide(), &mut workspace),
    ]
    .iter()
    .flatten()
    {
        sink.finite(&[estimate.noise_px]);
        if let Some(f) = FundamentalEstimate::fundamental(estimate) {
            sink.finite(&f.0);
        }
    }
    let mut options = HomographyOptions::default();
    options.ransac = any_options(source);
    for estimate in [
        homography(x1, x2, &options, &mut workspace),
        homography_guided(x1, x2, &options, guide(), &mut workspace),
    ]
    .iter()
    .flatten()
    {
        sink.finite(&[estimate.noise_px]);
        if let HomographyVerdict::Found(found) = &estimate.verdict {
            sink.finite(&found.homography.0);
            sink.finite(found.corners.iter().flatten());
            sink.finite(found.covariance.iter().flatten());
        }
        sink.flag(HomographyEstimate::homography(estimate).is_some());
    }
    for &inlier in workspace.inliers() {
        sink.flag(inlier);
    }
}

fn pose_of_points<T: Real>(
    source: &mut Source<'_>,
    sink: &mut Sink,
    workspace: &mut AbsolutePoseWorkspace<'_, T>,
) {
    let Some(camera) = any_camera_model::<T>(source) else { return };
    let mut points = source.vectors::<T, N>();
    let (mut x, _) = pixels(source, &camera, &camera);
    if source.below(4) > 0 {
        let pose = source.pose::<T>();
        let flat = source.below(3) == 0;
        for (pixel, point) in x.iter_mut().zip(&mut points) {
            if flat {
                point.z = T::ZERO;
            }
            let inside = pose.rotation * *point + pose.translation.vector;
            if let Some(seen) = camera.project(&inside) {
                *pixel = seen;
            }
        }
    }
    let n = source.below(N + 4);
    let (x, points) = (x.get(..n).unwrap_or(&x), points.get(..n).unwrap_or(&points));
    let mut options = AbsolutePoseOptions::default();
    options.ransac = any_options(source);
    if source.below(2) == 0 {
        let [world, camera] = source.vectors();
        options.gravity = Some(GravityPrior { world, camera, sigma_rad: source.positive() });
    }
    sink.count(workspace.capacity() + workspace.wide_capacity());
    let scores = source.array::<T, N>();
    let guide = Guide { scores: scores.get(..x.len()), keep_going: None };
    for estimate in [
        absolute_pose(&camera, x, points, &options, workspace),
        absolute_pose_guided(&camera, x, points, &options, guide, workspace),
    ]
    .iter()
    .flatten()
    {
        sink.finite(&[estimate.noise_px]);
        sink.flag(AbsolutePoseEstimate::pose(estimate).is_some());
        let found: &[_] = match &estimate.verdict {
            AbsolutePoseVerdict::Pose(pose) => core::slice::from_ref(pose),
            AbsolutePoseVerdict::PlanarAmbiguity(poses) => poses,
            _ => &[],
        };
        for found in found {
            sink.finite_pose(&found.pose);
            sink.finite(found.covariance.iter().flatten());
            sink.finite(&[found.rms_px]);
        }
    }
    for &inlier in workspace.inliers() {
        sink.flag(inlier);
    }
}

pub(crate) fn absolute<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    match source.below(3) {
        0 => pose_of_points(source, sink, &mut AbsolutePoseStorage::<T, N>::new().workspace()),
        1 => pose_of_points(source, sink, &mut WideAbsolutePoseStorage::<T, N>::new().workspace()),
        _ => {
            let (mut numbers, mut order, mut inliers) = ([T::ZERO; 200], [0; 30], [false; 25]);
            let n = source.below(200);
            let numbers = numbers.get_mut(..n).unwrap_or(&mut []);
            pose_of_points(
                source,
                sink,
                &mut AbsolutePoseWorkspace::from_slices(numbers, &mut order, &mut inliers),
            );
        }
    }
}
