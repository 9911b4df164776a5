//! Covariances of refined models from their normal equations and a robust noise scale.

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::super::scatter::student;
use crate::Real;
use crate::geometry::pose::tangent_basis;
use crate::linalg::{add_outer, cross, scaled_inverse};
use crate::real::{from_u32, lit, max, sqrt};
use crate::refine::homography::HomographyModel;
use crate::refine::lm::{NormalEquations, Tangents};
use crate::refine::relative_pose::Scales;

/// `variance (J' J)^-1`; none where the equations are singular.
pub(super) fn covariance<T: Real, const P: usize>(
    sums: &NormalEquations<T, P>,
    variance: T,
) -> Option<SMatrix<T, P, P>> {
    scaled_inverse(&sums.hessian, variance)
}

/// Sums over residuals within the support of Tukey's loss: of `r psi`, of `psi^2` and of `psi'`, in units of the support.
#[derive(Clone, Copy, Debug)]
pub(super) struct PsiSums<T> {
    weights: T,
    r_psi: T,
    psi_sq: T,
    slope: T,
    slope_sq: T,
    count: u32,
}

impl<T: Real> Default for PsiSums<T> {
    fn default() -> Self {
        Self {
            weights: T::ZERO,
            r_psi: T::ZERO,
            psi_sq: T::ZERO,
            slope: T::ZERO,
            slope_sq: T::ZERO,
            count: 0,
        }
    }
}

/// What the residuals say about the noise and about a refined model.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spread<T> {
    /// Standard deviation of a residual.
    pub(super) noise: T,
    /// The factor of `(J' W J)^-1` in the covariance.
    pub(super) variance: T,
    /// By how much Newton's step is longer than that of the weights, which fall with the residual.
    pub(super) bend: T,
    /// Residuals within the support.
    pub(super) count: u32,
}

impl<T: Real> PsiSums<T> {
    /// Adds a residual whose square over the support's is `u`; nothing beyond the support.
    pub(super) fn add(&mut self, u: T) {
        if u < T::ONE {
            let w = T::ONE - u;
            let psi_over_r = w * w;
            self.weights += psi_over_r;
            self.r_psi += u * psi_over_r;
            self.psi_sq += u * psi_over_r * psi_over_r;
            let slope = w * (T::ONE - u * lit(5.0));
            self.slope += slope;
            self.slope_sq += slope * slope;
            self.count += 1;
        }
    }

    /// The noise by Stein's identity `E[r psi] = sigma^2 E[psi']`, which holds for Gaussian residuals whatever the loss
    /// cuts off, and the M-estimator's variance `E[psi^2] / E[psi']^2`, times the mean weight; `freedom` parameters were
    /// fitted.
    ///
    /// # References
    /// P. Huber, "Robust Statistics", 1981, section 7.6; C. Stein, "Estimation of the mean of a multivariate normal
    /// distribution", Annals of Statistics, 1981.
    pub(super) fn spread(&self, support: T, freedom: u32) -> Spread<T> {
        let n = from_u32::<T>(self.count);
        let fitted = n / from_u32(core::cmp::max(self.count.saturating_sub(freedom), 1));
        // Residuals spread over the whole support leave no slope: then nothing better than the support is known.
        let slope = max(self.slope, n * lit(0.05));
        if self.count == 0 {
            return Spread { noise: T::ZERO, variance: T::ZERO, bend: T::ONE, count: 0 };
        }
        let scale = support * support * fitted;
        // Huber's correction for few residuals: 1 + p / n var(psi') / E[psi']^2.
        let spread = max(self.slope_sq * n / (slope * slope) - T::ONE, T::ZERO);
        let correction = T::ONE + from_u32::<T>(freedom) / n * spread;
        Spread {
            noise: sqrt(self.r_psi / slope * scale),
            count: self.count,
            bend: self.weights / slope,
            variance: self.psi_sq * self.weights / (slope * slope)
                * scale
                * correction
                * correction
                * student(self.count.saturating_sub(freedom)),
        }
    }
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
/// of the homography `model`. Not inlined: its matrices take no stack while the plane is refined.
#[inline(never)]
pub(super) fn planar_covariance<T: Real>(
    rotation: &Matrix3<T>,
    t: &Vector3<T>,
    n: &Vector3<T>,
    model: &HomographyModel<T>,
    sums: &NormalEquations<T, 8>,
    scales: &Scales<T>,
    variance: T,
) -> Option<SMatrix<T, 8, 8>> {
    let mut h = *rotation;
    add_outer(&mut h, t, n, T::ONE);
    let h = scales.transfer(&h);
    // The model is h scaled to length 1; a step of h moves it by its part orthogonal to h, scaled alike.
    let scale = T::ONE / sqrt(h.norm_squared());
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let basis = tangent_basis(n);
    let mut steps = [Matrix3::zeros(); 8];
    for (k, axis) in axes.iter().enumerate() {
        steps[k] = cross(axis, rotation);
        add_outer(&mut steps[3 + k], axis, n, T::ONE);
    }
    for (step, column) in steps.iter_mut().skip(6).zip(&basis.data.0) {
        add_outer(step, t, &Vector3::from(*column), T::ONE);
    }
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
    // J' H J, row by row.
    let mut information = SMatrix::<T, 8, 8>::zeros();
    for p in 0..8 {
        let mut row = [T::ZERO; 8];
        for q in 0..8 {
            for k in 0..8 {
                row[q] += jacobian.data.0[p][k] * sums.hessian.data.0[q][k];
            }
        }
        for q in 0..8 {
            for k in 0..8 {
                information.data.0[q][p] += row[k] * jacobian.data.0[q][k];
            }
        }
    }
    scaled_inverse(&information, variance)
}
