//! Relative pose as the engine's problem: five-point hypotheses gated by cheirality, Sampson scores, refinement.

use nalgebra::{Matrix3, Vector3};

use crate::Real;
use crate::geometry::pose::nearest_rotation;
use crate::linalg::{LANES, Lanes, add_outer};
use crate::real::{from_u32, lit, min};
use crate::refine::blocks::{BlockSlice, EpipolarBlock};
use crate::refine::homography::{RotationModel, transfer_sq};
use crate::refine::lm::{
    EpipolarModel, Manifold, Minimum, NormalEquations, descend, normal_equations, sampled_equations,
};
use crate::refine::relative_pose::{PoseFrame, PoseModel, Scales};
use crate::robust::loss::Loss;
use crate::robust::{Estimator, Gate, Score, ScoreCounts, Tally};
use crate::solvers::relpose_5pt;

use super::super::chance::{EXPLAINED_SIGMAS, band_accident, least_beyond_chance, width};
use super::super::degenerate::repeated;
use super::super::neighbours::apart;
use super::super::stride;
use super::in_front::pose_in_front;
use super::prior::RotationPrior;

/// Correspondences and what a score of them needs.
#[derive(Clone, Copy)]
pub(super) struct PoseProblem<'a, T: Real, B> {
    pub(super) data: BlockSlice<'a, B>,
    pub(super) scales: Scales<T>,
    /// The threshold in the blocks' unit.
    pub(super) threshold: T,
    /// Blocks between two that are scored one after the other.
    pub(super) stride: usize,
    /// The shorter side of the rectangle that the points of view 2 fill, and the chance of a wrong correspondence to lie
    /// within the threshold of its epipolar line: once for all, for they take a pass.
    pub(super) width: T,
    pub(super) line_accident: T,
    /// What is known of the rotation and enters every optimisation, and the variance of a residual that it is weighed
    /// against.
    pub(super) prior: Option<(&'a dyn RotationPrior<T>, T)>,
    /// What becomes of a sample before it is solved. Called through a pointer: code that looks for no plane links none of it.
    pub(super) exchange: Option<&'a Exchange<'a>>,
}

/// Changes a sample.
pub(super) type Exchange<'a> = dyn Fn(&mut [u32; 5]) + 'a;

/// Blocks scored between two looks at the gate.
const CHUNK: usize = 2;
/// Steps of the two stages of a local optimisation.
const WIDE_STEPS: u32 = 2;
const LOCAL_STEPS: u32 = 3;
/// The first stage's threshold over the second's.
const WIDE: f64 = 3.0;
/// A stage ends with a step that promises less than this share of the cost.
const CONVERGED: f64 = 0.01;
/// Blocks that a local optimisation looks at.
pub(super) const SAMPLED_BLOCKS: usize = 64;
/// Blocks on which it is tried whether a pose is but a rotation.
const TURNED_BLOCKS: usize = 8;
/// Passes over those at the most.
const TURN_PASSES: u32 = TURN_SIGMAS.len() as u32 + 1;
/// Errors, in standard deviations, up to which correspondences take part in a rotation: from coarse to fine, so that a few
/// wrong ones do not hold the rest.
const TURN_SIGMAS: [u32; 5] = [64, 24, 12, 8, 5];
/// The same for more correspondences, once that rotation is known.
const FINE_SIGMAS: [u32; 2] = [8, 5];
/// Squared distance beyond which poses are different solutions: some ten degrees of rotation or translation.
const APART_SQ: f64 = 0.03;
/// Two poses share their inliers but for one in so many of the pose that has more, and so many accidents.
const UNSHARED_ONE_IN: u32 = 10;
const UNSHARED: u32 = 3;
/// Rays closer to parallel than this many thresholds say nothing about depth.
const PARALLEL: f64 = 1.0;

impl<'a, T: Real, B: EpipolarBlock<T>> PoseProblem<'a, T, B> {
    pub(super) fn new(data: BlockSlice<'a, B>, scales: Scales<T>, threshold: T) -> Self {
        let sine = threshold * lit(PARALLEL);
        let scales = Scales { parallel_sq: sine * sine, ..scales };
        let (stride, width) = (stride(data.blocks.len()), width(data));
        let line_accident = band_accident(width, threshold);
        Self { data, scales, threshold, stride, width, line_accident, prior: None, exchange: None }
    }

    /// The normalised points or bearings of a correspondence; none where it is not finite.
    #[inline]
    pub(super) fn directions(&self, index: u32) -> Option<(Vector3<T>, Vector3<T>)> {
        let block = self.data.blocks.get(index as usize / LANES)?;
        let (f1, f2) = block.directions(index as usize % LANES)?;
        let (a, b) = (self.scales.inverse1(), self.scales.inverse2());
        let scaled = |f: [T; 3], s: [T; 2]| Vector3::new(f[0] * s[0], f[1] * s[1], f[2]);
        Some((scaled(f1, a), scaled(f2, b)))
    }

    /// Squared residuals of a block in units of the squared threshold; of a point behind a camera, the largest number.
    #[cfg_attr(not(small), inline(always))]
    fn squared(&self, block: &B, view: &View<T>) -> Lanes<T> {
        let mut squared = [T::ZERO; LANES];
        for l in 0..LANES {
            let sight = block.sight(&view.frame.views, l);
            squared[l] = sight.c * sight.c * view.scale / sight.d;
            if squared[l] < T::ONE && !view.frame.admits(&sight) {
                squared[l] = T::MAX;
            }
        }
        squared
    }

    fn view(&self, model: &PoseModel<T>) -> View<T> {
        View { frame: model.frame(), scale: T::ONE / (self.threshold * self.threshold) }
    }

    /// Calls `each` with the squared residuals of every block in order, in units of the squared threshold, points
    /// behind a camera at 1 or more, and how many lanes count.
    pub(super) fn for_each_block(&self, model: &PoseModel<T>, mut each: impl FnMut(&B, &Lanes<T>, usize)) {
        let view = self.view(model);
        let mut left = self.data.count;
        for block in self.data.blocks {
            each(block, &self.squared(block, &view), core::cmp::min(left, LANES));
            left = left.saturating_sub(LANES);
        }
    }

    /// The share of wrong correspondences that a pose explains by accident, measured on the correspondences
    /// themselves with view 2 of another in place of their own, of so many `others`; never below `least`.
    pub(super) fn accident(&self, model: &PoseModel<T>, least: T, others: usize) -> T {
        let view = self.view(model);
        let mut hits = 0u32;
        let seen = self.for_each_mispaired(others, &mut |block| {
            for s in self.squared(block, &view) {
                hits += (s < T::ONE) as u32;
            }
        });
        let share = from_u32::<T>(hits + 2) / from_u32(seen + 2);
        if seen > 0 && share > least { share } else { least }
    }

    /// The blocks of which every lane counts.
    pub(super) fn whole_blocks(&self) -> &[B] {
        self.data.blocks.get(..self.data.count / LANES).unwrap_or(self.data.blocks)
    }

    /// Calls `each` with some whole blocks, with view 2 of each of so many `others` in place of their own; how many
    /// correspondences these are. One copy of it in the code, for it is called through a pointer.
    pub(super) fn for_each_mispaired(&self, others: usize, each: &mut dyn FnMut(&B)) -> u32 {
        let full = self.whole_blocks();
        let every = core::cmp::max(full.len() / SAMPLED_BLOCKS, 1);
        let others = core::cmp::min(others, full.len().saturating_sub(1));
        let mut seen = 0;
        for k in 1..=others {
            // Never a whole turn.
            let shift = k * full.len() / (others + 1);
            for at in (0..full.len()).step_by(every) {
                let other = at + shift;
                let other = if other < full.len() { other } else { other - full.len() };
                if let (Some(block), Some(other)) = (full.get(at), full.get(other)) {
                    each(&block.mispaired(other));
                    seen += LANES as u32;
                }
            }
        }
        seen
    }

    /// The rotation that explains the inliers of a pose best, by alternating between the closest rotation of all that are
    /// explained and the choice of those, on a few blocks and then on more; none where they leave one open, or where less
    /// than half of them turn.
    #[cfg_attr(small, inline(never))]
    pub(super) fn rotation(&self, pose: &PoseModel<T>, sigma: T) -> Option<RotationModel<T>> {
        let few = self.agreeing(pose, TURNED_BLOCKS);
        let turned = self.nearest(&pose.rotation, &few, &TURN_SIGMAS, sigma)?;
        self.nearest(&turned.rotation, &self.agreeing(pose, SAMPLED_BLOCKS), &FINE_SIGMAS, sigma)
    }

    /// A rotation near `start` that a sample's correspondences leave after so many choices of them; none as above.
    fn nearest(
        &self,
        start: &Matrix3<T>,
        sample: &Agreeing,
        sigmas: &[u32],
        sigma: T,
    ) -> Option<RotationModel<T>> {
        let mut model = RotationModel { rotation: *start, scales: self.scales };
        let (s1, s2) = (model.scales.inverse1(), model.scales.inverse2());
        for &factor in sigmas {
            let limit = from_u32::<T>(factor) * sigma;
            let mut moment = Matrix3::zeros();
            let turned = self.turned(sample, &model, limit * limit, |block, turned| {
                for l in 0..LANES {
                    if turned[l]
                        && let Some((f1, f2)) = block.directions(l)
                    {
                        let v1 = Vector3::new(f1[0] * s1[0], f1[1] * s1[1], f1[2]);
                        let v2 = Vector3::new(f2[0] * s2[0], f2[1] * s2[1], f2[2]);
                        add_outer(&mut moment, &v2, &v1, T::ONE);
                    }
                }
            });
            if 2 * turned < sample.count {
                return None;
            }
            model.rotation = nearest_rotation(&moment)?;
        }
        Some(model)
    }

    /// Some of the blocks, and which of their correspondences agree with a pose.
    fn agreeing(&self, pose: &PoseModel<T>, blocks: usize) -> Agreeing {
        let blocks = core::cmp::min(blocks, SAMPLED_BLOCKS);
        let every = core::cmp::max(self.data.blocks.len().div_ceil(core::cmp::max(blocks, 1)), 1);
        let view = self.view(pose);
        let mut sample = Agreeing { every, lanes: [[false; LANES]; SAMPLED_BLOCKS], count: 0 };
        let mut left = self.data.count;
        for (block, lanes) in self.data.blocks.iter().step_by(every).zip(&mut sample.lanes) {
            let squared = self.squared(block, &view);
            for l in 0..LANES {
                lanes[l] = l < left && squared[l] < T::ONE;
                sample.count += lanes[l] as u32;
            }
            left = left.saturating_sub(LANES * every);
        }
        sample
    }

    /// How many of a sample a rotation explains up to a squared transfer error; calls `each` with those of a block.
    #[inline]
    fn turned(
        &self,
        sample: &Agreeing,
        rotation: &RotationModel<T>,
        limit: T,
        mut each: impl FnMut(&B, &[bool; LANES]),
    ) -> u32 {
        let h = rotation.matrix();
        let mut turned = 0u32;
        // At least one already, which the optimiser does not see through memory.
        let every = core::cmp::max(sample.every, 1);
        for (block, lanes) in self.data.blocks.iter().step_by(every).zip(&sample.lanes) {
            let squared = transfer_sq(&h, block, T::ONE);
            let mut explained = [false; LANES];
            for l in 0..LANES {
                explained[l] = lanes[l] && squared[l] < limit;
                turned += explained[l] as u32;
            }
            each(block, &explained);
        }
        turned
    }

    /// True where a rotation explains what a pose does: then the optima of poses are many, and none is better than the
    /// others.
    fn turns(&self, pose: &PoseModel<T>) -> bool {
        let sample = self.agreeing(pose, TURNED_BLOCKS);
        // A threshold is two standard deviations.
        let sigma = self.threshold * T::HALF;
        let Some(rotation) = self.nearest(&pose.rotation, &sample, &TURN_SIGMAS, sigma) else {
            return false;
        };
        let limit = self.threshold * self.threshold * lit(EXPLAINED_SIGMAS * EXPLAINED_SIGMAS * 0.25);
        self.turned(&sample, &rotation, limit, |_, _| ()) * 10 >= sample.count * 9
    }

    /// Whether correspondences are inliers of a model.
    pub(super) fn explains(&self, model: &PoseModel<T>, sample: &[u32]) -> bool {
        let frame = model.frame();
        sample.iter().all(|&index| {
            self.data.blocks.get(index as usize / LANES).is_some_and(|block| {
                let sight = block.sight(&frame.views, index as usize % LANES);
                sight.c * sight.c < self.threshold * self.threshold * sight.d && frame.admits(&sight)
            })
        })
    }

    /// How many correspondences of whole blocks lie within a threshold of a model, in front of the cameras or not.
    pub(super) fn within(&self, data: BlockSlice<'_, B>, model: &PoseModel<T>, threshold: T) -> u32 {
        let (frame, limit) = (model.frame(), threshold * threshold);
        let mut count = 0;
        for block in data.blocks.iter().take(data.count / LANES) {
            for l in 0..LANES {
                let sight = block.sight(&frame.views, l);
                count += (sight.c * sight.c < limit * sight.d) as u32;
            }
        }
        count
    }

    /// At most `steps` Gauss-Newton steps towards the minimum of a loss, on some of the blocks, without a look at where the
    /// last one leads; none where fewer than `least` are active or a direction is open.
    pub(super) fn approach(
        &self,
        data: BlockSlice<'_, B>,
        model: &PoseModel<T>,
        loss: &Loss<T>,
        steps: u32,
        least: u32,
        residuals: &mut u32,
    ) -> Option<PoseModel<T>> {
        let every = data.blocks.len().div_ceil(SAMPLED_BLOCKS);
        let mut model = *model;
        for _ in 0..steps {
            let mut sums = sampled_equations(data, every, &model, loss);
            *residuals = residuals.saturating_add((data.count / core::cmp::max(every, 1)) as u32);
            if sums.active < least {
                return None;
            }
            self.add_prior(&mut sums, &model, T::MAX);
            let (step, promise) = sums.step(T::ZERO)?;
            model = model.retract(&step);
            if promise <= sums.cost * lit(CONVERGED) {
                break;
            }
        }
        Some(model)
    }

    /// The model that minimises a loss, from `model`; `variance` is that of a residual.
    pub(super) fn optimise(
        &self,
        model: &PoseModel<T>,
        loss: &Loss<T>,
        passes: u32,
        tolerance: T,
        variance: T,
    ) -> Minimum<PoseModel<T>, T, 5> {
        let equations = |model: &PoseModel<T>| {
            let mut sums = normal_equations(self.data, model, loss);
            self.add_prior(&mut sums, model, variance);
            sums
        };
        descend(model, 5, passes, tolerance, equations, PoseModel::retract)
    }

    /// Adds what is known of the rotation, weighed against the variance of a residual where that is less than the one
    /// assumed, lest it outweigh correspondences that are better than they are said to be.
    #[cfg_attr(small, inline(never))]
    fn add_prior(&self, sums: &mut NormalEquations<T, 5>, model: &PoseModel<T>, variance: T) {
        if let Some((known, assumed)) = &self.prior {
            known.add(sums, &model.rotation, min(*assumed, variance));
        }
    }
}

/// Correspondences of every so many-th block that agree with a pose.
struct Agreeing {
    every: usize,
    lanes: [[bool; LANES]; SAMPLED_BLOCKS],
    count: u32,
}

/// What is computed once a model.
struct View<T: Real> {
    frame: PoseFrame<T>,
    scale: T,
}

impl<T: Real, B: EpipolarBlock<T>> Estimator<T, 5> for PoseProblem<'_, T, B> {
    type Model = PoseModel<T>;

    const DISCOVERIES: u32 = 3;
    const RIVALLED_DISCOVERIES: u32 = 8;
    const NEAR_MISS_INTERVAL: u32 = 8;
    const SCORE_PASSES: u32 = 1;

    fn count(&self) -> u32 {
        self.data.count as u32
    }

    fn least_consensus(&self) -> u32 {
        least_beyond_chance(self.data.count as u32, 5, self.line_accident)
    }

    #[cfg_attr(small, inline(never))]
    fn apart(&self, a: u32, b: u32) -> Option<T> {
        Some(apart(&self.directions(a)?, &self.directions(b)?))
    }

    fn generate(&self, sample: &[u32; 5], found: &mut impl FnMut(&PoseModel<T>)) -> bool {
        let mut f1 = [Vector3::zeros(); 5];
        let mut f2 = [Vector3::zeros(); 5];
        let mut sample = *sample;
        if let Some(exchange) = self.exchange {
            exchange(&mut sample);
        }
        for ((a, b), &index) in f1.iter_mut().zip(&mut f2).zip(&sample) {
            let Some((x, y)) = self.directions(index) else { return false };
            (*a, *b) = (x, y);
        }
        // As one twice in the sample is, too.
        if repeated(&f1, self.threshold) || repeated(&f2, self.threshold) {
            return false;
        }
        for essential in &relpose_5pt(&f1, &f2) {
            if let Some((rotation, translation)) = pose_in_front(essential, &f1, &f2, self.scales.parallel_sq)
            {
                found(&PoseModel { rotation, translation, scales: self.scales });
            }
        }
        true
    }

    fn score(&self, model: &PoseModel<T>, gate: &Gate<T>, counts: &mut ScoreCounts) -> Option<Score<T>> {
        let blocks = self.data.blocks;
        let view = self.view(model);
        let mut tally = Tally::new();
        let mut at = 0usize;
        let mut seen = 0u32;
        for k in 1..=blocks.len() {
            if let Some(block) = blocks.get(at) {
                let squared = self.squared(block, &view);
                let filled = core::cmp::min(self.data.count.saturating_sub(at * LANES), LANES);
                // Not two loops where code is to be small.
                if filled == LANES && !cfg!(small) {
                    tally.add(&squared);
                } else {
                    tally.add_first(&squared, filled);
                }
                seen += filled as u32;
            }
            at += self.stride;
            if at >= blocks.len() {
                at -= blocks.len();
            }
            if (k % CHUNK == 0 || k == blocks.len())
                && gate.rejects(tally.cost(), tally.inliers(), from_u32(seen))
            {
                counts.add_rejected(seen, tally.inliers().to_u32());
                return None;
            }
        }
        counts.add(seen);
        Some(tally.score())
    }

    fn refine(&self, model: &PoseModel<T>, residuals: &mut u32) -> Option<PoseModel<T>> {
        // A minimal model is off by more than the noise: inliers are gathered from three times the threshold first.
        let (wide, narrow) = (self.threshold * lit(WIDE), self.threshold);
        let near = self.approach(self.data, model, &Loss::Truncated(wide), WIDE_STEPS, 5, residuals)?;
        self.approach(self.data, &near, &Loss::Truncated(narrow), LOCAL_STEPS, 5, residuals)
    }

    fn differs(&self, optimum: &PoseModel<T>, other: &PoseModel<T>) -> bool {
        optimum.distance_sq(other) > lit(APART_SQ)
    }

    // Not inlined: its samples take no stack while a sample is solved.
    #[inline(never)]
    fn shares(&self, optimum: &PoseModel<T>, other: &PoseModel<T>, residuals: &mut u32) -> bool {
        let (a, b) = (self.agreeing(optimum, SAMPLED_BLOCKS), self.agreeing(other, SAMPLED_BLOCKS));
        let mut both = 0u32;
        for (a, b) in a.lanes.as_flattened().iter().zip(b.lanes.as_flattened()) {
            both += (a & b) as u32;
        }
        let seen = core::cmp::min(SAMPLED_BLOCKS * LANES, self.data.count) as u32;
        *residuals = residuals.saturating_add(2 * seen);
        let most = core::cmp::max(a.count, b.count);
        most.saturating_sub(both) <= most / UNSHARED_ONE_IN + UNSHARED
    }

    fn settles(&self, model: &PoseModel<T>, residuals: &mut u32) -> bool {
        let tried = TURN_PASSES * core::cmp::min(TURNED_BLOCKS * LANES, self.data.count) as u32;
        *residuals = residuals.saturating_add(tried);
        self.turns(model)
    }
}
