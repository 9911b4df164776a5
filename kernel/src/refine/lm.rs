//! Levenberg and Marquardt's method for matrices on a manifold, with the Sampson error of blocks of correspondences.

use nalgebra::{Matrix3, SMatrix, SVector};

use super::blocks::{BlockSlice, EpipolarBlock};
use crate::Real;
use crate::linalg::{LANES, Lanes, damped_step};
use crate::real::{from_u32, lit};
use crate::robust::loss::Loss;

/// A model whose epipolar matrix depends on `P` local parameters.
pub(crate) trait Manifold<T: Real, const P: usize>: Copy {
    /// The matrix of `x2' F x1`.
    fn matrix(&self) -> Matrix3<T>;
    /// The model moved by a step in the local parameters.
    fn retract(&self, step: &SVector<T, P>) -> Self;
}

/// A model given by the derivatives of its matrix.
pub(crate) trait Tangents<T: Real, const P: usize>: Manifold<T, P> {
    /// The derivative of the matrix by each local parameter, row by row.
    fn tangents(&self) -> [[T; 9]; P];
}

/// A model with the Sampson error.
pub(crate) trait EpipolarModel<T: Real, const P: usize>: Manifold<T, P> {
    /// What is computed once a pass.
    type Frame;
    /// What a pass over the data needs of the model.
    fn frame(&self) -> Self::Frame;
    /// What is known of a correspondence before its derivatives.
    type Sight;
    /// A correspondence as the model sees it.
    fn sight<B: EpipolarBlock<T>>(frame: &Self::Frame, block: &B, lane: usize) -> Self::Sight;
    /// The same where it has a squared residual below `limit`, and may be explained by the model at all (is in front of the
    /// cameras).
    fn inside<B: EpipolarBlock<T>>(
        frame: &Self::Frame,
        block: &B,
        lane: usize,
        limit: T,
    ) -> Option<Self::Sight>;
    /// Its residual and derivatives.
    fn row<B: EpipolarBlock<T>>(
        frame: &Self::Frame,
        block: &B,
        lane: usize,
        sight: &Self::Sight,
    ) -> Row<T, P>;
    /// Sums by the parameters of the rows, as sums by those of the model.
    fn turn_back(_frame: &Self::Frame, _sums: &mut NormalEquations<T, P>) {}
}

/// The residual `r = c / sqrt(d)` of a correspondence, without a root: only squares and products of them are summed.
#[derive(Clone, Copy)]
pub(crate) struct Row<T, const P: usize> {
    /// `c`.
    pub(crate) c: T,
    /// `1 / d`.
    pub(crate) inverse: T,
    /// `sqrt(d)` times the derivatives of `r`.
    pub(crate) j: [T; P],
}

/// Sums of one pass: `J'WJ`, `J'Wr` and the cost.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NormalEquations<T: Real, const P: usize> {
    /// `J' W J`.
    pub(crate) hessian: SMatrix<T, P, P>,
    /// `J' W r`.
    pub(crate) gradient: SVector<T, P>,
    /// Sum of the losses of all correspondences.
    pub(crate) cost: T,
    /// Correspondences with a weight above zero.
    pub(crate) active: u32,
}

impl<T: Real, const P: usize> NormalEquations<T, P> {
    /// Of no correspondences.
    pub(crate) fn zero() -> Self {
        Self { hessian: SMatrix::zeros(), gradient: SVector::zeros(), cost: T::ZERO, active: 0 }
    }

    /// The step to the minimum, each diagonal element larger by the share `damping`, and by how much it promises to lower
    /// the cost; none where a direction is open.
    pub(crate) fn step(&self, damping: T) -> Option<(SVector<T, P>, T)> {
        damped_step(&self.hessian, &self.gradient, damping)
    }

    /// Adds those of other correspondences.
    pub(crate) fn accumulate(&mut self, other: &Self) {
        self.hessian += other.hessian;
        self.gradient += other.gradient;
        self.cost += other.cost;
        self.active += other.active;
    }
}

struct Sums<T, const P: usize> {
    hessian: [[Lanes<T>; P]; P],
    gradient: [Lanes<T>; P],
    cost: Lanes<T>,
}

impl<T: Real, const P: usize> Sums<T, P> {
    /// Of no correspondences: a constant, so that it is made in place.
    const ZERO: Self =
        Self { hessian: [[[T::ZERO; LANES]; P]; P], gradient: [[T::ZERO; LANES]; P], cost: [T::ZERO; LANES] };

    /// Adds the first `filled` of four correspondences, each to a lane.
    #[cfg_attr(not(small), inline(always))]
    #[cfg_attr(small, inline(never))]
    fn add_rows(&mut self, rows: &[Row<T, P>; LANES], filled: usize, loss: &Loss<T>) {
        for l in 0..LANES {
            if l < filled {
                let Row { c, inverse, j } = rows[l];
                let (cost, weight) = loss.evaluate(c * c * inverse);
                self.cost[l] += cost;
                let w = weight * inverse;
                for p in 0..P {
                    let weighted = w * j[p];
                    self.gradient[p][l] += weighted * c;
                    for q in 0..P {
                        if q <= p {
                            self.hessian[p][q][l] += weighted * j[q];
                        }
                    }
                }
            }
        }
    }

    /// Adds the lanes of a block of which the first `filled` count, side by side.
    #[cfg_attr(not(small), inline(always))]
    fn add<B: EpipolarBlock<T>, M: EpipolarModel<T, P>>(
        &mut self,
        frame: &M::Frame,
        block: &B,
        loss: &Loss<T>,
        filled: usize,
    ) {
        let (mut c, mut inverse, mut j) = ([T::ZERO; LANES], [T::ZERO; LANES], [[T::ZERO; LANES]; P]);
        for l in 0..LANES {
            let row = M::row(frame, block, l, &M::sight(frame, block, l));
            (c[l], inverse[l]) = (row.c, row.inverse);
            for p in 0..P {
                j[p][l] = row.j[p];
            }
        }
        let mut w = [T::ZERO; LANES];
        for l in 0..LANES {
            if l < filled {
                let (cost, weight) = loss.evaluate(c[l] * c[l] * inverse[l]);
                self.cost[l] += cost;
                w[l] = weight * inverse[l];
            }
        }
        for p in 0..P {
            let mut weighted = [T::ZERO; LANES];
            for l in 0..LANES {
                weighted[l] = w[l] * j[p][l];
                self.gradient[p][l] += weighted[l] * c[l];
            }
            for q in 0..P {
                if q <= p {
                    for l in 0..LANES {
                        self.hessian[p][q][l] += weighted[l] * j[q][l];
                    }
                }
            }
        }
    }

    /// Adds every `step`-th block: how many correspondences have a weight, and how many were looked at. Those of blocks of
    /// which others are left out are packed into full blocks first.
    #[cfg_attr(not(small), inline(always))]
    fn add_in_lanes<B: EpipolarBlock<T>, M: EpipolarModel<T, P>>(
        &mut self,
        frame: &M::Frame,
        data: BlockSlice<'_, B>,
        step: usize,
        loss: &Loss<T>,
        limit: T,
    ) -> (u32, usize) {
        let (mut active, mut seen) = (0u32, 0usize);
        let mut pending = B::zero();
        let mut filled = 0usize;
        let mut left = data.count;
        // After the last block what is pending; one place for the derivatives keeps the code small.
        for block in data.blocks.iter().step_by(step).map(Some).chain(core::iter::once(None)) {
            let packed;
            let (current, lanes) = if let Some(block) = block {
                let mut inside = [false; LANES];
                for l in 0..LANES {
                    inside[l] = M::inside(frame, block, l, limit).is_some() & (l < left);
                }
                seen += core::cmp::min(left, LANES);
                left = left.saturating_sub(step.saturating_mul(LANES));
                if inside == [false; LANES] {
                    continue;
                }
                if inside == [true; LANES] {
                    active += LANES as u32;
                    (block, LANES)
                } else {
                    let mut ready = None;
                    for l in 0..LANES {
                        if inside[l] {
                            pending.set_lane(filled, block, l);
                            filled += 1;
                            active += 1;
                            if filled == LANES {
                                ready = Some(pending);
                                filled = 0;
                            }
                        }
                    }
                    let Some(full) = ready else { continue };
                    packed = full;
                    (&packed, LANES)
                }
            } else {
                (&pending, filled)
            };
            if lanes > 0 {
                self.add::<B, M>(frame, current, loss, lanes);
            }
        }
        (active, seen)
    }

    /// The same sums, bit for bit, where a core has no registers for lanes side by side: one correspondence after the other,
    /// each in registers from the pixels to its row.
    #[cfg_attr(not(small), inline(always))]
    fn add_in_turn<B: EpipolarBlock<T>, M: EpipolarModel<T, P>>(
        &mut self,
        frame: &M::Frame,
        data: BlockSlice<'_, B>,
        step: usize,
        loss: &Loss<T>,
        limit: T,
    ) -> (u32, usize) {
        let (mut active, mut seen) = (0u32, 0usize);
        let none = Row { c: T::ZERO, inverse: T::ZERO, j: [T::ZERO; P] };
        // Those that wait for a lane each, and after them those of a block.
        let mut rows = [[none; LANES]; 2];
        let mut waiting = 0usize;
        let mut left = data.count;
        for block in data.blocks.iter().step_by(step) {
            let mut end = waiting;
            for l in 0..LANES {
                if l < left
                    && let Some(sight) = M::inside(frame, block, l, limit)
                {
                    if let Some(place) = rows.as_flattened_mut().get_mut(end) {
                        *place = M::row(frame, block, l, &sight);
                    }
                    end += 1;
                }
            }
            seen += core::cmp::min(left, LANES);
            left = left.saturating_sub(step.saturating_mul(LANES));
            active += (end - waiting) as u32;
            if end - waiting == LANES {
                // A full block does not wait.
                if let Some(full) = rows.as_flattened().get(waiting..).and_then(|rows| rows.first_chunk()) {
                    self.add_rows(full, LANES, loss);
                }
                continue;
            }
            waiting = end;
            if let Some(over) = end.checked_sub(LANES) {
                let [full, rest] = &mut rows;
                self.add_rows(full, LANES, loss);
                // Two at the most, for neither those that waited nor those of the block were four. Both, for a copy of so
                // many would link `memmove`.
                (full[0], full[1]) = (rest[0], rest[1]);
                waiting = over;
            }
        }
        self.add_rows(&rows[0], waiting, loss);
        (active, seen)
    }
}

#[cfg_attr(not(small), inline(always))]
fn total<T: Real>(lanes: &Lanes<T>) -> T {
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3])
}

/// [`sampled_equations`] of every block.
pub(crate) fn normal_equations<T, B, M, const P: usize>(
    data: BlockSlice<'_, B>,
    model: &M,
    loss: &Loss<T>,
) -> NormalEquations<T, P>
where
    T: Real,
    B: EpipolarBlock<T>,
    M: EpipolarModel<T, P>,
{
    sampled_equations(data, 1, model, loss)
}

/// One pass over every `step`-th block. Correspondences beyond the loss's support are left out; the others of blocks that
/// hold such are packed into full blocks first, so that the derivatives are computed for them alone and no second copy of
/// the data is needed.
pub(crate) fn sampled_equations<T, B, M, const P: usize>(
    data: BlockSlice<'_, B>,
    step: usize,
    model: &M,
    loss: &Loss<T>,
) -> NormalEquations<T, P>
where
    T: Real,
    B: EpipolarBlock<T>,
    M: EpipolarModel<T, P>,
{
    let step = core::cmp::max(step, 1);
    let frame = model.frame();
    let mut sums = Sums::<T, P>::ZERO;
    let support = loss.support();
    let limit = support.unwrap_or(T::MAX);
    let (active, seen) = if cfg!(scalar) {
        sums.add_in_turn::<B, M>(&frame, data, step, loss, limit)
    } else {
        sums.add_in_lanes::<B, M>(&frame, data, step, loss, limit)
    };
    let mut equations = NormalEquations::zero();
    for p in 0..P {
        equations.gradient.data.0[0][p] = total(&sums.gradient[p]);
        for q in 0..P {
            let (a, b) = if q <= p { (p, q) } else { (q, p) };
            equations.hessian.data.0[q][p] = total(&sums.hessian[a][b]);
        }
    }
    let outside = from_u32::<T>((seen as u32).saturating_sub(active));
    let beyond = support.map_or(T::ZERO, |limit| loss.evaluate(limit).0);
    equations.cost = total(&sums.cost) + outside * beyond;
    equations.active = active;
    M::turn_back(&frame, &mut equations);
    equations
}

/// How a minimisation ended.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Minimum<M, T: Real, const P: usize> {
    /// The best model.
    pub(crate) model: M,
    /// The sums there, or before a last step too small for another pass.
    pub(crate) equations: NormalEquations<T, P>,
    /// Passes over the data.
    pub(crate) passes: u32,
}

/// Minimises the loss from `start` in at most `max_passes` passes over the data; ends with a step that lowers the cost, or
/// promises to, by less than the share `tolerance`.
pub(crate) fn minimise<T, B, M, const P: usize>(
    data: BlockSlice<'_, B>,
    start: &M,
    loss: &Loss<T>,
    max_passes: u32,
    tolerance: T,
) -> Minimum<M, T, P>
where
    T: Real,
    B: EpipolarBlock<T>,
    M: EpipolarModel<T, P>,
{
    descend(start, P as u32, max_passes, tolerance, |model| normal_equations(data, model, loss), M::retract)
}

/// [`minimise`] for any normal equations and retraction; nothing moves where fewer than `least_active` residuals have
/// a weight.
pub(crate) fn descend<T, M, const P: usize>(
    start: &M,
    least_active: u32,
    max_passes: u32,
    tolerance: T,
    normal_equations: impl Fn(&M) -> NormalEquations<T, P>,
    retract: impl Fn(&M, &SVector<T, P>) -> M,
) -> Minimum<M, T, P>
where
    T: Real,
    M: Copy,
{
    let mut best = Minimum { model: *start, equations: normal_equations(start), passes: 1 };
    let mut damping: T = lit(1e-4);
    while best.passes < max_passes {
        if best.equations.active < least_active {
            break;
        }
        let Some((step, promise)) = best.equations.step(damping) else {
            damping *= lit(100.0);
            best.passes += 1;
            continue;
        };
        let model = retract(&best.model, &step);
        // What the step promises is not worth the pass that tells.
        if promise <= tolerance * best.equations.cost {
            best.model = model;
            break;
        }
        let equations = normal_equations(&model);
        best.passes += 1;
        let (old, new) = (best.equations.cost, equations.cost);
        if new < old {
            best.model = model;
            best.equations = equations;
            damping *= lit(0.1);
            if old - new <= tolerance * old {
                break;
            }
        } else {
            if !(new - old > tolerance * old) {
                break;
            }
            damping *= lit(20.0);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::refine::blocks::PlaneBlock;
    use crate::refine::relative_pose::{PoseModel, Scales};
    use nalgebra::Vector3;

    fn model() -> PoseModel<f64> {
        PoseModel {
            rotation: crate::refine::relative_pose::cayley(&Vector3::new(0.1, -0.2, 0.05)),
            translation: Vector3::new(0.3, -0.5, 0.8).normalize(),
            scales: Scales { view1: [0.9, 1.1], view2: [1.05, 0.95], parallel_sq: 10.0, nearest_sq: 0.0 },
        }
    }

    fn blocks() -> [PlaneBlock<f64>; 3] {
        let mut blocks = [[[0.0; 4]; 4]; 3];
        for (i, x) in blocks.iter_mut().flatten().flatten().enumerate() {
            *x = ((i * i) as f64 * 0.7).sin();
        }
        blocks
    }

    #[test]
    fn sums_agree_with_central_differences() {
        let (model, blocks) = (model(), blocks());
        let data = BlockSlice { blocks: &blocks, count: 10 };
        for loss in [Loss::Squared, Loss::Cauchy(0.3), Loss::Truncated(2.0)] {
            let sums = normal_equations::<_, _, _, 5>(data, &model, &loss);
            for p in 0..5 {
                let h = 1e-6;
                let moved = |h: f64| {
                    let mut step = SVector::<f64, 5>::zeros();
                    step[p] = h;
                    normal_equations::<_, _, _, 5>(data, &model.retract(&step), &loss).cost
                };
                // The cost is the sum of the losses, its derivative twice J'Wr.
                let slope = (moved(h) - moved(-h)) / (4.0 * h);
                assert!((slope - sums.gradient[p]).abs() < 1e-7, "{p} {loss:?} {slope} {}", sums.gradient[p]);
            }
        }
    }
}
