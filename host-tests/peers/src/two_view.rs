//! Solvers of two views.

use epipole::Real;
use epipole::nalgebra::{Matrix3, Vector3};
#[cfg(not(feature = "wide"))]
use epipole::solvers::relpose_5pt;
#[cfg(feature = "wide")]
use epipole::solvers::relpose_5pt_wide;

use crate::symbols;

fn vectors<T: Real, const N: usize>(flat: &[T]) -> [Vector3<T>; N] {
    core::array::from_fn(|i| Vector3::new(flat[3 * i], flat[3 * i + 1], flat[3 * i + 2]))
}

fn row_major<T: Real>(m: &Matrix3<T>) -> [T; 9] {
    core::array::from_fn(|i| m[(i / 3, i % 3)])
}

#[cfg(not(feature = "wide"))]
symbols!(bench_5pt_f32, bench_5pt_f64, |a: 15, b: 15, out| {
    relpose_5pt(&vectors(a), &vectors(b)).iter().for_each(|e| out.push(row_major(&e.0)))
});
#[cfg(feature = "wide")]
symbols!(@one bench_5pt_f32, f32, a: 15, b: 15, out, {
    relpose_5pt_wide(&vectors(a), &vectors(b)).iter().for_each(|e| out.push(row_major(&e.0)))
});
