//! The uncertainty of a refined homography.

use nalgebra::{SMatrix, Vector2};

use super::super::frame::PixelFrame;
use super::super::scatter::Scatter;
use crate::Real;
use crate::linalg::{LANES, Ldlt, Lu};
use crate::real::{max, min};
use crate::refine::blocks::{BlockSlice, PlaneBlock};
use crate::refine::homography::HomographyModel;
use crate::refine::lm::{NormalEquations, Tangents};

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
