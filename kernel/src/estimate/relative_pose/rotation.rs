//! A camera that turns on the spot or does not move: when, and the verdict.

use nalgebra::{Matrix3, Vector3};

use super::super::chance::EXPLAINED_SIGMAS;
use super::covariance::{covariance, variance};
use super::evidence::{Evidence, Explained};
use super::judge::Judge;
use super::verdict::{PureRotation, RelativePoseEstimate, RelativePoseVerdict};
use crate::Real;
use crate::geometry::pose::from_parts;
use crate::real::{from_u32, lit, sqrt};
use crate::refine::blocks::EpipolarBlock;
use crate::refine::homography::RotationModel;
use crate::refine::lm::Manifold;
use crate::robust::loss::Loss;

/// Of a scene that stands still at the most one inlier in as many moves by twice the least motion.
const MOVED_ONE_IN: u32 = 10;

impl<T: Real, B: EpipolarBlock<T>> Judge<'_, '_, T, B> {
    /// The rotation of a camera that does not turn.
    #[cfg_attr(small, inline(never))]
    fn still(&self) -> RotationModel<T> {
        RotationModel { rotation: Matrix3::identity(), scales: self.problem.scales }
    }

    /// True where at least half of all correspondences are displaced by less than the least motion of interest, and hardly
    /// any inlier of the pose by more than twice as much.
    pub(super) fn hardly_moves(&self, evidence: &Evidence<'_, '_, T, B>) -> bool {
        let still = self.still().matrix();
        let sigma = self.least_motion / lit(EXPLAINED_SIGMAS);
        if !(sigma > T::ZERO) {
            return false;
        }
        if 2 * evidence.explained_within(&still, sigma).all < self.problem.data.count as u32 {
            return false;
        }
        let far = evidence.explained_within(&still, sigma * T::TWO);
        MOVED_ONE_IN * far.others <= far.inliers + far.others
    }

    /// True where a rotation moves the points by no more than the noise.
    pub(super) fn stands_still(&self, evidence: &Evidence<'_, '_, T, B>, turned: &Explained<T>) -> bool {
        let explained = evidence.explained(&self.still().matrix());
        // Nine in ten of what the rotation explains, with a mean square of the motion below the noise's.
        let moved = explained.squares - turned.squares;
        10 * explained.inliers >= 9 * turned.inliers && moved <= from_u32::<T>(explained.inliers) * T::TWO
    }

    /// A refined rotation, or no motion.
    pub(super) fn turned(
        &self,
        rotation: Option<&RotationModel<T>>,
        sigma: T,
        mask: &mut [bool],
        estimate: &mut RelativePoseEstimate<T>,
    ) {
        let problem = self.transfer_problem(sigma * lit(EXPLAINED_SIGMAS));
        let loss = Loss::Truncated(problem.threshold);
        let passes = if rotation.is_some() { 8 } else { 1 };
        let model = rotation.map_or_else(|| self.still(), |rotation| *rotation);
        let minimum = problem.optimise(&model, &loss, passes, lit(1e-6));
        self.mark_transfer(&minimum.model.matrix(), mask);
        let limit = problem.threshold * problem.threshold;
        let variance = variance(&minimum.equations, problem.data.count, limit, 2);
        estimate.noise_px = sqrt(variance);
        estimate.verdict = if rotation.is_none() {
            RelativePoseVerdict::NoMotion
        } else {
            RelativePoseVerdict::PureRotation(PureRotation {
                rotation: from_parts(&minimum.model.rotation, &Vector3::zeros()).rotation,
                covariance: covariance(&minimum.equations, variance),
            })
        };
    }
}
