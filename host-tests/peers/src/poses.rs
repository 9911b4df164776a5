//! The minimal solvers of absolute and upright pose: `bench_p3p_*`, `bench_up3pt_*`.

use core::slice;

use epipole::Real;
use epipole::geometry::Pose;
use epipole::nalgebra::Vector3;
use epipole::solvers;

/// The first `N` vectors of an array of rows, where they lie.
///
/// # Safety
/// `p` points to `3 * N` numbers that live as long as the result.
pub(crate) unsafe fn vectors<'a, T: Real, const N: usize>(p: *const T) -> &'a [Vector3<T>; N] {
    // SAFETY: a vector is its three numbers, one after the other, and nothing else.
    unsafe { &*p.cast() }
}

/// Writes R row-major, then t.
pub(crate) fn write_pose<T: Real>(pose: &Pose<T>, out: &mut [T]) {
    let Some(out) = out.first_chunk_mut::<12>() else { return };
    let (r, t) = (pose.rotation.to_rotation_matrix().into_inner(), pose.translation.vector);
    *out = [r.m11, r.m12, r.m13, r.m21, r.m22, r.m23, r.m31, r.m32, r.m33, t.x, t.y, t.z];
}

/// Writes poses one after the other; how many there were.
///
/// # Safety
/// `out` has room for 12 numbers a pose.
unsafe fn write_poses<T: Real>(poses: &[Pose<T>], out: *mut T) -> i32 {
    let out = unsafe { slice::from_raw_parts_mut(out, 12 * poses.len()) };
    for (pose, out) in poses.iter().zip(out.chunks_exact_mut(12)) {
        write_pose(pose, out);
    }
    poses.len() as i32
}

macro_rules! export {
    ($($name:ident, $t:ty, $solver:path;)*) => {$(
        /// # Safety
        /// `a` and `b` point to 3x3 numbers, `out` to room for four poses of 12.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(a: *const $t, b: *const $t, out: *mut $t) -> i32 {
            unsafe { write_poses(&$solver(vectors(a), vectors(b)), out) }
        }
    )*};
}

export! {
    bench_p3p_f64, f64, solvers::p3p;
    bench_p3p_f32, f32, solvers::p3p;
    bench_up3pt_f64, f64, solvers::relpose_upright_3pt;
    bench_up3pt_f32, f32, solvers::relpose_upright_3pt;
}
