//! Random sample consensus: hypothesise, score with early exit, optimise what leads, stop when confident.

use super::budget::{Guide, Progress, RansacOptions, RansacReport, StopReason};
use super::estimator::{Estimator, ScoreCounts};
use super::sampler::Sampler;
use super::score::{Gate, Score};
use super::stopping::{iterations_needed, miss_probability, undetected_inlier_ratio};
use crate::Real;
use crate::real::{from_u32, lit, max, min};

/// How many locally optimised models a run keeps, best first.
pub const KEPT: usize = 4;

/// A sample's best hypothesis is optimised where it explains this share of what the best minimal model does: the
/// best minimal model need not lie in the best basin.
const SLACK: f64 = 0.7;
/// Until the best optimum has been met [`Estimator::DISCOVERIES`] times, the run lasts so many times as long.
const PATIENCE: u32 = 5;
/// Optima whose costs differ by less than this share of the correspondences count as the same one.
const SAME_OPTIMUM: f64 = 0.003;

/// What a run found: models after local optimisation, best first, and how it went.
#[derive(Clone, Copy, Debug)]
#[must_use]
pub struct Consensus<M, T> {
    /// The best model and the runners-up of other samples (often the same optimum again).
    pub models: [Option<(M, Score<T>)>; KEPT],
    /// How the run went.
    pub report: RansacReport<T>,
}

/// The consensus of an estimator's correspondences.
///
/// The best hypothesis of a sample is optimised locally where it comes near the best minimal model so far; the run
/// ends once samples enough for the inliers of the best optimised model have been drawn. Where samples lead to different
/// optima, one sample of inliers is not enough: until [`Estimator::DISCOVERIES`] of them have led to the best one, five
/// times as many samples are asked for. With an order, ranked and uniform samples alternate: the best ranked ones may lie
/// close together.
///
/// # Input
/// `order` maps the ranks of ranked sampling to correspondences; without it samples are uniform. `least_inliers` is
/// the smallest consensus of interest: it sharpens the sequential test while nothing has been found. `keep_going` is
/// asked before every [`Guide::INTERVAL`]-th iteration. Options are taken as they are: [`RansacOptions::check`] them.
///
/// # Returns
/// Up to [`KEPT`] models, best first, and the report. No model where every sample was degenerate, every hypothesis was
/// rejected, or there are fewer correspondences than a sample takes.
///
/// # Cost
/// At most the budget; one local optimisation, begun within the budget of residuals, may end beyond it.
/// Memory: the models alone, on the stack.
///
/// # References
/// M. Fischler, R. Bolles, "Random sample consensus", Communications of the ACM 24, 1981.
/// O. Chum, J. Matas, J. Kittler, "Locally optimized RANSAC", DAGM 2003. Here a hypothesis is optimised where it comes
/// near the best minimal model, not only where it beats it.
///
/// # Examples
/// A line through points, some of them wrong:
/// ```
/// use epipole::robust::{Estimator, Gate, RansacOptions, Score, ScoreCounts, ransac};
///
/// struct Points<'a>(&'a [(f32, f32)]);
///
/// impl Estimator<f32, 2> for Points<'_> {
///     type Model = (f32, f32); // y = a + b x
///
///     fn count(&self) -> u32 {
///         self.0.len() as u32
///     }
///
///     fn generate(&self, sample: &[u32; 2], found: &mut impl FnMut(&(f32, f32))) -> bool {
///         let [p, q] = sample.map(|i| self.0[i as usize]);
///         let b = (q.1 - p.1) / (q.0 - p.0);
///         found(&(p.1 - b * p.0, b));
///         true
///     }
///
///     fn score(&self, model: &(f32, f32), gate: &Gate<f32>, counts: &mut ScoreCounts) -> Option<Score<f32>> {
///         counts.residuals += self.0.len() as u64;
///         let mut score = Score { cost: 0.0, inliers: 0 };
///         for (x, y) in self.0 {
///             let squared = ((model.0 + model.1 * x - y) / 0.1).powi(2);
///             score.cost += squared.min(1.0);
///             score.inliers += u32::from(squared < 1.0);
///         }
///         (score.cost <= gate.bound).then_some(score)
///     }
///
///     fn refine(&self, _: &(f32, f32), _: &mut u64) -> Option<(f32, f32)> {
///         None
///     }
/// }
///
/// let points: [(f32, f32); 12] = core::array::from_fn(|i| {
///     let x = i as f32;
///     (x, if i % 3 == 0 { 7.0 - x * x } else { 1.0 + 0.5 * x })
/// });
/// let consensus = ransac(&Points(&points), &RansacOptions::default(), None, 2, None);
/// let ((a, b), score) = consensus.models[0].unwrap();
/// assert!((a - 1.0).abs() < 1e-5 && (b - 0.5).abs() < 1e-5 && score.inliers == 8);
/// ```
pub fn ransac<T: Real, E: Estimator<T, S>, const S: usize>(
    estimator: &E,
    options: &RansacOptions<T>,
    order: Option<&[u32]>,
    least_inliers: u32,
    mut keep_going: Option<&mut dyn FnMut(&Progress) -> bool>,
) -> Consensus<E::Model, T> {
    let count = estimator.count();
    let size = S as u32;
    let all = from_u32::<T>(count);
    let mut uniform = Sampler::<T>::uniform(options.seed, count);
    let mut ranked = Sampler::<T>::ranked(options.seed, count, size);
    let mut models: [Option<(E::Model, Score<T>)>; KEPT] = [None; KEPT];
    let mut spent = Progress::default();
    let mut counts = ScoreCounts::default();
    let mut refined_residuals = 0u64;
    let mut minimal_cost = T::MAX;
    let mut minimal_inliers = 0;
    let mut needed = u32::MAX;
    let mut discoveries = 0;
    let same = all * lit(SAME_OPTIMUM);
    let mut gate = gate::<T>(T::MAX, least_inliers, count, &counts);
    let budget = options.budget;
    // What may be spent when another hypothesis is looked at, and whether more has been.
    let one_score = E::SCORE_PASSES as u64 * count as u64;
    let last_start = budget.max_residuals.saturating_sub(one_score);
    let mut exhausted = budget.max_residuals < one_score;
    let mut stop = StopReason::MaxIterations;

    while spent.iterations < budget.max_iterations {
        let patience = if discoveries < E::DISCOVERIES { PATIENCE } else { 1 };
        if spent.iterations >= core::cmp::max(needed.saturating_mul(patience), options.min_iterations) {
            stop = StopReason::Confident;
            break;
        }
        if spent.solver_calls >= budget.max_solver_calls {
            stop = StopReason::MaxSolverCalls;
            break;
        }
        if exhausted || spent.residuals >= budget.max_residuals {
            stop = StopReason::MaxResiduals;
            break;
        }
        if spent.iterations > 0
            && spent.iterations.is_multiple_of(Guide::<T>::INTERVAL)
            && let Some(ask) = keep_going.as_mut()
            && !ask(&spent)
        {
            stop = StopReason::Interrupted;
            break;
        }
        // Ranked samples first, and every other time.
        let order = if spent.iterations.is_multiple_of(2) { order } else { None };
        let sampler = if order.is_some() { &mut ranked } else { &mut uniform };
        let Some(mut sample) = sampler.sample::<S>(spent.iterations) else { break };
        spent.iterations += 1;
        if let Some(order) = order {
            for entry in &mut sample {
                *entry = order.get(*entry as usize).copied().unwrap_or(0);
            }
        }

        // Near misses are optimised too, at a bounded rate.
        let near = minimal_cost < T::MAX
            && spent.refinements < E::NEAR_MISSES + spent.iterations / E::NEAR_MISS_INTERVAL;
        let bound = if near { all - (all - minimal_cost) * lit(SLACK) } else { minimal_cost };
        let mut leader: Option<(E::Model, Score<T>)> = None;
        let mut hypotheses = 0;
        let solved = estimator.generate(&sample, &mut |model| {
            exhausted |= counts.residuals + refined_residuals > last_start;
            if exhausted {
                return;
            }
            hypotheses += 1;
            let Some(model) = &estimator.polish(model, &mut counts) else { return };
            gate.bound = bound;
            let score = estimator.score(model, &gate, &mut counts);
            let Some(score) = score else { return };
            if score.cost < minimal_cost {
                minimal_cost = score.cost;
                minimal_inliers = score.inliers;
            }
            if leader.is_none_or(|(_, best)| score.cost < best.cost) {
                leader = Some((*model, score));
            }
        });
        spent.solver_calls += solved as u32;
        spent.hypotheses += hypotheses;
        spent.residuals = counts.residuals + refined_residuals;

        let Some((model, score)) = leader else { continue };
        let mut candidate = (model, score);
        if spent.residuals < budget.max_residuals {
            spent.refinements += 1;
            if let Some(refined) = estimator.refine(&model, &mut refined_residuals) {
                let bound = Gate::at(score.cost);
                if let Some(better) = estimator.score(&refined, &bound, &mut counts) {
                    candidate = (refined, better);
                }
            }
            spent.residuals = counts.residuals + refined_residuals;
        }
        let leads = models[0].is_none_or(|(_, best)| candidate.1.cost < best.cost);
        if leads && estimator.reject(&candidate.0) {
            continue;
        }
        discoveries = match models[0] {
            Some((_, best)) if candidate.1.cost > best.cost + same => discoveries,
            Some((_, best)) if candidate.1.cost > best.cost - same => discoveries + 1,
            _ => 1,
        };
        keep(&mut models, candidate);
        if leads {
            spent.inliers = candidate.1.inliers;
            needed = iterations_needed(options.confidence, spent.inliers, count, size);
            gate = self::gate(minimal_cost, core::cmp::max(least_inliers, minimal_inliers), count, &counts);
        }
    }

    let best = models[0].map(|(_, score)| score);
    let inliers = best.map_or(0, |score| score.inliers);
    Consensus {
        models,
        report: RansacReport {
            spent,
            stop,
            inliers,
            cost: best.map_or(from_u32(count), |score| score.cost),
            miss_probability: miss_probability(spent.iterations, inliers, count, size),
            excluded_inlier_ratio: undetected_inlier_ratio(options.confidence, spent.iterations, count, size),
        },
    }
}

/// The sequential test between `inliers` of `count` and the share of inliers that rejected models had so far.
fn gate<T: Real>(bound: T, inliers: u32, count: u32, counts: &ScoreCounts) -> Gate<T> {
    let ratio = |a: u64, b: u64| lit::<T>(a as f64) / lit::<T>(b as f64);
    // Before enough is known, 5 %; a measured share is kept within what separates right from wrong.
    let bad = if counts.rejected_residuals < 500 {
        lit(0.05)
    } else {
        min(ratio(counts.rejected_inliers, counts.rejected_residuals), lit(0.5))
    };
    Gate::new(bound, ratio(inliers as u64, core::cmp::max(count, 1) as u64), max(bad, lit(0.01)))
}

/// Inserts a model by its cost; the worst falls off.
fn keep<M: Copy, T: Real>(models: &mut [Option<(M, Score<T>)>; KEPT], candidate: (M, Score<T>)) {
    let mut moving = Some(candidate);
    for place in models {
        let Some((_, score)) = &moving else { return };
        if place.is_none_or(|(_, kept)| score.cost < kept.cost) {
            core::mem::swap(place, &mut moving);
        }
    }
}
