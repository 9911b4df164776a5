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
    /// True where at least half of all correspondences are displaced by less than the least motion of interest, and hardly
    /// any inlier of the pose by more than twice as much.
    pub(super) fn hardly_moves(&self, evidence: &Evidence<'_, '_, T, B>) -> bool {
        let still = RotationModel { rotation: Matrix3::identity(), scales: self.problem.scales }.matrix();
        let sigma = self.least_motion / lit(EXPLAINED_SIGMAS);
        if !(sigma > T::ZERO) {
            return false;
        }
        if 2 * (Evidence { sigma, ..*evidence }).explained(&still).all < self.problem.data.count as u32 {
            return false;
        }
        let far = Evidence { sigma: sigma * T::TWO, ..*evidence }.explained(&still);
        MOVED_ONE_IN * far.others <= far.inliers + far.others
    }

    /// True where a rotation moves the points by no more than the noise.
    pub(super) fn stands_still(
        &self,
        evidence: &Evidence<'_, '_, T, B>,
        rotation: &RotationModel<T>,
        turned: &Explained<T>,
    ) -> bool {
        let still = RotationModel { rotation: Matrix3::identity(), scales: rotation.scales };
        let explained = evidence.explained(&still.matrix());
        // Nine in ten of what the rotation explains, with a mean square of the motion below the noise's.
        let moved = explained.squares - turned.squares;
        10 * explained.inliers >= 9 * turned.inliers && moved <= from_u32::<T>(explained.inliers) * T::TWO
    }

    /// No motion, or a refined rotation.
    pub(super) fn turned(
        &self,
        rotation: &RotationModel<T>,
        still: bool,
        sigma: T,
        mask: &mut [bool],
        estimate: &mut RelativePoseEstimate<T>,
    ) {
        let problem = self.transfer_problem(sigma * lit(EXPLAINED_SIGMAS));
        let model = if still {
            RotationModel { rotation: Matrix3::identity(), scales: rotation.scales }
        } else {
            *rotation
        };
        let loss = Loss::Truncated(problem.threshold);
        let passes = if still { 1 } else { 8 };
        let minimum = problem.optimise(&model, &loss, passes, lit(1e-6));
        self.mark_transfer(&minimum.model.matrix(), mask);
        let limit = problem.threshold * problem.threshold;
        let variance = variance(&minimum.equations, problem.data.count, limit, 2);
        estimate.noise_px = sqrt(variance);
        estimate.verdict = if still {
            RelativePoseVerdict::NoMotion
        } else {
            RelativePoseVerdict::PureRotation(PureRotation {
                rotation: from_parts(&minimum.model.rotation, &Vector3::zeros()).rotation,
                covariance: covariance(&minimum.equations, variance),
            })
        };
    }
}
