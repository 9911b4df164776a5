//! The search and the verdict with something known of the rotation beforehand.
//!
//! Smaller samples, turned by a rotation that is known to within its uncertainty only, give poses that are off by more
//! than the noise. So a hypothesis is first polished on a few correspondences, within a threshold as wide as the
//! uncertainty; what finds no support there is not scored.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::super::chance::band_accident;
use super::super::degenerate::repeated;
use super::super::prior::PriorFit;
use super::hypothesis::PoseProblem;
use super::judge::{Judge, Left};
use super::prior::KnownRotation;
use super::verdict::{RelativePoseEstimate, RelativePoseVerdict};
use super::{LEAST_INLIERS, RelativePoseOptions};
use crate::Real;
use crate::geometry::pose::upright;
use crate::linalg::LANES;
use crate::real::{abs, from_u32, lit, max, min, sqrt};
use crate::refine::blocks::{BlockSlice, EpipolarBlock};
use crate::refine::relative_pose::PoseModel;
use crate::robust::budget::after;
use crate::robust::loss::Loss;
use crate::robust::{
    Consensus, Estimator, Gate, Guide, Progress, RansacOptions, RansacReport, Score, ScoreCounts, StopReason,
    iterations_needed, rank_by_score, ransac,
};
use crate::solvers::{relpose_upright_3pt, translation_2pt};

/// Blocks of the correspondences on which hypotheses are polished.
const SUBSET: usize = 8;
/// Steps of a local optimisation.
const LOCAL_STEPS: u32 = 1;
/// The wide threshold is the narrow one and so many standard deviations of the prior.
const WIDE_SIGMAS: f64 = 1.0;
/// Where wrong correspondences lie within the wide threshold more often than this, the prior is too vague to sample by.
const VAGUE: f64 = 0.3;
/// Squared distance of rotation and translation, rad, below which two polished models lead to one optimum, and in squared
/// thresholds: within a tight one a step hardly leads from so far.
const SAME_POSE_SQ: f64 = 0.001;
const SAME_POSE_THRESHOLDS_SQ: f64 = 400.0;
/// Probability with which a rival of a prior's consensus is found if there is one.
const RIVAL_CONFIDENCE: f64 = 0.85;
/// A smaller share of inliers is left to the search without the prior.
const LEAST_SHARE: f64 = 0.2;

/// A problem of which the rotation is known in part: `K` is what the samples need of it.
pub(super) struct AidedProblem<'a, T: Real, B, K> {
    problem: PoseProblem<'a, T, B>,
    known: K,
    /// Correspondences in a subset.
    count: usize,
    wide: T,
    /// Correspondences of the subset that must lie within the wide threshold.
    support: u32,
}

impl<'a, T: Real, B: EpipolarBlock<T>, K> AidedProblem<'a, T, B, K> {
    /// None where the prior is too vague to sample by.
    fn new(problem: &PoseProblem<'a, T, B>, variance: T, known: K) -> Option<Self> {
        let wide = problem.threshold + sqrt(variance) * lit(WIDE_SIGMAS);
        let accident = band_accident(problem.width, wide);
        if !(accident < lit(VAGUE)) {
            return None;
        }
        let count = core::cmp::min(problem.data.count / LANES, SUBSET) * LANES;
        // Two standard deviations more than chance.
        let n = from_u32::<T>(count as u32);
        let chance = n * accident + T::TWO * sqrt(n * accident * (T::ONE - accident));
        let support = core::cmp::max(chance.to_u32() + 1, 5);
        Some(Self { problem: *problem, known, count, wide, support })
    }

    /// Some full blocks, others for another model, so that polished models stay as independent as their samples.
    fn subset(&self, model: &PoseModel<T>) -> [B; SUBSET] {
        let blocks = self.problem.data.blocks;
        let full = self.problem.data.count / LANES;
        let mut subset = [B::zero(); SUBSET];
        let mut at = (abs(model.translation.x) * from_u32(full as u32 * 8)).to_u32() as usize
            % core::cmp::max(full, 1);
        for place in &mut subset {
            // The stride is coprime to the number of all blocks, the last of which may not be full.
            for _ in 0..2 {
                if at >= blocks.len() {
                    at -= blocks.len();
                }
                if at < full {
                    break;
                }
                at += self.problem.stride;
            }
            if let Some(block) = blocks.get(at) {
                *place = *block;
            }
            at += self.problem.stride;
        }
        subset
    }
}

/// Poses of minimal samples of `S` correspondences, something being known.
trait Minimal<T: Real, const S: usize> {
    fn poses(
        &self,
        f1: &[Vector3<T>; S],
        f2: &[Vector3<T>; S],
        found: &mut impl FnMut(Matrix3<T>, Vector3<T>),
    );
}

/// The turns that make both views upright.
struct Upright<T: Real>([Matrix3<T>; 2]);

impl<T: Real> Minimal<T, 3> for Upright<T> {
    fn poses(
        &self,
        f1: &[Vector3<T>; 3],
        f2: &[Vector3<T>; 3],
        found: &mut impl FnMut(Matrix3<T>, Vector3<T>),
    ) {
        let [a, b] = &self.0;
        let back = b.transpose();
        for pose in &relpose_upright_3pt(&f1.map(|f| a * f), &f2.map(|f| b * f)) {
            let rotation = pose.rotation.to_rotation_matrix().into_inner();
            found(back * rotation * a, back * pose.translation.vector);
        }
    }
}

/// The rotation.
struct Turned<T: Real>(UnitQuaternion<T>);

impl<T: Real> Minimal<T, 2> for Turned<T> {
    fn poses(
        &self,
        f1: &[Vector3<T>; 2],
        f2: &[Vector3<T>; 2],
        found: &mut impl FnMut(Matrix3<T>, Vector3<T>),
    ) {
        if let Some(translation) = translation_2pt(&self.0, f1, f2) {
            found(self.0.to_rotation_matrix().into_inner(), translation);
        }
    }
}

impl<T: Real, B: EpipolarBlock<T>, K: Minimal<T, S>, const S: usize> Estimator<T, S>
    for AidedProblem<'_, T, B, K>
{
    type Model = PoseModel<T>;

    // A polished model lies where its optimum does: one near miss in 32 iterations is enough.
    const NEAR_MISSES: u32 = 0;
    // The subset is looked at three times before.
    const SCORE_PASSES: u32 = 4;

    fn count(&self) -> u32 {
        self.problem.data.count as u32
    }

    fn generate(&self, sample: &[u32; S], found: &mut impl FnMut(&PoseModel<T>)) -> bool {
        let (mut f1, mut f2) = ([Vector3::zeros(); S], [Vector3::zeros(); S]);
        for ((a, b), &index) in f1.iter_mut().zip(&mut f2).zip(sample) {
            let Some((x, y)) = self.problem.directions(index) else { return false };
            (*a, *b) = (x, y);
        }
        if repeated(&f1, self.problem.threshold) || repeated(&f2, self.problem.threshold) {
            return false;
        }
        let scales = self.problem.scales;
        self.known.poses(&f1, &f2, &mut |rotation, translation| {
            found(&PoseModel { rotation, translation, scales });
        });
        true
    }

    fn polish(&self, model: &PoseModel<T>, bound: T, counts: &mut ScoreCounts) -> Option<PoseModel<T>> {
        let subset = self.subset(model);
        let data = BlockSlice { blocks: &subset, count: self.count };
        let (residuals, wide) = (&mut counts.residuals, self.wide);
        // Of a model that may cost no more than the bound, at least so many lie within the narrow threshold, once polished.
        let count = from_u32::<T>(self.problem.data.count as u32);
        let share = T::ONE - bound / count;
        let support = max(share * from_u32(self.count as u32), from_u32(self.support));
        *residuals = residuals.saturating_add(self.count as u32);
        if self.problem.within(data, model, wide) < support.to_u32() {
            return None;
        }
        let [first, second] = [wide, wide * T::HALF].map(Loss::Truncated);
        let model = self.problem.approach(data, model, &first, 1, self.support, residuals)?;
        self.problem.approach(data, &model, &second, 1, 5, residuals)
    }

    fn score(&self, model: &PoseModel<T>, gate: &Gate<T>, counts: &mut ScoreCounts) -> Option<Score<T>> {
        self.problem.score(model, gate, counts)
    }

    fn repeats(&self, sample: &[u32; S], best: &PoseModel<T>) -> bool {
        // What a sample of inliers leads to is the optimum among them.
        self.problem.explains(best, sample)
    }

    fn leads_back(&self, model: &PoseModel<T>, best: &PoseModel<T>) -> bool {
        let threshold = self.problem.threshold;
        model.distance_sq(best) < min(lit(SAME_POSE_SQ), threshold * threshold * lit(SAME_POSE_THRESHOLDS_SQ))
    }

    fn differs(&self, optimum: &PoseModel<T>, other: &PoseModel<T>) -> bool {
        self.problem.differs(optimum, other)
    }

    fn refine(&self, model: &PoseModel<T>, residuals: &mut u32) -> Option<PoseModel<T>> {
        // A polished model needs no wide stage.
        let loss = Loss::Tukey(self.problem.threshold * T::TWO);
        self.problem.approach(self.problem.data, model, &loss, LOCAL_STEPS, 5, residuals)
    }
}

/// The consensus by smaller samples; none where the prior is too vague for them. Not inlined: its variables take no stack
/// during the verdict.
#[inline(never)]
fn search<T: Real, B: EpipolarBlock<T>>(
    problem: &PoseProblem<'_, T, B>,
    known: &KnownRotation<T>,
    options: &RansacOptions<T>,
    order: Option<&[u32]>,
    keep_going: Option<&mut dyn FnMut(&Progress) -> bool>,
) -> Option<Consensus<PoseModel<T>, T>> {
    let count = problem.data.count as u32;
    let least = core::cmp::max((from_u32::<T>(count) * lit(LEAST_SHARE)).to_u32(), LEAST_INLIERS);
    let mut options = *options;
    // As many correspondences in the fewest samples as without the prior.
    let size = match known {
        KnownRotation::Gravity { .. } => 3,
        KnownRotation::Rotation { .. } => 2,
    };
    let floor = options.min_iterations.saturating_mul(size).div_ceil(5);
    let most =
        core::cmp::max(iterations_needed(options.confidence, least, count, size), options.min_iterations);
    options.min_iterations = floor;
    options.budget.max_iterations = core::cmp::min(options.budget.max_iterations, most);
    match known {
        KnownRotation::Gravity { direction, .. } => {
            let turns = Upright([upright(&direction.from)?, upright(&direction.to)?]);
            let aided = AidedProblem::new(problem, known.variance(), turns)?;
            Some(ransac::<T, _, 3>(&aided, &options, order, LEAST_INLIERS, keep_going))
        }
        KnownRotation::Rotation { rotation, .. } => {
            let aided = AidedProblem::new(problem, known.variance(), Turned(*rotation))?;
            Some(ransac::<T, _, 2>(&aided, &options, order, LEAST_INLIERS, keep_going))
        }
    }
}

/// The estimate with a prior: by smaller samples where that finds a consensus that agrees with the prior, otherwise by
/// the search without it. The prior takes part in the refinement where it fits, and nowhere else. Not inlined: without a
/// prior its variables take no stack.
#[inline(never)]
pub(super) fn judge<T: Real, B: EpipolarBlock<T>>(
    plain: &Judge<'_, '_, T, B>,
    known: &KnownRotation<T>,
    options: &RelativePoseOptions<T>,
    guide: Guide<'_, T>,
    mask: &mut [bool],
    order: &mut [u32],
    estimate: &mut RelativePoseEstimate<T>,
) {
    let problem = PoseProblem { prior: Some((known, plain.sigma * plain.sigma)), ..*plain.problem };
    let aided = Judge { problem: &problem, ..*plain };
    let (planes, options) = (options.planes, &options.ransac);
    let Guide { scores, mut keep_going } = guide;
    // Reborrowed, for a second search may need it.
    let ask = keep_going.as_mut().map(|ask| &mut **ask as &mut dyn FnMut(&_) -> bool);
    let first = search(&problem, known, options, ranked(scores, order, mask.len()), ask);
    let mut spent = first.map_or(Progress::default(), |first| first.report.spent);
    let mut interrupted = first.is_some_and(|first| first.report.stop == StopReason::Interrupted);
    let confident = first.filter(|first| first.report.stop == StopReason::Confident);
    if let Some(first) = confident {
        aided.judge(&first, planes, &mut Left::none(), mask, order, estimate);
        if !matches!(
            estimate.verdict,
            RelativePoseVerdict::General(_) | RelativePoseVerdict::GeneralOrPlanar(_)
        ) {
            estimate.prior = known.agreement(&estimate.verdict);
        }
        if let Some(PriorFit::Fits(_)) = estimate.prior {
            let mut ask = after(first.report.spent, &mut keep_going);
            let ask = ask.as_mut().map(|ask| ask as &mut dyn FnMut(&_) -> bool);
            let rival = rival(plain.problem, &first, options, ask);
            let mut report = first.report;
            report.spent = spent.plus(&rival.spent);
            interrupted = rival.stop == StopReason::Interrupted;
            if rival.stop != StopReason::Confident {
                report.stop = rival.stop;
            }
            if !(rival.cost < first.report.cost) {
                estimate.report = report;
                return;
            }
            spent = report.spent;
        }
    }
    let mut left = *options;
    left.budget = options.budget.less(&spent);
    if interrupted {
        left.budget.max_iterations = 0;
    }
    let second = {
        let mut ask = after(spent, &mut keep_going);
        let ask = ask.as_mut().map(|ask| ask as &mut dyn FnMut(&_) -> bool);
        ransac(plain.problem, &left, ranked(scores, order, mask.len()), LEAST_INLIERS, ask)
    };
    let total = |mut report: RansacReport<T>| {
        report.spent = second.report.spent.plus(&spent);
        report.spent.inliers = report.inliers;
        report.stop = if interrupted { StopReason::Interrupted } else { second.report.stop };
        report
    };
    // The search by smaller samples may have found the better pose nevertheless.
    if let Some(first) = first
        && first.report.cost < second.report.cost
    {
        aided.judge(&first, planes, &mut Left::none(), mask, order, estimate);
        if !matches!(
            estimate.verdict,
            RelativePoseVerdict::General(_) | RelativePoseVerdict::GeneralOrPlanar(_)
        ) {
            estimate.prior = known.agreement(&estimate.verdict);
        }
        if let Some(PriorFit::Fits(_)) = estimate.prior {
            estimate.report = total(first.report);
            return;
        }
    }
    estimate.report = total(second.report);
    let budget = left.budget.less(&second.report.spent);
    let searched = second.report.spent.iterations;
    plain.judge(&second, planes, &mut Left { searched, budget, keep_going }, mask, order, estimate);
    let fit = known.agreement(&estimate.verdict);
    if let Some(PriorFit::Fits(_)) = fit {
        aided.judge(&second, planes, &mut Left::none(), mask, order, estimate);
    }
    estimate.prior = fit;
}

/// A short search without the prior for a consensus half as large again: a wrong prior may have led to a pose that a part
/// of the inliers fits by accident.
fn rival<T: Real, B: EpipolarBlock<T>>(
    problem: &PoseProblem<'_, T, B>,
    found: &Consensus<PoseModel<T>, T>,
    options: &RansacOptions<T>,
    keep_going: Option<&mut dyn FnMut(&Progress) -> bool>,
) -> RansacReport<T> {
    let count = problem.data.count as u32;
    let inliers = found.report.inliers + found.report.inliers / 2;
    let mut options = *options;
    options.min_iterations = 0;
    options.budget = options.budget.less(&found.report.spent);
    let needed =
        if inliers < count { iterations_needed::<T>(lit(RIVAL_CONFIDENCE), inliers, count, 5) } else { 0 };
    let samples = core::cmp::min(options.budget.max_iterations, needed);
    options.budget.max_iterations = samples;
    let mut report = ransac::<T, _, 5>(problem, &options, None, inliers, keep_going).report;
    // As many as were wanted, so that the budget has not ended it.
    if samples == needed && report.stop == StopReason::MaxIterations {
        report.stop = StopReason::Confident;
    }
    report
}

/// The order of the correspondences by their scores, in the memory given.
pub(super) fn ranked<'a, T: Real>(
    scores: Option<&[T]>,
    order: &'a mut [u32],
    count: usize,
) -> Option<&'a [u32]> {
    rank_by_score(scores?, order);
    order.get(..count)
}
