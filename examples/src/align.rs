//! Sub-pixel alignment of matched patches: the affine motion and the change of brightness that carry the patch of
//! image 1 onto image 2, by Gauss-Newton (Lucas and Kanade, IJCAI 1981; inverse compositional: Baker and Matthews,
//! IJCV 2004).

use epipole::nalgebra::{Matrix2, Matrix6, Vector2, Vector6};

use crate::features::Features;
use crate::matching::Match;
use crate::pyramid::{Level, sample};

/// Half the side of the aligned patch, in pixels of the keypoint's level.
const RADIUS: i32 = 7;
const SIDE: usize = 2 * RADIUS as usize + 1;
const MAX_ITERATIONS: usize = 12;
/// The alignment ends when the patch's centre moves less, in pixels of the level.
const STEP_PX: f32 = 0.005;
/// A centre that leaves the keypoint further, in pixels of the level, has slipped to another structure.
const MAX_SHIFT_PX: f32 = 3.0;
/// Least correlation of the aligned patches.
const MIN_CORRELATION: f32 = 0.8;

/// Moves `x2` of every match to where the patch around `x1` is found in image 2. A match whose patches do not align
/// keeps the keypoint's position.
pub fn refine_matches(a: &Features, b: &Features, matches: &mut [Match]) {
    let half = matches.len().div_ceil(2).max(1);
    std::thread::scope(|scope| {
        for chunk in matches.chunks_mut(half) {
            scope.spawn(move || {
                for m in chunk {
                    let (p, q) = (a.keypoints[m.index1], b.keypoints[m.index2]);
                    let (from, to) = (&a.levels[p.level], &b.levels[q.level]);
                    let [px, py] = from.from_full(p.x, p.y);
                    let [qx, qy] = to.from_full(q.x, q.y);
                    let start = Patch { centre: Vector2::new(px, py), angle: p.angle };
                    let guess = Patch { centre: Vector2::new(qx, qy), angle: q.angle };
                    if let Some(found) = align(from, start, to, guess) {
                        let [x, y] = to.to_full(found.x, found.y);
                        m.x2 = [f64::from(x), f64::from(y)];
                    }
                }
            });
        }
    });
}

/// Where a patch lies in its level, and how it is turned.
#[derive(Clone, Copy)]
struct Patch {
    centre: Vector2<f32>,
    angle: f32,
}

/// Values over the patch, with the weight of each pixel.
type Window = [[f32; SIDE]; SIDE];

/// The pixel of `to` that corresponds to the centre of the patch in `from`, or nothing where the patches differ.
fn align(from: &Level, patch: Patch, to: &Level, guess: Patch) -> Option<Vector2<f32>> {
    let weights = weights();
    let at = |du: f32, dv: f32| sample(&from.image, patch.centre.x + du, patch.centre.y + dv);
    let template = window(at);
    let (template, _) = normalise(&template, &weights)?;
    let scale = normalise(&window(at), &weights)?.1;

    // Steepest descent of the normalised template; the means are taken out because brightness is free.
    let mut columns = [[[0.0f32; SIDE]; SIDE]; 6];
    for_each(|i, j, u, v| {
        let gx = (at(u + 0.5, v) - at(u - 0.5, v)) / scale;
        let gy = (at(u, v + 0.5) - at(u, v - 0.5)) / scale;
        for (column, value) in columns.iter_mut().zip([gx, gy, gx * u, gx * v, gy * u, gy * v]) {
            column[j][i] = value;
        }
    });
    for column in &mut columns {
        let mean = weighted_sum(&weights, |i, j| column[j][i]);
        column.iter_mut().flatten().for_each(|c| *c -= mean);
    }
    let hessian = Matrix6::from_fn(|r, c| weighted_sum(&weights, |i, j| columns[r][j][i] * columns[c][j][i]));
    let factor = hessian.cholesky()?;

    let (sin, cos) = (guess.angle - patch.angle).sin_cos();
    let mut warp = Matrix2::new(cos, -sin, sin, cos);
    let mut centre = guess.centre;
    for _ in 0..MAX_ITERATIONS {
        let current = window(|u, v| {
            let p = centre + warp * Vector2::new(u, v);
            sample(&to.image, p.x, p.y)
        });
        let (current, _) = normalise(&current, &weights)?;
        let gradient = Vector6::from_fn(|r, _| {
            weighted_sum(&weights, |i, j| columns[r][j][i] * (current[j][i] - template[j][i]))
        });
        let step = factor.solve(&gradient);
        let inverse = Matrix2::new(1.0 + step[2], step[3], step[4], 1.0 + step[5]).try_inverse()?;
        let moved = warp * inverse * Vector2::new(step[0], step[1]);
        warp *= inverse;
        centre -= moved;
        let shift = (centre - guess.centre).norm();
        if !(shift <= MAX_SHIFT_PX) {
            return None;
        }
        if moved.norm() < STEP_PX {
            let correlation = weighted_sum(&weights, |i, j| current[j][i] * template[j][i]);
            return (correlation >= MIN_CORRELATION).then_some(centre);
        }
    }
    None
}

fn for_each(mut f: impl FnMut(usize, usize, f32, f32)) {
    for j in 0..SIDE {
        for i in 0..SIDE {
            f(i, j, i as f32 - RADIUS as f32, j as f32 - RADIUS as f32);
        }
    }
}

fn window(mut value: impl FnMut(f32, f32) -> f32) -> Window {
    let mut out = [[0.0; SIDE]; SIDE];
    for_each(|i, j, u, v| out[j][i] = value(u, v));
    out
}

/// A Gaussian window whose sum is 1.
fn weights() -> Window {
    let sigma_sq = (RADIUS as f32 * 0.6).powi(2);
    let mut w = window(|u, v| (-(u * u + v * v) / (2.0 * sigma_sq)).exp());
    let total: f32 = w.iter().flatten().sum();
    w.iter_mut().flatten().for_each(|x| *x /= total);
    w
}

fn weighted_sum(weights: &Window, mut value: impl FnMut(usize, usize) -> f32) -> f32 {
    let mut sum = 0.0;
    for_each(|i, j, _, _| sum += weights[j][i] * value(i, j));
    sum
}

/// The window with mean 0 and deviation 1, and its deviation; nothing for a window without contrast.
fn normalise(window: &Window, weights: &Window) -> Option<(Window, f32)> {
    let mean = weighted_sum(weights, |i, j| window[j][i]);
    let variance = weighted_sum(weights, |i, j| (window[j][i] - mean).powi(2));
    let deviation = variance.sqrt();
    if deviation < 0.5 {
        return None;
    }
    let mut out = *window;
    out.iter_mut().flatten().for_each(|x| *x = (*x - mean) / deviation);
    Some((out, deviation))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::fractal;
    use crate::pyramid::pyramid;
    use image::{GrayImage, Luma};

    /// A smooth texture of which `motion` takes a point of the first image to the second.
    fn image(motion: impl Fn(f32, f32) -> (f32, f32), gain: f32) -> Level {
        let value = |x: u32, y: u32| {
            let (u, v) = motion(x as f32, y as f32);
            40.0 + gain * 200.0 * fractal(u / 6.0, v / 6.0, 3, 1)
        };
        let image = GrayImage::from_fn(64, 64, |x, y| Luma([value(x, y) as u8]));
        pyramid(&image, 1, 1.2, 16).remove(0)
    }

    #[test]
    fn recovers_shift_turn_and_brightness() {
        let from = image(|x, y| (x, y), 1.0);
        let (centre, angle) = (Vector2::new(31.0, 33.0), 0.3f32);
        let truth = Vector2::new(32.4, 31.7);
        let (sin, cos) = angle.sin_cos();
        let to = image(
            |x, y| {
                let (dx, dy) = (x - truth.x, y - truth.y);
                (centre.x + cos * dx + sin * dy, centre.y - sin * dx + cos * dy)
            },
            0.8,
        );
        // The keypoint is a pixel off and its angle 6 degrees.
        let start = Patch { centre, angle: 0.0 };
        let guess = Patch { centre: truth + Vector2::new(0.8, -0.6), angle: angle + 0.1 };
        let found = align(&from, start, &to, guess).unwrap();
        assert!((found - truth).norm() < 0.05, "{found}");
    }

    #[test]
    fn refuses_another_patch_and_a_flat_one() {
        let from = image(|x, y| (x, y), 1.0);
        let other = image(|x, y| (x + 300.0, y + 100.0), 1.0);
        let flat = image(|_, _| (0.0, 0.0), 1.0);
        let patch = Patch { centre: Vector2::new(31.0, 33.0), angle: 0.0 };
        assert_eq!(align(&from, patch, &other, patch), None);
        assert_eq!(align(&from, patch, &flat, patch), None);
    }
}
