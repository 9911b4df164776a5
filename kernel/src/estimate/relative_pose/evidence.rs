//! Which of the simpler models (no motion, a rotation, a plane) the inliers of a relative pose leave standing.
//!
//! A simpler model is given up where the data prove parallax against it, in one of these ways, the first two also together.
//!
//! By count: correspondences that it leaves unexplained agree with the pose more often than chance. Of `m` unexplained
//! ones `k` agree; a wrong one agrees with the probability `p`, the share of the image within the threshold of an
//! epipolar line; the pose has two degrees of freedom left once the simpler model is given, so that the expected number
//! of accidents as good as this is at most `C(m, 2) P(B(m - 2, p) >= k - 2)`: it must be below 0.03, against a rotation
//! below 0.0001 (where parallax is hardly visible, a general pose has no direction).
//!
//! By scatter: on the correspondences that it does explain, the squared error across the epipolar lines is what noise
//! is, and the one along them must not be larger: the logarithm of the ratio of both has a known deviation.
//!
//! By fit: on what a plane explains, the epipolar lines of the pose must not fit far better than those of the plane's
//! own motion: by a likelihood ratio with five degrees of freedom, which holds for lines close by, and by Vuong's with
//! the scatter of Gaussian errors, which holds for lines of another direction.
//!
//! # References
//! L. Moisan, B. Stival, "A probabilistic criterion to detect rigid point matches between two images", IJCV 2004 (the
//! number of false alarms).
//! O. Chum, T. Werner, J. Matas, "Two-view geometry estimation unaffected by a dominant plane", CVPR 2005 (off-plane
//! correspondences decide).
//! P. Torr, "An assessment of information criteria for motion model selection", CVPR 1997 (the models and their
//! degrees of freedom).
//! Q. Vuong, "Likelihood ratio tests for model selection and non-nested hypotheses", Econometrica 1989 (the scatter of a
//! likelihood ratio).

use nalgebra::Matrix3;

use crate::Real;
use crate::linalg::LANES;
use crate::real::{from_u32, lit, ln, max, min, sqrt};
use crate::refine::blocks::EpipolarBlock;
use crate::refine::homography::transfer_sq;

use super::super::chance::{EXPLAINED_SIGMAS, beyond_chance_with};
use super::hypothesis::PoseProblem;

/// Chi-squared of five degrees of freedom exceeds this once in 5,000 times.
const CHANCE_GAIN: f64 = 24.0;
/// A Gaussian variable lies so many standard deviations above its mean once in 5,000 times.
const CHANCE_DEVIATIONS: f64 = 3.54;

/// How a simpler model explains the inliers of a pose.
#[derive(Clone, Copy, Debug)]
pub(super) struct Explained<T> {
    /// Correspondences, inliers of the pose or not, that the model explains.
    pub(super) all: u32,
    /// Inliers of the pose that it explains.
    pub(super) inliers: u32,
    /// Inliers of the pose that it does not.
    pub(super) others: u32,
    /// Sum over the explained ones of the squared error in two dimensions, in units of sigma.
    pub(super) squares: T,
    /// Sum over the same of the squared error across the epipolar lines.
    pub(super) across: T,
}

/// The evidence of one problem.
pub(super) struct Evidence<'a, 'b, T: Real, B> {
    pub(super) problem: &'a PoseProblem<'b, T, B>,
    /// Which correspondences are inliers of the pose.
    pub(super) inliers: &'a [bool],
    /// The matrix of the epipolar lines in the blocks' coordinates: the pose's, or the simpler model's own.
    pub(super) epipolar: Matrix3<T>,
    /// Standard deviation of a coordinate in the blocks' unit.
    pub(super) sigma: T,
}

impl<T: Real, B: EpipolarBlock<T>> Evidence<'_, '_, T, B> {
    /// How a model `x2 ~ H x1` explains the inliers.
    pub(super) fn explained(&self, h: &Matrix3<T>) -> Explained<T> {
        self.explained_within(h, self.sigma)
    }

    /// The same with another standard deviation.
    pub(super) fn explained_within(&self, h: &Matrix3<T>, sigma: T) -> Explained<T> {
        let scale = T::ONE / (sigma * sigma);
        let limit: T = lit(EXPLAINED_SIGMAS * EXPLAINED_SIGMAS);
        let mut result = Explained { all: 0, inliers: 0, others: 0, squares: T::ZERO, across: T::ZERO };
        let mut mask = self.inliers.iter();
        for block in self.problem.data.blocks {
            let squared = transfer_sq(h, block, scale);
            let (c, d) = block.residual(&self.epipolar);
            for (l, &inlier) in (0..LANES).zip(mask.by_ref()) {
                let explained = squared[l] < limit;
                result.all += explained as u32;
                if explained {
                    // Inliers of the pose or not: their errors across the lines must not be cut off.
                    result.squares += squared[l];
                    result.across += c[l] * c[l] * scale / d[l];
                }
                result.inliers += (inlier && explained) as u32;
                result.others += (inlier && !explained) as u32;
            }
        }
        result
    }

    /// True where the data prove parallax against a simpler model with `parameters` degrees of freedom; `accident` is the
    /// chance of a wrong correspondence to lie within the threshold of its epipolar line.
    pub(super) fn proves_parallax(
        &self,
        count: u32,
        explained: &Explained<T>,
        parameters: u32,
        accident: T,
        accidents: T,
    ) -> bool {
        let n = explained.all;
        if n <= parameters {
            return true;
        }
        // The pose takes 5 of the freedom across; the model's parameters beyond those lie along.
        let along = (explained.squares - explained.across) / from_u32((n + 5).saturating_sub(parameters));
        // Noise below half of what it is said to be is not believed.
        let across = max(explained.across / from_u32(n.saturating_sub(5) + 1), lit(0.25));
        // The logarithm of a ratio of two sums of about n squares each has the variance 2 / n + 2 / n.
        let deviations =
            if along > across { ln(along / across) * sqrt(from_u32(n)) * T::HALF } else { T::ZERO };
        let unexplained = count.saturating_sub(n);
        beyond_chance_with(unexplained, explained.others, 2, accident, deviations, accidents)
    }

    /// True where the epipolar lines of `pose` fit what the plane `x2 ~ H x1` explains far better than the plane's own
    /// lines, those of this evidence, do: by more than five parameters fitted to noise gain, and by more than lines of
    /// another direction gain, across which the noise is another.
    pub(super) fn bends(&self, h: &Matrix3<T>, pose: &Matrix3<T>, noise: T) -> bool {
        let limit: T = lit(EXPLAINED_SIGMAS * EXPLAINED_SIGMAS);
        let scale = T::ONE / (self.sigma * self.sigma);
        let mut gain = T::ZERO;
        // Of both errors of a correspondence: squares and product, and their number.
        let (mut cc, mut ee, mut ce, mut n) = (T::ZERO, T::ZERO, T::ZERO, T::ZERO);
        let mut mask = self.inliers.iter();
        for block in self.problem.data.blocks {
            let squared = transfer_sq(h, block, scale);
            let ((c, d), (e, f)) = (block.residual(&self.epipolar), block.residual(pose));
            for (l, _) in (0..LANES).zip(mask.by_ref()) {
                if squared[l] < limit {
                    let (own, other) = (c[l] * c[l] * scale / d[l], e[l] * e[l] * scale / f[l]);
                    gain += min(own, limit) - min(other, limit);
                    if own < limit && other < limit {
                        cc += own;
                        ee += other;
                        ce += c[l] * e[l] * scale / (sqrt(d[l]) * sqrt(f[l]));
                        n += T::ONE;
                    }
                }
            }
        }
        // Two Gaussian variables of correlation r: the difference of their squares has the variance 4 (1 - r^2).
        let apart = T::ONE - ce * ce / max(cc * ee, T::MIN_POSITIVE);
        let deviations: T = lit(CHANCE_DEVIATIONS * CHANCE_DEVIATIONS * 4.0);
        let unit = noise * noise * scale;
        gain > unit * lit(CHANCE_GAIN) && gain * gain > unit * unit * deviations * n * apart
    }
}
