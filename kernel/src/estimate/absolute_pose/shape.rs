//! Whether the inliers fix a pose: distinct points, off one line, off one plane.

use nalgebra::{Matrix3, Vector3};

use super::hypothesis::PoseProblem;
use crate::Real;
use crate::linalg::symmetric_eigen;
use crate::real::{from_u32, lit, max, sqrt};
use crate::refine::reprojection::{CameraPose, ReprojectionBlock};

/// What the inliers' points look like.
pub(super) enum Shape<T: Real> {
    /// Fewer than four distinct points.
    Repeated,
    /// All, or all but two, on one line to within what the pixels resolve.
    Line,
    /// Flat: a second pose may fit as well.
    Flat {
        /// Where to look for it.
        twin: CameraPose<T>,
    },
    /// None of these.
    Volume,
}

/// Thickness over width below which a second pose is looked for.
const FLAT: f64 = 0.1;

pub(super) fn shape_of_inliers<T: Real, B: ReprojectionBlock<T>>(
    problem: &PoseProblem<'_, T, B>,
    pose: &CameraPose<T>,
) -> Shape<T> {
    let mut distinct: [Option<Vector3<T>>; 4] = [None; 4];
    let mut largest = T::ZERO;
    problem.for_each_inlier(pose, |x| largest = max(x.norm_squared(), largest));
    let tiny = largest * (T::EPSILON * T::EPSILON * lit::<T>(64.0));
    problem.for_each_inlier(pose, |x| {
        for slot in &mut distinct {
            match slot {
                Some(known) if (*known - x).norm_squared() <= tiny => return,
                Some(_) => {}
                None => {
                    *slot = Some(x);
                    return;
                }
            }
        }
    });
    if distinct[3].is_none() {
        return Shape::Repeated;
    }

    // The line through the inliers, without those that are far from a first one.
    let all = Axes::of(problem, pose, None);
    let reach = lit::<T>(4.0) * all.values[1] / from_u32(core::cmp::max(all.count, 1)) + tiny;
    let trimmed = Axes::of(problem, pose, Some((&all, reach)));
    let line = if trimmed.count > 4 { trimmed } else { all };
    let focal = (problem.focal[0] + problem.focal[1]) * T::HALF;
    let mut off = 0u32;
    problem.for_each_inlier(pose, |x| {
        let depth_sq = (pose.rotation * x + pose.translation).norm_squared();
        let resolved = problem.threshold / focal;
        off += (line.off_line_sq(&x) > resolved * resolved * depth_sq) as u32;
    });
    if off <= 2 && line.count > 4 {
        return Shape::Line;
    }

    if all.values[2] < lit::<T>(FLAT * FLAT) * all.values[1] {
        return Shape::Flat { twin: twin(pose, &all) };
    }
    Shape::Volume
}

/// Where the second pose of a plane is: its normal mirrored in the line of sight to the middle of the points.
fn twin<T: Real>(pose: &CameraPose<T>, plane: &Axes<T>) -> CameraPose<T> {
    let middle = pose.rotation * plane.mean + pose.translation;
    let sight = middle * (T::ONE / sqrt(middle.norm_squared()));
    let mirror = |n: &Vector3<T>| Matrix3::identity() - n * n.transpose() * T::TWO;
    let rotation = mirror(&sight) * pose.rotation * mirror(&plane.normal);
    CameraPose { rotation, translation: middle - rotation * plane.mean }
}

/// Mean and principal axes of points.
#[derive(Clone, Copy)]
struct Axes<T: Real> {
    mean: Vector3<T>,
    /// Eigenvalues of the scatter, largest first.
    values: Vector3<T>,
    direction: Vector3<T>,
    normal: Vector3<T>,
    count: u32,
}

impl<T: Real> Axes<T> {
    /// Of the inliers, or of those whose squared distance from a line is no larger than a limit.
    fn of<B: ReprojectionBlock<T>>(
        problem: &PoseProblem<'_, T, B>,
        pose: &CameraPose<T>,
        near: Option<(&Self, T)>,
    ) -> Self {
        let counts = |x: &Vector3<T>| near.is_none_or(|(line, limit)| line.off_line_sq(x) <= limit);
        let (mut sum, mut count) = (Vector3::zeros(), 0u32);
        problem.for_each_inlier(pose, |x| {
            if counts(&x) {
                sum += x;
                count += 1;
            }
        });
        let mean = sum * (T::ONE / from_u32(core::cmp::max(count, 1)));
        let mut scatter = Matrix3::zeros();
        problem.for_each_inlier(pose, |x| {
            if counts(&x) {
                let d = x - mean;
                scatter += d * d.transpose();
            }
        });
        let (mut values, mut direction, mut normal) = (Vector3::zeros(), Vector3::x(), Vector3::z());
        if let Some(eigen) = symmetric_eigen(&scatter) {
            values = eigen.values.map(|v| max(v, T::ZERO));
            direction = eigen.vectors.column(0).into_owned();
            normal = eigen.vectors.column(2).into_owned();
        }
        Self { mean, values, direction, normal, count }
    }

    fn off_line_sq(&self, x: &Vector3<T>) -> T {
        let d = x - self.mean;
        (d - self.direction * self.direction.dot(&d)).norm_squared()
    }
}
