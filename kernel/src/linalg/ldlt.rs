//! L D L' factors of a small symmetric positive definite matrix.

use nalgebra::SMatrix;

use crate::Real;
use crate::real::from_u32;

/// `A = L D L'` of a symmetric positive definite matrix: `L` unit lower triangular, `D` diagonal and positive. No square
/// root is taken, and the verdict does not depend on how the unknowns are scaled.
///
/// ```
/// use epipole::linalg::Ldlt;
/// use epipole::nalgebra::{Matrix2, Vector2};
/// let a = Matrix2::new(4.0_f32, 2.0, 2.0, 3.0);
/// assert_eq!(Ldlt::new(&a).unwrap().solve(&Vector2::new(8.0, 8.0)), Vector2::new(1.0, 2.0));
/// assert!(Ldlt::new(&Matrix2::new(1.0_f32, 2.0, 2.0, 1.0)).is_none());
/// ```
///
/// # References
/// G. H. Golub and C. F. Van Loan, "Matrix Computations", 4th edition, 2013, section 4.1.
#[derive(Clone, Copy, Debug)]
pub struct Ldlt<T, const N: usize> {
    /// Row i: `L` up to column i - 1. The rest is not used.
    lower: [[T; N]; N],
    /// 1 / D.
    inverse_d: [T; N],
}

impl<T: Real, const N: usize> Ldlt<T, N> {
    /// The factors of `a`, of which the lower triangle alone is read; `None` where `a` is not positive definite to
    /// working precision (a pivot is not larger than `N EPSILON` times its diagonal element) or holds a NaN or an
    /// infinity.
    ///
    /// A singular matrix may pass where its leading blocks are ill-conditioned: rounding then leaves a larger pivot.
    ///
    /// # Accuracy
    /// Backward stable.
    ///
    /// # Cost
    /// N^3 / 6 multiplications, N divisions.
    #[must_use]
    pub fn new(a: &SMatrix<T, N, N>) -> Option<Self> {
        let mut lower = [[T::ZERO; N]; N];
        let mut inverse_d = [T::ZERO; N];
        let floor = from_u32::<T>(N as u32) * T::EPSILON;
        for i in 0..N {
            // Row i of L D first (by forward substitution), of L after the division by D.
            let mut row = [T::ZERO; N];
            for j in 0..i {
                let mut sum = a.data.0[j][i];
                for k in 0..j {
                    sum -= row[k] * lower[j][k];
                }
                row[j] = sum;
            }
            let diagonal = a.data.0[i][i];
            let mut pivot = diagonal;
            for j in 0..i {
                let scaled = row[j] * inverse_d[j];
                pivot -= scaled * row[j];
                row[j] = scaled;
            }
            // Written so that NaN and infinity fail too.
            if !(pivot > floor * diagonal && pivot > T::ZERO && pivot <= T::MAX) {
                return None;
            }
            inverse_d[i] = T::ONE / pivot;
            lower[i] = row;
        }
        Some(Self { lower, inverse_d })
    }

    /// `A^-1 B`, by substitution.
    ///
    /// # Cost
    /// N^2 multiplications a column of B, no division.
    #[must_use]
    pub fn solve<const M: usize>(&self, b: &SMatrix<T, N, M>) -> SMatrix<T, N, M> {
        let mut result = *b;
        for x in &mut result.data.0 {
            for i in 0..N {
                let mut sum = x[i];
                for j in 0..i {
                    sum -= self.lower[i][j] * x[j];
                }
                x[i] = sum;
            }
            for i in (0..N).rev() {
                let mut sum = x[i] * self.inverse_d[i];
                for j in i + 1..N {
                    sum -= self.lower[j][i] * x[j];
                }
                x[i] = sum;
            }
        }
        result
    }

    /// `A^-1`, symmetric to the bit.
    ///
    /// # Cost
    /// About N^3 / 2 multiplications.
    #[must_use]
    pub fn inverse(&self) -> SMatrix<T, N, N> {
        // Columns of L^-1, then A^-1 = L^-T D^-1 L^-1.
        let mut columns = [[T::ZERO; N]; N];
        for c in 0..N {
            columns[c][c] = T::ONE;
            for i in c + 1..N {
                let mut sum = T::ZERO;
                for j in c..i {
                    sum -= self.lower[i][j] * columns[c][j];
                }
                columns[c][i] = sum;
            }
        }
        let mut result = super::identity();
        for i in 0..N {
            for j in 0..=i {
                let mut sum = T::ZERO;
                for k in i..N {
                    sum += columns[i][k] * columns[j][k] * self.inverse_d[k];
                }
                result.data.0[i][j] = sum;
                result.data.0[j][i] = sum;
            }
        }
        result
    }
}
