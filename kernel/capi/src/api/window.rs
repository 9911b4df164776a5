//! Bundle adjustment of a sliding window. Frames and points are named by numbers, which are valid until the frame or point
//! is removed; a window is used by one call at a time.

use core::ffi::c_void;

use epipole::bundle::{FrameHandle, PointHandle, PosePrior};
use epipole::nalgebra::{Vector2, Vector3};

use super::Scalar;
use crate::Status;
use crate::enums::KeepGoing;
use crate::options::{Defaults, flag, loss as loss_of};
use crate::raw::{Grows, Output, OutputStruct, disjoint, lend, read_options};
use crate::status::answer;
use crate::types::{Camera, Pose, from_rows, rotation, rows};
use crate::window::{
    self, BundleOptions, BundleReport, Capacities, FrameCovariance, Lent, PointReport, Window,
};

type Vector = Vector3<Scalar>;

/// Bytes of the memory of a window for so many frames, points and observations; 0 where no memory is that large.
/// `prior`: not 0 for a window that marginalises.
#[unsafe(export_name = name!("window_size"))]
pub extern "C" fn window_size(frames: usize, points: usize, observations: usize, prior: u32) -> usize {
    Capacities { frames, points, observations, prior: prior != 0 }.size::<Scalar>()
}

/// An empty window in `size` bytes of memory, aligned to `EPI_WORKSPACE_ALIGN`; see `epi_window_size`. It is a part of the
/// memory: nothing is to be freed.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_create"))]
pub unsafe extern "C" fn window_create(
    memory: *mut c_void,
    size: usize,
    frames: usize,
    points: usize,
    observations: usize,
    prior: u32,
    window: *mut *mut Window<Scalar>,
) -> i32 {
    answer(|| {
        // SAFETY: the caller's promise.
        let (memory, mut created) =
            unsafe { (window::lend(memory, size)?, Output::<*mut Window<Scalar>>::new(window, 1)?) };
        disjoint(&[], &[memory.bytes(), created.bytes()])?;
        let capacities = Capacities { frames, points, observations, prior: flag(prior)? };
        created.push(window::create::<Scalar>(memory, &capacities)?);
        Ok(0)
    })
}

/// Fills the options of `epi_window_optimise` with their defaults. `size`: `sizeof` of the struct.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("bundle_options_default"))]
pub unsafe extern "C" fn bundle_options_default(options: *mut BundleOptions<Scalar>, size: usize) -> i32 {
    answer(|| {
        // SAFETY: the caller's promise.
        let mut output = unsafe { OutputStruct::new(options, size)? };
        output.write(&BundleOptions::defaults(size));
        Ok(0)
    })
}

/// The window and the arguments of a function, checked, under the names of the arguments.
macro_rules! lend_window {
    ($window:ident in { $($inputs:tt)* } out { $($output:ident: [$write:ty; $capacity:expr]),* $(,)? }) => {
        // SAFETY: the caller's promise.
        let $window = unsafe { Lent::<Scalar>::new($window)? };
        lend!(in { $($inputs)* } out { $($output: [$write; $capacity]),* });
        lend_window!(@apart $window; $($inputs)*; $($output)*);
        #[allow(unused_mut)]
        let mut $window = $window.open()?;
    };
    (@apart $window:ident; $($input:ident: [$read:ty; $count:expr]),*; $($output:ident)*) => {
        disjoint(&[$($input.bytes(),)* $($output.bytes(),)*], &[$window.bytes()])?;
    };
}

/// Removes everything. Frames and points that were named are no longer.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_clear"))]
pub unsafe extern "C" fn window_clear(window: *mut Window<Scalar>) -> i32 {
    answer(|| {
        lend_window!(window in {  } out {  });
        window.clear();
        Ok(0)
    })
}

/// Answers the number of frames in the window.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_frame_count"))]
pub unsafe extern "C" fn window_frame_count(window: *mut Window<Scalar>) -> i32 {
    answer(|| {
        lend_window!(window in {  } out {  });
        Ok(window.frame_count())
    })
}

/// Answers the number of points in the window.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_point_count"))]
pub unsafe extern "C" fn window_point_count(window: *mut Window<Scalar>) -> i32 {
    answer(|| {
        lend_window!(window in {  } out {  });
        Ok(window.point_count())
    })
}

/// Answers the number of observations in the window.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_observation_count"))]
pub unsafe extern "C" fn window_observation_count(window: *mut Window<Scalar>) -> i32 {
    answer(|| {
        lend_window!(window in {  } out {  });
        Ok(window.observation_count())
    })
}

/// Answers the number of frames in the marginalisation prior.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_prior_frame_count"))]
pub unsafe extern "C" fn window_prior_frame_count(window: *mut Window<Scalar>) -> i32 {
    answer(|| {
        lend_window!(window in {  } out {  });
        Ok(window.prior_frame_count())
    })
}

/// Adds a frame with its camera and its pose, world to camera. `frame`: its name.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_add_frame"))]
pub unsafe extern "C" fn window_add_frame(
    window: *mut Window<Scalar>,
    camera: *const Camera<Scalar>,
    pose: *const Pose<Scalar>,
    frame: *mut u32,
) -> i32 {
    answer(|| {
        lend_window!(window in { camera: [Camera<Scalar>; 1], pose: [Pose<Scalar>; 1] } out { frame: [u32; 1] });
        let (camera, pose) = (camera.value()?.to_kernel()?, pose.value()?.to_kernel()?);
        frame.push(window.add_frame(camera, &pose)?.to_bits());
        Ok(0)
    })
}

/// Removes a frame with its observations, its prior and its distances.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_remove_frame"))]
pub unsafe extern "C" fn window_remove_frame(window: *mut Window<Scalar>, frame: u32) -> i32 {
    answer(|| {
        lend_window!(window in {  } out {  });
        window.remove_frame(FrameHandle::from_bits(frame))?;
        Ok(0)
    })
}

/// Holds a frame where it is (`fixed` 1), or lets it go (0).
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_fix_frame"))]
pub unsafe extern "C" fn window_fix_frame(window: *mut Window<Scalar>, frame: u32, fixed: u32) -> i32 {
    answer(|| {
        lend_window!(window in {  } out {  });
        window.fix_frame(FrameHandle::from_bits(frame), flag(fixed)?)?;
        Ok(0)
    })
}

/// The pose of a frame, world to camera.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_pose"))]
pub unsafe extern "C" fn window_pose(
    window: *mut Window<Scalar>,
    frame: u32,
    pose: *mut Pose<Scalar>,
) -> i32 {
    answer(|| {
        lend_window!(window in {  } out { pose: [Pose<Scalar>; 1] });
        pose.push(window.pose(FrameHandle::from_bits(frame))?.into());
        Ok(0)
    })
}

/// Puts a frame at a pose.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_set_pose"))]
pub unsafe extern "C" fn window_set_pose(
    window: *mut Window<Scalar>,
    frame: u32,
    pose: *const Pose<Scalar>,
) -> i32 {
    answer(|| {
        lend_window!(window in { pose: [Pose<Scalar>; 1] } out {  });
        window.set_pose(FrameHandle::from_bits(frame), &pose.value()?.to_kernel()?)?;
        Ok(0)
    })
}

/// Adds a point of the world, x y z. `point`: its name.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_add_point"))]
pub unsafe extern "C" fn window_add_point(
    window: *mut Window<Scalar>,
    position: *const Scalar,
    point: *mut u32,
) -> i32 {
    answer(|| {
        lend_window!(window in { position: [Vector; 1] } out { point: [u32; 1] });
        point.push(window.add_point(&position.value()?)?.to_bits());
        Ok(0)
    })
}

/// Removes a point with its observations.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_remove_point"))]
pub unsafe extern "C" fn window_remove_point(window: *mut Window<Scalar>, point: u32) -> i32 {
    answer(|| {
        lend_window!(window in {  } out {  });
        window.remove_point(PointHandle::from_bits(point))?;
        Ok(0)
    })
}

/// Holds a point where it is (`fixed` 1), or lets it go (0).
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_fix_point"))]
pub unsafe extern "C" fn window_fix_point(window: *mut Window<Scalar>, point: u32, fixed: u32) -> i32 {
    answer(|| {
        lend_window!(window in {  } out {  });
        window.fix_point(PointHandle::from_bits(point), flag(fixed)?)?;
        Ok(0)
    })
}

/// The position of a point in the world, x y z.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_position"))]
pub unsafe extern "C" fn window_position(
    window: *mut Window<Scalar>,
    point: u32,
    position: *mut Scalar,
) -> i32 {
    answer(|| {
        lend_window!(window in {  } out { position: [[Scalar; 3]; 1] });
        position.push(window.position(PointHandle::from_bits(point))?.into());
        Ok(0)
    })
}

/// Puts a point at a position, x y z.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_set_position"))]
pub unsafe extern "C" fn window_set_position(
    window: *mut Window<Scalar>,
    point: u32,
    position: *const Scalar,
) -> i32 {
    answer(|| {
        lend_window!(window in { position: [Vector; 1] } out {  });
        window.set_position(PointHandle::from_bits(point), &position.value()?)?;
        Ok(0)
    })
}

/// Adds the observation of a point by a frame at a pixel u v, each coordinate with the standard deviation `sigma_px`. A frame
/// observes a point once at the most.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_add_observation"))]
pub unsafe extern "C" fn window_add_observation(
    window: *mut Window<Scalar>,
    frame: u32,
    point: u32,
    pixel: *const Scalar,
    sigma_px: Scalar,
) -> i32 {
    answer(|| {
        lend_window!(window in { pixel: [Vector2<Scalar>; 1] } out {  });
        let (frame, point) = (FrameHandle::from_bits(frame), PointHandle::from_bits(point));
        window.add_observation(frame, point, &pixel.value()?, sigma_px)?;
        Ok(0)
    })
}

/// Removes one observation; frame and point stay.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_remove_observation"))]
pub unsafe extern "C" fn window_remove_observation(
    window: *mut Window<Scalar>,
    frame: u32,
    point: u32,
) -> i32 {
    answer(|| {
        lend_window!(window in {  } out {  });
        window.remove_observation(FrameHandle::from_bits(frame), PointHandle::from_bits(point))?;
        Ok(0)
    })
}

/// The names of the frames. `frames`: `capacity`, no fewer than `epi_window_frame_count`. Answers how many.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_frames"))]
pub unsafe extern "C" fn window_frames(
    window: *mut Window<Scalar>,
    frames: *mut u32,
    capacity: usize,
) -> i32 {
    answer(|| {
        lend_window!(window in {  } out { frames: [u32; capacity] });
        frames.holding(window.frame_count())?;
        Ok(frames.write(window.frame_handles().map(FrameHandle::to_bits)))
    })
}

/// The names of the points. `points`: `capacity`, no fewer than `epi_window_point_count`. Answers how many.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_points"))]
pub unsafe extern "C" fn window_points(
    window: *mut Window<Scalar>,
    points: *mut u32,
    capacity: usize,
) -> i32 {
    answer(|| {
        lend_window!(window in {  } out { points: [u32; capacity] });
        points.holding(window.point_count())?;
        Ok(points.write(window.point_handles().map(PointHandle::to_bits)))
    })
}

/// The observations of a point: frames, and pixels u v. `frames`, `pixels`: `capacity`, no fewer than the observations.
/// Answers how many.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_observations_of"))]
pub unsafe extern "C" fn window_observations_of(
    window: *mut Window<Scalar>,
    point: u32,
    frames: *mut u32,
    pixels: *mut Scalar,
    capacity: usize,
) -> i32 {
    answer(|| {
        lend_window!(window in {  } out { frames: [u32; capacity], pixels: [[Scalar; 2]; capacity] });
        let point = PointHandle::from_bits(point);
        frames.holding(window.observations_of(point)?.count())?;
        pixels.write(window.observations_of(point)?.map(|(_, pixel)| pixel.into()));
        Ok(frames.write(window.observations_of(point)?.map(|(frame, _)| frame.to_bits())))
    })
}

/// Sets what is known of a frame's camera centre in the world, x y z, with the standard deviation of each coordinate. A frame
/// has one prior at the most.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_set_position_prior"))]
pub unsafe extern "C" fn window_set_position_prior(
    window: *mut Window<Scalar>,
    frame: u32,
    centre: *const Scalar,
    sigma: Scalar,
) -> i32 {
    answer(|| {
        lend_window!(window in { centre: [Vector; 1] } out {  });
        let prior = PosePrior::position(&centre.value()?, sigma)?;
        window.set_pose_prior(FrameHandle::from_bits(frame), Some(prior))?;
        Ok(0)
    })
}

/// Sets what is known of a frame's rotation, i j k w, with the standard deviation about each axis, rad.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_set_rotation_prior"))]
pub unsafe extern "C" fn window_set_rotation_prior(
    window: *mut Window<Scalar>,
    frame: u32,
    quaternion: *const Scalar,
    sigma_rad: Scalar,
) -> i32 {
    answer(|| {
        lend_window!(window in { quaternion: [[Scalar; 4]; 1] } out {  });
        let prior = PosePrior::rotation(&rotation(&quaternion.value()?)?, sigma_rad)?;
        window.set_pose_prior(FrameHandle::from_bits(frame), Some(prior))?;
        Ok(0)
    })
}

/// Sets what is known of a frame's pose. `information`: the inverse covariance, rotation then translation, 6x6 by rows.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_set_pose_prior"))]
pub unsafe extern "C" fn window_set_pose_prior(
    window: *mut Window<Scalar>,
    frame: u32,
    pose: *const Pose<Scalar>,
    information: *const Scalar,
) -> i32 {
    answer(|| {
        lend_window!(window in { pose: [Pose<Scalar>; 1], information: [[[Scalar; 6]; 6]; 1] } out {  });
        let prior = PosePrior::full(&pose.value()?.to_kernel()?, &from_rows(information.value()?))?;
        window.set_pose_prior(FrameHandle::from_bits(frame), Some(prior))?;
        Ok(0)
    })
}

/// Removes the prior of a frame.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_remove_pose_prior"))]
pub unsafe extern "C" fn window_remove_pose_prior(window: *mut Window<Scalar>, frame: u32) -> i32 {
    answer(|| {
        lend_window!(window in {  } out {  });
        window.set_pose_prior(FrameHandle::from_bits(frame), None)?;
        Ok(0)
    })
}

/// Sets a known distance between the centres of two frames with its standard deviation: what gives a window of one camera its
/// scale. A frame `a` has one at the most.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_set_distance"))]
pub unsafe extern "C" fn window_set_distance(
    window: *mut Window<Scalar>,
    a: u32,
    b: u32,
    distance: Scalar,
    sigma: Scalar,
) -> i32 {
    answer(|| {
        lend_window!(window in {  } out {  });
        window.set_distance(FrameHandle::from_bits(a), FrameHandle::from_bits(b), distance, sigma)?;
        Ok(0)
    })
}

/// Removes the distance set from a frame to another.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_remove_distance"))]
pub unsafe extern "C" fn window_remove_distance(window: *mut Window<Scalar>, a: u32) -> i32 {
    answer(|| {
        lend_window!(window in {  } out {  });
        window.remove_distance(FrameHandle::from_bits(a))?;
        Ok(0)
    })
}

/// Takes a frame out and leaves what it said as a prior on the others. `loss`: one of `epi_loss`. Answers how many points went
/// with it.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_marginalise_frame"))]
pub unsafe extern "C" fn window_marginalise_frame(
    window: *mut Window<Scalar>,
    frame: u32,
    loss: u32,
    loss_scale: Scalar,
) -> i32 {
    answer(|| {
        lend_window!(window in {  } out {  });
        Ok(window.marginalise_frame(FrameHandle::from_bits(frame), &loss_of(loss, loss_scale)?)?)
    })
}

/// Takes a point out and leaves what its observations said about the frames. `loss`: one of `epi_loss`.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_marginalise_point"))]
pub unsafe extern "C" fn window_marginalise_point(
    window: *mut Window<Scalar>,
    point: u32,
    loss: u32,
    loss_scale: Scalar,
) -> i32 {
    answer(|| {
        lend_window!(window in {  } out {  });
        window.marginalise_point(PointHandle::from_bits(point), &loss_of(loss, loss_scale)?)?;
        Ok(0)
    })
}

/// Forgets the marginalisation prior.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_clear_prior"))]
pub unsafe extern "C" fn window_clear_prior(window: *mut Window<Scalar>) -> i32 {
    answer(|| {
        lend_window!(window in {  } out {  });
        window.clear_prior();
        Ok(0)
    })
}

/// The covariances of a frame, all other frames and points being unknown too. `loss`: one of `epi_loss`.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_frame_covariance"))]
pub unsafe extern "C" fn window_frame_covariance(
    window: *mut Window<Scalar>,
    frame: u32,
    loss: u32,
    loss_scale: Scalar,
    covariance: *mut FrameCovariance<Scalar>,
) -> i32 {
    answer(|| {
        lend_window!(window in {  } out { covariance: [FrameCovariance<Scalar>; 1] });
        let found = window.frame_covariance(FrameHandle::from_bits(frame), &loss_of(loss, loss_scale)?)?;
        covariance.push(FrameCovariance {
            pose: rows(&found.pose),
            centre: rows(&found.centre),
            motion: rows(&found.motion),
        });
        Ok(0)
    })
}

/// The covariance of a point, all frames and other points being unknown too: 3x3 by rows. `loss`: one of `epi_loss`.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_point_covariance"))]
pub unsafe extern "C" fn window_point_covariance(
    window: *mut Window<Scalar>,
    point: u32,
    loss: u32,
    loss_scale: Scalar,
    covariance: *mut Scalar,
) -> i32 {
    answer(|| {
        lend_window!(window in {  } out { covariance: [[[Scalar; 3]; 3]; 1] });
        let found = window.point_covariance(PointHandle::from_bits(point), &loss_of(loss, loss_scale)?)?;
        covariance.push(rows(&found));
        Ok(0)
    })
}

/// Moves frames and points to the least cost. `keep_going`: null, or asked before every iteration. `report_size`: `sizeof` of
/// the struct.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_optimise"))]
pub unsafe extern "C" fn window_optimise(
    window: *mut Window<Scalar>,
    options: *const BundleOptions<Scalar>,
    keep_going: KeepGoing,
    context: *mut c_void,
    report: *mut BundleReport<Scalar>,
    report_size: usize,
) -> i32 {
    answer(|| {
        // SAFETY: the caller's promise.
        let (lent, options, mut report) = unsafe { lend_run(window, options, report, report_size)? };
        let mut window = lent.open()?;
        report.write(
            &window
                .optimise_while(&options, |progress| match keep_going {
                    // SAFETY: the caller's function, with the caller's context.
                    Some(ask) => unsafe { ask(context, progress.iterations) != 0 },
                    None => true,
                })?
                .into(),
        );
        Ok(0)
    })
}

/// Moves one frame alone, all else held. `report_size`: `sizeof` of the struct.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_refine_frame"))]
pub unsafe extern "C" fn window_refine_frame(
    window: *mut Window<Scalar>,
    frame: u32,
    options: *const BundleOptions<Scalar>,
    report: *mut BundleReport<Scalar>,
    report_size: usize,
) -> i32 {
    answer(|| {
        // SAFETY: the caller's promise.
        let (lent, options, mut report) = unsafe { lend_run(window, options, report, report_size)? };
        let mut window = lent.open()?;
        report.write(&window.refine_frame(FrameHandle::from_bits(frame), &options)?.into());
        Ok(0)
    })
}

/// Moves one point alone, all frames held. `report_size`: `sizeof` of the struct.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_refine_point"))]
pub unsafe extern "C" fn window_refine_point(
    window: *mut Window<Scalar>,
    point: u32,
    options: *const BundleOptions<Scalar>,
    report: *mut BundleReport<Scalar>,
    report_size: usize,
) -> i32 {
    answer(|| {
        // SAFETY: the caller's promise.
        let (lent, options, mut report) = unsafe { lend_run(window, options, report, report_size)? };
        let mut window = lent.open()?;
        report.write(&window.refine_point(PointHandle::from_bits(point), &options)?.into());
        Ok(0)
    })
}

/// How well the observations of a point agree with it, `outlier_sigma` deviations being the limit. `report_size`: `sizeof` of
/// the struct.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("window_point_report"))]
pub unsafe extern "C" fn window_point_report(
    window: *mut Window<Scalar>,
    point: u32,
    outlier_sigma: Scalar,
    report: *mut PointReport<Scalar>,
    report_size: usize,
) -> i32 {
    answer(|| {
        // SAFETY: the caller's promise.
        let (lent, mut report) =
            unsafe { (Lent::<Scalar>::new(window)?, OutputStruct::new(report, report_size)?) };
        disjoint(&[report.bytes()], &[lent.bytes()])?;
        report.write(&lent.open()?.point_report(PointHandle::from_bits(point), outlier_sigma)?.into());
        Ok(0)
    })
}

type Run<'a, R> = (Lent<'a, Scalar>, epipole::bundle::BundleOptions<Scalar>, OutputStruct<'a, R>);

/// What an optimisation takes.
///
/// # Safety
/// The contract of the crate.
unsafe fn lend_run<'a, R: Grows>(
    window: *mut Window<Scalar>,
    options: *const BundleOptions<Scalar>,
    report: *mut R,
    report_size: usize,
) -> Result<Run<'a, R>, Status> {
    // SAFETY: passed on.
    let (window, (options, options_bytes), report) = unsafe {
        (
            Lent::<Scalar>::new(window)?,
            read_options(options, BundleOptions::defaults(size_of::<BundleOptions<Scalar>>()))?,
            OutputStruct::new(report, report_size)?,
        )
    };
    disjoint(&[options_bytes], &[window.bytes(), report.bytes()])?;
    Ok((window, options.to_kernel()?, report))
}
