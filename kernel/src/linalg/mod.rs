//! Small fixed-size linear algebra without panic paths or unbounded loops.

use nalgebra::{ArrayStorage, Matrix3, SMatrix, Vector3};

use crate::Real;
use crate::real::{abs, is_finite, max};

pub(crate) mod batch;
pub(crate) mod conic;
mod cubic;
mod eigen;
mod elimination;
mod lanes;
mod ldlt;
mod least_singular3;
mod lu;
mod null_space;
pub mod poly;
mod quartic;
mod row_qr;
mod svd3;
pub(crate) mod vec3;

pub use cubic::{cubic_roots, quadratic_roots};
pub use eigen::{SymmetricEigen, symmetric_eigen};
pub(crate) use elimination::Elimination;
pub use lanes::{LANES, Lanes};
pub use ldlt::Ldlt;
pub(crate) use ldlt::{damped_step, scaled_inverse};
pub(crate) use least_singular3::least_singular3;
pub use lu::Lu;
pub(crate) use null_space::null_space_of_columns;
pub use null_space::{null_space, null_space_refined};
pub use quartic::quartic_roots;
pub use row_qr::{LeastSingular, RowQr};
pub use svd3::{Svd3, svd3};

/// `A B`, by a call where code is to be small.
#[cfg_attr(not(small), inline(always))]
#[cfg_attr(small, inline(never))]
pub(crate) fn product<T: Real>(a: &Matrix3<T>, b: &Matrix3<T>) -> Matrix3<T> {
    let b = &b.data.0;
    let column = |j: usize| times(a, &Vector3::from(b[j])).data.0[0];
    Matrix3::from_data(ArrayStorage([column(0), column(1), column(2)]))
}

/// `A x`, by a call where code is to be small.
#[cfg_attr(not(small), inline(always))]
#[cfg_attr(small, inline(never))]
pub(crate) fn times<T: Real>(a: &Matrix3<T>, x: &Vector3<T>) -> Vector3<T> {
    let (a, x) = (&a.data.0, &x.data.0[0]);
    let row = |i: usize| a[0][i] * x[0] + a[1][i] * x[1] + a[2][i] * x[2];
    Vector3::new(row(0), row(1), row(2))
}

/// `A += s a b'`, by a call where code is to be small.
#[cfg_attr(not(small), inline(always))]
#[cfg_attr(small, inline(never))]
pub(crate) fn add_outer<T: Real>(sum: &mut Matrix3<T>, a: &Vector3<T>, b: &Vector3<T>, s: T) {
    for j in 0..3 {
        for i in 0..3 {
            sum.data.0[j][i] += a.data.0[0][i] * b.data.0[0][j] * s;
        }
    }
}

/// `[v]x A`: the cross products of a vector with the columns of a matrix.
#[cfg_attr(not(small), inline(always))]
#[cfg_attr(small, inline(never))]
pub(crate) fn cross<T: Real>(v: &Vector3<T>, a: &Matrix3<T>) -> Matrix3<T> {
    let mut result = *a;
    for column in &mut result.data.0 {
        *column = v.cross(&Vector3::from(*column)).data.0[0];
    }
    result
}

fn identity<T: Real, const N: usize>() -> SMatrix<T, N, N> {
    let mut result = SMatrix::zeros();
    for i in 0..N {
        result.data.0[i][i] = T::ONE;
    }
    result
}

/// The largest absolute value; `None` where one is NaN or infinite.
fn largest_magnitude<'a, T: Real>(elements: impl Iterator<Item = &'a T>) -> Option<T> {
    let mut largest = T::ZERO;
    for &x in elements {
        if !is_finite(x) {
            return None;
        }
        largest = max(abs(x), largest);
    }
    Some(largest)
}

/// A slice in pieces of `N`, the last of which may be shorter. `chunks` keeps `N` at run time, and with it the panic of a
/// division by zero where its iterator is not inlined.
#[inline]
pub(crate) fn pieces<X, const N: usize>(slice: &[X]) -> impl Iterator<Item = &[X]> {
    let (full, rest) = slice.as_chunks::<N>();
    full.iter().map(|piece| piece.as_slice()).chain((!rest.is_empty()).then_some(rest))
}
