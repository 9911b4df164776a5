//! The truncated quadratic (MSAC) score, summed in four fixed lanes with early exit.

use crate::Real;
use crate::linalg::{LANES, Lanes};
use crate::real::{lit, ln};

/// How well a model explains all correspondences.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Score<T> {
    /// Sum over the correspondences of min(r^2 / threshold^2, 1): lower is better.
    pub cost: T,
    /// How many have r < threshold.
    pub inliers: u32,
}

/// When to give a hypothesis up before all its residuals are known: as soon as its cost exceeds the best model's, or
/// when Wald's sequential test holds that its inlier ratio is that of a wrong model.
///
/// # References
/// J. Matas, O. Chum, "Randomized RANSAC with sequential probability ratio test", ICCV 2005.
/// P. Torr, A. Zisserman, "MLESAC", CVIU 2000 (the truncated score; its limit is the bail-out test's).
#[derive(Clone, Copy, Debug)]
pub struct Gate<T> {
    /// Cost at which the hypothesis has lost.
    pub bound: T,
    /// Added to the log likelihood ratio by every inlier (negative).
    per_inlier: T,
    /// Added by every outlier (positive).
    per_outlier: T,
    /// Ratio at which the test rejects.
    limit: T,
}

/// A good hypothesis is given up with a probability of at most one in this many.
const REJECTION_ODDS: f64 = 2000.0;

impl<T: Real> Gate<T> {
    /// Nothing is given up.
    #[must_use]
    pub fn open() -> Self {
        Self { bound: T::MAX, per_inlier: T::ZERO, per_outlier: T::ZERO, limit: T::ONE }
    }

    /// Gives up at the cost `bound` alone.
    #[must_use]
    pub fn at(bound: T) -> Self {
        Self { bound, ..Self::open() }
    }

    /// Gives up at the cost `bound`, and by the sequential test between the inlier ratio `good` of the best model and
    /// the ratio `bad` of wrong ones; no test where they hardly differ.
    #[must_use]
    pub fn new(bound: T, good: T, bad: T) -> Self {
        let bad = crate::real::max(bad, lit::<T>(0.01));
        let good = crate::real::min(good, lit::<T>(0.99));
        if good < bad * lit::<T>(1.5) {
            return Self { bound, ..Self::open() };
        }
        Self {
            bound,
            per_inlier: ln(bad / good),
            per_outlier: ln((T::ONE - bad) / (T::ONE - good)),
            limit: ln(lit::<T>(REJECTION_ODDS)),
        }
    }

    /// True where a hypothesis with this tally has lost.
    #[cfg_attr(not(small), inline(always))]
    #[must_use]
    pub fn rejects(&self, cost: T, inliers: T, seen: T) -> bool {
        cost > self.bound || inliers * self.per_inlier + (seen - inliers) * self.per_outlier > self.limit
    }
}

/// A running score, lane by lane.
#[derive(Clone, Copy, Debug)]
pub struct Tally<T> {
    cost: Lanes<T>,
    inliers: Lanes<T>,
}

impl<T: Real> Tally<T> {
    /// Nothing seen.
    #[cfg_attr(not(small), inline(always))]
    #[must_use]
    pub fn new() -> Self {
        Self { cost: [T::ZERO; LANES], inliers: [T::ZERO; LANES] }
    }

    /// Adds squared residuals in units of the squared threshold. What is not below 1 (NaN too) costs 1.
    #[cfg_attr(not(small), inline(always))]
    pub fn add(&mut self, squared: &Lanes<T>) {
        for l in 0..LANES {
            let inside = squared[l] < T::ONE;
            self.cost[l] += if inside { squared[l] } else { T::ONE };
            self.inliers[l] += if inside { T::ONE } else { T::ZERO };
        }
    }

    /// Adds the first `count` lanes only.
    #[inline]
    pub fn add_first(&mut self, squared: &Lanes<T>, count: usize) {
        for l in 0..LANES {
            if l < count {
                let inside = squared[l] < T::ONE;
                self.cost[l] += if inside { squared[l] } else { T::ONE };
                self.inliers[l] += if inside { T::ONE } else { T::ZERO };
            }
        }
    }

    /// The cost so far.
    #[cfg_attr(not(small), inline(always))]
    #[must_use]
    pub fn cost(&self) -> T {
        (self.cost[0] + self.cost[1]) + (self.cost[2] + self.cost[3])
    }

    /// The inliers so far, as a number of the scalar type (exact below 2^24).
    #[cfg_attr(not(small), inline(always))]
    #[must_use]
    pub fn inliers(&self) -> T {
        (self.inliers[0] + self.inliers[1]) + (self.inliers[2] + self.inliers[3])
    }

    /// The score of a model whose every residual has been added.
    #[inline]
    #[must_use]
    pub fn score(&self) -> Score<T> {
        Score { cost: self.cost(), inliers: self.inliers().to_u32() }
    }
}

impl<T: Real> Default for Tally<T> {
    fn default() -> Self {
        Self::new()
    }
}
