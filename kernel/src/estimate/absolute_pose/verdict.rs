//! What 2-D to 3-D correspondences can say about the pose of a camera.

use nalgebra::Matrix6;

use crate::estimate::{PriorFit, Unobservable};
use crate::geometry::Pose;
use crate::robust::RansacReport;
use crate::{Real, Solutions};

/// What correspondences of pixels and world points say about the pose.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum AbsolutePoseVerdict<T: Real> {
    /// One pose explains the inliers.
    Pose(AbsolutePose<T>),
    /// The inliers lie (nearly) on a plane, and two poses explain them alike within the noise: the more likely first.
    PlanarAmbiguity(Solutions<AbsolutePose<T>, 2>),
    /// The inliers agree, but no pose follows from them.
    Unobservable(Unobservable),
    /// The points agree with the pixels only behind the camera: a frame's axis points backwards, or left and right
    /// are exchanged.
    BehindCamera,
    /// Something agrees, on fewer correspondences than chance could explain.
    TooFewInliers,
    /// No pose explains more correspondences than chance.
    NoConsensus,
}

/// A pose with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AbsolutePose<T: Real> {
    /// World to camera, in the unit of the points.
    pub pose: Pose<T>,
    /// Covariance of the rotation vector w of `R <- Exp(w) R` (rad), then of t; none where the inliers leave a
    /// direction open.
    pub covariance: Option<Matrix6<T>>,
    /// Root mean square of the inliers' reprojection errors, pixels.
    pub rms_px: T,
}

/// A verdict and how it was reached.
#[derive(Clone, Debug, PartialEq)]
#[must_use]
pub struct AbsolutePoseEstimate<T: Real> {
    /// The verdict.
    pub verdict: AbsolutePoseVerdict<T>,
    /// Of a gravity prior: whether it fits; none without a prior or a pose.
    pub gravity: Option<PriorFit<T>>,
    /// Estimate of the noise of one image coordinate from the inliers' residuals, pixels; 0 without a pose.
    pub noise_px: T,
    /// How the search went.
    pub report: RansacReport<T>,
}

impl<T: Real> AbsolutePoseEstimate<T> {
    /// The pose, or the more likely one of two.
    #[must_use]
    pub fn pose(&self) -> Option<Pose<T>> {
        match &self.verdict {
            AbsolutePoseVerdict::Pose(found) => Some(found.pose),
            AbsolutePoseVerdict::PlanarAmbiguity(poses) => poses.first().map(|found| found.pose),
            _ => None,
        }
    }
}
