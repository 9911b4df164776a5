//! Marginalisation: what a frame and its points said of the frames that remain, as a square root of information.

use super::constraint::{self, At};
use super::memory::{FrameHandle, FrameSlot, NO_SLOT, ObservationSlot, PointHandle};
use super::pass::Groups;
use super::square_root::SquareRoot;
use super::{Window, WindowError};
use crate::Real;
use crate::robust::loss::Loss;

/// What goes into the prior.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Leaving {
    /// A frame: its observations, its prior and its distances, then its pose is eliminated.
    Frame(u16),
    /// A point: all its observations.
    Point(u16),
    /// A frame without what it observed: it is eliminated from the prior that is there.
    FrameAlone(u16),
}

impl Leaving {
    fn takes<T: Real>(self, o: &ObservationSlot<T>) -> bool {
        match self {
            Self::Frame(frame) => o.frame == frame,
            Self::Point(point) => o.point == point,
            Self::FrameAlone(_) => false,
        }
    }

    fn frame(self) -> Option<u16> {
        match self {
            Self::Frame(frame) | Self::FrameAlone(frame) => Some(frame),
            Self::Point(_) => None,
        }
    }
}

impl<T: Real> Window<'_, T> {
    /// Takes a frame out of the window and leaves what it said about the other frames as a prior on them.
    ///
    /// The frame's observations enter the prior as what they add to the observations of the same points that stay:
    /// their prediction from those is compared with them, and the point is eliminated from the comparison. So the
    /// points live on with the rest of their observations, none counts twice, and of a point that no further frame
    /// observes, frame by frame exactly the whole goes into the prior (the chain rule of probability). A point that is
    /// observed again later is counted as a little less certain than it is. A point left without observations goes too,
    /// and its handle becomes stale.
    ///
    /// # Input
    /// Call it where the window is optimised: new rows are linearised where frames and points are, and the prior that
    /// was there is moved to the same place first (its cost and gradient exactly, its Jacobian by that of the chart), so
    /// that all of it has one linearisation point. `loss` gives each observation the weight with which it enters.
    ///
    /// The chart: one frame of the prior, the anchor, moves in the world, the others move beside it. Measurements
    /// between frames then say nothing of where the world is, wherever the window moves.
    ///
    /// # Returns
    /// The number of points that went.
    ///
    /// # Errors
    /// [`WindowError::StaleFrame`], [`WindowError::NoPriorMemory`].
    ///
    /// # Degeneracies
    /// A frame or direction that nothing determines leaves rows of zeros. Observations behind their camera count for
    /// nothing.
    ///
    /// # Accuracy
    /// The factor is triangularised by Givens rotations, never through its square: in `f32` the prior keeps directions
    /// that are 1e6 times weaker than the strongest, where a Hessian keeps 1e3.
    ///
    /// # Cost
    /// Two rows of up to `6 n` unknowns for every observation of the frame, `O(n^2)` each.
    ///
    /// # References
    /// M. Kaess, A. Ranganathan, F. Dellaert, "iSAM: incremental smoothing and mapping", IEEE Transactions on Robotics
    /// 24(6), 2008 (rows by Givens rotations). N. Demmel, D. Schubert, C. Sommer, D. Cremers, V. Usenko, "Square root
    /// marginalization for sliding-window bundle adjustment", ICCV 2021. Deviations, both measured on a synthetic
    /// flight of 60 frames, 8 in the window: they drop the frame's observations of points that live on, or end the
    /// points, which leaves
    /// 2.8 times the position error of full bundle adjustment against 1.1 times. Keeping the prior's first
    /// linearisation point instead of moving it makes the window inconsistent within 2,000 frames (normalised error
    /// squared of 4,500 a degree of freedom after 6,000 frames, against 0.7). Moving it in a chart of each frame by
    /// itself lets relative measurements pass, to second order, for knowledge of the heading: after 10,000 frames
    /// deviations were told a third too small and the error had grown to 8.8 m, against 1.9 m by the anchor
    /// (`bundle_flight long 10000 7`); the invariance is that of A. Barrau, S. Bonnabel, "The invariant extended Kalman
    /// filter as a stable observer", IEEE Transactions on Automatic Control 62(4), 2017. Over 300 frames and five other
    /// flights the position error is 0.98 times that of full bundle adjustment, 0.70 to 2.1 times in one
    /// (`bundle_flight 300 5 1 1000` in `host-tests`, 2026-11-26); letting a frame from the middle leave by turns made
    /// no difference (1.09).
    pub fn marginalise_frame(&mut self, frame: FrameHandle, loss: &Loss<T>) -> Result<usize, WindowError> {
        self.frame(frame)?;
        if !self.has_prior_memory() {
            return Err(WindowError::NoPriorMemory);
        }
        fold(self, Leaving::Frame(frame.index), loss).ok_or(WindowError::NoPriorMemory)?;
        let mut gone = 0;
        for point in (0u16..).take(self.points.len()) {
            if let [only] = self.group(point)
                && only.frame == frame.index
            {
                self.erase_point(point);
                gone += 1;
            }
        }
        self.erase_frame(frame.index);
        Ok(gone)
    }

    /// Takes a point out of the window and leaves what its observations said about the frames as a prior on them:
    /// exact, and a way to make room for other points.
    ///
    /// # Errors
    /// [`WindowError::StalePoint`], [`WindowError::NoPriorMemory`].
    ///
    /// # Cost
    /// Two rows of up to `6 n` unknowns for each of its observations, `O(n^2)` each.
    pub fn marginalise_point(&mut self, point: PointHandle, loss: &Loss<T>) -> Result<(), WindowError> {
        self.point(point)?;
        if !self.has_prior_memory() {
            return Err(WindowError::NoPriorMemory);
        }
        fold(self, Leaving::Point(point.index), loss).ok_or(WindowError::NoPriorMemory)?;
        self.remove_point(point)
    }

    /// Frames in the marginalisation prior.
    #[must_use]
    pub fn prior_frame_count(&self) -> usize {
        self.header.prior_frames
    }

    /// Forgets the marginalisation prior.
    pub fn clear_prior(&mut self) {
        self.header.prior_frames = 0;
        for frame in self.frames.iter_mut() {
            frame.prior_column = NO_SLOT;
        }
    }
}

/// Takes a removed frame out of the prior.
pub(super) fn project_out<T: Real>(window: &mut Window<'_, T>, frame: u16) {
    if window.frames.get(frame as usize).is_some_and(|f| f.prior_column != NO_SLOT) {
        let _ = fold(window, Leaving::FrameAlone(frame), &Loss::Squared);
    }
}

/// Gives a column to every frame that the prior will tie together, the leaving frame's first.
fn assign_columns<T: Real>(
    frames: &mut [FrameSlot<T>],
    observations: &[ObservationSlot<T>],
    leaving: Leaving,
) -> u16 {
    let tie = |frames: &mut [FrameSlot<T>], i: u16| {
        if let Some(f) = frames.get_mut(i as usize)
            && (!f.fixed || f.prior_column != NO_SLOT)
        {
            f.slot = 0;
        }
    };
    for f in frames.iter_mut() {
        f.slot = if f.prior_column == NO_SLOT { NO_SLOT } else { 0 };
    }
    for (_, group) in Groups(observations).filter(|(_, g)| g.iter().any(|o| leaving.takes(o))) {
        for o in group {
            tie(frames, o.frame);
        }
    }
    if let Leaving::Frame(frame) = leaving {
        tie(frames, frame);
        for i in (0u16..).take(frames.len()) {
            let other = frames.get(i as usize).and_then(|f| f.distance).map(|d| d.other);
            match other {
                Some(other) if i == frame => tie(frames, other),
                Some(other) if other == frame => tie(frames, i),
                _ => {}
            }
        }
    }
    let own = |i: u16| leaving.frame() == Some(i);
    let mut used = u16::from((0u16..).zip(frames.iter()).any(|(i, f)| own(i) && f.slot != NO_SLOT));
    for (i, f) in (0u16..).zip(frames.iter_mut()).filter(|(_, f)| f.slot != NO_SLOT) {
        if !own(i) {
            f.slot = used;
            used += 1;
        }
    }
    used
}

/// Folds what leaves into the prior.
fn fold<T: Real>(window: &mut Window<'_, T>, leaving: Leaving, loss: &Loss<T>) -> Option<()> {
    let observations = window.observations.split_at_checked(window.header.observations)?.0;
    let used = assign_columns(window.frames, observations, leaving);
    let mut root = SquareRoot::of(window.scalars, window.frames.len(), used as usize)?;
    let row = core::mem::take(&mut root.constraint);
    let prior = core::mem::take(&mut root.prior);
    let only = if let Leaving::Frame(frame) = leaving { frame } else { NO_SLOT };
    let prior_frames = window.header.prior_frames;
    constraint::rows(window.frames, prior, prior_frames, row, At::Current, Some(only), |j, r| {
        root.insert_row(j, r);
    });
    for (i, group) in Groups(observations).filter(|(_, g)| g.iter().any(|o| leaving.takes(o))) {
        if let Some(point) = window.points.get(i) {
            root.insert_point(window.frames, point, group, loss, |o| leaving.takes(o));
        }
    }
    // Leaving the frame's six rows aside marginalises it; what follows is the packed factor of the rest.
    let frame = leaving.frame().and_then(|i| window.frames.get_mut(i as usize)).filter(|f| f.slot != NO_SLOT);
    let own = u16::from(frame.is_some());
    if let Some(frame) = frame {
        frame.slot = NO_SLOT;
    }
    let n = root.n;
    let start: usize = (0..6 * own as usize).map(|k| n - k + 1).sum();
    for (to, &from) in prior.iter_mut().zip(root.factor.iter().skip(start)) {
        *to = from;
    }
    window.header.prior_frames = used.saturating_sub(own) as usize;
    for f in window.frames.iter_mut() {
        f.prior_column = if f.slot == NO_SLOT { NO_SLOT } else { f.slot.saturating_sub(own) };
        f.linearised = f.pose;
    }
    constraint::tie_to_anchor(window.frames, prior, window.header.prior_frames);
    Some(())
}
