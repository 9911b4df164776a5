//! A plane among the inliers: its homography, the two motions that explain it, and the verdict on a planar scene.

use nalgebra::Vector3;

use super::super::chance::EXPLAINED_SIGMAS;
use super::covariance::{planar_covariance, variance};
use super::judge::{Judge, Judgement, pose_model};
use super::verdict::{PlanarPose, RelativePoseVerdict};
use crate::geometry::{Homography, Pose};
use crate::linalg::LANES;
use crate::real::{lit, sqrt};
use crate::refine::blocks::EpipolarBlock;
use crate::refine::homography::{HomographyModel, transfer_sq};
use crate::robust::loss::Loss;
use crate::robust::{Budget, RansacOptions, ransac};
use crate::{Real, Solutions};

/// A plane is looked for with the threshold of this many standard deviations.
const PLANE_SIGMAS: f64 = 3.5;

/// One motion that explains a homography.
#[derive(Clone, Copy, Debug)]
pub(super) struct Twin<T: Real> {
    /// The pose, |t| = 1.
    pub(super) pose: Pose<T>,
    /// The plane's normal in view 1, away from the camera.
    normal: Vector3<T>,
    /// |t| over the plane's distance.
    ratio: T,
    /// Cost of the pose over all correspondences.
    cost: T,
}

impl<T: Real, B: EpipolarBlock<T>> Judge<'_, '_, T, B> {
    /// The plane that holds the most inliers, refined.
    pub(super) fn plane(&self, inliers: &[u32], sigma: T) -> Option<HomographyModel<T>> {
        let problem = self.transfer_problem(sigma * lit(PLANE_SIGMAS), Some(inliers));
        let budget = Budget { max_iterations: 60, ..Budget::default() };
        let options = RansacOptions { seed: self.seed, confidence: lit(0.99), min_iterations: 10, budget };
        let (model, _) = ransac(&problem, &options, None, 8, None).models[0]?;
        let loss = Loss::Truncated(problem.threshold);
        HomographyModel::new(&problem.optimise(&model, &loss, 8, lit(1e-6)).model.0)
    }

    /// The up to two motions of a plane that keep its points in front of both cameras, the more likely one first.
    pub(super) fn twins(&self, plane: &HomographyModel<T>) -> Solutions<Twin<T>, 2> {
        let h = Homography(self.problem.scales.transfer_back(&plane.0));
        let mut found: [Option<Twin<T>>; 2] = [None; 2];
        for motion in &h.motions() {
            let t = motion.pose.translation.vector;
            let length = sqrt(t.norm_squared());
            // The normal points away from the camera for points in front of it.
            if !(length > T::ZERO) || !self.visible(plane, &motion.normal) {
                continue;
            }
            let pose = Pose::from_parts((t * (T::ONE / length)).into(), motion.pose.rotation);
            let cost = self.cost(&pose_model(&pose, self.problem));
            let mut moving = Some(Twin { pose, normal: motion.normal, ratio: length, cost });
            for place in &mut found {
                let cost = moving.map_or(T::MAX, |twin| twin.cost);
                if place.is_none_or(|kept| cost < kept.cost) {
                    core::mem::swap(place, &mut moving);
                }
            }
        }
        let mut twins = Solutions::new();
        for twin in found.into_iter().flatten() {
            twins.push(twin);
        }
        twins
    }

    /// True where most of a plane's inliers see the plane's normal point away.
    fn visible(&self, plane: &HomographyModel<T>, normal: &Vector3<T>) -> bool {
        let limit = self.problem.threshold * self.problem.threshold * T::TWO;
        let (mut ahead, mut behind) = (0u32, 0u32);
        let mut left = self.problem.data.count;
        let s = self.problem.scales.inverse1();
        for block in self.problem.data.blocks {
            let (points, weight) = block.planes();
            let squared = transfer_sq(&plane.0, &points, &weight);
            for l in 0..LANES {
                if l < left && squared[l] < limit {
                    let side = normal.x * points[0][l] * s[0] + normal.y * points[1][l] * s[1] + normal.z;
                    ahead += (side > T::ZERO) as u32;
                    behind += (side <= T::ZERO) as u32;
                }
            }
            left = left.saturating_sub(LANES);
        }
        ahead > behind
    }

    /// The verdict on a planar scene.
    pub(super) fn planar(
        &self,
        plane: &HomographyModel<T>,
        twins: Solutions<Twin<T>, 2>,
        sigma: T,
        mask: &mut [bool],
    ) -> Judgement<T> {
        let problem = self.transfer_problem(sigma * lit(EXPLAINED_SIGMAS), None);
        let loss = Loss::Truncated(problem.threshold);
        let sums = problem.optimise(plane, &loss, 1, T::ZERO).equations;
        let limit = problem.threshold * problem.threshold;
        let variance = variance(&sums, problem.data.count, limit, 2);
        let mut poses = Solutions::new();
        for &Twin { pose, normal, ratio, .. } in &twins {
            let rotation = pose.rotation.to_rotation_matrix().into_inner();
            let t = pose.translation.vector * ratio;
            let scales = &self.problem.scales;
            let covariance = planar_covariance(&rotation, &t, &normal, plane, &sums, scales, variance);
            poses.push(PlanarPose { pose, normal, baseline_over_distance: ratio, covariance });
        }
        self.mark_transfer(&plane.0, mask);
        Judgement { verdict: RelativePoseVerdict::Planar(poses), noise: sqrt(variance) }
    }
}
