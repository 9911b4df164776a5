//! `epipole::refine` on points that the caller holds.

use epipole::Real;
use epipole::geometry::{Fundamental, Homography};
use epipole::nalgebra::{Point3, SMatrix, Vector2};
use epipole::real::lit;
use epipole::refine::{RefineTwoViewOptions, fundamental, homography, relative_pose, relative_pose_jacobian};

use crate::robust::any_loss;
use crate::{Sink, Source};

const N: usize = 14;

pub(crate) fn two_views<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let pose = source.pose::<T>();
    let (mut x1, mut x2) = ([Vector2::zeros(); N], [Vector2::zeros(); N]);
    let exact = source.below(3) > 0;
    for (a, b) in x1.iter_mut().zip(&mut x2) {
        (*a, *b) = (source.vector2(), source.vector2());
        if exact {
            let seen = pose * Point3::new(a.x, a.y, T::ONE) * lit::<T>(3.0);
            *b = Vector2::new(seen.x / seen.z, seen.y / seen.z) + *b * lit::<T>(1e-3);
        }
    }
    let n = source.below(N + 1);
    let (x1, x2) = (x1.get(..n).unwrap_or(&x1), x2.get(..n).unwrap_or(&x2));
    let mut options = RefineTwoViewOptions::default();
    options.loss = any_loss(source);
    options.max_passes = source.below(20) as u32;
    let mut jacobians = [SMatrix::<T, 5, 4>::zeros(); N];
    let jacobians = jacobians.get_mut(..n).unwrap_or_default();
    if let Ok(Some(refined)) = relative_pose(x1, x2, &pose, &options) {
        sink.finite_pose(&refined.model);
        sink.number(refined.cost);
        if let Ok(found) = relative_pose_jacobian(&refined.model, x1, x2, jacobians) {
            sink.flag(found);
            jacobians.iter().for_each(|jacobian| sink.numbers(jacobian));
        }
    }
    if let Ok(Some(refined)) = homography(x1, x2, &Homography(source.matrix()), &options) {
        sink.finite(&refined.model.0);
        sink.number(refined.cost);
    }
    if let Ok(Some(refined)) = fundamental(x1, x2, &Fundamental(source.matrix()), &options) {
        sink.finite(&refined.model.0);
        sink.number(refined.cost);
    }
}
