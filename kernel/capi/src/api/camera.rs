//! Cameras: projection and its inverse.

use epipole::geometry::CameraModel;
use epipole::nalgebra::{Vector2, Vector3};

use super::Scalar;
use crate::raw::{Input, Output, disjoint};
use crate::status::answer;
use crate::types::Camera;

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
        // SAFETY: the caller's promise.
        let (camera, points, mut pixels, mut visible) = unsafe {
            (
                Input::<Camera<Scalar>>::new(camera, 1)?,
                Input::<Vector3<Scalar>>::new(points, count)?,
                Output::<[Scalar; 2]>::new(pixels, count)?,
                Output::<u8>::new(visible, count)?,
            )
        };
        disjoint(&[camera.bytes(), points.bytes()], &[pixels.bytes(), visible.bytes()])?;
        let camera = camera.value()?.to_kernel()?;
        let mut seen = 0;
        pixels.write(points.slice.iter().map(|point| {
            let pixel = camera.project(point);
            visible.push(u8::from(pixel.is_some()));
            seen += usize::from(pixel.is_some());
            pixel.map_or([0.0; 2], Into::into)
        }));
        Ok(seen)
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
        // SAFETY: the caller's promise.
        let (camera, pixels, mut bearings, mut valid) = unsafe {
            (
                Input::<Camera<Scalar>>::new(camera, 1)?,
                Input::<Vector2<Scalar>>::new(pixels, count)?,
                Output::<[Scalar; 3]>::new(bearings, count)?,
                Output::<u8>::new(valid, count)?,
            )
        };
        disjoint(&[camera.bytes(), pixels.bytes()], &[bearings.bytes(), valid.bytes()])?;
        let camera = camera.value()?.to_kernel()?;
        let mut found = 0;
        bearings.write(pixels.slice.iter().map(|pixel| {
            let bearing = camera.unproject(pixel).ok();
            valid.push(u8::from(bearing.is_some()));
            found += usize::from(bearing.is_some());
            bearing.map_or([0.0; 3], Into::into)
        }));
        Ok(found)
    })
}
