//! From a consensus to a verdict: the simplest model that the data leave standing.

use nalgebra::{Matrix3, Vector3};

use super::super::chance::{EXPLAINED_SIGMAS, beyond_chance, line_accident};
use super::super::degenerate::{few_distinct, list, on_a_line};
use super::covariance::{covariance, variance};
use super::evidence::{Evidence, Explained};
use super::hypothesis::PoseProblem;
use super::verdict::{GeneralMotion, PureRotation, RelativePoseVerdict, Unobservable};
use crate::Real;
use crate::geometry::Pose;
use crate::geometry::pose::from_parts;
use crate::linalg::LANES;
use crate::real::{from_u32, lit, max, sqrt};
use crate::refine::blocks::EpipolarBlock;
use crate::refine::homography::{RotationModel, transfer_sq};
use crate::refine::lm::{Manifold, Minimum};
use crate::refine::relative_pose::PoseModel;
use crate::robust::loss::Loss;
use crate::robust::{Estimator, Gate, ScoreCounts};

use super::super::transfer::TransferProblem;

/// What the verdict needs beside the problem.
pub(super) struct Judge<'a, 'b, T: Real, B> {
    pub(super) problem: &'a PoseProblem<'b, T, B>,
    /// Standard deviation of a coordinate in the blocks' unit, as the options have it.
    pub(super) sigma: T,
    pub(super) seed: u64,
}

/// A verdict, with the noise in the blocks' unit.
pub(super) struct Judgement<T: Real> {
    pub(super) verdict: RelativePoseVerdict<T>,
    pub(super) noise: T,
}

/// Error of an inlier in two dimensions over the threshold: as likely for a true correspondence as the threshold is in
/// one (chi-squared at 95 %: sqrt(5.99 / 3.84)).
const PLANE_THRESHOLD: f64 = 1.25;

impl<T: Real, B: EpipolarBlock<T>> Judge<'_, '_, T, B> {
    /// The chance of a wrong correspondence to be an inlier.
    fn accident(&self) -> T {
        line_accident(self.problem.data, self.problem.threshold)
    }

    /// The verdict where no hypothesis was found at all.
    pub(super) fn without_model(&self) -> RelativePoseVerdict<T> {
        let all = 0..self.problem.data.count as u32;
        if few_distinct(self.problem.data, all, 5, self.sigma, self.accident()) {
            RelativePoseVerdict::Unobservable(Unobservable::TooFewDistinct)
        } else {
            RelativePoseVerdict::NoConsensus
        }
    }

    /// The verdict on a pose and its runners-up; writes the inlier mask, and uses `order` as memory.
    pub(super) fn verdict(&self, best: &PoseModel<T>, mask: &mut [bool], order: &mut [u32]) -> Judgement<T> {
        let problem = self.problem;
        let count = problem.data.count as u32;
        let mut refined = self.refine(best);
        let accident = problem.accident(&refined.model, self.accident());
        let inliers = self.mark(&refined.model, mask);
        let noise = self.noise(&refined);
        if !beyond_chance(count, inliers, 5, accident) {
            mask.iter_mut().for_each(|inlier| *inlier = false);
            let verdict = if !beyond_chance(count, count, 5, accident) {
                RelativePoseVerdict::TooFewInliers
            } else {
                self.without_model()
            };
            return Judgement { verdict, noise: T::ZERO };
        }
        // Where the options promise less noise than there is, the data are believed.
        let sigma = max(self.sigma, noise);
        let indices = list(mask, order);
        if few_distinct(problem.data, indices.iter().copied(), 5, sigma, accident) {
            let verdict = RelativePoseVerdict::Unobservable(Unobservable::TooFewDistinct);
            return Judgement { verdict, noise };
        }
        if on_a_line(problem.data, indices, sigma, accident) {
            return Judgement { verdict: RelativePoseVerdict::Unobservable(Unobservable::Collinear), noise };
        }
        let evidence = Evidence { problem, inliers: mask, epipolar: refined.model.matrix(), sigma, accident };
        if let Some(rotation) = evidence.rotation(&refined.model) {
            let explained = evidence.explained(&rotation.matrix());
            if !evidence.proves_parallax(count, &explained, 3) {
                let still = self.stands_still(&evidence, &rotation, &explained);
                return self.turned(&rotation, still, sigma, mask);
            }
        }
        if let Some(plane) = self.plane(indices, sigma)
            && 2 * evidence.explained(&plane.0).inliers > inliers
        {
            // A plane that holds most inliers may have led to the wrong one of its two poses.
            let twins = self.twins(&plane);
            for twin in &twins {
                let other = self.refine(&pose_model(&twin.pose, problem));
                if self.cost(&other.model) < self.cost(&refined.model) {
                    refined = other;
                }
            }
            self.mark(&refined.model, mask);
            let epipolar = refined.model.matrix();
            let evidence = Evidence { problem, inliers: mask, epipolar, sigma, accident };
            let explained = evidence.explained(&plane.0);
            if !evidence.proves_parallax(count, &explained, 8) && !twins.is_empty() {
                return self.planar(&plane, twins, sigma, mask);
            }
        }
        let noise = self.noise(&refined);
        let variance = noise * noise;
        let motion = GeneralMotion {
            pose: refined.model.pose(),
            covariance: covariance(&self.final_sums(&refined), variance),
        };
        Judgement { verdict: RelativePoseVerdict::General(motion), noise }
    }

    /// The pose that all inliers support, with what lies just beyond the threshold at a falling weight.
    fn refine(&self, model: &PoseModel<T>) -> Minimum<PoseModel<T>, T, 5> {
        let loss = Loss::Tukey(self.problem.threshold * T::TWO);
        self.problem.optimise(model, &loss, 10, lit(1e-6))
    }

    /// The sums of the inliers at a refined pose.
    fn final_sums(&self, refined: &Minimum<PoseModel<T>, T, 5>) -> crate::refine::lm::NormalEquations<T, 5> {
        let loss = Loss::Truncated(self.problem.threshold);
        self.problem.optimise(&refined.model, &loss, 1, T::ZERO).equations
    }

    /// Root of the mean squared residual of the inliers.
    fn noise(&self, refined: &Minimum<PoseModel<T>, T, 5>) -> T {
        let limit = self.problem.threshold * self.problem.threshold;
        sqrt(variance(&self.final_sums(refined), self.problem.data.count, limit, 1))
    }

    pub(super) fn cost(&self, model: &PoseModel<T>) -> T {
        let score = self.problem.score(model, &Gate::open(), &mut ScoreCounts::default());
        score.map_or(T::MAX, |score| score.cost)
    }

    /// Writes the pose's inliers and counts them.
    fn mark(&self, model: &PoseModel<T>, mask: &mut [bool]) -> u32 {
        let mut entries = mask.iter_mut();
        let mut inliers = 0;
        self.problem.for_each_block(model, |_, squared, filled| {
            for (inlier, &s) in entries.by_ref().take(filled).zip(squared) {
                *inlier = s < T::ONE;
                inliers += *inlier as u32;
            }
        });
        inliers
    }

    /// Writes the inliers of `x2 ~ H x1`.
    pub(super) fn mark_transfer(&self, h: &Matrix3<T>, mask: &mut [bool]) {
        let limit = self.problem.threshold * lit(PLANE_THRESHOLD);
        let limit = limit * limit;
        let mut entries = mask.iter_mut();
        for block in self.problem.data.blocks {
            let (plane, weight) = block.planes();
            let squared = transfer_sq(h, &plane, &weight);
            for (&s, inlier) in squared.iter().take(LANES).zip(entries.by_ref()) {
                *inlier = s < limit;
            }
        }
    }

    /// True where a rotation moves the points by no more than the noise.
    fn stands_still(
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
    fn turned(&self, rotation: &RotationModel<T>, still: bool, sigma: T, mask: &mut [bool]) -> Judgement<T> {
        let problem = self.transfer_problem(sigma * lit(EXPLAINED_SIGMAS), None);
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
        let verdict = if still {
            RelativePoseVerdict::NoMotion
        } else {
            RelativePoseVerdict::PureRotation(PureRotation {
                rotation: from_parts(&minimum.model.rotation, &Vector3::zeros()).rotation,
                covariance: covariance(&minimum.equations, variance),
            })
        };
        Judgement { verdict, noise: sqrt(variance) }
    }

    pub(super) fn transfer_problem<'c>(
        &'c self,
        threshold: T,
        subset: Option<&'c [u32]>,
    ) -> TransferProblem<'c, T, B> {
        TransferProblem { data: self.problem.data, threshold, subset }
    }
}

pub(super) fn pose_model<T: Real, B>(pose: &Pose<T>, problem: &PoseProblem<'_, T, B>) -> PoseModel<T> {
    PoseModel {
        rotation: pose.rotation.to_rotation_matrix().into_inner(),
        translation: pose.translation.vector,
        scales: problem.scales,
    }
}
