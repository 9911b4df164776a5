//! From pixels and cameras to a verdict, robustly.

use core::ffi::c_void;

use epipole::estimate::{self, TwoViewWorkspace};
use epipole::geometry::CameraModel;
use epipole::nalgebra::Vector2;
use epipole::robust::Guide;

use super::Scalar;
use crate::enums::KeepGoing;
use crate::raw::{Input, Output, OutputStruct, disjoint, read_options};
use crate::status::answer;
use crate::types::{Camera, RelativePoseEstimate, RelativePoseOptions};
use crate::workspace::{self, Memory, TWO_VIEW_NUMBERS, TWO_VIEW_WIDE_NUMBERS};

/// Fills the options with their defaults. `size`: `sizeof` of the struct.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("relative_pose_options_default"))]
pub unsafe extern "C" fn relative_pose_options_default(
    options: *mut RelativePoseOptions<Scalar>,
    size: usize,
) -> i32 {
    answer(|| {
        // SAFETY: the caller's promise.
        let mut output = unsafe { OutputStruct::new(options, size)? };
        output.write(&RelativePoseOptions { size: size as u32, ..RelativePoseOptions::new() });
        Ok(0)
    })
}

/// Bytes of the workspace of `epi_relative_pose` for `count` correspondences; 0 where no memory is that large.
/// `wide`: not 0 if a camera is a fisheye.
#[unsafe(export_name = name!("relative_pose_workspace_size"))]
pub extern "C" fn relative_pose_workspace_size(count: usize, wide: u32) -> usize {
    workspace::size::<Scalar>(if wide == 0 { TWO_VIEW_NUMBERS } else { TWO_VIEW_WIDE_NUMBERS }, count)
}

/// The pose of view 2 in the frame of view 1 from pixel correspondences, many of which may be wrong, or why there is
/// none: `X2 = R X1 + t`, |t| = 1.
///
/// `x1`, `x2`: `count >= 5` times u v. `workspace`: of the size that `epi_relative_pose_workspace_size` tells.
/// `estimate_size`: `sizeof` of the struct. `inliers`: `count` times 1 or 0, the mask of the verdict's model.
/// Answers how many poses there are.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("relative_pose"))]
pub unsafe extern "C" fn relative_pose(
    camera1: *const Camera<Scalar>,
    camera2: *const Camera<Scalar>,
    x1: *const Scalar,
    x2: *const Scalar,
    count: usize,
    options: *const RelativePoseOptions<Scalar>,
    workspace: *mut c_void,
    workspace_size: usize,
    estimate: *mut RelativePoseEstimate<Scalar>,
    estimate_size: usize,
    inliers: *mut u8,
) -> i32 {
    let scores = core::ptr::null();
    let context = core::ptr::null_mut();
    // SAFETY: passed on.
    unsafe {
        relative_pose_guided(
            camera1,
            camera2,
            x1,
            x2,
            scores,
            count,
            options,
            None,
            context,
            workspace,
            workspace_size,
            estimate,
            estimate_size,
            inliers,
        )
    }
}

/// `epi_relative_pose` with match scores, or with a caller's "may I go on?".
///
/// `scores`: null, or `count` numbers, lower is better, by which samples are drawn best first. `keep_going`: null, or
/// asked before every eighth iteration.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("relative_pose_guided"))]
pub unsafe extern "C" fn relative_pose_guided(
    camera1: *const Camera<Scalar>,
    camera2: *const Camera<Scalar>,
    x1: *const Scalar,
    x2: *const Scalar,
    scores: *const Scalar,
    count: usize,
    options: *const RelativePoseOptions<Scalar>,
    keep_going: KeepGoing,
    context: *mut c_void,
    workspace: *mut c_void,
    workspace_size: usize,
    estimate: *mut RelativePoseEstimate<Scalar>,
    estimate_size: usize,
    inliers: *mut u8,
) -> i32 {
    answer(|| {
        // SAFETY: the caller's promise.
        let (camera1, camera2, x1, x2, scores) = unsafe {
            (
                Input::<Camera<Scalar>>::new(camera1, 1)?,
                Input::<Camera<Scalar>>::new(camera2, 1)?,
                Input::<Vector2<Scalar>>::new(x1, count)?,
                Input::<Vector2<Scalar>>::new(x2, count)?,
                Input::<Scalar>::nullable(scores, count)?,
            )
        };
        // SAFETY: the caller's promise.
        let ((options, options_bytes), memory, mut estimate, mut inliers) = unsafe {
            (
                read_options(options, RelativePoseOptions::new())?,
                Memory::new(workspace, workspace_size)?,
                OutputStruct::new(estimate, estimate_size)?,
                Output::<u8>::new(inliers, count)?,
            )
        };
        disjoint(
            &[
                camera1.bytes(),
                camera2.bytes(),
                x1.bytes(),
                x2.bytes(),
                scores.map_or(0..0, |scores| scores.bytes()),
                options_bytes,
            ],
            &[memory.bytes(), estimate.bytes(), inliers.bytes()],
        )?;
        let (camera1, camera2) = (camera1.value()?.to_kernel()?, camera2.value()?.to_kernel()?);
        let ordinary = camera1.rectilinear().is_some() && camera2.rectilinear().is_some();
        let width = if ordinary { TWO_VIEW_NUMBERS } else { TWO_VIEW_WIDE_NUMBERS };
        let slices = memory.cut::<Scalar>(width, count)?;
        let mut workspace = TwoViewWorkspace::from_slices(slices.numbers, slices.order, slices.inliers);
        let mut ask = asker(keep_going, context);
        let guide = Guide { scores: scores.map(|scores| scores.slice), keep_going: Some(&mut ask) };
        let found = estimate::relative_pose_guided(
            &camera1,
            &camera2,
            x1.slice,
            x2.slice,
            &options.to_kernel(),
            guide,
            &mut workspace,
        )?;
        let found = RelativePoseEstimate::from(&found);
        estimate.write(&found);
        inliers.write(workspace.inliers().iter().map(|&inlier| u8::from(inlier)));
        Ok(found.pose_count as usize)
    })
}

/// The caller's "may I go on?"; yes where there is none.
fn asker(keep_going: KeepGoing, context: *mut c_void) -> impl FnMut(&epipole::robust::Progress) -> bool {
    move |progress| match keep_going {
        // SAFETY: the caller's function, with the caller's context.
        Some(ask) => unsafe { ask(context, progress.iterations) != 0 },
        None => true,
    }
}
