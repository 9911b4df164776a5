//! What the engine asks of a problem.

use super::score::{Gate, Score};
use crate::Real;

/// A model-fitting problem over numbered correspondences, with minimal samples of `S`.
///
/// An implementation owns or borrows the correspondences. Every method is a pure function of its arguments and of
/// them, so that a run is repeated bit for bit.
pub trait Estimator<T: Real, const S: usize> {
    /// What is estimated.
    type Model: Copy;

    /// How many hypotheses that come near the best one are optimised locally at once, beside those that are better. Fewer
    /// serve where a minimal sample already fixes the model well.
    const NEAR_MISSES: u32 = 10;

    /// Beyond those, one in as many iterations.
    const NEAR_MISS_INTERVAL: u32 = 32;

    /// How many local optimisations must have led to the best optimum for a run to end with the samples that one of
    /// inliers only takes: more than one where samples of noisy inliers lead to different optima. Half as many, rounded up,
    /// do where most correspondences agree with the best one.
    const DISCOVERIES: u32 = 1;

    /// The same where another solution ([`differs`](Self::differs)) scores almost as well: samples of either may be the
    /// rarer ones, and it takes more of them to know which is best.
    const RIVALLED_DISCOVERIES: u32 = Self::DISCOVERIES;

    /// Residuals of one correspondence that [`polish`](Self::polish) and [`score`](Self::score) together evaluate at the
    /// most, for one hypothesis.
    const SCORE_PASSES: u32 = 2;

    /// How many correspondences there are.
    fn count(&self) -> u32;

    /// How many correspondences must agree with a model for it to be of any use: a run that has found fewer ends once
    /// samples enough for so many have been drawn. Asked once, after 256 iterations. 0: such a run goes to its limits.
    fn least_consensus(&self) -> u32 {
        0
    }

    /// Hands every model of a minimal sample that passes its own checks (cheirality, orientation) to `found`; false,
    /// and nothing handed over, where the sample was rejected as degenerate before it was solved.
    fn generate(&self, sample: &[u32; S], found: &mut impl FnMut(&Self::Model)) -> bool;

    /// A hypothesis as it is to be scored; none where it is not worth that: where it is unlikely to cost less than
    /// `bound`, which is none at first (`T::MAX`). Serves problems whose minimal models are off by more than the noise.
    /// Adds the residuals evaluated.
    fn polish(&self, model: &Self::Model, _bound: T, _counts: &mut ScoreCounts) -> Option<Self::Model> {
        Some(*model)
    }

    /// The score of a model, or none where `gate` rejected it; adds the residuals evaluated and, of a rejected model,
    /// its inliers to the counts.
    fn score(&self, model: &Self::Model, gate: &Gate<T>, counts: &mut ScoreCounts) -> Option<Score<T>>;

    /// The model after local optimisation on its inliers; none where that failed. Adds the residuals evaluated.
    fn refine(&self, model: &Self::Model, residuals: &mut u32) -> Option<Self::Model>;

    /// How far apart two correspondences are, in any unit, where near ones are right together more often than others: then
    /// samples of near ones are sooner of right ones only, and every other one is. None where that is not so. Asked 16 times a
    /// sample at the most.
    fn apart(&self, _a: u32, _b: u32) -> Option<T> {
        None
    }

    /// True where a sample is not worth its model, because it would lead to `best`, the best model so far, again.
    fn repeats(&self, _sample: &[u32; S], _best: &Self::Model) -> bool {
        false
    }

    /// True where a polished model is so near `best`, the best model so far, that nothing but the same optimum can come of
    /// it: then it is not scored, and no discovery. How near that is depends on the threshold, too: optimisation on the
    /// inliers of a tight one reaches less far.
    fn leads_back(&self, _model: &Self::Model, _best: &Self::Model) -> bool {
        false
    }

    /// True where two optima are different solutions, not one that was reached more and less exactly; never, where solutions
    /// are not told apart.
    fn differs(&self, _optimum: &Self::Model, _other: &Self::Model) -> bool {
        false
    }

    /// True where two different solutions explain the same correspondences but for a few, as any two poses do between which a
    /// plane or a rotation leaves the choice: then more samples hardly tell them apart, and in a run of more than a few
    /// samples [`RIVALLED_DISCOVERIES`](Self::RIVALLED_DISCOVERIES) are not asked for. Adds the residuals evaluated.
    fn shares(&self, _optimum: &Self::Model, _other: &Self::Model, _residuals: &mut u32) -> bool {
        false
    }

    /// True where more samples would lead to a model that is no better than this one, the best so far, for what all of
    /// them tell: then [`DISCOVERIES`](Self::DISCOVERIES) asks for no more. Adds the residuals evaluated.
    fn settles(&self, _model: &Self::Model, _residuals: &mut u32) -> bool {
        false
    }

    /// True where the model, although it scores best, must not stand.
    fn reject(&self, _model: &Self::Model) -> bool {
        false
    }
}

/// What scoring adds up.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ScoreCounts {
    /// Residuals evaluated.
    pub residuals: u32,
    /// Residuals evaluated of rejected models.
    pub rejected_residuals: u32,
    /// Inliers among those.
    pub rejected_inliers: u32,
}

impl ScoreCounts {
    /// Adds a model's residuals.
    pub(crate) fn add(&mut self, residuals: u32) {
        self.residuals = self.residuals.saturating_add(residuals);
    }

    /// Adds a rejected model's; the share of its inliers is not asked more exactly than by 32 bits of them.
    pub(crate) fn add_rejected(&mut self, residuals: u32, inliers: u32) {
        self.add(residuals);
        if let Some(sum) = self.rejected_residuals.checked_add(residuals) {
            self.rejected_residuals = sum;
            self.rejected_inliers += inliers;
        }
    }
}
