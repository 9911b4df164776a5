//! Structs as C sees them: no pointers and no `size_t`, so 32- and 64-bit machines agree on their layout.

use epipole::Real;
use epipole::geometry::triangulation::{self, Triangulation};
use epipole::geometry::{self, BrownConrady, CameraModel, KannalaBrandt, Pinhole, UnprojectError};
use epipole::nalgebra::{
    Matrix2x3, Matrix3x2, Quaternion, SMatrix, Translation3, UnitQuaternion, Vector2, Vector3,
};
use epipole::real::{abs, is_finite, lit};
use epipole::robust::{self, RansacReport};

use crate::Status;
use crate::enums::{self, CameraModel as Model};
use crate::raw::Plain;

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

/// What the rays of views determine.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct TriangulatedPoint<T> {
    /// By the verdict a point, a unit direction, or zeros.
    pub point: [T; 3],
    /// One of `epi_triangulation_verdict`.
    pub verdict: u32,
    /// The first view that the point lies behind.
    pub view: u32,
    /// How many views it lies behind.
    pub behind: u32,
}

/// A point of least reprojection error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct RefinedPoint<T> {
    /// In the world.
    pub point: [T; 3],
    /// Sum of the squared reprojection errors.
    pub cost_px_sq: T,
    /// Of the point for a noise of 1 px, 3x3 by rows; zeros without.
    pub covariance_per_px_sq: [[T; 3]; 3],
    /// 1 where there is a covariance, 0 where a direction is open.
    pub has_covariance: u32,
    /// 1 where the iteration converged.
    pub converged: u32,
    /// Evaluations of all residuals.
    pub evaluations: u32,
}

// SAFETY: plain numbers, and padding that nobody reads.
unsafe impl<T: Plain> Plain for TriangulatedPoint<T> {}
// SAFETY: plain numbers, and padding that nobody reads.
unsafe impl<T: Plain> Plain for RefinedPoint<T> {}

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
    /// Of relative poses: what the best other solution that was met explains, as a share of what the best one does; near 1
    /// where two explain the correspondences alike, 0 where no other was met.
    pub rival_share: T,
}

impl<T: Real> Pose<T> {
    pub(crate) const fn zero() -> Self {
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

/// The rows of a matrix.
pub(crate) fn rows<T: Real, const R: usize, const C: usize>(matrix: &SMatrix<T, R, C>) -> [[T; C]; R] {
    matrix.transpose().data.0
}

/// The matrix of these rows.
pub(crate) fn from_rows<T: Real, const R: usize, const C: usize>(rows: [[T; C]; R]) -> SMatrix<T, R, C> {
    SMatrix::<T, C, R>::from(rows).transpose()
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
        const PINHOLE: u32 = Model::Pinhole as u32;
        const BROWN_CONRADY: u32 = Model::BrownConrady as u32;
        const KANNALA_BRANDT: u32 = Model::KannalaBrandt as u32;
        let pinhole = Pinhole::new(self.fx, self.fy, self.cx, self.cy);
        let [a, b, c, d, e, ..] = self.distortion;
        Ok(match self.model {
            PINHOLE => pinhole?.into(),
            BROWN_CONRADY => BrownConrady::new(pinhole?, [a, b, c, d, e])?.into(),
            KANNALA_BRANDT if cfg!(feature = "fisheye") => KannalaBrandt::new(pinhole?, [a, b, c, d])?.into(),
            _ => return Err(Status::UnknownEnum),
        })
    }
}

/// A camera as the estimators see it. Without fisheyes their code for bearings is dropped, half of their size.
pub(crate) struct Lens<T: Real>(geometry::Camera<T>);

impl<T: Real> Camera<T> {
    pub(crate) fn to_lens(self) -> Result<Lens<T>, Status> {
        self.to_kernel().map(Lens)
    }
}

/// A method of the camera's model; none of a fisheye in a library without them.
macro_rules! through {
    ($lens:ident, $method:ident($argument:ident)) => {
        match &$lens.0 {
            geometry::Camera::Pinhole(camera) => Some(camera.$method($argument)),
            geometry::Camera::BrownConrady(camera) => Some(camera.$method($argument)),
            geometry::Camera::KannalaBrandt(camera) if cfg!(feature = "fisheye") => {
                Some(camera.$method($argument))
            }
            _ => None,
        }
    };
}

impl<T: Real> CameraModel<T> for Lens<T> {
    fn project(&self, point: &Vector3<T>) -> Option<Vector2<T>> {
        through!(self, project(point)).unwrap_or_default()
    }
    fn project_with_jacobian(&self, point: &Vector3<T>) -> Option<(Vector2<T>, Matrix2x3<T>)> {
        through!(self, project_with_jacobian(point)).unwrap_or_default()
    }
    fn unproject(&self, pixel: &Vector2<T>) -> Result<Vector3<T>, UnprojectError> {
        through!(self, unproject(pixel)).unwrap_or(Err(UnprojectError::OutsideDomain))
    }
    fn unproject_with_jacobian(
        &self,
        pixel: &Vector2<T>,
    ) -> Result<(Vector3<T>, Matrix3x2<T>), UnprojectError> {
        through!(self, unproject_with_jacobian(pixel)).unwrap_or(Err(UnprojectError::OutsideDomain))
    }
    fn focal(&self) -> T {
        self.0.focal()
    }
    #[inline(always)]
    fn rectilinear(&self) -> Option<(T, T)> {
        if cfg!(feature = "fisheye") {
            return self.0.rectilinear();
        }
        let pinhole = self.0.pinhole();
        Some((pinhole.fx(), pinhole.fy()))
    }
}

impl<T: Real> SearchReport<T> {
    pub(crate) const fn zero() -> Self {
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
            rival_share: T::ZERO,
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
            residuals: report.spent.residuals as u64,
            iterations: report.spent.iterations,
            solver_calls: report.spent.solver_calls,
            hypotheses: report.spent.hypotheses,
            refinements: report.spent.refinements,
            stop: stop as u32,
            inliers: report.inliers,
            cost: report.cost,
            miss_probability: report.miss_probability,
            excluded_inlier_ratio: report.excluded_inlier_ratio,
            rival_share: report.rival_share,
        }
    }
}

impl<T: Real> From<Triangulation<T>> for TriangulatedPoint<T> {
    fn from(kernel: Triangulation<T>) -> Self {
        use enums::TriangulationVerdict as C;
        let plain = |point: Vector3<T>, verdict: C| Self {
            point: point.into(),
            verdict: verdict as u32,
            view: 0,
            behind: 0,
        };
        match kernel {
            Triangulation::Point(point) => plain(point, C::Point),
            Triangulation::Behind { point, view, count } => {
                Self { view: view as u32, behind: count as u32, ..plain(point, C::Behind) }
            }
            Triangulation::AtInfinity { direction } => plain(direction, C::AtInfinity),
            Triangulation::Undetermined => plain(Vector3::zeros(), C::Undetermined),
        }
    }
}

impl<T: Real> From<triangulation::RefinedPoint<T>> for RefinedPoint<T> {
    fn from(kernel: triangulation::RefinedPoint<T>) -> Self {
        Self {
            point: kernel.point.into(),
            cost_px_sq: kernel.cost_px_sq,
            covariance_per_px_sq: kernel.covariance_per_px_sq.map_or([[T::ZERO; 3]; 3], |c| rows(&c)),
            has_covariance: u32::from(kernel.covariance_per_px_sq.is_some()),
            converged: u32::from(kernel.converged),
            evaluations: kernel.evaluations,
        }
    }
}
