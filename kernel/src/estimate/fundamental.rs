//! The fundamental matrix between two images.

use core::fmt;

use nalgebra::{Matrix3, Vector2, Vector3};

use super::chance::{EXPLAINED_SIGMAS, beyond_chance, line_accident};
use super::degenerate::{few_distinct, on_a_line};
use super::load::{PixelUnits, check_pixels, load_pixels};
use super::relative_pose::Unobservable;
use super::stride;
use super::transfer::TransferProblem;
use super::workspace::TwoViewWorkspace;
use crate::geometry::{Fundamental, Homography};
use crate::linalg::{LANES, Lanes};
use crate::real::{from_u32, lit, max, sqrt};
use crate::refine::blocks::{Block, BlockSlice, EpipolarBlock, PlaneBlock};
use crate::refine::fundamental::{FundamentalModel, oriented};
use crate::refine::homography::{HomographyModel, transfer_sq};
use crate::refine::lm::{Manifold, Minimum, minimise};
use crate::robust::budget::check_noise;
use crate::robust::loss::Loss;
use crate::robust::{
    Budget, Estimator, Gate, Guide, OptionsError, RansacOptions, RansacReport, Sampler, Score, ScoreCounts,
    Tally, rank_by_score, ransac,
};
use crate::solvers::relpose_7pt;
use crate::{InputError, Real};

/// Options of [`fundamental`].
#[derive(Clone, Copy, Debug, PartialEq)]
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
        Self { max_error_px: T::ONE, sigma_px: None, ransac: RansacOptions::default() }
    }
}

/// Malformed input or options. Outputs are untouched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FundamentalError {
    /// The correspondences cannot be used.
    Input(InputError),
    /// An option is out of its range.
    Options(OptionsError),
}

impl fmt::Display for FundamentalError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Input(error) => error.fmt(f),
            Self::Options(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for FundamentalError {}

impl From<InputError> for FundamentalError {
    fn from(error: InputError) -> Self {
        Self::Input(error)
    }
}

impl From<OptionsError> for FundamentalError {
    fn from(error: OptionsError) -> Self {
        Self::Options(error)
    }
}

/// What two images say about their epipolar geometry.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum FundamentalVerdict<T: Real> {
    /// `x2' F x1 = 0` between pixels, |F| = 1.
    Found(Fundamental<T>),
    /// All inliers agree with one homography `x2 ~ H x1`, of a plane or a turning camera: every `F = [e]x H` explains them.
    Homography(Homography<T>),
    /// The inliers agree, but no epipolar geometry follows from them.
    Unobservable(Unobservable),
    /// So few correspondences that chance could explain them even if all agreed.
    TooFewInliers,
    /// No epipolar geometry explains more correspondences than chance.
    NoConsensus,
}

/// A verdict and how it was reached.
#[derive(Clone, Debug, PartialEq)]
#[must_use]
pub struct FundamentalEstimate<T: Real> {
    /// The verdict.
    pub verdict: FundamentalVerdict<T>,
    /// Robust estimate of the noise of one image coordinate from the inliers' residuals, pixels; 0 without inliers.
    pub noise_px: T,
    /// How the search went.
    pub report: RansacReport<T>,
}

impl<T: Real> FundamentalEstimate<T> {
    /// The fundamental matrix, if one was found.
    #[must_use]
    pub fn fundamental(&self) -> Option<Fundamental<T>> {
        match self.verdict {
            FundamentalVerdict::Found(f) => Some(f),
            _ => None,
        }
    }
}

/// The smallest consensus of interest to the search; the verdict asks for more where chance demands it.
const LEAST_INLIERS: u32 = 12;
/// Passes over the data in the two stages of a local optimisation.
const WIDE_PASSES: u32 = 5;
const LOCAL_PASSES: u32 = 8;
/// Pairs of off-plane correspondences tried where one plane holds most inliers.
const PARALLAX_PAIRS: u32 = 64;

/// Correspondences and what a score of them needs.
struct FundamentalProblem<'a, T> {
    data: BlockSlice<'a, PlaneBlock<T>>,
    threshold: T,
}

impl<T: Real> FundamentalProblem<'_, T> {
    fn points(&self, index: u32) -> Option<(Vector3<T>, Vector3<T>)> {
        let block = self.data.blocks.get(index as usize / LANES)?;
        let lane = index as usize % LANES;
        let at = |k: usize| block[k].get(lane).copied();
        Some((Vector3::new(at(0)?, at(1)?, T::ONE), Vector3::new(at(2)?, at(3)?, T::ONE)))
    }

    fn squared(&self, block: &PlaneBlock<T>, f: &Matrix3<T>) -> Lanes<T> {
        let scale = T::ONE / (self.threshold * self.threshold);
        let (c, d) = block.residual(f);
        let mut squared = [T::ZERO; LANES];
        for l in 0..LANES {
            squared[l] = c[l] * c[l] * scale / d[l];
        }
        squared
    }

    fn optimise(
        &self,
        model: &FundamentalModel<T>,
        loss: &Loss<T>,
        passes: u32,
    ) -> Minimum<FundamentalModel<T>, T, 7> {
        minimise(self.data, model, loss, passes, lit(1e-5))
    }

    fn cost(&self, model: &FundamentalModel<T>) -> T {
        self.score(model, &Gate::open(), &mut ScoreCounts::default()).map_or(T::MAX, |score| score.cost)
    }
}

impl<T: Real> Estimator<T, 7> for FundamentalProblem<'_, T> {
    type Model = FundamentalModel<T>;

    fn count(&self) -> u32 {
        self.data.count as u32
    }

    fn generate(&self, sample: &[u32; 7], found: &mut impl FnMut(&FundamentalModel<T>)) -> bool {
        let mut x1 = [Vector3::zeros(); 7];
        let mut x2 = [Vector3::zeros(); 7];
        for ((a, b), &index) in x1.iter_mut().zip(&mut x2).zip(sample) {
            let Some((p, q)) = self.points(index) else { return false };
            (*a, *b) = (p, q);
        }
        for f in &relpose_7pt(&x1, &x2) {
            if oriented(&f.0, &x1, &x2)
                && let Some(model) = FundamentalModel::new(&f.0)
            {
                found(&model);
            }
        }
        true
    }

    fn score(
        &self,
        model: &FundamentalModel<T>,
        gate: &Gate<T>,
        counts: &mut ScoreCounts,
    ) -> Option<Score<T>> {
        let f = model.matrix();
        let blocks = self.data.blocks;
        let stride = stride(blocks.len());
        let mut tally = Tally::new();
        let mut at = 0usize;
        let mut seen = 0u32;
        for k in 0..blocks.len() {
            if let Some(block) = blocks.get(at) {
                let squared = self.squared(block, &f);
                let filled = self.data.count.saturating_sub(at * LANES);
                if filled >= LANES {
                    tally.add(&squared);
                } else {
                    tally.add_first(&squared, filled);
                }
                seen += core::cmp::min(filled, LANES) as u32;
            }
            at += stride;
            if at >= blocks.len() {
                at -= blocks.len();
            }
            if k % 2 == 1 && gate.rejects(tally.cost(), tally.inliers(), from_u32(seen)) {
                counts.residuals += seen as u64;
                counts.rejected_residuals += seen as u64;
                counts.rejected_inliers += tally.inliers().to_f64() as u64;
                return None;
            }
        }
        counts.residuals += seen as u64;
        Some(tally.score())
    }

    fn refine(&self, model: &FundamentalModel<T>, residuals: &mut u64) -> Option<FundamentalModel<T>> {
        let first = self.optimise(model, &Loss::Truncated(self.threshold * T::TWO), WIDE_PASSES);
        let minimum = self.optimise(&first.model, &Loss::Truncated(self.threshold), LOCAL_PASSES);
        *residuals += (first.passes + minimum.passes) as u64 * self.data.count as u64;
        Some(minimum.model)
    }
}

/// The fundamental matrix of pixel correspondences, many of which may be wrong, or why there is none:
/// `x2' F x1 = 0`.
///
/// Hypotheses of seven points gated by the oriented epipolar constraint, scored by the truncated squared Sampson error,
/// refined on their inliers with seven degrees of freedom. Where one plane holds most inliers, its homography and two
/// correspondences off it give further hypotheses.
///
/// # Input
/// Pixels of view 1 and of view 2, at least 7, at most [`TwoViewWorkspace::capacity`].
///
/// # Returns
/// A verdict; after it [`TwoViewWorkspace::inliers`] is the inlier mask.
///
/// # Errors
/// [`FundamentalError`], with everything untouched.
///
/// # Degeneracies
/// Inliers of one plane or of a turning camera: [`FundamentalVerdict::Homography`]. Inliers on one line, or fewer than
/// seven distinct ones: [`FundamentalVerdict::Unobservable`].
///
/// # Accuracy
/// That of a maximum-likelihood fit to the inliers.
///
/// # Cost
/// At most `max_iterations` samples; by itself as many as the confidence needs for the inliers found.
///
/// # References
/// O. Chum, T. Werner, J. Matas, "Two-view geometry estimation unaffected by a dominant plane", CVPR 2005, and
/// "Epipolar geometry estimation via RANSAC benefits from the oriented epipolar constraint", ICPR 2004;
/// A. Bartoli, P. Sturm, "Nonlinear estimation of the fundamental matrix with minimal parameters", TPAMI 2004.
///
/// # Examples
/// ```
/// use epipole::estimate::{FundamentalOptions, TwoViewStorage, fundamental};
/// use epipole::nalgebra::Vector2;
/// // A camera of focal length 500 that moves to the right by 1: y stays, x moves by 500 / depth.
/// let x1: [Vector2<f64>; 40] =
///     core::array::from_fn(|k| Vector2::new((k * 37 % 101) as f64 * 6.0, (k * 53 % 89) as f64 * 5.0));
/// let mut x2 = x1;
/// for (k, p) in x2.iter_mut().enumerate() {
///     p.x -= 500.0 / (4.0 + (k * 29 % 17) as f64);
/// }
/// x2[3].y += 40.0; // A wrong match.
/// let mut storage = TwoViewStorage::<f64, 40>::new();
/// let mut workspace = storage.workspace();
/// let estimate = fundamental(&x1, &x2, &FundamentalOptions::default(), &mut workspace).unwrap();
/// let f = estimate.fundamental().unwrap().0;
/// assert!((x2[5].push(1.0).transpose() * f * x1[5].push(1.0)).x.abs() < 1e-6);
/// assert!(!workspace.inliers()[3]);
/// ```
pub fn fundamental<T: Real>(
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    options: &FundamentalOptions<T>,
    workspace: &mut TwoViewWorkspace<'_, T>,
) -> Result<FundamentalEstimate<T>, FundamentalError> {
    fundamental_guided(x1, x2, options, Guide::none(), workspace)
}

/// [`fundamental`], with match scores for ordered sampling, or with a caller's "may I go on?".
///
/// # Errors
/// [`FundamentalError`], with everything untouched.
pub fn fundamental_guided<T: Real>(
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    options: &FundamentalOptions<T>,
    guide: Guide<'_, T>,
    workspace: &mut TwoViewWorkspace<'_, T>,
) -> Result<FundamentalEstimate<T>, FundamentalError> {
    let sigma_px = check_noise(options.max_error_px, options.sigma_px)?;
    options.ransac.check()?;
    check_pixels(x1, x2, 7, workspace.capacity())?;
    guide.check(x1.len())?;
    let count = x1.len();
    workspace.count = count;
    let units = load_pixels(x1, x2, workspace);
    let blocks = PlaneBlock::slice(workspace.numbers);
    let data = BlockSlice { blocks: blocks.get(..count.div_ceil(LANES)).unwrap_or(blocks), count };
    let problem = FundamentalProblem { data, threshold: options.max_error_px / units.pixels };
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
    let judge = Judge { problem: &problem, sigma: sigma_px / units.pixels, units, seed: options.ransac.seed };
    let (verdict, noise) = match &consensus.models[0] {
        Some((model, _)) => judge.verdict(model, mask, workspace.order),
        None => (judge.without_model(), T::ZERO),
    };
    report.inliers = mask.iter().map(|&inlier| inlier as u32).sum();
    Ok(FundamentalEstimate { verdict, noise_px: noise * units.pixels, report })
}

struct Judge<'a, 'b, T: Real> {
    problem: &'a FundamentalProblem<'b, T>,
    sigma: T,
    units: PixelUnits<T>,
    seed: u64,
}

impl<T: Real> Judge<'_, '_, T> {
    fn accident(&self) -> T {
        line_accident(self.problem.data, self.problem.threshold)
    }

    fn without_model(&self) -> FundamentalVerdict<T> {
        let data = self.problem.data;
        if few_distinct(data, 0..data.count as u32, 7, self.sigma, self.accident()) {
            FundamentalVerdict::Unobservable(Unobservable::TooFewDistinct)
        } else {
            FundamentalVerdict::NoConsensus
        }
    }

    /// The verdict on the best model, and the noise in the blocks' unit; writes the inlier mask.
    fn verdict(
        &self,
        model: &FundamentalModel<T>,
        mask: &mut [bool],
        order: &mut [u32],
    ) -> (FundamentalVerdict<T>, T) {
        let data = self.problem.data;
        let count = data.count as u32;
        let chance = self.accident();
        // What lies beyond two thresholds is an outlier; what lies between still helps, with a falling weight.
        let loss = Loss::Tukey(self.problem.threshold * T::TWO);
        let mut model = self.problem.optimise(model, &loss, 10).model;
        let inliers = self.mark(&model, mask, order);
        if !beyond_chance(count, inliers, 7, chance) {
            mask.iter_mut().for_each(|inlier| *inlier = false);
            let possible = beyond_chance(count, count, 7, chance);
            return (
                if possible { self.without_model() } else { FundamentalVerdict::TooFewInliers },
                T::ZERO,
            );
        }
        let mut noise = self.noise(&model);
        let sigma = max(self.sigma, noise);
        let indices = order.get(..inliers as usize).unwrap_or(&[]);
        if few_distinct(data, indices.iter().copied(), 7, sigma, chance) {
            return (FundamentalVerdict::Unobservable(Unobservable::TooFewDistinct), noise);
        }
        if on_a_line(data, indices, sigma, chance) {
            return (FundamentalVerdict::Unobservable(Unobservable::Collinear), noise);
        }
        if let Some(plane) = self.plane(indices, sigma) {
            let (on, off, outside) = self.split(&plane, sigma, mask, order);
            if 2 * on > inliers {
                let indices = order.get(..outside as usize).unwrap_or(&[]);
                if let Some(other) = self.through_plane(&plane, indices)
                    && self.problem.cost(&other) < self.problem.cost(&model)
                {
                    model = self.problem.optimise(&other, &loss, 10).model;
                    noise = self.noise(&model);
                }
                self.mark(&model, mask, order);
                let (_, agreeing, outside) = self.split(&plane, sigma, mask, order);
                if !beyond_chance(outside, core::cmp::max(agreeing, off), 2, chance) {
                    let h = self.units.pixels2() * plane.0 * self.units.normaliser1();
                    let h = h * (T::ONE / sqrt(h.norm_squared()));
                    return (FundamentalVerdict::Homography(Homography(h)), noise);
                }
            }
        }
        let f = self.units.normaliser2().transpose() * model.matrix() * self.units.normaliser1();
        let f = f * (T::ONE / sqrt(f.norm_squared()));
        (FundamentalVerdict::Found(Fundamental(f)), noise)
    }

    /// Writes the inliers, as a mask and as a list, and counts them.
    fn mark(&self, model: &FundamentalModel<T>, mask: &mut [bool], order: &mut [u32]) -> u32 {
        let f = model.matrix();
        let mut entries = mask.iter_mut().zip(0u32..);
        let mut free = order.iter_mut();
        let mut inliers = 0;
        for block in self.problem.data.blocks {
            for (&s, (inlier, index)) in self.problem.squared(block, &f).iter().zip(entries.by_ref()) {
                *inlier = s < T::ONE;
                if *inlier && let Some(entry) = free.next() {
                    *entry = index;
                    inliers += 1;
                }
            }
        }
        inliers
    }

    /// Root of the mean squared residual of the inliers.
    fn noise(&self, model: &FundamentalModel<T>) -> T {
        let problem = self.problem;
        let sums = problem.optimise(model, &Loss::Truncated(problem.threshold), 1).equations;
        let outside = from_u32::<T>((problem.data.count as u32).saturating_sub(sums.active));
        let squares = sums.cost - outside * problem.threshold * problem.threshold;
        sqrt(max(squares, T::ZERO) / from_u32(core::cmp::max(sums.active.saturating_sub(7), 1)))
    }

    /// The plane that holds the most inliers, refined.
    fn plane(&self, inliers: &[u32], sigma: T) -> Option<HomographyModel<T>> {
        let threshold = sigma * lit(3.5);
        let problem = TransferProblem { data: self.problem.data, threshold, subset: Some(inliers) };
        let budget = Budget { max_iterations: 60, ..Budget::default() };
        let options = RansacOptions { seed: self.seed, confidence: lit(0.99), min_iterations: 10, budget };
        let (model, _) = ransac(&problem, &options, None, 8, None).models[0]?;
        HomographyModel::new(&problem.optimise(&model, &Loss::Truncated(threshold), 8, lit(1e-6)).model.0)
    }

    /// How many inliers a plane explains, how many it does not, and how many correspondences in all it does not, listed
    /// in `order`.
    fn split(
        &self,
        plane: &HomographyModel<T>,
        sigma: T,
        mask: &[bool],
        order: &mut [u32],
    ) -> (u32, u32, u32) {
        let limit = sigma * sigma * lit(EXPLAINED_SIGMAS * EXPLAINED_SIGMAS);
        let mut entries = mask.iter().zip(0u32..);
        let mut free = order.iter_mut();
        let (mut on, mut off, mut outside) = (0, 0, 0);
        for block in self.problem.data.blocks {
            let squared = transfer_sq(&plane.0, block, &[T::ONE; LANES]);
            for (&s, (&inlier, index)) in squared.iter().zip(entries.by_ref()) {
                if s < limit {
                    on += inlier as u32;
                } else {
                    off += inlier as u32;
                    if let Some(entry) = free.next() {
                        *entry = index;
                        outside += 1;
                    }
                }
            }
        }
        (on, off, outside)
    }

    /// The best `F = [e]x H` with the epipole of two correspondences off the plane, refined.
    fn through_plane(&self, plane: &HomographyModel<T>, off: &[u32]) -> Option<FundamentalModel<T>> {
        let mut sampler = Sampler::<T>::uniform(self.seed, off.len() as u32);
        let mut best: Option<(FundamentalModel<T>, T)> = None;
        for k in 0..PARALLAX_PAIRS {
            let pair: [u32; 2] = sampler.sample(k)?;
            let line = |i: u32| {
                let (x1, x2) = self.problem.points(*off.get(i as usize)?)?;
                Some((plane.0 * x1).cross(&x2))
            };
            let (Some(a), Some(b)) = (line(pair[0]), line(pair[1])) else { continue };
            let epipole = a.cross(&b);
            let Some(model) = FundamentalModel::new(&(crate::geometry::pose::skew(&epipole) * plane.0))
            else {
                continue;
            };
            let gate = Gate::at(best.map_or(T::MAX, |(_, cost)| cost));
            let score = self.problem.score(&model, &gate, &mut ScoreCounts::default());
            if let Some(score) = score
                && best.is_none_or(|(_, cost)| score.cost < cost)
            {
                best = Some((model, score.cost));
            }
        }
        let (model, _) = best?;
        self.problem.refine(&model, &mut 0)
    }
}
