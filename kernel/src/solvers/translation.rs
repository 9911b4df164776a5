//! Direction of translation between two views whose relative rotation is known: two correspondences, or any number.

use nalgebra::{UnitQuaternion, Vector3};

use crate::input::check;
use crate::linalg::RowQr;
use crate::real::{lit, sqrt};
use crate::{InputError, Real};

/// The unit translation of two correspondences, if the rotation is known: `d2 x2 = d1 R x1 + t`.
///
/// `t` is orthogonal to the normals `R x1 x x2` of both epipolar planes, and has both points in front.
///
/// # Input
/// Bearings of any length; `rotation` from view 1 to view 2.
///
/// # Returns
/// None where no translation has both points in front, or the input is degenerate or not finite.
///
/// # Degeneracies
/// None where the camera does not move, or where both points lie in one plane with the baseline.
///
/// # Accuracy
/// A few roundings over the parallax and over the angle between the epipolar planes.
///
/// # Cost
/// Closed form: one square root.
///
/// # References
/// R. Hartley, A. Zisserman, "Multiple View Geometry in Computer Vision", 2nd edition, 2004, section 9.6.
///
/// # Examples
/// ```
/// use epipole::geometry::Pose;
/// use epipole::nalgebra::{Point3, Vector3};
/// use epipole::solvers::translation_2pt;
/// let truth = Pose::new(Vector3::new(0.6, 0.0, 0.8), Vector3::new(0.0, 0.3, 0.1));
/// let x1 = [Vector3::new(1.0, 0.3, 4.0), Vector3::new(-1.0, 0.5, 5.0)];
/// let x2 = x1.map(|x| (truth * Point3::from(x)).coords);
/// let t = translation_2pt(&truth.rotation, &x1, &x2).unwrap();
/// assert!((t - truth.translation.vector).norm() < 1e-12);
/// ```
#[must_use]
pub fn translation_2pt<T: Real>(
    rotation: &UnitQuaternion<T>,
    x1: &[Vector3<T>; 2],
    x2: &[Vector3<T>; 2],
) -> Option<Vector3<T>> {
    let (y0, y1) = (rotation * x1[0], rotation * x1[1]);
    let (n0, n1) = (y0.cross(&x2[0]), y1.cross(&x2[1]));
    let t = n0.cross(&n1);
    let size = t.norm_squared();
    let tiny = T::EPSILON * T::EPSILON * lit::<T>(64.0);
    if !(size > tiny * n0.norm_squared() * n1.norm_squared()) {
        return None;
    }
    let sign = if x2[0].dot(&n1) > T::ZERO { T::ONE } else { -T::ONE };
    let t = t * (sign / sqrt(size));
    let front = in_front(&y0, &x2[0], &n0, &t) > 0 && in_front(&y1, &x2[1], &n1, &t) > 0;
    front.then_some(t)
}

/// 1 where both distances are positive, -1 where both are negative, otherwise 0: `d1 n = x2 x t`, `d2 n = y x t`.
fn in_front<T: Real>(y: &Vector3<T>, x2: &Vector3<T>, n: &Vector3<T>, t: &Vector3<T>) -> i32 {
    let (d1, d2) = (x2.cross(t).dot(n), y.cross(t).dot(n));
    i32::from(d1 > T::ZERO && d2 > T::ZERO) - i32::from(d1 < T::ZERO && d2 < T::ZERO)
}

/// The least-squares unit translation of `N >= 2` correspondences, if the rotation is known:
/// `min sum (t' (R x1 x x2))^2` over unit bearings, with most points in front.
///
/// # Input
/// Bearings of any length but zero; `rotation` from view 1 to view 2. No outliers.
///
/// # Returns
/// None where the translation is not determined.
///
/// # Errors
/// Different lengths, fewer than two, a coordinate that is not finite.
///
/// # Degeneracies
/// None where the camera does not move, where all points lie in one plane with the baseline, and where as many points
/// are in front as behind.
///
/// # Accuracy
/// Noise-free: a few roundings over the parallax.
///
/// # Cost
/// Two passes; an orthogonal factor of three columns, never the squares.
///
/// # References
/// As [`translation_2pt`].
///
/// # Examples
/// ```
/// use epipole::geometry::Pose;
/// use epipole::nalgebra::{Point3, Vector3};
/// use epipole::solvers::translation_npt;
/// let truth = Pose::new(Vector3::new(0.6, 0.0, 0.8), Vector3::new(0.0, 0.3, 0.1));
/// let x1: [Vector3<f64>; 3] = [[1.0, 0.3, 4.0], [-1.0, 0.5, 5.0], [0.2, -1.0, 3.0]].map(Vector3::from);
/// let x2 = x1.map(|x| (truth * Point3::from(x)).coords);
/// let t = translation_npt(&truth.rotation, &x1, &x2)?.unwrap();
/// assert!((t - truth.translation.vector).norm() < 1e-12);
/// # Ok::<(), epipole::InputError>(())
/// ```
pub fn translation_npt<T: Real>(
    rotation: &UnitQuaternion<T>,
    x1: &[Vector3<T>],
    x2: &[Vector3<T>],
) -> Result<Option<Vector3<T>>, InputError> {
    check(x1, x2, 2)?;
    let r = rotation.to_rotation_matrix().into_inner();
    let normal = |a: &Vector3<T>, b: &Vector3<T>| {
        let y = r * a;
        let scale = T::ONE / sqrt(y.norm_squared() * b.norm_squared());
        (y, y.cross(b) * scale)
    };
    let mut factor = RowQr::<T, 3>::new();
    for (a, b) in x1.iter().zip(x2) {
        let (_, n) = normal(a, b);
        factor.fold([[n.x, n.y, n.z]]);
    }
    let Some(least) = factor.least_singular() else { return Ok(None) };
    // Two orthogonal directions must be better determined than by rounding.
    let floor = T::EPSILON * lit::<T>(16.0);
    if !(least.next_value > floor) || !(least.next_value > least.value * T::TWO) {
        return Ok(None);
    }
    let t = Vector3::from(least.vector);
    let mut vote = 0;
    for (a, b) in x1.iter().zip(x2) {
        let (y, n) = normal(a, b);
        vote += in_front(&y, b, &n, &t);
    }
    Ok(match vote {
        0 => None,
        v if v > 0 => Some(t),
        _ => Some(-t),
    })
}
