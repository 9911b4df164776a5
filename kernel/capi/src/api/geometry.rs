//! Poses and rotations; essential and fundamental matrices, homographies and what they are made of. Matrices are 3x3 by
//! rows, rotations quaternions i j k w.

use epipole::geometry::{Essential, Fundamental, Homography, PlaneMotion, cheirality, pose as poses_of};
use epipole::nalgebra::{Matrix3, SVector, Vector2, Vector3};

use super::Scalar;
use crate::Status;
use crate::limits::{ESSENTIAL_POSES_MAX, HOMOGRAPHY_MOTIONS_MAX};
use crate::raw::{Output, lend};
use crate::status::answer;
use crate::types::{Pose, from_rows, quaternion as ijkw, rotation, rows};

type Vector = Vector3<Scalar>;
type Matrix = [[Scalar; 3]; 3];

/// The pose of a rotation matrix, which is checked, and a translation.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("pose_from_matrix"))]
pub unsafe extern "C" fn pose_from_matrix(
    matrix: *const Scalar,
    translation: *const Scalar,
    pose: *mut Pose<Scalar>,
) -> i32 {
    answer(|| {
        lend!(in { matrix: [Matrix; 1], translation: [Vector; 1] } out { pose: [Pose<Scalar>; 1] });
        let (r, t) = (from_rows(matrix.value()?), translation.value()?);
        if !r.iter().chain(t.iter()).all(|x: &Scalar| x.is_finite()) {
            return Err(Status::NotFinite);
        }
        let excess: Matrix3<Scalar> = r.transpose() * r - Matrix3::identity();
        if !(excess.norm_squared() <= 1e-6 && r.determinant() > 0.0) {
            return Err(Status::Rotation);
        }
        pose.push(poses_of::from_parts(&r, &t).into());
        Ok(1)
    })
}

/// The rotation matrix and the translation of a pose.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("pose_matrix"))]
pub unsafe extern "C" fn pose_matrix(
    pose: *const Pose<Scalar>,
    matrix: *mut Scalar,
    translation: *mut Scalar,
) -> i32 {
    answer(|| {
        lend!(in { pose: [Pose<Scalar>; 1] } out { matrix: [Matrix; 1], translation: [[Scalar; 3]; 1] });
        let pose = pose.value()?.to_kernel()?;
        matrix.push(rows(&pose.rotation.to_rotation_matrix().into_inner()));
        translation.push(pose.translation.vector.into());
        Ok(1)
    })
}

/// The pose of the second camera in the frame of the first, from two poses world to camera.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("pose_relative"))]
pub unsafe extern "C" fn pose_relative(
    first: *const Pose<Scalar>,
    second: *const Pose<Scalar>,
    relative: *mut Pose<Scalar>,
) -> i32 {
    answer(|| {
        lend!(in { first: [Pose<Scalar>; 1], second: [Pose<Scalar>; 1] } out { relative: [Pose<Scalar>; 1] });
        let (first, second) = (first.value()?.to_kernel()?, second.value()?.to_kernel()?);
        relative.push(poses_of::relative(&first, &second).into());
        Ok(1)
    })
}

/// The camera's centre in the world, `-R' t`.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("pose_centre"))]
pub unsafe extern "C" fn pose_centre(pose: *const Pose<Scalar>, centre: *mut Scalar) -> i32 {
    answer(|| {
        lend!(in { pose: [Pose<Scalar>; 1] } out { centre: [[Scalar; 3]; 1] });
        centre.push(poses_of::centre(&pose.value()?.to_kernel()?).into());
        Ok(1)
    })
}

/// The pose moved by `delta`, a rotation vector w (rad) and dt: `R <- Exp(w) R`, `t <- t + dt`, the chart of covariances.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("pose_retract"))]
pub unsafe extern "C" fn pose_retract(
    pose: *const Pose<Scalar>,
    delta: *const Scalar,
    moved: *mut Pose<Scalar>,
) -> i32 {
    answer(|| {
        lend!(in { pose: [Pose<Scalar>; 1], delta: [SVector<Scalar, 6>; 1] } out { moved: [Pose<Scalar>; 1] });
        let (pose, delta) = (pose.value()?.to_kernel()?, delta.value()?);
        if !delta.iter().all(|x| x.is_finite()) {
            return Err(Status::NotFinite);
        }
        moved.push(poses_of::retract(&pose, &delta).into());
        Ok(1)
    })
}

/// The rotation of a rotation vector, rad.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("rotation_exp"))]
pub unsafe extern "C" fn rotation_exp(vector: *const Scalar, quaternion: *mut Scalar) -> i32 {
    answer(|| {
        lend!(in { vector: [Vector; 1] } out { quaternion: [[Scalar; 4]; 1] });
        let vector = vector.value()?;
        if !vector.iter().all(|x| x.is_finite()) {
            return Err(Status::NotFinite);
        }
        quaternion.push(ijkw(&poses_of::exp(&vector)));
        Ok(1)
    })
}

/// The rotation vector of a rotation, of length in [0, pi].
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("rotation_log"))]
pub unsafe extern "C" fn rotation_log(quaternion: *const Scalar, vector: *mut Scalar) -> i32 {
    answer(|| {
        lend!(in { quaternion: [[Scalar; 4]; 1] } out { vector: [[Scalar; 3]; 1] });
        vector.push(poses_of::log(&rotation(&quaternion.value()?)?).into());
        Ok(1)
    })
}

/// The rotation nearest to a matrix. Answers 1, or 0 where more than one is as near.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("nearest_rotation"))]
pub unsafe extern "C" fn nearest_rotation(matrix: *const Scalar, nearest: *mut Scalar) -> i32 {
    answer(|| {
        lend!(in { matrix: [Matrix; 1] } out { nearest: [Matrix; 1] });
        Ok(nearest.write(poses_of::nearest_rotation(&from_rows(matrix.value()?)).map(|r| rows(&r))))
    })
}

/// The turn that takes a direction of gravity to +y, for the upright solvers. Answers 1, or 0 for no direction.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("upright"))]
pub unsafe extern "C" fn upright(gravity: *const Scalar, matrix: *mut Scalar) -> i32 {
    answer(|| {
        lend!(in { gravity: [Vector; 1] } out { matrix: [Matrix; 1] });
        Ok(matrix.write(poses_of::upright(&gravity.value()?).map(|r| rows(&r))))
    })
}

/// The two tangents of a unit vector in which covariances of directions are given: 3x2 by rows.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("tangent_basis"))]
pub unsafe extern "C" fn tangent_basis(unit: *const Scalar, basis: *mut Scalar) -> i32 {
    answer(|| {
        lend!(in { unit: [Vector; 1] } out { basis: [[[Scalar; 2]; 3]; 1] });
        basis.push(rows(&poses_of::tangent_basis(&unit.value()?)));
        Ok(1)
    })
}

/// `E = [t]x R`.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("essential_from_pose"))]
pub unsafe extern "C" fn essential_from_pose(pose: *const Pose<Scalar>, essential: *mut Scalar) -> i32 {
    answer(|| {
        lend!(in { pose: [Pose<Scalar>; 1] } out { essential: [Matrix; 1] });
        essential.push(rows(&Essential::from_pose(&pose.value()?.to_kernel()?).0));
        Ok(1)
    })
}

/// `E = K2' F K1`.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("essential_from_fundamental"))]
pub unsafe extern "C" fn essential_from_fundamental(
    fundamental: *const Scalar,
    k1: *const Scalar,
    k2: *const Scalar,
    essential: *mut Scalar,
) -> i32 {
    answer(|| {
        lend!(in { fundamental: [Matrix; 1], k1: [Matrix; 1], k2: [Matrix; 1] } out { essential: [Matrix; 1] });
        let f = Fundamental(from_rows(fundamental.value()?));
        let e = Essential::from_fundamental(&f, &from_rows(k1.value()?), &from_rows(k2.value()?));
        essential.push(rows(&e.0));
        Ok(1)
    })
}

/// `F = K2^-T E K1^-1`. Answers 1, or 0 where a calibration matrix is singular.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("essential_to_fundamental"))]
pub unsafe extern "C" fn essential_to_fundamental(
    essential: *const Scalar,
    k1: *const Scalar,
    k2: *const Scalar,
    fundamental: *mut Scalar,
) -> i32 {
    answer(|| {
        lend!(in { essential: [Matrix; 1], k1: [Matrix; 1], k2: [Matrix; 1] } out { fundamental: [Matrix; 1] });
        let e = Essential(from_rows(essential.value()?));
        let f = e.to_fundamental(&from_rows(k1.value()?), &from_rows(k2.value()?));
        Ok(fundamental.write(f.map(|f| rows(&f.0))))
    })
}

/// The essential matrix nearest to a matrix. Answers 1, or 0 where none is.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("essential_nearest"))]
pub unsafe extern "C" fn essential_nearest(matrix: *const Scalar, nearest: *mut Scalar) -> i32 {
    answer(|| {
        lend!(in { matrix: [Matrix; 1] } out { nearest: [Matrix; 1] });
        Ok(nearest.write(Essential(from_rows(matrix.value()?)).nearest().map(|e| rows(&e.0))))
    })
}

/// The four poses of an essential matrix, |t| = 1, in the order (R1, t), (R1, -t), (R2, t), (R2, -t).
///
/// `poses`: `capacity >= EPI_ESSENTIAL_POSES_MAX`. Answers 4, or 0 for a matrix without.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("essential_poses"))]
pub unsafe extern "C" fn essential_poses(
    essential: *const Scalar,
    poses: *mut Pose<Scalar>,
    capacity: usize,
) -> i32 {
    answer(|| {
        lend!(in { essential: [Matrix; 1] } out { poses: [Pose<Scalar>; capacity] });
        poses.holding(ESSENTIAL_POSES_MAX)?;
        let found = Essential(from_rows(essential.value()?)).poses();
        Ok(poses.write(found.into_iter().flatten().map(Pose::from)))
    })
}

/// The pose of an essential matrix that has the most points in front of both cameras.
///
/// `x1`, `x2`: `count` times x y z. `in_front`: how many points, then how many of the second best pose: as many, and the
/// points do not tell the poses apart. Answers 1, or 0 for a matrix without poses.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("essential_pose_by_cheirality"))]
pub unsafe extern "C" fn essential_pose_by_cheirality(
    essential: *const Scalar,
    x1: *const Scalar,
    x2: *const Scalar,
    count: usize,
    pose: *mut Pose<Scalar>,
    in_front: *mut u32,
) -> i32 {
    answer(|| {
        lend!(in { essential: [Matrix; 1], x1: [Vector; count], x2: [Vector; count] }
            out { pose: [Pose<Scalar>; 1], in_front: [[u32; 2]; 1] });
        let found = Essential(from_rows(essential.value()?)).pose_by_cheirality(x1.slice, x2.slice);
        in_front.write(found.map(|found| [found.in_front as u32, found.runner_up as u32]));
        Ok(pose.write(found.map(|found| found.pose.into())))
    })
}

/// The matrix of rank 2 nearest to a matrix. Answers 1, or 0 where none is.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("fundamental_nearest"))]
pub unsafe extern "C" fn fundamental_nearest(matrix: *const Scalar, nearest: *mut Scalar) -> i32 {
    answer(|| {
        lend!(in { matrix: [Matrix; 1] } out { nearest: [Matrix; 1] });
        Ok(nearest.write(Fundamental(from_rows(matrix.value()?)).nearest().map(|f| rows(&f.0))))
    })
}

/// The epipoles of both views, `F e1 = 0` and `F' e2 = 0`, unit vectors. Answers 1, or 0 where they are not determined.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("fundamental_epipoles"))]
pub unsafe extern "C" fn fundamental_epipoles(
    fundamental: *const Scalar,
    epipole1: *mut Scalar,
    epipole2: *mut Scalar,
) -> i32 {
    answer(|| {
        lend!(in { fundamental: [Matrix; 1] } out { epipole1: [[Scalar; 3]; 1], epipole2: [[Scalar; 3]; 1] });
        let f = Fundamental(from_rows(fundamental.value()?));
        let found = f.epipole1().zip(f.epipole2());
        epipole1.write(found.map(|(e, _)| e.into()));
        Ok(epipole2.write(found.map(|(_, e)| e.into())))
    })
}

/// The motions and planes of a homography between normalised points, `H ~ R + t n' / d`: poses with t / d, unit normals.
///
/// `poses`, `normals`: `capacity >= EPI_HOMOGRAPHY_MOTIONS_MAX`. Answers how many.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("homography_motions"))]
pub unsafe extern "C" fn homography_motions(
    homography: *const Scalar,
    poses: *mut Pose<Scalar>,
    normals: *mut Scalar,
    capacity: usize,
) -> i32 {
    answer(|| {
        lend!(in { homography: [Matrix; 1] }
            out { poses: [Pose<Scalar>; capacity], normals: [[Scalar; 3]; capacity] });
        poses.holding(HOMOGRAPHY_MOTIONS_MAX)?;
        let found = Homography(from_rows(homography.value()?)).motions();
        Ok(write_motions(&found, &mut poses, &mut normals))
    })
}

/// Those of the motions that have the most of the points `x1` in front of the camera, `count` times x y z.
///
/// `poses`, `normals`: `capacity >= EPI_HOMOGRAPHY_MOTIONS_MAX`. Answers how many.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("homography_visible_motions"))]
pub unsafe extern "C" fn homography_visible_motions(
    homography: *const Scalar,
    x1: *const Scalar,
    count: usize,
    poses: *mut Pose<Scalar>,
    normals: *mut Scalar,
    capacity: usize,
) -> i32 {
    answer(|| {
        lend!(in { homography: [Matrix; 1], x1: [Vector; count] }
            out { poses: [Pose<Scalar>; capacity], normals: [[Scalar; 3]; capacity] });
        poses.holding(HOMOGRAPHY_MOTIONS_MAX)?;
        let found = Homography(from_rows(homography.value()?)).visible_motions(x1.slice);
        Ok(write_motions(&found, &mut poses, &mut normals))
    })
}

fn write_motions(
    motions: &[PlaneMotion<Scalar>],
    poses: &mut Output<'_, Pose<Scalar>>,
    normals: &mut Output<'_, [Scalar; 3]>,
) -> usize {
    normals.write(motions.iter().map(|motion| motion.normal.into()));
    poses.write(motions.iter().map(|motion| motion.pose.into()))
}

/// `K2 H K1^-1`, between pixels. Answers 1, or 0 where K1 is singular.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("homography_to_pixels"))]
pub unsafe extern "C" fn homography_to_pixels(
    homography: *const Scalar,
    k1: *const Scalar,
    k2: *const Scalar,
    pixels: *mut Scalar,
) -> i32 {
    answer(|| {
        lend!(in { homography: [Matrix; 1], k1: [Matrix; 1], k2: [Matrix; 1] } out { pixels: [Matrix; 1] });
        let h = Homography(from_rows(homography.value()?));
        let h = h.to_pixels(&from_rows(k1.value()?), &from_rows(k2.value()?));
        Ok(pixels.write(h.map(|h| rows(&h.0))))
    })
}

/// `K2^-1 H K1`, between normalised points. Answers 1, or 0 where K2 is singular.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("homography_to_normalised"))]
pub unsafe extern "C" fn homography_to_normalised(
    homography: *const Scalar,
    k1: *const Scalar,
    k2: *const Scalar,
    normalised: *mut Scalar,
) -> i32 {
    answer(|| {
        lend!(in { homography: [Matrix; 1], k1: [Matrix; 1], k2: [Matrix; 1] } out { normalised: [Matrix; 1] });
        let h = Homography(from_rows(homography.value()?));
        let h = h.to_normalised(&from_rows(k1.value()?), &from_rows(k2.value()?));
        Ok(normalised.write(h.map(|h| rows(&h.0))))
    })
}

/// The homography from view 2 to view 1. Answers 1, or 0 where H is singular.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("homography_inverse"))]
pub unsafe extern "C" fn homography_inverse(homography: *const Scalar, inverse: *mut Scalar) -> i32 {
    answer(|| {
        lend!(in { homography: [Matrix; 1] } out { inverse: [Matrix; 1] });
        Ok(inverse.write(Homography(from_rows(homography.value()?)).inverse().map(|h| rows(&h.0))))
    })
}

/// Points of view 1 in view 2.
///
/// `x1`, `x2`: `count` times u v; zeros in x2 where the homography takes a point to infinity. `valid`: `count` times 1 or
/// 0. Answers how many are valid.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("homography_transfer"))]
pub unsafe extern "C" fn homography_transfer(
    homography: *const Scalar,
    x1: *const Scalar,
    count: usize,
    x2: *mut Scalar,
    valid: *mut u8,
) -> i32 {
    answer(|| {
        lend!(in { homography: [Matrix; 1], x1: [Vector2<Scalar>; count] }
            out { x2: [[Scalar; 2]; count], valid: [u8; count] });
        let h = Homography(from_rows(homography.value()?));
        Ok(x2.write_masked(&mut valid, x1.slice.iter().map(|x1| h.transfer(x1).map(Into::into)), [0.0; 2]))
    })
}

/// Which points lie in front of both cameras.
///
/// `pose`: of view 2 in the frame of view 1. `x1`, `x2`: `count` times x y z. `in_front`: `count` times 1 or 0. Answers
/// how many do.
///
/// # Safety
/// See the crate.
#[unsafe(export_name = name!("in_front_of_both"))]
pub unsafe extern "C" fn in_front_of_both(
    pose: *const Pose<Scalar>,
    x1: *const Scalar,
    x2: *const Scalar,
    count: usize,
    in_front: *mut u8,
) -> i32 {
    answer(|| {
        lend!(in { pose: [Pose<Scalar>; 1], x1: [Vector; count], x2: [Vector; count] }
            out { in_front: [u8; count] });
        let pose = pose.value()?.to_kernel()?;
        let mut found = 0;
        in_front.write(x1.slice.iter().zip(x2.slice).map(|(x1, x2)| {
            let inside = cheirality::in_front_of_both(&pose, x1, x2);
            found += usize::from(inside);
            u8::from(inside)
        }));
        Ok(found)
    })
}
