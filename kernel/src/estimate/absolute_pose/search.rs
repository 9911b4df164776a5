//! The search for a consensus: by the gravity prior first where there is one, and without it where that fails.

use nalgebra::{Matrix3, Vector3};

use super::super::prior::{Direction, PriorFit};
use super::NEEDED;
use super::hypothesis::{PoseProblem, UprightProblem};
use super::options::GravityPrior;
use crate::Real;
use crate::geometry::pose::upright;
use crate::real::{from_u32, is_finite, lit, min};
use crate::refine::reprojection::{CameraPose, ReprojectionBlock};
use crate::robust::budget::after;
use crate::robust::{Consensus, Progress, RansacOptions, StopReason, iterations_needed, ransac};

/// Standard deviations beyond which a prior is contradicted.
const PRIOR_SIGMAS: f64 = 4.0;
/// One correspondence in so many agrees at the least where the search by the prior may find it.
const LEAST_ONE_IN: u32 = 20;

/// A gravity prior, checked.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gravity<T: Real> {
    pub(super) direction: Direction<T>,
    /// Weight of the squared chord between the two, px^2.
    pub(super) weight: T,
    sigma_rad: T,
}

impl<T: Real> Gravity<T> {
    pub(super) fn new(prior: &GravityPrior<T>, sigma_px: T) -> Option<Self> {
        if !(is_finite(prior.sigma_rad) && prior.sigma_rad > T::ZERO) {
            return None;
        }
        let ratio = sigma_px / prior.sigma_rad;
        let direction = Direction::new(&prior.world, &prior.camera)?;
        Some(Self { direction, weight: ratio * ratio, sigma_rad: prior.sigma_rad })
    }

    /// The same prior weighed against another variance of an image coordinate, px^2, where that is less.
    pub(super) fn weighed(&self, variance: T) -> Self {
        let weight = variance / (self.sigma_rad * self.sigma_rad);
        Self { weight: min(self.weight, weight), ..*self }
    }

    /// The angle between the two in standard deviations.
    fn deviation(&self, pose: &CameraPose<T>) -> T {
        self.direction.turn_between(&pose.rotation) / self.sigma_rad
    }
}

/// The consensus with a gravity prior, and what became of the prior.
#[inline(never)]
pub(super) fn aided_search<T: Real, B: ReprojectionBlock<T>>(
    options: &RansacOptions<T>,
    gravity: &Gravity<T>,
    problem: &PoseProblem<'_, T, B>,
    order: Option<&[u32]>,
    mut keep_going: Option<&mut dyn FnMut(&Progress) -> bool>,
) -> (Consensus<CameraPose<T>, T>, Option<PriorFit<T>>) {
    let deviations_of = |consensus: &Consensus<CameraPose<T>, T>| {
        consensus.best.map_or(T::MAX, |(model, _)| gravity.deviation(&model))
    };
    let limit = lit(PRIOR_SIGMAS);
    let upright_frame = |v: &Vector3<T>| upright(v).unwrap_or_else(Matrix3::identity);
    let aided = UprightProblem {
        problem: *problem,
        world: upright_frame(&gravity.direction.from),
        camera: upright_frame(&gravity.direction.to),
    };
    // As many as a twentieth of inliers needs, so that something is left where the prior is wrong.
    let count = problem.data.count as u32;
    let least = core::cmp::max(count / LEAST_ONE_IN, NEEDED as u32);
    let most = core::cmp::max(iterations_needed(options.confidence, least, count, 2), options.min_iterations);
    let mut left = *options;
    left.budget.max_iterations = core::cmp::min(options.budget.max_iterations, most);
    // Reborrowed, for the second search may need it.
    let ask = keep_going.as_mut().map(|ask| &mut **ask as &mut dyn FnMut(&_) -> bool);
    let mut first = ransac::<T, _, 2>(&aided, &left, order, NEEDED as u32, ask);
    let deviations = deviations_of(&first);
    // Where less than 30 % agree, or the optimum has left the prior, the prior must win against a search without it.
    let share = from_u32::<T>(first.report.inliers) / from_u32(count);
    if deviations < limit && share > lit(0.3) {
        return (first, Some(PriorFit::Fits(deviations)));
    }
    let spent = first.report.spent;
    left.budget = options.budget.less(&spent);
    let interrupted = first.report.stop == StopReason::Interrupted;
    if interrupted {
        left.budget.max_iterations = 0;
    }
    let mut ask = after(spent, &mut keep_going);
    let ask = ask.as_mut().map(|ask| ask as &mut dyn FnMut(&_) -> bool);
    let mut second = ransac::<T, _, 3>(problem, &left, order, NEEDED as u32, ask);
    // The report is of both: what is asked for again by its iterations is the same.
    let total = spent.plus(&second.report.spent);
    let stop = if interrupted { StopReason::Interrupted } else { second.report.stop };
    for report in [&mut first.report, &mut second.report] {
        report.spent = Progress { inliers: report.inliers, ..total };
        report.stop = stop;
    }
    let chosen = if second.report.cost < first.report.cost { second } else { first };
    let deviations = deviations_of(&chosen);
    let fit =
        if deviations < limit { PriorFit::Fits(deviations) } else { PriorFit::Contradicted(deviations) };
    (chosen, chosen.best.map(|_| fit))
}
