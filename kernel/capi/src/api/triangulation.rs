//! Points from two views and from many.

use epipole::geometry::Camera as KernelCamera;
use epipole::geometry::triangulation::{self, View, ViewPair};
use epipole::nalgebra::{Vector2, Vector3};

use super::Scalar;
use crate::Status;
use crate::enums::{TriangulationMethod, TriangulationVerdict};
use crate::limits::POINT_MAX_VIEWS;
use crate::raw::lend;
use crate::status::answer;
use crate::types::{Camera, Pose, RefinedPoint, TriangulatedPoint, rows};

type Vector = Vector3<Scalar>;

/// Points of two views from their bearings.
///
/// `pose`: of view 2 in the frame of view 1; the points have the unit of its translation. `method`: one of
/// `epi_triangulation_method`. `x1`, `x2`: `count` times x y z, bearings of any length. `points`: `count` times x y z in
/// the frame of view 1, by the verdict. `verdicts`: `count` times one of `epi_triangulation_verdict`. Answers how many
/// have the verdict `EPI_TRIANGULATION_VERDICT_POINT`.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("triangulate"))]
pub unsafe extern "C" fn triangulate(
    pose: *const Pose<Scalar>,
    method: u32,
    x1: *const Scalar,
    x2: *const Scalar,
    count: usize,
    points: *mut Scalar,
    verdicts: *mut u8,
) -> i32 {
    const MIDPOINT: u32 = TriangulationMethod::Midpoint as u32;
    const DLT: u32 = TriangulationMethod::Dlt as u32;
    const OPTIMAL: u32 = TriangulationMethod::Optimal as u32;
    answer(|| {
        lend!(in { pose: [Pose<Scalar>; 1], x1: [Vector; count], x2: [Vector; count] }
            out { points: [[Scalar; 3]; count], verdicts: [u8; count] });
        let pair = ViewPair::new(&pose.value()?.to_kernel()?);
        if method > OPTIMAL {
            return Err(Status::UnknownEnum);
        }
        let mut found = 0;
        points.write(x1.slice.iter().zip(x2.slice).map(|(x1, x2)| {
            let answer = TriangulatedPoint::from(match method {
                MIDPOINT => pair.triangulate_midpoint(x1, x2),
                DLT => pair.triangulate_dlt(x1, x2),
                _ => pair.triangulate_optimal(x1, x2),
            });
            verdicts.push(answer.verdict as u8);
            found += usize::from(answer.verdict == TriangulationVerdict::Point as u32);
            answer.point
        }));
        Ok(found)
    })
}

/// The point of two and more views from its bearings: algebraic error, a start for `epi_refine_point`.
///
/// `poses`: 2 to `EPI_POINT_MAX_VIEWS`, world to camera. `bearings`: `count` times x y z. Answers 1 for the verdict
/// `EPI_TRIANGULATION_VERDICT_POINT`, else 0.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("triangulate_dlt"))]
pub unsafe extern "C" fn triangulate_dlt(
    poses: *const Pose<Scalar>,
    bearings: *const Scalar,
    count: usize,
    point: *mut TriangulatedPoint<Scalar>,
) -> i32 {
    answer(|| {
        lend!(in { poses: [Pose<Scalar>; count], bearings: [Vector; count] }
            out { point: [TriangulatedPoint<Scalar>; 1] });
        // One point has few views; their poses in the kernel's type stand here.
        let mut views = [epipole::geometry::Pose::identity(); POINT_MAX_VIEWS];
        let views = views.get_mut(..count).ok_or(Status::Capacity)?;
        for (view, pose) in views.iter_mut().zip(poses.slice) {
            *view = pose.to_kernel()?;
        }
        let found = TriangulatedPoint::from(triangulation::triangulate_dlt(views, bearings.slice)?);
        point.push(found);
        Ok(usize::from(found.verdict == TriangulationVerdict::Point as u32))
    })
}

/// The point of least reprojection error in two to `EPI_POINT_MAX_VIEWS` views, from a start.
///
/// `cameras`, `poses` (world to camera): `count`. `pixels`: `count` times u v. `start`: x y z. Answers 1.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("refine_point"))]
pub unsafe extern "C" fn refine_point(
    cameras: *const Camera<Scalar>,
    poses: *const Pose<Scalar>,
    pixels: *const Scalar,
    count: usize,
    start: *const Scalar,
    point: *mut RefinedPoint<Scalar>,
) -> i32 {
    answer(|| {
        lend!(in { cameras: [Camera<Scalar>; count], poses: [Pose<Scalar>; count],
                pixels: [Vector2<Scalar>; count], start: [Vector; 1] }
            out { point: [RefinedPoint<Scalar>; 1] });
        if count > POINT_MAX_VIEWS {
            return Err(Status::Capacity);
        }
        let first = cameras.value()?.to_kernel()?;
        let mut lenses: [KernelCamera<Scalar>; POINT_MAX_VIEWS] = [first; POINT_MAX_VIEWS];
        for (lens, camera) in lenses.iter_mut().zip(cameras.slice) {
            *lens = camera.to_kernel()?;
        }
        let mut views =
            lenses.each_ref().map(|camera| View { camera, pose: epipole::geometry::Pose::identity() });
        for (view, pose) in views.iter_mut().zip(poses.slice) {
            view.pose = pose.to_kernel()?;
        }
        let views = views.get(..count).ok_or(Status::Capacity)?;
        point.push(triangulation::refine_point(views, pixels.slice, &start.value()?)?.into());
        Ok(1)
    })
}

/// Angles between the rays of two views to points, rad.
///
/// `pose`: of view 2 in the frame of view 1. `points`: `count` times x y z in the frame of view 1. `angles`: `count`.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("parallax"))]
pub unsafe extern "C" fn parallax(
    pose: *const Pose<Scalar>,
    points: *const Scalar,
    count: usize,
    angles: *mut Scalar,
) -> i32 {
    answer(|| {
        lend!(in { pose: [Pose<Scalar>; 1], points: [Vector; count] } out { angles: [Scalar; count] });
        let pair = ViewPair::new(&pose.value()?.to_kernel()?);
        Ok(angles.write(points.slice.iter().map(|point| pair.parallax(point))))
    })
}

/// The covariance of a point of two views whose bearings have the standard deviation `sigma_rad`: 3x3 by rows.
///
/// `point`: x y z in the frame of view 1. Answers 1, or 0 where a direction is open.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("point_covariance"))]
pub unsafe extern "C" fn point_covariance(
    pose: *const Pose<Scalar>,
    point: *const Scalar,
    sigma_rad: Scalar,
    covariance: *mut Scalar,
) -> i32 {
    answer(|| {
        lend!(in { pose: [Pose<Scalar>; 1], point: [Vector; 1] } out { covariance: [[[Scalar; 3]; 3]; 1] });
        let pair = ViewPair::new(&pose.value()?.to_kernel()?);
        Ok(covariance.write(pair.covariance(&point.value()?, sigma_rad).map(|c| rows(&c))))
    })
}
