//! The two passes over the observations that make one iteration: building the reduced system, and going back to the
//! points with the frames' step. Jacobians are computed in both, and stored in neither.

use super::memory::{FrameSlot, NO_SLOT, ObservationSlot, PointSlot};
use super::residual::{linearise, residual};
use super::small::{S3, V3, add, cross, dot, inverse_factor, lower, product_transposed, sub, upper};
use super::system::{System, add_spread, add_spread_vector, block_index};
use crate::Real;
use crate::robust::loss::Loss;

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
    /// Twice the fall of the cost that the linear model promises.
    pub(super) promised: T,
    /// A point left the view of a camera that saw it.
    pub(super) lost_sight: bool,
}

fn damp<T: Real>(v: &S3<T>, lambda: T) -> S3<T> {
    let up = T::ONE + lambda;
    [v[0] * up, v[1], v[2], v[3] * up, v[4], v[5] * up]
}

/// Fills the reduced system, but for the constraints and the damping of the frames.
pub(super) fn build<T: Real>(
    frames: &mut [FrameSlot<T>],
    points: &[PointSlot<T>],
    observations: &[ObservationSlot<T>],
    system: &mut System<'_, T>,
    loss: &Loss<T>,
    curved: bool,
    free: Points,
    lambda: T,
) -> Built<T> {
    let mut built = Built { rho: T::ZERO, used: 0, behind: 0, unused_points: 0 };
    for (index, group) in Groups(observations) {
        let Some(point) = points.get(index) else { continue };
        let is_free = free.is_free(index, point);
        let (mut v, mut g) = ([T::ZERO; 6], [T::ZERO; 3]);
        let mut rho = T::ZERO;
        let mut seen = 0;
        for o in group {
            let Some(frame) = frames.get_mut(o.frame as usize) else { continue };
            frame.work.slot = NO_SLOT;
            let Some(camera) = &frame.camera else { continue };
            if !is_free && frame.slot == NO_SLOT {
                continue;
            }
            let Some(l) = linearise(camera, &frame.pose, &point.position, o, loss, curved) else {
                built.behind += 1;
                continue;
            };
            seen += 1;
            rho += l.rho;
            let wb = l.weighted_b();
            l.add_point_block(&wb, &mut v);
            let e = l.gradient();
            g = add(&g, &super::small::mul_transposed(&frame.pose.rotation, &e));
            if frame.slot != NO_SLOT {
                let (u, m) = l.camera_blocks(&wb);
                let work = &mut frame.work;
                (work.slot, work.u, work.m, work.y, work.e) = (frame.slot, u, m, l.y, e);
            }
        }
        if is_free && seen < 2 {
            built.unused_points += 1;
            continue;
        }
        built.rho += rho;
        built.used += seen;
        let factor = if is_free { inverse_factor(&damp(&v, lambda), T::EPSILON) } else { None };
        eliminate(frames, group, system, factor.as_ref().map(|l| (l, lower(l, &g))));
    }
    built
}

/// Adds a point's share of the system, less what its own motion takes of it.
#[inline(always)]
fn eliminate<T: Real>(
    frames: &mut [FrameSlot<T>],
    group: &[ObservationSlot<T>],
    system: &mut System<'_, T>,
    point: Option<(&[T; 6], V3<T>)>,
) {
    for (before, o) in group.iter().enumerate() {
        let Some(frame) = frames.get_mut(o.frame as usize) else { continue };
        let work = &mut frame.work;
        let slot = work.slot as usize;
        if work.slot == NO_SLOT {
            continue;
        }
        let (Some(gradient), Some(rhs)) = (system.gradient.get_mut(slot), system.rhs.get_mut(slot)) else {
            continue;
        };
        add_spread_vector(gradient, &work.y, &work.e);
        let mut q = work.e;
        let mut c = work.m;
        if let Some((l, z)) = &point {
            // N = U L^-T
            let n = [lower(l, &work.u[0]), lower(l, &work.u[1]), lower(l, &work.u[2])];
            work.u = n;
            q = sub(&q, &[dot(&n[0], z), dot(&n[1], z), dot(&n[2], z)]);
            for i in 0..3 {
                for j in 0..3 {
                    c[i][j] -= dot(&n[i], &n[j]);
                }
            }
        }
        add_spread_vector(rhs, &work.y, &[-q[0], -q[1], -q[2]]);
        let (ya, na) = (work.y, work.u.map(|r| [-r[0], -r[1], -r[2]]));
        if let Some(block) = system.blocks.get_mut(block_index(slot, slot)) {
            add_spread(block, &ya, &c, &ya);
        }
        if point.is_none() {
            continue;
        }
        for other in group.iter().take(before) {
            let Some(other) = frames.get(other.frame as usize) else { continue };
            if other.work.slot == NO_SLOT {
                continue;
            }
            let c = product_transposed(&na, &other.work.u);
            if let Some(block) = system.blocks.get_mut(block_index(slot, other.work.slot as usize)) {
                add_spread(block, &ya, &c, &other.work.y);
            }
        }
    }
}

/// Moves the points to their trial positions, given the frames' trial placements, and compares the costs.
pub(super) fn back_substitute<T: Real>(
    frames: &[FrameSlot<T>],
    points: &mut [PointSlot<T>],
    observations: &[ObservationSlot<T>],
    step: &[[T; 6]],
    loss: &Loss<T>,
    curved: bool,
    free: Points,
    lambda: T,
) -> Tried<T> {
    let mut tried = Tried { change: T::ZERO, promised: T::ZERO, lost_sight: false };
    for (index, group) in Groups(observations) {
        let Some(point) = points.get_mut(index) else { continue };
        point.trial = point.position;
        let is_free = free.is_free(index, point);
        let (mut v, mut g, mut pull) = ([T::ZERO; 6], [T::ZERO; 3], [T::ZERO; 3]);
        let mut before = T::ZERO;
        let (mut seen, mut all_seen) = (0, true);
        for o in group {
            let Some(frame) = frames.get(o.frame as usize) else { continue };
            let Some(camera) = &frame.camera else { continue };
            if !is_free {
                if frame.slot != NO_SLOT {
                    match residual(camera, &frame.pose, &point.position, o) {
                        Some(r) => before += loss.evaluate(r[0] * r[0] + r[1] * r[1]).0,
                        None => all_seen = false,
                    }
                }
                continue;
            }
            let Some(l) = linearise(camera, &frame.pose, &point.position, o, loss, curved) else {
                all_seen = false;
                continue;
            };
            seen += 1;
            before += l.rho;
            let wb = l.weighted_b();
            l.add_point_block(&wb, &mut v);
            let r = [l.weight * l.r[0], l.weight * l.r[1]];
            for k in 0..3 {
                g[k] += l.b[0][k] * r[0] + l.b[1][k] * r[1];
            }
            if let Some(s) = step.get(frame.slot as usize) {
                let h = add(&cross(&[s[0], s[1], s[2]], &l.y), &[s[3], s[4], s[5]]);
                let dh = [dot(&l.d[0], &h), dot(&l.d[1], &h)];
                for k in 0..3 {
                    pull[k] += wb[0][k] * dh[0] + wb[1][k] * dh[1];
                }
            }
        }
        if is_free && seen < 2 {
            continue;
        }
        if is_free && let Some(l) = inverse_factor(&damp(&v, lambda), T::EPSILON) {
            let dx = upper(&l, &lower(&l, &add(&g, &pull))).map(|x| -x);
            point.trial = add(&point.position, &dx);
            let damped = [lambda * v[0] * dx[0], lambda * v[3] * dx[1], lambda * v[5] * dx[2]];
            tried.promised += dot(&dx, &sub(&damped, &g));
        }
        let counts = |frame: &FrameSlot<T>| is_free || frame.slot != NO_SLOT;
        let mut after = cost(frames, group, point, loss, counts, all_seen);
        if after.is_none() {
            // One point that would leave the view does not spoil the step of all.
            point.trial = point.position;
            after = cost(frames, group, point, loss, counts, all_seen);
        }
        match after {
            Some(after) => tried.change += after - before,
            None => tried.lost_sight = true,
        }
    }
    tried
}

/// Twice the cost of a point at the trial state, of the observations that counted before; none where a camera that sees
/// it would no longer.
#[inline(always)]
fn cost<T: Real>(
    frames: &[FrameSlot<T>],
    group: &[ObservationSlot<T>],
    point: &PointSlot<T>,
    loss: &Loss<T>,
    counts: impl Fn(&FrameSlot<T>) -> bool,
    all_seen: bool,
) -> Option<T> {
    let mut sum = T::ZERO;
    for o in group {
        let Some(frame) = frames.get(o.frame as usize) else { continue };
        let Some(camera) = &frame.camera else { continue };
        if !counts(frame) || (!all_seen && residual(camera, &frame.pose, &point.position, o).is_none()) {
            continue;
        }
        let r = residual(camera, &frame.trial, &point.trial, o)?;
        sum += loss.evaluate(r[0] * r[0] + r[1] * r[1]).0;
    }
    Some(sum)
}
