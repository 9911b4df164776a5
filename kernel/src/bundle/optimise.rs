//! Levenberg-Marquardt over the window, the points eliminated.

use super::constraint::{self, At};
use super::memory::{FrameHandle, FrameSlot, NO_SLOT, ObservationSlot, PointHandle, PointSlot};
use super::options::{BundleOptions, BundleReport, PointReport, Progress, Termination, Unknowns};
use super::pass::{self, Built, Points, Tried};
use super::residual::{Robust, squared_residual};
use super::system::{System, block_index};
use super::window::contradicts;
use super::{BundleError, Window};
use crate::Real;
use crate::real::{from_u32, is_finite, lit, max, min, sqrt};

/// Which frames may move.
#[derive(Clone, Copy)]
enum Frames {
    Free,
    Held,
    Only(u16),
}

impl<T: Real> Window<'_, T> {
    /// Moves frames and points to a minimum of
    ///
    /// ```text
    /// 1/2 sum rho(|(project(R_i (X_j - C_i)) - x_ij) / sigma_ij|^2) + 1/2 |priors|^2 + 1/2 |distances|^2
    /// ```
    ///
    /// by Levenberg-Marquardt on the poses' manifold, the points eliminated (Schur complement), Jacobians recomputed
    /// and not stored.
    ///
    /// # Input
    /// The window's frames, points and observations. Free points seen fewer than twice are left where they are. What
    /// no observation, prior or fixed frame determines (the gauge: seven degrees of freedom of a window without any)
    /// stays where the start has it, held by the damping.
    ///
    /// # Returns
    /// The report. [`BundleReport::changed`] says whether anything moved; a step is only taken where it lowers the cost.
    ///
    /// # Errors
    /// [`BundleError`]: the options, nothing free, no observations or none that count, a free frame that nothing
    /// constrains, contradictory fixed frames. The window is then as it was.
    ///
    /// # Degeneracies
    /// A point without parallax moves little along its ray. Behind a camera an observation does not count; no step
    /// takes a point out of the view of a camera that sees it.
    ///
    /// # Accuracy
    /// `f64` reaches the minimum to the cost tolerance, `f32` to a relative excess of about 1e-6 of the cost.
    ///
    /// # Cost
    /// At most [`BundleOptions::max_iterations`] iterations, each two linearisations and one projection of every
    /// observation. While the cost still falls by more than a tenth, an iteration also adds up a 6x6 block for every pair
    /// of frames that see a point together and factors the system, half of all work; afterwards up to four of five
    /// iterations keep the factor they have, with a new gradient and the curvature that the last step met.
    ///
    /// # References
    /// B. Triggs, P. McLauchlan, R. Hartley, A. Fitzgibbon, "Bundle adjustment: a modern synthesis", Vision Algorithms,
    /// 2000 (the elimination; the second-order weight of a robust loss, section 4.3). H. B. Nielsen, "Damping parameter
    /// in Marquardt's method", 1999 (the rule of the damping). J. Fan, "A Shamanskii-like Levenberg-Marquardt method for
    /// nonlinear equations", Computational Optimization and Applications 56, 2013 (steps that keep a factor). J. Nocedal,
    /// "Updating quasi-Newton matrices with limited storage", Mathematics of Computation 35, 1980 (the curvature). Deviation:
    /// Marquardt's diagonal for the frames is that of the reduced system.
    ///
    /// # Examples
    /// See the [module](super).
    pub fn optimise(&mut self, options: &BundleOptions<T>) -> Result<BundleReport<T>, BundleError> {
        self.optimise_while(options, |_| true)
    }

    /// [`optimise`](Self::optimise) as long as `go_on` says yes; it is asked before every iteration, with what has been
    /// done so far: the place for a timer.
    ///
    /// # Returns
    /// As [`optimise`](Self::optimise), with [`Termination::Interrupted`](super::Termination::Interrupted) where `go_on` said
    /// no: the window is then at the best place found.
    ///
    /// # Errors
    /// As [`optimise`](Self::optimise).
    pub fn optimise_while(
        &mut self,
        options: &BundleOptions<T>,
        go_on: impl FnMut(&Progress<T>) -> bool,
    ) -> Result<BundleReport<T>, BundleError> {
        let (frames, points) = match options.unknowns {
            Unknowns::FramesAndPoints => (Frames::Free, Points::Free),
            Unknowns::Frames => (Frames::Free, Points::Held),
            Unknowns::Points => (Frames::Held, Points::Free),
        };
        self.minimise(options, frames, points, go_on)
    }

    /// Moves one frame alone, all else held: pose-only refinement, for a new frame of known points.
    ///
    /// # Returns
    /// The report, as [`optimise`](Self::optimise).
    ///
    /// # Errors
    /// As [`optimise`](Self::optimise); [`BundleError::StaleFrame`].
    pub fn refine_frame(
        &mut self,
        frame: FrameHandle,
        options: &BundleOptions<T>,
    ) -> Result<BundleReport<T>, BundleError> {
        self.frame(frame).map_err(|_| BundleError::StaleFrame)?;
        self.minimise(options, Frames::Only(frame.index), Points::Held, |_| true)
    }

    /// Moves one point alone, all frames held: refinement of an N-view triangulation.
    ///
    /// # Returns
    /// The report, as [`optimise`](Self::optimise).
    ///
    /// # Errors
    /// As [`optimise`](Self::optimise); [`BundleError::StalePoint`].
    pub fn refine_point(
        &mut self,
        point: PointHandle,
        options: &BundleOptions<T>,
    ) -> Result<BundleReport<T>, BundleError> {
        self.point(point).map_err(|_| BundleError::StalePoint)?;
        self.minimise(options, Frames::Held, Points::Only(point.index), |_| true)
    }

    /// How well the observations of a point agree with it where it is, `outlier_sigma` deviations being the limit.
    ///
    /// # Returns
    /// How many observations there are, how many lie behind their camera or beyond the limit, and their errors: what a caller
    /// needs to drop a point.
    ///
    /// # Errors
    /// [`BundleError::StalePoint`].
    ///
    /// # Cost
    /// One projection an observation of the point.
    pub fn point_report(&self, point: PointHandle, outlier_sigma: T) -> Result<PointReport<T>, BundleError> {
        let position = &self.point(point).map_err(|_| BundleError::StalePoint)?.position;
        let mut report = PointReport { observations: 0, outliers: 0, behind: 0, rms_sigma: T::ZERO };
        let mut sum = T::ZERO;
        for o in self.group(point.index) {
            let Some(frame) = self.frames.get(o.frame as usize) else { continue };
            let Some(camera) = &frame.camera else { continue };
            report.observations += 1;
            match squared_residual(camera, &frame.pose, position, o) {
                None => report.behind += 1,
                Some(squared) => {
                    sum += squared;
                    report.outliers += usize::from(!(squared <= outlier_sigma * outlier_sigma));
                }
            }
        }
        let seen = report.observations.saturating_sub(report.behind);
        if seen > 0 {
            report.rms_sigma = sqrt(sum / from_u32(seen as u32));
        }
        Ok(report)
    }

    /// Gives column blocks to the frames that may move and counts them.
    fn assign_slots(&mut self, which: Frames) -> u16 {
        let mut used = 0;
        for (index, frame) in (0u16..).zip(self.frames.iter_mut()) {
            let free = frame.is_live()
                && !frame.fixed
                && match which {
                    Frames::Free => true,
                    Frames::Held => false,
                    Frames::Only(only) => only == index,
                };
            frame.slot = if free { used } else { NO_SLOT };
            used += u16::from(free);
            frame.trial = frame.pose;
        }
        for point in self.points.iter_mut() {
            point.trial = point.position;
        }
        used
    }

    fn minimise(
        &mut self,
        options: &BundleOptions<T>,
        frames: Frames,
        points: Points,
        mut go_on: impl FnMut(&Progress<T>) -> bool,
    ) -> Result<BundleReport<T>, BundleError> {
        options.check()?;
        for (index, frame) in self.frames.iter().enumerate() {
            if let Some(d) = &frame.distance
                && let Some(other) = self.frames.get(d.other as usize)
                && frame.fixed
                && other.fixed
                && contradicts(frame, other, d)
            {
                return Err(BundleError::ContradictoryFixedFrames { frame: index });
            }
        }
        let used = self.assign_slots(frames);
        let points_free = points != Points::Held && self.points.iter().any(|p| p.live && !p.fixed);
        if used == 0 && !points_free {
            return Err(BundleError::NothingFree);
        }
        let (Some((observations, _)), Some(system)) = (
            self.observations.split_at_checked(self.header.observations).filter(|(live, _)| !live.is_empty()),
            System::of(self.scalars, self.frames.len(), used as usize),
        ) else {
            return Err(BundleError::NoObservations);
        };
        let mut problem = Problem {
            frames: self.frames,
            points: self.points,
            observations,
            system,
            prior_frames: self.header.prior_frames,
            robust: Robust::new(options.loss),
            free: points,
            points_promise: T::ZERO,
        };
        let mut damping = options.initial_damping;
        let (mut cost, built) = problem.linearise(damping);
        if built.used == 0 && !(used > 0 && cost > T::ZERO) {
            return Err(BundleError::NoUsablePoint { behind: built.behind });
        }
        if let Some(frame) = problem.unconstrained_frame() {
            return Err(BundleError::UnconstrainedFrame { frame });
        }
        let observed = observations.len() as u32;
        let mut report = BundleReport {
            termination: Termination::Converged,
            changed: false,
            iterations: 0,
            cost_before: cost * T::HALF,
            cost_after: cost * T::HALF,
            observations: built.used,
            outliers: 0,
            behind: built.behind,
            unused_points: built.unused_points,
            evaluations: observed,
        };
        let least_damping = T::TWO * T::EPSILON;
        // Without noise every iteration halves what is left: no share of it would end the descent.
        let negligible = from_u32::<T>(observed) * lit(NEGLIGIBLE);
        let mut growth = T::TWO;
        let mut age = 0;
        let mut current = true;
        report.termination = loop {
            if report.iterations >= options.max_iterations {
                break Termination::IterationLimit;
            }
            let after =
                report.evaluations.saturating_add(observed.saturating_mul(if current { 2 } else { 3 }));
            if after > options.max_evaluations {
                break Termination::BudgetSpent;
            }
            let (iterations, evaluations) = (report.iterations, report.evaluations);
            if !go_on(&Progress { iterations, cost: cost * T::HALF, damping, evaluations }) {
                break Termination::Interrupted;
            }
            report.iterations += 1;
            report.evaluations = after;
            if !current {
                cost = problem.linearise(damping).0;
            }
            current = false;
            let tried = problem.try_step(damping);
            if let Some((Tried { change, lost_sight }, promised)) = tried {
                let small = options.cost_tolerance * max(cost, negligible);
                let gain = -change / promised;
                if !lost_sight && change < T::ZERO && gain > lit(1e-3) {
                    problem.accept();
                    report.changed = true;
                    cost += change;
                    // A lagged step that gains little says nothing of one that is not.
                    if -change <= small && !problem.system.lagged {
                        break Termination::Converged;
                    }
                    let curved = -change <= lit::<T>(CURVED) * cost;
                    let settled = curved == problem.robust.curved
                        && -change <= lit::<T>(LAGGED) * cost
                        && -change > small;
                    age = if settled && age < OLDEST { age + 1 } else { 0 };
                    problem.system.lagged = age > 0;
                    problem.robust.curved = curved;
                    let x = T::TWO * gain - T::ONE;
                    let shrink = max(T::ONE / lit(3.0), T::ONE - x * x * x);
                    damping = max(damping * shrink, least_damping);
                    growth = T::TWO;
                    continue;
                }
                // Where the promise itself is below the tolerance, rounding decides about the change.
                if !(promised > small || problem.system.lagged) {
                    break Termination::Converged;
                }
            }
            age = 0;
            if core::mem::replace(&mut problem.system.lagged, false) {
                continue;
            }
            problem.robust.curved = false;
            damping *= growth;
            growth *= T::TWO;
            if !(damping < lit(1e10)) {
                break Termination::NoProgress;
            }
        };
        report.cost_after = min(cost * T::HALF, report.cost_before);
        report.outliers = self.count_outliers(options);
        Ok(report)
    }

    fn count_outliers(&self, options: &BundleOptions<T>) -> usize {
        let limit = options.outlier_sigma * options.outlier_sigma;
        self.live_observations()
            .iter()
            .filter(|o| {
                let (Some(frame), Some(point)) =
                    (self.frames.get(o.frame as usize), self.points.get(o.point as usize))
                else {
                    return false;
                };
                let Some(camera) = &frame.camera else { return false };
                squared_residual(camera, &frame.pose, &point.position, o).is_some_and(|r| !(r <= limit))
            })
            .count()
    }
}

/// A fall by less than this share of the cost turns the curvature of the loss on.
const CURVED: f64 = 1e-3;
/// A fall by less than this share of the cost lets the next iteration keep the factored system.
const LAGGED: f64 = 0.1;
/// Iterations in a row that may keep it.
const OLDEST: u32 = 4;
/// The squared residual, in variances of its noise, that is as good as none: a thirtieth of a standard deviation.
const NEGLIGIBLE: f64 = 1e-3;

/// The window's slices while it is optimised.
struct Problem<'a, T: Real> {
    frames: &'a mut [FrameSlot<T>],
    points: &'a mut [PointSlot<T>],
    observations: &'a [ObservationSlot<T>],
    system: System<'a, T>,
    prior_frames: usize,
    robust: Robust<T>,
    free: Points,
    /// Twice the fall of the cost that the points promise with the frames held.
    points_promise: T,
}

impl<T: Real> Problem<'_, T> {
    /// Builds the reduced system where the window is; twice the cost.
    fn linearise(&mut self, damping: T) -> (T, Built<T>) {
        self.system.clear();
        // `step` serves as the row, so it is taken out of the system while rows are added to the rest.
        let row = core::mem::take(&mut self.system.step);
        let (prior, system) = (self.system.prior, &mut self.system);
        let mut cost = T::ZERO;
        constraint::rows(
            self.frames,
            prior,
            self.prior_frames,
            row.as_flattened_mut(),
            At::Current,
            None,
            |row, r| {
                cost += r * r;
                system.add_row(row, r);
            },
        );
        self.system.step = row;
        let built = pass::build(
            self.frames,
            self.points,
            self.observations,
            &mut self.system,
            &self.robust,
            self.free,
            damping,
        );
        self.points_promise = built.promised;
        (cost + built.rho, built)
    }

    /// A free frame on which nothing acts.
    fn unconstrained_frame(&self) -> Option<usize> {
        self.frames.iter().position(|frame| {
            let slot = frame.slot as usize;
            frame.slot != NO_SLOT
                && self
                    .system
                    .blocks
                    .get(block_index(slot, slot))
                    .is_some_and(|b| (0..6).all(|k| b[k][k] == T::ZERO))
        })
    }

    /// The step of this damping, as trial placements and positions, and twice the fall of the cost that the damped
    /// model promises; none where the system is not positive definite.
    fn try_step(&mut self, damping: T) -> Option<(Tried<T>, T)> {
        if !self.system.damp_and_factor(damping) {
            return None;
        }
        self.system.solve();
        let system = &mut self.system;
        let mut promised = self.points_promise;
        for frame in self.frames.iter_mut() {
            let slot = frame.slot as usize;
            let (Some(d), Some(b)) = (system.step.get(slot), system.rhs.get(slot)) else { continue };
            frame.trial = frame.pose.moved(d);
            for k in 0..6 {
                promised += d[k] * b[k];
            }
        }
        let mut tried = pass::back_substitute(
            self.frames,
            self.points,
            self.observations,
            system.step,
            &self.robust,
            self.free,
            damping,
        );
        let (prior, row) = (system.prior, system.step.as_flattened_mut());
        let mut change = T::ZERO;
        for (at, sign) in [(At::Trial, T::ONE), (At::Current, -T::ONE)] {
            constraint::rows(self.frames, prior, self.prior_frames, row, at, None, |_, r| {
                change += sign * r * r;
            });
        }
        tried.change += change;
        is_finite(tried.change).then_some((tried, promised))
    }

    /// Goes to where the last step led.
    fn accept(&mut self) {
        self.system.remember();
        for frame in self.frames.iter_mut().filter(|f| f.slot != NO_SLOT) {
            frame.pose = frame.trial;
        }
        for point in self.points.iter_mut().filter(|p| p.live) {
            point.position = point.trial;
        }
    }
}
