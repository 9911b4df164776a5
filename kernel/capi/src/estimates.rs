//! What estimators and refinement answer.

use epipole::Real;
use epipole::nalgebra::SMatrix;
use epipole::{estimate, geometry, refine};

use crate::enums;
use crate::raw::Grows;
use crate::types::{Pose, SearchReport, quaternion, rows};

/// What `epi_relative_pose` found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct RelativePoseEstimate<T> {
    /// How the search went.
    pub report: SearchReport<T>,
    /// One of `epi_relative_pose_verdict`.
    pub verdict: u32,
    /// One of `epi_unobservable`.
    pub unobservable: u32,
    /// Poses found: 1 of a general motion, 1 or 2 of a plane, else 0.
    pub pose_count: u32,
    /// What became of a prior: one of `epi_prior_fit`.
    pub prior: u32,
    /// Of a plane: 1 where `general` holds a general motion, else 0.
    pub has_general: u32,
    /// Rows of each covariance: 5, 8 or 3 by the verdict, 0 where the inliers leave a direction open.
    pub covariance_size: [u32; 2],
    /// Robust estimate of the noise of one image coordinate, pixels; 0 without inliers.
    pub noise_px: T,
    /// By how many standard deviations a prior and the pose found differ.
    pub prior_deviations: T,
    /// Of view 2 in the frame of view 1, |t| = 1.
    pub poses: [Pose<T>; 2],
    /// Of a plane: its unit normal in the frame of view 1.
    pub normals: [[T; 3]; 2],
    /// Of a plane: the length of the true translation over the plane's distance from view 1.
    pub baseline_over_distance: [T; 2],
    /// By rows, in the first `covariance_size` squared numbers. Order: `kernel/CONVENTIONS.md`.
    pub covariance: [[T; 64]; 2],
    /// Of a plane: the general motion that explains more correspondences than both poses of the plane, although by no more
    /// than chance might. The better answer where the scene is but nearly a plane.
    pub general: RefinedRelativePose<T>,
}

/// What `epi_refine_relative_pose` found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct RefinedRelativePose<T> {
    /// Of view 2 in the frame of view 1, |t| = 1.
    pub pose: Pose<T>,
    /// 5x5 by rows: w of `R <- Exp(w) R` (rad), then t in its tangent basis; zeros without.
    pub covariance: [[T; 5]; 5],
    /// 1 where there is a covariance, 0 where a direction is open.
    pub has_covariance: u32,
}

/// What `epi_homography` found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct HomographyEstimate<T> {
    /// How the search went.
    pub report: SearchReport<T>,
    /// One of `epi_homography_verdict`.
    pub verdict: u32,
    /// One of `epi_unobservable`.
    pub unobservable: u32,
    /// 1 where there is a covariance, 0 where a direction is open.
    pub has_covariance: u32,
    /// Robust estimate of the noise of one image coordinate, pixels; 0 without inliers.
    pub noise_px: T,
    /// `x2 ~ H x1` between pixels, 3x3 by rows, |H| = 1.
    pub homography: [[T; 3]; 3],
    /// Four pixels of view 1 around the inliers.
    pub corners: [[T; 2]; 4],
    /// Of the pixels of view 2 to which the corners go, px^2: 8x8 by rows.
    pub covariance: [[T; 8]; 8],
}

/// What `epi_fundamental` found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct FundamentalEstimate<T> {
    /// How the search went.
    pub report: SearchReport<T>,
    /// One of `epi_fundamental_verdict`.
    pub verdict: u32,
    /// One of `epi_unobservable`.
    pub unobservable: u32,
    /// Robust estimate of the noise of one image coordinate, pixels; 0 without inliers.
    pub noise_px: T,
    /// `x2' F x1 = 0` between pixels, 3x3 by rows, |F| = 1; of a plane its homography `x2 ~ H x1` instead.
    pub matrix: [[T; 3]; 3],
}

/// What `epi_absolute_pose` found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct AbsolutePoseEstimate<T> {
    /// How the search went.
    pub report: SearchReport<T>,
    /// One of `epi_absolute_pose_verdict`.
    pub verdict: u32,
    /// One of `epi_unobservable`.
    pub unobservable: u32,
    /// Poses found: 1, of a plane 2, the more likely first; else 0.
    pub pose_count: u32,
    /// What became of a gravity prior: one of `epi_prior_fit`.
    pub gravity: u32,
    /// For each pose 1 where there is a covariance, 0 where a direction is open.
    pub has_covariance: [u32; 2],
    /// Estimate of the noise of one image coordinate, pixels; 0 without a pose.
    pub noise_px: T,
    /// Of a gravity prior: by how many standard deviations it differs from the pose found.
    pub gravity_deviations: T,
    /// Root mean square of the inliers' reprojection errors, pixels.
    pub rms_px: [T; 2],
    /// World to camera.
    pub poses: [Pose<T>; 2],
    /// 6x6 by rows: w of `R <- Exp(w) R` (rad), then t.
    pub covariance: [[[T; 6]; 6]; 2],
}

/// What `epi_refine_absolute_pose` found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct RefinedAbsolutePose<T> {
    /// World to camera; the start where nothing could be improved.
    pub pose: Pose<T>,
    /// 6x6 by rows: w of `R <- Exp(w) R` (rad), then t; zeros without.
    pub covariance: [[T; 6]; 6],
    /// Sum of the losses, px^2, and of the prior's share.
    pub cost: T,
    /// The cost at the start.
    pub initial_cost: T,
    /// 1 where there is a covariance, 0 where a direction is open.
    pub has_covariance: u32,
    /// Points that the camera sees with a weight above zero.
    pub active: u32,
    /// Passes over the correspondences.
    pub passes: u32,
}

/// What `epi_refine_homography` and `epi_refine_fundamental` found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct RefinedTwoView<T> {
    /// 3x3 by rows, of length 1; the start where nothing could be improved.
    pub matrix: [[T; 3]; 3],
    /// Sum of the losses, px^2.
    pub cost: T,
    /// The cost at the start.
    pub initial_cost: T,
    /// How many correspondences have a weight above zero.
    pub active: u32,
    /// Passes over the correspondences.
    pub passes: u32,
}

// SAFETY: plain numbers.
unsafe impl<T: Real> Grows for RelativePoseEstimate<T> {
    const FIRST: usize = size_of::<Self>();
}
// SAFETY: plain numbers.
unsafe impl<T: Real> Grows for RefinedRelativePose<T> {
    const FIRST: usize = size_of::<Self>();
}
// SAFETY: plain numbers.
unsafe impl<T: Real> Grows for HomographyEstimate<T> {
    const FIRST: usize = size_of::<Self>();
}
// SAFETY: plain numbers.
unsafe impl<T: Real> Grows for FundamentalEstimate<T> {
    const FIRST: usize = size_of::<Self>();
}
// SAFETY: plain numbers.
unsafe impl<T: Real> Grows for AbsolutePoseEstimate<T> {
    const FIRST: usize = size_of::<Self>();
}
// SAFETY: plain numbers.
unsafe impl<T: Real> Grows for RefinedAbsolutePose<T> {
    const FIRST: usize = size_of::<Self>();
}

impl<T: Real> RelativePoseEstimate<T> {
    /// Without a pose.
    fn empty(verdict: enums::RelativePoseVerdict) -> Self {
        Self {
            report: SearchReport::zero(),
            verdict: verdict as u32,
            unobservable: enums::Unobservable::No as u32,
            pose_count: 0,
            prior: enums::PriorFit::None as u32,
            has_general: 0,
            covariance_size: [0; 2],
            noise_px: T::ZERO,
            prior_deviations: T::ZERO,
            poses: [Pose::zero(); 2],
            normals: [[T::ZERO; 3]; 2],
            baseline_over_distance: [T::ZERO; 2],
            covariance: [[T::ZERO; 64]; 2],
            general: RefinedRelativePose::zero(),
        }
    }
}

impl<T: Real> From<&estimate::RelativePoseEstimate<T>> for RelativePoseEstimate<T> {
    fn from(kernel: &estimate::RelativePoseEstimate<T>) -> Self {
        use enums::RelativePoseVerdict as C;
        use estimate::RelativePoseVerdict as Kernel;
        let mut found = match &kernel.verdict {
            Kernel::General(motion) | Kernel::GeneralOrPlanar(motion) => {
                let general = matches!(kernel.verdict, Kernel::General(_));
                let mut found = Self::empty(if general { C::General } else { C::GeneralOrPlanar });
                found.pose_count = 1;
                found.poses[0] = motion.pose.into();
                found.covariance_size[0] = write_rows(&motion.covariance, &mut found.covariance[0]);
                found
            }
            Kernel::Planar(poses) => {
                let mut found = Self::empty(C::Planar);
                for (k, planar) in (0..2).zip(poses.iter()) {
                    found.pose_count += 1;
                    found.poses[k] = planar.pose.into();
                    found.normals[k] = planar.normal.into();
                    found.baseline_over_distance[k] = planar.baseline_over_distance;
                    found.covariance_size[k] = write_rows(&planar.covariance, &mut found.covariance[k]);
                }
                found
            }
            Kernel::PureRotation(pure) => {
                let mut found = Self::empty(C::PureRotation);
                found.poses[0].rotation = quaternion(&pure.rotation);
                found.covariance_size[0] = write_rows(&pure.covariance, &mut found.covariance[0]);
                found
            }
            Kernel::NoMotion => Self::empty(C::NoMotion),
            Kernel::Unobservable(why) => Self { unobservable: reason(*why), ..Self::empty(C::Unobservable) },
            Kernel::TooFewInliers => Self::empty(C::TooFewInliers),
            Kernel::NoConsensus => Self::empty(C::NoConsensus),
            _ => Self::empty(C::Other),
        };
        let (prior, sigmas) = match kernel.prior {
            None => (enums::PriorFit::None, T::ZERO),
            Some(estimate::PriorFit::Fits(sigmas)) => (enums::PriorFit::Fits, sigmas),
            Some(estimate::PriorFit::Contradicted(sigmas)) => (enums::PriorFit::Contradicted, sigmas),
            Some(_) => (enums::PriorFit::Other, T::ZERO),
        };
        (found.prior, found.prior_deviations) = (prior as u32, sigmas);
        if let Some(motion) = &kernel.general {
            (found.has_general, found.general) = (1, motion.into());
        }
        found.report = kernel.report.into();
        found.noise_px = kernel.noise_px;
        found
    }
}

impl<T: Real> RefinedRelativePose<T> {
    const fn zero() -> Self {
        Self { pose: Pose::zero(), covariance: [[T::ZERO; 5]; 5], has_covariance: 0 }
    }
}

impl<T: Real> From<&estimate::GeneralMotion<T>> for RefinedRelativePose<T> {
    fn from(kernel: &estimate::GeneralMotion<T>) -> Self {
        Self {
            pose: kernel.pose.into(),
            covariance: kernel.covariance.map_or([[T::ZERO; 5]; 5], |c| rows(&c)),
            has_covariance: u32::from(kernel.covariance.is_some()),
        }
    }
}

impl<T: Real> From<&estimate::HomographyEstimate<T>> for HomographyEstimate<T> {
    fn from(kernel: &estimate::HomographyEstimate<T>) -> Self {
        use enums::HomographyVerdict as C;
        use estimate::HomographyVerdict as Kernel;
        let verdict = match &kernel.verdict {
            Kernel::Found(_) => C::Found,
            Kernel::Unobservable(_) => C::Unobservable,
            Kernel::TooFewInliers => C::TooFewInliers,
            Kernel::NoConsensus => C::NoConsensus,
            _ => C::Other,
        };
        let mut found = Self {
            report: kernel.report.into(),
            verdict: verdict as u32,
            unobservable: enums::Unobservable::No as u32,
            has_covariance: 0,
            noise_px: kernel.noise_px,
            homography: [[T::ZERO; 3]; 3],
            corners: [[T::ZERO; 2]; 4],
            covariance: [[T::ZERO; 8]; 8],
        };
        match &kernel.verdict {
            Kernel::Found(model) => {
                found.homography = rows(&model.homography.0);
                found.corners = model.corners.map(Into::into);
                found.has_covariance = u32::from(model.covariance.is_some());
                found.covariance = model.covariance.map_or([[T::ZERO; 8]; 8], |c| rows(&c));
            }
            Kernel::Unobservable(why) => found.unobservable = reason(*why),
            _ => {}
        }
        found
    }
}

impl<T: Real> From<&estimate::FundamentalEstimate<T>> for FundamentalEstimate<T> {
    fn from(kernel: &estimate::FundamentalEstimate<T>) -> Self {
        use enums::FundamentalVerdict as C;
        use estimate::FundamentalVerdict as Kernel;
        let none = [[T::ZERO; 3]; 3];
        let (verdict, matrix, unobservable) = match &kernel.verdict {
            Kernel::Found(f) => (C::Found, rows(&f.0), 0),
            Kernel::Planar(h) => (C::Planar, rows(&h.0), 0),
            Kernel::Unobservable(why) => (C::Unobservable, none, reason(*why)),
            Kernel::TooFewInliers => (C::TooFewInliers, none, 0),
            Kernel::NoConsensus => (C::NoConsensus, none, 0),
            _ => (C::Other, none, 0),
        };
        let report = kernel.report.into();
        Self { report, verdict: verdict as u32, unobservable, noise_px: kernel.noise_px, matrix }
    }
}

impl<T: Real> From<&estimate::AbsolutePoseEstimate<T>> for AbsolutePoseEstimate<T> {
    fn from(kernel: &estimate::AbsolutePoseEstimate<T>) -> Self {
        use enums::{AbsolutePoseVerdict as C, PriorFit as Fit};
        use estimate::{AbsolutePoseVerdict as Kernel, PriorFit};
        let (verdict, poses, unobservable) = match &kernel.verdict {
            Kernel::Pose(pose) => (C::Pose, core::slice::from_ref(pose), 0),
            Kernel::PlanarAmbiguity(poses) => (C::PlanarAmbiguity, poses.as_slice(), 0),
            Kernel::Unobservable(why) => (C::Unobservable, &[][..], reason(*why)),
            Kernel::BehindCamera => (C::BehindCamera, &[][..], 0),
            Kernel::TooFewInliers => (C::TooFewInliers, &[][..], 0),
            Kernel::NoConsensus => (C::NoConsensus, &[][..], 0),
            _ => (C::Other, &[][..], 0),
        };
        let (gravity, gravity_deviations) = match kernel.gravity {
            None => (Fit::None, T::ZERO),
            Some(PriorFit::Fits(by)) => (Fit::Fits, by),
            Some(PriorFit::Contradicted(by)) => (Fit::Contradicted, by),
            Some(_) => (Fit::Other, T::ZERO),
        };
        let mut found = Self {
            report: kernel.report.into(),
            verdict: verdict as u32,
            unobservable,
            pose_count: 0,
            gravity: gravity as u32,
            has_covariance: [0; 2],
            noise_px: kernel.noise_px,
            gravity_deviations,
            rms_px: [T::ZERO; 2],
            poses: [Pose::zero(); 2],
            covariance: [[[T::ZERO; 6]; 6]; 2],
        };
        for (k, pose) in (0..2).zip(poses) {
            found.pose_count += 1;
            found.has_covariance[k] = u32::from(pose.covariance.is_some());
            found.rms_px[k] = pose.rms_px;
            found.poses[k] = pose.pose.into();
            found.covariance[k] = pose.covariance.map_or([[T::ZERO; 6]; 6], |c| rows(&c));
        }
        found
    }
}

impl<T: Real> From<&refine::RefinedAbsolutePose<T>> for RefinedAbsolutePose<T> {
    fn from(kernel: &refine::RefinedAbsolutePose<T>) -> Self {
        Self {
            pose: kernel.pose.into(),
            covariance: kernel.covariance.map_or([[T::ZERO; 6]; 6], |c| rows(&c)),
            cost: kernel.cost,
            initial_cost: kernel.initial_cost,
            has_covariance: u32::from(kernel.covariance.is_some()),
            active: kernel.active,
            passes: kernel.passes,
        }
    }
}

// SAFETY: plain numbers.
unsafe impl<T: Real> Grows for RefinedTwoView<T> {
    const FIRST: usize = size_of::<Self>();
}

macro_rules! from_refined {
    ($($model:ident)*) => {$(
        impl<T: Real> From<refine::RefinedTwoView<geometry::$model<T>, T>> for RefinedTwoView<T> {
            fn from(kernel: refine::RefinedTwoView<geometry::$model<T>, T>) -> Self {
                let refine::RefinedTwoView { model, cost, initial_cost, active, passes } = kernel;
                Self { matrix: rows(&model.0), cost, initial_cost, active, passes }
            }
        }
    )*};
}
from_refined!(Homography Fundamental);

/// One of `epi_unobservable`.
fn reason(why: estimate::Unobservable) -> u32 {
    match why {
        estimate::Unobservable::Collinear => enums::Unobservable::Collinear as u32,
        estimate::Unobservable::TooFewDistinct => enums::Unobservable::TooFewDistinct as u32,
        _ => enums::Unobservable::Other as u32,
    }
}

/// A matrix by rows into the first of `numbers`; its size, 0 without one.
fn write_rows<T: Real, const N: usize>(matrix: &Option<SMatrix<T, N, N>>, numbers: &mut [T; 64]) -> u32 {
    let Some(matrix) = matrix else { return 0 };
    for (to, from) in numbers.iter_mut().zip(rows(matrix).into_iter().flatten()) {
        *to = from;
    }
    N as u32
}
