//! How near a right correspondence may be: wrong ones that agree with a pose by accident seem to lie much nearer than the
//! scene, for along its epipolar line a wrong match may be anywhere. A residual of theirs moves a pose as hundreds of
//! others do, so the last refinement leaves out what is nearer than a limit below which accidents are too many.

use super::hypothesis::PoseProblem;
use crate::Real;
use crate::linalg::LANES;
use crate::real::{from_u32, lit};
use crate::refine::blocks::EpipolarBlock;
use crate::refine::lm::EpipolarModel;
use crate::refine::relative_pose::{PoseFrame, PoseModel};

/// Squared distance of the farthest limit, in baselines (64), and how many there are, each half as far as the one before.
const FARTHEST_SQ: f64 = 4096.0;
const LIMITS: usize = 9;
/// What a right correspondence is worth against an accident: less than one, for it moves the pose by its noise, an accident
/// by as much as the whole threshold.
const WORTH: f64 = 0.2;
/// At most one in so many of those that agree is left out.
const LEFT_OUT: u32 = 4;
/// With how many others each correspondence is mispaired for every wrong one to one that agrees, since that often the count
/// of accidents is taken; and the least and the most.
const MISPAIRED: [u32; 3] = [5, 1, 12];

/// Correspondences that agree with a pose: all, and those nearer than each limit.
#[derive(Default)]
struct Near {
    all: u32,
    nearer: [u32; LIMITS],
}

impl Near {
    /// Adds those of a block that lie within the root of `limit` and in front of the cameras.
    fn add<T: Real, B: EpipolarBlock<T>>(&mut self, frame: &PoseFrame<T>, block: &B, limit: T) {
        for l in 0..LANES {
            let sight = block.sight(&frame.views, l);
            if sight.c * sight.c < limit * sight.d && sight.in_front(frame.parallel_sq) {
                self.all += 1;
                let [top, mut bottom] = sight.distance_sq();
                bottom *= lit(FARTHEST_SQ);
                for nearer in &mut self.nearer {
                    if top >= bottom {
                        break;
                    }
                    *nearer += 1;
                    bottom *= lit(0.25);
                }
            }
        }
    }
}

impl<T: Real, B: EpipolarBlock<T>> PoseProblem<'_, T, B> {
    /// The squared distance from view 1, in baselines, from which on those within `support` of a pose take part; zero where
    /// all do. Of the limits the one that leaves out the most accidents, less a share of the right ones; how many accidents
    /// there are is measured on correspondences with view 2 of another, times as many as do not agree.
    pub(super) fn nearest_sq(&self, model: &PoseModel<T>, support: T) -> T {
        let (frame, limit) = (model.frame(), support * support);
        let (mut agreeing, mut accidents) = (Near::default(), Near::default());
        for block in self.whole_blocks() {
            agreeing.add(&frame, block, limit);
        }
        let wrong = ((self.whole_blocks().len() * LANES) as u32).saturating_sub(agreeing.all);
        let others = core::cmp::min(wrong * MISPAIRED[0] / core::cmp::max(agreeing.all, 1), MISPAIRED[2]);
        let others = core::cmp::max(others, MISPAIRED[1]) as usize;
        let mispaired = self.for_each_mispaired(others, &mut |block| accidents.add(&frame, block, limit));
        let share =
            from_u32::<T>(wrong) / from_u32(core::cmp::max(mispaired.saturating_sub(accidents.all), 1));
        let (mut nearest, mut most) = (T::ZERO, T::ZERO);
        let mut at = lit(FARTHEST_SQ);
        for (&near, &accidents) in agreeing.nearer.iter().zip(&accidents.nearer) {
            let expected = from_u32::<T>(accidents) * share;
            let gain = expected - (from_u32::<T>(near) - expected) * lit(WORTH);
            if gain > most && near <= agreeing.all / LEFT_OUT {
                (nearest, most) = (at, gain);
            }
            at *= lit(0.25);
        }
        nearest
    }
}
