//! Small fixed-size linear algebra without panic paths or unbounded loops.

use nalgebra::SMatrix;

use crate::Real;
use crate::real::{abs, is_finite, max};

pub(crate) mod batch;
pub(crate) mod conic;
mod cubic;
mod eigen;
mod lanes;
mod ldlt;
mod least_singular3;
mod lu;
mod null_space;
pub mod poly;
mod quartic;
mod row_qr;
mod svd3;

pub use cubic::{cubic_roots, quadratic_roots};
pub use eigen::{SymmetricEigen, symmetric_eigen};
pub use lanes::{LANES, Lanes};
pub use ldlt::Ldlt;
pub(crate) use least_singular3::least_singular3;
pub use lu::Lu;
pub use null_space::{null_space, null_space_refined};
pub use quartic::quartic_roots;
pub use row_qr::{LeastSingular, RowQr};
pub use svd3::{Svd3, svd3};

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
