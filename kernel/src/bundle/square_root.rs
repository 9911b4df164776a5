//! The window's problem in square-root form: constraints and points folded into one triangular factor over the frames.
//! Marginalisation and covariances are read off it.

use super::memory::{FrameSlot, NO_SLOT, ObservationSlot, PointSlot, system_len};
use super::qr::{insert, packed_len, rotate, row_scale};
use super::residual::rows;
use crate::Real;
use crate::real::sqrt;
use crate::robust::loss::Loss;

/// A packed factor over the frames' column blocks in the memory of the linear system, and a point's rows above it.
pub(super) struct SquareRoot<'a, T> {
    /// Unknowns of the frames.
    pub(super) n: usize,
    pub(super) factor: &'a mut [T],
    /// The point's three rows: its own columns first, then the frames', then the right-hand side.
    pub(super) lead: [&'a mut [T]; 3],
    row: &'a mut [T],
    /// A row of the constraints.
    pub(super) constraint: &'a mut [T],
    pub(super) prior: &'a mut [T],
}

impl<'a, T: Real> SquareRoot<'a, T> {
    /// An empty factor over `used` column blocks in the scalars of a window with the capacity `frames`.
    pub(super) fn of(scalars: &'a mut [T], frames: usize, used: usize) -> Option<Self> {
        let n = 6 * used;
        let (system, prior) = scalars.split_at_mut_checked(system_len(frames))?;
        let (factor, vectors) = system.split_at_mut_checked(18 * frames * (frames + 1))?;
        // The factor is shorter than the triangle of blocks by more than a row of the constraints.
        let (factor, rest) = factor.split_at_mut_checked(packed_len(n))?;
        let (constraint, _) = rest.split_at_mut_checked(n)?;
        let (row, vectors) = vectors.split_at_mut_checked(n + 4)?;
        let (a, vectors) = vectors.split_at_mut_checked(n + 4)?;
        let (b, vectors) = vectors.split_at_mut_checked(n + 4)?;
        let (c, _) = vectors.split_at_mut_checked(n + 4)?;
        factor.fill(T::ZERO);
        Some(Self { n, factor, lead: [a, b, c], row, constraint, prior })
    }

    /// Folds in a row of the constraints, with its residual.
    pub(super) fn insert_row(&mut self, j: &[T], r: T) {
        let Some((_, row)) = self.row.split_at_mut_checked(3) else { return };
        for (to, &from) in row.iter_mut().zip(j.iter().chain(core::iter::once(&r))) {
            *to = from;
        }
        let scale = row_scale(j);
        insert(self.factor, self.n, row, scale);
    }

    /// Folds in those observations of a point that enter, given those that stay. Afterwards `lead` holds the rows that
    /// determine the point itself: leaving them aside marginalises it.
    pub(super) fn insert_point(
        &mut self,
        frames: &[FrameSlot<T>],
        point: &PointSlot<T>,
        group: &[ObservationSlot<T>],
        loss: &Loss<T>,
        enters: impl Fn(&ObservationSlot<T>) -> bool,
    ) {
        for lead in &mut self.lead {
            lead.fill(T::ZERO);
        }
        // Those that stay come first: what they say of the point is what the others are compared with.
        let (staying, entering) = (group.iter().filter(|o| !enters(o)), group.iter().filter(|o| enters(o)));
        for o in staying.chain(entering) {
            let enters = enters(o);
            let Some(frame) = frames.get(o.frame as usize) else { continue };
            let Some(camera) = &frame.camera else { continue };
            let Some(l) = rows(camera, &frame.pose, &point.position, o, loss) else { continue };
            for k in 0..2 {
                self.row.fill(T::ZERO);
                if let Some(last) = self.row.get_mut(self.n + 3) {
                    *last = l.r[k];
                }
                let Some((own, others)) = self.row.split_at_mut_checked(3) else { return };
                if !point.fixed {
                    for (to, &from) in own.iter_mut().zip(&l.point[k]) {
                        *to = from;
                    }
                }
                if let Some(block) = others.as_chunks_mut::<6>().0.get_mut(frame.slot as usize)
                    && frame.slot != NO_SLOT
                {
                    let ([a, b, c], [d, e, f]) = (l.turn[k], l.shift[k]);
                    *block = [a, b, c, d, e, f];
                }
                let jacobian = self.row.split_last().map_or(&[][..], |(_, j)| j);
                self.fold_row(row_scale(jacobian), enters);
            }
        }
    }

    fn fold_row(&mut self, scale: T, enters: bool) {
        let mut row = &mut *self.row;
        for (k, lead) in self.lead.iter_mut().enumerate() {
            let Some((_, lead)) = lead.split_at_mut_checked(k) else { return };
            rotate(lead, row, scale * T::EPSILON);
            let Some((_, shorter)) = row.split_first_mut() else { return };
            row = shorter;
        }
        if enters {
            insert(self.factor, self.n, row, scale);
        }
    }

    /// `t` becomes `t R^-1` for a row `t` over the frames. False where an unknown of the frames is not determined.
    pub(super) fn solve_row(factor: &[T], n: usize, t: &mut [T], floor: T) -> bool {
        let mut t = t;
        for row in super::qr::packed_rows(factor, n) {
            let Some((head, tail)) = t.split_first_mut() else { return false };
            let (Some(&pivot), Some(rest)) = (row.first(), row.get(1..)) else { return false };
            if *head != T::ZERO {
                if !(crate::real::abs(pivot) > floor) {
                    return false;
                }
                *head /= pivot;
                let x = *head;
                for (to, &r) in tail.iter_mut().zip(rest) {
                    *to -= x * r;
                }
            }
            t = tail;
        }
        true
    }

    /// The length of each of the last six columns.
    pub(super) fn last_columns(&self) -> [T; 6] {
        let mut squares = [T::ZERO; 6];
        for row in super::qr::packed_rows(self.factor, self.n) {
            // The last element is the right-hand side.
            for (square, &x) in squares.iter_mut().rev().zip(row.iter().rev().skip(1)) {
                *square += x * x;
            }
        }
        squares.map(sqrt)
    }
}
