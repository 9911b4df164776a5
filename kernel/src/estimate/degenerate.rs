//! Configurations of image points from which no model follows: one line, too few distinct points.

use nalgebra::Vector3;

use super::chance::{EXPLAINED_SIGMAS, beyond_chance, line_accident};
use super::stride;
use crate::Real;
use crate::linalg::LANES;
use crate::linalg::vec3::apart_sq;
use crate::real::{abs, lit, min, sqrt};
use crate::refine::blocks::{BlockSlice, EpipolarBlock};
use crate::robust::Sampler;

/// Lines tried, each through two inliers.
const LINES: u32 = 24;
/// Where hardly a point may lie off a line, so many more than half of those looked at end the look.
const FEW_OFF: u32 = 3;
/// Distinct points looked for at the most.
const DISTINCT: usize = 12;
/// Points of repetitions lie within this many standard deviations of each other.
const REPEATED_SIGMAS: f64 = 8.0;

/// Points of both views on the plane: x1, y1, x2, y2.
type Point<T> = [T; 4];

/// True where two of a sample's points are closer than `distance` in a view: then they say the same thing twice, or
/// one of them is wrong.
pub(super) fn repeated<T: Real, const S: usize>(points: &[Vector3<T>; S], distance: T) -> bool {
    let limit = distance * distance;
    for i in 1..S {
        for j in 0..i {
            // Written so that a NaN counts as repeated.
            if !(apart_sq(&points[i].data.0[0], &points[j].data.0[0]) > limit) {
                return true;
            }
        }
    }
    false
}

#[cfg_attr(small, inline(never))]
fn point<T: Real, B: EpipolarBlock<T>>(data: BlockSlice<'_, B>, index: u32) -> Option<Point<T>> {
    let (point, _) = data.blocks.get(index as usize / LANES)?.on_planes(index as usize % LANES)?;
    Some(point)
}

/// A line of each view: a point, and the unit normal.
type Line<T> = [[T; 4]; 2];

/// True where a point's squared distances from a line of each view are below a limit.
#[cfg_attr(small, inline(never))]
fn lies_on<T: Real>(p: &Point<T>, [c, n]: &Line<T>, limit: T) -> bool {
    let d1 = (p[0] - c[0]) * n[0] + (p[1] - c[1]) * n[1];
    let d2 = (p[2] - c[2]) * n[2] + (p[3] - c[3]) * n[3];
    d1 * d1 < limit && d2 * d2 < limit
}

/// The lines through two points.
fn through<T: Real>(a: &Point<T>, b: &Point<T>) -> Line<T> {
    let normal = |k: usize| {
        let (x, y) = (b[k] - a[k], b[k + 1] - a[k + 1]);
        let scale = T::ONE / sqrt(x * x + y * y);
        (-y * scale, x * scale)
    };
    let ((a1, b1), (a2, b2)) = (normal(0), normal(2));
    [*a, [a1, b1, a2, b2]]
}

/// The lines of least squares through the points that lie within `limit` of `line`.
fn fit<T: Real, B: EpipolarBlock<T>>(
    data: BlockSlice<'_, B>,
    inliers: &[u32],
    line: &Line<T>,
    limit: T,
) -> Line<T> {
    let mut result = *line;
    // One view after the other, which is half the code of both together.
    for view in 0..2 {
        let (x, y) = (2 * view, 2 * view + 1);
        // Moments about the first point.
        let mut first = None;
        let (mut n, mut sx, mut sy) = (T::ZERO, T::ZERO, T::ZERO);
        let (mut xx, mut yy, mut xy) = (T::ZERO, T::ZERO, T::ZERO);
        for p in inliers.iter().filter_map(|&i| point(data, i)).filter(|p| lies_on(p, line, limit)) {
            let [p, q] = [p[x], p[y]];
            let first: &[T; 2] = first.get_or_insert([p, q]);
            let (dx, dy) = (p - first[0], q - first[1]);
            n += T::ONE;
            sx += dx;
            sy += dy;
            xx += dx * dx;
            yy += dy * dy;
            xy += dx * dy;
        }
        let Some(first) = first else { break };
        let (mx, my) = (sx / n, sy / n);
        let (xx, yy, xy) = (xx / n - mx * mx, yy / n - my * my, xy / n - mx * my);
        // The direction of the larger moment, from the half angle: (xx - yy + r, 2 xy) or (2 xy, yy - xx + r).
        let r = sqrt((xx - yy) * (xx - yy) + lit::<T>(4.0) * xy * xy);
        let (dx, dy) = if xx > yy { (xx - yy + r, T::TWO * xy) } else { (T::TWO * xy, yy - xx + r) };
        let length = sqrt(dx * dx + dy * dy);
        if length > T::ZERO {
            result[0][x] = first[0] + mx;
            result[0][y] = first[1] + my;
            result[1][x] = -dy / length;
            result[1][y] = dx / length;
        }
    }
    result
}

/// True where the inliers lie on one line in both views but for as few as chance explains.
#[cfg_attr(small, inline(never))]
pub(super) fn on_a_line<T: Real, B: EpipolarBlock<T>>(
    data: BlockSlice<'_, B>,
    inliers: &[u32],
    sigma: T,
    accident: &dyn Fn() -> T,
) -> bool {
    let outside = (data.count as u32).saturating_sub(inliers.len() as u32);
    line_with(data, inliers, sigma, FEW_OFF, &|off| !beyond_chance(outside + off, off, 2, accident()))
}

/// True where at least half of all correspondences, and more than chance explains, lie on one line in both views,
/// although no model may agree with them.
pub(super) fn mostly_on_a_line<T: Real, B: EpipolarBlock<T>>(
    data: BlockSlice<'_, B>,
    all: &[u32],
    sigma: T,
) -> bool {
    let band = line_accident(data, sigma * lit(EXPLAINED_SIGMAS));
    let count = all.len() as u32;
    line_with(data, all, sigma, count, &|off| 2 * off <= count && beyond_chance(count, count - off, 2, band))
}

/// True where an acceptable number of the inliers lie off some line of least squares. A line through two of them is left as
/// soon as `patience` more than half of those looked at lie off it.
fn line_with<T: Real, B: EpipolarBlock<T>>(
    data: BlockSlice<'_, B>,
    inliers: &[u32],
    sigma: T,
    patience: u32,
    acceptable: &dyn Fn(u32) -> bool,
) -> bool {
    let total = inliers.len() as u32;
    let limit = sigma * sigma * lit(EXPLAINED_SIGMAS * EXPLAINED_SIGMAS);
    let step = stride(inliers.len());
    let mut sampler = Sampler::<T>::uniform(0, total);
    for k in 0..LINES {
        let Some([i, j]) = sampler.sample::<2>(k) else { return false };
        let end = |i: u32| inliers.get(i as usize).and_then(|&i| point(data, i));
        let (Some(a), Some(b)) = (end(i), end(j)) else { continue };
        let first = through(&a, &b);
        if off_line(data, inliers, step, &first, limit * lit(9.0), patience) > total / 2 {
            continue;
        }
        // Two noisy points give a coarse line; all near it give a good one.
        let coarse = fit(data, inliers, &first, limit * lit(9.0));
        let line = fit(data, inliers, &coarse, limit);
        if acceptable(off_line(data, inliers, step, &line, limit, total)) {
            return true;
        }
    }
    false
}

/// How many inliers do not lie on the line in both views; all where `patience` more than half of those looked at do not, so
/// that an ordinary scene is soon done. Looks at every `step`-th in turns, so that those off the line may come first in the
/// input.
fn off_line<T: Real, B: EpipolarBlock<T>>(
    data: BlockSlice<'_, B>,
    inliers: &[u32],
    step: usize,
    line: &Line<T>,
    limit: T,
    patience: u32,
) -> u32 {
    let mut off = 0;
    let mut at = 0usize;
    for seen in 0..inliers.len() as u32 {
        let point = inliers.get(at).and_then(|&index| point(data, index));
        let on = point.is_some_and(|p| lies_on(&p, line, limit));
        off += !on as u32;
        at += step;
        if at >= inliers.len() {
            at -= inliers.len();
        }
        if off > patience && off - patience > seen / 2 {
            return inliers.len() as u32;
        }
    }
    off
}

/// True where the inliers are repetitions of too few distinct points for one model, but for as few as chance explains: of
/// four for a homography, of one more than a `minimal` sample, which has several solutions, for the others. One function for
/// all lists.
#[cfg_attr(small, inline(never))]
pub(super) fn few_distinct<T: Real, B: EpipolarBlock<T>>(
    data: BlockSlice<'_, B>,
    inliers: &mut dyn Iterator<Item = u32>,
    minimal: u32,
    sigma: T,
    accident: &dyn Fn() -> T,
) -> bool {
    let radius = sigma * lit(REPEATED_SIGMAS);
    let needed = if minimal > 4 { minimal + 1 } else { minimal };
    let mut centres = [[T::ZERO; 4]; DISTINCT];
    let mut sizes = [0u32; DISTINCT];
    let mut used = 0usize;
    let mut more = 0u32;
    let mut total = 0u32;
    for index in inliers {
        let Some(p) = point(data, index) else { continue };
        total += 1;
        let near = |c: &Point<T>| p.iter().zip(c).all(|(a, b)| abs(*a - *b) < radius);
        let mut known = false;
        for (centre, size) in centres.iter().zip(&mut sizes).take(used) {
            if near(centre) {
                *size += 1;
                known = true;
                break;
            }
        }
        if known {
            continue;
        }
        match (centres.get_mut(used), sizes.get_mut(used)) {
            (Some(centre), Some(size)) => {
                *centre = p;
                *size = 1;
                used += 1;
            }
            // Points beyond the list's end count as not repeated: with more than one in ten a pose is settled (below).
            _ => {
                more += 1;
                if minimal == 5 && more > data.count as u32 / 10 {
                    return false;
                }
            }
        }
    }
    let many = more > 0;
    // The largest first.
    for i in 1..DISTINCT {
        for j in 0..i {
            if sizes[i] > sizes[j] {
                sizes.swap(i, j);
            }
        }
    }
    let held = |points: u32| -> u32 { sizes.iter().take(points as usize).filter(|&&size| size > 1).sum() };
    // A model through repeated points can be bent to meet some accidents: nine in ten are too many.
    let most = total - total / 10;
    if total > 0 && held(minimal - 1) >= most {
        return true;
    }
    // One more fixes the model but for its several solutions: the rest must tell the right one.
    let wrong = (data.count as u32).saturating_sub(total);
    let held = held(needed - 1);
    let rest = total - held;
    if needed > minimal && held >= most && !beyond_chance(rest + wrong, rest, 0, accident()) {
        return true;
    }
    // Many distinct points, most of them repeated: a homography or a fundamental matrix can be bent to the others; a pose
    // of five points, which they must see in front of both cameras, cannot.
    if many && (minimal == 5 || 3 * held < 2 * total) {
        return false;
    }
    // Given the most repeated points, each of which takes the place of one of a minimal sample: do the rest agree more
    // often than chance?
    let mut rest = total;
    for (taken, &largest) in (1..core::cmp::min(minimal, 8)).zip(&sizes) {
        rest = rest.saturating_sub(largest);
        let repeated = largest > 1 && 2 * rest <= total;
        if repeated && !beyond_chance(rest + wrong, rest, minimal - taken, accident()) {
            return true;
        }
    }
    total > 0 && used < needed as usize
}

/// True where repetitions of fewer than `needed` distinct points hold at least half of all correspondences, and more than
/// chance explains, although no model may agree with them.
pub(super) fn few_repeated<T: Real, B: EpipolarBlock<T>>(
    data: BlockSlice<'_, B>,
    needed: u32,
    sigma: T,
    accident: T,
) -> bool {
    let count = data.count as u32;
    let radius = sigma * lit(REPEATED_SIGMAS);
    let near = |p: &Point<T>, c: &Point<T>| p.iter().zip(c).all(|(a, b)| abs(*a - *b) < radius);
    let mut centres: [Option<Point<T>>; DISTINCT] = [None; DISTINCT];
    // The sizes of the largest repetitions, falling.
    let mut sizes = [0u32; DISTINCT];
    let mut sampler = Sampler::<T>::uniform(0, count);
    for k in 0..DISTINCT as u32 {
        let Some(centre) = sampler.sample::<1>(k).and_then(|[index]| point(data, index)) else { continue };
        if centres.iter().flatten().any(|other| near(&centre, other)) {
            continue;
        }
        if let Some(place) = centres.iter_mut().find(|place| place.is_none()) {
            *place = Some(centre);
        }
        let mut size = (0..count).filter_map(|i| point(data, i)).map(|p| near(&p, &centre) as u32).sum();
        for largest in &mut sizes {
            if size > *largest {
                core::mem::swap(largest, &mut size);
            }
        }
    }
    let held = sizes.iter().take(needed as usize - 1).filter(|&&size| size > 1).sum();
    // The band or disc of an accident has a radius of a few standard deviations, a repetition of some more.
    2 * held >= count && beyond_chance(count, held, needed, min(accident * lit(12.0), T::ONE))
}

/// Writes the indices of the set entries of a mask, in order.
pub(super) fn list<'a>(mask: &[bool], order: &'a mut [u32]) -> &'a [u32] {
    let mut length = 0;
    let inliers = (0u32..).zip(mask).filter(|(_, inlier)| **inlier);
    for (entry, (index, _)) in order.iter_mut().zip(inliers) {
        *entry = index;
        length += 1;
    }
    order.get(..length).unwrap_or(&[])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::refine::blocks::PlaneBlock;

    #[test]
    fn a_line_is_found_whatever_comes_first() {
        // Thirty points off the line, no more than chance explains, and two hundred on it.
        let mut blocks: [PlaneBlock<f32>; 58] = [[[0.0; LANES]; 4]; 58];
        let order: [u32; 230] = core::array::from_fn(|i| i as u32);
        for i in 0..230 {
            let x = (i as f32 * 0.7).sin() * 300.0;
            let off = if i < 30 { 80.0 + (i as f32 * 1.9).cos() * 60.0 } else { 0.0 };
            for (k, value) in [x, 0.3 * x + off, x + 5.0, 0.3 * x - off].into_iter().enumerate() {
                blocks[i / LANES][k][i % LANES] = value;
            }
        }
        let data = BlockSlice { blocks: &blocks, count: 2000 };
        assert!(on_a_line(data, &order, 1.0, &|| 0.05));
        let backwards = order.map(|i| 229 - i);
        assert!(on_a_line(data, &backwards, 1.0, &|| 0.05));
        assert!(!on_a_line(data, &order, 1.0, &|| 1e-4));
    }
}
