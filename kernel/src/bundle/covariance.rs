//! Covariances of a frame and of a point, from the square root of the reduced system.

use nalgebra::{Matrix3, Matrix6};

use super::constraint::{self, At, to_pose_chart};
use super::memory::{FrameHandle, NO_SLOT, PointHandle};
use super::pass::Groups;
use super::qr::{packed_rows, rank_tolerance};
use super::square_root::SquareRoot;
use super::{BundleError, Window};
use crate::Real;
use crate::real::{abs, max, sqrt};
use crate::robust::loss::Loss;

/// What the window knows of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameCovariance<T: Real> {
    /// Of the pose: rotation (rad), then translation, of `R <- Exp(w) R`, `t <- t + dt`.
    pub pose: Matrix6<T>,
    /// Of the camera's centre in the world. Far from the world's origin it says more than the translation, which holds
    /// the rotation times the distance.
    pub centre: Matrix3<T>,
    /// Of the motion in the camera's own frame: rotation about its centre (rad), then the translation `v` of
    /// `centre <- centre - R' v`.
    pub motion: Matrix6<T>,
}

impl<T: Real> Window<'_, T> {
    /// The covariance of a frame, all other frames and points being unknown too (the marginal covariance), for
    /// observations whose noise is as told.
    ///
    /// # Input
    /// The window where it is, best after [`optimise`](Self::optimise). Fixed frames and points count as exact. `loss`
    /// weights the observations.
    ///
    /// # Errors
    /// [`BundleError::StaleFrame`]; [`BundleError::NothingFree`] for a fixed frame; [`BundleError::Unobservable`] where
    /// the window does not determine the frame: without two fixed frames, priors, or a fixed frame and a distance, none
    /// is determined.
    ///
    /// # Accuracy
    /// Through a triangular factor, not its square: `f32` gives 2 to 3 digits where the weakest direction is 1e4 times
    /// weaker than the strongest.
    ///
    /// # Cost
    /// Two rows of `6 n` unknowns for every observation of the window, `O(n^2)` each: several iterations' worth.
    ///
    /// # References
    /// M. Kaess, F. Dellaert, "Covariance recovery from a square root information matrix for data association", Robotics
    /// and Autonomous Systems 57(12), 2009.
    pub fn frame_covariance(
        &mut self,
        frame: FrameHandle,
        loss: &Loss<T>,
    ) -> Result<FrameCovariance<T>, BundleError> {
        let slot = self.frame(frame).map_err(|_| BundleError::StaleFrame)?;
        if slot.fixed {
            return Err(BundleError::NothingFree);
        }
        let (pose, rotation) = (slot.pose.pose(), slot.pose.rotation);
        let root = self.square_root(Some(frame.index), None, loss).ok_or(BundleError::Unobservable)?;
        let columns = root.last_columns();
        let mut r = [[T::ZERO; 6]; 6];
        let tolerance = rank_tolerance::<T>(root.n);
        for (i, (to, row)) in
            r.iter_mut().zip(packed_rows(root.factor, root.n).skip(root.n.saturating_sub(6))).enumerate()
        {
            for (x, &value) in to.iter_mut().skip(i).zip(row) {
                *x = value;
            }
            let determined = to.get(i).zip(columns.get(i)).is_some_and(|(&d, &c)| abs(d) > tolerance * c);
            if !determined {
                return Err(BundleError::Unobservable);
            }
        }
        let inverse = invert_upper(&r);
        let mut motion = Matrix6::zeros();
        for i in 0..6 {
            for j in 0..=i {
                let mut sum = T::ZERO;
                for k in i..6 {
                    sum += inverse[i][k] * inverse[j][k];
                }
                motion[(i, j)] = sum;
                motion[(j, i)] = sum;
            }
            // The deviation against what it would be were all else known: not more than rounding can tell.
            if !(sqrt(motion[(i, i)]) * columns[i] * tolerance < T::ONE) {
                return Err(BundleError::Unobservable);
            }
        }
        let turn = Matrix3::from_fn(|i, j| rotation[i][j]);
        let centre = turn.transpose() * motion.fixed_view::<3, 3>(3, 3) * turn;
        Ok(FrameCovariance { pose: to_pose_chart(&motion, &pose), centre, motion })
    }

    /// The covariance of a point's position, all frames and other points being unknown too.
    ///
    /// # Errors
    /// [`BundleError::StalePoint`]; [`BundleError::NothingFree`] for a fixed point; [`BundleError::Unobservable`] as in
    /// [`frame_covariance`](Self::frame_covariance), or for a point without parallax.
    ///
    /// # Cost
    /// As [`frame_covariance`](Self::frame_covariance).
    pub fn point_covariance(
        &mut self,
        point: PointHandle,
        loss: &Loss<T>,
    ) -> Result<Matrix3<T>, BundleError> {
        if self.point(point).map_err(|_| BundleError::StalePoint)?.fixed {
            return Err(BundleError::NothingFree);
        }
        let mut root = self.square_root(None, Some(point.index), loss).ok_or(BundleError::Unobservable)?;
        let n = root.n;
        let tolerance = rank_tolerance::<T>(n + 3);
        // The point's rows [P C] and the frames' factor R: cov = P^-1 (I + (C R^-1)(C R^-1)') P^-T.
        let mut p = [[T::ZERO; 3]; 3];
        let mut gram = [[T::ZERO; 3]; 3];
        let mut columns = [T::ZERO; 3];
        for (i, (to, lead)) in p.iter_mut().zip(root.lead.iter()).enumerate() {
            for ((x, &value), column) in to.iter_mut().zip(lead.iter()).zip(&mut columns).skip(i) {
                *x = value;
                *column += value * value;
            }
        }
        let mut largest = T::ZERO;
        for row in packed_rows(root.factor, n) {
            largest = max(largest, row.first().map_or(T::ZERO, |&x| abs(x)));
        }
        for lead in root.lead.iter_mut() {
            let Some((_, t)) = lead.split_at_mut_checked(3) else { return Err(BundleError::Unobservable) };
            if !SquareRoot::solve_row(root.factor, n, t, largest * tolerance) {
                return Err(BundleError::Unobservable);
            }
        }
        for i in 0..3 {
            if !(p[i][i] * p[i][i] > tolerance * tolerance * columns[i]) {
                return Err(BundleError::Unobservable);
            }
            for j in 0..3 {
                let mut sum = if i == j { T::ONE } else { T::ZERO };
                for (&a, &b) in root.lead[i].iter().skip(3).zip(root.lead[j].iter().skip(3)).take(n) {
                    sum += a * b;
                }
                gram[i][j] = sum;
            }
        }
        let inverse = Matrix3::from_fn(|i, j| invert_upper(&p)[i][j]);
        let covariance = inverse * Matrix3::from_fn(|i, j| gram[i][j]) * inverse.transpose();
        Ok((covariance + covariance.transpose()) * T::HALF)
    }

    /// The factor of the whole window, `last_frame`'s columns last; `last_point`'s rows stay in `lead`.
    fn square_root(
        &mut self,
        last_frame: Option<u16>,
        last_point: Option<u16>,
        loss: &Loss<T>,
    ) -> Option<SquareRoot<'_, T>> {
        let mut used = 0;
        for (i, frame) in (0u16..).zip(self.frames.iter_mut()) {
            frame.slot = NO_SLOT;
            if frame.is_live() && !frame.fixed && last_frame != Some(i) {
                frame.slot = used;
                used += 1;
            }
        }
        if let Some(frame) = self.frames.get_mut(last_frame.unwrap_or(NO_SLOT) as usize) {
            frame.slot = used;
            used += 1;
        }
        let live = self.observations.split_at_checked(self.header.observations)?.0;
        let mut root = SquareRoot::of(self.scalars, self.frames.len(), used as usize)?;
        let row = core::mem::take(&mut root.constraint);
        let prior = core::mem::take(&mut root.prior);
        constraint::rows(self.frames, prior, self.header.prior_frames, row, At::Current, None, |j, r| {
            root.insert_row(j, r);
        });
        let is_last = |i: usize| last_point.is_some_and(|p| p as usize == i);
        for (i, group) in Groups(live).filter(|(i, _)| !is_last(*i)) {
            if let Some(point) = self.points.get(i) {
                root.insert_point(self.frames, point, group, loss, |_| true);
            }
        }
        for (i, group) in Groups(live).filter(|(i, _)| is_last(*i)) {
            if let Some(point) = self.points.get(i) {
                root.insert_point(self.frames, point, group, loss, |_| true);
            }
        }
        Some(root)
    }
}

/// The inverse of an upper triangle.
fn invert_upper<T: Real, const N: usize>(r: &[[T; N]; N]) -> [[T; N]; N] {
    let mut inverse = [[T::ZERO; N]; N];
    for j in 0..N {
        inverse[j][j] = T::ONE / r[j][j];
        for i in (0..j).rev() {
            let mut sum = T::ZERO;
            for k in i + 1..=j {
                sum += r[i][k] * inverse[k][j];
            }
            inverse[i][j] = -sum / r[i][i];
        }
    }
    inverse
}
