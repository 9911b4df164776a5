//! Marginalisation: what a frame and its points said of the frames that remain, as a square root of information.

use super::constraint::{self, At};
use super::memory::{FrameHandle, NO_SLOT, ObservationSlot};
use super::pass::Groups;
use super::square_root::SquareRoot;
use super::{Window, WindowError};
use crate::Real;
use crate::robust::loss::Loss;

/// What a marginalisation did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Marginalised {
    /// Points that went into the prior with all their observations, and out of the window.
    pub points: usize,
    /// Frames that the prior now ties together.
    pub prior_frames: usize,
}

impl<T: Real> Window<'_, T> {
    /// Takes a frame out of the window and leaves what it said about the other frames as a prior on them.
    ///
    /// Every point that the frame observes goes with it: all its observations, in whichever frame, enter the prior once,
    /// and the point's handle becomes stale. A point that is still tracked is added anew by the caller with the
    /// observations of the frames to come, at the position read before. Measured on a synthetic flight this keeps
    /// more of the information than dropping the frame's observations of points that live on.
    ///
    /// # Input
    /// Call it where the window is optimised: the prior is linearised where frames and points are. A frame that is
    /// already in the prior keeps its first linearisation point, and new rows are linearised there too, so that no
    /// direction that the measurements do not determine is ever believed to be known. `loss` gives each observation the
    /// weight with which it enters.
    ///
    /// # Errors
    /// [`WindowError::StaleFrame`], [`WindowError::NoPriorMemory`].
    ///
    /// # Degeneracies
    /// A frame or direction that nothing determines leaves rows of zeros. Points behind their camera count for nothing.
    ///
    /// # Accuracy
    /// The factor is triangularised by Givens rotations, never through its square: in `f32` the prior keeps directions
    /// that are 1e6 times weaker than the strongest, where a Hessian keeps 1e3.
    ///
    /// # Cost
    /// Two rows of up to `6 n` unknowns for every observation of the points that go, `O(n^2)` each.
    ///
    /// # References
    /// M. Kaess, A. Ranganathan, F. Dellaert, "iSAM: incremental smoothing and mapping", IEEE Transactions on Robotics
    /// 24(6), 2008 (rows by Givens rotations). N. Demmel, D. Schubert, C. Sommer, D. Cremers, V. Usenko, "Square root
    /// marginalization for sliding-window bundle adjustment", ICCV 2021. G. Huang, A. Mourikis, S. Roumeliotis,
    /// "Observability-based rules for designing consistent EKF SLAM estimators", IJRR 29(5), 2010 (first estimates).
    pub fn marginalise_frame(
        &mut self,
        frame: FrameHandle,
        loss: &Loss<T>,
    ) -> Result<Marginalised, WindowError> {
        self.frame(frame)?;
        if !self.has_prior_memory() {
            return Err(WindowError::NoPriorMemory);
        }
        let index = frame.index;
        let points = fold(self, index, Some(loss)).ok_or(WindowError::NoPriorMemory)?;
        for point in 0..self.points.len() as u16 {
            if observed_by(self.group(point), index) {
                self.erase_point(point);
                self.retain_observations(|o| o.point != point);
            }
        }
        self.erase_frame(index);
        Ok(Marginalised { points, prior_frames: self.header.prior_frames })
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

fn observed_by<T: Real>(group: &[ObservationSlot<T>], frame: u16) -> bool {
    group.iter().any(|o| o.frame == frame)
}

/// Takes a removed frame out of the prior.
pub(super) fn project_out<T: Real>(window: &mut Window<'_, T>, frame: u16) {
    if window.frames.get(frame as usize).is_some_and(|f| f.prior_column != NO_SLOT) {
        let _ = fold(window, frame, None);
    }
}

/// Rebuilds the prior without `frame`; with `loss`, what its points, its own prior and its distances say goes in.
/// Returns how many points went in.
fn fold<T: Real>(window: &mut Window<'_, T>, frame: u16, loss: Option<&Loss<T>>) -> Option<usize> {
    let live = window.observations.split_at_checked(window.header.observations)?.0;
    // Columns: the frame itself first, then every other that the prior or a point of the frame ties to it.
    let tied = |frames: &mut [super::FrameSlot<T>], i: u16| {
        if let Some(f) = frames.get_mut(i as usize)
            && (!f.fixed || f.prior_column != NO_SLOT)
        {
            f.slot = 0;
        }
    };
    for f in window.frames.iter_mut() {
        f.slot = if f.prior_column == NO_SLOT { NO_SLOT } else { 0 };
    }
    tied(window.frames, frame);
    if loss.is_some() {
        for (_, group) in Groups(live).filter(|(_, g)| observed_by(g, frame)) {
            for o in group {
                tied(window.frames, o.frame);
            }
        }
        for i in 0..window.frames.len() as u16 {
            let Some(other) = window.frames.get(i as usize).and_then(|f| f.distance).map(|d| d.other) else {
                continue;
            };
            if i == frame {
                tied(window.frames, other);
            } else if other == frame {
                tied(window.frames, i);
            }
        }
    }
    let own = window.frames.get(frame as usize).is_some_and(|f| f.slot != NO_SLOT);
    let mut used = u16::from(own);
    for (i, f) in (0u16..).zip(window.frames.iter_mut()) {
        if f.slot == NO_SLOT {
            continue;
        }
        if f.prior_column == NO_SLOT {
            f.first = f.pose;
        }
        if i == frame {
            f.slot = 0;
        } else {
            f.slot = used;
            used += 1;
        }
    }
    let capacity = window.frames.len();
    let mut root = SquareRoot::of(window.scalars, capacity, used as usize)?;
    let row = core::mem::take(&mut root.constraint);
    let prior = core::mem::take(&mut root.prior);
    let only = if loss.is_some() { frame } else { NO_SLOT };
    let prior_frames = window.header.prior_frames;
    constraint::rows(window.frames, prior, prior_frames, row, At::First, Some(only), |j, r| {
        root.insert_row(j, r);
    });
    let mut points = 0;
    if let Some(loss) = loss {
        for (i, group) in Groups(live).filter(|(_, g)| observed_by(g, frame)) {
            if let Some(point) = window.points.get(i) {
                root.insert_point(window.frames, point, group, loss, At::First);
                points += 1;
            }
        }
    }
    // Leaving the frame's six rows aside marginalises it; what follows is the packed factor of the rest.
    let n = root.n;
    let skipped = if own { 6 } else { 0 };
    let start: usize = (0..skipped).map(|k| n - k + 1).sum();
    for (to, &from) in prior.iter_mut().zip(root.factor.iter().skip(start)) {
        *to = from;
    }
    window.header.prior_frames = used.saturating_sub(u16::from(own)) as usize;
    for (i, f) in (0u16..).zip(window.frames.iter_mut()) {
        f.prior_column = match f.slot {
            NO_SLOT => NO_SLOT,
            _ if i == frame => NO_SLOT,
            slot => slot - u16::from(own),
        };
    }
    Some(points)
}
