//! From pixels and cameras to a verdict, robustly; and a relative pose refined with its covariance. Long because the
//! arguments of a C function are many.

use core::ffi::c_void;

use epipole::estimate::{self, AbsolutePoseWorkspace, TwoViewWorkspace};
use epipole::geometry::CameraModel;
use epipole::nalgebra::{Vector2, Vector3};
use epipole::robust;

use super::Scalar;
use crate::Status;
use crate::enums::KeepGoing;
use crate::estimates::*;
use crate::options::*;
use crate::raw::{Bytes, Input, Output, OutputStruct, disjoint, read_options};
use crate::status::answer;
use crate::types::{Camera, Pose};
use crate::workspace::*;

type Pixel = Vector2<Scalar>;

/// # Safety
/// As of [`OutputStruct::new`].
pub(super) unsafe fn write_defaults<O: Defaults>(options: *mut O, size: usize) -> Result<usize, Status> {
    // SAFETY: passed on.
    let mut output = unsafe { OutputStruct::new(options, size)? };
    output.write(&O::defaults(size));
    Ok(0)
}

/// The caller's "may I go on?"; yes where there is none.
fn asker(keep_going: KeepGoing, context: *mut c_void) -> impl FnMut(&robust::Progress) -> bool {
    move |progress| match keep_going {
        // SAFETY: the caller's function, with the caller's context.
        Some(ask) => unsafe { ask(context, progress.iterations) != 0 },
        None => true,
    }
}

/// What every robust estimation takes, its pointers checked.
struct Lent<'a, O, E> {
    scores: Option<Input<'a, Scalar>>,
    options: O,
    memory: Memory<'a>,
    estimate: OutputStruct<'a, E>,
    inliers: Output<'a, u8>,
}

impl<O: Defaults, E: crate::raw::Grows> Lent<'_, O, E> {
    /// # Safety
    /// The contract of the crate.
    unsafe fn new(
        inputs: [Bytes; 4],
        scores: *const Scalar,
        count: usize,
        options: *const O,
        (workspace, workspace_size): (*mut c_void, usize),
        (estimate, estimate_size): (*mut E, usize),
        inliers: *mut u8,
    ) -> Result<Self, Status> {
        // SAFETY: passed on.
        let (scores, (options, options_bytes), memory, estimate, inliers) = unsafe {
            (
                Input::<Scalar>::nullable(scores, count)?,
                read_options(options, O::defaults(size_of::<O>()))?,
                Memory::new(workspace, workspace_size)?,
                OutputStruct::new(estimate, estimate_size)?,
                Output::<u8>::new(inliers, count)?,
            )
        };
        let [a, b, c, d] = inputs;
        let scored = scores.map_or(0..0, |scores| scores.bytes());
        disjoint(&[a, b, c, d, scored, options_bytes], &[memory.bytes(), estimate.bytes(), inliers.bytes()])?;
        Ok(Self { scores, options, memory, estimate, inliers })
    }
}

/// Fills the options of `epi_relative_pose` with their defaults. `size`: `sizeof` of the struct.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("relative_pose_options_default"))]
pub unsafe extern "C" fn relative_pose_options_default(
    options: *mut RelativePoseOptions<Scalar>,
    size: usize,
) -> i32 {
    // SAFETY: passed on.
    answer(|| unsafe { write_defaults(options, size) })
}

/// Bytes of the workspace of `epi_relative_pose` for `count` correspondences; 0 where no memory is that large. `wide`: not 0
/// if a camera is a fisheye.
#[unsafe(export_name = name!("relative_pose_workspace_size"))]
pub extern "C" fn relative_pose_workspace_size(count: usize, wide: u32) -> usize {
    size::<Scalar>(if wide == 0 { TWO_VIEW_NUMBERS } else { TWO_VIEW_WIDE_NUMBERS }, count)
}

/// The pose of view 2 in the frame of view 1 from pixel correspondences, many of which may be wrong, or why there is
/// none: `X2 = R X1 + t`, |t| = 1.
///
/// `x1`, `x2`: `count >= 5` times u v.
/// `workspace`: of the size that `epi_relative_pose_workspace_size` tells. `estimate_size`: `sizeof` of the struct. `inliers`:
/// `count` times 1 or 0, the mask of the verdict's model. Answers how many poses there are.
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
    let (scores, context) = (core::ptr::null(), core::ptr::null_mut());
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
        let (camera1, camera2, x1, x2) = unsafe {
            (
                Input::<Camera<Scalar>>::new(camera1, 1)?,
                Input::<Camera<Scalar>>::new(camera2, 1)?,
                Input::<Pixel>::new(x1, count)?,
                Input::<Pixel>::new(x2, count)?,
            )
        };
        let inputs = [camera1.bytes(), camera2.bytes(), x1.bytes(), x2.bytes()];
        let (room, answer) = ((workspace, workspace_size), (estimate, estimate_size));
        // SAFETY: the caller's promise.
        let mut lent = unsafe { Lent::new(inputs, scores, count, options, room, answer, inliers)? };
        let options = lent.options.to_kernel()?;
        let (camera1, camera2) = (camera1.value()?.to_lens()?, camera2.value()?.to_lens()?);
        let ordinary = camera1.rectilinear().is_some() && camera2.rectilinear().is_some();
        let width = if ordinary { TWO_VIEW_NUMBERS } else { TWO_VIEW_WIDE_NUMBERS };
        let slices = lent.memory.cut::<Scalar>(width, count)?;
        let mut workspace = TwoViewWorkspace::from_slices(slices.numbers, slices.order, slices.inliers);
        let mut ask = asker(keep_going, context);
        let guide =
            robust::Guide { scores: lent.scores.map(|scores| scores.slice), keep_going: Some(&mut ask) };
        let found = estimate::relative_pose_guided(
            &camera1,
            &camera2,
            x1.slice,
            x2.slice,
            &options,
            guide,
            &mut workspace,
        )?;
        let found = RelativePoseEstimate::from(&found);
        lent.estimate.write(&found);
        lent.inliers.write(workspace.inliers().iter().map(|&inlier| u8::from(inlier)));
        Ok(found.pose_count as usize)
    })
}

/// Fills the options of `epi_homography` with their defaults. `size`: `sizeof` of the struct.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("homography_options_default"))]
pub unsafe extern "C" fn homography_options_default(
    options: *mut HomographyOptions<Scalar>,
    size: usize,
) -> i32 {
    // SAFETY: passed on.
    answer(|| unsafe { write_defaults(options, size) })
}

/// Bytes of the workspace of `epi_homography` for `count` correspondences; 0 where no memory is that large.
#[unsafe(export_name = name!("homography_workspace_size"))]
pub extern "C" fn homography_workspace_size(count: usize) -> usize {
    size::<Scalar>(TWO_VIEW_NUMBERS, count)
}

/// The homography `x2 ~ H x1` of pixel correspondences, many of which may be wrong, or why there is none.
///
/// `x1`, `x2`: `count >= 4` times u v.
/// `workspace`: of the size that `epi_homography_workspace_size` tells. `estimate_size`: `sizeof` of the struct. `inliers`:
/// `count` times 1 or 0, the mask of the verdict's model. Answers 1 where there is one, else 0.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("homography"))]
pub unsafe extern "C" fn homography(
    x1: *const Scalar,
    x2: *const Scalar,
    count: usize,
    options: *const HomographyOptions<Scalar>,
    workspace: *mut c_void,
    workspace_size: usize,
    estimate: *mut HomographyEstimate<Scalar>,
    estimate_size: usize,
    inliers: *mut u8,
) -> i32 {
    let (scores, context) = (core::ptr::null(), core::ptr::null_mut());
    // SAFETY: passed on.
    unsafe {
        homography_guided(
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

/// `epi_homography` with match scores, or with a caller's "may I go on?".
///
/// `scores`: null, or `count` numbers, lower is better, by which samples are drawn best first. `keep_going`: null, or
/// asked before every eighth iteration.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("homography_guided"))]
pub unsafe extern "C" fn homography_guided(
    x1: *const Scalar,
    x2: *const Scalar,
    scores: *const Scalar,
    count: usize,
    options: *const HomographyOptions<Scalar>,
    keep_going: KeepGoing,
    context: *mut c_void,
    workspace: *mut c_void,
    workspace_size: usize,
    estimate: *mut HomographyEstimate<Scalar>,
    estimate_size: usize,
    inliers: *mut u8,
) -> i32 {
    answer(|| {
        // SAFETY: the caller's promise.
        let (x1, x2) = unsafe { (Input::<Pixel>::new(x1, count)?, Input::<Pixel>::new(x2, count)?) };
        let inputs = [0..0, 0..0, x1.bytes(), x2.bytes()];
        let (room, answer) = ((workspace, workspace_size), (estimate, estimate_size));
        // SAFETY: the caller's promise.
        let mut lent = unsafe { Lent::new(inputs, scores, count, options, room, answer, inliers)? };
        let options = lent.options.to_kernel()?;
        let width = TWO_VIEW_NUMBERS;
        let slices = lent.memory.cut::<Scalar>(width, count)?;
        let mut workspace = TwoViewWorkspace::from_slices(slices.numbers, slices.order, slices.inliers);
        let mut ask = asker(keep_going, context);
        let guide =
            robust::Guide { scores: lent.scores.map(|scores| scores.slice), keep_going: Some(&mut ask) };
        let found = estimate::homography_guided(x1.slice, x2.slice, &options, guide, &mut workspace)?;
        let found = HomographyEstimate::from(&found);
        lent.estimate.write(&found);
        lent.inliers.write(workspace.inliers().iter().map(|&inlier| u8::from(inlier)));
        Ok(usize::from(found.verdict == 0))
    })
}

/// Fills the options of `epi_fundamental` with their defaults. `size`: `sizeof` of the struct.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("fundamental_options_default"))]
pub unsafe extern "C" fn fundamental_options_default(
    options: *mut FundamentalOptions<Scalar>,
    size: usize,
) -> i32 {
    // SAFETY: passed on.
    answer(|| unsafe { write_defaults(options, size) })
}

/// Bytes of the workspace of `epi_fundamental` for `count` correspondences; 0 where no memory is that large.
#[unsafe(export_name = name!("fundamental_workspace_size"))]
pub extern "C" fn fundamental_workspace_size(count: usize) -> usize {
    size::<Scalar>(TWO_VIEW_NUMBERS, count)
}

/// The fundamental matrix `x2' F x1 = 0` of pixel correspondences, many of which may be wrong, or why there is none.
///
/// `x1`, `x2`: `count >= 7` times u v.
/// `workspace`: of the size that `epi_fundamental_workspace_size` tells. `estimate_size`: `sizeof` of the struct. `inliers`:
/// `count` times 1 or 0, the mask of the verdict's model. Answers 1 where there is one, else 0.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("fundamental"))]
pub unsafe extern "C" fn fundamental(
    x1: *const Scalar,
    x2: *const Scalar,
    count: usize,
    options: *const FundamentalOptions<Scalar>,
    workspace: *mut c_void,
    workspace_size: usize,
    estimate: *mut FundamentalEstimate<Scalar>,
    estimate_size: usize,
    inliers: *mut u8,
) -> i32 {
    let (scores, context) = (core::ptr::null(), core::ptr::null_mut());
    // SAFETY: passed on.
    unsafe {
        fundamental_guided(
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

/// `epi_fundamental` with match scores, or with a caller's "may I go on?".
///
/// `scores`: null, or `count` numbers, lower is better, by which samples are drawn best first. `keep_going`: null, or
/// asked before every eighth iteration.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("fundamental_guided"))]
pub unsafe extern "C" fn fundamental_guided(
    x1: *const Scalar,
    x2: *const Scalar,
    scores: *const Scalar,
    count: usize,
    options: *const FundamentalOptions<Scalar>,
    keep_going: KeepGoing,
    context: *mut c_void,
    workspace: *mut c_void,
    workspace_size: usize,
    estimate: *mut FundamentalEstimate<Scalar>,
    estimate_size: usize,
    inliers: *mut u8,
) -> i32 {
    answer(|| {
        // SAFETY: the caller's promise.
        let (x1, x2) = unsafe { (Input::<Pixel>::new(x1, count)?, Input::<Pixel>::new(x2, count)?) };
        let inputs = [0..0, 0..0, x1.bytes(), x2.bytes()];
        let (room, answer) = ((workspace, workspace_size), (estimate, estimate_size));
        // SAFETY: the caller's promise.
        let mut lent = unsafe { Lent::new(inputs, scores, count, options, room, answer, inliers)? };
        let options = lent.options.to_kernel()?;
        let width = TWO_VIEW_NUMBERS;
        let slices = lent.memory.cut::<Scalar>(width, count)?;
        let mut workspace = TwoViewWorkspace::from_slices(slices.numbers, slices.order, slices.inliers);
        let mut ask = asker(keep_going, context);
        let guide =
            robust::Guide { scores: lent.scores.map(|scores| scores.slice), keep_going: Some(&mut ask) };
        let found = estimate::fundamental_guided(x1.slice, x2.slice, &options, guide, &mut workspace)?;
        let found = FundamentalEstimate::from(&found);
        lent.estimate.write(&found);
        lent.inliers.write(workspace.inliers().iter().map(|&inlier| u8::from(inlier)));
        Ok(usize::from(found.verdict == 0))
    })
}

/// Fills the options of `epi_absolute_pose` with their defaults. `size`: `sizeof` of the struct.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("absolute_pose_options_default"))]
pub unsafe extern "C" fn absolute_pose_options_default(
    options: *mut AbsolutePoseOptions<Scalar>,
    size: usize,
) -> i32 {
    // SAFETY: passed on.
    answer(|| unsafe { write_defaults(options, size) })
}

/// Bytes of the workspace of `epi_absolute_pose` for `count` correspondences; 0 where no memory is that large. `wide`: not 0
/// if a camera is a fisheye.
#[unsafe(export_name = name!("absolute_pose_workspace_size"))]
pub extern "C" fn absolute_pose_workspace_size(count: usize, wide: u32) -> usize {
    size::<Scalar>(if wide == 0 { ABSOLUTE_POSE_NUMBERS } else { ABSOLUTE_POSE_WIDE_NUMBERS }, count)
}

/// The pose of a camera, world to camera, from pixels of known points, many of which may be wrong, or why there is
/// none: `x ~ project(R X + t)`.
///
/// `pixels`: `count >= 4` times u v. `points`: `count` times x y z.
/// `workspace`: of the size that `epi_absolute_pose_workspace_size` tells. `estimate_size`: `sizeof` of the struct. `inliers`:
/// `count` times 1 or 0, the mask of the verdict's model. Answers how many poses there are.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("absolute_pose"))]
pub unsafe extern "C" fn absolute_pose(
    camera: *const Camera<Scalar>,
    pixels: *const Scalar,
    points: *const Scalar,
    count: usize,
    options: *const AbsolutePoseOptions<Scalar>,
    workspace: *mut c_void,
    workspace_size: usize,
    estimate: *mut AbsolutePoseEstimate<Scalar>,
    estimate_size: usize,
    inliers: *mut u8,
) -> i32 {
    let (scores, context) = (core::ptr::null(), core::ptr::null_mut());
    // SAFETY: passed on.
    unsafe {
        absolute_pose_guided(
            camera,
            pixels,
            points,
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

/// `epi_absolute_pose` with match scores, or with a caller's "may I go on?".
///
/// `scores`: null, or `count` numbers, lower is better, by which samples are drawn best first. `keep_going`: null, or
/// asked before every eighth iteration.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("absolute_pose_guided"))]
pub unsafe extern "C" fn absolute_pose_guided(
    camera: *const Camera<Scalar>,
    pixels: *const Scalar,
    points: *const Scalar,
    scores: *const Scalar,
    count: usize,
    options: *const AbsolutePoseOptions<Scalar>,
    keep_going: KeepGoing,
    context: *mut c_void,
    workspace: *mut c_void,
    workspace_size: usize,
    estimate: *mut AbsolutePoseEstimate<Scalar>,
    estimate_size: usize,
    inliers: *mut u8,
) -> i32 {
    answer(|| {
        // SAFETY: the caller's promise.
        let (camera, pixels, points) = unsafe {
            (
                Input::<Camera<Scalar>>::new(camera, 1)?,
                Input::<Pixel>::new(pixels, count)?,
                Input::<Vector3<Scalar>>::new(points, count)?,
            )
        };
        let inputs = [camera.bytes(), 0..0, pixels.bytes(), points.bytes()];
        let (room, answer) = ((workspace, workspace_size), (estimate, estimate_size));
        // SAFETY: the caller's promise.
        let mut lent = unsafe { Lent::new(inputs, scores, count, options, room, answer, inliers)? };
        let options = lent.options.to_kernel()?;
        let camera = camera.value()?.to_lens()?;
        let ordinary = camera.rectilinear().is_some();
        let width = if ordinary { ABSOLUTE_POSE_NUMBERS } else { ABSOLUTE_POSE_WIDE_NUMBERS };
        let slices = lent.memory.cut::<Scalar>(width, count)?;
        let mut workspace = AbsolutePoseWorkspace::from_slices(slices.numbers, slices.order, slices.inliers);
        let mut ask = asker(keep_going, context);
        let guide =
            robust::Guide { scores: lent.scores.map(|scores| scores.slice), keep_going: Some(&mut ask) };
        let found = estimate::absolute_pose_guided(
            &camera,
            pixels.slice,
            points.slice,
            &options,
            guide,
            &mut workspace,
        )?;
        let found = AbsolutePoseEstimate::from(&found);
        lent.estimate.write(&found);
        lent.inliers.write(workspace.inliers().iter().map(|&inlier| u8::from(inlier)));
        Ok(found.pose_count as usize)
    })
}

/// A relative pose refined on all correspondences that agree with it, and its covariance.
///
/// `x1`, `x2`: `count >= 5` times u v. `start`: of view 2 in the frame of view 1. `workspace`: of the size that
/// `epi_relative_pose_workspace_size` tells. `refined_size`: `sizeof` of the struct. `inliers`: `count` times 1 or 0.
/// Answers 1, or 0 where fewer than six agree or leave a direction open; then nothing is written but the mask.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("refine_relative_pose"))]
pub unsafe extern "C" fn refine_relative_pose(
    camera1: *const Camera<Scalar>,
    camera2: *const Camera<Scalar>,
    x1: *const Scalar,
    x2: *const Scalar,
    count: usize,
    start: *const Pose<Scalar>,
    options: *const RelativePoseOptions<Scalar>,
    workspace: *mut c_void,
    workspace_size: usize,
    refined: *mut RefinedRelativePose<Scalar>,
    refined_size: usize,
    inliers: *mut u8,
) -> i32 {
    answer(|| {
        // SAFETY: the caller's promise.
        let (camera1, camera2, x1, x2, start) = unsafe {
            (
                Input::<Camera<Scalar>>::new(camera1, 1)?,
                Input::<Camera<Scalar>>::new(camera2, 1)?,
                Input::<Pixel>::new(x1, count)?,
                Input::<Pixel>::new(x2, count)?,
                Input::<Pose<Scalar>>::new(start, 1)?,
            )
        };
        let inputs = [camera1.bytes(), camera2.bytes(), x1.bytes(), x2.bytes()];
        let (room, answer) = ((workspace, workspace_size), (refined, refined_size));
        // SAFETY: the caller's promise.
        let mut lent =
            unsafe { Lent::new(inputs, core::ptr::null(), count, options, room, answer, inliers)? };
        disjoint(&[start.bytes()], &[lent.memory.bytes(), lent.estimate.bytes(), lent.inliers.bytes()])?;
        let options = lent.options.to_kernel()?;
        let start = start.value()?.to_kernel()?;
        let (camera1, camera2) = (camera1.value()?.to_lens()?, camera2.value()?.to_lens()?);
        let ordinary = camera1.rectilinear().is_some() && camera2.rectilinear().is_some();
        let width = if ordinary { TWO_VIEW_NUMBERS } else { TWO_VIEW_WIDE_NUMBERS };
        let slices = lent.memory.cut::<Scalar>(width, count)?;
        let mut workspace = TwoViewWorkspace::from_slices(slices.numbers, slices.order, slices.inliers);
        let found = estimate::refine_relative_pose(
            &camera1,
            &camera2,
            x1.slice,
            x2.slice,
            &start,
            &options,
            &mut workspace,
        )?;
        if let Some(found) = &found {
            lent.estimate.write(&found.into());
        }
        lent.inliers.write(workspace.inliers().iter().map(|&inlier| u8::from(inlier)));
        Ok(usize::from(found.is_some()))
    })
}
