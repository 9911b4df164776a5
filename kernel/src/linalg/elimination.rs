//! Rows that are one short of a basis, by elimination: their null vector, and a vector of given products with them.

use crate::Real;
use crate::real::abs;

/// `A P = L U` of `M` rows of length `N = M + 1`: `U` has ones on its diagonal and none larger behind them, `P` brings
/// the largest that is left of each row to the front of it.
///
/// Fewer than half of the operations of reflections, for errors that a step of refinement takes away where its residuals
/// have more digits than the rows.
pub(crate) struct Elimination<T, const M: usize, const N: usize> {
    /// The columns of `A`, and after [`Self::factor`] `L` below the diagonal, the reciprocals of its pivots on it, `U` above.
    pub(crate) columns: [[T; M]; N],
    /// Which column of `A` stands in each place.
    order: [usize; N],
}

impl<T: Real, const M: usize, const N: usize> Elimination<T, M, N> {
    #[inline]
    pub(crate) fn new() -> Self {
        const { assert!(M + 1 == N) };
        Self { columns: [[T::ZERO; M]; N], order: core::array::from_fn(|i| i) }
    }

    /// False where all that is left of a row is `floor` or less, or is not finite.
    #[inline]
    pub(crate) fn factor(&mut self, floor: T) -> bool {
        for k in 0..M {
            let (mut best, mut largest) = (k, abs(self.columns[k][k]));
            for j in k + 1..N {
                let size = abs(self.columns[j][k]);
                best = if size > largest { j } else { best };
                largest = if size > largest { size } else { largest };
            }
            if !(largest > floor && largest <= T::MAX) {
                return false;
            }
            // An error where both are the same.
            if let Ok([a, b]) = self.columns.get_disjoint_mut([k, best]) {
                core::mem::swap(a, b);
            }
            if let Ok([a, b]) = self.order.get_disjoint_mut([k, best]) {
                core::mem::swap(a, b);
            }
            let inverse = T::ONE / self.columns[k][k];
            self.columns[k][k] = inverse;
            // Zeros instead of a shorter column: the loop over its elements has no count.
            let mut lower = self.columns[k];
            for i in 0..M {
                lower[i] = if i > k { lower[i] } else { T::ZERO };
            }
            for column in self.columns.iter_mut().skip(k + 1) {
                let factor = column[k] * inverse;
                for i in 0..M {
                    column[i] -= factor * lower[i];
                }
                column[k] = factor;
            }
        }
        true
    }

    /// A vector that every row is orthogonal to, of largest element 1 or a little more.
    #[inline]
    pub(crate) fn null_vector(&self) -> [T; N] {
        self.back([T::ZERO; M], T::ONE)
    }

    /// A vector whose products with the rows are `products`.
    #[inline]
    pub(crate) fn solve(&self, mut products: [T; M]) -> [T; N] {
        for k in 0..M {
            let y = products[k] * self.columns[k][k];
            products[k] = y;
            for i in k + 1..M {
                products[i] -= self.columns[k][i] * y;
            }
        }
        self.back(products, T::ZERO)
    }

    /// `x` of `U P' x = y`, the element of the last place given.
    #[inline]
    fn back(&self, mut y: [T; M], last: T) -> [T; N] {
        let mut result = [T::ZERO; N];
        for j in (0..N).rev() {
            let value = if j < M { y[j] } else { last };
            for i in 0..j {
                y[i] -= self.columns[j][i] * value;
            }
            if let Some(place) = result.get_mut(self.order[j]) {
                *place = value;
            }
        }
        result
    }
}
