//! The fundamental matrix as the engine's problem: seven-point hypotheses that keep the orientation, Sampson scores,
//! refinement; and from a plane and two correspondences off it.

use nalgebra::{Matrix3, Vector3};

use super::relief::{Admitting, Relief};
use crate::Real;
use crate::estimate::chance::{least_beyond_chance, line_accident};
use crate::estimate::neighbours::apart;
use crate::estimate::stride;
use crate::geometry::pose::skew;
use crate::linalg::{LANES, Lanes};
use crate::real::{from_u32, lit};
use crate::refine::blocks::{BlockSlice, EpipolarBlock, PlaneBlock};
use crate::refine::fundamental::FundamentalModel;
use crate::refine::lm::{Minimum, minimise};
use crate::robust::loss::Loss;
use crate::robust::{Estimator, Gate, Score, ScoreCounts, Tally};
use crate::solvers::{homography_4pt, relpose_7pt};

/// Blocks scored between two looks at the gate.
const CHUNK: usize = 2;
/// Passes over the data in the two stages of a local optimisation.
const WIDE_PASSES: u32 = 5;
const LOCAL_PASSES: u32 = 8;

/// Correspondences and what a score of them needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct EpipolarProblem<'a, T> {
    pub(super) data: BlockSlice<'a, PlaneBlock<T>>,
    /// The threshold in the blocks' unit.
    pub(super) threshold: T,
    /// Blocks between two that are scored one after the other.
    stride: usize,
}

impl<'a, T: Real> EpipolarProblem<'a, T> {
    pub(super) fn new(data: BlockSlice<'a, PlaneBlock<T>>, threshold: T) -> Self {
        Self { data, threshold, stride: stride(data.blocks.len()) }
    }

    fn points(&self, index: u32) -> Option<(Vector3<T>, Vector3<T>)> {
        let block = self.data.blocks.get(index as usize / LANES)?;
        let lane = index as usize % LANES;
        let at = |k: usize| block[k].get(lane).copied();
        Some((Vector3::new(at(0)?, at(1)?, T::ONE), Vector3::new(at(2)?, at(3)?, T::ONE)))
    }

    /// Squared residuals of a block in units of the squared threshold.
    #[cfg_attr(not(small), inline(always))]
    pub(super) fn squared(&self, block: &PlaneBlock<T>, f: &Matrix3<T>, scale: T) -> Lanes<T> {
        let (c, d) = block.residual(f);
        let mut squared = [T::ZERO; LANES];
        for l in 0..LANES {
            squared[l] = c[l] * c[l] * scale / d[l];
        }
        squared
    }

    /// What makes squared residuals units of the squared threshold.
    pub(super) fn scale(&self) -> T {
        T::ONE / (self.threshold * self.threshold)
    }

    /// The model that minimises a loss, from `model`, by what a relief admits, if there is one.
    pub(super) fn optimise(
        &self,
        model: &FundamentalModel<T>,
        relief: Option<&Relief<T>>,
        loss: &Loss<T>,
        passes: u32,
        tolerance: T,
    ) -> Minimum<FundamentalModel<T>, T, 7> {
        let start = Admitting { model: *model, relief };
        let Minimum { model, equations, passes } = minimise(self.data, &start, loss, passes, tolerance);
        Minimum { model: model.model, equations, passes }
    }

    /// The truncated cost of a model.
    pub(super) fn cost(&self, model: &FundamentalModel<T>) -> T {
        self.score_within(model, &Gate::open(), &mut ScoreCounts::default())
            .map_or(T::MAX, |score| score.cost)
    }

    fn score_within(
        &self,
        model: &FundamentalModel<T>,
        gate: &Gate<T>,
        counts: &mut ScoreCounts,
    ) -> Option<Score<T>> {
        let blocks = self.data.blocks;
        let scale = self.scale();
        let mut tally = Tally::new();
        let mut at = 0usize;
        let mut seen = 0u32;
        for _ in 0..blocks.len().div_ceil(CHUNK) {
            for _ in 0..CHUNK {
                // The last chunk may be short.
                if seen as usize >= self.data.count {
                    break;
                }
                if let Some(block) = blocks.get(at) {
                    let squared = self.squared(block, &model.matrix, scale);
                    let filled = core::cmp::min(self.data.count.saturating_sub(at * LANES), LANES);
                    if filled == LANES {
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
            }
            if gate.rejects(tally.cost(), tally.inliers(), from_u32(seen)) {
                counts.add_rejected(seen, tally.inliers().to_u32());
                return None;
            }
        }
        counts.add(seen);
        Some(tally.score())
    }

    fn optimise_locally(&self, model: &FundamentalModel<T>, residuals: &mut u32) -> FundamentalModel<T> {
        // A minimal model is off by more than the noise: inliers are gathered from twice the threshold first.
        let wide = Loss::Truncated(self.threshold * T::TWO);
        let first = self.optimise(model, None, &wide, WIDE_PASSES, lit(1e-3));
        let loss = Loss::Truncated(self.threshold);
        let minimum = self.optimise(&first.model, None, &loss, LOCAL_PASSES, lit(1e-4));
        let passes = first.passes + minimum.passes;
        *residuals = residuals.saturating_add(passes.saturating_mul(self.data.count as u32));
        minimum.model
    }
}

impl<T: Real> Estimator<T, 7> for EpipolarProblem<'_, T> {
    type Model = FundamentalModel<T>;

    fn count(&self) -> u32 {
        self.data.count as u32
    }

    fn least_consensus(&self) -> u32 {
        least_beyond_chance(self.data.count as u32, 7, line_accident(self.data, self.threshold))
    }

    fn apart(&self, a: u32, b: u32) -> Option<T> {
        Some(apart(&self.points(a)?, &self.points(b)?))
    }

    fn generate(&self, sample: &[u32; 7], found: &mut impl FnMut(&FundamentalModel<T>)) -> bool {
        let mut x1 = [Vector3::zeros(); 7];
        let mut x2 = [Vector3::zeros(); 7];
        for ((a, b), &index) in x1.iter_mut().zip(&mut x2).zip(sample) {
            let Some((p, q)) = self.points(index) else { return false };
            (*a, *b) = (p, q);
        }
        let solutions = relpose_7pt(&x1, &x2);
        for f in &solutions {
            if let Some(model) = FundamentalModel::new(&f.0)
                && oriented(&model, &x1, &x2)
            {
                found(&model);
            }
        }
        // Without noise a plane's equations are dependent: any epipole goes with its homography.
        if solutions.is_empty()
            && let ([a1, b1, c1, d1, ..], [a2, b2, c2, d2, ..]) = (x1, x2)
            && let Some(plane) = homography_4pt(&[a1, b1, c1, d1], &[a2, b2, c2, d2])
            && let Some(model) = FundamentalModel::new(&(skew(&Vector3::<T>::x()) * plane.0))
        {
            found(&model);
        }
        true
    }

    fn score(
        &self,
        model: &FundamentalModel<T>,
        gate: &Gate<T>,
        counts: &mut ScoreCounts,
    ) -> Option<Score<T>> {
        self.score_within(model, gate, counts)
    }

    fn refine(&self, model: &FundamentalModel<T>, residuals: &mut u32) -> Option<FundamentalModel<T>> {
        Some(self.optimise_locally(model, residuals))
    }
}

/// True where all points of a sample lie in front of both cameras or all behind: `e2 x x2` and `F x1` point the same way
/// for all, or opposite ways for all.
///
/// # References
/// O. Chum, T. Werner, J. Matas, "Epipolar geometry estimation via RANSAC benefits from the oriented epipolar constraint",
/// ICPR 2004.
fn oriented<T: Real>(model: &FundamentalModel<T>, x1: &[Vector3<T>; 7], x2: &[Vector3<T>; 7]) -> bool {
    let (mut positive, mut negative) = (false, false);
    for (a, b) in x1.iter().zip(x2) {
        let side = model.epipole2.cross(b).dot(&(model.matrix * a));
        positive |= side > T::ZERO;
        negative |= side < T::ZERO;
    }
    !(positive && negative)
}

/// The epipolar geometries that have a homography: `F = [e]x H`, of which two correspondences off its plane fix the
/// epipole, where the lines between transferred and measured points meet.
///
/// # References
/// O. Chum, T. Werner, J. Matas, "Two-view geometry estimation unaffected by a dominant plane", CVPR 2005.
pub(super) struct ParallaxProblem<'a, 'b, T: Real> {
    pub(super) problem: &'a EpipolarProblem<'b, T>,
    pub(super) homography: &'a Matrix3<T>,
    /// Correspondences off the plane.
    pub(super) off: &'a [u32],
}

impl<T: Real> Estimator<T, 2> for ParallaxProblem<'_, '_, T> {
    type Model = FundamentalModel<T>;

    fn count(&self) -> u32 {
        self.off.len() as u32
    }

    fn generate(&self, sample: &[u32; 2], found: &mut impl FnMut(&FundamentalModel<T>)) -> bool {
        let line = |k: u32| {
            let (x1, x2) = self.problem.points(*self.off.get(k as usize)?)?;
            Some((self.homography * x1).cross(&x2))
        };
        let [i, j] = *sample;
        let (Some(a), Some(b)) = (line(i), line(j)) else { return false };
        let Some(model) = FundamentalModel::new(&(skew(&a.cross(&b)) * self.homography)) else {
            return false;
        };
        found(&model);
        true
    }

    fn score(
        &self,
        model: &FundamentalModel<T>,
        gate: &Gate<T>,
        counts: &mut ScoreCounts,
    ) -> Option<Score<T>> {
        let mut score = self.problem.score_within(model, &Gate::at(gate.bound), counts)?;
        // The engine counts the agreement of what it samples from: all on the plane agree anyhow.
        let on = (self.problem.data.count as u32).saturating_sub(self.count());
        score.inliers = score.inliers.saturating_sub(on);
        Some(score)
    }

    fn refine(&self, model: &FundamentalModel<T>, residuals: &mut u32) -> Option<FundamentalModel<T>> {
        Some(self.problem.optimise_locally(model, residuals))
    }
}
