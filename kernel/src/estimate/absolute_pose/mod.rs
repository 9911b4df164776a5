//! The pose of a calibrated camera from pixels of known points.

use nalgebra::{Vector2, Vector3};

use crate::geometry::CameraModel;
use crate::linalg::LANES;
use crate::real::{from_u32, is_finite, lit};
use crate::refine::blocks::Block;
use crate::refine::reprojection::{BearingPointBlock, PlanePointBlock};
use crate::robust::Guide;
use crate::robust::budget::check_noise;
use crate::{InputError, Real};

mod hypothesis;
mod judge;
mod options;
mod search;
mod shape;
mod verdict;
mod workspace;

use judge::{Task, estimate};
pub use options::{AbsolutePoseError, AbsolutePoseOptions, GravityPrior};
use search::Gravity;
pub use verdict::{AbsolutePose, AbsolutePoseEstimate, AbsolutePoseVerdict};
pub use workspace::{AbsolutePoseStorage, AbsolutePoseWorkspace, WideAbsolutePoseStorage};

/// The fewest correspondences: three leave up to four poses.
const NEEDED: usize = 4;

/// The pose of a camera from pixels of known points, many of which may be wrong, or why there is none.
///
/// `x ~ project(R X + t)`.
///
/// # Input
/// `pixels[i]` is where the camera sees `points[i]` (the world's frame, any unit); at least four, at most the
/// workspace's capacity.
///
/// # Returns
/// An [`AbsolutePoseVerdict`] with the report of the search; the inlier mask stands in the workspace.
///
/// # Errors
/// [`AbsolutePoseError`]: different lengths, fewer than four, more than the capacity, a coordinate that is not finite
/// (array 0 the pixels, 1 the points), an option out of range. Nothing has been written then.
///
/// # Degeneracies
/// Inliers on a line or on fewer than four distinct points: `Unobservable`. On a plane far away or small, two poses fit
/// alike: `PlanarAmbiguity` with both. Points that fit only behind the camera: `BehindCamera`. Agreement that the best of as
/// many hypotheses would meet by accident (measured on the pixels with the points of others) is no consensus.
///
/// # Accuracy
/// That of a maximum-likelihood fit to the inliers (Tukey's loss, ending at two thresholds). Distortion is removed from the
/// pixels beforehand; [`refine::absolute_pose`](crate::refine::absolute_pose) measures in the distorted image. A gravity
/// prior is weighed against the option's sigma or, where that is less, against the noise seen.
///
/// # Cost
/// Bounded by [`Budget`](crate::robust::Budget). With gravity the search by two correspondences takes as many samples as a
/// twentieth of inliers needs; where it finds less than 30 %, or a pose that contradicts the prior, one without gravity
/// takes what is left.
///
/// # References
/// M. Fischler, R. Bolles, "Random sample consensus", Communications of the ACM, 1981; O. Chum, J. Matas, J. Kittler,
/// "Locally optimized RANSAC", DAGM 2003; G. Schweighofer, A. Pinz, "Robust pose estimation from a planar target", IEEE
/// TPAMI 2006 (the second pose of a plane).
///
/// # Examples
/// ```
/// use epipole::estimate::{AbsolutePoseOptions, AbsolutePoseStorage, absolute_pose};
/// use epipole::geometry::{CameraModel, Pinhole, Pose};
/// use epipole::nalgebra::{Point3, Vector2, Vector3};
///
/// let camera = Pinhole::new(500.0, 500.0, 320.0, 240.0)?;
/// let truth = Pose::new(Vector3::new(-1.0, 0.0, 0.0), Vector3::new(0.0, 0.1, 0.0));
/// let (mut pixels, mut points) = ([Vector2::zeros(); 60], [Vector3::zeros(); 60]);
/// for k in 0..60 {
///     let i = k as f64;
///     points[k] = Vector3::new((1.7 * i).sin() * 2.0, (2.3 * i).cos(), 5.0 + 2.0 * (0.9 * i).sin());
///     pixels[k] = camera.project(&(truth * Point3::from(points[k])).coords).unwrap();
///     if k % 3 == 0 {
///         pixels[k] = Vector2::new((i * 77.0) % 640.0, (i * 31.0) % 480.0); // A wrong match.
///     }
/// }
/// let mut storage = AbsolutePoseStorage::<f64, 60>::new();
/// let mut workspace = storage.workspace();
/// let options = AbsolutePoseOptions::default();
/// let estimate = absolute_pose(&camera, &pixels, &points, &options, &mut workspace)?;
/// let pose = estimate.pose().unwrap();
/// assert!((pose.to_homogeneous() - truth.to_homogeneous()).norm() < 1e-8);
/// assert!(!workspace.inliers()[0] && workspace.inliers()[1]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
// Inlined, as the next: the options' constants and the camera's type then reach it.
#[inline(always)]
pub fn absolute_pose<T: Real>(
    camera: &impl CameraModel<T>,
    pixels: &[Vector2<T>],
    points: &[Vector3<T>],
    options: &AbsolutePoseOptions<T>,
    workspace: &mut AbsolutePoseWorkspace<'_, T>,
) -> Result<AbsolutePoseEstimate<T>, AbsolutePoseError> {
    absolute_pose_guided(camera, pixels, points, options, Guide::none(), workspace)
}

/// [`absolute_pose`], with match scores for ordered sampling, or with a caller's "may I go on?".
///
/// # Input
/// As [`absolute_pose`], and a [`Guide`].
///
/// # Returns
/// As [`absolute_pose`]. A run that the guide ended is repeated bit for bit by a budget of as many iterations as the report
/// tells.
///
/// # Errors
/// As [`absolute_pose`], and [`InputError::LengthMismatch`](crate::InputError) where there are scores but not one for each
/// correspondence.
///
/// # Cost
/// As [`absolute_pose`], and about `2 n log2 n` comparisons for the order of the scores.
///
/// # References
/// O. Chum, J. Matas, "Matching with PROSAC", CVPR 2005.
///
/// # Examples
/// See [`relative_pose_guided`](super::relative_pose_guided) and [`homography_guided`](super::homography_guided), which
/// take a guide alike.
// Inlined: of options without a prior and cameras that are never a fisheye the compiler then drops what serves them.
#[inline(always)]
pub fn absolute_pose_guided<T: Real>(
    camera: &impl CameraModel<T>,
    pixels: &[Vector2<T>],
    points: &[Vector3<T>],
    options: &AbsolutePoseOptions<T>,
    guide: Guide<'_, T>,
    workspace: &mut AbsolutePoseWorkspace<'_, T>,
) -> Result<AbsolutePoseEstimate<T>, AbsolutePoseError> {
    let sigma_px = check_noise(options.max_error_px, options.sigma_px)?;
    options.ransac.check()?;
    let gravity = match &options.gravity {
        Some(prior) => Some(Gravity::new(prior, sigma_px).ok_or(AbsolutePoseError::Gravity)?),
        None => None,
    };
    let focal = camera.rectilinear();
    let capacity = match focal {
        Some(_) => workspace.capacity_of::<PlanePointBlock<T>>(),
        None => workspace.capacity_of::<BearingPointBlock<T>>(),
    };
    check(pixels, points, capacity)?;
    if let Some(scores) = guide.scores
        && scores.len() != pixels.len()
    {
        return Err(InputError::LengthMismatch { first: pixels.len(), second: scores.len() }.into());
    }
    workspace.count = pixels.len();
    // Points about their mean: the digits of f32 are not spent on a distant origin.
    let mut mean = Vector3::zeros();
    let share = T::ONE / from_u32(points.len() as u32);
    for point in points {
        mean += point * share;
    }
    let task = Task { options, sigma_px, mean };
    let pairs = pixels.iter().zip(points).map(|(pixel, point)| (pixel, point - mean));
    Ok(match focal {
        Some((fx, fy)) => {
            fill::<T, PlanePointBlock<T>, 5>(
                workspace.numbers,
                pairs.map(|(pixel, p)| {
                    let [u, v] = match camera.unproject(pixel) {
                        Ok(f) if f.z > T::ZERO => [fx * f.x / f.z, fy * f.y / f.z],
                        _ => [lit(f64::NAN); 2],
                    };
                    [u, v, p.x, p.y, p.z]
                }),
            );
            estimate::<T, PlanePointBlock<T>>(&task, gravity, [fx, fy], guide, workspace)
        }
        None => {
            fill::<T, BearingPointBlock<T>, 12>(
                workspace.numbers,
                pairs.map(|(pixel, p)| bearing_rows(camera, pixel, &p)),
            );
            estimate::<T, BearingPointBlock<T>>(&task, gravity, [camera.focal(); 2], guide, workspace)
        }
    })
}

fn check<T: Real>(pixels: &[Vector2<T>], points: &[Vector3<T>], capacity: usize) -> Result<(), InputError> {
    let given = pixels.len();
    if given != points.len() {
        return Err(InputError::LengthMismatch { first: given, second: points.len() });
    }
    if given < NEEDED {
        return Err(InputError::TooFew { given, needed: NEEDED });
    }
    if given > capacity {
        return Err(InputError::TooMany { given, capacity });
    }
    for (index, p) in pixels.iter().enumerate() {
        if !(is_finite(p.x) && is_finite(p.y)) {
            return Err(InputError::NotFinite { array: 0, index });
        }
    }
    for (index, p) in points.iter().enumerate() {
        if !(is_finite(p.x) && is_finite(p.y) && is_finite(p.z)) {
            return Err(InputError::NotFinite { array: 1, index });
        }
    }
    Ok(())
}

/// The rows a, b, c of a pixel, then its point: c the bearing, a and b the pseudo-inverse of its derivative.
fn bearing_rows<T: Real>(camera: &impl CameraModel<T>, pixel: &Vector2<T>, p: &Vector3<T>) -> [T; 12] {
    let nan = lit(f64::NAN);
    let Ok((f, j)) = camera.unproject_with_jacobian(pixel) else {
        return [nan, nan, nan, nan, nan, nan, nan, nan, nan, p.x, p.y, p.z];
    };
    let (j0, j1) = (j.column(0), j.column(1));
    let (uu, uv, vv) = (j0.dot(&j0), j0.dot(&j1), j1.dot(&j1));
    let inverse = T::ONE / (uu * vv - uv * uv);
    let a = (j0 * vv - j1 * uv) * inverse;
    let b = (j1 * uu - j0 * uv) * inverse;
    [a.x, a.y, a.z, b.x, b.y, b.z, f.x, f.y, f.z, p.x, p.y, p.z]
}

/// Writes correspondences into blocks, four side by side; the lanes left in the last block are zero.
fn fill<T: Real, B: Block<T>, const W: usize>(numbers: &mut [T], mut from: impl Iterator<Item = [T; W]>) {
    for block in B::slice_mut(numbers) {
        *block = B::zero();
        for lane in 0..LANES {
            let Some(numbers) = from.next() else { return };
            block.write_lane(lane, &numbers);
        }
    }
}
