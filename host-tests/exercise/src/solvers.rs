//! `epipole::solvers`.

use epipole::nalgebra::Vector3;
use epipole::solvers as s;
use epipole::{Real, Solutions};

use crate::{Sink, Source};

/// Correspondences: any vectors, or the images of points under a motion, so that solutions exist.
pub(crate) fn correspondences<T: Real, const N: usize>(
    source: &mut Source<'_>,
) -> ([Vector3<T>; N], [Vector3<T>; N]) {
    let x1 = source.vectors::<T, N>();
    if source.below(4) == 0 {
        return (x1, source.vectors());
    }
    let pose = source.pose::<T>();
    (x1, x1.map(|x| pose.rotation * x + pose.translation.vector))
}

pub(crate) fn relpose_5pt<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let (x1, x2) = correspondences::<T, 5>(source);
    let solutions = s::relpose_5pt(&x1, &x2);
    sink.count(solutions.len());
    for e in Solutions::as_slice(&solutions) {
        sink.finite(&e.0);
    }
    for pose in &s::relpose_5pt_poses(&x1, &x2) {
        sink.finite_pose(pose);
    }
    let single = |x: &[Vector3<T>; 5]| x.map(|v| v.map(|c| c.to_f64() as f32));
    for e in &s::relpose_5pt_wide(&single(&x1), &single(&x2)) {
        sink.finite(&e.0);
    }
}

pub(crate) fn relpose_7pt<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let (x1, x2) = correspondences::<T, 7>(source);
    let solutions = s::relpose_7pt(&x1, &x2);
    sink.count(solutions.len());
    for f in &solutions {
        sink.finite(&f.0);
    }
}

pub(crate) fn relpose_8pt<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let (x1, x2) = correspondences::<T, 11>(source);
    for n in [8, 7 + source.below(5)] {
        let (x1, x2) = (x1.get(..n).unwrap_or(&x1), x2.get(..n).unwrap_or(&x2));
        let e = s::relpose_8pt(x1, x2);
        sink.flag(e.is_ok());
        if let Ok(Some(e)) = e {
            sink.finite(&e.0);
        }
        let f = s::fundamental_8pt(x1, x2);
        sink.flag(f.is_ok());
        if let Ok(Some(f)) = f {
            sink.finite(&f.0);
        }
    }
}

pub(crate) fn homography<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let (x1, x2) = correspondences::<T, 4>(source);
    let h = s::homography_4pt(&x1, &x2);
    sink.flag(h.is_some());
    if let Some(h) = h {
        sink.finite(&h.0);
    }
    let (x1, x2) = correspondences::<T, 6>(source);
    let n = 3 + source.below(4);
    let h = s::homography_npt(x1.get(..n).unwrap_or(&x1), x2.get(..n).unwrap_or(&x2));
    sink.flag(h.is_ok());
    if let Ok(Some(h)) = h {
        sink.finite(&h.0);
    }
}

/// Bearings of points seen by a camera: any, or under a pose.
fn seen<T: Real, const N: usize>(source: &mut Source<'_>, points: &[Vector3<T>; N]) -> [Vector3<T>; N] {
    if source.below(4) == 0 {
        return source.vectors();
    }
    let pose = source.pose::<T>();
    points.map(|x| pose.rotation * x + pose.translation.vector)
}

pub(crate) fn absolute_minimal<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let points = source.vectors::<T, 3>();
    let bearings = seen(source, &points);
    for pose in &s::p3p(&bearings, &points) {
        sink.finite_pose(pose);
    }
    let points = source.vectors::<T, 2>();
    let bearings = seen(source, &points);
    for pose in &s::abspose_upright_2pt(&bearings, &points) {
        sink.finite_pose(pose);
    }
}

pub(crate) fn absolute_linear<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let points = source.vectors::<T, 8>();
    let bearings = seen(source, &points);
    let n = source.below(9);
    let (Some(p), Some(b)) = (points.get(..n), bearings.get(..n)) else { return };
    if let Ok(poses) = s::abspose_npt(b, p) {
        for pose in &poses {
            sink.finite_pose(pose);
        }
    }
    let flat = points.map(|x| x.xy());
    if let Ok(poses) = s::abspose_planar(b, flat.get(..n).unwrap_or(&flat)) {
        for planar in &poses {
            sink.finite_pose(&planar.pose);
            sink.finite(&[planar.rms_rad]);
        }
    }
    let pixels = bearings.map(|b| b.xy() / b.z);
    if let Ok(Some(projection)) = s::resection_dlt(pixels.get(..n).unwrap_or(&pixels), p) {
        sink.finite(&projection);
    }
    if let Some(parts) = s::decompose_projection(&source.matrix::<T, 3, 4>()) {
        sink.finite(&parts.calibration);
        sink.finite_pose(&parts.pose);
    }
    if let Ok(Some(pose)) = s::absolute_orientation_npt(b, p) {
        sink.finite_pose(&pose);
    }
    if let Ok(Some(similarity)) = s::absolute_orientation_with_scale_npt(b, p) {
        sink.finite_pose(&similarity.isometry);
        sink.finite(&[similarity.scaling()]);
    }
}

pub(crate) fn partial_motions<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let (x1, x2) = correspondences::<T, 3>(source);
    for pose in &s::relpose_upright_3pt(&x1, &x2) {
        sink.finite_pose(pose);
    }
    let rotation = source.rotation::<T>();
    let (x1, x2) = correspondences::<T, 2>(source);
    if let Some(rotation) = s::rotation_2pt(&x1, &x2) {
        sink.finite(&rotation.coords);
    }
    if let Some(translation) = s::translation_2pt(&rotation, &x1, &x2) {
        sink.finite(&translation);
    }
    let (x1, x2) = correspondences::<T, 6>(source);
    let n = source.below(7);
    let (x1, x2) = (x1.get(..n).unwrap_or(&x1), x2.get(..n).unwrap_or(&x2));
    if let Ok(Some(rotation)) = s::rotation_npt(x1, x2) {
        sink.finite(&rotation.coords);
    }
    if let Ok(Some(translation)) = s::translation_npt(&rotation, x1, x2) {
        sink.finite(&translation);
    }
}
