//! Minimal and linear solvers. Bearings are x y z of any length unless a function says so; none of them is robust.

use epipole::geometry;
use epipole::nalgebra::{Vector2, Vector3};
use epipole::solvers;

use super::Scalar;
use crate::limits::*;
use crate::raw::lend;
use crate::status::answer;
use crate::types::{Pose, from_rows, quaternion, rotation, rows};

type Vector = Vector3<Scalar>;
type Matrix = [[Scalar; 3]; 3];

/// Essential matrices of five bearing pairs, `x2' E x1 = 0`.
///
/// `x1`, `x2`: 5 times x y z. `essentials`: `capacity >= EPI_RELPOSE_5PT_MAX` matrices by rows, |E| = 1. Answers how many.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("relpose_5pt"))]
pub unsafe extern "C" fn relpose_5pt(
    x1: *const Scalar,
    x2: *const Scalar,
    essentials: *mut Scalar,
    capacity: usize,
) -> i32 {
    answer(|| {
        lend!(in { x1: [Vector; 5], x2: [Vector; 5] } out { essentials: [Matrix; capacity] });
        essentials.holding(RELPOSE_5PT_MAX)?;
        Ok(essentials.write(solvers::relpose_5pt(x1.array()?, x2.array()?).iter().map(|e| rows(&e.0))))
    })
}

/// Poses of view 2 in the frame of view 1 of five bearing pairs, all five points in front of both cameras, |t| = 1.
///
/// `x1`, `x2`: 5 times x y z. `poses`: `capacity >= EPI_RELPOSE_5PT_MAX`. Answers how many.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("relpose_5pt_poses"))]
pub unsafe extern "C" fn relpose_5pt_poses(
    x1: *const Scalar,
    x2: *const Scalar,
    poses: *mut Pose<Scalar>,
    capacity: usize,
) -> i32 {
    answer(|| {
        lend!(in { x1: [Vector; 5], x2: [Vector; 5] } out { poses: [Pose<Scalar>; capacity] });
        poses.holding(RELPOSE_5PT_MAX)?;
        Ok(poses.write(solvers::relpose_5pt_poses(x1.array()?, x2.array()?).into_iter().map(Pose::from)))
    })
}

/// Fundamental matrices of seven correspondences, `x2' F x1 = 0`.
///
/// `x1`, `x2`: 7 times x y z. `fundamentals`: `capacity >= EPI_RELPOSE_7PT_MAX` matrices by rows, |F| = 1. Answers how
/// many.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("relpose_7pt"))]
pub unsafe extern "C" fn relpose_7pt(
    x1: *const Scalar,
    x2: *const Scalar,
    fundamentals: *mut Scalar,
    capacity: usize,
) -> i32 {
    answer(|| {
        lend!(in { x1: [Vector; 7], x2: [Vector; 7] } out { fundamentals: [Matrix; capacity] });
        fundamentals.holding(RELPOSE_7PT_MAX)?;
        Ok(fundamentals.write(solvers::relpose_7pt(x1.array()?, x2.array()?).iter().map(|f| rows(&f.0))))
    })
}

/// The essential matrix of eight and more correspondences.
///
/// `x1`, `x2`: `count >= 8` times x y z. `essential`: by rows. Answers 1, or 0 where none is determined.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("relpose_8pt"))]
pub unsafe extern "C" fn relpose_8pt(
    x1: *const Scalar,
    x2: *const Scalar,
    count: usize,
    essential: *mut Scalar,
) -> i32 {
    answer(|| {
        lend!(in { x1: [Vector; count], x2: [Vector; count] } out { essential: [Matrix; 1] });
        Ok(essential.write(solvers::relpose_8pt(x1.slice, x2.slice)?.map(|e| rows(&e.0))))
    })
}

/// The fundamental matrix of eight and more correspondences.
///
/// `x1`, `x2`: `count >= 8` times x y z. `fundamental`: by rows. Answers 1, or 0 where none is determined.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("fundamental_8pt"))]
pub unsafe extern "C" fn fundamental_8pt(
    x1: *const Scalar,
    x2: *const Scalar,
    count: usize,
    fundamental: *mut Scalar,
) -> i32 {
    answer(|| {
        lend!(in { x1: [Vector; count], x2: [Vector; count] } out { fundamental: [Matrix; 1] });
        Ok(fundamental.write(solvers::fundamental_8pt(x1.slice, x2.slice)?.map(|f| rows(&f.0))))
    })
}

/// Poses of view 2 in the frame of view 1 of three bearing pairs, both frames turned until gravity is along +y, |t| = 1.
///
/// `x1`, `x2`: 3 times x y z. `poses`: `capacity >= EPI_RELPOSE_UPRIGHT_3PT_MAX`. Answers how many.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("relpose_upright_3pt"))]
pub unsafe extern "C" fn relpose_upright_3pt(
    x1: *const Scalar,
    x2: *const Scalar,
    poses: *mut Pose<Scalar>,
    capacity: usize,
) -> i32 {
    answer(|| {
        lend!(in { x1: [Vector; 3], x2: [Vector; 3] } out { poses: [Pose<Scalar>; capacity] });
        poses.holding(RELPOSE_UPRIGHT_3PT_MAX)?;
        Ok(poses.write(solvers::relpose_upright_3pt(x1.array()?, x2.array()?).into_iter().map(Pose::from)))
    })
}

/// The homography of four correspondences, `x2 ~ H x1`.
///
/// `x1`, `x2`: 4 times x y z. `homography`: by rows. Answers 1, or 0 where three points are on a line or change their sense.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("homography_4pt"))]
pub unsafe extern "C" fn homography_4pt(
    x1: *const Scalar,
    x2: *const Scalar,
    homography: *mut Scalar,
) -> i32 {
    answer(|| {
        lend!(in { x1: [Vector; 4], x2: [Vector; 4] } out { homography: [Matrix; 1] });
        Ok(homography.write(solvers::homography_4pt(x1.array()?, x2.array()?).map(|h| rows(&h.0))))
    })
}

/// The homography of four and more correspondences.
///
/// `x1`, `x2`: `count >= 4` times x y z. `homography`: by rows. Answers 1, or 0 where none is determined.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("homography_npt"))]
pub unsafe extern "C" fn homography_npt(
    x1: *const Scalar,
    x2: *const Scalar,
    count: usize,
    homography: *mut Scalar,
) -> i32 {
    answer(|| {
        lend!(in { x1: [Vector; count], x2: [Vector; count] } out { homography: [Matrix; 1] });
        Ok(homography.write(solvers::homography_npt(x1.slice, x2.slice)?.map(|h| rows(&h.0))))
    })
}

/// Poses, world to camera, that show three points along three unit bearings.
///
/// `bearings`, `points`: 3 times x y z. `poses`: `capacity >= EPI_P3P_MAX`. Answers how many.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("p3p"))]
pub unsafe extern "C" fn p3p(
    bearings: *const Scalar,
    points: *const Scalar,
    poses: *mut Pose<Scalar>,
    capacity: usize,
) -> i32 {
    answer(|| {
        lend!(in { bearings: [Vector; 3], points: [Vector; 3] } out { poses: [Pose<Scalar>; capacity] });
        poses.holding(P3P_MAX)?;
        Ok(poses.write(solvers::p3p(bearings.array()?, points.array()?).into_iter().map(Pose::from)))
    })
}

/// Poses, world to camera, that show two points along two bearings, both frames turned until gravity is along +y.
///
/// `bearings`, `points`: 2 times x y z. `poses`: `capacity >= EPI_ABSPOSE_UPRIGHT_2PT_MAX`. Answers how many.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("abspose_upright_2pt"))]
pub unsafe extern "C" fn abspose_upright_2pt(
    bearings: *const Scalar,
    points: *const Scalar,
    poses: *mut Pose<Scalar>,
    capacity: usize,
) -> i32 {
    answer(|| {
        lend!(in { bearings: [Vector; 2], points: [Vector; 2] } out { poses: [Pose<Scalar>; capacity] });
        poses.holding(ABSPOSE_UPRIGHT_2PT_MAX)?;
        let found = solvers::abspose_upright_2pt(bearings.array()?, points.array()?);
        Ok(poses.write(found.into_iter().map(Pose::from)))
    })
}

/// Poses, world to camera, of least error of four and more points, a plane of them included: the better first.
///
/// `bearings`, `points`: `count >= 4` times x y z. `poses`: `capacity >= EPI_ABSPOSE_NPT_MAX`. Answers how many.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("abspose_npt"))]
pub unsafe extern "C" fn abspose_npt(
    bearings: *const Scalar,
    points: *const Scalar,
    count: usize,
    poses: *mut Pose<Scalar>,
    capacity: usize,
) -> i32 {
    answer(|| {
        lend!(in { bearings: [Vector; count], points: [Vector; count] } out { poses: [Pose<Scalar>; capacity] });
        poses.holding(ABSPOSE_NPT_MAX)?;
        Ok(poses.write(solvers::abspose_npt(bearings.slice, points.slice)?.into_iter().map(Pose::from)))
    })
}

/// The one or two poses, target to camera, that show four and more points of the target's plane z = 0: the better first.
///
/// `bearings`: `count >= 4` times x y z. `points`: `count` times x y. `poses`, `rms_rad` (of the angles):
/// `capacity >= EPI_ABSPOSE_PLANAR_MAX`. Answers how many.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("abspose_planar"))]
pub unsafe extern "C" fn abspose_planar(
    bearings: *const Scalar,
    points: *const Scalar,
    count: usize,
    poses: *mut Pose<Scalar>,
    rms_rad: *mut Scalar,
    capacity: usize,
) -> i32 {
    answer(|| {
        lend!(in { bearings: [Vector; count], points: [Vector2<Scalar>; count] }
            out { poses: [Pose<Scalar>; capacity], rms_rad: [Scalar; capacity] });
        poses.holding(ABSPOSE_PLANAR_MAX)?;
        let found = solvers::abspose_planar(bearings.slice, points.slice)?;
        rms_rad.write(found.iter().map(|target| target.rms_rad));
        Ok(poses.write(found.iter().map(|target| Pose::from(target.pose))))
    })
}

/// The projection matrix `x ~ P (X, 1)` of six and more points.
///
/// `pixels`: `count >= 6` times u v. `points`: `count` times x y z. `projection`: 3x4 by rows. Answers 1, or 0 where none
/// is determined.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("resection_dlt"))]
pub unsafe extern "C" fn resection_dlt(
    pixels: *const Scalar,
    points: *const Scalar,
    count: usize,
    projection: *mut Scalar,
) -> i32 {
    answer(|| {
        lend!(in { pixels: [Vector2<Scalar>; count], points: [Vector; count] }
            out { projection: [[[Scalar; 4]; 3]; 1] });
        Ok(projection.write(solvers::resection_dlt(pixels.slice, points.slice)?.map(|p| rows(&p))))
    })
}

/// Calibration and pose of a projection matrix.
///
/// `projection`: 3x4 by rows. `calibration`: 3x3 by rows, upper triangular, its last entry 1. Answers 1, or 0 for a matrix
/// of no camera.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("decompose_projection"))]
pub unsafe extern "C" fn decompose_projection(
    projection: *const Scalar,
    calibration: *mut Scalar,
    pose: *mut Pose<Scalar>,
) -> i32 {
    answer(|| {
        lend!(in { projection: [[[Scalar; 4]; 3]; 1] } out { calibration: [Matrix; 1], pose: [Pose<Scalar>; 1] });
        let parts = solvers::decompose_projection(&from_rows(projection.value()?));
        calibration.write(parts.map(|parts| rows(&parts.calibration)));
        Ok(pose.write(parts.map(|parts| parts.pose.into())))
    })
}

/// The rotation of two bearing pairs, `x2 ~ R x1`, best in the middle between them.
///
/// `x1`, `x2`: 2 times x y z. `quaternion`: i j k w. Answers 1, or 0 where none is determined.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("rotation_2pt"))]
pub unsafe extern "C" fn rotation_2pt(x1: *const Scalar, x2: *const Scalar, quaternion: *mut Scalar) -> i32 {
    answer(|| {
        lend!(in { x1: [Vector; 2], x2: [Vector; 2] } out { quaternion: [[Scalar; 4]; 1] });
        Ok(quaternion.write(solvers::rotation_2pt(x1.array()?, x2.array()?).map(|q| self::quaternion(&q))))
    })
}

/// The least-squares rotation of two and more bearing pairs.
///
/// `x1`, `x2`: `count >= 2` times x y z. `quaternion`: i j k w. Answers 1, or 0 where none is determined.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("rotation_npt"))]
pub unsafe extern "C" fn rotation_npt(
    x1: *const Scalar,
    x2: *const Scalar,
    count: usize,
    quaternion: *mut Scalar,
) -> i32 {
    answer(|| {
        lend!(in { x1: [Vector; count], x2: [Vector; count] } out { quaternion: [[Scalar; 4]; 1] });
        Ok(quaternion.write(solvers::rotation_npt(x1.slice, x2.slice)?.map(|q| self::quaternion(&q))))
    })
}

/// The unit translation of two bearing pairs, the rotation (i j k w) being known.
///
/// `x1`, `x2`: 2 times x y z. `translation`: x y z. Answers 1, or 0 where none is determined.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("translation_2pt"))]
pub unsafe extern "C" fn translation_2pt(
    quaternion: *const Scalar,
    x1: *const Scalar,
    x2: *const Scalar,
    translation: *mut Scalar,
) -> i32 {
    answer(|| {
        lend!(in { quaternion: [[Scalar; 4]; 1], x1: [Vector; 2], x2: [Vector; 2] }
            out { translation: [[Scalar; 3]; 1] });
        let rotation = rotation(&quaternion.value()?)?;
        Ok(translation.write(solvers::translation_2pt(&rotation, x1.array()?, x2.array()?).map(Into::into)))
    })
}

/// The least-squares unit translation of two and more bearing pairs, the rotation (i j k w) being known.
///
/// `x1`, `x2`: `count >= 2` times x y z. `translation`: x y z. Answers 1, or 0 where none is determined.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("translation_npt"))]
pub unsafe extern "C" fn translation_npt(
    quaternion: *const Scalar,
    x1: *const Scalar,
    x2: *const Scalar,
    count: usize,
    translation: *mut Scalar,
) -> i32 {
    answer(|| {
        lend!(in { quaternion: [[Scalar; 4]; 1], x1: [Vector; count], x2: [Vector; count] }
            out { translation: [[Scalar; 3]; 1] });
        let rotation = rotation(&quaternion.value()?)?;
        Ok(translation.write(solvers::translation_npt(&rotation, x1.slice, x2.slice)?.map(Into::into)))
    })
}

/// The least-squares pose of three and more points, `b = R a + t`.
///
/// `a`, `b`: `count >= 3` times x y z. Answers 1, or 0 where none is determined.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("absolute_orientation_npt"))]
pub unsafe extern "C" fn absolute_orientation_npt(
    a: *const Scalar,
    b: *const Scalar,
    count: usize,
    pose: *mut Pose<Scalar>,
) -> i32 {
    answer(|| {
        lend!(in { a: [Vector; count], b: [Vector; count] } out { pose: [Pose<Scalar>; 1] });
        Ok(pose.write(solvers::absolute_orientation_npt(a.slice, b.slice)?.map(Into::into)))
    })
}

/// The least-squares similarity of three and more points, `b = s R a + t`.
///
/// `a`, `b`: `count >= 3` times x y z. `pose`: R and t. `scale`: s > 0. Answers 1, or 0 where none is determined.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("absolute_orientation_with_scale_npt"))]
pub unsafe extern "C" fn absolute_orientation_with_scale_npt(
    a: *const Scalar,
    b: *const Scalar,
    count: usize,
    pose: *mut Pose<Scalar>,
    scale: *mut Scalar,
) -> i32 {
    answer(|| {
        lend!(in { a: [Vector; count], b: [Vector; count] } out { pose: [Pose<Scalar>; 1], scale: [Scalar; 1] });
        let found = solvers::absolute_orientation_with_scale_npt(a.slice, b.slice)?;
        scale.write(found.map(|similarity| similarity.scaling()));
        Ok(pose.write(found.map(|similarity| geometry::Pose::into(similarity.isometry))))
    })
}
