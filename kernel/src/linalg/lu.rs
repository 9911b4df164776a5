//! LU factors of a small square matrix, with row exchanges.

use nalgebra::SMatrix;

use crate::Real;
use crate::real::{abs, from_u32};

/// `P A = L U` of a square matrix: `L` unit lower triangular, `U` upper triangular, `P` the row exchanges of partial
/// pivoting.
///
/// ```
/// use epipole::linalg::Lu;
/// use epipole::nalgebra::{Matrix3, Vector3};
/// let a = Matrix3::new(0.0, 2.0, 1.0, 1.0, 1.0, 0.0, 3.0, 0.0, -1.0);
/// let lu = Lu::new(&a).unwrap();
/// let x = lu.solve(&Vector3::new(3.0, 2.0, 2.0));
/// assert!((a * x - Vector3::new(3.0, 2.0, 2.0)).norm_squared() < 1e-28);
/// ```
///
/// # References
/// G. H. Golub and C. F. Van Loan, "Matrix Computations", 4th edition, 2013, section 3.4.
#[derive(Clone, Copy, Debug)]
pub struct Lu<T, const N: usize> {
    /// Rows: `U` on and above the diagonal, `L` below it.
    rows: [[T; N]; N],
    /// Which row of `A` stands in each row of `L U`.
    order: [usize; N],
    odd: bool,
}

impl<T: Real, const N: usize> Lu<T, N> {
    /// The factors of `a`; `None` where `a` is singular to working precision (a pivot is not larger than
    /// `N EPSILON` times the largest element) or holds a NaN or an infinity.
    ///
    /// A singular matrix may pass where its leading blocks are ill-conditioned: rounding then leaves a larger pivot.
    ///
    /// # Accuracy
    /// Backward stable in practice: the relative residual of a solution is a few `EPSILON`.
    ///
    /// # Cost
    /// N^3 / 3 multiplications, N divisions.
    #[must_use]
    pub fn new(a: &SMatrix<T, N, N>) -> Option<Self> {
        let mut rows = a.transpose().data.0;
        let mut order = [0; N];
        for (i, place) in order.iter_mut().enumerate() {
            *place = i;
        }
        let mut odd = false;
        let largest = super::largest_magnitude(rows.iter().flatten())?;
        let floor = from_u32::<T>(N as u32) * T::EPSILON * largest;
        for k in 0..N {
            // The largest of the column rises to row k by exchanges: no index is known only at run time.
            for i in k + 1..N {
                if abs(rows[i][k]) > abs(rows[k][k]) {
                    for j in 0..N {
                        (rows[i][j], rows[k][j]) = (rows[k][j], rows[i][j]);
                    }
                    order.swap(i, k);
                    odd = !odd;
                }
            }
            let pivot = rows[k][k];
            // Written so that NaN and infinity, by overflow, fail too.
            if !(abs(pivot) > floor && abs(pivot) <= T::MAX) {
                return None;
            }
            let inverse = T::ONE / pivot;
            let upper = rows[k];
            for row in rows.iter_mut().skip(k + 1) {
                let factor = row[k] * inverse;
                row[k] = factor;
                for j in k + 1..N {
                    row[j] -= factor * upper[j];
                }
            }
        }
        Some(Self { rows, order, odd })
    }

    /// `A^-1 B`, by substitution.
    ///
    /// # Cost
    /// N^2 multiplications and N divisions a column of B.
    #[must_use]
    pub fn solve<const M: usize>(&self, b: &SMatrix<T, N, M>) -> SMatrix<T, N, M> {
        let mut result = *b;
        for (x, rhs) in result.data.0.iter_mut().zip(&b.data.0) {
            for i in 0..N {
                let mut sum = rhs.get(self.order[i]).copied().unwrap_or(T::ZERO);
                for j in 0..i {
                    sum -= self.rows[i][j] * x[j];
                }
                x[i] = sum;
            }
            for i in (0..N).rev() {
                let mut sum = x[i];
                for j in i + 1..N {
                    sum -= self.rows[i][j] * x[j];
                }
                x[i] = sum / self.rows[i][i];
            }
        }
        result
    }

    /// `A^-1`.
    ///
    /// # Cost
    /// N^3 multiplications. To apply it once, [`Self::solve`] is cheaper and more accurate.
    #[must_use]
    pub fn inverse(&self) -> SMatrix<T, N, N> {
        self.solve(&super::identity())
    }

    /// The determinant of `A`.
    #[must_use]
    pub fn determinant(&self) -> T {
        let sign = if self.odd { -T::ONE } else { T::ONE };
        self.rows.iter().enumerate().fold(sign, |product, (i, row)| product * row[i])
    }
}
