//! `epipole::geometry`.

use epipole::geometry::cheirality::in_front_of_both;
use epipole::geometry::triangulation::{
    Triangulation, View, ViewPair, depth_sigma, point_covariance, refine_point, triangulate_dlt,
};
use epipole::geometry::{
    BrownConrady, Camera, CameraModel, Essential, Fundamental, Homography, KannalaBrandt, Pinhole,
    PlaneMotion, Pose, pose as p, residual,
};
use epipole::nalgebra::{Vector3, Vector6};
use epipole::{Real, real::lit};

use crate::{Sink, Source};

pub(crate) fn pose<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let (a, b) = (source.pose::<T>(), source.pose::<T>());
    let moved = p::retract(&a, &Vector6::from(source.array::<T, 6>()));
    sink.numbers(&moved.rotation.coords);
    sink.numbers(&moved.translation.vector);
    sink.numbers(&p::centre(&a));
    sink.numbers(&p::relative(&a, &b).translation.vector);
    sink.numbers(&p::from_parts(&source.rotation_matrix::<T>(), &source.vector3()).rotation.coords);
    sink.numbers(&Essential::from_pose(&a).0);
}

pub(crate) fn rotations<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let (w, v) = (source.vector3::<T>(), source.vector3::<T>());
    let q = source.rotation::<T>();
    sink.numbers(&p::exp(&w).coords);
    if let Some(turn) = p::upright(&w) {
        sink.finite(&turn);
    }
    sink.finite(&p::log(&q));
    sink.numbers(&p::left_jacobian(&w));
    sink.numbers(&p::skew(&w));
    sink.numbers(&p::tangent_basis(&v));
    sink.finite(&[p::rotation_angle(&q, &source.rotation())]);
    sink.number(p::vector_angle(&w, &v));
    sink.numbers(&p::quaternion_from_matrix(&source.rotation_matrix::<T>()).coords);
    let nearest = p::nearest_rotation(&source.matrix::<T, 3, 3>());
    sink.flag(nearest.is_some());
    if let Some(nearest) = nearest {
        sink.finite(&nearest);
    }
}

/// A pinhole camera of ordinary parameters, now and then of any.
fn camera<T: Real>(source: &mut Source<'_>) -> Option<Pinhole<T>> {
    let [fx, fy, cx, cy] = source.array::<T, 4>();
    let hundred = lit::<T>(100.0);
    Pinhole::new(fx * hundred, fy * hundred, cx * hundred, cy * hundred).ok()
}

fn model<T: Real>(camera: &impl CameraModel<T>, source: &mut Source<'_>, sink: &mut Sink) {
    sink.finite(&[camera.focal()]);
    if let Some((fx, fy)) = camera.rectilinear() {
        sink.finite(&[fx, fy]);
    }
    let point = source.vector3::<T>();
    if let Some(pixel) = camera.project(&point) {
        sink.finite(&pixel);
    }
    if let Some((pixel, jacobian)) = camera.project_with_jacobian(&point) {
        sink.finite(&pixel);
        sink.finite(&jacobian);
    }
    let pixel = source.vector2::<T>() * lit::<T>(100.0);
    if let Ok(bearing) = camera.unproject(&pixel) {
        sink.finite(&bearing);
    }
    if let Ok((bearing, jacobian)) = camera.unproject_with_jacobian(&pixel) {
        sink.finite(&bearing);
        sink.finite(&jacobian);
    }
    let pose = source.pose();
    if let Some(r) = residual::reprojection(camera, &pose, &point, &pixel) {
        sink.finite(&r);
    }
    if let Some(r) = residual::reprojection_with_jacobians(camera, &pose, &point, &pixel) {
        sink.finite(&r.residual);
        sink.finite(&r.by_pose);
        sink.finite(&r.by_point);
    }
}

pub(crate) fn pinhole<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let Some(camera) = camera::<T>(source) else { return };
    sink.finite(&[camera.fx(), camera.fy(), camera.cx(), camera.cy()]);
    sink.finite(&camera.matrix());
    sink.numbers(&camera.inverse_matrix());
    if let Some(jacobian) = camera.intrinsics_jacobian(&source.vector3()) {
        sink.finite(&jacobian);
    }
    model(&camera, source, sink);
}

pub(crate) fn brown_conrady<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let Some(pinhole) = camera::<T>(source) else { return };
    let scale = lit::<T>(0.1);
    let Ok(camera) = BrownConrady::new(pinhole, source.array::<T, 5>().map(|k| k * scale)) else { return };
    sink.finite(&camera.distortion());
    sink.number(camera.max_radius());
    sink.number(camera.pinhole().fx());
    if let Some(jacobian) = camera.intrinsics_jacobian(&source.vector3()) {
        sink.finite(&jacobian);
    }
    model(&camera, source, sink);
}

pub(crate) fn kannala_brandt<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let Some(pinhole) = camera::<T>(source) else { return };
    let scale = lit::<T>(0.1);
    let Ok(camera) = KannalaBrandt::new(pinhole, source.array::<T, 4>().map(|k| k * scale)) else { return };
    sink.finite(&camera.coefficients());
    sink.number(camera.max_angle());
    sink.number(camera.pinhole().fx());
    if let Some(jacobian) = camera.intrinsics_jacobian(&source.vector3()) {
        sink.finite(&jacobian);
    }
    model(&camera, source, sink);
}

/// One of the camera models.
pub(crate) fn any_camera_model<T: Real>(source: &mut Source<'_>) -> Option<Camera<T>> {
    let pinhole = camera::<T>(source)?;
    let scale = lit::<T>(0.1);
    match source.below(3) {
        0 => Some(pinhole.into()),
        1 => Some(BrownConrady::new(pinhole, source.array::<T, 5>().map(|k| k * scale)).ok()?.into()),
        _ => Some(KannalaBrandt::new(pinhole, source.array::<T, 4>().map(|k| k * scale)).ok()?.into()),
    }
}

pub(crate) fn any_camera<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let Some(camera) = any_camera_model::<T>(source) else { return };
    sink.number(camera.pinhole().fx());
    model(&camera, source, sink);
}

pub(crate) fn residuals<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let m = source.matrix::<T, 3, 3>();
    let (x1, x2) = (source.vector2::<T>(), source.vector2::<T>());
    let (b1, b2): (Vector3<T>, Vector3<T>) = (source.vector3(), source.vector3());
    let (j1, j2) = (source.matrix::<T, 3, 2>(), source.matrix::<T, 3, 2>());
    for r in [
        residual::sampson_bearing(&m, &b1, &b2, &j1, &j2),
        residual::sampson(&m, &x1, &x2),
        residual::symmetric_epipolar_sq(&m, &x1, &x2),
        residual::symmetric_transfer_sq(&m, &source.matrix(), &x1, &x2),
    ]
    .into_iter()
    .flatten()
    {
        sink.finite(&[r]);
    }
    if let Some((r, jacobian)) = residual::sampson_with_jacobian(&m, &x1, &x2) {
        sink.finite(&[r]);
        sink.finite(&jacobian);
    }
    if let Some(r) = residual::transfer(&m, &x1, &x2) {
        sink.finite(&r);
    }
    if let Some((r, jacobian)) = residual::transfer_with_jacobian(&m, &x1, &x2) {
        sink.finite(&r);
        sink.finite(&jacobian);
    }
}

fn triangulated<T: Real>(answer: Triangulation<T>, sink: &mut Sink) -> Option<Vector3<T>> {
    match answer {
        Triangulation::Point(point) => sink.finite(&point),
        Triangulation::Behind { point, view, count } => {
            sink.finite(&point);
            sink.count(view);
            sink.count(count);
        }
        Triangulation::AtInfinity { direction } => sink.finite(&direction),
        Triangulation::Undetermined => sink.flag(false),
    }
    answer.point()
}

pub(crate) fn two_view_triangulation<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let views = match source.below(2) {
        0 => ViewPair::new(&source.pose::<T>()),
        _ => ViewPair::from_parts(&source.rotation_matrix(), &source.vector3()),
    };
    sink.numbers(&views.centre());
    let (x1, x2) = (source.vector3::<T>(), source.vector3::<T>());
    let (j1, j2) = (source.matrix::<T, 3, 2>(), source.matrix::<T, 3, 2>());
    for answer in [
        views.triangulate_midpoint(&x1, &x2),
        views.triangulate_dlt(&x1, &x2),
        views.triangulate_optimal(&x1, &x2),
        views.triangulate_optimal_bearings(&x1, &x2, &j1, &j2),
    ] {
        if let Some(point) = triangulated(answer, sink) {
            sink.number(views.parallax(&point));
            if let Some(covariance) = views.covariance(&point, source.positive()) {
                sink.finite(&covariance);
                sink.number(depth_sigma(&covariance, &x1));
            }
        }
    }
}

pub(crate) fn many_view_triangulation<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let poses: [Pose<T>; 5] = core::array::from_fn(|_| source.pose());
    let bearings = source.vectors::<T, 5>();
    let pixels: [_; 5] = core::array::from_fn(|_| source.vector2::<T>());
    let n = source.below(6);
    let (Some(poses), Some(bearings), Some(pixels)) = (poses.get(..n), bearings.get(..n), pixels.get(..n))
    else {
        return;
    };
    let start = match triangulate_dlt(poses, bearings) {
        Ok(answer) => triangulated(answer, sink),
        Err(_) => None,
    };
    let Some(camera) = camera::<T>(source) else { return };
    let views: [_; 5] = core::array::from_fn(|k| View {
        camera: &camera,
        pose: poses.get(k).copied().unwrap_or_else(Pose::identity),
    });
    let refined = refine_point(views.get(..n).unwrap_or(&[]), pixels, &start.unwrap_or_else(Vector3::zeros));
    sink.flag(refined.is_ok());
    if let Ok(refined) = refined {
        sink.finite(&refined.point);
        sink.finite(&[refined.cost_px_sq]);
        sink.finite(refined.covariance_per_px_sq.iter().flatten());
        sink.count(refined.evaluations as usize);
    }
    let jacobians = [source.matrix::<T, 2, 3>(), source.matrix()];
    if let Some(covariance) = point_covariance(&jacobians, source.positive()) {
        sink.finite(&covariance);
    }
}

pub(crate) fn homography<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let h = Homography(source.matrix::<T, 3, 3>());
    let (k1, k2) = (source.matrix(), source.matrix());
    sink.flag(h.to_pixels(&k1, &k2).is_some());
    sink.flag(h.to_normalised(&k1, &k2).is_some());
    if let Some(point) = h.transfer(&source.vector2()) {
        sink.finite(&point);
    }
    if let Some(inverse) = h.inverse() {
        sink.finite(&inverse.0);
    }
    let motions = h.visible_motions(&source.vectors::<T, 3>());
    sink.count(motions.len());
    for motion in h.motions().iter().chain(&motions) {
        sink.finite_pose(&motion.pose);
        sink.finite(&motion.normal);
        sink.numbers(&PlaneMotion::homography(motion).0);
    }
}

pub(crate) fn fundamental<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let f = Fundamental(source.matrix::<T, 3, 3>());
    let x = source.vector3();
    sink.numbers(&f.line1(&x));
    sink.numbers(&f.line2(&x));
    for epipole in [f.epipole1(), f.epipole2()].iter().flatten() {
        sink.finite(epipole);
    }
    if let Some(nearest) = f.nearest() {
        sink.finite(&nearest.0);
    }
}

pub(crate) fn essential<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let e = match source.below(3) {
        0 => Essential(source.matrix::<T, 3, 3>()),
        _ => Essential::from_pose(&source.pose()),
    };
    let (k1, k2) = (source.matrix::<T, 3, 3>(), source.matrix::<T, 3, 3>());
    if let Some(f) = e.to_fundamental(&k1, &k2) {
        sink.numbers(&Essential::from_fundamental(&f, &k1, &k2).0);
    }
    let nearest = e.nearest();
    sink.flag(nearest.is_some());
    if let Some(nearest) = nearest {
        sink.finite(&nearest.0);
    }
    for pose in e.poses().iter().flatten() {
        sink.finite_pose(pose);
    }
    let (x1, x2) = (source.vectors::<T, 4>(), source.vectors::<T, 4>());
    if let Some(chosen) = e.pose_by_cheirality(&x1, &x2) {
        sink.finite_pose(&chosen.pose);
        sink.count(chosen.in_front);
        sink.count(chosen.runner_up);
    }
    if let Some(pair) = e.twisted_pair() {
        let pose = pair.pose_with_all_in_front(&x1, &x2);
        sink.flag(pose.is_some());
        if let Some(pose) = pose {
            sink.finite_pose(&pose);
        }
    }
    sink.flag(in_front_of_both(&source.pose(), &x1[0], &x2[0]));
}
