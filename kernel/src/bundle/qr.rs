//! The upper triangular factor of a least-squares problem, built up row by row with Givens rotations.
//!
//! Row `k` of a packed factor over `n` unknowns has the columns `k..n` and the right-hand side behind them. No square
//! of the Jacobian is formed, so `f32` keeps what a Hessian would lose. A row of zeros is an unknown that nothing has
//! determined yet: rank deficiency needs no special case.

use crate::Real;
use crate::real::{abs, lit, sqrt};

/// Numbers of a packed factor over `n` unknowns.
pub(super) const fn packed_len(n: usize) -> usize {
    n * (n + 1) / 2 + n
}

/// The rows of a packed factor.
pub(super) fn packed_rows<T>(factor: &[T], n: usize) -> impl Iterator<Item = &[T]> {
    let mut rest = factor;
    (0..n).map_while(move |k| {
        let (row, tail) = rest.split_at_checked(n - k + 1)?;
        rest = tail;
        Some(row)
    })
}

/// The rows of a packed factor, to write to.
pub(super) fn packed_rows_mut<T>(factor: &mut [T], n: usize) -> impl Iterator<Item = &mut [T]> {
    let mut rest = factor;
    (0..n).map_while(move |k| {
        let (row, tail) = core::mem::take(&mut rest).split_at_mut_checked(n - k + 1)?;
        rest = tail;
        Some(row)
    })
}

/// Folds one row (`n` columns and the right-hand side, from column `first` on) into a packed factor. `row` is used up;
/// what is left of it has zeros in all columns.
///
/// An element below rounding of the row it came with (`scale`) is taken for the zero it would be in exact arithmetic.
pub(super) fn insert<T: Real>(factor: &mut [T], n: usize, row: &mut [T], scale: T) {
    let floor = scale * T::EPSILON;
    let mut rest = factor;
    let mut row = row;
    for k in 0..n {
        let Some((head, tail)) = core::mem::take(&mut rest).split_at_mut_checked(n - k + 1) else { return };
        rest = tail;
        rotate(head, row, floor);
        let Some((_, shorter)) = core::mem::take(&mut row).split_first_mut() else { return };
        row = shorter;
    }
}

/// Turns `top` and `row` so that the first element of `row` becomes zero.
pub(super) fn rotate<T: Real>(top: &mut [T], row: &mut [T], floor: T) {
    let (Some(&a), Some(&b)) = (top.first(), row.first()) else { return };
    if !(abs(b) > floor) {
        return;
    }
    let r = sqrt(a * a + b * b);
    let (c, s) = (a / r, b / r);
    for (x, y) in top.iter_mut().zip(row.iter_mut()) {
        let (t, v) = (*x, *y);
        *x = c * t + s * v;
        *y = c * v - s * t;
    }
}

/// The rounding level of a row: its largest element.
pub(super) fn row_scale<T: Real>(row: &[T]) -> T {
    row.iter().fold(T::ZERO, |m, &x| if abs(x) > m { abs(x) } else { m })
}

/// A pivot below this share of its column's length says that the column depends on those before it.
pub(super) fn rank_tolerance<T: Real>(n: usize) -> T {
    T::EPSILON * lit::<T>(20.0) * crate::real::from_u32::<T>(n as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factor_reproduces_the_normal_matrix() {
        let a = [[1.0, 2.0, 3.0, 1.0], [4.0, -5.0, 6.0, 2.0], [7.0, 8.0, -9.0, 3.0], [0.5, 0.1, 2.0, 4.0f64]];
        let mut factor = [0.0; packed_len(3)];
        for row in a {
            insert(&mut factor, 3, &mut { row }, row_scale(&row));
        }
        let mut r = [[0.0; 4]; 3];
        for (k, packed) in packed_rows(&factor, 3).enumerate() {
            r[k][k..].copy_from_slice(packed);
        }
        for i in 0..3 {
            for j in 0..4 {
                let want: f64 = a.iter().map(|row| row[i] * row[j]).sum();
                let got: f64 = r.iter().map(|row| row[i] * row[j]).sum();
                assert!((want - got).abs() < 1e-12, "{i} {j}");
            }
        }
    }

    #[test]
    fn dependent_rows_leave_zeros() {
        let mut factor = [0.0f32; packed_len(3)];
        for k in 1..6 {
            let mut row = [k as f32, 2.0 * k as f32, 3.0 * k as f32, 0.5 * k as f32];
            let scale = row_scale(&row);
            insert(&mut factor, 3, &mut row, scale);
        }
        assert_eq!(&factor[4..], &[0.0; 5]);
    }
}
