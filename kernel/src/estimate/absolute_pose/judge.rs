//! From a consensus to a verdict.

use nalgebra::{Matrix3, Matrix6, Translation3, Vector3};

use super::super::Unobservable;
use super::super::chance::measured_accident;
use super::super::prior::PriorFit;
use super::NEEDED;
use super::hypothesis::PoseProblem;
use super::options::AbsolutePoseOptions;
use super::search::{Gravity, aided_search};
use super::shape::{Shape, shape_of_inliers};
use super::verdict::{AbsolutePose, AbsolutePoseEstimate, AbsolutePoseVerdict};
use super::workspace::AbsolutePoseWorkspace;
use crate::geometry::Pose;
use crate::geometry::pose::skew;
use crate::linalg::{LANES, Ldlt};
use crate::real::{abs, from_u32, lit, ln, max, sqrt};
use crate::refine::blocks::BlockSlice;
use crate::refine::lm::NormalEquations;
use crate::refine::reprojection::{CameraPose, ReprojectionBlock};
use crate::robust::loss::Loss;
use crate::robust::{
    Consensus, Guide, RansacReport, iterations_needed, log_binomial_tail, rank_by_score, ransac,
};
use crate::{Real, Solutions};

/// A second pose of a plane is told from the first if it is this much less likely (the logarithm of 100).
const LOG_ODDS: f64 = 4.6;
/// A consensus is believed if chance makes one like it with less than this probability (the logarithm of 5 %).
const LOG_CHANCE: f64 = -3.0;
/// What chance explains may be so much before it is measured, on each pixel with the points of so many others.
const LARGE_ACCIDENT: f64 = 0.3;
const MISPAIRED: usize = 64;
/// Samples drawn at the most to find out that the points lie behind the camera.
const MAX_BEHIND: u32 = 300;

/// What is asked of the loaded correspondences.
pub(super) struct Task<'a, T: Real> {
    pub(super) options: &'a AbsolutePoseOptions<T>,
    pub(super) sigma_px: T,
    /// Subtracted from the points.
    pub(super) mean: Vector3<T>,
}

/// The verdict on loaded correspondences. Inlined: of options without a prior the compiler then drops what uses one.
#[inline(always)]
pub(super) fn estimate<T: Real, B: ReprojectionBlock<T>>(
    task: &Task<'_, T>,
    gravity: Option<Gravity<T>>,
    focal: [T; 2],
    guide: Guide<'_, T>,
    workspace: &mut AbsolutePoseWorkspace<'_, T>,
) -> AbsolutePoseEstimate<T> {
    let count = workspace.count;
    let blocks = B::slice(workspace.numbers);
    let data = BlockSlice { blocks: blocks.get(..count.div_ceil(LANES)).unwrap_or(blocks), count };
    let problem = PoseProblem::new(data, focal, task.options.max_error_px);
    let order = match guide.scores {
        Some(scores) => {
            rank_by_score(scores, workspace.order);
            workspace.order.get(..count)
        }
        None => None,
    };
    let ransac_options = &task.options.ransac;
    let (consensus, fit, gravity) = match gravity {
        Some(gravity) => {
            let (consensus, fit) = aided_search(ransac_options, &gravity, &problem, order, guide.keep_going);
            // The prior takes part where it fits.
            let fits = matches!(fit, Some(PriorFit::Fits(_)));
            (consensus, fit, fits.then_some(gravity))
        }
        None => {
            let consensus =
                ransac::<T, _, 3>(&problem, ransac_options, order, NEEDED as u32, guide.keep_going);
            (consensus, None, None)
        }
    };
    let mask = workspace.inliers.get_mut(..count).unwrap_or_default();
    judged(task, &problem, &consensus, fit, gravity.as_ref(), mask)
}

/// The verdict on what a search found.
#[inline(never)]
fn judged<T: Real, B: ReprojectionBlock<T>>(
    task: &Task<'_, T>,
    problem: &PoseProblem<'_, T, B>,
    consensus: &Consensus<CameraPose<T>, T>,
    fit: Option<PriorFit<T>>,
    gravity: Option<&Gravity<T>>,
    mask: &mut [bool],
) -> AbsolutePoseEstimate<T> {
    let count = problem.data.count;
    mask.iter_mut().for_each(|inlier| *inlier = false);
    let mut estimate = AbsolutePoseEstimate {
        verdict: AbsolutePoseVerdict::NoConsensus,
        gravity: None,
        noise_px: T::ZERO,
        report: consensus.report,
    };
    let found = consensus.best.map(|(model, _)| model);
    let believed = found.filter(|model| beyond_chance(task, problem, model, &consensus.report));
    // Points behind the camera show a depth-reversed shape that a part of them fits in front, too.
    let few = 2 * consensus.report.inliers < count as u32;
    if few && behind_camera(task, problem, consensus) {
        estimate.verdict = AbsolutePoseVerdict::BehindCamera;
        return estimate;
    }
    let Some(model) = believed else {
        if found.is_some() && consensus.report.inliers > 3 {
            estimate.verdict = AbsolutePoseVerdict::TooFewInliers;
        }
        return estimate;
    };
    estimate.gravity = fit;
    let truncated = Loss::Truncated(problem.threshold);
    // A prior is weighed against the noise there is, lest it outweigh correspondences better than they are said to be.
    let gravity = gravity.map(|gravity| {
        let sums = problem.optimise(&model, &truncated, None, 1, T::ZERO).equations;
        gravity.weighed(variance(task, problem, &sums))
    });
    let gravity = gravity.as_ref();
    // A pose where Tukey's loss is least, which no single correspondence at the threshold moves; its inliers' equations.
    let refined = |model: &CameraPose<T>, passes: u32| {
        let wide = Loss::Tukey(problem.threshold * T::TWO);
        let model = problem.optimise(model, &wide, gravity, passes, lit(1e-4)).model;
        problem.optimise(&model, &truncated, gravity, 1, T::ZERO)
    };
    let best = refined(&model, 12);
    let mut entries = mask.iter_mut();
    problem.for_each_block(&best.model, |_, relative, filled| {
        for (inlier, &s) in entries.by_ref().take(filled).zip(relative) {
            *inlier = s < T::ONE;
        }
    });
    let finish = |pose: &CameraPose<T>, sums: &NormalEquations<T, 6>| {
        let variance = variance(task, problem, sums);
        let active = from_u32::<T>(core::cmp::max(sums.active, 1));
        AbsolutePose {
            pose: shifted(&pose.pose(), &task.mean),
            covariance: covariance(&sums.hessian, variance, &(pose.rotation * task.mean)),
            rms_px: sqrt(squares(problem, sums) / active),
        }
    };
    let first = finish(&best.model, &best.equations);
    estimate.noise_px = sqrt(variance(task, problem, &best.equations));
    estimate.verdict = match shape_of_inliers(problem, &best.model) {
        Shape::Repeated => AbsolutePoseVerdict::Unobservable(Unobservable::TooFewDistinct),
        Shape::Line => AbsolutePoseVerdict::Unobservable(Unobservable::Collinear),
        Shape::Volume => AbsolutePoseVerdict::Pose(first),
        Shape::Flat { twin } => {
            let second = refined(&twin, 20);
            let turned = (second.model.rotation - best.model.rotation).norm_squared();
            let moved = (second.model.translation - best.model.translation).norm_squared();
            let same = turned < lit(1e-4) && moved < lit::<T>(1e-4) * best.model.translation.norm_squared();
            let noise = estimate.noise_px * estimate.noise_px;
            let worse = second.equations.cost - best.equations.cost;
            if !same && worse < lit::<T>(2.0 * LOG_ODDS) * max(noise, T::MIN_POSITIVE) {
                let mut poses = Solutions::new();
                let second = finish(&second.model, &second.equations);
                let (first, second) = if worse < T::ZERO { (second, first) } else { (first, second) };
                poses.push(first);
                poses.push(second);
                AbsolutePoseVerdict::PlanarAmbiguity(poses)
            } else {
                AbsolutePoseVerdict::Pose(first)
            }
        }
    };
    estimate
}

/// True where a pose has more inliers than the best of as many poses of wrong correspondences.
fn beyond_chance<T: Real, B: ReprojectionBlock<T>>(
    task: &Task<'_, T>,
    problem: &PoseProblem<'_, T, B>,
    model: &CameraPose<T>,
    report: &RansacReport<T>,
) -> bool {
    if (report.inliers as usize) < NEEDED {
        return false;
    }
    // A wrong pose puts a point within the threshold of its pixel as often as the disc's share of the image's extent.
    let mut extent = T::ZERO;
    let zero = CameraPose { rotation: Matrix3::zeros(), translation: Vector3::z() };
    problem.for_each_block(&zero, |block, _, filled| {
        for l in 0..filled {
            let [a, b, _] = block.rows(l, problem.focal);
            let size = max(abs(a[2]), abs(b[2]));
            extent = if size > extent { size } else { extent };
        }
    });
    let radius = task.options.max_error_px / max(extent, task.options.max_error_px * T::TWO);
    let disc = radius * radius;
    let tried = ln(from_u32::<T>(core::cmp::max(report.spent.hypotheses, 1)));
    let proven = |chance: T| {
        tried + log_binomial_tail(problem.data.count as u32 - 3, report.inliers - 3, chance) < lit(LOG_CHANCE)
    };
    // A pose that draws the points together, or a cluster of them to one of pixels, meets more than its disc's share:
    // measured where it matters.
    let scale = problem.scale();
    let measured = || {
        measured_accident(problem.data, disc, MISPAIRED, 0, |block, other| {
            problem.relative(&block.mispaired(other), model, scale)
        })
    };
    proven(max(disc, lit(LARGE_ACCIDENT))) || proven(measured())
}

/// True where poses with the points behind the camera find a consensus twice as large as the one in front.
fn behind_camera<T: Real, B: ReprojectionBlock<T>>(
    task: &Task<'_, T>,
    problem: &PoseProblem<'_, T, B>,
    in_front: &Consensus<CameraPose<T>, T>,
) -> bool {
    let count = problem.data.count as u32;
    let wanted = core::cmp::max(2 * in_front.report.inliers, NEEDED as u32);
    let mirrored = PoseProblem { facing: -T::ONE, ..*problem };
    let mut options = task.options.ransac;
    let needed = iterations_needed(options.confidence, wanted, count, 3);
    // No more than the search itself took: a run that ended early is repeated by the iterations it reports.
    let spent = in_front.report.spent.iterations;
    options.budget.max_iterations = core::cmp::min(spent, core::cmp::min(needed, MAX_BEHIND));
    let behind = ransac::<T, _, 3>(&mirrored, &options, None, wanted, None);
    behind.report.inliers >= wanted
        && behind.best.is_some_and(|(model, _)| beyond_chance(task, &mirrored, &model, &behind.report))
}

/// The sum of the inliers' squared residuals, px^2.
fn squares<T: Real, B: ReprojectionBlock<T>>(
    problem: &PoseProblem<'_, T, B>,
    sums: &NormalEquations<T, 6>,
) -> T {
    let outside = from_u32::<T>((problem.data.count as u32).saturating_sub(sums.active));
    max(sums.cost - outside * problem.threshold * problem.threshold, T::ZERO)
}

/// The variance of an image coordinate: of the residuals if there are enough, otherwise the one assumed.
fn variance<T: Real, B: ReprojectionBlock<T>>(
    task: &Task<'_, T>,
    problem: &PoseProblem<'_, T, B>,
    sums: &NormalEquations<T, 6>,
) -> T {
    let freedom = (2 * sums.active).saturating_sub(6);
    if freedom < 10 { task.sigma_px * task.sigma_px } else { squares(problem, sums) / from_u32(freedom) }
}

/// The covariance for points that are not counted from their mean: `t = t' - R mean`.
fn covariance<T: Real>(hessian: &Matrix6<T>, variance: T, turned_mean: &Vector3<T>) -> Option<Matrix6<T>> {
    let about_mean = Ldlt::new(hessian)?.inverse() * variance;
    let mut j = Matrix6::identity();
    let lever = skew(turned_mean);
    for p in 0..3 {
        for q in 0..3 {
            j.data.0[q][3 + p] = lever.data.0[q][p];
        }
    }
    Some(j * about_mean * j.transpose())
}

fn shifted<T: Real>(pose: &Pose<T>, mean: &Vector3<T>) -> Pose<T> {
    let translation = pose.translation.vector - pose.rotation * mean;
    Pose::from_parts(Translation3::from(translation), pose.rotation)
}
