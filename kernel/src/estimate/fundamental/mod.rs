//! The fundamental matrix between two images of uncalibrated cameras.

use nalgebra::Vector2;

use super::error::TwoViewError;
use super::frame::PixelFrame;
use super::load::check_pixels;
use super::workspace::{TwoViewStorage, TwoViewWorkspace};
use crate::Real;
use crate::linalg::LANES;
use crate::refine::blocks::{Block, BlockSlice, PlaneBlock};
use crate::robust::budget::check_noise;
use crate::robust::{Guide, RansacOptions, rank_by_score, ransac};

mod hypothesis;
mod judge;
mod relief;
mod verdict;

use hypothesis::EpipolarProblem;
use judge::Judge;
pub use verdict::{FundamentalEstimate, FundamentalVerdict};

/// Malformed input or options of [`fundamental`].
pub type FundamentalError = TwoViewError;

/// The memory of [`fundamental`].
pub type FundamentalStorage<T, const N: usize> = TwoViewStorage<T, N>;

/// The workspace of [`fundamental`].
pub type FundamentalWorkspace<'a, T> = TwoViewWorkspace<'a, T>;

/// Options of [`fundamental`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct FundamentalOptions<T> {
    /// Largest Sampson error of an inlier, pixels. Default 1.
    pub max_error_px: T,
    /// Standard deviation of the noise of one image coordinate, pixels. Default: half of `max_error_px`.
    pub sigma_px: Option<T>,
    /// Confidence, iterations, budgets and seed.
    pub ransac: RansacOptions<T>,
}

impl<T: Real> Default for FundamentalOptions<T> {
    fn default() -> Self {
        Self { max_error_px: T::ONE, sigma_px: None, ransac: RansacOptions::of_two_views() }
    }
}

/// The fundamental matrix of pixel correspondences, many of which may be wrong, or why there is none:
/// `x2' F x1 = 0`.
///
/// Minimises over the matrices of rank 2 the sum of a robust loss of the squared Sampson error
/// `(x2' F x1)^2 / (|(F x1)_xy|^2 + |(F' x2)_xy|^2)`. Where one plane holds most inliers, its homography and two
/// correspondences off it give further hypotheses.
///
/// # Input
/// Pixels of two images, not corrected for a lens beyond a pinhole: `x1[i]` corresponds to `x2[i]`, at least 7, at most
/// [`TwoViewWorkspace::capacity`].
///
/// # Returns
/// A verdict, the noise, a report; in the workspace the inlier mask.
///
/// # Errors
/// [`FundamentalError`]; workspace and mask are untouched.
///
/// # Degeneracies
/// Inliers of one plane or of a camera that only turned, but for as few as chance explains and, beside the accidents that
/// wrong correspondences bring and two that fix the epipole, no more than three in twenty: [`FundamentalVerdict::Planar`].
/// Inliers on one line, or repetitions of fewer than eight distinct points, for seven have up to three
/// matrices: [`FundamentalVerdict::Unobservable`].
///
/// # Accuracy
/// That of the maximum-likelihood estimate from the inliers to within a few percent. Wrong correspondences that agree by
/// accident seem to lie far off the scene, where they would move the matrix as hundreds of others do: the last refinement
/// leaves out what lies farther off the plane that fits the inliers best than a limit, where the epipoles are more certain
/// without, at most a quarter (they stay inliers of the mask). Coordinates are counted from the
/// middle of the points in units of their spread, so that `f32` answers as `f64` does.
///
/// # Cost
/// At most [`Budget::max_iterations`](crate::robust::Budget) samples of seven, by itself as many as the confidence
/// needs for the inliers found, or for the fewest that chance does not explain, and one local optimisation of at most 13
/// passes over the correspondences for each that leads; at most 40 in the end and as many again where a plane holds most
/// inliers, and for each of those two pairs of passes that look for accidents the inliers ten times and six mispaired lists.
/// After 32 samples every other one (every fourth where there are scores) is of near correspondences, which are right
/// together more often.
///
/// # References
/// O. Chum, T. Werner, J. Matas, "Two-view geometry estimation unaffected by a dominant plane", CVPR 2005, and
/// "Epipolar geometry estimation via RANSAC benefits from the oriented epipolar constraint", ICPR 2004;
/// A. Bartoli, P. Sturm, "Nonlinear estimation of the fundamental matrix with minimal parameters", IEEE Transactions on
/// Pattern Analysis and Machine Intelligence, 2004 (deviation: tangents of the matrices of rank 2 in place of two
/// rotations).
///
/// # Examples
/// ```
/// use epipole::estimate::{FundamentalOptions, FundamentalStorage, fundamental};
/// use epipole::nalgebra::Vector2;
/// // A camera of focal length 500 that moves to the right by 1: y stays, x moves by 500 / depth.
/// let x1: [Vector2<f64>; 40] =
///     core::array::from_fn(|k| Vector2::new((k * 37 % 101) as f64 * 6.0, (k * 53 % 89) as f64 * 5.0));
/// let mut x2 = x1;
/// for (k, p) in x2.iter_mut().enumerate() {
///     p.x -= 500.0 / (4.0 + (k * 29 % 17) as f64);
/// }
/// x2[3].y += 40.0; // A wrong match.
/// let mut storage = FundamentalStorage::<f64, 40>::new();
/// let mut workspace = storage.workspace();
/// let estimate = fundamental(&x1, &x2, &FundamentalOptions::default(), &mut workspace).unwrap();
/// let f = estimate.fundamental().unwrap().0;
/// let line = f * x1[5].push(1.0);
/// assert!((line.dot(&x2[5].push(1.0)) / line.xy().norm()).abs() < 1e-6); // pixels from the epipolar line
/// assert!(!workspace.inliers()[3]);
/// ```
pub fn fundamental<T: Real>(
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    options: &FundamentalOptions<T>,
    workspace: &mut FundamentalWorkspace<'_, T>,
) -> Result<FundamentalEstimate<T>, FundamentalError> {
    fundamental_guided(x1, x2, options, Guide::none(), workspace)
}

/// [`fundamental`], with match scores for ordered sampling, or with a caller's "may I go on?".
///
/// # Input
/// As [`fundamental`], and a [`Guide`].
///
/// # Returns
/// As [`fundamental`]. A run that the guide ended is repeated bit for bit by a budget of as many iterations as the report
/// tells.
///
/// # Errors
/// As [`fundamental`], and [`InputError::LengthMismatch`](crate::InputError) where there are scores but not one for each
/// correspondence.
///
/// # Cost
/// As [`fundamental`], and about `2 n log2 n` comparisons for the order of the scores.
///
/// # References
/// O. Chum, J. Matas, "Matching with PROSAC", CVPR 2005.
///
/// # Examples
/// See [`relative_pose_guided`](super::relative_pose_guided) and [`homography_guided`](super::homography_guided), which
/// take a guide alike.
pub fn fundamental_guided<T: Real>(
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    options: &FundamentalOptions<T>,
    guide: Guide<'_, T>,
    workspace: &mut FundamentalWorkspace<'_, T>,
) -> Result<FundamentalEstimate<T>, FundamentalError> {
    let sigma_px = check_noise(options.max_error_px, options.sigma_px)?;
    options.ransac.check()?;
    check_pixels(x1, x2, 7, workspace.capacity())?;
    guide.check(x1.len())?;
    let frame = PixelFrame::load(x1, x2, options.max_error_px, workspace);
    let count = x1.len();
    let blocks = PlaneBlock::slice(workspace.numbers);
    let blocks = blocks.get(..count.div_ceil(LANES)).unwrap_or(blocks);
    let problem = EpipolarProblem::new(BlockSlice { blocks, count }, options.max_error_px / frame.pixels);
    let order = match guide.scores {
        Some(scores) => {
            rank_by_score(scores, workspace.order);
            workspace.order.get(..count)
        }
        None => None,
    };
    let consensus = ransac(&problem, &options.ransac, order, LEAST_INLIERS, guide.keep_going);
    let mut report = consensus.report;
    let seed = options.ransac.seed;
    let judge = Judge { problem: &problem, sigma: sigma_px / frame.pixels, frame: &frame, seed };
    let mask = workspace.inliers.get_mut(..count).unwrap_or_default();
    let (verdict, noise) = match &consensus.best {
        Some((model, _)) => judge.verdict(model, mask, workspace.order),
        None => (judge.without_model(mask, workspace.order), T::ZERO),
    };
    report.inliers = mask.iter().map(|&inlier| inlier as u32).sum();
    Ok(FundamentalEstimate { verdict, noise_px: frame.distance_px(noise), report })
}

/// The smallest consensus of interest to the search; the verdict asks for more where chance demands it.
const LEAST_INLIERS: u32 = 12;
