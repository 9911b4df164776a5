//! The uncertainty of a refined homography.

use nalgebra::{SMatrix, Vector2};

use super::super::frame::PixelFrame;
use crate::Real;
use crate::linalg::{LANES, Ldlt, Lu};
use crate::real::{from_u32, max, min};
use crate::refine::blocks::{BlockSlice, EpipolarBlock, PlaneBlock};
use crate::refine::homography::{HomographyModel, transfer_sq};
use crate::refine::lm::{NormalEquations, Tangents};

/// The scatter of residuals under Tukey's biweight, as the asymptotic covariance of an M-estimate needs it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scatter<T> {
    /// Sum of the weights.
    weights: T,
    /// Sum over both coordinates of the squared weighted residuals, halved.
    squares: T,
    /// Sum of the mean derivative of a weighted residual by its residual.
    slopes: T,
    /// How many correspondences lie within the support.
    count: u32,
}

impl<T: Real> Scatter<T> {
    /// The scatter about a model; `support` is where the biweight vanishes.
    pub(super) fn new(data: BlockSlice<'_, PlaneBlock<T>>, model: &HomographyModel<T>, support: T) -> Self {
        let inverse = T::ONE / (support * support);
        let three = T::TWO + T::ONE;
        let mut result = Self { weights: T::ZERO, squares: T::ZERO, slopes: T::ZERO, count: 0 };
        let mut left = data.count;
        for block in data.blocks {
            let (plane, weight) = block.planes();
            for (l, squared) in transfer_sq(&model.0, &plane, &weight).into_iter().enumerate().take(LANES) {
                let u = squared * inverse;
                if l < left && u < T::ONE {
                    let v = T::ONE - u;
                    let weight = v * v;
                    result.weights += weight;
                    result.squares += weight * weight * squared * T::HALF;
                    result.slopes += v * (T::ONE - three * u);
                    result.count += 1;
                }
            }
            left = left.saturating_sub(LANES);
        }
        result
    }

    /// By how much the inverse of `J' W J` is to be multiplied: `E[psi psi'] E[psi']^-2` of the residuals, times the mean weight.
    fn factor(&self) -> Option<T> {
        (self.slopes > T::ZERO)
            .then(|| self.fitted() * self.squares * self.weights / (self.slopes * self.slopes))
    }

    /// By how much two residuals a correspondence are too small about a model of eight parameters fitted to them.
    fn fitted(&self) -> T {
        let n = core::cmp::max(self.count, 5);
        from_u32::<T>(n) / from_u32::<T>(n - 4)
    }

    /// Variance of one coordinate's noise.
    pub(super) fn variance(&self) -> T {
        if self.slopes > T::ZERO { self.fitted() * self.squares / self.slopes } else { T::ZERO }
    }
}

/// The corners of the box around the inliers in view 1, drawn towards its points' mean until the plane's horizon is far.
pub(super) fn corners<T: Real>(
    data: BlockSlice<'_, PlaneBlock<T>>,
    model: &HomographyModel<T>,
    mask: &[bool],
) -> [[T; 2]; 4] {
    let (mut low, mut high, mut sum) = ([T::MAX; 2], [-T::MAX; 2], [T::ZERO; 2]);
    let mut number = T::ZERO;
    let mut entries = mask.iter();
    for block in data.blocks {
        for (l, &inlier) in (0..LANES).zip(entries.by_ref()) {
            if inlier {
                number += T::ONE;
                for k in 0..2 {
                    low[k] = min(low[k], block[k][l]);
                    high[k] = max(high[k], block[k][l]);
                    sum[k] += block[k][l];
                }
            }
        }
    }
    let mean = [sum[0] / number, sum[1] / number];
    let box_corners = [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]];
    // The depth of the transferred point is linear: positive at the mean of the inliers, least at a corner.
    let m = &model.0.data.0;
    let depth = |p: &[T; 2]| m[0][2] * p[0] + m[1][2] * p[1] + m[2][2];
    let at_mean = depth(&mean);
    let mut drop = T::ZERO;
    for corner in &box_corners {
        drop = max(drop, at_mean - depth(corner));
    }
    let allowed = at_mean * (T::ONE - T::HALF * T::HALF);
    let share = if drop > allowed { allowed / drop } else { T::ONE };
    box_corners.map(|c| [mean[0] + (c[0] - mean[0]) * share, mean[1] + (c[1] - mean[1]) * share])
}

/// The 8x8 covariance in pixels of the transferred corners; none where the equations or the corners are singular.
pub(super) fn covariance<T: Real>(
    model: &HomographyModel<T>,
    equations: &NormalEquations<T, 8>,
    scatter: &Scatter<T>,
    corners: &[[T; 2]; 4],
    frame: &PixelFrame<T>,
) -> Option<SMatrix<T, 8, 8>> {
    let inverse = Ldlt::new(&equations.hessian)?.inverse();
    let scale = scatter.factor()? * frame.pixels * frame.pixels;
    let m = &model.0.data.0;
    let tangents = model.tangents();
    let mut jacobian = SMatrix::<T, 8, 8>::zeros();
    for (column, t) in jacobian.data.0.iter_mut().zip(&tangents) {
        for (pair, &[x, y]) in column.as_chunks_mut::<2>().0.iter_mut().zip(corners) {
            let inverse_z = T::ONE / (m[0][2] * x + m[1][2] * y + m[2][2]);
            let u = (m[0][0] * x + m[1][0] * y + m[2][0]) * inverse_z;
            let v = (m[0][1] * x + m[1][1] * y + m[2][1]) * inverse_z;
            let z = t[6] * x + t[7] * y + t[8];
            *pair = [
                (t[0] * x + t[1] * y + t[2] - u * z) * inverse_z,
                (t[3] * x + t[4] * y + t[5] - v * z) * inverse_z,
            ];
        }
    }
    // Singular where the corners themselves determine no homography.
    Lu::new(&jacobian)?;
    let half = jacobian * inverse;
    let mut covariance = half * jacobian.transpose();
    covariance *= scale;
    crate::real::is_finite(covariance.norm_squared()).then_some(covariance)
}

/// Pixels of view 1.
pub(super) fn to_pixels<T: Real>(frame: &PixelFrame<T>, point: [T; 2]) -> Vector2<T> {
    Vector2::new(point[0] * frame.pixels + frame.centre1[0], point[1] * frame.pixels + frame.centre1[1])
}
