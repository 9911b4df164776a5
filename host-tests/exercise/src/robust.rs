//! `epipole::robust`: the parts of RANSAC, and the engine on an estimator of the simplest kind.

use epipole::Real;
use epipole::real::{from_u32, is_finite, lit};
use epipole::robust::loss::Loss;
use epipole::robust::{
    Estimator, Gate, Guide, RansacOptions, Sampler, Score, ScoreCounts, Tally, iterations_needed,
    log_binomial_tail, miss_probability, probability_of_inlier_sample, rank_by_score, ransac,
    undetected_inlier_ratio,
};

use crate::{Sink, Source};

pub(crate) fn any_loss<T: Real>(source: &mut Source<'_>) -> Loss<T> {
    let scale = source.positive();
    match source.below(6) {
        0 => Loss::Squared,
        1 => Loss::Truncated(scale),
        2 => Loss::Huber(scale),
        3 => Loss::Cauchy(scale),
        4 => Loss::Tukey(scale),
        _ => Loss::GemanMcClure(scale),
    }
}

pub(crate) fn losses<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let loss = any_loss::<T>(source);
    let (cost, weight) = loss.evaluate(source.scalar());
    sink.numbers(&[cost, weight]);
    sink.flag(loss.support().is_some());
}

pub(crate) fn sampling_and_stopping<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let [count, inliers, size, iteration] = [0; 4].map(|_| source.byte()).map(u32::from);
    let mut uniform = Sampler::<T>::uniform(source.byte().into(), count);
    let mut ranked = Sampler::<T>::ranked(source.byte().into(), count, 5);
    for sample in
        [uniform.sample::<5>(iteration), ranked.sample::<5>(0), ranked.sample::<5>(1)].into_iter().flatten()
    {
        for index in sample {
            sink.count(index as usize);
            sink.flag(index < count);
        }
    }
    let confidence = source.scalar::<T>();
    sink.numbers(&[
        probability_of_inlier_sample::<T>(inliers, count, size),
        miss_probability::<T>(iteration, inliers, count, size),
        undetected_inlier_ratio(confidence, iteration, count, size),
        log_binomial_tail(count, inliers, source.scalar::<T>()),
    ]);
    sink.count(iterations_needed(confidence, inliers, count, size) as usize);
    let scores = source.array::<T, 9>();
    let mut order = [0; 9];
    rank_by_score(&scores, &mut order);
    for index in order {
        sink.count(index as usize);
    }
}

pub(crate) fn scoring<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let mut tally = Tally::<T>::new();
    tally.add(&source.array());
    tally.add_first(&source.array(), source.below(6));
    let score = tally.score();
    sink.numbers(&[tally.cost(), tally.inliers(), score.cost]);
    sink.count(score.inliers as usize);
    for gate in [
        Gate::open(),
        Gate::at(source.scalar()),
        Gate::new(source.scalar(), source.scalar(), source.scalar()),
    ] {
        sink.flag(gate.rejects(tally.cost(), tally.inliers(), source.scalar()));
    }
    let mut list = epipole::Solutions::<T, 2>::new();
    sink.flag(list.push(tally.cost()));
}

/// The value that most numbers are near to, from samples of two.
struct Location<T>([T; 20]);

impl<T: Real> Estimator<T, 2> for Location<T> {
    type Model = T;

    fn count(&self) -> u32 {
        20
    }

    fn generate(&self, sample: &[u32; 2], found: &mut impl FnMut(&T)) -> bool {
        let [a, b] = sample.map(|index| self.0.get(index as usize).copied().unwrap_or(T::ZERO));
        found(&((a + b) * T::HALF));
        is_finite(a) && is_finite(b)
    }

    fn apart(&self, a: u32, b: u32) -> Option<T> {
        Some(*self.0.get(a as usize)? - *self.0.get(b as usize)?)
    }

    fn polish(&self, model: &T, _bound: T, counts: &mut ScoreCounts) -> Option<T> {
        counts.residuals += 1;
        self.0.first().map(|x| *model + (*x - *model) * lit::<T>(1e-3))
    }

    fn score(&self, model: &T, gate: &Gate<T>, counts: &mut ScoreCounts) -> Option<Score<T>> {
        let mut score = Score { cost: T::ZERO, inliers: 0 };
        for (seen, &x) in (1u32..).zip(&self.0) {
            let squared = (x - *model) * (x - *model);
            score.cost += if squared < T::ONE { squared } else { T::ONE };
            score.inliers += u32::from(squared < T::ONE);
            counts.residuals += 1;
            if gate.rejects(score.cost, from_u32(score.inliers), from_u32(seen)) {
                counts.rejected_residuals += seen;
                return None;
            }
        }
        Some(score)
    }

    fn refine(&self, model: &T, residuals: &mut u32) -> Option<T> {
        *residuals += 20;
        Some(*model)
    }
}

pub(crate) fn engine<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let options = any_options::<T>(source);
    sink.flag(options.check().is_ok());
    let mut asked = 0;
    let mut keep_going = |_: &epipole::robust::Progress| {
        asked += 1;
        asked < 5
    };
    let guide = Guide::<T>::none();
    sink.flag(guide.scores.is_none());
    let location = Location(source.array());
    sink.flag(location.reject(&source.scalar()));
    sink.flag(location.settles(&source.scalar(), &mut 0));
    sink.flag(location.repeats(&[0, 1], &T::ZERO));
    sink.numbers(location.polish(&source.scalar(), T::MAX, &mut ScoreCounts::default()).iter());
    sink.flag(location.leads_back(&T::ONE, &T::ZERO));
    sink.flag(location.differs(&T::ONE, &T::ZERO));
    sink.flag(location.shares(&T::ONE, &T::ZERO, &mut 0));
    sink.count(location.least_consensus() as usize);
    let consensus = ransac(&location, &options, None, 3, Some(&mut keep_going));
    if let Some((model, score)) = consensus.best {
        sink.number(model);
        sink.number(score.cost);
    }
    sink.count(consensus.report.inliers as usize);
}

/// Options of a short run, now and then out of range.
pub(crate) fn any_options<T: Real>(source: &mut Source<'_>) -> RansacOptions<T> {
    let mut options = RansacOptions::default();
    if source.below(8) == 0 {
        options.confidence = source.scalar();
    }
    options.min_iterations = source.below(8) as u32;
    options.budget.max_iterations = source.below(40) as u32;
    options.seed = u64::from(source.byte());
    options
}
