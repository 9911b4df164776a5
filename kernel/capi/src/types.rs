//! Structs as C sees them: no pointers and no `size_t`, so 32- and 64-bit machines agree on their layout.

use epipole::Real;
use epipole::estimate;
use epipole::geometry::{self, BrownConrady, KannalaBrandt, Pinhole};
use epipole::nalgebra::{Quaternion, SMatrix, Translation3, UnitQuaternion};
use epipole::real::{abs, is_finite, lit};
use epipole::robust::{self, RansacReport};

use crate::Status;
use crate::enums::{self, CameraModel};
use crate::raw::{Grows, Plain};

/// A pose into the camera, `x_cam = R X + t`; of two views, `X2 = R X1 + t`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Pose<T> {
    /// Unit quaternion `i j k w`.
    pub rotation: [T; 4],
    /// The translation.
    pub translation: [T; 3],
}

/// A camera. Pixels: the centre of the top-left pixel is (0, 0).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Camera<T> {
    /// One of `epi_camera_model`.
    pub model: u32,
    /// Horizontal focal length, px.
    pub fx: T,
    /// Vertical focal length, px.
    pub fy: T,
    /// Principal point, px from the left.
    pub cx: T,
    /// Principal point, px from the top.
    pub cy: T,
    /// Coefficients of the model; those that it does not have are ignored.
    pub distortion: [T; 8],
}

// SAFETY: plain numbers.
unsafe impl<T: Plain> Plain for Pose<T> {}
// SAFETY: plain numbers, and padding that nobody reads.
unsafe impl<T: Plain> Plain for Camera<T> {}

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
    /// Residuals evaluated at the most.
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

/// How a search went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct SearchReport<T> {
    /// Residuals evaluated.
    pub residuals: u64,
    /// Samples drawn.
    pub iterations: u32,
    /// Minimal problems solved.
    pub solver_calls: u32,
    /// Hypotheses scored.
    pub hypotheses: u32,
    /// Local optimisations made.
    pub refinements: u32,
    /// Why the search ended: one of `epi_stop_reason`.
    pub stop: u32,
    /// Inliers of the verdict's model.
    pub inliers: u32,
    /// Truncated squared error of the search's best model: the sum of min(r^2 / threshold^2, 1).
    pub cost: T,
    /// Probability that no sample of inliers only was drawn, given the inliers found.
    pub miss_probability: T,
    /// Without consensus: a larger share of inliers would have been sampled, with the confidence asked.
    pub excluded_inlier_ratio: T,
}

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
    /// Rows of each covariance: 5, 8 or 3 by the verdict, 0 where the inliers leave a direction open.
    pub covariance_size: [u32; 2],
    /// Robust estimate of the noise of one image coordinate, pixels; 0 without inliers.
    pub noise_px: T,
    /// Of view 2 in the frame of view 1, |t| = 1.
    pub poses: [Pose<T>; 2],
    /// Of a plane: its unit normal in the frame of view 1.
    pub normals: [[T; 3]; 2],
    /// Of a plane: the length of the true translation over the plane's distance from view 1.
    pub baseline_over_distance: [T; 2],
    /// Row-major, in the first `covariance_size` squared numbers. Order: `kernel/CONVENTIONS.md`.
    pub covariance: [[T; 64]; 2],
}

// SAFETY: plain numbers that begin with the size.
unsafe impl<T: Real> Grows for RelativePoseOptions<T> {
    const FIRST: usize = size_of::<Self>();
}
// SAFETY: plain numbers.
unsafe impl<T: Real> Grows for RelativePoseEstimate<T> {
    const FIRST: usize = size_of::<Self>();
}

impl<T: Real> Pose<T> {
    const fn zero() -> Self {
        Self { rotation: [T::ZERO; 4], translation: [T::ZERO; 3] }
    }

    /// The pose of the kernel.
    pub(crate) fn to_kernel(self) -> Result<geometry::Pose<T>, Status> {
        let rotation = rotation(&self.rotation)?;
        if !self.translation.iter().all(|&x| is_finite(x)) {
            return Err(Status::NotFinite);
        }
        Ok(geometry::Pose::from_parts(Translation3::from(self.translation), rotation))
    }
}

/// The rotation of a unit quaternion `i j k w`.
pub(crate) fn rotation<T: Real>(q: &[T; 4]) -> Result<UnitQuaternion<T>, Status> {
    let [i, j, k, w] = *q;
    if !q.iter().all(|&x| is_finite(x)) {
        return Err(Status::NotFinite);
    }
    let excess = i * i + j * j + k * k + w * w - T::ONE;
    // Written so that an overflow fails too.
    if !(abs(excess) <= lit::<T>(1e-3)) {
        return Err(Status::Rotation);
    }
    Ok(UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k)))
}

/// `i j k w`.
pub(crate) fn quaternion<T: Real>(q: &UnitQuaternion<T>) -> [T; 4] {
    [q.i, q.j, q.k, q.w]
}

impl<T: Real> From<geometry::Pose<T>> for Pose<T> {
    fn from(pose: geometry::Pose<T>) -> Self {
        Self { rotation: quaternion(&pose.rotation), translation: pose.translation.vector.into() }
    }
}

impl<T: Real> Camera<T> {
    /// The camera of the kernel.
    pub(crate) fn to_kernel(self) -> Result<geometry::Camera<T>, Status> {
        const PINHOLE: u32 = CameraModel::Pinhole as u32;
        const BROWN_CONRADY: u32 = CameraModel::BrownConrady as u32;
        const KANNALA_BRANDT: u32 = CameraModel::KannalaBrandt as u32;
        let pinhole = Pinhole::new(self.fx, self.fy, self.cx, self.cy);
        let [a, b, c, d, e, ..] = self.distortion;
        Ok(match self.model {
            PINHOLE => pinhole?.into(),
            BROWN_CONRADY => BrownConrady::new(pinhole?, [a, b, c, d, e])?.into(),
            KANNALA_BRANDT => KannalaBrandt::new(pinhole?, [a, b, c, d])?.into(),
            _ => return Err(Status::UnknownEnum),
        })
    }
}

impl<T: Real> RelativePoseOptions<T> {
    /// The defaults of the kernel.
    pub(crate) fn new() -> Self {
        let kernel = estimate::RelativePoseOptions::<T>::default();
        let search = kernel.ransac;
        Self {
            size: size_of::<Self>() as u32,
            min_iterations: search.min_iterations,
            max_iterations: search.budget.max_iterations,
            max_solver_calls: search.budget.max_solver_calls,
            max_residuals: search.budget.max_residuals,
            seed: search.seed,
            confidence: search.confidence,
            max_error_px: kernel.max_error_px,
            sigma_px: T::ZERO,
        }
    }

    /// The options of the kernel.
    pub(crate) fn to_kernel(self) -> estimate::RelativePoseOptions<T> {
        let mut kernel = estimate::RelativePoseOptions::default();
        kernel.max_error_px = self.max_error_px;
        kernel.sigma_px = given(self.sigma_px);
        kernel.ransac.confidence = self.confidence;
        kernel.ransac.min_iterations = self.min_iterations;
        kernel.ransac.seed = self.seed;
        kernel.ransac.budget.max_iterations = self.max_iterations;
        kernel.ransac.budget.max_solver_calls = self.max_solver_calls;
        kernel.ransac.budget.max_residuals = self.max_residuals;
        kernel
    }
}

/// A number for which 0 means the default.
fn given<T: Real>(x: T) -> Option<T> {
    (x != T::ZERO).then_some(x)
}

impl<T: Real> SearchReport<T> {
    const fn zero() -> Self {
        Self {
            residuals: 0,
            iterations: 0,
            solver_calls: 0,
            hypotheses: 0,
            refinements: 0,
            stop: 0,
            inliers: 0,
            cost: T::ZERO,
            miss_probability: T::ZERO,
            excluded_inlier_ratio: T::ZERO,
        }
    }
}

impl<T: Real> From<RansacReport<T>> for SearchReport<T> {
    fn from(report: RansacReport<T>) -> Self {
        use enums::StopReason as C;
        use robust::StopReason as Kernel;
        let stop = match report.stop {
            Kernel::Confident => C::Confident,
            Kernel::MaxIterations => C::MaxIterations,
            Kernel::MaxSolverCalls => C::MaxSolverCalls,
            Kernel::MaxResiduals => C::MaxResiduals,
            Kernel::Interrupted => C::Interrupted,
            _ => C::Other,
        };
        Self {
            residuals: report.spent.residuals,
            iterations: report.spent.iterations,
            solver_calls: report.spent.solver_calls,
            hypotheses: report.spent.hypotheses,
            refinements: report.spent.refinements,
            stop: stop as u32,
            inliers: report.inliers,
            cost: report.cost,
            miss_probability: report.miss_probability,
            excluded_inlier_ratio: report.excluded_inlier_ratio,
        }
    }
}

impl<T: Real> RelativePoseEstimate<T> {
    /// Without a pose.
    fn empty(verdict: enums::RelativePoseVerdict) -> Self {
        Self {
            report: SearchReport::zero(),
            verdict: verdict as u32,
            unobservable: enums::Unobservable::No as u32,
            pose_count: 0,
            covariance_size: [0; 2],
            noise_px: T::ZERO,
            poses: [Pose::zero(); 2],
            normals: [[T::ZERO; 3]; 2],
            baseline_over_distance: [T::ZERO; 2],
            covariance: [[T::ZERO; 64]; 2],
        }
    }
}

impl<T: Real> From<&estimate::RelativePoseEstimate<T>> for RelativePoseEstimate<T> {
    fn from(kernel: &estimate::RelativePoseEstimate<T>) -> Self {
        use enums::RelativePoseVerdict as C;
        use estimate::RelativePoseVerdict as Kernel;
        let mut found = match &kernel.verdict {
            Kernel::General(motion) => {
                let mut found = Self::empty(C::General);
                found.pose_count = 1;
                found.poses[0] = motion.pose.into();
                found.covariance_size[0] = row_major(&motion.covariance, &mut found.covariance[0]);
                found
            }
            Kernel::Planar(poses) => {
                let mut found = Self::empty(C::Planar);
                for (k, planar) in poses.iter().enumerate().take(2) {
                    found.pose_count += 1;
                    found.poses[k] = planar.pose.into();
                    found.normals[k] = planar.normal.into();
                    found.baseline_over_distance[k] = planar.baseline_over_distance;
                    found.covariance_size[k] = row_major(&planar.covariance, &mut found.covariance[k]);
                }
                found
            }
            Kernel::PureRotation(pure) => {
                let mut found = Self::empty(C::PureRotation);
                found.poses[0].rotation = quaternion(&pure.rotation);
                found.covariance_size[0] = row_major(&pure.covariance, &mut found.covariance[0]);
                found
            }
            Kernel::NoMotion => Self::empty(C::NoMotion),
            Kernel::Unobservable(why) => {
                Self { unobservable: reason(*why) as u32, ..Self::empty(C::Unobservable) }
            }
            Kernel::TooFewInliers => Self::empty(C::TooFewInliers),
            Kernel::NoConsensus => Self::empty(C::NoConsensus),
            _ => Self::empty(C::Other),
        };
        found.report = kernel.report.into();
        found.noise_px = kernel.noise_px;
        found
    }
}

fn reason(why: estimate::Unobservable) -> enums::Unobservable {
    match why {
        estimate::Unobservable::Collinear => enums::Unobservable::Collinear,
        estimate::Unobservable::TooFewDistinct => enums::Unobservable::TooFewDistinct,
        _ => enums::Unobservable::Other,
    }
}

/// A matrix by rows into the first of `numbers`; its size, 0 without one.
fn row_major<T: Real, const N: usize>(matrix: &Option<SMatrix<T, N, N>>, numbers: &mut [T]) -> u32 {
    let Some(matrix) = matrix else { return 0 };
    let transposed = matrix.transpose();
    for (to, &from) in numbers.iter_mut().zip(transposed.iter()) {
        *to = from;
    }
    N as u32
}
