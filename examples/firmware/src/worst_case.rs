//! Bounds on the instructions of the robust estimators, for budgets in time.
//!
//! An estimate of N correspondences that draws k samples takes at most `a + b N + k (c + d N)` instructions on this core:
//! every sample may hand over all its hypotheses, each scored on all correspondences, and start a local optimisation.
//! The constants are those of a Cortex-M4F in `f32` at opt-level 3, from `cargo m4f worst_case`, with a margin of a tenth.
//! Other cores take [`CORE`] times as many; `cargo rv32imafc worst_case` checks that. Another compiler needs its own.

/// Instructions of this core for a hundred of a Cortex-M4F, at the most: with the FPU of Arm, with that of RISC-V
/// (no multiply-add is used on either), or without one. By the ratios of `budget.txt`, of which the largest are 1.33 and 67.
pub const CORE: u64 = if cfg!(fpu = "arm") {
    100
} else if cfg!(fpu = "riscv") {
    140
} else {
    7000
};

/// The constants of one estimator.
#[derive(Clone, Copy, Debug)]
pub struct Bound {
    /// a: whatever happens once.
    pub fixed: u64,
    /// b: loading, verdict and covariance, for each correspondence.
    pub per_point: u64,
    /// c: a sample, its solver and what its local optimisation does once.
    pub per_sample: u64,
    /// d: scores and local optimisation of a sample, for each correspondence.
    pub per_sample_and_point: u64,
}

impl Bound {
    /// On this core, from the constants of a Cortex-M4F.
    const fn on_this_core(fixed: u64, per_point: u64, per_sample: u64, per_sample_and_point: u64) -> Self {
        Self {
            fixed: fixed * CORE / 100,
            per_point: per_point * CORE / 100,
            per_sample: per_sample * CORE / 100,
            per_sample_and_point: per_sample_and_point * CORE / 100,
        }
    }

    /// Instructions at the most, of `n` correspondences and `samples` samples.
    #[must_use]
    pub const fn instructions(&self, n: u64, samples: u64) -> u64 {
        self.fixed + self.per_point * n + samples * (self.per_sample + self.per_sample_and_point * n)
    }

    /// The samples for which `n` correspondences surely stay within a budget of instructions, for
    /// `Budget::max_iterations`; none where the budget does not suffice for one.
    #[must_use]
    pub const fn max_iterations(&self, budget: u64, n: u64) -> Option<u32> {
        let once = self.fixed + self.per_point * n;
        let samples = budget.saturating_sub(once) / (self.per_sample + self.per_sample_and_point * n);
        match samples {
            0 => None,
            _ if samples > u32::MAX as u64 => Some(u32::MAX),
            _ => Some(samples as u32),
        }
    }
}

/// `estimate::relative_pose` of pinhole cameras.
pub const RELATIVE_POSE: Bound = Bound::on_this_core(2_000_000, 8_000, 200_000, 9_000);
/// `estimate::absolute_pose` of a pinhole camera, without a gravity prior.
pub const ABSOLUTE_POSE: Bound = Bound::on_this_core(200_000, 6_000, 40_000, 4_600);
/// `estimate::homography`.
pub const HOMOGRAPHY: Bound = Bound::on_this_core(300_000, 10_000, 20_000, 500);
/// `estimate::fundamental`.
pub const FUNDAMENTAL: Bound = Bound::on_this_core(2_000_000, 100_000, 100_000, 9_000);
