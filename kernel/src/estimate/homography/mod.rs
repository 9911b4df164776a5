//! The homography between two images of a plane, or of a camera that only turned.

use nalgebra::Vector2;

use super::chance::{best_beyond_chance, beyond_chance, measured_accident, point_accident};
use super::degenerate::{few_distinct, few_repeated, list, mostly_on_a_line, on_a_line};
use super::error::TwoViewError;
use super::frame::PixelFrame;
use super::load::check_pixels;
use super::relative_pose::Unobservable;
use super::scatter::Scatter;
use super::transfer::TransferProblem;
use super::workspace::{TwoViewStorage, TwoViewWorkspace};
use crate::Real;
use crate::linalg::LANES;
use crate::real::{from_u32, lit, max, min, sqrt};
use crate::refine::blocks::{Block, BlockSlice, EpipolarBlock, PlaneBlock};
use crate::refine::homography::{HomographyModel, transfer_sq};
use crate::robust::budget::check_noise;
use crate::robust::loss::Loss;
use crate::robust::{Guide, RansacOptions, rank_by_score, ransac};

mod covariance;
mod verdict;

use covariance::{corners, covariance, to_pixels};
pub use verdict::{FoundHomography, HomographyEstimate, HomographyVerdict};

/// Malformed input or options of [`homography`].
pub type HomographyError = TwoViewError;

/// The memory of [`homography`].
pub type HomographyStorage<T, const N: usize> = TwoViewStorage<T, N>;

/// The workspace of [`homography`].
pub type HomographyWorkspace<'a, T> = TwoViewWorkspace<'a, T>;

/// Options of [`homography`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct HomographyOptions<T> {
    /// Largest transfer error of an inlier, pixels: where the homography keeps scale, the distance in view 2 between
    /// transferred and measured point; else that distance relative to what the noise of both views makes of it (sqrt 2
    /// times the distance of the correspondence, four coordinates, from the homography to first order). Default 3.
    pub max_error_px: T,
    /// Standard deviation of the noise of one image coordinate, pixels. Default: a third of `max_error_px`.
    pub sigma_px: Option<T>,
    /// Confidence, iterations, budgets and seed.
    pub ransac: RansacOptions<T>,
}

impl<T: Real> Default for HomographyOptions<T> {
    fn default() -> Self {
        Self { max_error_px: lit(3.0), sigma_px: None, ransac: RansacOptions::of_two_views() }
    }
}

/// The homography `x2 ~ H x1` of pixel correspondences, many of which may be wrong, or why there is none.
///
/// Minimises over `H` the sum of a robust loss of `e' (I + J J')^-1 e`, with the transfer error
/// `e = h(x1) - x2` in view 2 and `J` the Jacobian of `h` (Sampson's approximation of the reprojection error in both
/// views).
///
/// # Input
/// Pixels of two images, not corrected for a lens beyond a pinhole: `x1[i]` corresponds to `x2[i]`, at least 4.
///
/// # Returns
/// A verdict, the noise, a report; in the workspace the inlier mask.
///
/// # Errors
/// [`HomographyError`]; workspace and mask are untouched.
///
/// # Degeneracies
/// All inliers on one line, or repetitions of fewer than four distinct points, but for as few as chance explains:
/// [`HomographyVerdict::Unobservable`].
/// Agreement that the best of as many hypotheses would meet by accident is no consensus. How often one agreement is an
/// accident is measured on the correspondences, each with view 2 of others: so a homography that draws a view together,
/// or that follows clusters, proves nothing.
///
/// # Accuracy
/// That of the maximum-likelihood estimate from the inliers to within a few percent. Coordinates are counted from the
/// middle of the points in units of their spread, so that `f32` answers as `f64` does.
///
/// # Cost
/// At most [`Budget::max_iterations`](crate::robust::Budget) samples of four, and one local optimisation of at most 10
/// passes over the correspondences for each that leads; at most 48 in the end, 16 where nothing lies beside the plane. Where
/// nothing is found, all samples: 0.03 seconds for 200 correspondences and the default, 0.2 for 2,000, on a desktop computer.
///
/// # References
/// M. Fischler, R. Bolles, "Random sample consensus", Communications of the ACM, 1981; O. Chum, T. Pajdla, P. Sturm, "The
/// geometric error for homographies", Computer Vision and Image Understanding, 2005 (the error); P. Huber, "Robust
/// Statistics", 1981, section 6.3 (the covariance of an M-estimate); L. Moisan, B. Stival, "A probabilistic criterion to
/// detect rigid point matches between two images", IJCV 2004 (the number of accidents expected; deviation: one agreement's
/// chance is measured, and models are counted as tried where those are fewer).
///
/// # Examples
/// ```
/// use epipole::estimate::{HomographyOptions, HomographyStorage, homography};
/// use epipole::nalgebra::{Matrix3, Vector2, Vector3};
///
/// let truth = Matrix3::new(1.1, 0.1, 20.0, -0.2, 0.9, 30.0, 1e-4, -2e-4, 1.0);
/// let (mut x1, mut x2) = ([Vector2::zeros(); 60], [Vector2::zeros(); 60]);
/// for k in 0..60 {
///     let i = k as f64;
///     x1[k] = Vector2::new((i * 97.0) % 640.0, (i * 53.0) % 480.0);
///     let y = truth * Vector3::new(x1[k].x, x1[k].y, 1.0);
///     x2[k] = Vector2::new(y.x / y.z, y.y / y.z);
///     if k % 3 == 0 {
///         x2[k] = Vector2::new((i * 77.0) % 640.0, (i * 31.0) % 480.0); // A wrong match.
///     }
/// }
/// let mut storage = HomographyStorage::<f64, 60>::new();
/// let mut workspace = storage.workspace();
/// let estimate = homography(&x1, &x2, &HomographyOptions::default(), &mut workspace).unwrap();
/// let h = estimate.homography().unwrap().0;
/// assert!((h / h[(2, 2)] - truth).norm() < 1e-6);
/// assert!(!workspace.inliers()[3] && workspace.inliers()[1]);
/// ```
pub fn homography<T: Real>(
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    options: &HomographyOptions<T>,
    workspace: &mut HomographyWorkspace<'_, T>,
) -> Result<HomographyEstimate<T>, HomographyError> {
    homography_guided(x1, x2, options, Guide::none(), workspace)
}

/// [`homography`], with match scores for ordered sampling, or with a caller's "may I go on?".
///
/// # Input
/// As [`homography`], and a [`Guide`].
///
/// # Returns
/// As [`homography`]. A run that the guide ended is repeated bit for bit by a budget of as many iterations as the report
/// tells.
///
/// # Errors
/// As [`homography`], and [`InputError::LengthMismatch`](crate::InputError) where there are scores but not one for each
/// correspondence.
///
/// # Cost
/// As [`homography`], and about `2 n log2 n` comparisons for the order of the scores.
///
/// # References
/// O. Chum, J. Matas, "Matching with PROSAC", CVPR 2005.
///
/// # Examples
/// ```
/// use epipole::estimate::{HomographyOptions, HomographyStorage, homography_guided};
/// use epipole::nalgebra::Vector2;
/// use epipole::robust::Guide;
///
/// // A picture that moved by 12 pixels; every other match is wrong, and its score is the worse.
/// let x1: [_; 40] = core::array::from_fn(|i| Vector2::new((i * 97 % 640) as f32, (i * 61 % 480) as f32));
/// let mut x2 = x1.map(|x| Vector2::new(x.x + 12.0, x.y));
/// let scores: [f32; 40] = core::array::from_fn(|i| if i % 2 == 0 { 0.3 } else { 0.8 });
/// for i in (1..40).step_by(2) {
///     x2[i] = Vector2::new((i * 53 % 640) as f32, (i * 89 % 480) as f32);
/// }
/// let guide = Guide { scores: Some(&scores), keep_going: None };
/// let mut storage = HomographyStorage::<f32, 40>::new();
/// let estimate = homography_guided(&x1, &x2, &HomographyOptions::default(), guide, &mut storage.workspace())?;
/// let centre = estimate.homography().unwrap().transfer(&Vector2::new(320.0, 240.0)).unwrap();
/// assert!((centre - Vector2::new(332.0, 240.0)).norm() < 0.01);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn homography_guided<T: Real>(
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    options: &HomographyOptions<T>,
    guide: Guide<'_, T>,
    workspace: &mut HomographyWorkspace<'_, T>,
) -> Result<HomographyEstimate<T>, HomographyError> {
    let sigma_px = options.sigma_px.unwrap_or(options.max_error_px / lit(3.0));
    let sigma_px = check_noise(options.max_error_px, Some(sigma_px))?;
    options.ransac.check()?;
    check_pixels(x1, x2, 4, workspace.capacity())?;
    guide.check(x1.len())?;
    let frame = PixelFrame::load(x1, x2, options.max_error_px, workspace);
    let count = x1.len();
    let blocks = PlaneBlock::slice(workspace.numbers);
    let blocks = blocks.get(..count.div_ceil(LANES)).unwrap_or(blocks);
    let problem = TransferProblem {
        data: BlockSlice { blocks, count },
        // The noise of both views is in the distance between transferred and measured point.
        threshold: options.max_error_px / frame.pixels * lit(core::f64::consts::FRAC_1_SQRT_2),
        subset: None,
    };
    let order = match guide.scores {
        Some(scores) => {
            rank_by_score(scores, workspace.order);
            workspace.order.get(..count)
        }
        None => None,
    };
    let consensus = ransac(&problem, &options.ransac, order, LEAST_INLIERS, guide.keep_going);
    let mut report = consensus.report;
    let sigma = sigma_px / frame.pixels;
    let judge = Judge { problem: &problem, sigma, frame: &frame, tried: report.spent.hypotheses };
    let mask = workspace.inliers.get_mut(..count).unwrap_or_default();
    let (verdict, noise) = match &consensus.best {
        Some((model, _)) => judge.verdict(model, mask, workspace.order),
        None => (judge.without_model(mask, workspace.order), T::ZERO),
    };
    report.inliers = mask.iter().map(|&inlier| inlier as u32).sum();
    Ok(HomographyEstimate { verdict, noise_px: frame.distance_px(noise), report })
}

/// The smallest consensus of interest to the search; the verdict asks for more where chance demands it.
const LEAST_INLIERS: u32 = 8;

/// Passes over the data of the last refinement.
const FINAL_PASSES: u32 = 8;

/// Inliers in a box of this many standard deviations are one point.
const POINT_SIGMAS: f64 = 8.0;

/// Where the weight of the last refinement vanishes, in standard deviations of the noise: of Gaussian noise hardly
/// anything is lost, of points beside the plane most.
const SUPPORT_SIGMAS: f64 = 8.0;

/// The least and the largest such place, in thresholds.
const SUPPORT: [f64; 2] = [1.5, 2.8];

/// Where the weight of a refinement vanishes, in thresholds, that finds the optimum of the inliers alone.
const INLIER_SUPPORT: f64 = 1.2;

/// A last refinement that costs more than the optimum of the inliers by so many correspondences, and by this share of all,
/// has been drawn away by what lies beside the plane: noise as large as the threshold makes up to 10 of 200 or 13 of 1,000
/// of it.
const DRAWN_AWAY: [f64; 2] = [8.0, 0.02];

/// Then its support is this much narrower, at the most so often.
const NARROWER: f64 = 0.7;
const NARROWED: u32 = 4;

/// With how many others each correspondence is mispaired to measure what chance explains: at first, and where the verdict
/// hangs on it.
const MISPAIRED: usize = 3;
const MISPAIRED_MORE: usize = 64;

struct Judge<'a, 'b, T: Real> {
    problem: &'a TransferProblem<'b, T, PlaneBlock<T>>,
    /// Standard deviation of a coordinate in the blocks' unit, as the options have it.
    sigma: T,
    frame: &'a PixelFrame<T>,
    /// Hypotheses that the search has looked at.
    tried: u32,
}

impl<T: Real> Judge<'_, '_, T> {
    /// The chance of a wrong correspondence to be an inlier: in view 2 it is one within sqrt 2 thresholds.
    fn accident(&self) -> T {
        point_accident(self.problem.data, self.problem.threshold * lit(core::f64::consts::SQRT_2))
    }

    /// The verdict where no homography explains more than chance does.
    fn without_model(&self, mask: &mut [bool], order: &mut [u32]) -> HomographyVerdict<T> {
        mask.iter_mut().for_each(|inlier| *inlier = true);
        let data = self.problem.data;
        let count = data.count as u32;
        let accident = self.accident();
        let all = list(mask, order);
        let verdict = if !beyond_chance(count, count, 4, accident) {
            HomographyVerdict::TooFewInliers
        } else if few_repeated(data, 4, self.sigma, accident) {
            HomographyVerdict::Unobservable(Unobservable::TooFewDistinct)
        } else if mostly_on_a_line(data, all, self.sigma) {
            HomographyVerdict::Unobservable(Unobservable::Collinear)
        } else {
            HomographyVerdict::NoConsensus
        };
        mask.iter_mut().for_each(|inlier| *inlier = false);
        verdict
    }

    /// The verdict on the best homography, and the noise in the blocks' unit; writes the inlier mask.
    fn verdict(
        &self,
        best: &HomographyModel<T>,
        mask: &mut [bool],
        order: &mut [u32],
    ) -> (HomographyVerdict<T>, T) {
        let problem = self.problem;
        let data = problem.data;
        // Beside a plane there are often others that a homography follows at twice the threshold: what holds the inliers
        // alone may explain more.
        let (best, least_cost) = self.of_inliers(best);
        // What lies beyond the threshold takes part at a falling weight, as far as the noise of this plane may reach.
        let noise = sqrt(Scatter::new(data, &best, problem.threshold * T::TWO).variance());
        let [least, largest] = SUPPORT.map(|share| problem.threshold * lit(share));
        let mut support = min(max(noise * lit(SUPPORT_SIGMAS), least), largest);
        let margin = lit::<T>(DRAWN_AWAY[0]) + from_u32::<T>(data.count as u32) * lit(DRAWN_AWAY[1]);
        let refined = |support: T| {
            let minimum = problem.optimise(&best, &Loss::Tukey(support), FINAL_PASSES, lit(1e-4));
            let model = HomographyModel::new(&minimum.model.0)?;
            let drawn_away = problem.cost(&model) > least_cost + margin;
            Some((model, minimum.equations, drawn_away))
        };
        let mut found = None;
        for narrowed in 0..=NARROWED {
            if narrowed > 0 {
                support *= lit(NARROWER);
            }
            found = refined(support);
            if !matches!(found, Some((.., true))) {
                break;
            }
        }
        let Some((model, equations, _)) = found else {
            return (self.without_model(mask, order), T::ZERO);
        };
        let inliers = self.mark(&model, mask);
        // A model that draws one view together explains more wrong ones than its discs do, and many samples find such.
        let scale = T::ONE / (problem.threshold * problem.threshold);
        let measured = |others: usize, unseen: u32| {
            measured_accident(data, self.accident(), others, unseen, |block, other| {
                transfer_sq(&model.0, &block.mispaired(other), scale)
            })
        };
        let proven = |p: T| best_beyond_chance(self.tried, data.count as u32, inliers, 4, p);
        let coarse = measured(MISPAIRED, 2);
        if !proven(coarse) && !proven(measured(MISPAIRED_MORE, 0)) {
            return (self.without_model(mask, order), T::ZERO);
        }
        let scatter = Scatter::new(data, &model, support);
        let noise = sqrt(scatter.variance());
        let sigma = max(self.sigma, noise);
        let indices = list(mask, order);
        // A homography through repeated points agrees with any pairing of them.
        if few_distinct(data, &mut indices.iter().copied(), 4, sigma, &|| coarse) {
            return (HomographyVerdict::Unobservable(Unobservable::TooFewDistinct), noise);
        }
        if on_a_line(data, indices, sigma, &|| self.accident()) {
            return (HomographyVerdict::Unobservable(Unobservable::Collinear), noise);
        }
        let Some(homography) = self.frame.homography(&model.0) else {
            return (self.without_model(mask, order), T::ZERO);
        };
        let corners = corners(data, &model, mask);
        // One point of view 1, spread by the noise over as many of view 2 as a wild homography likes.
        let (width, height) = (corners[2][0] - corners[0][0], corners[2][1] - corners[0][1]);
        if max(width, height) < sigma * lit(POINT_SIGMAS) {
            return (HomographyVerdict::Unobservable(Unobservable::TooFewDistinct), noise);
        }
        let found = FoundHomography {
            homography,
            corners: corners.map(|corner| to_pixels(self.frame, corner)),
            covariance: covariance(&model, &equations, &scatter, &corners, self.frame),
        };
        (HomographyVerdict::Found(found), noise)
    }

    /// The optimum next to a model of what lies within the threshold, and its cost: the model itself where that is no lower.
    fn of_inliers(&self, best: &HomographyModel<T>) -> (HomographyModel<T>, T) {
        let problem = self.problem;
        let loss = Loss::Tukey(problem.threshold * lit(INLIER_SUPPORT));
        let near = problem.optimise(best, &loss, FINAL_PASSES, lit(1e-3)).model;
        let cost = problem.cost(best);
        match HomographyModel::new(&near.0).map(|model| (model, problem.cost(&model))) {
            Some((model, lower)) if lower < cost => (model, lower),
            _ => (*best, cost),
        }
    }

    /// Writes the inliers and counts them.
    fn mark(&self, model: &HomographyModel<T>, mask: &mut [bool]) -> u32 {
        let limit = self.problem.threshold * self.problem.threshold;
        let mut entries = mask.iter_mut();
        let mut inliers = 0;
        for block in self.problem.data.blocks {
            for (&s, inlier) in transfer_sq(&model.0, block, T::ONE).iter().zip(entries.by_ref()) {
                *inlier = s < limit;
                inliers += *inlier as u32;
            }
        }
        inliers
    }
}
