//! Absolute pose of a planar target, with the second pose that a plane allows.

use nalgebra::{Translation3, Vector2, Vector3};

use crate::geometry::Pose;
use crate::geometry::object_space::fits;
use crate::geometry::pose::from_parts;
use crate::input::check_finite;
use crate::real::sqrt;
use crate::{InputError, Real, Solutions};

/// One of the poses of a planar target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarTargetPose<T: Real> {
    /// Target to camera.
    pub pose: Pose<T>,
    /// Root mean square of the angles between the bearings and the target's points, rad: times the focal length, the
    /// reprojection error in pixels.
    pub rms_rad: T,
}

/// The up to two poses of a camera that sees `N >= 4` points of a planar target, such as the corners of a square marker.
///
/// Small or distant targets look alike in two poses, whose normals are mirrored in the line of sight. Both are
/// returned with their errors: trust the first where the second's is larger by several times the noise, otherwise
/// decide by the last pose or by another sensor.
///
/// # Input
/// `bearings` of any length in the camera's frame; `points` on the target's plane z = 0, in any unit.
///
/// # Returns
/// Poses with every point in front of the camera, the smaller error first. One where the target is seen so near that the
/// second pose is no local minimum any more.
///
/// # Errors
/// Different lengths, fewer than four, a coordinate that is not finite (array 0 the bearings).
///
/// # Degeneracies
/// Empty where all points or all bearings coincide. For points on a line, one of the poses that fit.
///
/// # Accuracy
/// As [`abspose_npt`](super::abspose_npt).
///
/// # Cost
/// Twice that of [`abspose_npt`](super::abspose_npt).
///
/// # References
/// G. Schweighofer, A. Pinz, "Robust pose estimation from a planar target", IEEE TPAMI 2006; T. Collins, A. Bartoli,
/// "Infinitesimal plane-based pose estimation", IJCV 2014.
///
/// # Examples
/// ```
/// use epipole::geometry::Pose;
/// use epipole::nalgebra::{Point3, Vector2, Vector3};
/// use epipole::solvers::abspose_planar;
/// let truth = Pose::new(Vector3::new(0.1, -0.2, 1.0), Vector3::new(0.4, 0.2, 0.1));
/// let square = [[-0.03, -0.03], [0.03, -0.03], [0.03, 0.03], [-0.03, 0.03]].map(Vector2::<f64>::from);
/// let bearings = square.map(|p| (truth * Point3::new(p.x, p.y, 0.0)).coords);
/// let poses = abspose_planar(&bearings, &square)?;
/// assert!((poses[0].pose.to_homogeneous() - truth.to_homogeneous()).norm() < 1e-9);
/// assert!(poses.len() == 2 && poses[1].rms_rad > 1e-5);
/// # Ok::<(), epipole::InputError>(())
/// ```
pub fn abspose_planar<T: Real>(
    bearings: &[Vector3<T>],
    points: &[Vector2<T>],
) -> Result<Solutions<PlanarTargetPose<T>, 2>, InputError> {
    check_finite(bearings, 0)?;
    check_finite(points, 1)?;
    if bearings.len() != points.len() {
        return Err(InputError::LengthMismatch { first: bearings.len(), second: points.len() });
    }
    if bearings.len() < 4 {
        return Err(InputError::TooFew { given: bearings.len(), needed: 4 });
    }
    let pairs = bearings
        .iter()
        .zip(points)
        .map(|(f, x)| (f * (T::ONE / sqrt(f.norm_squared())), Vector3::new(x.x, x.y, T::ZERO)));
    let mut poses = Solutions::new();
    for fit in fits(pairs, bearings.len() as u32, mirrored) {
        poses.push(PlanarTargetPose { pose: fit.pose, rms_rad: fit.rms_rad });
    }
    Ok(poses)
}

/// The pose whose plane has its normal mirrored in the line of sight to the target's middle (the origin).
fn mirrored<T: Real>(pose: &Pose<T>) -> Option<Pose<T>> {
    let middle = pose.translation.vector;
    let sight = middle * (T::ONE / sqrt(middle.norm_squared()));
    let r = pose.rotation.to_rotation_matrix().into_inner();
    // (I - 2 s s') R (I - 2 z z')
    let mut other = r - sight * (r.transpose() * sight).transpose() * T::TWO;
    for i in 0..3 {
        other[(i, 2)] = -other[(i, 2)];
    }
    let Translation3 { vector } = pose.translation;
    Some(from_parts(&other, &vector))
}
