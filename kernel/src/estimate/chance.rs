//! What chance explains: how many wrong correspondences agree with a model by accident.
//!
//! # References
//! L. Moisan, B. Stival, "A probabilistic criterion to detect rigid point matches between two images", IJCV 2004 (the
//! number of false alarms).

use crate::Real;
use crate::linalg::{LANES, Lanes};
use crate::real::{from_u32, lit, ln, max, min};
use crate::refine::blocks::{Block, BlockSlice, EpipolarBlock};
use crate::robust::log_binomial_tail;

/// Accidents expected at the most where something counts as proven.
pub(super) const ACCIDENTS: f64 = 0.01;
/// A correspondence is explained by a model up to this many standard deviations in two dimensions: of true ones 4 in a
/// million lie beyond.
pub(super) const EXPLAINED_SIGMAS: f64 = 5.0;

/// ln of the number of ways to choose `k` of `n`, for small `k`.
fn ln_choose<T: Real>(n: u32, k: u32) -> T {
    let mut sum = T::ZERO;
    for i in 0..core::cmp::min(k, 8) {
        if n > i {
            sum += ln(from_u32::<T>(n - i) / from_u32::<T>(i + 1));
        }
    }
    sum
}

/// True where `agreeing` of `count` correspondences agree with a model fitted to `freedom` of them more often than
/// wrong ones do by accident with probability `p` each.
#[cfg_attr(small, inline(never))]
pub(super) fn beyond_chance<T: Real>(count: u32, agreeing: u32, freedom: u32, p: T) -> bool {
    ln_accidents(count, agreeing, freedom, p) < ln(lit(ACCIDENTS))
}

/// How many of `count` must agree at the least to be [`beyond_chance`]; all, where none are.
pub(super) fn least_beyond_chance<T: Real>(count: u32, freedom: u32, p: T) -> u32 {
    let (mut low, mut high) = (0, count);
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if beyond_chance(count, middle, freedom, p) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

/// [`beyond_chance`] of the best of `tried` models.
pub(super) fn best_beyond_chance<T: Real>(tried: u32, count: u32, agreeing: u32, freedom: u32, p: T) -> bool {
    if agreeing <= freedom || count <= freedom {
        return false;
    }
    let models = min(ln_choose::<T>(count, freedom), ln(from_u32(core::cmp::max(tried, 1))));
    models + log_binomial_tail(count - freedom, agreeing - freedom, p) < ln(lit(ACCIDENTS))
}

/// ln of the expected number of accidents, of models fitted to `freedom` of `count` wrong correspondences, with which as
/// many as `agreeing` agree; 0 or more where that is nothing.
fn ln_accidents<T: Real>(count: u32, agreeing: u32, freedom: u32, p: T) -> T {
    if agreeing <= freedom || count <= freedom {
        return T::ZERO;
    }
    let tail = log_binomial_tail(count - freedom, agreeing - freedom, p);
    ln_choose::<T>(count, freedom) + tail
}

/// [`beyond_chance`] with independent evidence beside the count: a statistic that lies `deviations` standard deviations
/// above what chance makes of it; at most so many `accidents` expected.
pub(super) fn beyond_chance_with<T: Real>(
    count: u32,
    agreeing: u32,
    freedom: u32,
    p: T,
    deviations: T,
    accidents: T,
) -> bool {
    let by_count = min(ln_accidents(count, agreeing, freedom, p), T::ZERO);
    let z = max(deviations, T::ZERO);
    by_count - z * z * T::HALF < ln(accidents)
}

/// The chance of a wrong correspondence to lie within `threshold` of an epipolar line by the Sampson error: the area of
/// the band over that of the rectangle that the points of view 2 fill.
pub(super) fn line_accident<T: Real, B: EpipolarBlock<T>>(data: BlockSlice<'_, B>, threshold: T) -> T {
    band_accident(width(data), threshold)
}

/// [`line_accident`] where that rectangle's [`width`] is known.
pub(super) fn band_accident<T: Real>(width: T, threshold: T) -> T {
    // Sampson's error is the distance to the line over sqrt 2 where both lines are alike; the band has two sides.
    let band = lit::<T>(2.0 * core::f64::consts::SQRT_2) * threshold;
    if width > band { band / width } else { T::ONE }
}

/// The shorter side of the rectangle that the points of view 2 fill.
pub(super) fn width<T: Real, B: EpipolarBlock<T>>(data: BlockSlice<'_, B>) -> T {
    sides(data).0
}

/// The chance of a wrong correspondence to lie within `radius` of a transferred point: the area of the disc over that
/// of the rectangle that the points of view 2 fill.
pub(super) fn point_accident<T: Real, B: EpipolarBlock<T>>(data: BlockSlice<'_, B>, radius: T) -> T {
    let (a, b) = sides(data);
    let disc = lit::<T>(core::f64::consts::PI) * radius * radius;
    if a * b > disc { disc / (a * b) } else { T::ONE }
}

/// The share of wrong correspondences that a model explains by accident, measured on the correspondences themselves, each
/// with one half of so many `others` in place of its own; never below `least`. `squared` gives the squared errors of a block
/// that gets that half from another, in units of the squared threshold. So many accidents are added as `unseen`, where the
/// pairs are too few to do without.
pub(super) fn measured_accident<T: Real, B: Block<T>>(
    data: BlockSlice<'_, B>,
    least: T,
    others: usize,
    unseen: u32,
    squared: impl Fn(&B, &B) -> Lanes<T>,
) -> T {
    let mut hits = 0u32;
    let seen = for_each_other(data, others, 1, |block, other| {
        for s in squared(block, other) {
            hits += (s < T::ONE) as u32;
        }
    });
    let share = from_u32::<T>(hits + unseen) / from_u32(seen + unseen);
    if seen > 0 && share > least { share } else { least }
}

/// Calls `visit` with every `every`-th full block and with a block of other correspondences, so many `others` of each; how many
/// correspondences those were.
pub(super) fn for_each_other<T: Real, B: Block<T>>(
    data: BlockSlice<'_, B>,
    others: usize,
    every: usize,
    mut visit: impl FnMut(&B, &B),
) -> u32 {
    let full = data.blocks.get(..data.count / LANES).unwrap_or(data.blocks);
    let mut seen = 0u32;
    let turns = full.len() * LANES;
    let others = core::cmp::min(others, turns.saturating_sub(1));
    let every = core::cmp::max(every, 1);
    for k in 1..=others {
        // The list and the list turned by some blocks and lanes, which is never a whole turn.
        let turn = k * turns / (others + 1);
        let (start, end) = full.split_at_checked(turn / LANES).unwrap_or((full, &[]));
        for (block, other) in full.iter().zip(end.iter().chain(start)).step_by(every) {
            visit(block, &other.turned(turn));
            seen += LANES as u32;
        }
    }
    seen
}

/// The two longer sides of the box around the points or bearings of view 2, the shorter of them first.
fn sides<T: Real, B: EpipolarBlock<T>>(data: BlockSlice<'_, B>) -> (T, T) {
    let (mut low, mut high) = ([T::MAX; 3], [-T::MAX; 3]);
    let mut left = data.count;
    for block in data.blocks {
        for l in 0..core::cmp::min(left, LANES) {
            let Some((_, f2)) = block.directions(l) else { break };
            for k in 0..3 {
                if f2[k] > -T::MAX && f2[k] < T::MAX {
                    low[k] = min(low[k], f2[k]);
                    high[k] = max(high[k], f2[k]);
                }
            }
        }
        left = left.saturating_sub(LANES);
    }
    // A plane's third side is zero.
    let mut sides = [T::ZERO; 3];
    for k in 0..3 {
        sides[k] = max(high[k] - low[k], T::ZERO);
    }
    let longest = max(max(sides[0], sides[1]), sides[2]);
    let shortest = min(min(sides[0], sides[1]), sides[2]);
    let middle = sides[0] + sides[1] + sides[2] - longest - shortest;
    (middle, longest)
}
