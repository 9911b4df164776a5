//! The homography between two images.

use core::fmt;

use nalgebra::{Matrix3, SMatrix, Vector2};

use super::chance::{beyond_chance, point_accident};
use super::degenerate::{few_distinct, on_a_line};
use super::load::{PixelUnits, check_pixels, load_pixels};
use super::relative_pose::Unobservable;
use super::transfer::TransferProblem;
use super::workspace::TwoViewWorkspace;
use crate::geometry::Homography;
use crate::linalg::{LANES, Ldlt};
use crate::real::{from_u32, lit, max, sqrt};
use crate::refine::blocks::{Block, BlockSlice, PlaneBlock};
use crate::refine::homography::{HomographyModel, transfer_sq};
use crate::robust::budget::check_noise;
use crate::robust::loss::Loss;
use crate::robust::{Guide, OptionsError, RansacOptions, RansacReport, rank_by_score, ransac};
use crate::{InputError, Real};

/// Options of [`homography`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct HomographyOptions<T> {
    /// Largest transfer error of an inlier, pixels: where the homography keeps scale, the distance between a point of
    /// view 2 and the transferred point; else that distance relative to what the noise of both views makes of it.
    /// Default 3.
    pub max_error_px: T,
    /// Standard deviation of the noise of one image coordinate, pixels. Default: a third of `max_error_px`.
    pub sigma_px: Option<T>,
    /// Confidence, iterations, budgets and seed.
    pub ransac: RansacOptions<T>,
}

impl<T: Real> Default for HomographyOptions<T> {
    fn default() -> Self {
        Self { max_error_px: lit(3.0), sigma_px: None, ransac: RansacOptions::default() }
    }
}

/// Malformed input or options. Outputs are untouched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum HomographyError {
    /// The correspondences cannot be used.
    Input(InputError),
    /// An option is out of its range.
    Options(OptionsError),
}

impl fmt::Display for HomographyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Input(error) => error.fmt(f),
            Self::Options(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for HomographyError {}

impl From<InputError> for HomographyError {
    fn from(error: InputError) -> Self {
        Self::Input(error)
    }
}

impl From<OptionsError> for HomographyError {
    fn from(error: OptionsError) -> Self {
        Self::Options(error)
    }
}

/// What two images say about a homography between them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum HomographyVerdict<T: Real> {
    /// `x2 ~ H x1` between pixels.
    Found {
        /// The homography, |H| = 1 and det H > 0.
        homography: Homography<T>,
        /// Covariance of its nine entries row by row, of rank 8 (the scale is fixed); none where the inliers leave more
        /// than the scale open.
        covariance: Option<SMatrix<T, 9, 9>>,
    },
    /// The inliers agree, but no homography follows from them.
    Unobservable(Unobservable),
    /// So few correspondences that chance could explain them even if all agreed.
    TooFewInliers,
    /// No homography explains more correspondences than chance.
    NoConsensus,
}

/// A verdict and how it was reached.
#[derive(Clone, Debug, PartialEq)]
#[must_use]
pub struct HomographyEstimate<T: Real> {
    /// The verdict.
    pub verdict: HomographyVerdict<T>,
    /// Robust estimate of the noise of one image coordinate from the inliers' residuals, pixels; 0 without inliers.
    pub noise_px: T,
    /// How the search went.
    pub report: RansacReport<T>,
}

impl<T: Real> HomographyEstimate<T> {
    /// The homography, if one was found.
    #[must_use]
    pub fn homography(&self) -> Option<Homography<T>> {
        match self.verdict {
            HomographyVerdict::Found { homography, .. } => Some(homography),
            _ => None,
        }
    }
}

/// The homography `x2 ~ H x1` of pixel correspondences, many of which may be wrong, or why there is none.
///
/// Hypotheses of four points that keep their orientation, scored by the truncated squared transfer error and refined on
/// their inliers; the error is Sampson's, `e' (I + J J')^-1 e` times 2, so that the noise of both views counts.
///
/// # Input
/// Pixels of view 1 and of view 2, at least 4, at most [`TwoViewWorkspace::capacity`].
///
/// # Returns
/// A verdict; after it [`TwoViewWorkspace::inliers`] is the inlier mask.
///
/// # Errors
/// [`HomographyError`], with everything untouched.
///
/// # Degeneracies
/// Inliers on one line, or fewer than four distinct ones: [`HomographyVerdict::Unobservable`].
///
/// # Accuracy
/// That of a maximum-likelihood fit to the inliers; in `f32` as in `f64` to well below a tenth of a pixel.
///
/// # Cost
/// At most `max_iterations` samples; by itself as many as the confidence needs for the inliers found.
///
/// # References
/// R. Hartley and A. Zisserman, "Multiple View Geometry in Computer Vision", 2nd edition, 2003, chapter 4 (the error
/// and its covariance); the engine: [`ransac`](crate::robust::ransac).
///
/// # Examples
/// ```
/// use epipole::estimate::{HomographyOptions, TwoViewStorage, homography};
/// use epipole::nalgebra::Vector2;
/// let x1: [Vector2<f64>; 20] =
///     core::array::from_fn(|k| Vector2::new((k * 37 % 101) as f64 * 6.0, (k * 53 % 89) as f64 * 5.0));
/// let mut x2 = x1.map(|p| Vector2::new(1.1 * p.x + 20.0, 0.9 * p.y - 5.0));
/// x2[3] = Vector2::new(10.0, 400.0); // A wrong match.
/// let mut storage = TwoViewStorage::<f64, 20>::new();
/// let mut workspace = storage.workspace();
/// let estimate = homography(&x1, &x2, &HomographyOptions::default(), &mut workspace).unwrap();
/// let moved = estimate.homography().unwrap().transfer(&Vector2::new(100.0, 100.0)).unwrap();
/// assert!((moved - Vector2::new(130.0, 85.0)).norm() < 1e-6);
/// assert!(!workspace.inliers()[3]);
/// ```
pub fn homography<T: Real>(
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    options: &HomographyOptions<T>,
    workspace: &mut TwoViewWorkspace<'_, T>,
) -> Result<HomographyEstimate<T>, HomographyError> {
    homography_guided(x1, x2, options, Guide::none(), workspace)
}

/// The smallest consensus of interest to the search; the verdict asks for more where chance demands it.
const LEAST_INLIERS: u32 = 8;

/// [`homography`], with match scores for ordered sampling, or with a caller's "may I go on?".
///
/// # Errors
/// [`HomographyError`], with everything untouched.
pub fn homography_guided<T: Real>(
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    options: &HomographyOptions<T>,
    guide: Guide<'_, T>,
    workspace: &mut TwoViewWorkspace<'_, T>,
) -> Result<HomographyEstimate<T>, HomographyError> {
    let sigma = options.sigma_px.unwrap_or(options.max_error_px / lit(3.0));
    let sigma_px = check_noise(options.max_error_px, Some(sigma))?;
    options.ransac.check()?;
    check_pixels(x1, x2, 4, workspace.capacity())?;
    guide.check(x1.len())?;
    let count = x1.len();
    workspace.count = count;
    let units = load_pixels(x1, x2, workspace);
    let blocks = PlaneBlock::slice(workspace.numbers);
    let data = BlockSlice { blocks: blocks.get(..count.div_ceil(LANES)).unwrap_or(blocks), count };
    // The whitened error is that of the distance over sqrt 2.
    let threshold = options.max_error_px / units.pixels * lit(core::f64::consts::FRAC_1_SQRT_2);
    let problem = TransferProblem { data, threshold, subset: None };
    let order = match guide.scores {
        Some(scores) => {
            rank_by_score(scores, workspace.order);
            workspace.order.get(..count)
        }
        None => None,
    };
    let consensus = ransac(&problem, &options.ransac, order, LEAST_INLIERS, guide.keep_going);
    let mut report = consensus.report;
    let mask = workspace.inliers.get_mut(..count).unwrap_or_default();
    mask.iter_mut().for_each(|inlier| *inlier = false);
    let (verdict, noise) = match &consensus.models[0] {
        Some((model, _)) => judge(&problem, model, sigma_px / units.pixels, &units, mask, workspace.order),
        None => {
            let few = few_distinct(data, 0..count as u32, 4, sigma_px / units.pixels, accident(&problem));
            (without_model(few), T::ZERO)
        }
    };
    report.inliers = mask.iter().map(|&inlier| inlier as u32).sum();
    Ok(HomographyEstimate { verdict, noise_px: noise * units.pixels, report })
}

fn accident<T: Real>(problem: &TransferProblem<'_, T, PlaneBlock<T>>) -> T {
    point_accident(problem.data, problem.threshold * lit(core::f64::consts::SQRT_2))
}

fn without_model<T: Real>(few_distinct: bool) -> HomographyVerdict<T> {
    if few_distinct {
        HomographyVerdict::Unobservable(Unobservable::TooFewDistinct)
    } else {
        HomographyVerdict::NoConsensus
    }
}

/// The verdict on the best model of the search, and the noise in the blocks' unit; writes the inlier mask.
fn judge<T: Real>(
    problem: &TransferProblem<'_, T, PlaneBlock<T>>,
    model: &HomographyModel<T>,
    sigma: T,
    units: &PixelUnits<T>,
    mask: &mut [bool],
    order: &mut [u32],
) -> (HomographyVerdict<T>, T) {
    // What lies somewhat beyond the threshold still helps, with a falling weight.
    let loss = Loss::Tukey(problem.threshold * lit(1.7));
    let refined = problem.optimise(model, &loss, 10, lit(1e-6));
    let h = refined.model.0;
    let limit = problem.threshold * problem.threshold;
    let mut entries = mask.iter_mut().zip(0u32..);
    let mut free = order.iter_mut();
    let mut inliers = 0;
    for block in problem.data.blocks {
        for &s in &transfer_sq(&h, block, &[T::ONE; LANES]) {
            let Some((inlier, index)) = entries.next() else { break };
            *inlier = s < limit;
            if *inlier && let Some(entry) = free.next() {
                *entry = index;
                inliers += 1;
            }
        }
    }
    let count = problem.data.count as u32;
    let chance = accident(problem);
    let indices = order.get(..inliers as usize).unwrap_or(&[]);
    let sums = problem.optimise(&refined.model, &Loss::Truncated(problem.threshold), 1, T::ZERO).equations;
    let outside = from_u32::<T>(count.saturating_sub(sums.active));
    let free = core::cmp::max((2 * sums.active).saturating_sub(8), 1);
    let variance = max(sums.cost - outside * limit, T::ZERO) / from_u32(free);
    let noise = sqrt(variance);
    let verdict = if few_distinct(problem.data, indices.iter().copied(), 4, sigma, chance) {
        HomographyVerdict::Unobservable(Unobservable::TooFewDistinct)
    } else if !beyond_chance(count, inliers, 4, chance) {
        mask.iter_mut().for_each(|inlier| *inlier = false);
        let verdict = if beyond_chance(count, count, 4, chance) {
            HomographyVerdict::NoConsensus
        } else {
            HomographyVerdict::TooFewInliers
        };
        return (verdict, T::ZERO);
    } else if on_a_line(problem.data, indices, max(sigma, noise), chance) {
        HomographyVerdict::Unobservable(Unobservable::Collinear)
    } else {
        let (homography, covariance) = units.homography(&refined.model, &sums.hessian, variance);
        HomographyVerdict::Found { homography, covariance }
    };
    (verdict, noise)
}

impl<T: Real> PixelUnits<T> {
    /// A homography of the blocks' coordinates between pixels, and the covariance of its entries.
    fn homography(
        &self,
        model: &HomographyModel<T>,
        hessian: &SMatrix<T, 8, 8>,
        variance: T,
    ) -> (Homography<T>, Option<SMatrix<T, 9, 9>>) {
        use crate::refine::lm::Manifold;
        let pixels = |m: &Matrix3<T>| self.pixels2() * m * self.normaliser1();
        let h = pixels(&model.0);
        let scale = T::ONE / sqrt(h.norm_squared());
        let h = h * scale;
        let row_major = |m: &Matrix3<T>| {
            let m = &m.data.0;
            [m[0][0], m[1][0], m[2][0], m[0][1], m[1][1], m[2][1], m[0][2], m[1][2], m[2][2]]
        };
        let covariance = Ldlt::new(hessian).map(|factors| {
            let inner = factors.inverse() * variance;
            let mut jacobian = SMatrix::<T, 9, 8>::zeros();
            for (column, tangent) in jacobian.data.0.iter_mut().zip(model.tangents()) {
                let [a, b, c, d, e, f, g, i, j] = tangent;
                let step = pixels(&Matrix3::new(a, b, c, d, e, f, g, i, j)) * scale;
                // The scale stays: the part along h falls away.
                let along = h.dot(&step);
                *column = row_major(&(step - h * along));
            }
            jacobian * inner * jacobian.transpose()
        });
        let sign = if h.determinant() < T::ZERO { -T::ONE } else { T::ONE };
        (Homography(h * sign), covariance)
    }
}
