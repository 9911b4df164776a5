//! What two views can say about the motion between them.

use nalgebra::{Matrix3, SMatrix, UnitQuaternion, Vector3};

use crate::estimate::PriorFit;
use crate::geometry::Pose;
use crate::robust::RansacReport;
use crate::{Real, Solutions};

/// What two views say about the motion between them.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum RelativePoseVerdict<T: Real> {
    /// A general motion in a scene that shows it.
    General(GeneralMotion<T>),
    /// A general motion, unless the inliers lie on a plane, which
    /// [`RelativePoseOptions::planes`](super::RelativePoseOptions::planes) left unexamined: then the pose may be the wrong
    /// one of two that explain the plane alike, and its covariance tells nothing of the other.
    GeneralOrPlanar(GeneralMotion<T>),
    /// All inliers lie on one plane, or those off it speak for two motions alike: the poses that explain the plane's
    /// homography, the more likely one first. Two where both keep the points in front of the cameras.
    Planar(Solutions<PlanarPose<T>, 2>),
    /// The camera turned and its centre stayed, as far as the noise lets see.
    PureRotation(PureRotation<T>),
    /// Every inlier stayed where it was, as far as the noise lets see.
    NoMotion,
    /// The inliers agree, but no pose follows from them.
    Unobservable(Unobservable),
    /// So few correspondences that chance could explain them even if all agreed.
    TooFewInliers,
    /// No model explains more correspondences than chance.
    NoConsensus,
}

/// A general motion: `X2 = R X1 + t` with |t| = 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeneralMotion<T: Real> {
    /// The pose of view 2 in the frame of view 1.
    pub pose: Pose<T>,
    /// Covariance of the rotation vector w of `R <- Exp(w) R` (rad), then of t in the basis of its tangent plane that
    /// [`tangent_basis`](crate::geometry::pose::tangent_basis) gives; none where the inliers leave a direction open.
    pub covariance: Option<SMatrix<T, 5, 5>>,
}

/// One explanation of a planar scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarPose<T: Real> {
    /// The pose of view 2 in the frame of view 1, |t| = 1.
    pub pose: Pose<T>,
    /// The plane's unit normal in the frame of view 1, with `n' X1 = d > 0` for its points.
    pub normal: Vector3<T>,
    /// |t| / d: the length of the true translation over the distance of the plane from view 1.
    pub baseline_over_distance: T,
    /// Covariance of w of `R <- Exp(w) R` (rad), of t / d, and of n in the basis of its tangent plane that
    /// [`tangent_basis`](crate::geometry::pose::tangent_basis) gives; none where the inliers leave a direction open.
    pub covariance: Option<SMatrix<T, 8, 8>>,
}

/// A rotation about the camera's centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PureRotation<T: Real> {
    /// `x2 ~ R x1`.
    pub rotation: UnitQuaternion<T>,
    /// Covariance of w of `R <- Exp(w) R`, rad^2; none where the inliers leave a direction open.
    pub covariance: Option<Matrix3<T>>,
}

/// Why inliers that agree fix no pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Unobservable {
    /// They lie on one line in an image.
    Collinear,
    /// They are repetitions of too few distinct points.
    TooFewDistinct,
}

/// A verdict and how it was reached.
#[derive(Clone, Debug, PartialEq)]
#[must_use]
pub struct RelativePoseEstimate<T: Real> {
    /// The verdict.
    pub verdict: RelativePoseVerdict<T>,
    /// Of a planar scene: the general motion that explains correspondences off the plane or relief on it, more than both
    /// poses of the plane do by what three correspondences are worth (or more, where the noise is louder than it is said to
    /// be), although by no more than chance might; or the one of two general motions that explains a little more than
    /// the other. Right where the scene is but nearly a plane, as most scenes are. None
    /// otherwise. The inliers are the plane's.
    pub general: Option<GeneralMotion<T>>,
    /// Of a prior: whether it fits; none without one, or where the verdict knows of no rotation.
    pub prior: Option<PriorFit<T>>,
    /// Robust estimate of the noise of one image coordinate from the inliers' residuals, pixels; 0 without inliers.
    pub noise_px: T,
    /// How the search went.
    pub report: RansacReport<T>,
}

impl<T: Real> RelativePoseEstimate<T> {
    /// The pose of a general motion, or of one that is general unless the scene is a plane; of a planar scene that of
    /// [`general`](Self::general), else the plane's more likely one.
    #[must_use]
    // Called in small code: inlined, it makes a copy of the estimate that is looked at one of many pieces.
    #[cfg_attr(small, inline(never))]
    pub fn pose(&self) -> Option<Pose<T>> {
        match &self.verdict {
            RelativePoseVerdict::General(motion) | RelativePoseVerdict::GeneralOrPlanar(motion) => {
                Some(motion.pose)
            }
            RelativePoseVerdict::Planar(poses) => {
                let planar = poses.first().map(|planar| planar.pose);
                self.general.map(|motion| motion.pose).or(planar)
            }
            _ => None,
        }
    }
}
