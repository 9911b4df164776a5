//! Cameras: projection and its inverse.

use epipole::geometry::CameraModel;
use epipole::nalgebra::{Vector2, Vector3};

use super::Scalar;
use crate::raw::lend;
use crate::status::answer;
use crate::types::{Camera, rows};

/// The pixels of points of the camera frame.
///
/// `points`: `count` times x y z. `pixels`: `count` times u v, zeros where the camera does not see the point.
/// `visible`: `count` times 1 or 0. Answers how many are visible.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("camera_project"))]
pub unsafe extern "C" fn camera_project(
    camera: *const Camera<Scalar>,
    points: *const Scalar,
    count: usize,
    pixels: *mut Scalar,
    visible: *mut u8,
) -> i32 {
    answer(|| {
        lend!(in { camera: [Camera<Scalar>; 1], points: [Vector3<Scalar>; count] }
            out { pixels: [[Scalar; 2]; count], visible: [u8; count] });
        let camera = camera.value()?.to_kernel()?;
        let found = points.slice.iter().map(|point| camera.project(point).map(Into::into));
        Ok(pixels.write_masked(&mut visible, found, [0.0; 2]))
    })
}

/// The unit bearings of pixels.
///
/// `pixels`: `count` times u v. `bearings`: `count` times x y z, zeros where the lens has none.
/// `valid`: `count` times 1 or 0. Answers how many have a bearing.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("camera_unproject"))]
pub unsafe extern "C" fn camera_unproject(
    camera: *const Camera<Scalar>,
    pixels: *const Scalar,
    count: usize,
    bearings: *mut Scalar,
    valid: *mut u8,
) -> i32 {
    answer(|| {
        lend!(in { camera: [Camera<Scalar>; 1], pixels: [Vector2<Scalar>; count] }
            out { bearings: [[Scalar; 3]; count], valid: [u8; count] });
        let camera = camera.value()?.to_kernel()?;
        let found = pixels.slice.iter().map(|pixel| camera.unproject(pixel).ok().map(Into::into));
        Ok(bearings.write_masked(&mut valid, found, [0.0; 3]))
    })
}

/// The pixel of one point with its Jacobian by the point: 2x3 by rows. Answers 1, or 0 where the camera does not see it.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("camera_project_with_jacobian"))]
pub unsafe extern "C" fn camera_project_with_jacobian(
    camera: *const Camera<Scalar>,
    point: *const Scalar,
    pixel: *mut Scalar,
    jacobian: *mut Scalar,
) -> i32 {
    answer(|| {
        lend!(in { camera: [Camera<Scalar>; 1], point: [Vector3<Scalar>; 1] }
            out { pixel: [[Scalar; 2]; 1], jacobian: [[[Scalar; 3]; 2]; 1] });
        let found = camera.value()?.to_kernel()?.project_with_jacobian(&point.value()?);
        jacobian.write(found.map(|(_, j)| rows(&j)));
        Ok(pixel.write(found.map(|(pixel, _)| pixel.into())))
    })
}

/// The unit bearing of one pixel with its Jacobian by the pixel, rad/px: 3x2 by rows. Answers 1, or 0 where the lens has
/// none.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("camera_unproject_with_jacobian"))]
pub unsafe extern "C" fn camera_unproject_with_jacobian(
    camera: *const Camera<Scalar>,
    pixel: *const Scalar,
    bearing: *mut Scalar,
    jacobian: *mut Scalar,
) -> i32 {
    answer(|| {
        lend!(in { camera: [Camera<Scalar>; 1], pixel: [Vector2<Scalar>; 1] }
            out { bearing: [[Scalar; 3]; 1], jacobian: [[[Scalar; 2]; 3]; 1] });
        let found = camera.value()?.to_kernel()?.unproject_with_jacobian(&pixel.value()?).ok();
        jacobian.write(found.map(|(_, j)| rows(&j)));
        Ok(bearing.write(found.map(|(bearing, _)| bearing.into())))
    })
}
