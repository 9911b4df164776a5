//! Up to which inverse depth correspondences may move a model that two views fix: wrong ones that agree with it by accident
//! seem to lie much nearer than the scene, for along its epipolar line a wrong match may be anywhere, and a residual of
//! theirs moves the model as hundreds of others do.

use crate::Real;
use crate::real::{from_u32, lit, max, sqrt};

/// What an accident adds to the variance over what a right correspondence as near does.
const HARM: f64 = 5.0;
/// Right ones count as far as they are more than accidents by so many standard deviations of these.
const DEVIATIONS: f64 = 2.0;
/// At most one in so many of those that agree is left out.
const LEFT_OUT: u32 = 4;

/// Of ranges from far to near, each to twice the inverse depth of the one before, the last that takes part; none where all
/// do. `agreeing` correspondences of each range, among them `share` times as many accidents as given. It is the range
/// after which the translation has the least variance, where a correspondence tells of it as the square of its inverse
/// depth.
pub(super) fn last_range<T: Real>(agreeing: &[u32], accidents: &[u32], share: T) -> Option<usize> {
    let all = agreeing.iter().sum::<u32>();
    let (mut last, mut least) = (None, T::MAX);
    // Over the ranges so far: what the right ones tell, and how uncertain that is.
    let (mut information, mut uncertainty) = (T::ZERO, T::ZERO);
    let mut weight = T::ONE;
    let mut left_out = all;
    for (range, (&here, &accidents)) in agreeing.iter().zip(accidents).enumerate() {
        let expected = from_u32::<T>(accidents) * share;
        let right = max(from_u32::<T>(here) - expected, T::ZERO);
        information += max(right - sqrt(expected) * lit(DEVIATIONS), T::ZERO) * weight;
        uncertainty += (right + expected * lit(HARM)) * weight;
        left_out = left_out.saturating_sub(here);
        let variance = uncertainty / (information * information);
        if variance < least && left_out <= all / LEFT_OUT {
            (last, least) = ((left_out > 0).then_some(range), variance);
        }
        weight *= lit(4.0);
    }
    last
}
