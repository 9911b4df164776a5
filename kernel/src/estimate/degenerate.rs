//! Configurations of image points from which no model follows: one line, too few distinct points.

use super::chance::{EXPLAINED_SIGMAS, beyond_chance};
use crate::Real;
use crate::linalg::LANES;
use crate::real::lit;
use crate::refine::blocks::{BlockSlice, EpipolarBlock};
use crate::robust::Sampler;

/// Lines tried, each through two inliers.
const LINES: u32 = 24;
/// Distinct points looked for at the most.
const DISTINCT: usize = 12;
/// Points of repetitions lie within this many standard deviations of each other.
const REPEATED_SIGMAS: f64 = 8.0;

/// Points of both views on the plane: x1, y1, x2, y2.
type Point<T> = [T; 4];

fn point<T: Real, B: EpipolarBlock<T>>(data: BlockSlice<'_, B>, index: u32) -> Option<Point<T>> {
    let (plane, _) = data.blocks.get(index as usize / LANES)?.planes();
    let lane = index as usize % LANES;
    let at = |k: usize| plane[k].get(lane).copied();
    Some([at(0)?, at(1)?, at(2)?, at(3)?])
}

/// Squared distance of a point from the line through two, in the two coordinates from `k` on, in units of `scale`.
fn line_distance_sq<T: Real>(p: &Point<T>, a: &Point<T>, b: &Point<T>, k: usize, scale: T) -> T {
    let (dx, dy) = (b[k] - a[k], b[k + 1] - a[k + 1]);
    let c = (p[k] - a[k]) * dy - (p[k + 1] - a[k + 1]) * dx;
    c * c * scale / (dx * dx + dy * dy)
}

/// True where the inliers lie on one line in both views but for as few as chance explains.
pub(super) fn on_a_line<T: Real, B: EpipolarBlock<T>>(
    data: BlockSlice<'_, B>,
    inliers: &[u32],
    sigma: T,
    accident: T,
) -> bool {
    let total = inliers.len() as u32;
    let scale = T::ONE / (sigma * sigma);
    let limit: T = lit(EXPLAINED_SIGMAS * EXPLAINED_SIGMAS);
    let outside = (data.count as u32).saturating_sub(total);
    let mut sampler = Sampler::<T>::uniform(0, total);
    for k in 0..LINES {
        let Some([i, j]) = sampler.sample::<2>(k) else { return false };
        let end = |i: u32| inliers.get(i as usize).and_then(|&i| point(data, i));
        let (Some(a), Some(b)) = (end(i), end(j)) else { continue };
        let mut off = 0;
        let mut proven = false;
        for &index in inliers {
            let Some(p) = point(data, index) else { continue };
            let on = line_distance_sq(&p, &a, &b, 0, scale) < limit
                && line_distance_sq(&p, &a, &b, 2, scale) < limit;
            off += !on as u32;
            // Looked at now and then, so that an ordinary scene is soon done.
            if off % 8 == 7 && !on && beyond_chance(outside + off, off, 2, accident) {
                proven = true;
                break;
            }
        }
        if !proven && !beyond_chance(outside + off, off, 2, accident) {
            return true;
        }
    }
    false
}

/// True where the inliers are repetitions of fewer than `needed` distinct points but for as few as chance explains.
pub(super) fn few_distinct<T: Real, B: EpipolarBlock<T>>(
    data: BlockSlice<'_, B>,
    inliers: impl Iterator<Item = u32>,
    needed: u32,
    sigma: T,
    accident: T,
) -> bool {
    let radius = sigma * lit(REPEATED_SIGMAS);
    let mut centres = [[T::ZERO; 4]; DISTINCT];
    let mut sizes = [0u32; DISTINCT];
    let mut used = 0usize;
    let mut total = 0u32;
    for index in inliers {
        let Some(p) = point(data, index) else { continue };
        total += 1;
        let near = |c: &Point<T>| p.iter().zip(c).all(|(a, b)| crate::real::abs(*a - *b) < radius);
        let mut known = false;
        for (centre, size) in centres.iter().zip(&mut sizes).take(used) {
            if near(centre) {
                *size += 1;
                known = true;
                break;
            }
        }
        if !known {
            let (Some(centre), Some(size)) = (centres.get_mut(used), sizes.get_mut(used)) else {
                return false;
            };
            *centre = p;
            *size = 1;
            used += 1;
        }
    }
    // Given the most repeated points, each of which takes the place of one of a minimal sample: do the rest agree more
    // often than chance?
    let mut rest = total;
    for taken in 1..core::cmp::min(needed, 8) {
        let (mut largest, mut place) = (0, None);
        for size in &mut sizes {
            if *size > largest {
                largest = *size;
                place = Some(size);
            }
        }
        if let Some(size) = place {
            *size = 0;
        }
        rest = rest.saturating_sub(largest);
        let wrong = (data.count as u32).saturating_sub(total);
        if !beyond_chance(rest + wrong, rest, needed - taken, accident) && largest > 1 {
            return true;
        }
    }
    total > 0 && used < needed as usize
}
