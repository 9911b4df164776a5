//! Rotation between two views of the same bearings: two correspondences, or any number.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::geometry::pose::quaternion_from_matrix;
use crate::input::check;
use crate::linalg::svd3;
use crate::real::{is_finite, lit, sqrt};
use crate::{InputError, Real};

/// The rotation that maps two bearings onto two others: `x2 ~ R x1`.
///
/// It maps the bisector of the first pair onto that of the second and the plane onto the plane, which is the
/// least-squares rotation where the angles between the two differ.
///
/// # Input
/// Bearings of any length.
///
/// # Returns
/// None where the two bearings of a view are parallel or opposite, or the input is not finite.
///
/// # Degeneracies
/// Nearly parallel bearings: the rotation about them takes the noise over their angle.
///
/// # Accuracy
/// A few roundings over the sine of the angle between the bearings.
///
/// # Cost
/// Closed form: seven square roots.
///
/// # References
/// H. Black, "A passive system for determining the attitude of a satellite", AIAA Journal, 1964; here symmetric in the
/// two bearings.
///
/// # Examples
/// ```
/// use epipole::nalgebra::{UnitQuaternion, Vector3};
/// use epipole::solvers::rotation_2pt;
/// let truth = UnitQuaternion::new(Vector3::new(0.1, -0.4, 0.2));
/// let x1 = [Vector3::new(0.1, 0.2, 1.0), Vector3::new(-0.4, 0.1, 1.0)];
/// let rotation = rotation_2pt(&x1, &x1.map(|x| truth * x)).unwrap();
/// assert!(rotation.angle_to(&truth) < 1e-14);
/// ```
#[must_use]
pub fn rotation_2pt<T: Real>(x1: &[Vector3<T>; 2], x2: &[Vector3<T>; 2]) -> Option<UnitQuaternion<T>> {
    let (a, b) = (frame(x1)?, frame(x2)?);
    let rotation = quaternion_from_matrix(&(b * a.transpose()));
    rotation.coords.iter().all(|&x| is_finite(x)).then_some(rotation)
}

/// Bisector, normal and their cross product as columns.
fn frame<T: Real>([a, b]: &[Vector3<T>; 2]) -> Option<Matrix3<T>> {
    let unit = |v: &Vector3<T>| v * (T::ONE / sqrt(v.norm_squared()));
    let (a, b) = (unit(a), unit(b));
    let (sum, difference) = (a + b, a - b);
    let tiny = T::EPSILON * T::EPSILON * lit::<T>(16.0);
    if !(sum.norm_squared() > tiny && difference.norm_squared() > tiny) {
        return None;
    }
    // Of unit vectors, the sum and the difference are orthogonal.
    let (e1, e2) = (unit(&sum), unit(&difference));
    let e2 = unit(&(e2 - e1 * e1.dot(&e2)));
    Some(Matrix3::from_columns(&[e1, e2, e1.cross(&e2)]))
}

/// The least-squares rotation of `N >= 2` correspondences: `min sum |x2 - R x1|^2` over unit bearings.
///
/// # Input
/// Bearings of any length but zero. No outliers.
///
/// # Returns
/// None where the bearings do not fix the rotation: all parallel in a view.
///
/// # Errors
/// Different lengths, fewer than two, a coordinate that is not finite.
///
/// # Degeneracies
/// As above; also where a bearing is zero.
///
/// # Accuracy
/// Noise-free, bearings spread over the image: a few roundings.
///
/// # Cost
/// One pass, and one singular value decomposition of a 3x3 matrix.
///
/// # References
/// W. Kabsch, "A solution for the best rotation to relate two sets of vectors", Acta Crystallographica, 1976.
///
/// # Examples
/// ```
/// use epipole::nalgebra::{UnitQuaternion, Vector3};
/// use epipole::solvers::rotation_npt;
/// let truth = UnitQuaternion::new(Vector3::new(0.1, -0.4, 0.2));
/// let x1: [Vector3<f64>; 3] = [[0.1, 0.2, 1.0], [-0.4, 0.1, 1.0], [0.0, -0.3, 1.0]].map(Vector3::from);
/// let rotation = rotation_npt(&x1, &x1.map(|x| truth * x))?.unwrap();
/// assert!(rotation.angle_to(&truth) < 1e-14);
/// # Ok::<(), epipole::InputError>(())
/// ```
pub fn rotation_npt<T: Real>(
    x1: &[Vector3<T>],
    x2: &[Vector3<T>],
) -> Result<Option<UnitQuaternion<T>>, InputError> {
    check(x1, x2, 2)?;
    let mut sum = Matrix3::zeros();
    for (a, b) in x1.iter().zip(x2) {
        sum += b * (a * (T::ONE / sqrt(a.norm_squared() * b.norm_squared()))).transpose();
    }
    Ok(nearest_rotation(&sum).map(|r| quaternion_from_matrix(&r)))
}

/// The rotation that maximises `trace(R' m)`; none where more than one does.
fn nearest_rotation<T: Real>(m: &Matrix3<T>) -> Option<Matrix3<T>> {
    let svd = svd3(m)?;
    if !(svd.s[1] > svd.s[0] * T::EPSILON * lit::<T>(64.0)) {
        return None;
    }
    // U and V are completed to right-handed frames or not: the least direction takes the sign.
    let sign = if svd.u.determinant() * svd.v.determinant() < T::ZERO { -T::ONE } else { T::ONE };
    let mut u = svd.u;
    for i in 0..3 {
        u[(i, 2)] *= sign;
    }
    Some(u * svd.v.transpose())
}
