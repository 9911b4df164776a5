//! What ties frames other than observations: pose priors, distances, and the marginalisation prior, all as rows
//! `J d + r` of one least-squares problem.

use nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3};

use super::memory::{Chart, FrameSlot, NO_SLOT, Work};
use super::placement::Placement;
use super::small::{M3, dot, mul, mul_transposed, sub};
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
    if prior_frames == 0 {
        return;
    }
    for frame in frames.iter_mut().filter(|f| f.prior_column != NO_SLOT) {
        let here = *frame.at(at);
        let e = here.motion_from(&frame.linearised);
        let [turn, shift] = here.motion_jacobian(&frame.linearised, &e);
        frame.work = Work::Chart(Chart { motion: e, turn, shift });
    }
    let n = 6 * prior_frames;
    for (k, packed) in qr::packed_rows(prior, n).enumerate() {
        let Some((&constant, packed)) = packed.split_last() else { continue };
        let mut residual = constant;
        row.fill(T::ZERO);
        for frame in frames.iter().filter(|f| f.prior_column != NO_SLOT) {
            let start = 6 * frame.prior_column as usize;
            if start + 6 <= k {
                continue;
            }
            let mut r = [T::ZERO; 6];
            if start >= k {
                for (x, &value) in r.iter_mut().zip(packed.iter().skip(start - k)) {
                    *x = value;
                }
            } else {
                for (x, &value) in r.iter_mut().skip(k - start).zip(packed.iter()) {
                    *x = value;
                }
            }
            let Work::Chart(chart) = &frame.work else { continue };
            for (a, b) in r.iter().zip(&chart.motion) {
                residual += *a * *b;
            }
            set_block(row, frame.slot, &through(&r, &chart.turn, &chart.shift));
        }
        sink(row, residual);
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
