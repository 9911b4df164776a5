//! `epipole::solvers`.

use epipole::Real;
use epipole::nalgebra::Vector3;
use epipole::solvers as s;

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
    for e in &solutions {
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
