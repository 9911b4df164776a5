//! The two passes over the observations that make one iteration: building the reduced system, and going back to the
//! points with the frames' step. Jacobians are computed in both, and stored in neither.

use super::memory::{FrameSlot, NO_SLOT, ObservationSlot, PointSlot, Seen, Work};
use super::residual::{Robust, linearise, squared_residual};
use super::small::{M3, S3, V3, add, add_scaled, dot, inverse_factor, lower, sub, upper};
use super::system::{System, add_spread, add_square_spread, add_turned, block_index, subtract_spread_vector};
use crate::Real;

/// The observations, point by point.
pub(super) struct Groups<'a, T: Real>(pub(super) &'a [ObservationSlot<T>]);

impl<'a, T: Real> Iterator for Groups<'a, T> {
    type Item = (usize, &'a [ObservationSlot<T>]);

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        let point = self.0.first()?.point;
        let count = self.0.iter().take_while(|o| o.point == point).count();
        let (group, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some((point as usize, group))
    }
}

/// Which points may move.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Points {
    Free,
    Held,
    /// This one alone.
    Only(u16),
}

impl Points {
    fn is_free<T: Real>(self, index: usize, point: &PointSlot<T>) -> bool {
        !point.fixed
            && match self {
                Self::Free => true,
                Self::Held => false,
                Self::Only(only) => only as usize == index,
            }
    }
}

/// What building the system found.
#[derive(Clone, Copy, Default)]
pub(super) struct Built<T> {
    /// Twice the cost.
    pub(super) rho: T,
    /// Twice the fall of the cost that the points alone promise, the frames held.
    pub(super) promised: T,
    /// Observations that count.
    pub(super) used: usize,
    /// Observations behind their camera.
    pub(super) behind: usize,
    /// Free points seen fewer than twice.
    pub(super) unused_points: usize,
}

/// What a step does.
#[derive(Clone, Copy, Default)]
pub(super) struct Tried<T> {
    /// Twice the change of the cost.
    pub(super) change: T,
    /// A point left the view of a camera that saw it.
    pub(super) lost_sight: bool,
}

/// What the observations of a point say where it is.
struct Observed<T> {
    rho: T,
    seen: usize,
    behind: usize,
}

/// Linearises the observations of a point into the work space of their frames. Those that a free frame or a free point
/// does not turn into an unknown are left out. `then` is called with every one, with its frame's axes and column block.
#[inline(always)]
fn observe<T: Real>(
    frames: &mut [FrameSlot<T>],
    group: &[ObservationSlot<T>],
    x: &V3<T>,
    robust: &Robust<T>,
    is_free: bool,
    mut then: impl FnMut(&mut Seen<T>, &M3<T>, usize),
) -> Observed<T> {
    let mut observed = Observed { rho: T::ZERO, seen: 0, behind: 0 };
    for o in group {
        let Some(frame) = frames.get_mut(o.frame as usize) else { continue };
        frame.work = Work::Nothing;
        let Some(camera) = &frame.camera else { continue };
        if !is_free && frame.slot == NO_SLOT {
            continue;
        }
        let Some(rho) = linearise(camera, &frame.pose, x, o, robust, &mut frame.work) else {
            observed.behind += 1;
            continue;
        };
        observed.rho += rho;
        observed.seen += 1;
        if let Work::Seen(seen) = &mut frame.work {
            then(seen, &frame.pose.rotation, frame.slot as usize);
        }
    }
    observed
}

/// The inverse Cholesky factor of a point's damped block.
#[inline(always)]
fn damped_factor<T: Real>(v: &S3<T>, lambda: T) -> Option<[T; 6]> {
    let up = T::ONE + lambda;
    inverse_factor(&[v[0] * up, v[1], v[2], v[3] * up, v[4], v[5] * up], T::EPSILON)
}

/// Fills the reduced system, but for the constraints and the damping of the frames. Until the step is known, the trial
/// position of a free point holds `L^-1` times its gradient.
pub(super) fn build<T: Real>(
    frames: &mut [FrameSlot<T>],
    points: &mut [PointSlot<T>],
    observations: &[ObservationSlot<T>],
    system: &mut System<'_, T>,
    robust: &Robust<T>,
    free: Points,
    lambda: T,
) -> Built<T> {
    let mut built = Built { rho: T::ZERO, promised: T::ZERO, used: 0, behind: 0, unused_points: 0 };
    for (index, group) in Groups(observations) {
        let Some(point) = points.get_mut(index) else { continue };
        let is_free = free.is_free(index, point);
        let (mut v, mut g) = ([T::ZERO; 6], [T::ZERO; 3]);
        let observed = observe(frames, group, &point.position, robust, is_free, |seen, axes, _| {
            if is_free {
                let (pull, mut n) = (seen.g, seen.n);
                seen.add_to_point(axes, &mut v, |k, row, weighted| {
                    add_scaled(&mut g, &row, pull[k]);
                    n[k] = weighted;
                });
                seen.n = n;
            }
        });
        built.behind += observed.behind;
        point.trial = [T::ZERO; 3];
        if is_free && observed.seen < 2 {
            built.unused_points += 1;
            continue;
        }
        built.rho += observed.rho;
        built.used += observed.seen;
        let factor = if is_free { damped_factor(&v, lambda) } else { None };
        if let Some(l) = &factor {
            point.trial = lower(l, &g);
            built.promised += dot(&point.trial, &point.trial);
        }
        let point = factor.map(|l| (l, upper(&l, &point.trial)));
        eliminate(frames, group, system, point.as_ref().map(|(l, moved)| (l, moved)));
    }
    built
}

/// Adds a point's share of the system, less what its own motion takes of it. Of the point: the factor of its block, and
/// how far it would move were the frames held.
#[inline(always)]
fn eliminate<T: Real>(
    frames: &mut [FrameSlot<T>],
    group: &[ObservationSlot<T>],
    system: &mut System<'_, T>,
    point: Option<(&[T; 6], &V3<T>)>,
) {
    // Fixed frames are often the oldest, which stand first.
    let moves = |o: &ObservationSlot<T>| frames.get(o.frame as usize).is_some_and(|f| f.slot != NO_SLOT);
    let Some((_, group)) = group.split_at_checked(group.iter().take_while(|o| !moves(o)).count()) else {
        return;
    };
    for (before, o) in group.iter().enumerate() {
        let Some(frame) = frames.get_mut(o.frame as usize) else { continue };
        let slot = frame.slot as usize;
        let Work::Seen(seen) = &mut frame.work else { continue };
        if frame.slot == NO_SLOT {
            continue;
        }
        let mut g = seen.g;
        if let Some((_, moved)) = point {
            g = [g[0] - dot(&seen.n[0], moved), g[1] - dot(&seen.n[1], moved)];
        }
        let Some(rhs) = system.rhs.get_mut(slot) else { continue };
        subtract_spread_vector(rhs, seen, g);
        if system.lagged {
            continue;
        }
        seen.rotation = seen.rotation_jacobian();
        let [a, h, b] = seen.info;
        let mut k = [[a, h], [h, b]];
        if let Some((l, _)) = point {
            seen.n = [lower(l, &seen.n[0]), lower(l, &seen.n[1])];
            let n = &seen.n;
            let across = dot(&n[0], &n[1]);
            k = [[a - dot(&n[0], &n[0]), h - across], [h - across, b - dot(&n[1], &n[1])]];
        }
        let frames = &*frames;
        let Some(Work::Seen(seen)) = frames.get(o.frame as usize).map(|f| &f.work) else { continue };
        let Some(row) = system.blocks.get_mut(block_index(slot, 0)..=block_index(slot, slot)) else {
            continue;
        };
        let Some((diagonal, row)) = row.split_last_mut() else { continue };
        if seen.turn == 0 {
            add_square_spread(diagonal, seen, &k);
        } else {
            add_turned(diagonal, seen, &k, seen);
        }
        if point.is_none() {
            continue;
        }
        let n = seen.n.map(|r| r.map(|x| -x));
        for other in group.iter().take(before) {
            let Some(other) = frames.get(other.frame as usize) else { continue };
            let (Work::Seen(theirs), Some(block)) = (&other.work, row.get_mut(other.slot as usize)) else {
                continue;
            };
            let m = &theirs.n;
            let k = [[dot(&n[0], &m[0]), dot(&n[0], &m[1])], [dot(&n[1], &m[0]), dot(&n[1], &m[1])]];
            if seen.turn | theirs.turn == 0 {
                add_spread(block, seen, &k, theirs);
            } else {
                add_turned(block, seen, &k, theirs);
            }
        }
    }
}

/// Moves the points to their trial positions, given the frames' trial placements, and compares the costs.
pub(super) fn back_substitute<T: Real>(
    frames: &mut [FrameSlot<T>],
    points: &mut [PointSlot<T>],
    observations: &[ObservationSlot<T>],
    step: &[[T; 6]],
    robust: &Robust<T>,
    free: Points,
    lambda: T,
) -> Tried<T> {
    let mut tried = Tried { change: T::ZERO, lost_sight: false };
    for (index, group) in Groups(observations) {
        let Some(point) = points.get_mut(index) else { continue };
        let is_free = free.is_free(index, point);
        let z = core::mem::replace(&mut point.trial, point.position);
        let (mut v, mut pull) = ([T::ZERO; 6], [T::ZERO; 3]);
        let observed = observe(frames, group, &point.position, robust, is_free, |seen, axes, slot| {
            if is_free {
                let moved = step.get(slot).map_or([T::ZERO; 2], |d| seen.moved_by(d));
                seen.add_to_point(axes, &mut v, |k, _, weighted| {
                    add_scaled(&mut pull, &weighted, moved[k]);
                });
            }
        });
        if is_free && observed.seen < 2 {
            continue;
        }
        if is_free && let Some(l) = damped_factor(&v, lambda) {
            let dx = upper(&l, &add(&z, &lower(&l, &pull)));
            point.trial = sub(&point.position, &dx);
        }
        let mut after = cost(frames, group, &point.trial, robust);
        if after.is_none() {
            // One point that would leave the view does not spoil the step of all.
            point.trial = point.position;
            after = cost(frames, group, &point.trial, robust);
        }
        match after {
            Some(after) => tried.change += after - observed.rho,
            None => tried.lost_sight = true,
        }
    }
    tried
}

/// Twice the cost of a point with the trial placements, of the observations that count; none where a camera that sees
/// it would no longer.
#[inline(always)]
fn cost<T: Real>(
    frames: &[FrameSlot<T>],
    group: &[ObservationSlot<T>],
    x: &V3<T>,
    robust: &Robust<T>,
) -> Option<T> {
    let mut sum = T::ZERO;
    for o in group {
        let Some(frame) = frames.get(o.frame as usize) else { continue };
        let (Some(camera), Work::Seen(_)) = (&frame.camera, &frame.work) else { continue };
        sum += robust.evaluate(squared_residual(camera, &frame.trial, x, o)?).0;
    }
    Some(sum)
}
