//! What an estimation of a relative pose is asked.

use super::super::error::TwoViewError;
use super::RelativePoseError;
use super::prior::{KnownRotation, RelativePosePrior};
use crate::Real;
use crate::robust::RansacOptions;

/// Options of [`relative_pose`](super::relative_pose()).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct RelativePoseOptions<T: Real> {
    /// Largest Sampson error of an inlier, pixels. Default 1.
    pub max_error_px: T,
    /// Standard deviation of the noise of one image coordinate, pixels. Default: half of `max_error_px`.
    pub sigma_px: Option<T>,
    /// Displacement between the views, pixels, that is no motion where at least half of all correspondences stay below
    /// it and at most one inlier in ten moves by twice as much. Default: 5 sigma, that is two and a half times
    /// `max_error_px`; 0 leaves the decision to the noise alone.
    pub least_motion_px: Option<T>,
    /// Gravity or the rotation, if known: then samples are smaller, and it enters the refinement. A prior that contradicts
    /// the correspondences is left aside and reported. Default none.
    pub prior: Option<RelativePosePrior<T>>,
    /// Whether it is examined if the inliers lie on a plane, which leaves two poses. Without that the verdict on a general
    /// motion, and on a plane, is [`GeneralOrPlanar`](super::RelativePoseVerdict::GeneralOrPlanar) (of planes one pose in
    /// three is then the wrong one of the two), every other verdict is the same, and firmware whose compiler sees it takes a
    /// fifth less flash. For scenes that are known to be no plane. Default true.
    pub planes: bool,
    /// Confidence, iterations, budgets and seed.
    pub ransac: RansacOptions<T>,
}

impl<T: Real> Default for RelativePoseOptions<T> {
    fn default() -> Self {
        Self {
            max_error_px: T::ONE,
            sigma_px: None,
            least_motion_px: None,
            prior: None,
            planes: true,
            ransac: RansacOptions::of_two_views(),
        }
    }
}

impl<T: Real> RelativePoseOptions<T> {
    /// The prior, checked. Inlined: of options without a prior the compiler then sees that there is none.
    #[inline(always)]
    pub(super) fn known(&self) -> Result<Option<KnownRotation<T>>, RelativePoseError> {
        match &self.prior {
            Some(prior) => KnownRotation::new(prior).ok_or(TwoViewError::Prior).map(Some),
            None => Ok(None),
        }
    }
}
