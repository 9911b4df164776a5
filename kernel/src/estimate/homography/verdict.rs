//! What correspondences can say about a homography between two images.

use nalgebra::{SMatrix, Vector2};

use crate::Real;
use crate::estimate::Unobservable;
use crate::geometry::Homography;
use crate::robust::RansacReport;

/// What the correspondences say about a homography.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum HomographyVerdict<T: Real> {
    /// A homography and its uncertainty.
    Found(FoundHomography<T>),
    /// The inliers agree, but many homographies explain them.
    Unobservable(Unobservable),
    /// So few correspondences that chance could explain them even if all agreed.
    TooFewInliers,
    /// No homography explains more correspondences than chance.
    NoConsensus,
}

/// A homography `x2 ~ H x1` between pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoundHomography<T: Real> {
    /// `H` of Frobenius norm 1, with the sign that makes `x2 = lambda H x1`, lambda > 0, for the inliers.
    pub homography: Homography<T>,
    /// Four pixels of view 1, the corners of the box around the inliers (drawn in where the plane's horizon crosses it),
    /// in the order (left, top), (right, top), (right, bottom), (left, bottom). `H` is known as well as where they go.
    pub corners: [Vector2<T>; 4],
    /// Covariance of the pixels of view 2 to which `H` takes the corners, px^2, in the order u, v of corner 0, u, v of
    /// corner 1, ...: the eight degrees of freedom of `H`. None where the inliers leave a direction open.
    pub covariance: Option<SMatrix<T, 8, 8>>,
}

/// A verdict and how it was reached.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct HomographyEstimate<T: Real> {
    /// The verdict.
    pub verdict: HomographyVerdict<T>,
    /// Robust estimate of the noise of one image coordinate from the inliers' residuals, pixels; 0 without inliers.
    pub noise_px: T,
    /// How the search went.
    pub report: RansacReport<T>,
}

impl<T: Real> HomographyEstimate<T> {
    /// The homography, where one was found.
    #[must_use]
    pub fn homography(&self) -> Option<Homography<T>> {
        match &self.verdict {
            HomographyVerdict::Found(found) => Some(found.homography),
            _ => None,
        }
    }
}
