//! L D L' factors of a small symmetric positive definite matrix.

use nalgebra::{SMatrix, SVector};

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
        let mut factors = Self { lower: [[T::ZERO; N]; N], inverse_d: [T::ZERO; N] };
        let Self { lower, inverse_d } = &mut factors;
        factor(a.data.0.as_flattened(), T::ZERO, lower.as_flattened_mut(), inverse_d)?;
        Some(factors)
    }

    /// `A^-1 B`, by substitution.
    ///
    /// # Cost
    /// N^2 multiplications a column of B, no division.
    #[must_use]
    pub fn solve<const M: usize>(&self, b: &SMatrix<T, N, M>) -> SMatrix<T, N, M> {
        let mut result = *b;
        for x in &mut result.data.0 {
            let _ = substitute(self.lower.as_flattened(), &self.inverse_d, x);
        }
        result
    }

    /// `A^-1`, symmetric to the bit.
    ///
    /// # Cost
    /// 3 N^3 / 2 multiplications.
    #[must_use]
    pub fn inverse(&self) -> SMatrix<T, N, N> {
        let mut columns = [[T::ZERO; N]; N];
        let mut result = SMatrix::<T, N, N>::zeros();
        let inverse = result.data.0.as_flattened_mut();
        let _ = invert(self.lower.as_flattened(), &self.inverse_d, columns.as_flattened_mut(), inverse);
        result
    }
}

// The work is done on slices, by functions that small code holds once for every N. Where N is known, no check is left.

/// The largest matrix there is room for: one function serves all.
const LARGEST: usize = 8;

/// The step `x = -A^-1 g` of a damped hessian, and by how much it promises to lower the cost; none where a direction is open.
pub(crate) fn damped_step<T: Real, const N: usize>(
    a: &SMatrix<T, N, N>,
    g: &SVector<T, N>,
    damping: T,
) -> Option<(SVector<T, N>, T)> {
    const { assert!(N <= LARGEST) };
    let mut x = *g;
    let promise = descend(a.data.0.as_flattened(), &g.data.0[0], damping, &mut x.data.0[0])?;
    Some((x, promise))
}

/// `scale A^-1`, symmetric to the bit; none where a direction is open.
pub(crate) fn scaled_inverse<T: Real, const N: usize>(
    a: &SMatrix<T, N, N>,
    scale: T,
) -> Option<SMatrix<T, N, N>> {
    const { assert!(N <= LARGEST) };
    let mut inverse = *a;
    scale_inverse(inverse.data.0.as_flattened_mut(), N, scale)?;
    Some(inverse)
}

#[cfg_attr(small, inline(never))]
#[cfg_attr(not(small), inline(always))]
fn scale_inverse<T: Real>(a: &mut [T], n: usize, scale: T) -> Option<()> {
    let (mut lower, mut columns, mut inverse_d) =
        ([T::ZERO; LARGEST * LARGEST], [T::ZERO; LARGEST * LARGEST], [T::ZERO; LARGEST]);
    let inverse_d = inverse_d.get_mut(..n)?;
    factor(a, T::ZERO, &mut lower, inverse_d)?;
    invert(&lower, inverse_d, &mut columns, a)?;
    a.iter_mut().for_each(|x| *x *= scale);
    Some(())
}

#[cfg_attr(small, inline(never))]
#[cfg_attr(not(small), inline(always))]
fn descend<T: Real>(a: &[T], g: &[T], damping: T, x: &mut [T]) -> Option<T> {
    let (mut lower, mut inverse_d) = ([T::ZERO; LARGEST * LARGEST], [T::ZERO; LARGEST]);
    let inverse_d = inverse_d.get_mut(..x.len())?;
    factor(a, damping, &mut lower, inverse_d)?;
    substitute(&lower, inverse_d, x)?;
    let mut promise = T::ZERO;
    for (x, g) in x.iter_mut().zip(g) {
        promise += *x * *g;
        *x = -*x;
    }
    Some(promise)
}

/// Row by row `L` and 1 / D of a matrix whose diagonal elements are larger by the share `damping`; none where
/// it is not positive definite.
#[cfg_attr(small, inline(never))]
#[cfg_attr(not(small), inline(always))]
fn factor<T: Real>(a: &[T], damping: T, lower: &mut [T], inverse_d: &mut [T]) -> Option<()> {
    let n = inverse_d.len();
    let floor = from_u32::<T>(n as u32) * T::EPSILON;
    for i in 0..n {
        // Row i of L D first (by forward substitution), of L after the division by D.
        let (above, row) = lower.split_at_mut_checked(i * n)?;
        for j in 0..i {
            let mut sum = *a.get(j * n + i)?;
            for (x, y) in row.iter().zip(above.get(j * n..)?).take(j) {
                sum -= *x * *y;
            }
            *row.get_mut(j)? = sum;
        }
        let diagonal = *a.get(i * n + i)?;
        let diagonal = diagonal + damping * diagonal;
        let mut pivot = diagonal;
        for (x, inverse) in row.iter_mut().zip(&*inverse_d).take(i) {
            let scaled = *x * *inverse;
            pivot -= scaled * *x;
            *x = scaled;
        }
        // Written so that NaN and infinity fail too.
        if !(pivot > floor * diagonal && pivot > T::ZERO && pivot <= T::MAX) {
            return None;
        }
        *inverse_d.get_mut(i)? = T::ONE / pivot;
    }
    Some(())
}

/// `x <- A^-1 x`.
#[cfg_attr(small, inline(never))]
#[cfg_attr(not(small), inline(always))]
fn substitute<T: Real>(lower: &[T], inverse_d: &[T], x: &mut [T]) -> Option<()> {
    let n = inverse_d.len();
    forward(lower, x)?;
    for i in (0..n).rev() {
        let (before, after) = x.split_at_mut_checked(i + 1)?;
        let target = before.last_mut()?;
        *target *= *inverse_d.get(i)?;
        for (k, y) in after.iter().enumerate() {
            *target -= *lower.get((i + 1 + k) * n + i)? * *y;
        }
    }
    Some(())
}

/// `x <- L^-1 x`.
#[cfg_attr(small, inline(never))]
#[cfg_attr(not(small), inline(always))]
fn forward<T: Real>(lower: &[T], x: &mut [T]) -> Option<()> {
    let n = x.len();
    for i in 0..n {
        let (before, rest) = x.split_at_mut_checked(i)?;
        let target = rest.first_mut()?;
        for (l, y) in lower.get(i * n..)?.iter().zip(before) {
            *target -= *l * *y;
        }
    }
    Some(())
}

/// `A^-1` from the columns of `L^-1`, for which there is memory: `L^-T D^-1 L^-1`.
#[cfg_attr(small, inline(never))]
#[cfg_attr(not(small), inline(always))]
fn invert<T: Real>(lower: &[T], inverse_d: &[T], columns: &mut [T], inverse: &mut [T]) -> Option<()> {
    let n = inverse_d.len();
    for c in 0..n {
        let column = columns.get_mut(c * n..c * n + n)?;
        *column.get_mut(c)? = T::ONE;
        forward(lower, column)?;
    }
    for i in 0..n {
        for j in 0..=i {
            let mut sum = T::ZERO;
            // What lies above the diagonal is zero.
            for ((x, y), d) in columns.get(i * n..)?.iter().zip(columns.get(j * n..)?).zip(inverse_d) {
                sum += *x * *y * *d;
            }
            *inverse.get_mut(i * n + j)? = sum;
            *inverse.get_mut(j * n + i)? = sum;
        }
    }
    Some(())
}
