//! A point refined to the least reprojection error in any number of views.

use core::fmt;

use nalgebra::{Matrix3, Vector2, Vector3};

use super::all_finite;
use super::covariance::from_factor;
use crate::geometry::residual::{reprojection, reprojection_with_jacobians};
use crate::geometry::{CameraModel, Pose};
use crate::linalg::RowQr;
use crate::real::{abs, is_finite, lit, max, sqrt};
use crate::{InputError, Real};

/// Evaluations of all residuals at the most, steps and halved steps together.
const MAX_EVALUATIONS: u32 = 24;

/// A camera and where it stands.
#[derive(Debug, PartialEq)]
pub struct View<'a, T: Real, C: ?Sized> {
    /// The camera model.
    pub camera: &'a C,
    /// World to camera.
    pub pose: Pose<T>,
}

impl<T: Real, C: ?Sized> Clone for View<'_, T, C> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T: Real, C: ?Sized> Copy for View<'_, T, C> {}

/// The answer of [`refine_point`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct RefinedPoint<T: Real> {
    /// The point in the world, seen by every view. Its cost is not above the start's, but for rounding.
    pub point: Vector3<T>,
    /// The sum of squared pixel residuals.
    pub cost_px_sq: T,
    /// The covariance for a noise of 1 px in every pixel coordinate; none where rounding hides it.
    pub covariance_per_px_sq: Option<Matrix3<T>>,
    /// Whether a further step would lower the cost by no more than rounding.
    pub converged: bool,
    /// Evaluations of all residuals after the first.
    pub evaluations: u32,
}

/// Why a point cannot be refined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RefinePointError {
    /// Lengths that differ, fewer than two views, a pose (array 0), a pixel (array 1) or the start (array 2) that is
    /// not finite.
    Input(InputError),
    /// The start has no pixel in this view.
    NotVisible {
        /// Index of the view.
        view: usize,
    },
    /// The views do not determine the point near the start.
    Unobservable,
}

impl fmt::Display for RefinePointError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Input(error) => error.fmt(f),
            Self::NotVisible { view } => write!(f, "view {view} does not see the start"),
            Self::Unobservable => f.write_str("the views do not determine the point"),
        }
    }
}

impl core::error::Error for RefinePointError {}

impl From<InputError> for RefinePointError {
    fn from(error: InputError) -> Self {
        Self::Input(error)
    }
}

/// The point of least squared reprojection error in all views, from a start nearby.
///
/// `min over X of sum |project_i(R_i X + t_i) - x_i|^2`, by Gauss-Newton steps that are halved until they lower the cost.
///
/// # Input
/// At least two views with their pixels, and a start that every view sees, as
/// [`triangulate_dlt`](super::triangulate_dlt) gives it.
///
/// # Returns
/// [`RefinedPoint`], with the covariance at the solution.
///
/// # Errors
/// [`RefinePointError`].
///
/// # Accuracy
/// By orthogonal factors of the Jacobian: relative error a few `EPSILON` over the parallax angle.
///
/// # Cost
/// At most 24 evaluations of all residuals and Jacobians; 2 to 5 are usual.
///
/// # Examples
/// ```
/// use epipole::geometry::{Pinhole, Pose, triangulation::{View, refine_point}};
/// use epipole::nalgebra::{Vector2, Vector3};
/// let camera = Pinhole::new(500.0, 500.0, 320.0, 240.0)?;
/// let views = [0.0, -1.0].map(|x| View { camera: &camera, pose: Pose::<f64>::translation(x, 0.0, 0.0) });
/// let pixels = [Vector2::new(445.0, 240.0), Vector2::new(320.0, 240.0)];
/// let refined = refine_point(&views, &pixels, &Vector3::new(0.9, 0.1, 4.3)).unwrap();
/// assert!(refined.converged && (refined.point - Vector3::new(1.0, 0.0, 4.0)).norm() < 1e-9);
/// # Ok::<(), epipole::geometry::CameraError>(())
/// ```
pub fn refine_point<T: Real, C: CameraModel<T> + ?Sized>(
    views: &[View<'_, T, C>],
    pixels: &[Vector2<T>],
    start: &Vector3<T>,
) -> Result<RefinedPoint<T>, RefinePointError> {
    if views.len() != pixels.len() {
        return Err(InputError::LengthMismatch { first: views.len(), second: pixels.len() }.into());
    }
    if views.len() < 2 {
        return Err(InputError::TooFew { given: views.len(), needed: 2 }.into());
    }
    // What rounding leaves of the cost: a few EPSILON of the largest number that enters each residual.
    let mut floor = T::ZERO;
    for (index, (view, pixel)) in views.iter().zip(pixels).enumerate() {
        let mut numbers = view.pose.rotation.coords.iter().chain(view.pose.translation.vector.iter());
        if !numbers.all(|x| is_finite(*x)) {
            return Err(InputError::NotFinite { array: 0, index }.into());
        }
        if !(is_finite(pixel.x) && is_finite(pixel.y)) {
            return Err(InputError::NotFinite { array: 1, index }.into());
        }
        let rounding = (max(abs(pixel.x), abs(pixel.y)) + view.camera.focal()) * (lit::<T>(8.0) * T::EPSILON);
        floor += rounding * rounding;
    }
    if !all_finite(start) {
        return Err(InputError::NotFinite { array: 2, index: 0 }.into());
    }
    for (index, (view, pixel)) in views.iter().zip(pixels).enumerate() {
        if reprojection(view.camera, &view.pose, start, pixel).is_none() {
            return Err(RefinePointError::NotVisible { view: index });
        }
    }

    let mut best = linearise(views, pixels, start).ok_or(RefinePointError::Unobservable)?;
    let mut step = best.step().ok_or(RefinePointError::Unobservable)?;
    let mut converged = false;
    let mut evaluations = 0;
    for _ in 0..MAX_EVALUATIONS {
        // An error d of a residual r is an error 2 r d of its square: what the cost itself is known to.
        converged = best.predicted <= floor + sqrt(floor * best.cost);
        evaluations += 1;
        let trial = linearise(views, pixels, &(best.point + step));
        if converged {
            // The last step, which the cost no longer shows.
            best = trial.filter(|trial| trial.predicted < best.predicted).unwrap_or(best);
            break;
        }
        let trial = trial.filter(|trial| trial.cost < best.cost);
        match trial.and_then(|trial| Some((trial, trial.step()?))) {
            Some(lower) => (best, step) = lower,
            None => step *= T::HALF,
        }
    }
    Ok(RefinedPoint {
        point: best.point,
        cost_px_sq: best.cost,
        covariance_per_px_sq: from_factor(&best.factor, T::ONE),
        converged,
        evaluations,
    })
}

/// The residuals of all views at a point, reduced to a triangle: `|J d + r|^2 = |R d + q|^2 + cost - predicted`.
#[derive(Clone, Copy)]
struct Linearised<T: Real> {
    point: Vector3<T>,
    factor: [[T; 3]; 3],
    right: [T; 3],
    cost: T,
    /// By how much a full step lowers the linearised cost: `|q|^2`.
    predicted: T,
}

impl<T: Real> Linearised<T> {
    /// The Gauss-Newton step `-R^-1 q`; none where it is not finite.
    fn step(&self) -> Option<Vector3<T>> {
        let [[a, b, c], [_, d, e], [_, _, f]] = self.factor;
        let [p, q, r] = self.right;
        let z = -r / f;
        let y = (-q - e * z) / d;
        let step = Vector3::new((-p - b * y - c * z) / a, y, z);
        all_finite(&step).then_some(step)
    }
}

fn linearise<T: Real, C: CameraModel<T> + ?Sized>(
    views: &[View<'_, T, C>],
    pixels: &[Vector2<T>],
    point: &Vector3<T>,
) -> Option<Linearised<T>> {
    let mut qr = RowQr::<T, 4>::new();
    let mut cost = T::ZERO;
    for (view, pixel) in views.iter().zip(pixels) {
        let r = reprojection_with_jacobians(view.camera, &view.pose, point, pixel)?;
        let (j, e) = (r.by_point, r.residual);
        qr.fold([[j.m11, j.m12, j.m13, e.x], [j.m21, j.m22, j.m23, e.y]]);
        cost += e.norm_squared();
    }
    let [[a, b, c, p], [_, d, e, q], [_, _, f, r], _] = *qr.r();
    let predicted = p * p + q * q + r * r;
    let o = T::ZERO;
    let finite = is_finite(cost) && is_finite(predicted);
    finite.then_some(Linearised {
        point: *point,
        factor: [[a, b, c], [o, d, e], [o, o, f]],
        right: [p, q, r],
        cost,
        predicted,
    })
}
