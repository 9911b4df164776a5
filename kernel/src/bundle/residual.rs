//! One observation: residual, Jacobian, robust weight.
//!
//! A pixel depends on the direction of its point alone, so its Jacobian by the point `y` of the camera frame is `P D`
//! with `D = [1 0 -p; 0 1 -q]`, `p = y0 / y2` and `q = y1 / y2`. All of an iteration is done with `D`: the 2x2 matrix `P`
//! and the weight go into the information `P' W P` and the gradient `P' W r` of the plane point.

use nalgebra::Vector3;

use super::memory::{ObservationSlot, Seen, Work};
use super::placement::Placement;
use super::small::{M3, S3, V3, add, cross, mul_transposed};
use crate::Real;
use crate::geometry::{Camera, CameraModel};
use crate::real::{abs, lit, sqrt};
use crate::robust::loss::Loss;

/// A loss, and the square up to which it is the square: most residuals ask no more.
pub(super) struct Robust<T> {
    loss: Loss<T>,
    squared_below: T,
    /// Whether steps take the curvature of the loss into account.
    pub(super) curved: bool,
}

impl<T: Real> Robust<T> {
    pub(super) fn new(loss: Loss<T>) -> Self {
        let squared_below = match loss {
            Loss::Squared => T::MAX,
            Loss::Huber(k) | Loss::Truncated(k) => k * k,
            _ => T::ZERO,
        };
        Self { loss, squared_below, curved: false }
    }

    /// Cost and weight of a squared residual.
    #[inline(always)]
    pub(super) fn evaluate(&self, squared: T) -> (T, T) {
        if squared < self.squared_below {
            return (squared, T::ONE);
        }
        if let Loss::Huber(k) = self.loss {
            let w = k / sqrt(squared);
            return (T::TWO * w * squared - self.squared_below, w);
        }
        self.loss.evaluate(squared)
    }
}

/// The squared length of the whitened residual; none where the camera does not see the point.
#[inline(always)]
pub(super) fn squared_residual<T: Real>(
    camera: &Camera<T>,
    at: &Placement<T>,
    x: &V3<T>,
    o: &ObservationSlot<T>,
) -> Option<T> {
    let y = at.in_camera(x);
    let pixel = match camera {
        Camera::Pinhole(c) => {
            if !(y[2] > T::ZERO && y[2] <= T::MAX) {
                return None;
            }
            let w = T::ONE / y[2];
            [c.fx() * (y[0] * w) + c.cx(), c.fy() * (y[1] * w) + c.cy()]
        }
        _ => camera.project(&Vector3::from(y))?.into(),
    };
    let r = [(pixel[0] - o.pixel[0]) * o.inverse_sigma, (pixel[1] - o.pixel[1]) * o.inverse_sigma];
    let squared = r[0] * r[0] + r[1] * r[1];
    (squared <= T::MAX).then_some(squared)
}

/// Linearises an observation into `work` and returns its robust cost, twice; none where the camera does not see the
/// point.
#[inline(always)]
pub(super) fn linearise<T: Real>(
    camera: &Camera<T>,
    at: &Placement<T>,
    x: &V3<T>,
    o: &ObservationSlot<T>,
    robust: &Robust<T>,
    work: &mut Work<T>,
) -> Option<T> {
    let y = at.in_camera(x);
    let Camera::Pinhole(c) = camera else { return linearise_any(camera, &y, o, robust, work) };
    if !(y[2] > T::ZERO) {
        return None;
    }
    let w = T::ONE / y[2];
    let plane = [-(y[0] * w), -(y[1] * w)];
    let (fx, fy) = (c.fx(), c.fy());
    let s = o.inverse_sigma;
    let r = [(c.cx() - fx * plane[0] - o.pixel[0]) * s, (c.cy() - fy * plane[1] - o.pixel[1]) * s];
    let scale = w * s;
    let (a, b) = (fx * scale, fy * scale);
    weighted(y, plane, r, [a * r[0], b * r[1]], [a * a, T::ZERO, b * b], 0, true, robust, work)
}

/// The same for a camera with distortion.
#[inline(never)]
fn linearise_any<T: Real>(
    camera: &Camera<T>,
    y: &V3<T>,
    o: &ObservationSlot<T>,
    robust: &Robust<T>,
    work: &mut Work<T>,
) -> Option<T> {
    let s = o.inverse_sigma;
    let (pixel, j) = camera.project_with_jacobian(&Vector3::from(*y))?;
    let r = [(pixel.x - o.pixel[0]) * s, (pixel.y - o.pixel[1]) * s];
    let mut y = *y;
    let mut columns = [[j.m11, j.m21], [j.m12, j.m22], [j.m13, j.m23]];
    // The plane lies across the optical axis unless the point is far to the side of it.
    let sideways = if abs(y[0]) > abs(y[1]) { (1, abs(y[0])) } else { (2, abs(y[1])) };
    let turn = if abs(y[2]) < lit::<T>(0.25) * sideways.1 { sideways.0 } else { 0 };
    for _ in 0..turn {
        y = [y[1], y[2], y[0]];
        columns = [columns[1], columns[2], columns[0]];
    }
    let [u, v] = [columns[0].map(|x| x * s), columns[1].map(|x| x * s)];
    let g = [u[0] * r[0] + u[1] * r[1], v[0] * r[0] + v[1] * r[1]];
    let info = [u[0] * u[0] + u[1] * u[1], u[0] * v[0] + u[1] * v[1], v[0] * v[0] + v[1] * v[1]];
    weighted(y, [-y[0] / y[2], -y[1] / y[2]], r, g, info, turn, false, robust, work)
}

/// Puts the weight in. `g` is `P' r`, `info` is `P' P`.
#[inline(always)]
fn weighted<T: Real>(
    y: V3<T>,
    plane: [T; 2],
    r: [T; 2],
    mut g: [T; 2],
    mut info: [T; 3],
    turn: u8,
    mut plain: bool,
    robust: &Robust<T>,
    work: &mut Work<T>,
) -> Option<T> {
    let squared = r[0] * r[0] + r[1] * r[1];
    // Every number of the observation is finite where this is.
    if !(squared + info[0] + info[2] + y[2] <= T::MAX) {
        return None;
    }
    let mut rho = squared;
    if !(squared < robust.squared_below) {
        let weight;
        (rho, weight) = robust.evaluate(squared);
        info = info.map(|x| x * weight);
        if robust.curved && matches!(robust.loss, Loss::Huber(_)) {
            // Huber's loss has no curvature along the residual: W = weight (I - r r' / r^2), of which three quarters
            // leave it definite. Without that, plain re-weighting, steps are short where outliers pull.
            let bend = lit::<T>(0.75) * weight / squared;
            plain = false;
            info[0] -= bend * g[0] * g[0];
            info[1] -= bend * g[0] * g[1];
            info[2] -= bend * g[1] * g[1];
        }
        g = [g[0] * weight, g[1] * weight];
    }
    let none = [[T::ZERO; 3]; 2];
    *work = Work::Seen(Seen { y, plane, info, g, n: none, rotation: none, turn, plain });
    Some(rho)
}

impl<T: Real> Seen<T> {
    /// Adds what the observation says of the point to its block `b' P' W P b`, where `b = D R`; `then` gets the rows of
    /// `P' W P b` and `P' W r`.
    #[inline(always)]
    pub(super) fn add_to_point(
        &self,
        rotation: &M3<T>,
        v: &mut S3<T>,
        mut then: impl FnMut(usize, V3<T>, V3<T>),
    ) {
        let row = |i: usize, k: usize, m: T| {
            let (a, b) = (&rotation[i], &rotation[k]);
            [a[0] + m * b[0], a[1] + m * b[1], a[2] + m * b[2]]
        };
        let [a, h, b] = self.info;
        if self.plain {
            for (k, scale) in [a, b].into_iter().enumerate() {
                let row = row(k, 2, self.plane[k]);
                let weighted = row.map(|x| x * scale);
                add_product(v, &row, &weighted);
                then(k, row, weighted);
            }
            return;
        }
        let [i, j, k] = match self.turn {
            0 => [0, 1, 2],
            1 => [1, 2, 0],
            _ => [2, 0, 1],
        };
        let rows = [row(i, k, self.plane[0]), row(j, k, self.plane[1])];
        for (k, [a, b]) in [[a, h], [h, b]].into_iter().enumerate() {
            let [p, q] = &rows;
            let weighted = [a * p[0] + b * q[0], a * p[1] + b * q[1], a * p[2] + b * q[2]];
            add_product(v, &rows[k], &weighted);
            then(k, rows[k], weighted);
        }
    }

    /// Jacobian of the plane point by the frame's rotation: `D [y]x'`.
    #[inline(always)]
    pub(super) fn rotation_jacobian(&self) -> [V3<T>; 2] {
        let (y, [p, q]) = (&self.y, self.plane);
        [[p * y[1], y[2] - p * y[0], -y[1]], [q * y[1] - y[2], -(q * y[0]), y[0]]]
    }

    /// How a motion of the frame moves the plane point.
    #[inline(always)]
    pub(super) fn moved_by(&self, d: &[T; 6]) -> [T; 2] {
        let [a, b, c, e, f, g] = *d;
        let [w, v] = match self.turn {
            0 => [[a, b, c], [e, f, g]],
            1 => [[b, c, a], [f, g, e]],
            _ => [[c, a, b], [g, e, f]],
        };
        let h = add(&cross(&w, &self.y), &v);
        [h[0] + self.plane[0] * h[2], h[1] + self.plane[1] * h[2]]
    }
}

/// Adds `a b'` to a symmetric matrix that it leaves symmetric.
#[inline(always)]
fn add_product<T: Real>(v: &mut S3<T>, a: &V3<T>, b: &V3<T>) {
    v[0] += a[0] * b[0];
    v[1] += a[0] * b[1];
    v[2] += a[0] * b[2];
    v[3] += a[1] * b[1];
    v[4] += a[1] * b[2];
    v[5] += a[2] * b[2];
}

/// The two rows of an observation, whitened and weighted.
pub(super) struct Rows<T> {
    /// By the frame's rotation.
    pub(super) turn: [V3<T>; 2],
    /// By the point in the camera frame, which is by the frame's translation.
    pub(super) shift: [V3<T>; 2],
    /// By the point in the world.
    pub(super) point: [V3<T>; 2],
    /// Residual.
    pub(super) r: [T; 2],
}

/// The rows of an observation for a square root; none where the camera does not see the point.
pub(super) fn rows<T: Real>(
    camera: &Camera<T>,
    at: &Placement<T>,
    x: &V3<T>,
    o: &ObservationSlot<T>,
    loss: &Loss<T>,
) -> Option<Rows<T>> {
    let y = at.in_camera(x);
    let (pixel, j) = camera.project_with_jacobian(&Vector3::from(y))?;
    let r = [(pixel.x - o.pixel[0]) * o.inverse_sigma, (pixel.y - o.pixel[1]) * o.inverse_sigma];
    let scale = sqrt(loss.evaluate(r[0] * r[0] + r[1] * r[1]).1);
    let shift =
        [[j.m11, j.m12, j.m13], [j.m21, j.m22, j.m23]].map(|d| d.map(|x| x * o.inverse_sigma * scale));
    let rotation: &M3<T> = &at.rotation;
    Some(Rows {
        turn: [cross(&y, &shift[0]), cross(&y, &shift[1])],
        point: [mul_transposed(rotation, &shift[0]), mul_transposed(rotation, &shift[1])],
        shift,
        r: r.map(|r| r * scale),
    })
}
