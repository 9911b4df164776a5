//! From a consensus to a verdict on the epipolar geometry.

use super::hypothesis::{EpipolarProblem, ParallaxProblem};
use super::relief::Relief;
use super::verdict::FundamentalVerdict;
use crate::Real;
use crate::estimate::Unobservable;
use crate::estimate::chance::{EXPLAINED_SIGMAS, beyond_chance, line_accident, measured_accident};
use crate::estimate::degenerate::{few_distinct, few_repeated, list, mostly_on_a_line, on_a_line};
use crate::estimate::frame::PixelFrame;
use crate::estimate::transfer::TransferProblem;
use crate::real::{from_u32, lit, max, sqrt};
use crate::refine::blocks::EpipolarBlock;
use crate::refine::fundamental::FundamentalModel;
use crate::refine::homography::{HomographyModel, transfer_sq};
use crate::robust::loss::Loss;
use crate::robust::{Budget, RansacOptions, ransac};

/// Passes over the data of the last refinement.
const FINAL_PASSES: u32 = 10;
/// Where the loss of its two stages ends, in thresholds: of noise of half a threshold one in 1,500 lies beyond the second.
const WIDE_SUPPORT: f64 = 2.0;
const SUPPORT: f64 = 1.7;
/// Times that what is too near is told from the rest, for a better model tells better.
const LOOKS: u32 = 2;
/// A plane must explain so many of the inliers to be the verdict, those aside that are off it by accident: as many as wrong
/// correspondences bring, and the two that fix the epipole of a planar scene.
const PLANE_SHARE: f64 = 0.85;
const FREE: u32 = 2;
/// A plane is looked for with the threshold of this many standard deviations.
const PLANE_SIGMAS: f64 = 3.5;

/// What the verdict needs beside the problem.
pub(super) struct Judge<'a, 'b, T: Real> {
    pub(super) problem: &'a EpipolarProblem<'b, T>,
    /// Standard deviation of a coordinate in the blocks' unit, as the options have it.
    pub(super) sigma: T,
    pub(super) frame: &'a PixelFrame<T>,
    pub(super) seed: u64,
}

/// How a plane divides the correspondences.
struct Split {
    /// Inliers that the plane explains.
    on: u32,
    /// Inliers that it does not.
    off: u32,
    /// Correspondences, inliers or not, that it does not explain.
    outside: u32,
}

impl<T: Real> Judge<'_, '_, T> {
    /// The chance of a wrong correspondence to be an inlier.
    fn accident(&self) -> T {
        line_accident(self.problem.data, self.problem.threshold)
    }

    /// The verdict where no model explains more than chance does.
    pub(super) fn without_model(&self, mask: &mut [bool], order: &mut [u32]) -> FundamentalVerdict<T> {
        mask.iter_mut().for_each(|inlier| *inlier = true);
        let data = self.problem.data;
        let count = data.count as u32;
        let accident = self.accident();
        let all = list(mask, order);
        let verdict = if !beyond_chance(count, count, 7, accident) {
            FundamentalVerdict::TooFewInliers
        } else if few_repeated(data, 7, self.sigma, accident) {
            FundamentalVerdict::Unobservable(Unobservable::TooFewDistinct)
        } else if mostly_on_a_line(data, all, self.sigma) {
            FundamentalVerdict::Unobservable(Unobservable::Collinear)
        } else {
            FundamentalVerdict::NoConsensus
        };
        mask.iter_mut().for_each(|inlier| *inlier = false);
        verdict
    }

    /// The verdict on the best model, and the noise in the blocks' unit; writes the inlier mask.
    pub(super) fn verdict(
        &self,
        best: &FundamentalModel<T>,
        mask: &mut [bool],
        order: &mut [u32],
    ) -> (FundamentalVerdict<T>, T) {
        let data = self.problem.data;
        let count = data.count as u32;
        let mut model = self.refine(best);
        let scale = self.problem.scale();
        let accident = measured_accident(data, self.accident(), 3, 2, |block, other| {
            self.problem.squared(&block.mispaired(other), &model.matrix, scale)
        });
        let inliers = self.mark(&model, mask);
        if !beyond_chance(count, inliers, 7, accident) {
            return (self.without_model(mask, order), T::ZERO);
        }
        model = self.relieve(&model);
        let inliers = self.mark(&model, mask);
        let noise = self.noise(&model);
        // Where the options promise less noise than there is, the data are believed.
        let sigma = max(self.sigma, noise);
        let indices = list(mask, order);
        if few_distinct(data, &mut indices.iter().copied(), 7, sigma, &|| accident) {
            return (FundamentalVerdict::Unobservable(Unobservable::TooFewDistinct), noise);
        }
        if on_a_line(data, indices, sigma, &|| accident) {
            return (FundamentalVerdict::Unobservable(Unobservable::Collinear), noise);
        }
        if let Some(plane) = self.plane(indices, sigma) {
            let split = self.split(&plane, sigma, mask, order);
            // Of seven inliers, five or more will often lie on a plane that holds most: the model may follow the plane and
            // two accidents.
            if 2 * split.on > inliers {
                let off = order.get(..split.outside as usize).unwrap_or(&[]);
                if let Some(other) = self.through(&plane, off) {
                    let other = self.relieve(&self.refine(&other));
                    if self.problem.cost(&other) < self.problem.cost(&model) {
                        model = other;
                        self.mark(&model, mask);
                    }
                }
                let split = self.split(&plane, sigma, mask, order);
                let accidents = from_u32::<T>(split.outside) * accident + from_u32(FREE);
                let off = max(from_u32::<T>(split.off) - accidents, T::ZERO);
                let on = from_u32::<T>(split.on);
                let holds = on >= (on + off) * lit(PLANE_SHARE);
                if holds
                    && !beyond_chance(split.outside, split.off, FREE, accident)
                    && let Some(homography) = self.frame.homography(&plane.0)
                {
                    self.mark_plane(&plane, sigma, mask);
                    return (FundamentalVerdict::Planar(homography), noise);
                }
            }
        }
        match self.frame.fundamental(&model.matrix) {
            Some(fundamental) => (FundamentalVerdict::Found(fundamental), self.noise(&model)),
            None => (self.without_model(mask, order), T::ZERO),
        }
    }

    /// The model that all inliers support: first with what lies just beyond the threshold at a falling weight, then with all
    /// of what noise explains at the same.
    fn refine(&self, model: &FundamentalModel<T>) -> FundamentalModel<T> {
        let wide = Loss::Tukey(self.problem.threshold * lit(WIDE_SUPPORT));
        let near = self.problem.optimise(model, None, &wide, FINAL_PASSES, lit(1e-3)).model;
        self.fit(&near, None)
    }

    /// The same of what is not too near to be right.
    fn relieve(&self, model: &FundamentalModel<T>) -> FundamentalModel<T> {
        let mut model = *model;
        for _ in 0..LOOKS {
            let relief = Relief::of(self.problem, &model, self.support());
            model = self.fit(&model, relief.as_ref());
        }
        model
    }

    fn fit(&self, model: &FundamentalModel<T>, relief: Option<&Relief<T>>) -> FundamentalModel<T> {
        let loss = Loss::Truncated(self.support());
        self.problem.optimise(model, relief, &loss, FINAL_PASSES, lit(1e-6)).model
    }

    fn support(&self) -> T {
        self.problem.threshold * lit(SUPPORT)
    }

    /// Writes the inliers and counts them.
    fn mark(&self, model: &FundamentalModel<T>, mask: &mut [bool]) -> u32 {
        let scale = self.problem.scale();
        let mut entries = mask.iter_mut();
        let mut inliers = 0;
        for block in self.problem.data.blocks {
            let squared = self.problem.squared(block, &model.matrix, scale);
            for (&s, inlier) in squared.iter().zip(entries.by_ref()) {
                *inlier = s < T::ONE;
                inliers += *inlier as u32;
            }
        }
        inliers
    }

    /// Root of the mean squared residual of the inliers.
    fn noise(&self, model: &FundamentalModel<T>) -> T {
        let problem = self.problem;
        let sums = problem.optimise(model, None, &Loss::Truncated(problem.threshold), 1, T::ZERO).equations;
        let outside = from_u32::<T>((problem.data.count as u32).saturating_sub(sums.active));
        let squares = sums.cost - outside * problem.threshold * problem.threshold;
        sqrt(max(squares, T::ZERO) / from_u32(core::cmp::max(sums.active.saturating_sub(7), 1)))
    }

    /// The plane that holds the most inliers, refined.
    fn plane(&self, inliers: &[u32], sigma: T) -> Option<HomographyModel<T>> {
        let threshold = sigma * lit(PLANE_SIGMAS);
        let problem = TransferProblem { data: self.problem.data, threshold, subset: Some(inliers) };
        let budget = Budget { max_iterations: 60, ..Budget::default() };
        let options = RansacOptions { seed: self.seed, confidence: lit(0.99), min_iterations: 10, budget };
        let (model, _) = ransac(&problem, &options, None, 8, None).best?;
        HomographyModel::new(&problem.optimise(&model, &Loss::Truncated(threshold), 8, lit(1e-6)).model.0)
    }

    /// The best epipolar geometry that has a plane's homography.
    fn through(&self, plane: &HomographyModel<T>, off: &[u32]) -> Option<FundamentalModel<T>> {
        let problem = ParallaxProblem { problem: self.problem, homography: &plane.0, off };
        let budget = Budget { max_iterations: 500, ..Budget::default() };
        let options = RansacOptions { seed: self.seed, confidence: lit(0.999), min_iterations: 20, budget };
        ransac(&problem, &options, None, 2, None).best.map(|(model, _)| model)
    }

    /// How a plane divides the correspondences; those outside are listed in `order`.
    fn split(&self, plane: &HomographyModel<T>, sigma: T, mask: &[bool], order: &mut [u32]) -> Split {
        let limit = sigma * sigma * lit(EXPLAINED_SIGMAS * EXPLAINED_SIGMAS);
        let mut entries = mask.iter().zip(0u32..);
        let mut free = order.iter_mut();
        let mut split = Split { on: 0, off: 0, outside: 0 };
        for block in self.problem.data.blocks {
            let squared = transfer_sq(&plane.0, block, T::ONE);
            for (&s, (&inlier, index)) in squared.iter().zip(entries.by_ref()) {
                if s < limit {
                    split.on += inlier as u32;
                } else if let Some(entry) = free.next() {
                    split.off += inlier as u32;
                    split.outside += 1;
                    *entry = index;
                }
            }
        }
        split
    }

    /// Writes what a plane explains.
    fn mark_plane(&self, plane: &HomographyModel<T>, sigma: T, mask: &mut [bool]) {
        let limit = sigma * sigma * lit(EXPLAINED_SIGMAS * EXPLAINED_SIGMAS);
        let mut entries = mask.iter_mut();
        for block in self.problem.data.blocks {
            let squared = transfer_sq(&plane.0, block, T::ONE);
            for (&s, inlier) in squared.iter().zip(entries.by_ref()) {
                *inlier = s < limit;
            }
        }
    }
}
