//! What ties frames other than observations: pose priors, distances, and the marginalisation prior, all as rows
//! `J d + r` of one least-squares problem.

use nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3};

use super::memory::{Chart, FrameSlot, NO_SLOT, Work};
use super::placement::Placement;
use super::small::{M3, V3, add, cross, dot, mul, mul_transposed, sub};
use super::{WindowError, qr};
use crate::Real;
use crate::geometry::{Pose, pose};
use crate::real::{is_finite, lit, sqrt};

/// What is known of a frame's pose beforehand, as a Gaussian about a pose: of a position sensor, an attitude filter, an
/// odometry.
///
/// # Examples
/// ```
/// use epipole::bundle::PosePrior;
/// use epipole::nalgebra::Vector3;
/// let gnss = PosePrior::position(&Vector3::new(12.0_f32, 4.0, -30.0), 0.5)?;
/// assert!(PosePrior::position(&Vector3::new(12.0_f32, 4.0, f32::NAN), 0.5).is_err());
/// # Ok::<(), epipole::bundle::WindowError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct PosePrior<T: Real> {
    base: Placement<T>,
    /// Rows of the upper triangle of the square root of the information, by `(w, v)`.
    root: [T; 21],
}

impl<T: Real> PosePrior<T> {
    /// The camera's centre in the world, with the standard deviation of each coordinate.
    ///
    /// # Errors
    /// [`WindowError::NotFinite`], [`WindowError::NotPositive`].
    pub fn position(centre: &Vector3<T>, sigma: T) -> Result<Self, WindowError> {
        let turned = Pose::from_parts((-centre).into(), UnitQuaternion::identity());
        Self::diagonal(&turned, T::ZERO, inverse(sigma)?)
    }

    /// The rotation from world to camera, with the standard deviation about each axis.
    ///
    /// # Errors
    /// [`WindowError::NotFinite`], [`WindowError::NotPositive`].
    pub fn rotation(rotation: &UnitQuaternion<T>, sigma_rad: T) -> Result<Self, WindowError> {
        let turned = Pose::from_parts(Vector3::zeros().into(), *rotation);
        Self::diagonal(&turned, inverse(sigma_rad)?, T::ZERO)
    }

    /// A pose with its full information matrix (the inverse covariance) in the order rotation, translation of
    /// `R <- Exp(w) R`, `t <- t + dt`. The matrix may be rank-deficient.
    ///
    /// # Errors
    /// [`WindowError::NotFinite`]; [`WindowError::NotPositiveSemidefinite`].
    pub fn full(pose: &Pose<T>, information: &Matrix6<T>) -> Result<Self, WindowError> {
        let base = Placement::from_pose(pose).ok_or(WindowError::NotFinite)?;
        if !information.iter().all(|&x| is_finite(x)) {
            return Err(WindowError::NotFinite);
        }
        // dt = v - [t]x w
        let mut chart = Matrix6::identity();
        chart.fixed_view_mut::<3, 3>(3, 0).copy_from(&-pose::skew(&pose.translation.vector));
        let a = chart.transpose() * information * chart;
        let mut root = [[T::ZERO; 6]; 6];
        let tolerance = T::EPSILON * lit(16.0);
        for i in 0..6 {
            let mut pivot = a[(i, i)];
            for k in 0..i {
                pivot -= root[k][i] * root[k][i];
            }
            let floor = tolerance * a[(i, i)];
            if !(pivot >= -floor) {
                return Err(WindowError::NotPositiveSemidefinite);
            }
            if pivot <= floor {
                continue;
            }
            let scale = T::ONE / sqrt(pivot);
            for j in i..6 {
                let mut sum = a[(i, j)];
                for k in 0..i {
                    sum -= root[k][i] * root[k][j];
                }
                root[i][j] = sum * scale;
            }
        }
        let mut packed = [T::ZERO; 21];
        let upper = (0..6).flat_map(|i| (i..6).map(move |j| (i, j)));
        for (x, (i, j)) in packed.iter_mut().zip(upper) {
            *x = root[i][j];
        }
        Ok(Self { base, root: packed })
    }

    fn diagonal(pose: &Pose<T>, turn: T, shift: T) -> Result<Self, WindowError> {
        let base = Placement::from_pose(pose).ok_or(WindowError::NotFinite)?;
        let o = T::ZERO;
        // The rows of an upper triangle, one after the other.
        let root = [turn, o, o, o, o, o, turn, o, o, o, o, turn, o, o, o, shift, o, o, shift, o, shift];
        Ok(Self { base, root })
    }
}

fn inverse<T: Real>(sigma: T) -> Result<T, WindowError> {
    if !is_finite(sigma) {
        return Err(WindowError::NotFinite);
    }
    let inverse = T::ONE / sigma;
    if sigma > T::ZERO && is_finite(inverse) { Ok(inverse) } else { Err(WindowError::NotPositive) }
}

/// At which of a frame's placements rows are linearised.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum At {
    Current,
    Trial,
}

impl<T: Real> FrameSlot<T> {
    #[inline]
    pub(super) fn at(&self, at: At) -> &Placement<T> {
        match at {
            At::Current => &self.pose,
            At::Trial => &self.trial,
        }
    }
}

/// Passes every row of the constraints to `sink`: the Jacobian by the motions of the frames, dense by column block, and
/// the residual. With `only`, pose priors and distances that do not involve that frame are left out.
///
/// `row` has 6 numbers for every column block. Frames without a column block count as constants.
pub(super) fn rows<T: Real>(
    frames: &mut [FrameSlot<T>],
    prior: &[T],
    prior_frames: usize,
    row: &mut [T],
    at: At,
    only: Option<u16>,
    mut sink: impl FnMut(&[T], T),
) {
    for (index, frame) in (0u16..).zip(frames.iter()) {
        if only.is_some_and(|o| o != index) {
            continue;
        }
        if let Some(known) = &frame.pose_prior {
            pose_prior_rows(frame, known, row, at, &mut sink);
        }
    }
    for (index, frame) in (0u16..).zip(frames.iter()) {
        let Some(distance) = frame.distance else { continue };
        if only.is_some_and(|o| o != index && o != distance.other) {
            continue;
        }
        let Some(other) = frames.get(distance.other as usize) else { continue };
        let (a, b) = (frame.at(at), other.at(at));
        let d = sub(&a.centre, &b.centre);
        let length = sqrt(dot(&d, &d));
        row.fill(T::ZERO);
        // The distance of two frames in one place has no gradient: any direction may part them.
        let n = if length > T::ZERO { d.map(|x| x / length) } else { [T::ONE, T::ZERO, T::ZERO] };
        for (slot, placement, sign) in [(frame.slot, a, -T::ONE), (other.slot, b, T::ONE)] {
            let g = mul(&placement.rotation, &n).map(|x| x * sign * distance.inverse_sigma);
            set_block(row, slot, &[T::ZERO, T::ZERO, T::ZERO, g[0], g[1], g[2]]);
        }
        sink(row, (length - distance.metres) * distance.inverse_sigma);
    }
    prior_rows(frames, prior, prior_frames, row, at, &mut sink);
}

fn pose_prior_rows<T: Real>(
    frame: &FrameSlot<T>,
    known: &PosePrior<T>,
    row: &mut [T],
    at: At,
    sink: &mut impl FnMut(&[T], T),
) {
    let here = frame.at(at);
    let e = here.motion_from(&known.base);
    let [turn, shift] = here.motion_jacobian(&known.base, &e);
    let mut packed = known.root.iter();
    for i in 0..6 {
        let mut r = [T::ZERO; 6];
        for (x, &value) in r.iter_mut().skip(i).zip(packed.by_ref().take(6 - i)) {
            *x = value;
        }
        if r.iter().all(|&x| x == T::ZERO) {
            continue;
        }
        let mut residual = T::ZERO;
        for (&a, &b) in r.iter().zip(&e) {
            residual += a * b;
        }
        row.fill(T::ZERO);
        set_block(row, frame.slot, &through(&r, &turn, &shift));
        sink(row, residual);
    }
}

fn prior_rows<T: Real>(
    frames: &mut [FrameSlot<T>],
    prior: &[T],
    prior_frames: usize,
    row: &mut [T],
    at: At,
    sink: &mut impl FnMut(&[T], T),
) {
    let Some(anchor) = anchor(frames, prior_frames) else { return };
    let (centre, base) = (anchor.at(at).centre, anchor.linearised);
    let (column, slot, turn) = (anchor.prior_column, anchor.slot, anchor.at(at).turn_from(&base));
    let (mut own, mut axes) = (Chart::IDENTITY, anchor.at(at).rotation);
    for frame in frames.iter_mut().filter(|f| f.prior_column != NO_SLOT) {
        let (mut here, mut there) = (*frame.at(at), frame.linearised);
        let is_anchor = frame.prior_column == column;
        if !is_anchor {
            // Both as seen from the anchor, in the axes of the world as the anchor has turned them.
            here.centre = sub(&here.centre, &centre);
            there.centre = sub(&there.centre, &base.centre);
            there = there.turned(&turn);
        }
        let motion = here.motion_from(&there);
        let [turn, shift] = here.motion_jacobian(&there, &motion);
        let chart = Chart { motion, turn, shift };
        if is_anchor {
            (own, axes) = (chart, here.rotation);
        }
        frame.work = Work::Chart(chart);
    }
    let n = 6 * prior_frames;
    let start = n - 6;
    for (k, packed) in qr::packed_rows(prior, n).enumerate() {
        let Some((&constant, packed)) = packed.split_last() else { continue };
        let mut residual = constant;
        row.fill(T::ZERO);
        let mut pull = Wrench::NONE;
        for frame in frames.iter().filter(|f| f.prior_column != NO_SLOT && f.prior_column != column) {
            let Some(r) = block_of(packed, k, 6 * frame.prior_column as usize) else { continue };
            let Work::Chart(chart) = &frame.work else { continue };
            for (a, b) in r.iter().zip(&chart.motion) {
                residual += *a * *b;
            }
            let r = through(&r, &chart.turn, &chart.shift);
            set_block(row, frame.slot, &r);
            let here = frame.at(at);
            pull.add(&r, &here.rotation, &sub(&centre, &here.centre));
        }
        let Some(r) = block_of(packed, k, start) else { continue };
        for (a, b) in r.iter().zip(&own.motion) {
            residual += *a * *b;
        }
        let mut r = through(&r, &own.turn, &own.shift);
        for (x, y) in r.iter_mut().zip(pull.on(&axes)) {
            *x -= y;
        }
        set_block(row, slot, &r);
        sink(row, residual);
    }
}

/// The frame of the prior's last column.
fn anchor<T: Real>(frames: &[FrameSlot<T>], prior_frames: usize) -> Option<&FrameSlot<T>> {
    let last = prior_frames.checked_sub(1)?;
    frames.iter().find(|f| f.prior_column != NO_SLOT && f.prior_column as usize == last)
}

/// Rewrites a factor over the motions of all frames, linearised where they are, for the prior's chart: the motion of
/// the anchor, and those of the others beside it.
pub(super) fn tie_to_anchor<T: Real>(frames: &[FrameSlot<T>], prior: &mut [T], prior_frames: usize) {
    let Some(anchor) = anchor(frames, prior_frames) else { return };
    let n = 6 * prior_frames;
    for (k, packed) in qr::packed_rows_mut(prior, n).enumerate() {
        let Some((_, packed)) = packed.split_last_mut() else { continue };
        let mut pull = Wrench::NONE;
        for frame in
            frames.iter().filter(|f| f.prior_column != NO_SLOT && f.prior_column != anchor.prior_column)
        {
            if let Some(r) = block_of(packed, k, 6 * frame.prior_column as usize) {
                pull.add(&r, &frame.pose.rotation, &sub(&anchor.pose.centre, &frame.pose.centre));
            }
        }
        // In the anchor's own rows the others have nothing.
        for (x, y) in packed.iter_mut().rev().zip(pull.on(&anchor.pose.rotation).iter().rev()) {
            *x += *y;
        }
    }
}

/// The six elements from column `start` on of row `k` of a packed triangle; none where all are left of it.
fn block_of<T: Real>(packed: &[T], k: usize, start: usize) -> Option<[T; 6]> {
    if start + 6 <= k {
        return None;
    }
    let mut r = [T::ZERO; 6];
    for (x, &value) in
        r.iter_mut().skip(k.saturating_sub(start)).zip(packed.iter().skip(start.saturating_sub(k)))
    {
        *x = value;
    }
    Some(r)
}

/// What rows by the motions of several frames say of a motion that carries all of them along with the anchor: as forces
/// on a rigid body, in the axes of the world, with their moment about the anchor's centre.
struct Wrench<T> {
    moment: V3<T>,
    force: V3<T>,
}

impl<T: Real> Wrench<T> {
    const NONE: Self = Self { moment: [T::ZERO; 3], force: [T::ZERO; 3] };

    /// Adds the row `r` of a frame with these axes; `arm` leads from its centre to the anchor's.
    fn add(&mut self, r: &[T; 6], axes: &M3<T>, arm: &V3<T>) {
        let force = mul_transposed(axes, &[r[3], r[4], r[5]]);
        let moment = add(&mul_transposed(axes, &[r[0], r[1], r[2]]), &cross(&force, arm));
        self.moment = add(&self.moment, &moment);
        self.force = add(&self.force, &force);
    }

    /// The row by the motion of the anchor.
    fn on(&self, axes: &M3<T>) -> [T; 6] {
        let ([a, b, c], [d, e, f]) = (mul(axes, &self.moment), mul(axes, &self.force));
        [a, b, c, d, e, f]
    }
}

/// `r' blockdiag(turn, shift)`
fn through<T: Real>(r: &[T; 6], turn: &M3<T>, shift: &M3<T>) -> [T; 6] {
    let a = mul_transposed(turn, &[r[0], r[1], r[2]]);
    let b = mul_transposed(shift, &[r[3], r[4], r[5]]);
    [a[0], a[1], a[2], b[0], b[1], b[2]]
}

fn set_block<T: Real>(row: &mut [T], slot: u16, values: &[T; 6]) {
    if slot == NO_SLOT {
        return;
    }
    if let Some(block) = row.as_chunks_mut::<6>().0.get_mut(slot as usize) {
        *block = *values;
    }
}

/// The covariance of `(w, dt)` of `R <- Exp(w) R`, `t <- t + dt` from that of `(w, v)`.
pub(super) fn to_pose_chart<T: Real>(covariance: &Matrix6<T>, pose: &Pose<T>) -> Matrix6<T> {
    let mut chart = Matrix6::identity();
    let minus: Matrix3<T> = -pose::skew(&pose.translation.vector);
    chart.fixed_view_mut::<3, 3>(3, 0).copy_from(&minus);
    chart * covariance * chart.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bundle::prior_len;

    const FRAMES: usize = 3;

    fn some(k: f64) -> Placement<f64> {
        let d = [0.3 * k, -0.2, 0.1 + 0.05 * k * k, k, 0.2 * k * k, -0.1 * k];
        Placement::IDENTITY.moved(&d)
    }

    /// Three frames of a prior, away from where it is linearised; the anchor is not the last slot.
    fn scene() -> ([FrameSlot<f64>; FRAMES], [f64; prior_len(FRAMES)]) {
        let mut frames = [FrameSlot::EMPTY; FRAMES];
        for ((k, frame), column) in (0u16..).zip(frames.iter_mut()).zip([1, 2, 0]) {
            frame.linearised = some(f64::from(k));
            let d = [0.05, -0.02 * f64::from(k), 0.03, 0.2, 0.1 * f64::from(k), -0.3];
            frame.pose = frame.linearised.moved(&d);
            frame.slot = k;
            frame.prior_column = column;
        }
        let mut seed = 1.0;
        let prior = [(); prior_len(FRAMES)].map(|()| {
            seed = (seed * 7.13 + 0.31) % 1.9;
            seed - 0.9
        });
        (frames, prior)
    }

    fn residuals(frames: &mut [FrameSlot<f64>], prior: &[f64]) -> ([f64; 18], [[f64; 18]; 18]) {
        let (mut all, mut jacobian, mut k) = ([0.0; 18], [[0.0; 18]; 18], 0);
        prior_rows(frames, prior, FRAMES, &mut [0.0; 18], At::Current, &mut |j: &[f64], r| {
            (all[k], jacobian[k]) = (r, j.try_into().unwrap());
            k += 1;
        });
        assert_eq!(k, 18);
        (all, jacobian)
    }

    #[test]
    fn prior_jacobian_by_central_differences() {
        let (frames, prior) = scene();
        let jacobian = residuals(&mut frames.clone(), &prior).1;
        for column in 0..18 {
            let h = 1e-6;
            let at = |h: f64| {
                let mut frames = frames;
                let mut d = [0.0; 6];
                d[column % 6] = h;
                frames[column / 6].pose = frames[column / 6].pose.moved(&d);
                residuals(&mut frames, &prior).0
            };
            let (up, down) = (at(h), at(-h));
            for row in 0..18 {
                let slope = (up[row] - down[row]) / (2.0 * h);
                assert!((slope - jacobian[row][column]).abs() < 1e-7, "{row} {column}");
            }
        }
    }

    #[test]
    fn tied_to_the_anchor_is_the_same_where_it_is_linearised() {
        let (mut frames, mut prior) = scene();
        for frame in &mut frames {
            frame.linearised = frame.pose;
        }
        let untied = prior;
        tie_to_anchor(&frames, &mut prior, FRAMES);
        let (r, jacobian) = residuals(&mut frames, &prior);
        for (row, packed) in qr::packed_rows(&untied, 18).enumerate() {
            let (constant, packed) = packed.split_last().unwrap();
            assert!((r[row] - constant).abs() < 1e-14);
            for (frame, start) in [(0usize, 6usize), (1, 12), (2, 0)] {
                for i in 0..6 {
                    let want = (start + i).checked_sub(row).map_or(0.0, |k: usize| packed[k]);
                    assert!((want - jacobian[row][6 * frame + i]).abs() < 1e-13, "{row} {frame} {i}");
                }
            }
        }
    }
}
