//! The scatter of errors about a refined model, as its covariance needs it.

use crate::Real;
use crate::linalg::LANES;
use crate::real::from_u32;
use crate::refine::blocks::{BlockSlice, EpipolarBlock};
use crate::refine::homography::{HomographyModel, transfer_sq};

/// By how much the covariance of an estimate is larger where the variance of the noise is itself an estimate of so many
/// degrees of freedom: that of Student's t, `f / (f - 2)`.
pub(super) fn student<T: Real>(freedom: u32) -> T {
    let freedom = core::cmp::max(freedom, 4);
    from_u32::<T>(freedom) / from_u32(freedom - 2)
}

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
    pub(super) fn new<B: EpipolarBlock<T>>(
        data: BlockSlice<'_, B>,
        model: &HomographyModel<T>,
        support: T,
    ) -> Self {
        let inverse = T::ONE / (support * support);
        let three = T::TWO + T::ONE;
        let mut result = Self { weights: T::ZERO, squares: T::ZERO, slopes: T::ZERO, count: 0 };
        let mut left = data.count;
        for block in data.blocks {
            for (l, squared) in transfer_sq(&model.0, block, T::ONE).into_iter().enumerate().take(LANES) {
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

    /// By how much the inverse of `J' W J` is to be multiplied: `E[psi psi'] E[psi']^-2` of the residuals, times the
    /// mean weight.
    pub(super) fn factor(&self) -> Option<T> {
        let student: T = student(core::cmp::max(2 * self.count, 10) - 8);
        (self.slopes > T::ZERO)
            .then(|| student * self.fitted() * self.squares * self.weights / (self.slopes * self.slopes))
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
