//! Camera models: where a point of the camera frame appears in the image, and back.
//!
//! Camera frame: x right, y down, z forward. Pixels: the centre of the top-left pixel is (0, 0).
//!
//! | model | lens | parameters after `fx fy cx cy` |
//! |---|---|---|
//! | [`Pinhole`] | none, or images already undistorted | |
//! | [`BrownConrady`] | ordinary lens, radial and tangential distortion | `k1 k2 p1 p2 k3` (OpenCV's order) |
//! | [`KannalaBrandt`] | fisheye, also beyond 90 degrees off the axis | `k1 k2 k3 k4` (OpenCV's `fisheye`) |
//!
//! [`Camera`] holds any of them by value. An accepted answer is always finite, whatever the input's bits.

use core::fmt;

use nalgebra::{Matrix2x3, Matrix3x2, Vector2, Vector3};

use crate::real::{is_finite, lit};
use crate::{Real, Solutions};

mod brown_conrady;
mod kannala_brandt;
mod pinhole;

pub use brown_conrady::BrownConrady;
pub use kannala_brandt::KannalaBrandt;
pub use pinhole::Pinhole;

/// What every camera model answers.
pub trait CameraModel<T: Real> {
    /// The pixel of a point of the camera frame; none where the camera cannot see it: behind the camera, outside the
    /// domain in which the lens model is one-to-one, or not finite.
    #[must_use]
    fn project(&self, point: &Vector3<T>) -> Option<Vector2<T>>;

    /// [`project`](Self::project), and the Jacobian of the pixel by the point.
    #[must_use]
    fn project_with_jacobian(&self, point: &Vector3<T>) -> Option<(Vector2<T>, Matrix2x3<T>)>;

    /// The unit bearing of a pixel.
    ///
    /// # Errors
    /// [`UnprojectError`]: the pixel is not finite, no point of the model's domain appears there, or the bounded
    /// iteration did not reach it.
    fn unproject(&self, pixel: &Vector2<T>) -> Result<Vector3<T>, UnprojectError>;

    /// [`unproject`](Self::unproject), and the Jacobian of the unit bearing by the pixel, in rad/px.
    ///
    /// Its columns are tangent to the unit sphere. With a covariance `S` of the pixel, `J S J'` is the bearing's: so
    /// a threshold in pixels is stated exactly wherever in the image the point lies, fisheye included.
    ///
    /// # Errors
    /// As [`unproject`](Self::unproject).
    fn unproject_with_jacobian(
        &self,
        pixel: &Vector2<T>,
    ) -> Result<(Vector3<T>, Matrix3x2<T>), UnprojectError>;

    /// The mean focal length in pixels: pixels per radian at the principal point.
    #[must_use]
    fn focal(&self) -> T;

    /// The focal lengths `(fx, fy)` in pixels of a lens whose image is, but for distortion, that of the plane z = 1:
    /// estimators then work on that plane. None for a fisheye, whose bearings may leave it.
    #[must_use]
    fn rectilinear(&self) -> Option<(T, T)> {
        None
    }
}

/// Any of the camera models, by value.
///
/// ```
/// use epipole::geometry::{Camera, CameraModel, Pinhole};
/// use epipole::nalgebra::{Vector2, Vector3};
/// let camera: Camera<f32> = Pinhole::new(500.0, 500.0, 320.0, 240.0)?.into();
/// let pixel = camera.project(&Vector3::new(0.1, 0.0, 1.0)).unwrap();
/// assert_eq!(pixel, Vector2::new(370.0, 240.0));
/// # Ok::<(), epipole::geometry::CameraError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Camera<T: Real> {
    /// No distortion.
    Pinhole(Pinhole<T>),
    /// Radial and tangential distortion.
    BrownConrady(BrownConrady<T>),
    /// Fisheye.
    KannalaBrandt(KannalaBrandt<T>),
}

macro_rules! delegate {
    ($self:ident, $camera:ident => $call:expr) => {
        match $self {
            Self::Pinhole($camera) => $call,
            Self::BrownConrady($camera) => $call,
            Self::KannalaBrandt($camera) => $call,
        }
    };
}

impl<T: Real> Camera<T> {
    /// The focal lengths and the principal point.
    #[must_use]
    pub fn pinhole(&self) -> Pinhole<T> {
        match self {
            Self::Pinhole(camera) => *camera,
            Self::BrownConrady(camera) => camera.pinhole(),
            Self::KannalaBrandt(camera) => camera.pinhole(),
        }
    }
}

impl<T: Real> CameraModel<T> for Camera<T> {
    fn project(&self, point: &Vector3<T>) -> Option<Vector2<T>> {
        delegate!(self, camera => camera.project(point))
    }
    fn project_with_jacobian(&self, point: &Vector3<T>) -> Option<(Vector2<T>, Matrix2x3<T>)> {
        delegate!(self, camera => camera.project_with_jacobian(point))
    }
    fn unproject(&self, pixel: &Vector2<T>) -> Result<Vector3<T>, UnprojectError> {
        delegate!(self, camera => camera.unproject(pixel))
    }
    fn unproject_with_jacobian(
        &self,
        pixel: &Vector2<T>,
    ) -> Result<(Vector3<T>, Matrix3x2<T>), UnprojectError> {
        delegate!(self, camera => camera.unproject_with_jacobian(pixel))
    }
    fn focal(&self) -> T {
        delegate!(self, camera => camera.focal())
    }
    fn rectilinear(&self) -> Option<(T, T)> {
        delegate!(self, camera => camera.rectilinear())
    }
}

impl<T: Real> From<Pinhole<T>> for Camera<T> {
    fn from(camera: Pinhole<T>) -> Self {
        Self::Pinhole(camera)
    }
}

impl<T: Real> From<BrownConrady<T>> for Camera<T> {
    fn from(camera: BrownConrady<T>) -> Self {
        Self::BrownConrady(camera)
    }
}

impl<T: Real> From<KannalaBrandt<T>> for Camera<T> {
    fn from(camera: KannalaBrandt<T>) -> Self {
        Self::KannalaBrandt(camera)
    }
}

/// Why a camera cannot be made of these parameters. The parameter is named as in its constructor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum CameraError {
    /// NaN or infinite.
    NotFinite {
        /// `"fx"`, `"k1"`, ...
        parameter: &'static str,
    },
    /// A focal length of zero or less.
    NotPositive {
        /// `"fx"` or `"fy"`
        parameter: &'static str,
    },
}

impl CameraError {
    /// The first of `values` that is not finite, by its name.
    fn check_finite<T: Real>(names: &[&'static str], values: &[T]) -> Result<(), Self> {
        match names.iter().zip(values).find(|(_, v)| !is_finite(**v)) {
            Some((parameter, _)) => Err(Self::NotFinite { parameter }),
            None => Ok(()),
        }
    }
}

impl fmt::Display for CameraError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NotFinite { parameter } => write!(f, "camera parameter {parameter} is not finite"),
            Self::NotPositive { parameter } => write!(f, "camera parameter {parameter} is not positive"),
        }
    }
}

impl core::error::Error for CameraError {}

/// Why a pixel has no bearing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum UnprojectError {
    /// A coordinate of the pixel is NaN or infinite, or so large that its bearing is not.
    NotFinite,
    /// No point of the domain in which the lens model is one-to-one appears at this pixel.
    OutsideDomain,
    /// The bounded iteration did not reach the pixel.
    NotConverged,
}

impl fmt::Display for UnprojectError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "the pixel is not finite",
            Self::OutsideDomain => "the pixel lies outside the image of the lens model",
            Self::NotConverged => "the distortion could not be inverted at this pixel",
        })
    }
}

impl core::error::Error for UnprojectError {}

/// `value` where all its numbers are finite.
#[inline]
fn finite<T: Real, V>(value: V, numbers: &[T]) -> Option<V> {
    numbers.iter().all(|x| is_finite(*x)).then_some(value)
}

/// The unit vector along `(x, y, 1)` and its Jacobian by `(x, y)`.
#[inline]
fn bearing_of_plane_point<T: Real>(p: &Vector2<T>) -> (Vector3<T>, Matrix3x2<T>) {
    let w = T::ONE / crate::real::sqrt(T::ONE + p.x * p.x + p.y * p.y);
    let b = Vector3::new(p.x * w, p.y * w, w);
    let jacobian = Matrix3x2::new(
        w - b.x * b.x * w,
        -b.x * b.y * w,
        -b.x * b.y * w,
        w - b.y * b.y * w,
        -b.x * b.z * w,
        -b.y * b.z * w,
    );
    (b, jacobian)
}

/// The smallest root in `(0, end)` of `c[0] + c[1] s + .. + c[4] s^4`, by the roots of its derivatives: between two
/// neighbours a polynomial is monotone and bisection cannot miss. None where there is none.
fn first_root<T: Real>(c: &[T; 5], end: T) -> Option<T> {
    let [_, c1, c2, c3, c4] = *c;
    let derivatives = [
        [lit::<T>(6.0) * c3, lit::<T>(24.0) * c4, T::ZERO, T::ZERO, T::ZERO],
        [lit::<T>(2.0) * c2, lit::<T>(6.0) * c3, lit::<T>(12.0) * c4, T::ZERO, T::ZERO],
        [c1, lit::<T>(2.0) * c2, lit::<T>(3.0) * c3, lit::<T>(4.0) * c4, T::ZERO],
        *c,
    ];
    let mut knots = Solutions::<T, 5>::new();
    for p in &derivatives {
        let value = |s: T| p.iter().rev().fold(T::ZERO, |sum, &k| sum * s + k);
        let mut roots = Solutions::<T, 5>::new();
        let mut low = T::ZERO;
        for &high in knots.iter().chain(core::iter::once(&end)) {
            let rising = value(high) > T::ZERO;
            if (value(low) > T::ZERO) != rising {
                let (mut a, mut b) = (low, high);
                for _ in 0..64 {
                    let middle = (a + b) * T::HALF;
                    if (value(middle) > T::ZERO) == rising {
                        b = middle;
                    } else {
                        a = middle;
                    }
                }
                roots.push(a);
            }
            low = high;
        }
        knots = roots;
    }
    knots.first().copied()
}
