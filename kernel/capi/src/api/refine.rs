//! Refinement of a model that is known roughly, and which number of an input is not finite.

use epipole::geometry::{Fundamental, Homography};
use epipole::nalgebra::{Vector2, Vector3};
use epipole::refine;

use super::Scalar;
use super::estimate::write_defaults;
use crate::Status;
use crate::estimates::{RefinedAbsolutePose, RefinedTwoView};
use crate::options::*;
use crate::raw::{Input, OutputStruct, disjoint, lend, read_options};
use crate::status::answer;
use crate::types::{Camera, Pose, from_rows};

type Pixel = Vector2<Scalar>;

/// Fills the options of `epi_refine_absolute_pose` with their defaults. `size`: `sizeof` of the struct.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("refine_absolute_pose_options_default"))]
pub unsafe extern "C" fn refine_absolute_pose_options_default(
    options: *mut RefineAbsolutePoseOptions<Scalar>,
    size: usize,
) -> i32 {
    // SAFETY: passed on.
    answer(|| unsafe { write_defaults(options, size) })
}

/// The pose, world to camera, of least robust reprojection error in the distorted image, from a start.
///
/// `pixels`: `count` times u v, at least 3, with a prior any number. `points`: `count` times x y z. `refined_size`:
/// `sizeof` of the struct. Answers 1.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("refine_absolute_pose"))]
pub unsafe extern "C" fn refine_absolute_pose(
    camera: *const Camera<Scalar>,
    pixels: *const Scalar,
    points: *const Scalar,
    count: usize,
    start: *const Pose<Scalar>,
    options: *const RefineAbsolutePoseOptions<Scalar>,
    refined: *mut RefinedAbsolutePose<Scalar>,
    refined_size: usize,
) -> i32 {
    answer(|| {
        // SAFETY: the caller's promise.
        let (camera, pixels, points, start, (options, options_bytes), mut refined) = unsafe {
            (
                Input::<Camera<Scalar>>::new(camera, 1)?,
                Input::<Pixel>::new(pixels, count)?,
                Input::<Vector3<Scalar>>::new(points, count)?,
                Input::<Pose<Scalar>>::new(start, 1)?,
                read_options(options, Defaults::defaults(size_of::<RefineAbsolutePoseOptions<Scalar>>()))?,
                OutputStruct::new(refined, refined_size)?,
            )
        };
        let inputs = [camera.bytes(), pixels.bytes(), points.bytes(), start.bytes(), options_bytes];
        disjoint(&inputs, &[refined.bytes()])?;
        let options = options.to_kernel()?;
        let (camera, start) = (camera.value()?.to_lens()?, start.value()?.to_kernel()?);
        let found = refine::absolute_pose(&camera, pixels.slice, points.slice, &start, &options)?;
        refined.write(&RefinedAbsolutePose::from(&found));
        Ok(1)
    })
}

/// Fills the options of `epi_refine_homography` and `epi_refine_fundamental` with their defaults. `size`: `sizeof` of the
/// struct.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("refine_two_view_options_default"))]
pub unsafe extern "C" fn refine_two_view_options_default(
    options: *mut RefineTwoViewOptions<Scalar>,
    size: usize,
) -> i32 {
    // SAFETY: passed on.
    answer(|| unsafe { write_defaults(options, size) })
}

/// What both refinements of a matrix share: their pointers checked, the result of the kernel written.
///
/// # Safety
/// See the crate.
unsafe fn refine_matrix<R: Into<RefinedTwoView<Scalar>>>(
    (x1, x2, count): (*const Scalar, *const Scalar, usize),
    start: *const Scalar,
    options: *const RefineTwoViewOptions<Scalar>,
    (refined, refined_size): (*mut RefinedTwoView<Scalar>, usize),
    refine: impl FnOnce(
        &[Pixel],
        &[Pixel],
        [[Scalar; 3]; 3],
        &refine::RefineTwoViewOptions<Scalar>,
    ) -> Result<Option<R>, epipole::InputError>,
) -> Result<usize, Status> {
    // SAFETY: passed on.
    let (x1, x2, start, (options, options_bytes), mut refined) = unsafe {
        (
            Input::<Pixel>::new(x1, count)?,
            Input::<Pixel>::new(x2, count)?,
            Input::<[[Scalar; 3]; 3]>::new(start, 1)?,
            read_options(options, Defaults::defaults(size_of::<RefineTwoViewOptions<Scalar>>()))?,
            OutputStruct::new(refined, refined_size)?,
        )
    };
    disjoint(&[x1.bytes(), x2.bytes(), start.bytes(), options_bytes], &[refined.bytes()])?;
    let found = refine(x1.slice, x2.slice, start.value()?, &options.to_kernel()?)?;
    Ok(found.map_or(0, |found| {
        refined.write(&found.into());
        1
    }))
}

/// The homography `x2 ~ H x1` of least robust error near a start.
///
/// `x1`, `x2`: `count >= 4` times u v. `start`: 3x3 by rows. `refined_size`: `sizeof` of the struct. Answers 1, or 0 where
/// the start is singular.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("refine_homography"))]
pub unsafe extern "C" fn refine_homography(
    x1: *const Scalar,
    x2: *const Scalar,
    count: usize,
    start: *const Scalar,
    options: *const RefineTwoViewOptions<Scalar>,
    refined: *mut RefinedTwoView<Scalar>,
    refined_size: usize,
) -> i32 {
    let refine = |x1: &[Pixel], x2: &[Pixel], start, options: &_| {
        refine::homography(x1, x2, &Homography(from_rows(start)), options)
    };
    // SAFETY: passed on.
    answer(|| unsafe { refine_matrix((x1, x2, count), start, options, (refined, refined_size), refine) })
}

/// The fundamental matrix `x2' F x1 = 0` of rank 2 and of least robust Sampson error near a start.
///
/// `x1`, `x2`: `count >= 7` times u v. `start`: 3x3 by rows. `refined_size`: `sizeof` of the struct. Answers 1, or 0 where
/// no matrix of rank 2 is nearest to the start.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("refine_fundamental"))]
pub unsafe extern "C" fn refine_fundamental(
    x1: *const Scalar,
    x2: *const Scalar,
    count: usize,
    start: *const Scalar,
    options: *const RefineTwoViewOptions<Scalar>,
    refined: *mut RefinedTwoView<Scalar>,
    refined_size: usize,
) -> i32 {
    let refine = |x1: &[Pixel], x2: &[Pixel], start, options: &_| {
        refine::fundamental(x1, x2, &Fundamental(from_rows(start)), options)
    };
    // SAFETY: passed on.
    answer(|| unsafe { refine_matrix((x1, x2, count), start, options, (refined, refined_size), refine) })
}

/// After `EPI_STATUS_NOT_FINITE`: which number of an array it is.
///
/// `numbers`: `count` of them. `index`: of the first that is NaN or infinite; divided by the numbers a point, that of the
/// point. Answers 1, or 0 where all are finite; then nothing is written.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("find_not_finite"))]
pub unsafe extern "C" fn find_not_finite(numbers: *const Scalar, count: usize, index: *mut u32) -> i32 {
    answer(|| {
        lend!(in { numbers: [Scalar; count] } out { index: [u32; 1] });
        let found = numbers.slice.iter().position(|&x| !epipole::real::is_finite(x));
        Ok(found.map_or(0, |found| index.write([u32::try_from(found).unwrap_or(u32::MAX)])))
    })
}
