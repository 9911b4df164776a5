//! Random sample consensus: hypothesise, score with early exit, optimise what leads, stop when confident.

use super::budget::{Guide, Progress, RansacOptions, RansacReport, StopReason};
use super::estimator::{Estimator, ScoreCounts};
use super::sampler::Sampler;
use super::score::{Gate, Score};
use super::stopping::{iterations_needed, miss_probability, undetected_inlier_ratio};
use crate::Real;
use crate::real::{from_u32, lit, max, min};

/// A sample's best hypothesis is optimised where it explains this share of what the best minimal model does: the
/// best minimal model need not lie in the best basin.
const SLACK: f64 = 0.7;
/// Where the best minimal model explains no more than chance, one in as many near misses is optimised.
const DOUBTFUL: u32 = 8;
/// Until the best optimum has been met as often as is wanted, the run lasts so many times as long, and this much longer.
const PATIENCE: u32 = 2;
/// After so many iterations a run asks which consensus is of any use: most have ended before.
const LONG: u32 = 256;
/// Optima whose costs differ by less than this share of the correspondences count as the same one; where most agree, also
/// those that differ by less than one correspondence.
const SAME_OPTIMUM: f64 = 0.003;

/// Another solution is a rival where what it explains less than the best is smaller than this share.
const RIVAL: f64 = 0.1;
/// A run for which no more iterations than these are needed lasts longer for any rival, also for one that explains the same
/// correspondences.
const BRIEF: u32 = 128;

/// So many samples of a run are not of near correspondences.
const UNIFORM: u32 = 32;

/// What a run found, and how it went.
#[derive(Clone, Copy, Debug)]
#[must_use]
pub struct Consensus<M, T> {
    /// The best model after local optimisation.
    pub best: Option<(M, Score<T>)>,
    /// How the run went.
    pub report: RansacReport<T>,
}

/// The consensus of an estimator's correspondences.
///
/// The best hypothesis of a sample is optimised locally where it comes near the best minimal model so far (more rarely
/// until that one explains more than chance); the run
/// ends once samples enough for the inliers of the best optimised model have been drawn. Where samples lead to different
/// optima, one sample of inliers is not enough: until [`Estimator::DISCOVERIES`] of them have led to the best one
/// ([`Estimator::RIVALLED_DISCOVERIES`] where another solution came near, which in a longer run must explain other
/// correspondences; half as many where most agree with the best), so many times as many samples, and as many again twice,
/// are asked for. A run that has found less than a consensus of any use ([`Estimator::least_consensus`]) ends once samples enough
/// for one have been drawn. With an order, ranked and uniform samples alternate: the best ranked ones may lie close together.
/// After 32 samples half of the uniform ones are of near correspondences, where the estimator tells distances
/// ([`Estimator::apart`]): those are right together more often. They count as all others do, so that where near ones are
/// wrong together the confidence is that of half as many samples.
///
/// # Input
/// `order` maps the ranks of ranked sampling to correspondences; without it samples are uniform. `least_inliers` is
/// the smallest consensus of interest: it sharpens the sequential test while nothing has been found. `keep_going` is
/// asked before every [`Guide::INTERVAL`]-th iteration. Options are taken as they are: [`RansacOptions::check`] them.
///
/// # Returns
/// The best model, and the report. No model where every sample was degenerate, every hypothesis was
/// rejected, or there are fewer correspondences than a sample takes.
///
/// # Cost
/// At most the budget; one local optimisation, begun within the budget of residuals, may end beyond it, with what compares
/// its model with the best.
/// Memory: three models on the stack.
///
/// # References
/// M. Fischler, R. Bolles, "Random sample consensus", Communications of the ACM 24, 1981.
/// O. Chum, J. Matas, J. Kittler, "Locally optimized RANSAC", DAGM 2003. Here a hypothesis is optimised where it comes
/// near the best minimal model, not only where it beats it.
/// D. Myatt, P. Torr, S. Nasuto, J. Bishop, R. Craddock, "NAPSAC: high noise, high dimensional robust estimation", BMVC 2002
/// (samples of near points; here the nearest of a few drawn from all, every other time).
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
///         counts.residuals += self.0.len() as u32;
///         let mut score = Score { cost: 0.0, inliers: 0 };
///         for (x, y) in self.0 {
///             let squared = ((model.0 + model.1 * x - y) / 0.1).powi(2);
///             score.cost += squared.min(1.0);
///             score.inliers += u32::from(squared < 1.0);
///         }
///         (score.cost <= gate.bound).then_some(score)
///     }
///
///     fn refine(&self, _: &(f32, f32), _: &mut u32) -> Option<(f32, f32)> {
///         None
///     }
/// }
///
/// let points: [(f32, f32); 12] = core::array::from_fn(|i| {
///     let x = i as f32;
///     (x, if i % 3 == 0 { 7.0 - x * x } else { 1.0 + 0.5 * x })
/// });
/// let consensus = ransac(&Points(&points), &RansacOptions::default(), None, 2, None);
/// let ((a, b), score) = consensus.best.unwrap();
/// assert!((a - 1.0).abs() < 1e-5 && (b - 0.5).abs() < 1e-5 && score.inliers == 8);
/// ```
#[cfg_attr(small, inline(never))]
pub fn ransac<T: Real, E: Estimator<T, S>, const S: usize>(
    estimator: &E,
    options: &RansacOptions<T>,
    order: Option<&[u32]>,
    least_inliers: u32,
    mut keep_going: Option<&mut dyn FnMut(&Progress) -> bool>,
) -> Consensus<E::Model, T> {
    let (count, size) = (estimator.count(), S as u32);
    let manners = Manners {
        discoveries: E::DISCOVERIES,
        rivalled_discoveries: E::RIVALLED_DISCOVERIES,
        near_misses: E::NEAR_MISSES,
        near_miss_interval: E::NEAR_MISS_INTERVAL,
        score_passes: E::SCORE_PASSES,
    };
    let mut search = Search::new(options, order.is_some(), count, size, least_inliers, manners);
    let mut best: Option<(E::Model, Score<T>)> = None;
    let mut sample = [0; S];
    while search.next(order, &mut sample, &mut keep_going) {
        if search.spent.iterations == LONG {
            search.ask_for(estimator.least_consensus());
        }
        if search.gathers(order.is_some()) {
            search.sampler.gather(search.spent.iterations, &mut sample, |a, b| estimator.apart(a, b));
        }
        if best.as_ref().is_some_and(|(model, _)| estimator.repeats(&sample, model)) {
            continue;
        }
        let bound = search.bound();
        let mut leader: Option<(E::Model, Score<T>)> = None;
        let solved = estimator.generate(&sample, &mut |model| {
            if !search.takes_hypothesis() {
                return;
            }
            let Some(model) = &estimator.polish(model, bound, &mut search.counts) else { return };
            if best.as_ref().is_some_and(|(best, _)| estimator.leads_back(model, best)) {
                return;
            }
            search.gate.bound = bound;
            let Some(score) = estimator.score(model, &search.gate, &mut search.counts) else { return };
            if score.cost < search.minimal.cost {
                search.minimal = score;
            }
            if leader.as_ref().is_none_or(|(_, best)| score.cost < best.cost) {
                leader = Some((*model, score));
            }
        });
        search.spent.solver_calls += solved as u32;
        search.add_up();

        let Some((model, score)) = leader else { continue };
        let mut candidate = (model, score);
        if search.spent.residuals < options.budget.max_residuals {
            search.spent.refinements += 1;
            if let Some(refined) = estimator.refine(&model, &mut search.refined_residuals) {
                let bound = Gate::at(score.cost);
                if let Some(better) = estimator.score(&refined, &bound, &mut search.counts) {
                    candidate = (refined, better);
                }
            }
            search.add_up();
        }
        let mut former = Former { cost: T::MAX, differs: false, contends: false };
        if let Some((model, score)) = &best {
            let differs = estimator.differs(&candidate.0, model);
            let contends = differs
                && search.would_be_rivalled(candidate.1.cost, score.cost)
                && (search.needed <= BRIEF
                    || !estimator.shares(&candidate.0, model, &mut search.refined_residuals));
            former = Former { cost: score.cost, differs, contends };
        }
        search.add_up();
        let leads = candidate.1.cost < former.cost;
        if leads {
            if estimator.reject(&candidate.0) {
                continue;
            }
            best = Some(candidate);
        }
        search.has_found(&candidate.1, &former);
        if leads && search.discoveries < search.wanted() {
            if estimator.settles(&candidate.0, &mut search.refined_residuals) {
                search.discoveries = u32::MAX;
            }
            search.add_up();
        }
    }
    Consensus { best, report: search.report(best.map(|(_, score)| score)) }
}

/// An estimator's constants.
struct Manners {
    discoveries: u32,
    rivalled_discoveries: u32,
    near_misses: u32,
    near_miss_interval: u32,
    score_passes: u32,
}

/// The cost of the best optimum before another, if there was one, whether the two are different solutions, and whether they
/// contend: the run then lasts longer.
struct Former<T> {
    cost: T,
    differs: bool,
    contends: bool,
}

/// What a run keeps beside its model: the same code for every estimator.
struct Search<'a, T> {
    options: &'a RansacOptions<T>,
    count: u32,
    size: u32,
    least_inliers: u32,
    manners: Manners,
    sampler: Sampler<T>,
    spent: Progress,
    counts: ScoreCounts,
    refined_residuals: u32,
    /// Of the best minimal model.
    minimal: Score<T>,
    /// Iterations for the best optimised model.
    needed: u32,
    discoveries: u32,
    /// The least consensus of any use, 0 where it is not known, and iterations for it.
    least_consensus: u32,
    least_needed: u32,
    /// The least cost of another solution than the best.
    rival: T,
    /// The cost of the last that contended with the best, and whether it comes near the best.
    contender: T,
    rivalled: bool,
    gate: Gate<T>,
    /// What may be spent when another hypothesis is looked at, and whether more has been.
    last_start: u32,
    exhausted: bool,
    stop: StopReason,
}

impl<'a, T: Real> Search<'a, T> {
    fn new(
        options: &'a RansacOptions<T>,
        ranked: bool,
        count: u32,
        size: u32,
        least_inliers: u32,
        manners: Manners,
    ) -> Self {
        let counts = ScoreCounts::default();
        let one_score = manners.score_passes.saturating_mul(count);
        Self {
            options,
            count,
            size,
            least_inliers,
            manners,
            sampler: if ranked {
                Sampler::ranked(options.seed, count, size)
            } else {
                Sampler::uniform(options.seed, count)
            },
            spent: Progress::default(),
            gate: gate(T::MAX, least_inliers, count, &counts),
            counts,
            refined_residuals: 0,
            minimal: Score { cost: T::MAX, inliers: 0 },
            needed: u32::MAX,
            discoveries: 0,
            least_consensus: 0,
            least_needed: u32::MAX,
            rival: from_u32(count),
            contender: from_u32(count),
            rivalled: false,
            last_start: options.budget.max_residuals.saturating_sub(one_score),
            exhausted: options.budget.max_residuals < one_score,
            stop: StopReason::MaxIterations,
        }
    }

    /// Draws the sample of another iteration; false where the run ends.
    fn next(
        &mut self,
        order: Option<&[u32]>,
        sample: &mut [u32],
        keep_going: &mut Option<&mut dyn FnMut(&Progress) -> bool>,
    ) -> bool {
        let wanted = self.wanted();
        let (spent, budget) = (&mut self.spent, &self.options.budget);
        if spent.iterations >= budget.max_iterations {
            return false;
        }
        let needed = if spent.inliers < self.least_consensus {
            self.least_needed
        } else {
            let patience = if self.discoveries < wanted { wanted.saturating_add(PATIENCE) } else { 1 };
            self.needed.saturating_mul(patience)
        };
        if spent.iterations >= core::cmp::max(needed, self.options.min_iterations) {
            self.stop = StopReason::Confident;
            return false;
        }
        if spent.solver_calls >= budget.max_solver_calls {
            self.stop = StopReason::MaxSolverCalls;
            return false;
        }
        if self.exhausted || spent.residuals >= budget.max_residuals {
            self.stop = StopReason::MaxResiduals;
            return false;
        }
        if spent.iterations > 0
            && spent.iterations.is_multiple_of(Guide::<T>::INTERVAL)
            && let Some(ask) = keep_going.as_mut()
            && !ask(spent)
        {
            self.stop = StopReason::Interrupted;
            return false;
        }
        // Ranked samples first, and every other time.
        let order = order.filter(|_| spent.iterations.is_multiple_of(2));
        if !self.sampler.draw(spent.iterations, order.is_some(), sample) {
            return false;
        }
        spent.iterations += 1;
        if let Some(order) = order {
            for entry in sample {
                *entry = order.get(*entry as usize).copied().unwrap_or(0);
            }
        }
        true
    }

    /// Whether this sample is to be of near correspondences: every other one of those that are not ranked, after a few. A model
    /// is the better the farther apart its sample is, and where most correspondences are right a few are enough.
    fn gathers(&self, ranked: bool) -> bool {
        let every = if ranked { 4 } else { 2 };
        self.spent.iterations > UNIFORM && self.spent.iterations.is_multiple_of(every)
    }

    /// Less than such a consensus is of no use.
    fn ask_for(&mut self, inliers: u32) {
        self.least_consensus = inliers;
        self.least_needed = iterations_needed(self.options.confidence, inliers, self.count, self.size);
    }

    /// The cost up to which a hypothesis is of interest: near misses are optimised too, at a bounded rate.
    fn bound(&self) -> T {
        let (all, least) = (from_u32::<T>(self.count), self.minimal.cost);
        let later = self.spent.iterations.checked_div(self.manners.near_miss_interval).unwrap_or(0);
        let limit = self.manners.near_misses + later;
        let limit = if self.beats_chance() { limit } else { limit / DOUBTFUL };
        let near = least < T::MAX && self.spent.refinements < limit;
        if near { all - (all - least) * lit(SLACK) } else { least }
    }

    /// True where more correspondences agree with the best minimal model than with the best of many wrong ones, which is their
    /// sample and three standard deviations more of the rest than with any of them.
    fn beats_chance(&self) -> bool {
        let expected = from_u32::<T>(self.count) * wrong_share(&self.counts);
        let excess = from_u32::<T>(self.minimal.inliers) - from_u32(self.size) - expected;
        excess > T::ZERO && excess * excess > expected * lit(9.0)
    }

    /// Whether another hypothesis is looked at, which is then counted.
    #[inline]
    fn takes_hypothesis(&mut self) -> bool {
        self.add_up();
        self.exhausted |= self.spent.residuals > self.last_start;
        self.spent.hypotheses += !self.exhausted as u32;
        !self.exhausted
    }

    /// True where most of the correspondences agree with the best optimum: then few others can come near it.
    fn most_agree(&self) -> bool {
        self.spent.inliers > self.count / 2
    }

    /// How many discoveries of the best optimum end a run.
    fn wanted(&self) -> u32 {
        let manners = &self.manners;
        let wanted = if self.rivalled { manners.rivalled_discoveries } else { manners.discoveries };
        if self.most_agree() { wanted.div_ceil(2) } else { wanted }
    }

    #[cfg_attr(small, inline(never))]
    fn add_up(&mut self) {
        self.spent.residuals = self.counts.residuals.saturating_add(self.refined_residuals);
    }

    /// True where a solution of such a cost comes near the best, of the least.
    fn near(&self, cost: T, least: T) -> bool {
        let all = from_u32::<T>(self.count);
        all - cost > (all - least) * lit(1.0 - RIVAL)
    }

    /// True where the best of two optima has no rival but for the other.
    #[cfg_attr(small, inline(never))]
    fn would_be_rivalled(&self, a: T, b: T) -> bool {
        let least = min(a, b);
        self.near(max(a, b), least) && !self.near(self.contender, least)
    }

    /// After another optimum than the best one before has been found.
    fn has_found(&mut self, score: &Score<T>, former: &Former<T>) {
        let all = from_u32::<T>(self.count);
        let mut same = all * lit(SAME_OPTIMUM);
        if self.most_agree() {
            same = max(same, T::ONE);
        }
        let (least, most) = (min(score.cost, former.cost), max(score.cost, former.cost));
        if former.differs {
            self.rival = min(self.rival, most);
        }
        if former.contends {
            self.contender = most;
        }
        self.rivalled = self.near(self.contender, least);
        self.discoveries = if score.cost > former.cost + same {
            self.discoveries
        } else if score.cost > former.cost - same {
            self.discoveries.saturating_add(1)
        } else {
            1
        };
        if score.cost < former.cost {
            self.spent.inliers = score.inliers;
            self.needed = iterations_needed(self.options.confidence, score.inliers, self.count, self.size);
            let inliers = core::cmp::max(self.least_inliers, self.minimal.inliers);
            self.gate = gate(self.minimal.cost, inliers, self.count, &self.counts);
        }
    }

    fn report(&self, best: Option<Score<T>>) -> RansacReport<T> {
        let (iterations, count, size) = (self.spent.iterations, self.count, self.size);
        let all = from_u32(count);
        let best = best.unwrap_or(Score { cost: all, inliers: 0 });
        let explained = all - best.cost;
        RansacReport {
            spent: self.spent,
            stop: self.stop,
            inliers: best.inliers,
            cost: best.cost,
            miss_probability: miss_probability(iterations, best.inliers, count, size),
            excluded_inlier_ratio: undetected_inlier_ratio(self.options.confidence, iterations, count, size),
            rival_share: if explained > T::ZERO { (all - self.rival) / explained } else { T::ZERO },
        }
    }
}

/// The sequential test between `inliers` of `count` and the share of inliers of wrong models.
fn gate<T: Real>(bound: T, inliers: u32, count: u32, counts: &ScoreCounts) -> Gate<T> {
    Gate::new(bound, from_u32::<T>(inliers) / from_u32(core::cmp::max(count, 1)), wrong_share(counts))
}

/// The share of inliers that rejected models had so far, within what separates right from wrong; 5 % before enough is
/// known.
#[cfg_attr(small, inline(never))]
fn wrong_share<T: Real>(counts: &ScoreCounts) -> T {
    if counts.rejected_residuals < 500 {
        return lit(0.05);
    }
    let share = from_u32::<T>(counts.rejected_inliers) / from_u32(counts.rejected_residuals);
    max(min(share, lit(0.5)), lit(0.01))
}
