//! What correspondences can say about the epipolar geometry of two images.

use crate::Real;
use crate::estimate::Unobservable;
use crate::geometry::{Fundamental, Homography};
use crate::robust::RansacReport;

/// What the correspondences say about the epipolar geometry of two images.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum FundamentalVerdict<T: Real> {
    /// `x2' F x1 = 0` between pixels, |F| = 1, of rank 2 to rounding.
    Found(Fundamental<T>),
    /// All inliers agree with one homography `x2 ~ H x1`, |H| = 1, of a plane or of a camera that only turned: every
    /// `F = [e]x H` explains them.
    Planar(Homography<T>),
    /// The inliers agree, but no epipolar geometry follows from them.
    Unobservable(Unobservable),
    /// So few correspondences that chance could explain them even if all agreed.
    TooFewInliers,
    /// No epipolar geometry explains more correspondences than chance.
    NoConsensus,
}

/// A verdict and how it was reached.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct FundamentalEstimate<T: Real> {
    /// The verdict.
    pub verdict: FundamentalVerdict<T>,
    /// Robust estimate of the noise of one image coordinate from the inliers' residuals, pixels; 0 without inliers.
    pub noise_px: T,
    /// How the search went.
    pub report: RansacReport<T>,
}

impl<T: Real> FundamentalEstimate<T> {
    /// The fundamental matrix, where one was found.
    #[must_use]
    pub fn fundamental(&self) -> Option<Fundamental<T>> {
        match self.verdict {
            FundamentalVerdict::Found(f) => Some(f),
            _ => None,
        }
    }
}
