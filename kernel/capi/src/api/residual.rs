//! Residuals of models: of correspondences, `count` of them, each with 1 or 0 in `valid` for a residual that exists. Where
//! none does, zeros. Functions answer how many exist.

use epipole::geometry::residual;
use epipole::nalgebra::Vector2;

use super::Scalar;
use crate::raw::lend;
use crate::status::answer;
use crate::types::{Camera, Pose, from_rows, rows};

type Matrix = [[Scalar; 3]; 3];
type Pixel = Vector2<Scalar>;

/// Sampson errors, signed: `x2' M x1` over the length of its gradient, in the unit of the points.
///
/// `matrix`: E of normalised points or F of pixels, by rows. `x1`, `x2`: `count` times x y. `errors`, `valid`: `count`.
/// Answers how many exist.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("sampson"))]
pub unsafe extern "C" fn sampson(
    matrix: *const Scalar,
    x1: *const Scalar,
    x2: *const Scalar,
    count: usize,
    errors: *mut Scalar,
    valid: *mut u8,
) -> i32 {
    answer(|| {
        lend!(in { matrix: [Matrix; 1], x1: [Pixel; count], x2: [Pixel; count] }
            out { errors: [Scalar; count], valid: [u8; count] });
        let m = from_rows(matrix.value()?);
        let pairs = x1.slice.iter().zip(x2.slice);
        Ok(errors.write_masked(&mut valid, pairs.map(|(x1, x2)| residual::sampson(&m, x1, x2)), 0.0))
    })
}

/// Sums of the squared distances of both points from their epipolar lines.
///
/// `matrix`: E of normalised points or F of pixels, by rows. `x1`, `x2`: `count` times x y. `errors_sq`, `valid`: `count`.
/// Answers how many exist.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("symmetric_epipolar_sq"))]
pub unsafe extern "C" fn symmetric_epipolar_sq(
    matrix: *const Scalar,
    x1: *const Scalar,
    x2: *const Scalar,
    count: usize,
    errors_sq: *mut Scalar,
    valid: *mut u8,
) -> i32 {
    answer(|| {
        lend!(in { matrix: [Matrix; 1], x1: [Pixel; count], x2: [Pixel; count] }
            out { errors_sq: [Scalar; count], valid: [u8; count] });
        let m = from_rows(matrix.value()?);
        let pairs = x1.slice.iter().zip(x2.slice);
        let errors = pairs.map(|(x1, x2)| residual::symmetric_epipolar_sq(&m, x1, x2));
        Ok(errors_sq.write_masked(&mut valid, errors, 0.0))
    })
}

/// Transfer errors of a homography, `H x1 - x2`.
///
/// `homography`: by rows. `x1`, `x2`: `count` times u v. `errors`: `count` times u v. `valid`: `count`. Answers how many
/// exist.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("transfer"))]
pub unsafe extern "C" fn transfer(
    homography: *const Scalar,
    x1: *const Scalar,
    x2: *const Scalar,
    count: usize,
    errors: *mut Scalar,
    valid: *mut u8,
) -> i32 {
    answer(|| {
        lend!(in { homography: [Matrix; 1], x1: [Pixel; count], x2: [Pixel; count] }
            out { errors: [[Scalar; 2]; count], valid: [u8; count] });
        let h = from_rows(homography.value()?);
        let pairs = x1.slice.iter().zip(x2.slice);
        let found = pairs.map(|(x1, x2)| residual::transfer(&h, x1, x2).map(Into::into));
        Ok(errors.write_masked(&mut valid, found, [0.0; 2]))
    })
}

/// Sums of the squared transfer errors of both directions.
///
/// `homography`, `inverse` (see `epi_homography_inverse`): by rows. `x1`, `x2`: `count` times u v. `errors_sq`, `valid`:
/// `count`. Answers how many exist.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("symmetric_transfer_sq"))]
pub unsafe extern "C" fn symmetric_transfer_sq(
    homography: *const Scalar,
    inverse: *const Scalar,
    x1: *const Scalar,
    x2: *const Scalar,
    count: usize,
    errors_sq: *mut Scalar,
    valid: *mut u8,
) -> i32 {
    answer(|| {
        lend!(in { homography: [Matrix; 1], inverse: [Matrix; 1], x1: [Pixel; count], x2: [Pixel; count] }
            out { errors_sq: [Scalar; count], valid: [u8; count] });
        let (h, inverse) = (from_rows(homography.value()?), from_rows(inverse.value()?));
        let pairs = x1.slice.iter().zip(x2.slice);
        let errors = pairs.map(|(x1, x2)| residual::symmetric_transfer_sq(&h, &inverse, x1, x2));
        Ok(errors_sq.write_masked(&mut valid, errors, 0.0))
    })
}

/// Reprojection errors, projected minus measured, px.
///
/// `pose`: world to camera. `points`: `count` times x y z. `pixels`: `count` times u v. `errors`: `count` times u v.
/// `valid`: `count`. Answers how many exist.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("reprojection"))]
pub unsafe extern "C" fn reprojection(
    camera: *const Camera<Scalar>,
    pose: *const Pose<Scalar>,
    points: *const Scalar,
    pixels: *const Scalar,
    count: usize,
    errors: *mut Scalar,
    valid: *mut u8,
) -> i32 {
    answer(|| {
        lend!(in { camera: [Camera<Scalar>; 1], pose: [Pose<Scalar>; 1],
                points: [epipole::nalgebra::Vector3<Scalar>; count], pixels: [Pixel; count] }
            out { errors: [[Scalar; 2]; count], valid: [u8; count] });
        let (camera, pose) = (camera.value()?.to_kernel()?, pose.value()?.to_kernel()?);
        let pairs = points.slice.iter().zip(pixels.slice);
        let found = pairs.map(|(x, pixel)| residual::reprojection(&camera, &pose, x, pixel).map(Into::into));
        Ok(errors.write_masked(&mut valid, found, [0.0; 2]))
    })
}

/// `epi_reprojection` of one point with its Jacobians.
///
/// `error`: u v. `by_pose`: 2x6 by rows, by the w and dt of `R <- Exp(w) R`, `t <- t + dt`. `by_point`: 2x3 by rows.
/// Answers 1, or 0 where the camera does not see the point.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("reprojection_with_jacobians"))]
pub unsafe extern "C" fn reprojection_with_jacobians(
    camera: *const Camera<Scalar>,
    pose: *const Pose<Scalar>,
    point: *const Scalar,
    pixel: *const Scalar,
    error: *mut Scalar,
    by_pose: *mut Scalar,
    by_point: *mut Scalar,
) -> i32 {
    answer(|| {
        lend!(in { camera: [Camera<Scalar>; 1], pose: [Pose<Scalar>; 1],
                point: [epipole::nalgebra::Vector3<Scalar>; 1], pixel: [Pixel; 1] }
            out { error: [[Scalar; 2]; 1], by_pose: [[[Scalar; 6]; 2]; 1], by_point: [[[Scalar; 3]; 2]; 1] });
        let (camera, pose) = (camera.value()?.to_kernel()?, pose.value()?.to_kernel()?);
        let found = residual::reprojection_with_jacobians(&camera, &pose, &point.value()?, &pixel.value()?);
        by_pose.write(found.map(|found| rows(&found.by_pose)));
        by_point.write(found.map(|found| rows(&found.by_point)));
        Ok(error.write(found.map(|found| found.residual.into())))
    })
}
