//! Absolute orientation: the rigid motion or similarity between two sets of points in space.

use nalgebra::{Matrix3, Similarity3, Translation3, UnitQuaternion, Vector3};

use crate::geometry::Pose;
use crate::geometry::pose::{finite, quaternion_from_matrix};
use crate::input::check;
use crate::linalg::svd3;
use crate::real::{from_u32, lit};
use crate::{InputError, Real};

/// The least-squares rigid motion of `N >= 3` points: `min sum |b - (R a + t)|^2`.
///
/// # Input
/// Points in any unit, the same for both. No outliers.
///
/// # Returns
/// The motion from `a` to `b`. None where it is not determined.
///
/// # Errors
/// Different lengths, fewer than three, a coordinate that is not finite.
///
/// # Degeneracies
/// None for points that coincide or lie on a line. Planar points are no problem; a mirror image gets the best rotation,
/// never a reflection.
///
/// # Accuracy
/// Noise-free: a few roundings of the distances from the mean.
///
/// # Cost
/// Two passes, and one singular value decomposition of a 3x3 matrix.
///
/// # References
/// S. Umeyama, "Least-squares estimation of transformation parameters between two point patterns", IEEE TPAMI 1991.
///
/// # Examples
/// ```
/// use epipole::geometry::Pose;
/// use epipole::nalgebra::{Point3, Vector3};
/// use epipole::solvers::absolute_orientation_npt;
/// let truth = Pose::new(Vector3::new(0.6, 0.0, 0.8), Vector3::new(0.0, 0.3, 0.1));
/// let a: [Vector3<f64>; 3] = [[1.0, 0.3, 4.0], [-1.0, 0.5, 5.0], [0.2, -1.0, 3.0]].map(Vector3::from);
/// let b = a.map(|x| (truth * Point3::from(x)).coords);
/// let pose = absolute_orientation_npt(&a, &b)?.unwrap();
/// assert!((pose.to_homogeneous() - truth.to_homogeneous()).norm() < 1e-13);
/// # Ok::<(), epipole::InputError>(())
/// ```
pub fn absolute_orientation_npt<T: Real>(
    a: &[Vector3<T>],
    b: &[Vector3<T>],
) -> Result<Option<Pose<T>>, InputError> {
    check(a, b, 3)?;
    Ok(align(a, b).and_then(|fit| {
        let t = fit.mean_b - fit.rotation * fit.mean_a;
        finite(Pose::from_parts(Translation3::from(t), fit.rotation))
    }))
}

/// The least-squares similarity of `N >= 3` points: `min sum |b - (s R a + t)|^2`, with `s > 0`.
///
/// # Input
/// Points in any units. No outliers.
///
/// # Returns
/// The similarity from `a` to `b`. None where it is not determined.
///
/// # Errors
/// Different lengths, fewer than three, a coordinate that is not finite.
///
/// # Degeneracies
/// As [`absolute_orientation_npt`].
///
/// # Accuracy
/// As [`absolute_orientation_npt`].
///
/// # Cost
/// As [`absolute_orientation_npt`].
///
/// # References
/// S. Umeyama, "Least-squares estimation of transformation parameters between two point patterns", IEEE TPAMI 1991.
///
/// # Examples
/// ```
/// use epipole::nalgebra::{Point3, Similarity3, Vector3};
/// use epipole::solvers::absolute_orientation_with_scale_npt;
/// let truth = Similarity3::new(Vector3::new(0.6, 0.0, 0.8), Vector3::new(0.0, 0.3, 0.1), 2.5);
/// let a: [Vector3<f64>; 3] = [[1.0, 0.3, 4.0], [-1.0, 0.5, 5.0], [0.2, -1.0, 3.0]].map(Vector3::from);
/// let b = a.map(|x| (truth * Point3::from(x)).coords);
/// let found = absolute_orientation_with_scale_npt(&a, &b)?.unwrap();
/// assert!((found.scaling() - 2.5).abs() < 1e-13);
/// # Ok::<(), epipole::InputError>(())
/// ```
pub fn absolute_orientation_with_scale_npt<T: Real>(
    a: &[Vector3<T>],
    b: &[Vector3<T>],
) -> Result<Option<Similarity3<T>>, InputError> {
    check(a, b, 3)?;
    Ok(align(a, b).and_then(|fit| {
        let t = fit.mean_b - fit.rotation * fit.mean_a * fit.scale;
        let pose = finite(Pose::from_parts(Translation3::from(t), fit.rotation))?;
        let scale = fit.scale;
        (scale > T::ZERO && scale <= T::MAX).then(|| Similarity3::from_isometry(pose, scale))
    }))
}

struct Alignment<T: Real> {
    rotation: UnitQuaternion<T>,
    scale: T,
    mean_a: Vector3<T>,
    mean_b: Vector3<T>,
}

fn align<T: Real>(a: &[Vector3<T>], b: &[Vector3<T>]) -> Option<Alignment<T>> {
    let share = T::ONE / from_u32(a.len() as u32);
    let (mut mean_a, mut mean_b) = (Vector3::zeros(), Vector3::zeros());
    for (p, q) in a.iter().zip(b) {
        mean_a += p * share;
        mean_b += q * share;
    }
    let (mut cross, mut spread) = (Matrix3::zeros(), T::ZERO);
    for (p, q) in a.iter().zip(b) {
        let (p, q) = (p - mean_a, q - mean_b);
        cross += q * p.transpose();
        spread += p.norm_squared();
    }
    let svd = svd3(&cross)?;
    // On a line the second value is rounding.
    if !(svd.s[1] > svd.s[0] * T::EPSILON * lit::<T>(64.0)) {
        return None;
    }
    let sign = if svd.u.determinant() * svd.v.determinant() < T::ZERO { -T::ONE } else { T::ONE };
    let mut u = svd.u;
    for i in 0..3 {
        u[(i, 2)] *= sign;
    }
    let rotation = quaternion_from_matrix(&(u * svd.v.transpose()));
    let scale = (svd.s[0] + svd.s[1] + svd.s[2] * sign) / spread;
    Some(Alignment { rotation, scale, mean_a, mean_b })
}
