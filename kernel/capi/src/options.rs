//! Options of the robust estimators and of refinement: filled by a `_default` function, their size first.

use epipole::Real;
use epipole::nalgebra::Vector3;
use epipole::robust::loss::Loss;
use epipole::{estimate, refine};

use crate::Status;
use crate::enums;
use crate::raw::Grows;
use crate::types::{Pose, from_rows, rotation};

/// Options of `epi_relative_pose`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct RelativePoseOptions<T> {
    /// Of this struct, in bytes.
    pub size: u32,
    /// Samples drawn at the least.
    pub min_iterations: u32,
    /// Samples drawn at the most.
    pub max_iterations: u32,
    /// Minimal problems solved at the most.
    pub max_solver_calls: u32,
    /// Residuals evaluated at the most; 2^32 - 1 and more: no limit but that.
    pub max_residuals: u64,
    /// The same seed and input give the same bits.
    pub seed: u64,
    /// Probability, in (0, 1), that a sample of inliers only has been drawn when the search stops by itself.
    pub confidence: T,
    /// Largest Sampson error of an inlier, pixels.
    pub max_error_px: T,
    /// Standard deviation of the noise of one image coordinate, pixels; 0 for half of `max_error_px`.
    pub sigma_px: T,
    /// Displacement between the views, pixels, that is no motion where at least half of all correspondences stay below it
    /// and at most one inlier in ten moves by twice as much; 0 leaves the decision to the noise alone, and a negative number
    /// stands for five times `sigma_px`.
    pub least_motion_px: T,
    /// Of gravity as a prior: its direction in view 1, of any length.
    pub prior_view1: [T; 3],
    /// Its direction in view 2.
    pub prior_view2: [T; 3],
    /// Standard deviation of each of the two directions, about each axis across it, rad.
    pub prior_sigma_rad: T,
    /// Of the rotation as a prior: a unit quaternion `i j k w`.
    pub prior_rotation: [T; 4],
    /// Covariance of w of `R <- Exp(w) R`, rad^2: 3x3 by rows.
    pub prior_covariance: [[T; 3]; 3],
    /// What is known: one of `epi_relative_pose_prior`, of which a library without the feature `prior` takes none.
    pub prior: u32,
    /// Not 0: whether the inliers lie on a plane, which leaves two poses, is not examined, and a general motion's verdict is
    /// `GENERAL_OR_PLANAR`.
    pub no_planes: u32,
}

/// Options of `epi_homography`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct HomographyOptions<T> {
    /// Of this struct, in bytes.
    pub size: u32,
    /// Samples drawn at the least.
    pub min_iterations: u32,
    /// Samples drawn at the most.
    pub max_iterations: u32,
    /// Minimal problems solved at the most.
    pub max_solver_calls: u32,
    /// Residuals evaluated at the most; 2^32 - 1 and more: no limit but that.
    pub max_residuals: u64,
    /// The same seed and input give the same bits.
    pub seed: u64,
    /// Probability, in (0, 1), that a sample of inliers only has been drawn when the search stops by itself.
    pub confidence: T,
    /// Largest transfer error of an inlier, pixels.
    pub max_error_px: T,
    /// Standard deviation of the noise of one image coordinate, pixels; 0 for a third of `max_error_px`.
    pub sigma_px: T,
}

/// Options of `epi_fundamental`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct FundamentalOptions<T> {
    /// Of this struct, in bytes.
    pub size: u32,
    /// Samples drawn at the least.
    pub min_iterations: u32,
    /// Samples drawn at the most.
    pub max_iterations: u32,
    /// Minimal problems solved at the most.
    pub max_solver_calls: u32,
    /// Residuals evaluated at the most; 2^32 - 1 and more: no limit but that.
    pub max_residuals: u64,
    /// The same seed and input give the same bits.
    pub seed: u64,
    /// Probability, in (0, 1), that a sample of inliers only has been drawn when the search stops by itself.
    pub confidence: T,
    /// Largest Sampson error of an inlier, pixels.
    pub max_error_px: T,
    /// Standard deviation of the noise of one image coordinate, pixels; 0 for half of `max_error_px`.
    pub sigma_px: T,
}

/// Options of `epi_absolute_pose`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct AbsolutePoseOptions<T> {
    /// Of this struct, in bytes.
    pub size: u32,
    /// Samples drawn at the least.
    pub min_iterations: u32,
    /// Samples drawn at the most.
    pub max_iterations: u32,
    /// Minimal problems solved at the most.
    pub max_solver_calls: u32,
    /// Residuals evaluated at the most; 2^32 - 1 and more: no limit but that.
    pub max_residuals: u64,
    /// The same seed and input give the same bits.
    pub seed: u64,
    /// Probability, in (0, 1), that a sample of inliers only has been drawn when the search stops by itself.
    pub confidence: T,
    /// Largest reprojection error of an inlier, pixels.
    pub max_error_px: T,
    /// Standard deviation of the noise of one image coordinate, pixels; 0 for half of `max_error_px`.
    pub sigma_px: T,
    /// Of a gravity prior: its direction in the world, of any length.
    pub gravity_world: [T; 3],
    /// Its direction in the camera, of any length.
    pub gravity_camera: [T; 3],
    /// Standard deviation of the angle between the two, rad.
    pub gravity_sigma_rad: T,
    /// 1 if gravity is known (not in a library without the feature `prior`), else 0 and the three above are ignored.
    pub has_gravity: u32,
}

/// Options of `epi_refine_absolute_pose`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct RefineAbsolutePoseOptions<T> {
    /// Of this struct, in bytes.
    pub size: u32,
    /// Passes over the correspondences at the most.
    pub max_passes: u32,
    /// Of the reprojection error: one of `epi_loss`.
    pub loss: u32,
    /// 1 if a prior is given, else 0 and the prior is ignored.
    pub has_prior: u32,
    /// Scale of the loss, pixels.
    pub loss_scale: T,
    /// Standard deviation of the noise of one image coordinate, pixels.
    pub sigma_px: T,
    /// The pose that a prior expects.
    pub prior_pose: Pose<T>,
    /// The inverse of its covariance, rotation (rad) then translation: 6x6 by rows.
    pub prior_information: [[T; 6]; 6],
}

/// Options of `epi_refine_homography` and `epi_refine_fundamental`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct RefineTwoViewOptions<T> {
    /// Of this struct, in bytes.
    pub size: u32,
    /// Passes over the correspondences at the most.
    pub max_passes: u32,
    /// Of the error: one of `epi_loss`.
    pub loss: u32,
    /// Scale of the loss, pixels.
    pub loss_scale: T,
}

// SAFETY: plain numbers that begin with the size.
unsafe impl<T: Real> Grows for RelativePoseOptions<T> {
    const FIRST: usize = size_of::<Self>();
}
// SAFETY: plain numbers that begin with the size.
unsafe impl<T: Real> Grows for HomographyOptions<T> {
    const FIRST: usize = size_of::<Self>();
}
// SAFETY: plain numbers that begin with the size.
unsafe impl<T: Real> Grows for FundamentalOptions<T> {
    const FIRST: usize = size_of::<Self>();
}
// SAFETY: plain numbers that begin with the size.
unsafe impl<T: Real> Grows for AbsolutePoseOptions<T> {
    const FIRST: usize = size_of::<Self>();
}
// SAFETY: plain numbers that begin with the size.
unsafe impl<T: Real> Grows for RefineAbsolutePoseOptions<T> {
    const FIRST: usize = size_of::<Self>();
}

/// Options as their `_default` function fills them, for a caller that knows `size` bytes of them.
pub(crate) trait Defaults: Grows {
    fn defaults(size: usize) -> Self;
}

macro_rules! search_options {
    ($name:ident $(, $field:ident: $value:expr)*) => {
        impl<T: Real> Defaults for $name<T> {
            fn defaults(size: usize) -> Self {
                let kernel = estimate::$name::<T>::default();
                let search = kernel.ransac;
                Self {
                    size: size as u32,
                    min_iterations: search.min_iterations,
                    max_iterations: search.budget.max_iterations,
                    max_solver_calls: search.budget.max_solver_calls,
                    max_residuals: search.budget.max_residuals as u64,
                    seed: search.seed,
                    confidence: search.confidence,
                    max_error_px: kernel.max_error_px,
                    sigma_px: T::ZERO,
                    $($field: $value,)*
                }
            }
        }

        impl<T: Real> $name<T> {
            /// The kernel's options of the search.
            fn search(&self) -> estimate::$name<T> {
                let mut kernel = estimate::$name::<T>::default();
                kernel.max_error_px = self.max_error_px;
                // 0 stands for the default.
                kernel.sigma_px = (self.sigma_px != T::ZERO).then_some(self.sigma_px);
                kernel.ransac.confidence = self.confidence;
                kernel.ransac.min_iterations = self.min_iterations;
                kernel.ransac.seed = self.seed;
                kernel.ransac.budget.max_iterations = self.max_iterations;
                kernel.ransac.budget.max_solver_calls = self.max_solver_calls;
                kernel.ransac.budget.max_residuals = u32::try_from(self.max_residuals).unwrap_or(u32::MAX);
                kernel
            }
        }
    };
}

search_options!(
    RelativePoseOptions,
    least_motion_px: -T::ONE,
    prior_view1: [T::ZERO; 3],
    prior_view2: [T::ZERO; 3],
    prior_sigma_rad: T::ZERO,
    prior_rotation: [T::ZERO; 4],
    prior_covariance: [[T::ZERO; 3]; 3],
    prior: enums::RelativePosePrior::None as u32,
    no_planes: 0
);
search_options!(HomographyOptions);
search_options!(FundamentalOptions);
search_options!(
    AbsolutePoseOptions,
    gravity_world: [T::ZERO; 3],
    gravity_camera: [T::ZERO; 3],
    gravity_sigma_rad: T::ZERO,
    has_gravity: 0
);

impl<T: Real> RelativePoseOptions<T> {
    /// Inlined: the compiler sees where a library without priors has none, and drops what uses them.
    #[inline(always)]
    pub(crate) fn to_kernel(self) -> Result<estimate::RelativePoseOptions<T>, Status> {
        const NONE: u32 = enums::RelativePosePrior::None as u32;
        const GRAVITY: u32 = enums::RelativePosePrior::Gravity as u32;
        const ROTATION: u32 = enums::RelativePosePrior::Rotation as u32;
        let mut kernel = self.search();
        // Below 0 stands for the default.
        kernel.least_motion_px = match self.least_motion_px {
            motion if motion < T::ZERO => None,
            motion if motion <= T::MAX => Some(motion),
            _ => return Err(Status::NotFinite),
        };
        kernel.prior = match self.prior {
            NONE => None,
            GRAVITY if cfg!(feature = "prior") => Some(estimate::RelativePosePrior::Gravity {
                view1: self.prior_view1.into(),
                view2: self.prior_view2.into(),
                sigma_rad: self.prior_sigma_rad,
            }),
            ROTATION if cfg!(feature = "prior") => Some(estimate::RelativePosePrior::Rotation {
                rotation: rotation(&self.prior_rotation)?,
                covariance: from_rows(self.prior_covariance),
            }),
            _ => return Err(Status::UnknownEnum),
        };
        kernel.planes = self.no_planes == 0;
        Ok(kernel)
    }
}

impl<T: Real> HomographyOptions<T> {
    pub(crate) fn to_kernel(self) -> Result<estimate::HomographyOptions<T>, Status> {
        Ok(self.search())
    }
}

impl<T: Real> FundamentalOptions<T> {
    pub(crate) fn to_kernel(self) -> Result<estimate::FundamentalOptions<T>, Status> {
        Ok(self.search())
    }
}

impl<T: Real> AbsolutePoseOptions<T> {
    /// Inlined, as that of a relative pose.
    #[inline(always)]
    pub(crate) fn to_kernel(self) -> Result<estimate::AbsolutePoseOptions<T>, Status> {
        let mut kernel = self.search();
        kernel.gravity = match flag(self.has_gravity)? {
            false => None,
            true if cfg!(feature = "prior") => Some(estimate::GravityPrior {
                world: Vector3::from(self.gravity_world),
                camera: Vector3::from(self.gravity_camera),
                sigma_rad: self.gravity_sigma_rad,
            }),
            true => return Err(Status::UnknownEnum),
        };
        Ok(kernel)
    }
}

impl<T: Real> Defaults for RefineAbsolutePoseOptions<T> {
    fn defaults(size: usize) -> Self {
        let kernel = refine::RefineAbsolutePoseOptions::<T>::default();
        let (loss, loss_scale) = loss_parts(kernel.loss);
        Self {
            size: size as u32,
            max_passes: kernel.max_passes,
            loss,
            has_prior: 0,
            loss_scale,
            sigma_px: kernel.sigma_px,
            prior_pose: Pose::zero(),
            prior_information: [[T::ZERO; 6]; 6],
        }
    }
}

impl<T: Real> RefineAbsolutePoseOptions<T> {
    pub(crate) fn to_kernel(self) -> Result<refine::RefineAbsolutePoseOptions<T>, Status> {
        let mut kernel = refine::RefineAbsolutePoseOptions::default();
        kernel.max_passes = self.max_passes;
        kernel.loss = loss(self.loss, self.loss_scale)?;
        kernel.sigma_px = positive(self.sigma_px, Status::Sigma)?;
        kernel.prior = match flag(self.has_prior)? {
            true => {
                let information = from_rows(self.prior_information);
                if !information.iter().all(|&x| epipole::real::is_finite(x)) {
                    return Err(Status::NotFinite);
                }
                Some(refine::PosePrior { pose: self.prior_pose.to_kernel()?, information })
            }
            false => None,
        };
        Ok(kernel)
    }
}

// SAFETY: plain numbers that begin with the size.
unsafe impl<T: Real> Grows for RefineTwoViewOptions<T> {
    const FIRST: usize = size_of::<Self>();
}

impl<T: Real> Defaults for RefineTwoViewOptions<T> {
    fn defaults(size: usize) -> Self {
        let kernel = refine::RefineTwoViewOptions::<T>::default();
        let (loss, loss_scale) = loss_parts(kernel.loss);
        Self { size: size as u32, max_passes: kernel.max_passes, loss, loss_scale }
    }
}

impl<T: Real> RefineTwoViewOptions<T> {
    pub(crate) fn to_kernel(self) -> Result<refine::RefineTwoViewOptions<T>, Status> {
        let mut kernel = refine::RefineTwoViewOptions::default();
        kernel.max_passes = self.max_passes;
        kernel.loss = loss(self.loss, self.loss_scale)?;
        Ok(kernel)
    }
}

/// A yes or no of C.
pub(crate) fn flag(value: u32) -> Result<bool, Status> {
    match value {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(Status::UnknownEnum),
    }
}

fn positive<T: Real>(value: T, status: Status) -> Result<T, Status> {
    if value > T::ZERO && epipole::real::is_finite(value) { Ok(value) } else { Err(status) }
}

/// The loss of a kind and a scale.
pub(crate) fn loss<T: Real>(kind: u32, scale: T) -> Result<Loss<T>, Status> {
    const SQUARED: u32 = enums::Loss::Squared as u32;
    const TRUNCATED: u32 = enums::Loss::Truncated as u32;
    const HUBER: u32 = enums::Loss::Huber as u32;
    const CAUCHY: u32 = enums::Loss::Cauchy as u32;
    const TUKEY: u32 = enums::Loss::Tukey as u32;
    const GEMAN_MCCLURE: u32 = enums::Loss::GemanMcClure as u32;
    let make = match kind {
        SQUARED => return Ok(Loss::Squared),
        TRUNCATED => Loss::Truncated,
        HUBER => Loss::Huber,
        CAUCHY => Loss::Cauchy,
        TUKEY => Loss::Tukey,
        GEMAN_MCCLURE => Loss::GemanMcClure,
        _ => return Err(Status::UnknownEnum),
    };
    Ok(make(positive(scale, Status::BadOption)?))
}

/// Kind and scale of a loss.
pub(crate) fn loss_parts<T: Real>(loss: Loss<T>) -> (u32, T) {
    let (kind, scale) = match loss {
        Loss::Squared => (enums::Loss::Squared, T::ONE),
        Loss::Truncated(k) => (enums::Loss::Truncated, k),
        Loss::Huber(k) => (enums::Loss::Huber, k),
        Loss::Cauchy(k) => (enums::Loss::Cauchy, k),
        Loss::Tukey(k) => (enums::Loss::Tukey, k),
        Loss::GemanMcClure(k) => (enums::Loss::GemanMcClure, k),
    };
    (kind as u32, scale)
}
