//! Points from two views and from many.

use epipole::geometry::triangulation::{self, ViewPair};
use epipole::nalgebra::Vector3;

use super::Scalar;
use crate::Status;
use crate::enums::{TriangulationMethod, TriangulationVerdict};
use crate::raw::{Input, Output, disjoint};
use crate::status::answer;
use crate::types::Pose;

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
        // SAFETY: the caller's promise.
        let (pose, x1, x2, mut points, mut verdicts) = unsafe {
            (
                Input::<Pose<Scalar>>::new(pose, 1)?,
                Input::<Vector3<Scalar>>::new(x1, count)?,
                Input::<Vector3<Scalar>>::new(x2, count)?,
                Output::<[Scalar; 3]>::new(points, count)?,
                Output::<u8>::new(verdicts, count)?,
            )
        };
        disjoint(&[pose.bytes(), x1.bytes(), x2.bytes()], &[points.bytes(), verdicts.bytes()])?;
        let pair = ViewPair::new(&pose.value()?.to_kernel()?);
        if method > OPTIMAL {
            return Err(Status::UnknownEnum);
        }
        let mut found = 0;
        points.write(x1.slice.iter().zip(x2.slice).map(|(x1, x2)| {
            let (point, verdict) = parts(match method {
                MIDPOINT => pair.triangulate_midpoint(x1, x2),
                DLT => pair.triangulate_dlt(x1, x2),
                _ => pair.triangulate_optimal(x1, x2),
            });
            verdicts.push(verdict as u8);
            found += usize::from(verdict as u8 == TriangulationVerdict::Point as u8);
            point
        }));
        Ok(found)
    })
}

/// Three numbers and what they are.
fn parts(triangulation: triangulation::Triangulation<Scalar>) -> ([Scalar; 3], TriangulationVerdict) {
    use triangulation::Triangulation as T;
    match triangulation {
        T::Point(point) => (point.into(), TriangulationVerdict::Point),
        T::Behind { point, .. } => (point.into(), TriangulationVerdict::Behind),
        T::AtInfinity { direction } => (direction.into(), TriangulationVerdict::AtInfinity),
        T::Undetermined => ([0.0; 3], TriangulationVerdict::Undetermined),
    }
}
