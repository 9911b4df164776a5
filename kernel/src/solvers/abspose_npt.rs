//! Absolute pose of four or more points, planes included.

use nalgebra::Vector3;

use crate::geometry::Pose;
use crate::geometry::object_space::fits;
use crate::input::check;
use crate::real::sqrt;
use crate::{InputError, Real, Solutions};

/// The poses that are local minima of the error of a camera that sees `N >= 4` known points.
///
/// `min sum |f_i x (R X_i + t) / |R X_i + t||^2` over rotations and translations, `f_i` the unit bearings: the sines of
/// the angles between the bearings and the points.
///
/// # Input
/// `bearings` of any length in the camera's frame, `points` in the world's, in any unit. Points may lie on a plane. No
/// outliers: see [`estimate::absolute_pose`](crate::estimate::absolute_pose).
///
/// # Returns
/// Up to four poses with every point in front of the camera, the best first. The later ones are local minima, of
/// interest for few points or a plane (see also [`abspose_planar`](super::abspose_planar)).
///
/// # Errors
/// Different lengths, fewer than four, a coordinate that is not finite (array 0 the bearings).
///
/// # Degeneracies
/// Empty where all points or all bearings coincide. For points on a line, one of the poses that fit.
///
/// # Accuracy
/// Noise-free, any pose: 100 % within 1e-6 rad (`f64`) and 1e-3 rad (`f32`); 99.9 % for four points of a plane.
///
/// # Cost
/// Two passes over the points to sum 70 numbers; 48 evaluations and 8 descents of at most 25 steps on those; at most six
/// Gauss-Newton passes for each minimum.
///
/// # References
/// G. Terzakis, M. Lourakis, "A consistently fast and globally optimal solution to the perspective-n-point problem",
/// ECCV 2020 (the quadratic form in the rotation). Here the starts are fixed rotations instead of eigenvectors, the
/// descent stays on the rotations, and the angles are minimised at the end.
///
/// # Examples
/// ```
/// use epipole::geometry::Pose;
/// use epipole::nalgebra::{Point3, Vector3};
/// use epipole::solvers::abspose_npt;
/// let truth = Pose::new(Vector3::new(0.1, -0.2, 1.0), Vector3::new(0.0, 2.3, 0.1));
/// let points: [Vector3<f64>; 5] =
///     [[1.0, 0.0, -4.0], [-1.0, 0.5, -5.0], [0.2, -1.0, -3.0], [0.5, 0.7, -4.0], [0.0, 0.1, -6.0]].map(Vector3::from);
/// let bearings = points.map(|p| (truth * Point3::from(p)).coords);
/// let poses = abspose_npt(&bearings, &points)?;
/// assert!((poses[0].to_homogeneous() - truth.to_homogeneous()).norm() < 1e-9);
/// # Ok::<(), epipole::InputError>(())
/// ```
pub fn abspose_npt<T: Real>(
    bearings: &[Vector3<T>],
    points: &[Vector3<T>],
) -> Result<Solutions<Pose<T>, 4>, InputError> {
    check(bearings, points, 4)?;
    let pairs = bearings.iter().zip(points).map(|(f, x)| (f * (T::ONE / sqrt(f.norm_squared())), *x));
    let mut poses = Solutions::new();
    for fit in fits(pairs, bearings.len() as u32, |_| None) {
        poses.push(fit.pose);
    }
    Ok(poses)
}
