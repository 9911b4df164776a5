//! The transfer error `x2 ~ H x1` on blocks, and the models that it refines: homographies and rotations.
//!
//! The squared error is Sampson's: `e' (I + J J')^-1 e` with `e` the transfer error in view 2 and `J` the Jacobian of
//! the transferred point by the point of view 1, so that noise in both views counts.

use nalgebra::{Matrix3, SVector, Vector3};

use super::blocks::{Block, BlockSlice, EpipolarBlock, PlaneBlock};
use super::lm::{Manifold, NormalEquations, Tangents};
use super::relative_pose::{Scales, cayley};
use crate::Real;
use crate::linalg::{LANES, Lanes, cross, product};
use crate::real::{abs, from_u32, sqrt};
use crate::robust::loss::Loss;

/// One transferred point.
struct Transfer<T> {
    /// The transferred point.
    u: T,
    v: T,
    /// The error.
    ex: T,
    ey: T,
    /// Inverse of its covariance: xx, xy, yy.
    w: [T; 3],
    /// The error's squared length in that metric.
    squared: T,
    /// 1 / depth of the transferred point; not positive where it has left the image plane.
    inverse_z: T,
}

impl<T: Real> Transfer<T> {
    #[cfg_attr(not(small), inline(always))]
    fn new(h: &Matrix3<T>, x1: T, y1: T, x2: T, y2: T) -> Self {
        let m = &h.data.0;
        let inverse_z = T::ONE / (m[0][2] * x1 + m[1][2] * y1 + m[2][2]);
        let u = (m[0][0] * x1 + m[1][0] * y1 + m[2][0]) * inverse_z;
        let v = (m[0][1] * x1 + m[1][1] * y1 + m[2][1]) * inverse_z;
        let (a, b) = ((m[0][0] - u * m[0][2]) * inverse_z, (m[1][0] - u * m[1][2]) * inverse_z);
        let (c, d) = ((m[0][1] - v * m[0][2]) * inverse_z, (m[1][1] - v * m[1][2]) * inverse_z);
        let (xx, xy, yy) = (T::ONE + a * a + b * b, a * c + b * d, T::ONE + c * c + d * d);
        // The determinant xx yy - xy^2 and the quadratic form, as sums of squares: positive whatever the rounding.
        let area = a * d - b * c;
        let scale = T::ONE / (xx + c * c + d * d + area * area);
        let (ex, ey) = (u - x2, v - y2);
        let (p, q) = (c * ex - a * ey, d * ex - b * ey);
        let squared = (ex * ex + ey * ey + p * p + q * q) * scale;
        Self { u, v, ex, ey, w: [yy * scale, -xy * scale, xx * scale], squared, inverse_z }
    }
}

/// Squared transfer errors of a block times `scale`; `T::MAX` where the transferred point is not in front of view 2 or not a
/// number.
#[cfg_attr(not(small), inline(always))]
pub(crate) fn transfer_sq<T: Real, B: EpipolarBlock<T>>(h: &Matrix3<T>, block: &B, scale: T) -> Lanes<T> {
    let mut squared = [T::MAX; LANES];
    for l in 0..LANES {
        let Some(([x1, y1, x2, y2], weight)) = block.on_planes(l) else { break };
        let t = Transfer::new(h, x1, y1, x2, y2);
        let s = t.squared * (weight * scale);
        squared[l] = if t.inverse_z > T::ZERO && s <= T::MAX { s } else { T::MAX };
    }
    squared
}

/// The symmetric 3x3 array of its entries 00, 01, 11, 02, 12, 22.
fn symmetric<X: Copy>([a, b, c, d, e, f]: [X; 6]) -> [[X; 3]; 3] {
    [[a, b, d], [b, c, e], [d, e, f]]
}

/// Lanes of which the terms are held before they are added.
const SIDE_BY_SIDE: usize = if cfg!(scalar) { 1 } else { LANES };

/// Sums of a pass, lane by lane.
struct Sums<T> {
    /// Six scalars (00, 01, 11, 02, 12, 22 of the rows of H) times the six products of the point's coordinates.
    products: [[Lanes<T>; 6]; 6],
    slopes: [[Lanes<T>; 3]; 3],
    cost: Lanes<T>,
}

impl<T: Real> Sums<T> {
    /// Of no correspondences: a constant, so that it is made in place.
    const ZERO: Self = Self {
        products: [[[T::ZERO; LANES]; 6]; 6],
        slopes: [[[T::ZERO; LANES]; 3]; 3],
        cost: [T::ZERO; LANES],
    };

    /// Adds the lanes of a block of which the first `filled` count.
    #[cfg_attr(not(small), inline(always))]
    fn add(
        &mut self,
        h: &Matrix3<T>,
        plane: &PlaneBlock<T>,
        weights: &Lanes<T>,
        loss: &Loss<T>,
        filled: usize,
    ) {
        for group in 0..LANES / SIDE_BY_SIDE {
            let zero = [T::ZERO; SIDE_BY_SIDE];
            let (mut row, mut slope, mut point, mut along) = ([zero; 6], [zero; 3], [zero; 6], [zero; 3]);
            for k in 0..SIDE_BY_SIDE {
                let l = group * SIDE_BY_SIDE + k;
                let (x, y) = (plane[0][l], plane[1][l]);
                let t = Transfer::new(h, x, y, plane[2][l], plane[3][l]);
                let mut weight = T::ZERO;
                if l < filled {
                    let (cost, w) = loss.evaluate(t.squared * weights[l]);
                    self.cost[l] += cost;
                    weight = w * weights[l];
                }
                let (w00, w01, w11) = (weight * t.w[0], weight * t.w[1], weight * t.w[2]);
                let (w02, w12) = (-(w00 * t.u + w01 * t.v), -(w01 * t.u + w11 * t.v));
                let w22 = -(w02 * t.u + w12 * t.v);
                (row[0][k], row[1][k], row[2][k]) = (w00, w01, w11);
                (row[3][k], row[4][k], row[5][k]) = (w02, w12, w22);
                let (a, b, c) = (x * t.inverse_z, y * t.inverse_z, t.inverse_z);
                (point[0][k], point[1][k], point[2][k]) = (a * a, a * b, b * b);
                (point[3][k], point[4][k], point[5][k]) = (a * c, b * c, c * c);
                (along[0][k], along[1][k], along[2][k]) = (a, b, c);
                let (p, q) = (w00 * t.ex + w01 * t.ey, w01 * t.ex + w11 * t.ey);
                (slope[0][k], slope[1][k], slope[2][k]) = (p, q, -(t.u * p + t.v * q));
            }
            for i in 0..6 {
                for j in 0..6 {
                    for k in 0..SIDE_BY_SIDE {
                        self.products[i][j][group * SIDE_BY_SIDE + k] += row[i][k] * point[j][k];
                    }
                }
            }
            for i in 0..3 {
                for j in 0..3 {
                    for k in 0..SIDE_BY_SIDE {
                        self.slopes[i][j][group * SIDE_BY_SIDE + k] += slope[i][k] * along[j][k];
                    }
                }
            }
        }
    }
}

/// The normal equations of all nine entries of `H`.
struct EntryEquations<T> {
    /// `J' W J`: pairs of rows and pairs of columns of H, as [`symmetric`] has them.
    products: [[T; 6]; 6],
    /// `J' W r`.
    slopes: [[T; 3]; 3],
    cost: T,
    active: u32,
}

impl<T: Real> EntryEquations<T> {
    const ZERO: Self =
        Self { products: [[T::ZERO; 6]; 6], slopes: [[T::ZERO; 3]; 3], cost: T::ZERO, active: 0 };
}

/// One pass over all correspondences for `x2 ~ H x1`. Those beyond the loss's support are left out; the others are packed
/// into full blocks first, so that the derivatives are computed for them alone.
fn entry_equations<T: Real, B: EpipolarBlock<T>>(
    data: BlockSlice<'_, B>,
    h: &Matrix3<T>,
    loss: &Loss<T>,
) -> EntryEquations<T> {
    let mut sums = Sums::<T>::ZERO;
    let support = loss.support().unwrap_or(T::MAX);
    let beyond = if support < T::MAX { loss.evaluate(support).0 } else { T::ZERO };
    let mut active = 0u32;
    let (mut pending, mut pending_weights) = (PlaneBlock::zero(), [T::ZERO; LANES]);
    let mut filled = 0usize;
    let mut left = data.count;
    for block in data.blocks {
        let squared = transfer_sq(h, block, T::ONE);
        for l in 0..LANES {
            if l < left
                && squared[l] < support
                && let Some((points, weight)) = block.on_planes(l)
            {
                pending.write_lane(filled, &points);
                if let Some(place) = pending_weights.get_mut(filled) {
                    *place = weight;
                }
                filled += 1;
                active += 1;
                if filled == LANES {
                    sums.add(h, &pending, &pending_weights, loss, LANES);
                    filled = 0;
                }
            }
        }
        left = left.saturating_sub(LANES);
    }
    if filled > 0 {
        sums.add(h, &pending, &pending_weights, loss, filled);
    }
    let total = |lanes: &Lanes<T>| (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
    let mut result = EntryEquations::ZERO;
    for (entry, lanes) in result.products.as_flattened_mut().iter_mut().zip(sums.products.as_flattened()) {
        *entry = total(lanes);
    }
    for (entry, lanes) in result.slopes.as_flattened_mut().iter_mut().zip(sums.slopes.as_flattened()) {
        *entry = total(lanes);
    }
    let outside = (data.count as u32).saturating_sub(active);
    result.cost = total(&sums.cost) + from_u32::<T>(outside) * beyond;
    result.active = active;
    result
}

/// The normal equations of a model of `x2 ~ H x1`.
#[cfg_attr(small, inline(never))]
pub(crate) fn transfer_equations<T, B, M, const P: usize>(
    data: BlockSlice<'_, B>,
    model: &M,
    loss: &Loss<T>,
) -> NormalEquations<T, P>
where
    T: Real,
    B: EpipolarBlock<T>,
    M: Tangents<T, P>,
{
    let entries = entry_equations(data, &model.matrix(), loss);
    let mut sums = NormalEquations { cost: entries.cost, active: entries.active, ..NormalEquations::zero() };
    let NormalEquations { hessian, gradient, .. } = &mut sums;
    along_tangents(
        &entries,
        &model.tangents(),
        hessian.data.0.as_flattened_mut(),
        gradient.data.0.as_flattened_mut(),
    );
    sums
}

/// The normal equations of a model whose matrix moves along `tangents`: hessian, column by column, and gradient. Where code
/// is to be small one function serves all models, and its numbers take no stack during the pass.
#[cfg_attr(not(small), inline(always))]
#[cfg_attr(small, inline(never))]
fn along_tangents<T: Real>(
    entries: &EntryEquations<T>,
    tangents: &[[T; 9]],
    hessian: &mut [T],
    gradient: &mut [T],
) {
    let blocks = entries.products.map(symmetric);
    let products = symmetric(blocks.each_ref());
    for (q, (tangent, slope)) in tangents.iter().zip(gradient).enumerate() {
        let mut image = [T::ZERO; 9];
        for i in 0..3 {
            for j in 0..3 {
                let mut sum = T::ZERO;
                for k in 0..3 {
                    for m in 0..3 {
                        sum += products[i][k][j][m] * tangent[3 * k + m];
                    }
                }
                image[3 * i + j] = sum;
                *slope += entries.slopes[i][j] * tangent[3 * i + j];
            }
        }
        for (p, other) in tangents.iter().enumerate().take(q + 1) {
            let mut sum = T::ZERO;
            for k in 0..9 {
                sum += other[k] * image[k];
            }
            for place in [q * tangents.len() + p, p * tangents.len() + q] {
                if let Some(entry) = hessian.get_mut(place) {
                    *entry = sum;
                }
            }
        }
    }
}

/// A homography with |H| = 1 and positive determinant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HomographyModel<T: Real>(pub(crate) Matrix3<T>);

impl<T: Real> HomographyModel<T> {
    /// Scales a homography; none where it is singular or not finite.
    pub(crate) fn new(h: &Matrix3<T>) -> Option<Self> {
        let size = sqrt(h.norm_squared());
        if !(size > T::ZERO && size <= T::MAX) {
            return None;
        }
        let mut h = h * (T::ONE / size);
        let determinant = h.determinant();
        if determinant < T::ZERO {
            h *= -T::ONE;
        }
        (abs(determinant) > T::EPSILON).then_some(Self(h))
    }
}

impl<T: Real> Manifold<T, 8> for HomographyModel<T> {
    fn matrix(&self) -> Matrix3<T> {
        self.0
    }

    fn retract(&self, step: &SVector<T, 8>) -> Self {
        let basis = self.tangents();
        let mut h = self.0;
        for i in 0..3 {
            for j in 0..3 {
                for p in 0..8 {
                    h.data.0[j][i] += basis[p][3 * i + j] * step.data.0[0][p];
                }
            }
        }
        Self(h * (T::ONE / sqrt(h.norm_squared())))
    }
}

impl<T: Real> Tangents<T, 8> for HomographyModel<T> {
    /// An orthonormal basis of the directions that change more than the scale: the columns, but the first, of the
    /// reflection that takes the first axis to -h or h.
    fn tangents(&self) -> [[T; 9]; 8] {
        let m = self.0.transpose();
        let mut v = [T::ZERO; 9];
        for (v, &h) in v.iter_mut().zip(m.iter()) {
            *v = h;
        }
        v[0] += if v[0] < T::ZERO { -T::ONE } else { T::ONE };
        let scale = T::TWO / v.iter().fold(T::ZERO, |sum, &x| sum + x * x);
        let mut basis = [[T::ZERO; 9]; 8];
        for p in 0..8 {
            for k in 0..9 {
                basis[p][k] = -(scale * v[p + 1] * v[k]);
            }
            basis[p][p + 1] += T::ONE;
        }
        basis
    }
}

/// A rotation between two views, as a homography of the blocks' coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RotationModel<T: Real> {
    pub(crate) rotation: Matrix3<T>,
    pub(crate) scales: Scales<T>,
}

impl<T: Real> Manifold<T, 3> for RotationModel<T> {
    #[cfg_attr(small, inline(never))]
    fn matrix(&self) -> Matrix3<T> {
        self.scales.transfer(&self.rotation)
    }

    fn retract(&self, step: &SVector<T, 3>) -> Self {
        let w = Vector3::new(step.data.0[0][0], step.data.0[0][1], step.data.0[0][2]);
        Self { rotation: product(&cayley(&w), &self.rotation), scales: self.scales }
    }
}

impl<T: Real> Tangents<T, 3> for RotationModel<T> {
    fn tangents(&self) -> [[T; 9]; 3] {
        let mut result = [[T::ZERO; 9]; 3];
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        for (tangent, axis) in result.iter_mut().zip(axes) {
            let m = self.scales.transfer(&cross(&axis, &self.rotation));
            for i in 0..3 {
                for j in 0..3 {
                    tangent[3 * i + j] = m.data.0[j][i];
                }
            }
        }
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blocks() -> [PlaneBlock<f64>; 3] {
        let mut blocks = [[[0.0; 4]; 4]; 3];
        for (i, x) in blocks.iter_mut().flatten().flatten().enumerate() {
            *x = ((i * i) as f64 * 0.7).sin();
        }
        blocks
    }

    /// The weight of the Sampson error is held fixed in a step, so the gradient of the cost with fixed weights is
    /// what the sums must give: checked where the error itself is zero, by the curvature.
    #[test]
    fn curvature_agrees_with_central_differences_at_the_truth() {
        let h = Matrix3::new(1.0, 0.1, 0.05, -0.08, 0.95, 0.1, 0.1, -0.2, 1.1);
        let model = HomographyModel::new(&h).unwrap();
        let mut blocks = blocks();
        for block in &mut blocks {
            for l in 0..4 {
                let y = h * Vector3::new(block[0][l], block[1][l], 1.0);
                (block[2][l], block[3][l]) = (y.x / y.z, y.y / y.z);
            }
        }
        let data = BlockSlice { blocks: &blocks, count: 11 };
        let sums = transfer_equations::<_, _, _, 8>(data, &model, &Loss::Squared);
        assert!(sums.cost < 1e-25 && sums.active == 11);
        for p in 0..8 {
            let step = 1e-5;
            let moved = |s: f64| {
                let mut delta = SVector::<f64, 8>::zeros();
                delta[p] = s;
                transfer_equations::<_, _, _, 8>(data, &model.retract(&delta), &Loss::Squared).cost
            };
            let curvature = (moved(step) + moved(-step)) / (2.0 * step * step);
            let expected = sums.hessian[(p, p)];
            assert!((curvature / expected - 1.0).abs() < 1e-4, "{p}: {curvature} {expected}");
        }
    }
}
