//! One minimal problem a call: `int bench_<task>_<scalar>(const T* a, const T* b, T* out)`.

use std::slice;

use epipole::geometry::triangulation::{Triangulation, ViewPair};
use epipole::geometry::{Essential, Pose};
use epipole::nalgebra::{Matrix3, Vector3};
use epipole::{Real, solvers};

use crate::poses::{vectors, write_pose};

/// Writes matrices row-major, one after the other; how many there were.
///
/// # Safety
/// `out` has room for all of them.
unsafe fn put<T: Real>(out: *mut T, matrices: impl IntoIterator<Item = Matrix3<T>>) -> i32 {
    let mut count = 0;
    for m in matrices {
        let rows = [m.m11, m.m12, m.m13, m.m21, m.m22, m.m23, m.m31, m.m32, m.m33];
        // SAFETY: as the caller promises.
        unsafe { *out.add(9 * count).cast() = rows };
        count += 1;
    }
    count as i32
}

/// Writes poses, a row-major rotation matrix and the translation each, one after the other; how many there were.
///
/// # Safety
/// `out` has room for all of them.
unsafe fn put_poses<T: Real>(out: *mut T, poses: impl IntoIterator<Item = Pose<T>>) -> i32 {
    let mut count = 0;
    for pose in poses {
        // SAFETY: as the caller promises.
        write_pose(&pose, unsafe { slice::from_raw_parts_mut(out.add(12 * count), 12) });
        count += 1;
    }
    count as i32
}

/// Exports `body` for both scalars as `extern "C"` functions of `(a, b, out)`.
macro_rules! export {
    ($($f32:ident $f64:ident: $body:ident;)*) => {
        $(
            /// # Safety
            /// The arrays are as long as the task's problem and its largest number of solutions.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $f32(a: *const f32, b: *const f32, out: *mut f32) -> i32 {
                // SAFETY: as the caller promises.
                unsafe { $body(a, b, out) }
            }
            /// # Safety
            /// The arrays are as long as the task's problem and its largest number of solutions.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $f64(a: *const f64, b: *const f64, out: *mut f64) -> i32 {
                // SAFETY: as the caller promises.
                unsafe { $body(a, b, out) }
            }
        )*
    };
}

export! {
    bench_5pt_f32 bench_5pt_f64: relpose_5pt;
    bench_5ptpose_f32 bench_5ptpose_f64: relpose_5pt_poses;
    bench_7pt_f32 bench_7pt_f64: relpose_7pt;
    bench_8pt_f32 bench_8pt_f64: relpose_8pt_of_8;
    bench_8pt20_f32 bench_8pt20_f64: relpose_8pt_of_20;
    bench_h4_f32 bench_h4_f64: homography_4pt;
    bench_edecomp_f32 bench_edecomp_f64: pose_by_cheirality;
    bench_trimid_f32 bench_trimid_f64: triangulate_midpoint;
    bench_tridlt_f32 bench_tridlt_f64: triangulate_dlt;
}

unsafe fn relpose_5pt<T: Real>(a: *const T, b: *const T, out: *mut T) -> i32 {
    // SAFETY: five bearings each, at most ten solutions.
    unsafe { put(out, solvers::relpose_5pt(vectors(a), vectors(b)).into_iter().map(|e| e.0)) }
}

unsafe fn relpose_5pt_poses<T: Real>(a: *const T, b: *const T, out: *mut T) -> i32 {
    // SAFETY: five bearings each, at most ten solutions.
    unsafe { put_poses(out, solvers::relpose_5pt_poses(vectors(a), vectors(b))) }
}

unsafe fn relpose_7pt<T: Real>(a: *const T, b: *const T, out: *mut T) -> i32 {
    // SAFETY: seven bearings each, at most three solutions.
    unsafe { put(out, solvers::relpose_7pt(vectors(a), vectors(b)).into_iter().map(|f| f.0)) }
}

unsafe fn relpose_8pt<T: Real, const N: usize>(a: *const T, b: *const T, out: *mut T) -> i32 {
    // SAFETY: N bearings each, at most one solution.
    unsafe {
        let e = solvers::relpose_8pt(vectors::<T, N>(a), vectors::<T, N>(b));
        put(out, e.ok().flatten().map(|e| e.0))
    }
}

unsafe fn relpose_8pt_of_8<T: Real>(a: *const T, b: *const T, out: *mut T) -> i32 {
    // SAFETY: passed on to the caller.
    unsafe { relpose_8pt::<T, 8>(a, b, out) }
}

unsafe fn relpose_8pt_of_20<T: Real>(a: *const T, b: *const T, out: *mut T) -> i32 {
    // SAFETY: passed on to the caller.
    unsafe { relpose_8pt::<T, 20>(a, b, out) }
}

unsafe fn homography_4pt<T: Real>(a: *const T, b: *const T, out: *mut T) -> i32 {
    // SAFETY: four bearings each, at most one solution.
    unsafe { put(out, solvers::homography_4pt(vectors(a), vectors(b)).map(|h| h.0)) }
}

/// An essential matrix, row-major, and five bearings of each view, to the pose that has all of them in front.
unsafe fn pose_by_cheirality<T: Real>(a: *const T, b: *const T, out: *mut T) -> i32 {
    // SAFETY: as the caller promises.
    let (e, x1, x2) =
        unsafe { (slice::from_raw_parts(a, 9), vectors::<T, 5>(b), vectors::<T, 5>(b.add(15))) };
    let e = Essential(Matrix3::from_row_slice(e));
    let pose = e.pose_by_cheirality(x1, x2).filter(|p| p.in_front == 5).map(|p| p.pose);
    // SAFETY: at most one pose.
    unsafe { put_poses(out, pose) }
}

/// A bearing of each view, and R row-major with t, to the point in the frame of view 1.
///
/// # Safety
/// As of the exported functions.
unsafe fn triangulate<T: Real>(
    a: *const T,
    b: *const T,
    out: *mut T,
    method: impl FnOnce(&ViewPair<T>, &Vector3<T>, &Vector3<T>) -> Triangulation<T>,
) -> i32 {
    // SAFETY: as the caller promises.
    let ([x1, x2], pose) = unsafe { (vectors(a), slice::from_raw_parts(b, 12)) };
    let t = Vector3::new(pose[9], pose[10], pose[11]);
    let views = ViewPair::from_parts(&Matrix3::from_row_slice(&pose[..9]), &t);
    let (Triangulation::Point(point) | Triangulation::Behind { point, .. }) = method(&views, x1, x2) else {
        return 0;
    };
    for (k, v) in point.iter().enumerate() {
        // SAFETY: room for one point.
        unsafe { *out.add(k) = *v };
    }
    1
}

unsafe fn triangulate_midpoint<T: Real>(a: *const T, b: *const T, out: *mut T) -> i32 {
    // SAFETY: two bearings, a pose, a point.
    unsafe { triangulate(a, b, out, ViewPair::triangulate_midpoint) }
}

unsafe fn triangulate_dlt<T: Real>(a: *const T, b: *const T, out: *mut T) -> i32 {
    // SAFETY: two bearings, a pose, a point.
    unsafe { triangulate(a, b, out, ViewPair::triangulate_dlt) }
}
