//! Refinement of an absolute pose on the pixels as the camera shows them, distortion included.

use nalgebra::{Matrix6, SMatrix, SVector, Vector2, Vector3, Vector6};

use super::lm::{NormalEquations, descend};
use crate::geometry::pose::{left_jacobian, log, retract};
use crate::geometry::residual::reprojection_with_jacobians;
use crate::geometry::{CameraModel, Pose};
use crate::linalg::Ldlt;
use crate::real::{is_finite, lit, sqrt};
use crate::robust::loss::Loss;
use crate::{InputError, Real};

/// What is known of a pose from elsewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PosePrior<T: Real> {
    /// The pose expected.
    pub pose: Pose<T>,
    /// The inverse of its covariance, in the order rotation (rad), translation; zero where nothing is known.
    pub information: Matrix6<T>,
}

/// Options of [`absolute_pose`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct RefineAbsolutePoseOptions<T: Real> {
    /// Loss of the reprojection error, its scale in pixels. Default Huber at 1 px.
    pub loss: Loss<T>,
    /// Standard deviation of the noise of one image coordinate, pixels: what a prior is weighed against, and the scale
    /// of the covariance. Default 1.
    pub sigma_px: T,
    /// A prior that enters as a residual. Default none.
    pub prior: Option<PosePrior<T>>,
    /// Passes over the correspondences at the most. Default 15.
    pub max_passes: u32,
}

impl<T: Real> Default for RefineAbsolutePoseOptions<T> {
    fn default() -> Self {
        Self { loss: Loss::Huber(T::ONE), sigma_px: T::ONE, prior: None, max_passes: 15 }
    }
}

/// A refined pose.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct RefinedAbsolutePose<T: Real> {
    /// World to camera. The start where nothing could be improved.
    pub pose: Pose<T>,
    /// Covariance of the rotation vector w of `R <- Exp(w) R` (rad), then of t; none where a direction is left open.
    pub covariance: Option<Matrix6<T>>,
    /// Sum of the losses, px^2, and of the prior's share.
    pub cost: T,
    /// The cost at the start.
    pub initial_cost: T,
    /// How many points the camera sees with a weight above zero.
    pub active: u32,
    /// Passes over the correspondences.
    pub passes: u32,
}

/// The pose of least robust reprojection error near a start.
///
/// `min sum rho(|project(R X + t) - x|^2) + sigma_px^2 e' L e` with `e = (log(R R0'), t - t0)` and `L` the information of
/// the prior `(R0, t0)`, by Levenberg and Marquardt's method.
///
/// # Input
/// `pixels[i]` shows `points[i]`, in the distorted image of any camera model; `start` world to camera.
///
/// # Returns
/// The pose, its covariance and the cost before and after; the cost never rises.
///
/// # Errors
/// Different lengths, a coordinate that is not finite (array 0 the pixels); without a prior also fewer than three.
///
/// # Degeneracies
/// A direction that the points leave open stays as it started, and there is no covariance. A point that the camera does
/// not see counts as an error of the focal length.
///
/// # Accuracy
/// The minimum, to a relative change of the cost of 1e-6 (`f32`) or 1e-10 (`f64`).
///
/// # Cost
/// At most `max_passes` passes.
///
/// # References
/// D. Marquardt, "An algorithm for least-squares estimation of nonlinear parameters", SIAM Journal, 1963; P. Holland, R.
/// Welsch, "Robust regression using iteratively reweighted least-squares", 1977.
///
/// # Examples
/// ```
/// use epipole::geometry::{BrownConrady, CameraModel, Pinhole, Pose};
/// use epipole::nalgebra::{Point3, Vector3};
/// use epipole::refine::{RefineAbsolutePoseOptions, absolute_pose};
/// let camera = BrownConrady::new(Pinhole::new(500.0, 500.0, 320.0, 240.0)?, [-0.3, 0.1, 0.001, 0.0, 0.0])?;
/// let truth = Pose::new(Vector3::new(0.1, -0.2, 1.0), Vector3::new(0.0, 0.3, 0.1));
/// let points: [Vector3<f64>; 4] =
///     [[1.0, 0.0, 4.0], [-1.0, 0.5, 5.0], [0.2, -1.0, 3.0], [0.5, 0.7, 4.0]].map(Vector3::from);
/// let pixels = points.map(|p| camera.project(&(truth * Point3::from(p)).coords).unwrap());
/// let start = Pose::new(Vector3::new(0.15, -0.2, 1.1), Vector3::new(0.05, 0.3, 0.1));
/// let refined = absolute_pose(&camera, &pixels, &points, &start, &RefineAbsolutePoseOptions::default())?;
/// assert!((refined.pose.to_homogeneous() - truth.to_homogeneous()).norm() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn absolute_pose<T: Real>(
    camera: &impl CameraModel<T>,
    pixels: &[Vector2<T>],
    points: &[Vector3<T>],
    start: &Pose<T>,
    options: &RefineAbsolutePoseOptions<T>,
) -> Result<RefinedAbsolutePose<T>, InputError> {
    check(pixels, points, if options.prior.is_some() { 0 } else { 3 })?;
    let equations = |pose: &Pose<T>| normal_equations(camera, pixels, points, pose, options);
    let least = if options.prior.is_some() { 0 } else { 3 };
    let tolerance = sqrt(T::EPSILON) * lit(0.003);
    let initial_cost = equations(start).cost;
    let minimum = descend(start, least, options.max_passes, tolerance, equations, retract);
    let variance = options.sigma_px * options.sigma_px;
    let covariance = Ldlt::new(&minimum.equations.hessian).map(|factors| factors.inverse() * variance);
    Ok(RefinedAbsolutePose {
        pose: minimum.model,
        covariance,
        cost: minimum.equations.cost,
        initial_cost,
        active: minimum.equations.active,
        passes: minimum.passes,
    })
}

fn check<T: Real>(pixels: &[Vector2<T>], points: &[Vector3<T>], needed: usize) -> Result<(), InputError> {
    if pixels.len() != points.len() {
        return Err(InputError::LengthMismatch { first: pixels.len(), second: points.len() });
    }
    if pixels.len() < needed {
        return Err(InputError::TooFew { given: pixels.len(), needed });
    }
    let finite = |v: &[T]| v.iter().all(|&x| is_finite(x));
    for (index, (pixel, point)) in pixels.iter().zip(points).enumerate() {
        if !finite(pixel.as_slice()) {
            return Err(InputError::NotFinite { array: 0, index });
        }
        if !finite(point.as_slice()) {
            return Err(InputError::NotFinite { array: 1, index });
        }
    }
    Ok(())
}

fn normal_equations<T: Real>(
    camera: &impl CameraModel<T>,
    pixels: &[Vector2<T>],
    points: &[Vector3<T>],
    pose: &Pose<T>,
    options: &RefineAbsolutePoseOptions<T>,
) -> NormalEquations<T, 6> {
    let mut sums = NormalEquations {
        hessian: SMatrix::<T, 6, 6>::zeros(),
        gradient: SVector::<T, 6>::zeros(),
        cost: T::ZERO,
        active: 0,
    };
    let unseen = options.loss.evaluate(camera.focal() * camera.focal()).0;
    for (pixel, point) in pixels.iter().zip(points) {
        let Some(r) = reprojection_with_jacobians(camera, pose, point, pixel) else {
            sums.cost += unseen;
            continue;
        };
        let (cost, weight) = options.loss.evaluate(r.residual.norm_squared());
        sums.cost += cost;
        if weight > T::ZERO {
            sums.active += 1;
            let weighted = r.by_pose.transpose() * weight;
            sums.hessian += weighted * r.by_pose;
            sums.gradient += weighted * r.residual;
        }
    }
    if let Some(prior) = &options.prior {
        let turn = log(&(pose.rotation * prior.pose.rotation.inverse()));
        let moved = pose.translation.vector - prior.pose.translation.vector;
        let error = Vector6::new(turn.x, turn.y, turn.z, moved.x, moved.y, moved.z);
        // log(Exp(w) Exp(e)) = e + Jl(e)^-1 w
        let mut j = Matrix6::identity();
        if let Some(inverse) = left_jacobian(&turn).try_inverse() {
            for p in 0..3 {
                for q in 0..3 {
                    j.data.0[q][p] = inverse.data.0[q][p];
                }
            }
        }
        let weight = prior.information * (options.sigma_px * options.sigma_px);
        let weighted = j.transpose() * weight;
        sums.hessian += weighted * j;
        sums.gradient += weighted * error;
        sums.cost += error.dot(&(weight * error));
    }
    sums
}
