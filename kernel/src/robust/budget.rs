//! What a run may spend, what it spent, and why it stopped.

use core::fmt;

use crate::Real;
use crate::real::{is_finite, lit};

/// Limits and seed of a robust estimation. The defaults suit every estimator of this crate.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct RansacOptions<T> {
    /// Probability, in (0, 1), that a sample of inliers only has been drawn when the run stops by itself. A relative
    /// pose takes up to five times as many samples, until three of them have led to the same best optimum.
    /// Default 0.999.
    pub confidence: T,
    /// Iterations made at the least, so that one lucky sample does not end the run. Default 20. A relative pose with a prior
    /// makes fewer, of as many correspondences altogether.
    pub min_iterations: u32,
    /// What the run may spend at the most. Default: 10,000 iterations, 100,000 in options of two views' models (a
    /// relative pose, a homography, a fundamental matrix); everything else unlimited.
    pub budget: Budget,
    /// Seed of the samples; the same seed and input give the same bits. Default 1.
    pub seed: u64,
}

/// Upper limits of a run; `u32::MAX` stands for none, for counts end there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Budget {
    /// Samples drawn. Default 10,000; options of two views' models (relative pose, homography, fundamental matrix): 100,000.
    pub max_iterations: u32,
    /// Minimal problems solved (degenerate samples cost none). Default: no limit.
    pub max_solver_calls: u32,
    /// Residuals evaluated, of one correspondence under one model each. Default: no limit but 4.29e9, where the count
    /// ends. The search stays within it but for one local optimisation and what compares its model with the best. A
    /// hypothesis is looked at where two residuals of every correspondence are left (one of a relative pose, four with a
    /// prior, where hypotheses are polished), so that less than that scores nothing.
    pub max_residuals: u32,
}

impl Default for Budget {
    fn default() -> Self {
        Self { max_iterations: 10_000, max_solver_calls: u32::MAX, max_residuals: u32::MAX }
    }
}

impl Budget {
    /// What is left after `spent`.
    pub(crate) fn less(&self, spent: &Progress) -> Self {
        Self {
            max_iterations: self.max_iterations.saturating_sub(spent.iterations),
            max_solver_calls: self.max_solver_calls.saturating_sub(spent.solver_calls),
            max_residuals: self.max_residuals.saturating_sub(spent.residuals),
        }
    }
}

impl<T: Real> Default for RansacOptions<T> {
    fn default() -> Self {
        Self { confidence: lit::<T>(0.999), min_iterations: 20, budget: Budget::default(), seed: 1 }
    }
}

impl<T: Real> RansacOptions<T> {
    /// The defaults of two views' models, of which 10,000 samples miss some that a twelfth (a homography) to a fifth agree with.
    pub(crate) fn of_two_views() -> Self {
        Self { budget: Budget { max_iterations: 100_000, ..Budget::default() }, ..Self::default() }
    }

    /// What is wrong with the options, if anything.
    ///
    /// # Errors
    /// [`OptionsError::Confidence`] outside (0, 1), [`OptionsError::NoIterations`].
    pub fn check(&self) -> Result<(), OptionsError> {
        if !(self.confidence > T::ZERO && self.confidence < T::ONE) {
            return Err(OptionsError::Confidence);
        }
        if self.budget.max_iterations == 0 {
            return Err(OptionsError::NoIterations);
        }
        Ok(())
    }
}

/// Which option is out of its range. Outputs are untouched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum OptionsError {
    /// `max_error_px` is not a positive finite number.
    MaxError,
    /// `sigma_px` is given and not a positive finite number.
    Sigma,
    /// `confidence` is not inside (0, 1).
    Confidence,
    /// `max_iterations` is 0.
    NoIterations,
}

impl fmt::Display for OptionsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::MaxError => "max_error_px must be positive and finite",
            Self::Sigma => "sigma_px must be positive and finite",
            Self::Confidence => "confidence must lie between 0 and 1",
            Self::NoIterations => "max_iterations must not be 0",
        })
    }
}

impl core::error::Error for OptionsError {}

/// Checks a threshold and a noise level in pixels; gives the noise level, by default half the threshold.
pub(crate) fn check_noise<T: Real>(max_error_px: T, sigma_px: Option<T>) -> Result<T, OptionsError> {
    let positive = |x: T| is_finite(x) && x > T::ZERO;
    if !positive(max_error_px) {
        return Err(OptionsError::MaxError);
    }
    let sigma = sigma_px.unwrap_or(max_error_px * T::HALF);
    if positive(sigma) { Ok(sigma) } else { Err(OptionsError::Sigma) }
}

/// What a caller may know or want to decide during a run; [`Guide::none`] for neither.
pub struct Guide<'a, T> {
    /// One number a correspondence, lower is better (a descriptor distance or ratio): every other sample is drawn best
    /// first.
    /// NaN ranks last.
    pub scores: Option<&'a [T]>,
    /// "May I go on?", asked before every [`Guide::INTERVAL`]-th iteration, the first excepted.
    pub keep_going: Option<&'a mut dyn FnMut(&Progress) -> bool>,
}

impl<T> Guide<'_, T> {
    /// Iterations between two questions to `keep_going`.
    pub const INTERVAL: u32 = 8;

    /// An error where there are scores, but not one for each of `count` correspondences.
    ///
    /// # Errors
    /// [`InputError::LengthMismatch`](crate::InputError::LengthMismatch).
    pub fn check(&self, count: usize) -> Result<(), crate::InputError> {
        match self.scores {
            Some(scores) if scores.len() != count => {
                Err(crate::InputError::LengthMismatch { first: count, second: scores.len() })
            }
            _ => Ok(()),
        }
    }

    /// No scores and no questions.
    #[must_use]
    pub const fn none() -> Self {
        Guide { scores: None, keep_going: None }
    }
}

/// The question of a search that follows others, which is told what all of them have spent.
pub(crate) fn after<'a>(
    spent: Progress,
    keep_going: &'a mut Option<&mut dyn FnMut(&Progress) -> bool>,
) -> Option<impl FnMut(&Progress) -> bool + 'a> {
    keep_going.as_mut().map(move |ask| move |now: &Progress| ask(&now.plus(&spent)))
}

/// What a run has spent so far. Where an estimate takes several searches, each counts on from those before it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Progress {
    /// Samples drawn.
    pub iterations: u32,
    /// Minimal problems solved.
    pub solver_calls: u32,
    /// Hypotheses scored.
    pub hypotheses: u32,
    /// Residuals evaluated.
    pub residuals: u32,
    /// Local optimisations made.
    pub refinements: u32,
    /// Inliers of the best model.
    pub inliers: u32,
}

impl Progress {
    /// This, and what another search spent; the inliers are this one's.
    #[cfg_attr(small, inline(never))]
    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self {
            iterations: self.iterations.saturating_add(other.iterations),
            solver_calls: self.solver_calls.saturating_add(other.solver_calls),
            hypotheses: self.hypotheses.saturating_add(other.hypotheses),
            residuals: self.residuals.saturating_add(other.residuals),
            refinements: self.refinements.saturating_add(other.refinements),
            inliers: self.inliers,
        }
    }
}

/// Why a run ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StopReason {
    /// The confidence was reached: of the inliers found, or that no consensus of any use is there.
    #[default]
    Confident,
    /// `max_iterations` was reached.
    MaxIterations,
    /// `max_solver_calls` was reached.
    MaxSolverCalls,
    /// `max_residuals` was reached.
    MaxResiduals,
    /// The caller's `keep_going` answered no. The same input with `max_iterations` set to the reported number of
    /// iterations gives the same bits.
    Interrupted,
}

/// How a run went.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RansacReport<T> {
    /// What was spent.
    pub spent: Progress,
    /// Why it ended.
    pub stop: StopReason,
    /// Inliers of the model returned; 0 without one.
    pub inliers: u32,
    /// The model's truncated squared error: the sum over all correspondences of min(r^2 / threshold^2, 1).
    pub cost: T,
    /// Probability that no sample of inliers only was drawn, given the inliers found: the hypergeometric chance of
    /// one draw to the power of the iterations. 1 without a model. Ranked samples and those of near correspondences count as if
    /// they were uniform: where scores tell inliers at all, and inliers move as their neighbours do, the true probability
    /// is smaller, for those samples hold inliers more often; where they mislead, every other sample is uniform, and its
    /// square root bounds it (every fourth and the fourth root, with scores and near correspondences both).
    pub miss_probability: T,
    /// Without consensus: a larger share of inliers than this would have been sampled, with the confidence asked.
    pub excluded_inlier_ratio: T,
    /// What the best other solution that samples led to explains (the number of correspondences less the cost), as a share of
    /// what the best one does: near 1 where two explain the correspondences alike, and which is right stands open. 0 where
    /// no other was met, and of an estimator that tells none apart ([`differs`](super::Estimator::differs)), as those of
    /// homographies, fundamental matrices and absolute poses do not.
    pub rival_share: T,
}

impl<T: Real> RansacReport<T> {
    /// Of no run.
    pub(crate) fn none() -> Self {
        Self {
            spent: Progress::default(),
            stop: StopReason::MaxIterations,
            inliers: 0,
            cost: T::ZERO,
            miss_probability: T::ONE,
            excluded_inlier_ratio: T::ONE,
            rival_share: T::ZERO,
        }
    }
}
