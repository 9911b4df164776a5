//! What the caller chooses, and what an optimisation reports.

use super::BundleError;
use crate::Real;
use crate::real::{is_finite, lit, max};
use crate::robust::loss::Loss;

/// Which unknowns move. Fixed frames and fixed points never do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Unknowns {
    /// Frames and points.
    #[default]
    FramesAndPoints,
    /// Frames alone: points are held where they are.
    Frames,
    /// Points alone: frames are held where they are.
    Points,
}

/// Options of [`Window::optimise`](super::Window::optimise).
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BundleOptions<T> {
    /// The loss on an observation's distance in standard deviations. [`Loss::Huber`] has one minimum more often;
    /// a redescending loss ([`Loss::Tukey`], [`Loss::GemanMcClure`], [`Loss::Cauchy`]) forgets gross errors
    /// altogether, and needs a good start.
    pub loss: Loss<T>,
    /// Which unknowns move.
    pub unknowns: Unknowns,
    /// Iterations at the most, rejected steps included.
    pub max_iterations: u32,
    /// Evaluations of observations at the most, three to an observation and iteration: the budget of time. An
    /// iteration that would go beyond it is not begun.
    pub max_evaluations: u32,
    /// Converged where an iteration lowers the cost by less than this share of it, or of what residuals of a thirtieth
    /// of their standard deviation would cost.
    pub cost_tolerance: T,
    /// Damping of the first iteration, relative to the diagonal.
    pub initial_damping: T,
    /// An observation further off than this many standard deviations is reported as an outlier.
    pub outlier_sigma: T,
}

impl<T: Real> Default for BundleOptions<T> {
    /// Huber's loss at 1.5 standard deviations, 20 iterations, a cost tolerance of 1e-7.
    fn default() -> Self {
        Self {
            loss: Loss::Huber(lit(1.5)),
            unknowns: Unknowns::FramesAndPoints,
            max_iterations: 20,
            max_evaluations: u32::MAX,
            cost_tolerance: max(lit(1e-7), T::EPSILON),
            initial_damping: lit(1e-4),
            outlier_sigma: lit(3.0),
        }
    }
}

impl<T: Real> BundleOptions<T> {
    pub(super) fn check(&self) -> Result<(), BundleError> {
        let scale = match self.loss {
            Loss::Squared => T::ONE,
            Loss::Truncated(k)
            | Loss::Huber(k)
            | Loss::Cauchy(k)
            | Loss::Tukey(k)
            | Loss::GemanMcClure(k) => k,
        };
        for (option, value) in [
            ("loss", scale),
            ("initial_damping", self.initial_damping),
            ("outlier_sigma", self.outlier_sigma),
        ] {
            if !(value > T::ZERO && is_finite(value)) {
                return Err(BundleError::BadOption { option });
            }
        }
        if !(self.cost_tolerance >= T::ZERO && is_finite(self.cost_tolerance)) {
            return Err(BundleError::BadOption { option: "cost_tolerance" });
        }
        Ok(())
    }
}

/// Why an optimisation ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Termination {
    /// The cost falls no further than the tolerance.
    Converged,
    /// [`BundleOptions::max_iterations`] are done.
    IterationLimit,
    /// The next iteration would exceed [`BundleOptions::max_evaluations`].
    BudgetSpent,
    /// The caller said no.
    Interrupted,
    /// No step lowers the cost, however strongly damped, although the gradient promises one: the limit of rounding, or
    /// points at the edge of a camera's view.
    NoProgress,
}

/// What the caller is told before each iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Progress<T> {
    /// Iterations done.
    pub iterations: u32,
    /// The cost, `1/2 sum rho`, of where the window is now.
    pub cost: T,
    /// The damping of the next iteration.
    pub damping: T,
    /// Evaluations of observations done.
    pub evaluations: u32,
}

/// What an optimisation did.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub struct BundleReport<T> {
    /// Why it ended.
    pub termination: Termination,
    /// Whether any frame or point has moved.
    pub changed: bool,
    /// Iterations, rejected steps included.
    pub iterations: u32,
    /// `1/2 sum rho` of observations, priors and distances before.
    pub cost_before: T,
    /// The same after; never larger.
    pub cost_after: T,
    /// Observations that counted.
    pub observations: usize,
    /// Of them, beyond [`BundleOptions::outlier_sigma`] afterwards. More than half of all: the start, the data or the
    /// fixed frames contradict each other, and the result is not to be trusted.
    pub outliers: usize,
    /// Observations that did not count, because the point was behind the camera or outside its model.
    pub behind: usize,
    /// Free points that did not move, seen fewer than twice.
    pub unused_points: usize,
    /// Evaluations of observations.
    pub evaluations: u32,
}

/// How well the observations of one point agree with it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PointReport<T> {
    /// Observations.
    pub observations: usize,
    /// Of them, beyond the number of standard deviations asked for.
    pub outliers: usize,
    /// Of them, where the camera does not see the point at all.
    pub behind: usize,
    /// Root mean square of the distances, in standard deviations, of those that see it.
    pub rms_sigma: T,
}
