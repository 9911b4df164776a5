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

    /// A vector that every row is orthogonal to: its last place is 1, and none exceeds `2^(M-1)` (of correspondences
    /// hardly 3).
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

#[cfg(test)]
mod tests {
    use super::*;

    fn of(rows: [[f64; 4]; 3]) -> Elimination<f64, 3, 4> {
        let mut result = Elimination::new();
        result.columns = core::array::from_fn(|j| core::array::from_fn(|i| rows[i][j]));
        result
    }

    fn products(rows: &[[f64; 4]; 3], x: &[f64; 4]) -> [f64; 3] {
        rows.map(|row| row.iter().zip(x).map(|(a, b)| a * b).sum())
    }

    #[test]
    fn a_null_vector_and_given_products() {
        // The largest elements stand in the last and the first column, and zeros where pivots would be without exchange.
        let rows = [[0.0, 1.0, -2.0, 5.0], [3.0, 0.0, 0.5, 7.0], [9.0, -1.0, 0.0, 2.0]];
        let mut equations = of(rows);
        assert!(equations.factor(1e-12));
        let null = equations.null_vector();
        assert!(null.contains(&1.0) && null.iter().all(|x| x.abs() <= 4.0));
        assert!(products(&rows, &null).iter().all(|x| x.abs() < 1e-14), "{null:?}");
        let wanted = [0.3, -4.0, 2.0];
        let found = products(&rows, &equations.solve(wanted));
        assert!(found.iter().zip(&wanted).all(|(a, b)| (a - b).abs() < 1e-14), "{found:?}");
    }

    #[test]
    fn no_factors_of_dependent_rows_or_what_is_not_finite() {
        let rows = [[1.0, 2.0, 3.0, 4.0], [0.0, 1.0, -1.0, 2.0], [2.0, 5.0, 5.0, 10.0]];
        assert!(!of(rows).factor(1e-14));
        assert!(!of([[0.0; 4]; 3]).factor(0.0));
        for bad in [f64::NAN, f64::INFINITY] {
            for at in 0..12 {
                let mut rows = [[1.0, 2.0, 3.0, 5.0], [0.0, 1.0, -1.0, 2.0], [2.0, 0.0, 5.0, 1.0]];
                rows[at / 4][at % 4] = bad;
                let mut equations = of(rows);
                assert!(!equations.factor(0.0) || !equations.null_vector().iter().all(|x| x.is_finite()));
            }
        }
    }
}
