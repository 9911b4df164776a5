//! Inliers of a fundamental matrix that are too near to be right, where that is measured off the plane that fits them best.

use nalgebra::{Matrix3, SVector, Vector3};

use super::hypothesis::EpipolarProblem;
use crate::Real;
use crate::estimate::chance::for_each_other;
use crate::estimate::near::last_range;
use crate::geometry::pose::skew;
use crate::linalg::vec3::{cross, dot};
use crate::linalg::{LANES, add_outer, damped_step};
use crate::real::{from_u32, lit, max};
use crate::refine::blocks::{EpipolarBlock, PlaneBlock};
use crate::refine::fundamental::FundamentalModel;
use crate::refine::lm::{EpipolarModel, Manifold, Row};

/// Passes that fit the plane: least squares first, then with Cauchy's weights.
const PLANE_PASSES: u32 = 5;
/// Squared relief of the farthest limit in mean squares of the inliers', and how many ranges there are, each but the last up
/// to twice the relief of the one before.
const FIRST_LIMIT: f64 = 1.0 / 16.0;
const RANGES: usize = 12;
/// Blocks that the plane is fitted to and whose accidents are counted, about so many and up to twice; partners of each.
const BLOCKS: usize = 64;
const OTHERS: usize = 6;
/// Accidents among those that agree, for each that mispaired ones let expect: the matrix was chosen for how many agree.
const SELECTED: f64 = 2.0;

/// How far correspondences lie off a plane, as inverse depths of one view.
///
/// By `x2 ~ [e2]x F x1 + s e2` each correspondence of a fundamental matrix has a number `s`, its inverse depth up to scale and
/// up to a plane `v' x1`; off a plane that fits most of them it is `s - v' x1`.
///
/// # References
/// R. Hartley, A. Zisserman, "Multiple View Geometry in Computer Vision", 2004, section 13.3 (plane and parallax).
#[derive(Clone, Copy, Debug)]
struct Side<T: Real> {
    /// The plane's homography `[e2]x F + e2 v'`.
    plane: Matrix3<T>,
    epipole2: Vector3<T>,
    /// The mean square of the inliers off the plane, as robust weights have it.
    square: T,
}

impl<T: Real> Side<T> {
    /// `s - v' x1` as a fraction: top and bottom.
    #[cfg_attr(not(small), inline(always))]
    fn fraction(&self, x1: &[T; 3], x2: &[T; 3]) -> (T, T) {
        let m = &self.plane.data.0;
        let row = |i: usize| m[0][i] * x1[0] + m[1][i] * x1[1] + m[2][i] * x1[2];
        let across = cross(x2, &self.epipole2.data.0[0]);
        (-dot(&cross(x2, &[row(0), row(1), row(2)]), &across), dot(&across, &across))
    }

    /// Its square in mean squares; none at the epipole, from where no depth is seen.
    #[cfg_attr(not(small), inline(always))]
    fn squared(&self, x1: &[T; 3], x2: &[T; 3]) -> T {
        let (top, bottom) = self.fraction(x1, x2);
        let bottom = bottom * bottom * self.square;
        if bottom >= T::MIN_POSITIVE { top * top / bottom } else { T::ZERO }
    }

    /// Off the plane that fits those of some pairs of points best that `inliers` gives.
    fn fitted(
        f: &Matrix3<T>,
        epipole2: &Vector3<T>,
        inliers: &impl Fn(&mut dyn FnMut(&[T; 3], &[T; 3])),
    ) -> Option<Self> {
        let mut side = Self { plane: skew(epipole2) * f, epipole2: *epipole2, square: T::ZERO };
        for pass in 0..PLANE_PASSES {
            let (mut hessian, mut gradient) = (Matrix3::zeros(), SVector::<T, 3>::zeros());
            let (mut weights, mut squares) = (T::ZERO, T::ZERO);
            inliers(&mut |x1, x2| {
                let (top, bottom) = side.fraction(x1, x2);
                if bottom >= T::EPSILON * T::EPSILON {
                    let s = top / bottom;
                    let weight = if pass == 0 { bottom } else { T::ONE / (s * s + side.square) };
                    weights += weight;
                    squares += weight * s * s;
                    let x1 = Vector3::from(*x1);
                    add_outer(&mut hessian, &x1, &x1, weight);
                    gradient -= x1 * (weight * s);
                }
            });
            let (step, _) = damped_step(&hessian, &gradient, T::ZERO)?;
            side.plane += epipole2 * step.transpose();
            let rest = squares + gradient.dot(&step);
            side.square = max(rest, squares * T::EPSILON) / weights;
        }
        (side.square > T::ZERO && side.square <= T::MAX).then_some(side)
    }
}

/// How far correspondences lie off a plane in the view in which it is more, as squares of inverse depths.
#[derive(Clone, Copy, Debug)]
pub(super) struct Relief<T: Real> {
    sides: [Side<T>; 2],
    /// The largest that takes part.
    limit: T,
}

impl<T: Real> Relief<T> {
    #[cfg_attr(not(small), inline(always))]
    fn squared<B: EpipolarBlock<T>>(&self, block: &B, lane: usize) -> T {
        let Some((x1, x2)) = block.directions(lane) else { return T::ZERO };
        let [a, b] = &self.sides;
        max(a.squared(&x1, &x2), b.squared(&x2, &x1))
    }

    /// Whether a lane lies no farther off the plane than the limit.
    #[cfg_attr(not(small), inline(always))]
    fn admits<B: EpipolarBlock<T>>(&self, block: &B, lane: usize) -> bool {
        self.squared(block, lane) <= self.limit
    }

    /// Of the inliers within `support` of a model those that are to stay; none where all are.
    pub(super) fn of(
        problem: &EpipolarProblem<'_, T>,
        model: &FundamentalModel<T>,
        support: T,
    ) -> Option<Self> {
        let data = problem.data;
        let full = data.blocks.get(..data.count / LANES).unwrap_or(data.blocks);
        let every = core::cmp::max(full.len() / BLOCKS, 1);
        let (frame, within) = (model.frame(), support * support);
        let inliers = |visit: &mut dyn FnMut(&[T; 3], &[T; 3])| {
            // At least one already, which the optimiser does not see through memory.
            for block in full.iter().step_by(core::cmp::max(every, 1)) {
                for l in 0..LANES {
                    if FundamentalModel::inside(&frame, block, l, within).is_some()
                        && let Some((x1, x2)) = block.directions(l)
                    {
                        visit(&x1, &x2);
                    }
                }
            }
        };
        let exchanged = |visit: &mut dyn FnMut(&[T; 3], &[T; 3])| inliers(&mut |x1, x2| visit(x2, x1));
        let side1 = Side::fitted(&model.matrix, &model.epipole2, &inliers)?;
        let side2 = Side::fitted(&model.matrix.transpose(), &model.epipole1, &exchanged)?;
        let mut relief = Self { sides: [side1, side2], limit: T::MAX };
        let count = |block: &PlaneBlock<T>, near: &mut [u32; RANGES]| {
            for l in 0..LANES {
                if FundamentalModel::inside(&frame, block, l, within).is_some() {
                    let squared = relief.squared(block, l);
                    let (mut range, mut limit) = (0, lit(FIRST_LIMIT));
                    while range < RANGES - 1 && squared > limit {
                        range += 1;
                        limit *= lit(4.0);
                    }
                    if let Some(count) = near.get_mut(range) {
                        *count += 1;
                    }
                }
            }
        };
        let (mut agreeing, mut accidents) = ([0u32; RANGES], [0u32; RANGES]);
        for block in full {
            count(block, &mut agreeing);
        }
        let seen = for_each_other(data, OTHERS, every, |block, other| {
            // Both ways, so that views exchanged give the same.
            count(&block.mispaired(other), &mut accidents);
            count(&other.mispaired(block), &mut accidents);
        });
        // As many accidents as wrong ones have: all but the inliers, and the accidents among those.
        let outside = ((full.len() * LANES) as u32).saturating_sub(agreeing.iter().sum());
        let apart = (2 * seen).saturating_sub(accidents.iter().sum());
        let share = from_u32::<T>(outside) * lit(SELECTED) / from_u32(core::cmp::max(apart, 1));
        let last = last_range(&agreeing, &accidents, share)?;
        relief.limit = (0..last).fold(lit(FIRST_LIMIT), |limit, _| limit * lit(4.0));
        Some(relief)
    }
}

/// A fundamental matrix in the refinement, which sees only what a relief admits.
#[derive(Clone, Copy, Debug)]
pub(super) struct Admitting<'a, T: Real> {
    pub(super) model: FundamentalModel<T>,
    pub(super) relief: Option<&'a Relief<T>>,
}

impl<T: Real> Manifold<T, 7> for Admitting<'_, T> {
    fn matrix(&self) -> Matrix3<T> {
        self.model.matrix
    }

    fn retract(&self, step: &SVector<T, 7>) -> Self {
        Self { model: self.model.retract(step), ..*self }
    }
}

impl<'a, T: Real> EpipolarModel<T, 7> for Admitting<'a, T> {
    type Frame = (<FundamentalModel<T> as EpipolarModel<T, 7>>::Frame, Option<&'a Relief<T>>);
    type Sight = ();

    fn frame(&self) -> Self::Frame {
        (self.model.frame(), self.relief)
    }

    #[inline(always)]
    fn sight<B: EpipolarBlock<T>>(_: &Self::Frame, _: &B, _: usize) {}

    #[inline(always)]
    fn inside<B: EpipolarBlock<T>>(
        (frame, relief): &Self::Frame,
        block: &B,
        l: usize,
        limit: T,
    ) -> Option<()> {
        FundamentalModel::inside(frame, block, l, limit)
            .filter(|_| relief.is_none_or(|relief| relief.admits(block, l)))
    }

    #[inline(always)]
    fn row<B: EpipolarBlock<T>>((frame, _): &Self::Frame, block: &B, l: usize, sight: &()) -> Row<T, 7> {
        FundamentalModel::row(frame, block, l, sight)
    }
}
