//! The deterministic RANSAC engine: sampling, scoring, stopping and budgets, over the [`Estimator`] trait.
//!
//! The engine knows no solver and no refinement; both reach it through the trait. The same seed and input give the
//! same bits on every target: samples come from a counter, sums run in a fixed order, and nothing depends on the
//! width of `usize` or on the capacity of a workspace.

pub(crate) mod budget;
mod estimator;
pub mod loss;
mod rank;
mod ransac;
mod sampler;
mod score;
mod stopping;

pub use budget::{Budget, Guide, OptionsError, Progress, RansacOptions, RansacReport, StopReason};
pub use estimator::{Estimator, ScoreCounts};
pub use rank::rank_by_score;
pub use ransac::{Consensus, ransac};
pub use sampler::Sampler;
pub use score::{Gate, Score, Tally};
pub use stopping::{
    iterations_needed, log_binomial_tail, miss_probability, probability_of_inlier_sample,
    undetected_inlier_ratio,
};
