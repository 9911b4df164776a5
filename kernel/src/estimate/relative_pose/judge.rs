//! From a consensus to a verdict: the simplest model that the data leave standing.

use core::cell::Cell;

use nalgebra::Matrix3;

use super::super::chance::{EXPLAINED_SIGMAS, beyond_chance};
use super::super::degenerate::{few_distinct, list, on_a_line};
use super::super::prior::PriorFit;
use super::LEAST_INLIERS;
use super::covariance::{PsiSums, Spread, covariance};
use super::evidence::Evidence;
use super::hypothesis::PoseProblem;
use super::planar::exchange_two;
use super::verdict::{GeneralMotion, RelativePoseEstimate, RelativePoseVerdict, Unobservable};
use crate::Real;
use crate::geometry::Pose;
use crate::geometry::pose::rotation_matrix;
use crate::linalg::LANES;
use crate::real::{from_u32, lit, max, min, sqrt};
use crate::refine::blocks::EpipolarBlock;
use crate::refine::homography::transfer_sq;
use crate::refine::lm::{Manifold, Minimum, NormalEquations};
use crate::refine::relative_pose::PoseModel;
use crate::robust::budget::after;
use crate::robust::loss::Loss;
use crate::robust::{
    Budget, Consensus, Estimator, Gate, Progress, RansacOptions, RansacReport, ScoreCounts, StopReason,
    ransac,
};

use super::super::transfer::TransferProblem;

/// What the verdict needs beside the problem.
pub(super) struct Judge<'a, 'b, T: Real, B> {
    pub(super) problem: &'a PoseProblem<'b, T, B>,
    /// Standard deviation of a coordinate in the blocks' unit, as the options have it.
    pub(super) sigma: T,
    /// Displacement in the blocks' unit up to which a correspondence may stand still.
    pub(super) least_motion: T,
    pub(super) seed: u64,
}

/// A pose at the minimum of its loss.
pub(super) struct Refined<T: Real> {
    pub(super) model: PoseModel<T>,
    /// The sums of the last pass.
    equations: NormalEquations<T, 5>,
    /// Where the loss ends.
    support: T,
    /// Of a residual, against which a prior was weighed where it is less than the one assumed.
    variance: T,
}

/// What a search has left to spend.
pub(super) struct Left<'a> {
    /// Iterations of that search, without others before it.
    pub(super) searched: u32,
    pub(super) budget: Budget,
    pub(super) keep_going: Option<&'a mut dyn FnMut(&Progress) -> bool>,
}

impl Left<'_> {
    /// Nothing.
    pub(super) fn none() -> Self {
        Self { searched: 0, budget: Budget { max_iterations: 0, ..Budget::default() }, keep_going: None }
    }
}

/// Error of an inlier in two dimensions over the threshold: as likely for a true correspondence as the threshold is in
/// one (chi-squared at 95 %: sqrt(5.99 / 3.84)).
const PLANE_THRESHOLD: f64 = 1.25;
/// Where the loss of the last refinement ends, in standard deviations of the noise: of many correspondences, and of `FEW`
/// and less, of which it loses hardly anything. What wrong ones add to the error does not fall with their number, as the
/// noise's part does.
const SUPPORT_SIGMAS: [f64; 2] = [3.5, 6.0];
const FEW: u32 = 150;
/// The least and largest such place, in thresholds.
const SUPPORT: [f64; 2] = [0.8, 2.6];
/// Of so few accidents expected a refinement takes no notice.
const FEW_ACCIDENTS: f64 = 0.4;
/// Passes of the last refinement at the most.
const REFINE_PASSES: u32 = 10;
/// Passes of a twin's.
const TWIN_PASSES: u32 = 4;
/// A plane must explain so many in twenty of the pose's inliers to be the verdict; of a planar scene it explains all but
/// accidents.
const PLANE_SHARE_OF_20: u32 = 17;
/// Before it is refined to the end, so many.
const LEAST_SHARE_OF_20: u32 = 13;
/// A twin so close to the pose (squared distance of its rotation and translation, rad) leads back to it; a pose so far from
/// another is another motion (3 degrees).
const SAME_POSE_SQ: f64 = 0.0005;
const OTHER_POSE_SQ: f64 = 0.0027;
/// Accidents expected at the most where parallax counts as proven against a rotation: where it is hardly visible a general
/// pose has no direction, so that little is lost.
const ROTATION_ACCIDENTS: f64 = 1e-4;
/// Accidents expected at the most where something off a plane counts as proven: to leave a plane that is one costs less
/// than to hold one that is none.
const PLANE_ACCIDENTS: f64 = 0.03;
/// Where a plane explains more inliers than this, poses that differ hardly differ in cost: as many samples again, so
/// many at the least and at the most, each with two correspondences off the plane, look for a better one, and of two that
/// explain the same neither is the verdict.
const MORE_SHARE_OF_20: u32 = 16;
const MORE_SAMPLES: [u32; 2] = [60, 300];
/// A pose that explains more correspondences than both poses of a plane do, by as many as this (in cost, where the noise is
/// what it is said to be), is reported beside them: of exact planes one in forty has one, of real scenes that count as
/// planes four in five. Of motions that differ by less none is proven.
const RIVAL: f64 = 3.0;
/// A pose of a plane that costs more than the pose found by this share of the inliers is not refined; with a prior, which
/// keeps the search near the truth, it hardly ever ends below.
const AGAINST: f64 = 0.5;
const AGAINST_AIDED: f64 = 0.25;
/// With how many others each correspondence is mispaired to measure what chance explains: at first, and where the verdict
/// hangs on it.
const MISPAIRED: usize = 3;
const MISPAIRED_MORE: usize = 24;
/// What chance explains may be so much before it is measured.
const LARGE_ACCIDENT: f64 = 0.3;
/// Inliers of which a line is believed where they agree with a pose no better than chance.
const LEAST_LINE: usize = 15;

impl<T: Real, B: EpipolarBlock<T>> Judge<'_, '_, T, B> {
    /// The chance of a wrong correspondence to be an inlier.
    fn accident(&self) -> T {
        self.problem.line_accident
    }

    /// Writes verdict and noise, in the blocks' unit, of what a search found (in place, for a verdict is large), how a prior
    /// that took part agrees with a general motion, and the inlier mask; uses `order` as memory. The report is that of the
    /// search; what more is spent is added. Whether `planes` are looked for is an argument of its own: the compiler sees it.
    pub(super) fn judge(
        &self,
        consensus: &Consensus<PoseModel<T>, T>,
        planes: bool,
        left: &mut Left<'_>,
        mask: &mut [bool],
        order: &mut [u32],
        estimate: &mut RelativePoseEstimate<T>,
    ) {
        (estimate.noise_px, estimate.general) = (T::ZERO, None);
        match &consensus.best {
            Some((model, _)) => self.verdict(model, planes, left, mask, order, estimate),
            None => {
                count_of(mask, false);
                self.without_model(estimate);
            }
        }
    }

    /// The verdict where no hypothesis was found at all.
    fn without_model(&self, estimate: &mut RelativePoseEstimate<T>) {
        let mut all = 0..self.problem.data.count as u32;
        estimate.verdict = if few_distinct(self.problem.data, &mut all, 5, self.sigma, &|| self.accident()) {
            RelativePoseVerdict::Unobservable(Unobservable::TooFewDistinct)
        } else {
            RelativePoseVerdict::NoConsensus
        }
    }

    /// [`judge`](Self::judge) of a pose.
    fn verdict(
        &self,
        best: &PoseModel<T>,
        planes: bool,
        left: &mut Left<'_>,
        mask: &mut [bool],
        order: &mut [u32],
        estimate: &mut RelativePoseEstimate<T>,
    ) {
        let problem = self.problem;
        let count = problem.data.count as u32;
        let mut refined = self.refine(best, REFINE_PASSES);
        let (inliers, mut spread) = self.mark(&refined, mask);
        // Measured where it is needed only: most poses are beyond the chance that may be.
        let measured = Cell::new(None);
        let accident = || {
            let measure = || problem.accident(&refined.model, self.accident(), MISPAIRED);
            let accident = measured.get().unwrap_or_else(measure);
            measured.set(Some(accident));
            accident
        };
        let proven = |accident: T| beyond_chance(count, inliers, 5, accident);
        if !proven(max(self.accident(), lit(LARGE_ACCIDENT))) && !proven(accident()) {
            measured.set(Some(problem.accident(&refined.model, self.accident(), MISPAIRED_MORE)));
        }
        if measured.get().is_some_and(|accident| !proven(accident)) {
            // Of points on one line even wrong pairs may agree.
            let indices = list(mask, order);
            let line = indices.len() > LEAST_LINE
                && on_a_line(problem.data, indices, self.sigma, &|| self.accident());
            if line {
                estimate.verdict = RelativePoseVerdict::Unobservable(Unobservable::Collinear);
            } else if !beyond_chance(count, count, 5, self.accident()) {
                estimate.verdict = RelativePoseVerdict::TooFewInliers;
            } else {
                self.without_model(estimate);
            }
            count_of(mask, false);
            return;
        }
        estimate.noise_px = spread.noise;
        // Where the options promise less noise than there is, the data are believed.
        let sigma = max(self.sigma, spread.noise);
        let indices = list(mask, order);
        if few_distinct(problem.data, &mut indices.iter().copied(), 5, sigma, &accident) {
            estimate.verdict = RelativePoseVerdict::Unobservable(Unobservable::TooFewDistinct);
            return;
        }
        if on_a_line(problem.data, indices, sigma, &accident) {
            estimate.verdict = RelativePoseVerdict::Unobservable(Unobservable::Collinear);
            return;
        }
        let evidence = Evidence { problem, inliers: mask, epipolar: refined.model.matrix(), sigma };
        if self.hardly_moves(&evidence) {
            return self.turned(None, self.least_motion / lit(EXPLAINED_SIGMAS), mask, estimate);
        }
        if let Some(rotation) = problem.rotation(&refined.model, sigma) {
            let explained = evidence.explained(&rotation.matrix());
            if !evidence.proves_parallax(count, &explained, 3, accident(), lit(ROTATION_ACCIDENTS)) {
                let still = self.stands_still(&evidence, &explained);
                return self.turned((!still).then_some(&rotation), sigma, mask, estimate);
            }
        }
        // Where most correspondences agree, the pose and its plane are known well after few passes.
        let clear = 2 * inliers > count;
        if planes && let Some(mut plane) = self.plane(&refined.model, indices, sigma, clear) {
            let held = evidence.explained(&plane.0).inliers;
            let planar = 20 * held > inliers * LEAST_SHARE_OF_20;
            if planar && clear {
                plane = self.finer(&plane, sigma);
            }
            if 2 * held > inliers {
                // A plane that holds most inliers may have led to the wrong one of its two poses.
                let twins = self.twins(&plane);
                let mut least = self.cost(&refined.model);
                let pose = refined.model;
                let leads_back = |twin: &PoseModel<T>| twin.distance_sq(&pose) < lit(SAME_POSE_SQ);
                let against = lit(if problem.prior.is_some() { AGAINST_AIDED } else { AGAINST });
                let mut moved = false;
                // What a free pose gains of the noise grows with its square.
                let louder = sigma / self.sigma;
                let chance = lit::<T>(RIVAL) * louder * louder;
                // Whether another motion explains as much as the best one but for chance.
                let mut tied = false;
                let hides = 20 * held > inliers * MORE_SHARE_OF_20;
                if hides
                    && let Some(other) =
                        self.another(left, self.off(&plane, sigma, order), &mut estimate.report)
                {
                    let cost = self.cost(&other.model);
                    if cost < least {
                        (refined, least, moved) = (other, cost, true);
                    }
                }
                for twin in &twins {
                    let far = twin.cost > least + from_u32::<T>(inliers) * against;
                    let twin = pose_model(&twin.pose, problem);
                    if clear && (far || leads_back(&twin)) {
                        continue;
                    }
                    // Few passes tell whether it comes near the pose.
                    let near = self.refine(&twin, TWIN_PASSES).model;
                    if clear && leads_back(&near) {
                        continue;
                    }
                    if self.cost(&near) < least + chance {
                        let other = self.refine(&near, REFINE_PASSES);
                        let cost = self.cost(&other.model);
                        let differs = other.model.distance_sq(&refined.model) > lit(OTHER_POSE_SQ);
                        tied = (tied || (differs && cost < least + chance)) && cost + chance > least;
                        if cost < least {
                            (refined, least, moved) = (other, cost, true);
                        }
                    }
                }
                if moved {
                    spread = self.mark(&refined, mask).1;
                }
                if planar && let Some(twin) = twins.first() {
                    // The plane's own lines: those of the pose are the ones that the noise happens to lie along.
                    let epipolar = pose_model(&twin.pose, problem).matrix();
                    let evidence = Evidence { problem, inliers: mask, epipolar, sigma };
                    let explained = evidence.explained(&plane.0);
                    let share =
                        explained.inliers * 20 >= (explained.inliers + explained.others) * PLANE_SHARE_OF_20;
                    let bends = || {
                        let noise = max(spread.noise, sigma * T::HALF);
                        evidence.bends(&plane.0, &refined.model.matrix(), noise)
                    };
                    let parallax = || {
                        let accident = problem.accident(&refined.model, self.accident(), MISPAIRED_MORE);
                        evidence.proves_parallax(count, &explained, 8, accident, lit(PLANE_ACCIDENTS))
                    };
                    let flat = share && !bends() && !parallax();
                    // What is off the plane may speak for two motions alike, and for neither of the plane's.
                    if flat || (hides && tied) {
                        if !flat || twins.iter().all(|twin| least + chance < twin.cost) {
                            estimate.general = Some(self.motion(&refined, &spread).0);
                        }
                        return self.planar(&plane, &twins, sigma, mask, estimate);
                    }
                }
            }
        }
        let (motion, fit) = self.motion(&refined, &spread);
        estimate.verdict = if planes {
            RelativePoseVerdict::General(motion)
        } else {
            RelativePoseVerdict::GeneralOrPlanar(motion)
        };
        estimate.noise_px = spread.noise;
        estimate.prior = fit;
    }

    /// The refined best of some more samples, where the search ended by itself and the budget is not spent; adds what they
    /// spend. Not inlined: its variables take no stack elsewhere.
    #[inline(never)]
    fn another(
        &self,
        left: &mut Left<'_>,
        off_plane: &[u32],
        report: &mut RansacReport<T>,
    ) -> Option<Refined<T>> {
        if report.stop != StopReason::Confident || left.searched == 0 {
            return None;
        }
        let wanted = core::cmp::min(core::cmp::max(left.searched, MORE_SAMPLES[0]), MORE_SAMPLES[1]);
        let samples = core::cmp::min(wanted, left.budget.max_iterations);
        let budget = Budget { max_iterations: samples, ..left.budget };
        let options =
            RansacOptions { seed: !self.seed, min_iterations: samples, budget, ..RansacOptions::default() };
        let mut ask = after(report.spent, &mut left.keep_going);
        let keep_going = ask.as_mut().map(|ask| ask as &mut dyn FnMut(&_) -> bool);
        // A plane leaves two poses and, with a little noise, all between them: two of every sample lie off it, if there are any.
        let exchange = |sample: &mut [u32; 5]| {
            if off_plane.len() > 1 {
                exchange_two(sample, off_plane);
            }
        };
        let problem = PoseProblem { exchange: Some(&exchange), ..*self.problem };
        let found = ransac::<T, _, 5>(&problem, &options, None, LEAST_INLIERS, keep_going);
        report.spent = report.spent.plus(&found.report.spent);
        report.stop = match found.report.stop {
            StopReason::Confident | StopReason::MaxIterations if samples == wanted => report.stop,
            StopReason::Confident => StopReason::MaxIterations,
            other => other,
        };
        found.best.map(|(model, _)| self.refine(&model, REFINE_PASSES))
    }

    /// The pose that all inliers support, with what lies just beyond the threshold at a falling weight.
    pub(super) fn refine(&self, model: &PoseModel<T>, passes: u32) -> Refined<T> {
        let mut start = self.open(model);
        let seen = self.spread(&start);
        let support = self.support(&seen);
        let variance = seen.noise * seen.noise;
        // Not where hardly one is expected, and not of poses that are only tried.
        let wrong = from_u32::<T>((self.problem.data.count as u32).saturating_sub(seen.count));
        if passes > TWIN_PASSES && wrong * self.accident() > lit(FEW_ACCIDENTS) {
            start.scales.nearest_sq = self.problem.nearest_sq(&start, support);
        }
        // The last step is worth three hundredths of a correspondence.
        let tolerance = max(lit::<T>(3e-2) / from_u32(self.problem.data.count as u32), lit(1e-5));
        let Minimum { model, equations, .. } =
            self.problem.optimise(&start, &Loss::Tukey(support), passes, tolerance, variance);
        Refined { model, equations, support, variance }
    }

    /// A pose that points may be as near as they like to.
    fn open(&self, model: &PoseModel<T>) -> PoseModel<T> {
        PoseModel { scales: self.problem.scales, ..*model }
    }

    /// A pose refined from a caller's; none where too few agree with it to fix it. Writes the inlier mask.
    pub(super) fn refined(&self, pose: &Pose<T>, mask: &mut [bool]) -> Option<GeneralMotion<T>> {
        let mut start = pose_model(pose, self.problem);
        let length = sqrt(start.translation.norm_squared());
        if length > T::ZERO {
            start.translation *= T::ONE / length;
            let mut refined = self.refine(&start, REFINE_PASSES);
            // What lies too near of a rough pose may not do so of the one that it leads to.
            if refined.model.scales.nearest_sq > T::ZERO {
                refined = self.refine(&refined.model, REFINE_PASSES);
            }
            let (inliers, spread) = self.mark(&refined, mask);
            if inliers >= 6 {
                let motion = self.motion(&refined, &spread).0;
                return motion.covariance.map(|_| motion);
            }
        }
        count_of(mask, false);
        None
    }

    /// A refined pose with its covariance, and how a prior that took part agrees.
    fn motion(&self, refined: &Refined<T>, spread: &Spread<T>) -> (GeneralMotion<T>, Option<PriorFit<T>>) {
        let (model, mut sums) = (&refined.model, refined.equations);
        let fit = self.problem.prior.and_then(|(known, variance)| {
            known.agreement(&mut sums, &model.rotation, min(variance, refined.variance), spread)
        });
        let covariance = covariance(&sums, spread.variance);
        (GeneralMotion { pose: model.pose(), covariance }, fit)
    }

    /// Where the loss about a pose ends: as far as the noise of these correspondences reaches.
    fn support(&self, seen: &Spread<T>) -> T {
        let threshold = self.problem.threshold;
        let few = from_u32::<T>(FEW) / from_u32(core::cmp::max(seen.count, FEW));
        let [near, far]: [T; 2] = [lit(SUPPORT_SIGMAS[0]), lit(SUPPORT_SIGMAS[1])];
        let sigmas = near + (far - near) * few;
        let [least, largest] = [threshold * lit(SUPPORT[0]), threshold * lit(SUPPORT[1])];
        min(max(seen.noise * sigmas, least), largest)
    }

    /// The noise about a pose, from what lies within two thresholds, and how many do.
    fn spread(&self, model: &PoseModel<T>) -> Spread<T> {
        self.survey(model, self.problem.threshold * T::TWO, &mut []).1
    }

    pub(super) fn cost(&self, model: &PoseModel<T>) -> T {
        // Of every pose over the same correspondences.
        let score = self.problem.score(&self.open(model), &Gate::open(), &mut ScoreCounts::default());
        let prior = self.problem.prior.as_ref().map_or(T::ZERO, |(known, variance)| {
            known.cost(&model.rotation) * *variance / (self.problem.threshold * self.problem.threshold)
        });
        score.map_or(T::MAX, |score| score.cost + prior)
    }

    /// Writes the pose's inliers; how many they are, and what the residuals say about the noise.
    fn mark(&self, refined: &Refined<T>, mask: &mut [bool]) -> (u32, Spread<T>) {
        self.survey(&refined.model, refined.support, mask)
    }

    /// How many inliers a pose has, what the residuals up to a support say about the noise, and the inliers, as far as there
    /// is a mask.
    fn survey(&self, model: &PoseModel<T>, support: T, mask: &mut [bool]) -> (u32, Spread<T>) {
        let share = self.problem.threshold / support;
        let scale = share * share;
        let mut entries = mask.iter_mut();
        let (mut inliers, mut sums) = (0, PsiSums::default());
        self.problem.for_each_block(model, |_, squared, filled| {
            for &s in squared.iter().take(filled) {
                let inside = s < T::ONE;
                if let Some(inlier) = entries.next() {
                    *inlier = inside;
                }
                inliers += inside as u32;
                sums.add(s * scale);
            }
        });
        (inliers, sums.spread(support, 5))
    }

    /// Writes the inliers of `x2 ~ H x1`.
    pub(super) fn mark_transfer(&self, h: &Matrix3<T>, mask: &mut [bool]) {
        let limit = self.problem.threshold * lit(PLANE_THRESHOLD);
        let limit = limit * limit;
        let mut entries = mask.iter_mut();
        for block in self.problem.data.blocks {
            let squared = transfer_sq(h, block, T::ONE);
            for (&s, inlier) in squared.iter().take(LANES).zip(entries.by_ref()) {
                *inlier = s < limit;
            }
        }
    }

    pub(super) fn transfer_problem(&self, threshold: T) -> TransferProblem<'_, T, B> {
        TransferProblem { data: self.problem.data, threshold, subset: None }
    }
}

/// The number of inliers; none where they do not stand, and then none is left. One loop for both.
#[cfg_attr(small, inline(never))]
pub(super) fn count_of(mask: &mut [bool], stand: bool) -> u32 {
    let mut count = 0;
    for inlier in mask {
        *inlier &= stand;
        count += *inlier as u32;
    }
    count
}

pub(super) fn pose_model<T: Real, B>(pose: &Pose<T>, problem: &PoseProblem<'_, T, B>) -> PoseModel<T> {
    PoseModel {
        rotation: rotation_matrix(&pose.rotation),
        translation: pose.translation.vector,
        scales: problem.scales,
    }
}
