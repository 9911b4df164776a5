//! One observation: residual, Jacobian, robust weight.

use nalgebra::Vector3;

use super::memory::ObservationSlot;
use super::placement::Placement;
use super::small::{M3, S3, V3};
use crate::Real;
use crate::geometry::{Camera, CameraModel};
use crate::robust::loss::Loss;

/// An observation linearised: with a motion `(w, v)` of the frame and `dx` of the point, the whitened residual is
/// `r + d (w x y + v) + b dx`.
pub(super) struct Linear<T> {
    /// The point in the camera frame.
    pub(super) y: V3<T>,
    /// Whitened residual.
    pub(super) r: [T; 2],
    /// Jacobian by the point in the camera frame.
    pub(super) d: [V3<T>; 2],
    /// Jacobian by the point in the world.
    pub(super) b: [V3<T>; 2],
    /// Robust weight.
    pub(super) weight: T,
    /// Curvature of the loss along the residual: the weight matrix is `weight (I - bend r r')`.
    pub(super) bend: T,
    /// Robust cost, twice.
    pub(super) rho: T,
}

/// The whitened residual; none where the camera does not see the point.
#[inline(always)]
pub(super) fn residual<T: Real>(
    camera: &Camera<T>,
    at: &Placement<T>,
    x: &V3<T>,
    o: &ObservationSlot<T>,
) -> Option<[T; 2]> {
    let pixel = camera.project(&Vector3::from(at.to_camera(x)))?;
    Some([(pixel.x - o.pixel[0]) * o.inverse_sigma, (pixel.y - o.pixel[1]) * o.inverse_sigma])
}

#[inline(always)]
pub(super) fn linearise<T: Real>(
    camera: &Camera<T>,
    at: &Placement<T>,
    x: &V3<T>,
    o: &ObservationSlot<T>,
    loss: &Loss<T>,
    curved: bool,
) -> Option<Linear<T>> {
    let y = at.to_camera(x);
    let (pixel, j) = camera.project_with_jacobian(&Vector3::from(y))?;
    let s = o.inverse_sigma;
    let r = [(pixel.x - o.pixel[0]) * s, (pixel.y - o.pixel[1]) * s];
    let d = [[j.m11 * s, j.m12 * s, j.m13 * s], [j.m21 * s, j.m22 * s, j.m23 * s]];
    let q = &at.rotation;
    let row = |d: &V3<T>| super::small::mul_transposed(q, d);
    let b = [row(&d[0]), row(&d[1])];
    let squared = r[0] * r[0] + r[1] * r[1];
    let (rho, weight) = loss.evaluate(squared);
    Some(Linear { y, r, d, b, weight, bend: if curved { bend(loss, squared) } else { T::ZERO }, rho })
}

/// Twice the loss's second derivative over its first, with the sign turned and at most what leaves the weight matrix
/// semi-definite. Beyond its threshold Huber's loss has no curvature along the residual; leaving that out, as plain
/// re-weighting does, makes the steps short where outliers pull.
#[inline(always)]
fn bend<T: Real>(loss: &Loss<T>, squared: T) -> T {
    match *loss {
        Loss::Huber(k) if squared > k * k => crate::real::lit::<T>(0.75) / squared,
        _ => T::ZERO,
    }
}

impl<T: Real> Linear<T> {
    /// The weight matrix times a 2-vector.
    #[inline(always)]
    pub(super) fn weigh(&self, v: [T; 2]) -> [T; 2] {
        let along = (v[0] * self.r[0] + v[1] * self.r[1]) * self.bend;
        [self.weight * (v[0] - along * self.r[0]), self.weight * (v[1] - along * self.r[1])]
    }

    /// The weight matrix times the rows of `b`.
    #[inline(always)]
    pub(super) fn weighted_b(&self) -> [V3<T>; 2] {
        let b = &self.b;
        let columns =
            [self.weigh([b[0][0], b[1][0]]), self.weigh([b[0][1], b[1][1]]), self.weigh([b[0][2], b[1][2]])];
        [[columns[0][0], columns[1][0], columns[2][0]], [columns[0][1], columns[1][1], columns[2][1]]]
    }

    /// Adds `b' W b`.
    #[inline(always)]
    pub(super) fn add_point_block(&self, wb: &[V3<T>; 2], v: &mut S3<T>) {
        let [p, q] = &self.b;
        let [wp, wq] = wb;
        v[0] += p[0] * wp[0] + q[0] * wq[0];
        v[1] += p[0] * wp[1] + q[0] * wq[1];
        v[2] += p[0] * wp[2] + q[0] * wq[2];
        v[3] += p[1] * wp[1] + q[1] * wq[1];
        v[4] += p[1] * wp[2] + q[1] * wq[2];
        v[5] += p[2] * wp[2] + q[2] * wq[2];
    }

    /// `d' W b` and `d' W d`.
    #[inline(always)]
    pub(super) fn camera_blocks(&self, wb: &[V3<T>; 2]) -> (M3<T>, M3<T>) {
        let d = &self.d;
        let mut u = [[T::ZERO; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                u[i][j] = d[0][i] * wb[0][j] + d[1][i] * wb[1][j];
            }
        }
        let columns =
            [self.weigh([d[0][0], d[1][0]]), self.weigh([d[0][1], d[1][1]]), self.weigh([d[0][2], d[1][2]])];
        let mut m = [[T::ZERO; 3]; 3];
        for i in 0..3 {
            for j in i..3 {
                m[i][j] = d[0][i] * columns[j][0] + d[1][i] * columns[j][1];
                m[j][i] = m[i][j];
            }
        }
        (u, m)
    }

    /// `d' weight r`, the gradient by the point in the camera frame.
    #[inline(always)]
    pub(super) fn gradient(&self) -> V3<T> {
        let g = [self.weight * self.r[0], self.weight * self.r[1]];
        let d = &self.d;
        [d[0][0] * g[0] + d[1][0] * g[1], d[0][1] * g[0] + d[1][1] * g[1], d[0][2] * g[0] + d[1][2] * g[1]]
    }
}
