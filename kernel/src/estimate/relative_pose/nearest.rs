//! How near a right correspondence may be: the last refinement leaves out what is nearer than a limit, where that makes the
//! pose more certain.

use super::hypothesis::PoseProblem;
use crate::Real;
use crate::estimate::near::last_range;
use crate::linalg::LANES;
use crate::real::{from_u32, lit};
use crate::refine::blocks::EpipolarBlock;
use crate::refine::lm::EpipolarModel;
use crate::refine::relative_pose::{PoseFrame, PoseModel};

/// Squared distance of the farthest limit, in baselines (64), and how many ranges of distance there are: beyond it, each half
/// as far as the one before, and what is nearer than all limits.
const FARTHEST_SQ: f64 = 4096.0;
const RANGES: usize = 10;
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
    /// all do. How many accidents there are is measured on correspondences with view 2 of another, times as many as do not
    /// agree.
    pub(super) fn nearest_sq(&self, model: &PoseModel<T>, support: T) -> T {
        let (frame, within) = (model.frame(), support * support);
        let (mut agreeing, mut accidents) = ([0; RANGES], [0; RANGES]);
        for block in self.whole_blocks() {
            add(&mut agreeing, &frame, block, within);
        }
        let all = agreeing.iter().sum::<u32>();
        let wrong = ((self.whole_blocks().len() * LANES) as u32).saturating_sub(all);
        let others =
            core::cmp::min(wrong.saturating_mul(MISPAIRED[0]) / core::cmp::max(all, 1), MISPAIRED[2]);
        let others = core::cmp::max(others, MISPAIRED[1]) as usize;
        let mispaired =
            self.for_each_mispaired(others, &mut |block| add(&mut accidents, &frame, block, within));
        let apart = mispaired.saturating_sub(accidents.iter().sum());
        let share = from_u32::<T>(wrong) / from_u32(core::cmp::max(apart, 1));
        let Some(last) = last_range(&agreeing, &accidents, share) else { return T::ZERO };
        (0..last).fold(lit(FARTHEST_SQ), |limit, _| limit * lit(0.25))
    }
}
