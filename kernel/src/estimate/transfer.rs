//! A homography as the engine's problem: four-point hypotheses, transfer scores, refinement.

use nalgebra::Vector3;

use crate::Real;
use crate::linalg::LANES;
use crate::real::{from_u32, lit};
use crate::refine::blocks::{BlockSlice, EpipolarBlock};
use crate::refine::homography::{HomographyModel, transfer_equations, transfer_sq};
use crate::refine::lm::{Minimum, Tangents, descend};
use crate::robust::loss::Loss;
use crate::robust::{Estimator, Gate, Score, ScoreCounts, Tally};
use crate::solvers::homography_4pt;

use super::stride;

/// Correspondences and what a transfer score of them needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct TransferProblem<'a, T, B> {
    pub(super) data: BlockSlice<'a, B>,
    /// The threshold in the blocks' unit.
    pub(super) threshold: T,
    /// Samples are drawn from these correspondences; from all without it.
    pub(super) subset: Option<&'a [u32]>,
}

/// Passes over the data in a local optimisation.
const LOCAL_PASSES: u32 = 5;

impl<T: Real, B: EpipolarBlock<T>> TransferProblem<'_, T, B> {
    fn points(&self, index: u32) -> Option<(Vector3<T>, Vector3<T>)> {
        let index = match self.subset {
            Some(subset) => *subset.get(index as usize)?,
            None => index,
        };
        let block = self.data.blocks.get(index as usize / LANES)?;
        let ([x1, y1, x2, y2], _) = block.on_planes(index as usize % LANES)?;
        Some((Vector3::new(x1, y1, T::ONE), Vector3::new(x2, y2, T::ONE)))
    }

    /// The truncated cost of a model.
    pub(super) fn cost(&self, model: &HomographyModel<T>) -> T {
        let score = self.score(model, &Gate::open(), &mut ScoreCounts::default());
        score.map_or(T::MAX, |score| score.cost)
    }

    /// The model that minimises a loss, from `model`.
    pub(super) fn optimise<M: Tangents<T, P>, const P: usize>(
        &self,
        model: &M,
        loss: &Loss<T>,
        passes: u32,
        tolerance: T,
    ) -> Minimum<M, T, P> {
        let sums = |model: &M| transfer_equations(self.data, model, loss);
        descend(model, P as u32, passes, tolerance, sums, M::retract)
    }
}

impl<T: Real, B: EpipolarBlock<T>> Estimator<T, 4> for TransferProblem<'_, T, B> {
    type Model = HomographyModel<T>;

    const NEAR_MISSES: u32 = 2;

    // One does where most correspondences agree.
    const DISCOVERIES: u32 = 2;

    fn count(&self) -> u32 {
        self.subset.map_or(self.data.count, <[u32]>::len) as u32
    }

    fn generate(&self, sample: &[u32; 4], found: &mut impl FnMut(&HomographyModel<T>)) -> bool {
        let mut x1 = [Vector3::zeros(); 4];
        let mut x2 = [Vector3::zeros(); 4];
        for ((a, b), &index) in x1.iter_mut().zip(&mut x2).zip(sample) {
            let Some((p, q)) = self.points(index) else { return false };
            (*a, *b) = (p, q);
        }
        // The solver itself rejects collinear triples and flipped ones before it solves.
        let Some(h) = homography_4pt(&x1, &x2) else { return false };
        if let Some(model) = HomographyModel::new(&h.0) {
            found(&model);
        }
        true
    }

    fn score(
        &self,
        model: &HomographyModel<T>,
        gate: &Gate<T>,
        counts: &mut ScoreCounts,
    ) -> Option<Score<T>> {
        let blocks = self.data.blocks;
        let scale = T::ONE / (self.threshold * self.threshold);
        let stride = stride(blocks.len());
        let mut tally = Tally::new();
        let mut at = 0usize;
        let mut seen = 0u32;
        for k in 0..blocks.len() {
            if let Some(block) = blocks.get(at) {
                let squared = transfer_sq(&model.0, block, scale);
                let filled = self.data.count.saturating_sub(at * LANES);
                if filled >= LANES {
                    tally.add(&squared);
                } else {
                    tally.add_first(&squared, filled);
                }
                seen += core::cmp::min(filled, LANES) as u32;
            }
            at += stride;
            if at >= blocks.len() {
                at -= blocks.len();
            }
            if k % 2 == 1 && gate.rejects(tally.cost(), tally.inliers(), from_u32(seen)) {
                counts.add_rejected(seen, tally.inliers().to_u32());
                return None;
            }
        }
        counts.add(seen);
        let mut score = tally.score();
        score.inliers = core::cmp::min(score.inliers, self.count());
        Some(score)
    }

    fn refine(&self, model: &HomographyModel<T>, residuals: &mut u32) -> Option<HomographyModel<T>> {
        // A minimal model is off by more than the noise: what lies within twice the threshold takes part, at a weight that
        // falls with the error. The caller polishes the best.
        let loss = Loss::Tukey(self.threshold * T::TWO);
        let minimum = self.optimise(model, &loss, LOCAL_PASSES, lit(1e-2));
        *residuals = residuals.saturating_add(minimum.passes.saturating_mul(self.data.count as u32));
        HomographyModel::new(&minimum.model.0)
    }
}
