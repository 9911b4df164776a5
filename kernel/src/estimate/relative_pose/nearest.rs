//! How near a right correspondence may be: wrong ones that agree with a pose by accident seem to lie much nearer than the
//! scene, for along its epipolar line a wrong match may be anywhere. A residual of theirs moves a pose as hundreds of
//! others do, so the last refinement leaves out what is nearer than a limit, where that makes the pose more certain.

use super::hypothesis::PoseProblem;
use crate::Real;
use crate::linalg::LANES;
use crate::real::{from_u32, lit, max, sqrt};
use crate::refine::blocks::EpipolarBlock;
use crate::refine::lm::EpipolarModel;
use crate::refine::relative_pose::{PoseFrame, PoseModel};

/// Squared distance of the farthest limit, in baselines (64), and how many ranges of distance there are: beyond it, each half
/// as far as the one before, and what is nearer than all limits.
const FARTHEST_SQ: f64 = 4096.0;
const RANGES: usize = 10;
/// What an accident adds to the pose's variance over what a right correspondence as near does.
const HARM: f64 = 5.0;
/// Right ones count as far as they are more than accidents by so many standard deviations of these.
const DEVIATIONS: f64 = 2.0;
/// At most one in so many of those that agree is left out.
const LEFT_OUT: u32 = 4;
/// With how many others each correspondence is mispaired for every wrong one to one that agrees, since that often the count
/// of accidents is taken; and the least and the most.
const MISPAIRED: [u32; 3] = [5, 1, 12];

/// How many correspondences of each range agree with a pose, from far to near.
type Near = [u32; RANGES];

/// Adds those of a block that lie within the root of `limit` and in front of the cameras.
fn add<T: Real, B: EpipolarBlock<T>>(near: &mut Near, frame: &PoseFrame<T>, block: &B, limit: T) {
    for l in 0..LANES {
        let sight = block.sight(&frame.views, l);
        if sight.c * sight.c < limit * sight.d && frame.admits(&sight) {
            let [top, mut bottom] = sight.distance_sq();
            bottom *= lit(FARTHEST_SQ);
            let mut range = 0;
            while range < RANGES - 1 && top < bottom {
                bottom *= lit(0.25);
                range += 1;
            }
            if let Some(count) = near.get_mut(range) {
                *count += 1;
            }
        }
    }
}

impl<T: Real, B: EpipolarBlock<T>> PoseProblem<'_, T, B> {
    /// The squared distance from view 1, in baselines, from which on those within `support` of a pose take part; zero where
    /// all do. Of the limits the one that leaves the translation the least variance, where a correspondence tells of it as
    /// the inverse square of its distance. How many accidents there are is measured on correspondences with view 2 of
    /// another, times as many as do not agree.
    pub(super) fn nearest_sq(&self, model: &PoseModel<T>, support: T) -> T {
        let (frame, within) = (model.frame(), support * support);
        let (mut agreeing, mut accidents) = ([0; RANGES], [0; RANGES]);
        for block in self.whole_blocks() {
            add(&mut agreeing, &frame, block, within);
        }
        let all = agreeing.iter().sum::<u32>();
        let wrong = ((self.whole_blocks().len() * LANES) as u32).saturating_sub(all);
        let others = core::cmp::min(wrong * MISPAIRED[0] / core::cmp::max(all, 1), MISPAIRED[2]);
        let others = core::cmp::max(others, MISPAIRED[1]) as usize;
        let mispaired =
            self.for_each_mispaired(others, &mut |block| add(&mut accidents, &frame, block, within));
        let apart = mispaired.saturating_sub(accidents.iter().sum());
        let share = from_u32::<T>(wrong) / from_u32(core::cmp::max(apart, 1));
        let (mut nearest, mut least) = (T::ZERO, T::MAX);
        // Over the ranges from far to near: what the right ones tell, and how uncertain that is.
        let (mut information, mut uncertainty) = (T::ZERO, T::ZERO);
        let (mut limit, mut weight) = (lit::<T>(FARTHEST_SQ), T::ONE);
        let mut left_out = all;
        for (&here, &accidents) in agreeing.iter().zip(&accidents) {
            let expected = from_u32::<T>(accidents) * share;
            let right = max(from_u32::<T>(here) - expected, T::ZERO);
            information += max(right - sqrt(expected) * lit(DEVIATIONS), T::ZERO) * weight;
            uncertainty += (right + expected * lit(HARM)) * weight;
            left_out = left_out.saturating_sub(here);
            let variance = uncertainty / (information * information);
            if variance < least && left_out <= all / LEFT_OUT {
                (nearest, least) = (if left_out > 0 { limit } else { T::ZERO }, variance);
            }
            limit *= lit(0.25);
            weight *= lit(4.0);
        }
        nearest
    }
}
