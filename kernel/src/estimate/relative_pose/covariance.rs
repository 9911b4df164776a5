//! Covariances of refined models from their normal equations and a robust noise scale.

use nalgebra::{Matrix3, SMatrix, Vector3};

use crate::Real;
use crate::geometry::pose::{skew, tangent_basis};
use crate::linalg::Ldlt;
use crate::real::{from_u32, max};
use crate::refine::homography::HomographyModel;
use crate::refine::lm::{Manifold, NormalEquations};
use crate::refine::relative_pose::Scales;

/// `variance (J' J)^-1`; none where the equations are singular.
pub(super) fn covariance<T: Real, const P: usize>(
    sums: &NormalEquations<T, P>,
    variance: T,
) -> Option<SMatrix<T, P, P>> {
    Ldlt::new(&sums.hessian).map(|factors| factors.inverse() * variance)
}

/// The mean squared residual of the active correspondences of a truncated loss, `dimension` residuals each.
pub(super) fn variance<T: Real, const P: usize>(
    sums: &NormalEquations<T, P>,
    count: usize,
    beyond: T,
    dimension: u32,
) -> T {
    let outside = from_u32::<T>((count as u32).saturating_sub(sums.active));
    let free = (sums.active * dimension).saturating_sub(P as u32);
    max(sums.cost - outside * beyond, T::ZERO) / from_u32(core::cmp::max(free, 1))
}

/// The 8x8 covariance of `(w, t / d, n)` with `H = Exp(w) R + (t / d) n'`, n in its tangent basis, from the equations
/// of the homography `model`.
pub(super) fn planar_covariance<T: Real>(
    rotation: &Matrix3<T>,
    t: &Vector3<T>,
    n: &Vector3<T>,
    model: &HomographyModel<T>,
    sums: &NormalEquations<T, 8>,
    scales: &Scales<T>,
    variance: T,
) -> Option<SMatrix<T, 8, 8>> {
    let h = scales.transfer(&(rotation + t * n.transpose()));
    // The model is h scaled to length 1; a step of h moves it by its part orthogonal to h, scaled alike.
    let scale = T::ONE / crate::real::sqrt(h.norm_squared());
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let basis = tangent_basis(n);
    let mut steps = [Matrix3::zeros(); 8];
    for (k, axis) in axes.iter().enumerate() {
        steps[k] = skew(axis) * rotation;
        steps[3 + k] = axis * n.transpose();
    }
    steps[6] = t * basis.column(0).transpose();
    steps[7] = t * basis.column(1).transpose();
    let tangents = model.tangents();
    let mut jacobian = SMatrix::<T, 8, 8>::zeros();
    for (q, step) in steps.iter().enumerate() {
        let moved = scales.transfer(step) * scale;
        for p in 0..8 {
            let mut sum = T::ZERO;
            for i in 0..3 {
                for j in 0..3 {
                    sum += tangents[p][3 * i + j] * moved.data.0[j][i];
                }
            }
            jacobian.data.0[q][p] = sum;
        }
    }
    let information = jacobian.transpose() * sums.hessian * jacobian;
    Ldlt::new(&information).map(|factors| factors.inverse() * variance)
}
