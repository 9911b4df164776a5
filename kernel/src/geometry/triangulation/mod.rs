//! Points in space from their bearings in two or more views.
//!
//! | function | views | minimises | for |
//! |---|---|---|---|
//! | [`ViewPair::triangulate_midpoint`] | 2 | distance to the two rays | speed: cheirality, initial points |
//! | [`ViewPair::triangulate_dlt`] | 2 | algebraic error, null vector of `A` | comparison with the classic method |
//! | [`ViewPair::triangulate_optimal`] | 2 | reprojection error | final points of two views |
//! | [`triangulate_dlt`] | N | algebraic error, null vector of `A` | a start for N views |
//! | [`refine_point`] | N | reprojection error in pixels | final points of N views |
//!
//! All answer with a [`Triangulation`]: rays that are parallel, or meet behind a camera, or do not determine a point are
//! told apart from a point in front of every view, and the coordinates of an answer are always finite. How well a point
//! is determined say [`ViewPair::parallax`] and [`ViewPair::covariance`], or for any views [`point_covariance`].

use nalgebra::{Matrix3, Vector3};

use super::Pose;
use super::pose::{rotation_matrix, vector_angle};
use crate::Real;
use crate::linalg::vec3::{cross, dot, over};
use crate::real::{abs, is_finite, lit, max, sqrt};

mod covariance;
mod dlt;
mod midpoint;
mod optimal;
mod refine;

pub use covariance::{depth_sigma, point_covariance};
pub use dlt::triangulate_dlt;
pub use refine::{RefinePointError, RefinedPoint, View, refine_point};

/// Where the rays of two or more views meet. "In front" of a view: the point lies on the side of the view's centre to
/// which its bearing points, for a fisheye also beyond 90 degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub enum Triangulation<T: Real> {
    /// The point, in front of every view.
    Point(Vector3<T>),
    /// The point of best fit, which lies behind at least one view (or at its centre): a wrong match, a wrong pose, or
    /// a far point whose rays diverge by noise.
    Behind {
        /// The point of best fit.
        point: Vector3<T>,
        /// The first view that it lies behind, from 0.
        view: usize,
        /// How many views it lies behind.
        count: usize,
    },
    /// The rays are parallel to within rounding: no depth, but a direction.
    AtInfinity {
        /// The unit direction of the point, in the frame in which the point would be.
        direction: Vector3<T>,
    },
    /// No point is determined: no baseline, every ray along the baseline, antiparallel rays, a bearing of zero length,
    /// or numbers that are not finite or beyond the range of the scalar.
    Undetermined,
}

impl<T: Real> Triangulation<T> {
    /// The point where it lies in front of every view.
    #[must_use]
    pub fn point(self) -> Option<Vector3<T>> {
        match self {
            Self::Point(point) => Some(point),
            _ => None,
        }
    }
}

/// Rays whose angle has a sine of no more than this are parallel: what the rounding of bearings and rotation leaves.
#[inline]
fn parallel_sine<T: Real>() -> T {
    lit::<T>(8.0) * T::EPSILON
}

/// Two views of known relative pose, `X2 = R X1 + t`. With a metric baseline |t|, as a calibrated stereo pair has, the
/// points are metric.
///
/// # Examples
/// Depth from a rectified stereo pair, baseline 0.12 m, f = 600 px, disparity 24 px: `Z = f b / disparity = 3 m`.
/// ```
/// use epipole::geometry::{Pose, triangulation::ViewPair};
/// use epipole::nalgebra::Vector3;
/// let stereo = ViewPair::new(&Pose::<f64>::translation(-0.12, 0.0, 0.0));
/// let left = Vector3::new(30.0 / 600.0, 12.0 / 600.0, 1.0);
/// let right = Vector3::new(6.0 / 600.0, 12.0 / 600.0, 1.0);
/// let point = stereo.triangulate_optimal(&left, &right).point().unwrap();
/// assert!((point.z - 3.0).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewPair<T: Real> {
    rotation: Matrix3<T>,
    /// Of view 2, in the frame of view 1.
    centre: Vector3<T>,
}

impl<T: Real> ViewPair<T> {
    /// The pair whose second view has this pose in the frame of the first.
    #[inline]
    #[must_use]
    pub fn new(pose: &Pose<T>) -> Self {
        Self::from_parts(&rotation_matrix(&pose.rotation), &pose.translation.vector)
    }

    /// The pair of rotation and translation. `r` must be a rotation; it is not checked.
    #[inline]
    #[must_use]
    pub fn from_parts(r: &Matrix3<T>, t: &Vector3<T>) -> Self {
        let minus = |k: usize| -dot(&r.data.0[k], &t.data.0[0]);
        Self { rotation: *r, centre: Vector3::new(minus(0), minus(1), minus(2)) }
    }

    /// The centre of view 2 in the frame of view 1, `-R' t`.
    #[must_use]
    pub fn centre(&self) -> Vector3<T> {
        self.centre
    }

    /// The angle between the rays from the two centres to a point of the frame of view 1, rad.
    ///
    /// The error of a depth is about that of the bearings times the depth over this angle.
    #[must_use]
    pub fn parallax(&self, point: &Vector3<T>) -> T {
        vector_angle(point, &(point - self.centre))
    }
}

/// The verdict on a point with the signs of its depths along the two bearings; `centre` of view 2 in the frame of view 1.
#[inline(always)]
fn judge<T: Real>(centre: &Vector3<T>, point: Vector3<T>, depth1: T, depth2: T) -> Triangulation<T> {
    // The sum is finite only where every term is; a smaller depth has lost digits to underflow.
    let size = abs(point.x) + abs(point.y) + abs(point.z);
    let least = T::MIN_POSITIVE / T::EPSILON;
    if depth1 >= least && depth2 >= least && size <= T::MAX {
        return Triangulation::Point(point);
    }
    let front = [depth1 > T::ZERO, depth2 > T::ZERO];
    if is_behind(*centre, point, depth1, depth2) {
        let count = 2 - front[0] as usize - front[1] as usize;
        Triangulation::Behind { point, view: front[0] as usize, count }
    } else {
        Triangulation::Undetermined
    }
}

// The rarer answers are told by functions that do not make them, so that a program that asks for points alone drops these;
// the arguments by value: a reference would force the hot path to keep them in memory.
#[cold]
fn is_behind<T: Real>(centre: Vector3<T>, point: Vector3<T>, depth1: T, depth2: T) -> bool {
    let finite = is_finite(depth1) && is_finite(depth2) && all_finite(&point);
    let moved = centre.x != T::ZERO || centre.y != T::ZERO || centre.z != T::ZERO;
    finite && moved && !(depth1 > T::ZERO && depth2 > T::ZERO)
}

/// The verdict where the rays `x1` and `d2`, both in the frame of view 1, have no parallax.
#[inline(always)]
fn judge_parallel<T: Real>(centre: Vector3<T>, x1: Vector3<T>, d2: Vector3<T>) -> Triangulation<T> {
    if is_at_infinity(centre, x1, d2)
        && let Some(x1) = scaled(&x1)
    {
        Triangulation::AtInfinity { direction: over(&x1, sqrt(dot(&x1, &x1))).into() }
    } else {
        Triangulation::Undetermined
    }
}

#[cold]
fn is_at_infinity<T: Real>(centre: Vector3<T>, x1: Vector3<T>, d2: Vector3<T>) -> bool {
    let (Some(x1), Some(d2), Some(c)) = (scaled(&x1), scaled(&d2), scaled(&centre)) else { return false };
    let limit = parallel_sine::<T>() * parallel_sine::<T>();
    let length_sq = dot(&x1, &x1);
    let parallel = |v: &[T; 3]| {
        let normal = cross(&x1, v);
        dot(&normal, &normal) <= limit * length_sq * dot(v, v)
    };
    parallel(&d2) && !parallel(&c) && !(dot(&x1, &d2) <= T::ZERO)
}

fn all_finite<T: Real>(v: &Vector3<T>) -> bool {
    is_finite(v.x) && is_finite(v.y) && is_finite(v.z)
}

/// The vector over its largest coordinate; none for zero and what is not finite.
fn scaled<T: Real>(v: &Vector3<T>) -> Option<[T; 3]> {
    let size = max(abs(v.x), max(abs(v.y), abs(v.z)));
    if !(all_finite(v) && size > T::ZERO) {
        return None;
    }
    let unit = over(&v.data.0[0], size);
    all_finite(&unit.into()).then_some(unit)
}
