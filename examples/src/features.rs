//! ORB-like features: oriented FAST corners over a scale pyramid, rotated binary descriptors.
//!
//! After Rublee et al., "ORB: an efficient alternative to SIFT or SURF", ICCV 2011, with these differences: corners
//! are ranked by their smaller structure-tensor eigenvalue and spread over the image cell by cell, their position
//! is refined below the pixel, and the binary tests are drawn from a Gaussian (Calonder et al., ECCV 2010) instead
//! of learned. FAST itself is imageproc's; its BRIEF does not rotate.

use std::f32::consts::TAU;

use image::GrayImage;
use imageproc::corners::corners_fast9;

use crate::noise::Rng;
use crate::pyramid::{Level, pyramid, sample};

/// Radius of the patch that gives orientation and descriptor, in pixels of the level.
const PATCH_RADIUS: i32 = 15;
/// Corners nearer to the border are dropped: the patch, turned, with one pixel for interpolation.
const BORDER: u32 = PATCH_RADIUS as u32 + 3;
/// Words of a descriptor.
const WORDS: usize = 8;

/// 512 binary tests.
pub type Descriptor = [u64; WORDS];

/// A corner, in full-resolution pixels.
#[derive(Clone, Copy, Debug)]
pub struct Keypoint {
    pub x: f32,
    pub y: f32,
    /// Direction of the intensity centroid, in radians, x to y.
    pub angle: f32,
    /// Level of the pyramid.
    pub level: usize,
    /// The smaller eigenvalue of the structure tensor, in squared grey values a pixel.
    pub response: f32,
}

/// Keypoints with their descriptors, and the pyramid they were found in.
pub struct Features {
    pub keypoints: Vec<Keypoint>,
    pub descriptors: Vec<Descriptor>,
    pub levels: Vec<Level>,
}

/// How many features, and where to look for them.
#[derive(Clone, Copy, Debug)]
pub struct FeatureOptions {
    pub max_features: usize,
    pub levels: usize,
    pub scale_factor: f32,
    pub fast_threshold: u8,
}

impl Default for FeatureOptions {
    fn default() -> Self {
        Self { max_features: 5000, levels: 8, scale_factor: 1.2, fast_threshold: 7 }
    }
}

/// The features of an image, at most `max_features`, coarser levels with proportionally fewer.
pub fn detect(image: &GrayImage, options: &FeatureOptions) -> Features {
    let levels = pyramid(image, options.levels, options.scale_factor, 2 * BORDER + 8);
    let tests = binary_tests();
    let area = |l: &Level| (l.image.width() * l.image.height()) as f32;
    let total: f32 = levels.iter().map(area).sum();
    let per_level: Vec<(Vec<Keypoint>, Vec<Descriptor>)> = std::thread::scope(|scope| {
        let tests = &tests;
        let work: Vec<_> = levels
            .iter()
            .enumerate()
            .map(|(index, level)| {
                let quota = (options.max_features as f32 * area(level) / total).round() as usize;
                scope.spawn(move || features_of_level(level, index, quota, options.fast_threshold, tests))
            })
            .collect();
        work.into_iter().map(|w| w.join().expect("feature thread")).collect()
    });
    let (mut keypoints, mut descriptors) = (Vec::new(), Vec::new());
    for (k, d) in per_level {
        keypoints.extend(k);
        descriptors.extend(d);
    }
    Features { keypoints, descriptors, levels }
}

fn features_of_level(
    level: &Level,
    index: usize,
    quota: usize,
    fast_threshold: u8,
    tests: &[[f32; 4]],
) -> (Vec<Keypoint>, Vec<Descriptor>) {
    corners(&level.image, quota, fast_threshold)
        .into_iter()
        .map(|(x, y, response)| {
            let angle = orientation(&level.image, x, y);
            let [dx, dy] = subpixel(&level.image, x, y);
            let (lx, ly) = (x as f32 + dx, y as f32 + dy);
            let [fx, fy] = level.to_full(lx, ly);
            (
                Keypoint { x: fx, y: fy, angle, level: index, response },
                describe(&level.smooth, lx, ly, angle, tests),
            )
        })
        .unzip()
}

/// FAST corners that are local maxima of the response, the best of every cell first.
fn corners(image: &GrayImage, quota: usize, fast_threshold: u8) -> Vec<(u32, u32, f32)> {
    let (width, height) = image.dimensions();
    let inside = |x: u32, y: u32| x >= BORDER && y >= BORDER && x + BORDER < width && y + BORDER < height;
    let candidates: Vec<_> = corners_fast9(image, fast_threshold)
        .into_iter()
        .filter(|c| inside(c.x, c.y))
        .map(|c| (c.x, c.y, response(image, c.x, c.y)))
        .collect();
    let mut map = vec![0.0f32; (width * height) as usize];
    for &(x, y, r) in &candidates {
        map[(y * width + x) as usize] = r;
    }
    // Of equal neighbours the first in raster order stays.
    let is_maximum = |&(x, y, r): &(u32, u32, f32)| {
        (y - 1..=y + 1).all(|v| {
            (x - 1..=x + 1).all(|u| {
                let other = map[(v * width + u) as usize];
                (u, v) == (x, y) || r > other || (r == other && (v, u) > (y, x))
            })
        })
    };
    spread(candidates.into_iter().filter(is_maximum).collect(), quota, width, height)
}

/// At most `quota` corners: the strongest of every cell of a grid, then the second of every cell, and so on.
fn spread(mut corners: Vec<(u32, u32, f32)>, quota: usize, width: u32, height: u32) -> Vec<(u32, u32, f32)> {
    const PER_CELL: usize = 4;
    let cell = ((width * height) as f32 * PER_CELL as f32 / quota.max(1) as f32).sqrt().max(8.0);
    let columns = (width as f32 / cell) as usize + 1;
    let rows = (height as f32 / cell) as usize + 1;
    corners.sort_by(|a, b| b.2.total_cmp(&a.2).then((a.1, a.0).cmp(&(b.1, b.0))));
    let mut taken = vec![0usize; columns * rows];
    let mut ranked: Vec<(usize, (u32, u32, f32))> = corners
        .into_iter()
        .map(|c| {
            let rank = &mut taken[(c.1 as f32 / cell) as usize * columns + (c.0 as f32 / cell) as usize];
            *rank += 1;
            (*rank, c)
        })
        .collect();
    ranked.sort_by_key(|&(rank, _)| rank);
    ranked.truncate(quota);
    ranked.into_iter().map(|(_, c)| c).collect()
}

/// The smaller eigenvalue of the structure tensor over 7 x 7 pixels (Shi and Tomasi, CVPR 1994).
fn response(image: &GrayImage, x: u32, y: u32) -> f32 {
    let w = image.width() as usize;
    let data = image.as_raw();
    let (mut xx, mut xy, mut yy) = (0i32, 0i32, 0i32);
    for v in y as usize - 3..=y as usize + 3 {
        for u in x as usize - 3..=x as usize + 3 {
            let at = |i: usize| i32::from(data[i]);
            let i = v * w + u;
            let gx = at(i + 1) - at(i - 1);
            let gy = at(i + w) - at(i - w);
            xx += gx * gx;
            xy += gx * gy;
            yy += gy * gy;
        }
    }
    let (xx, xy, yy) = (xx as f32, xy as f32, yy as f32);
    let root = ((xx - yy) * (xx - yy) + 4.0 * xy * xy).sqrt();
    (xx + yy - root) / (2.0 * 4.0 * 49.0)
}

/// The maximum of the paraboloid through the responses around a corner, at most half a pixel away a side.
fn subpixel(image: &GrayImage, x: u32, y: u32) -> [f32; 2] {
    let r = |dx: i32, dy: i32| response(image, x.wrapping_add_signed(dx), y.wrapping_add_signed(dy));
    let centre = r(0, 0);
    let (left, right, up, down) = (r(-1, 0), r(1, 0), r(0, -1), r(0, 1));
    let (gx, gy) = ((right - left) / 2.0, (down - up) / 2.0);
    let (hxx, hyy) = (left + right - 2.0 * centre, up + down - 2.0 * centre);
    let hxy = (r(1, 1) + r(-1, -1) - r(1, -1) - r(-1, 1)) / 4.0;
    let det = hxx * hyy - hxy * hxy;
    if hxx >= 0.0 || det <= 0.0 {
        return [0.0, 0.0];
    }
    let dx = (hxy * gy - hyy * gx) / det;
    let dy = (hxy * gx - hxx * gy) / det;
    if dx.abs() > 1.0 || dy.abs() > 1.0 { [0.0, 0.0] } else { [dx.clamp(-0.5, 0.5), dy.clamp(-0.5, 0.5)] }
}

/// The direction from the corner to the intensity centroid of the disc around it (Rosin 1999).
fn orientation(image: &GrayImage, x: u32, y: u32) -> f32 {
    let w = image.width() as i32;
    let data = image.as_raw();
    let (mut mx, mut my) = (0i32, 0i32);
    for dy in -PATCH_RADIUS..=PATCH_RADIUS {
        let half = f64::from(PATCH_RADIUS * PATCH_RADIUS - dy * dy).sqrt() as i32;
        for dx in -half..=half {
            let value = i32::from(data[((y as i32 + dy) * w + x as i32 + dx) as usize]);
            mx += dx * value;
            my += dy * value;
        }
    }
    (my as f32).atan2(mx as f32)
}

/// Pairs of points in the patch `[x1, y1, x2, y2]`, each point drawn from a Gaussian and kept inside the disc.
fn binary_tests() -> Vec<[f32; 4]> {
    let mut rng = Rng::new(0x0b);
    let limit = (PATCH_RADIUS - 1) as f32;
    let mut point = || {
        loop {
            let p = [rng.gaussian() * 6.0, rng.gaussian() * 6.0];
            if p[0] * p[0] + p[1] * p[1] <= limit * limit {
                return p;
            }
        }
    };
    (0..WORDS * 64)
        .map(|_| {
            let (a, b) = (point(), point());
            [a[0], a[1], b[0], b[1]]
        })
        .collect()
}

/// The binary tests turned by the corner's angle.
fn describe(smooth: &GrayImage, x: f32, y: f32, angle: f32, tests: &[[f32; 4]]) -> Descriptor {
    let (sin, cos) = (angle % TAU).sin_cos();
    let value = |u: f32, v: f32| sample(smooth, x + cos * u - sin * v, y + sin * u + cos * v);
    let mut words = [0u64; WORDS];
    for (word, chunk) in words.iter_mut().zip(tests.chunks(64)) {
        for (bit, t) in chunk.iter().enumerate() {
            *word |= u64::from(value(t[0], t[1]) < value(t[2], t[3])) << bit;
        }
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matching::cross_check;
    use crate::noise::fractal;
    use image::imageops::rotate90;
    use image::{GrayImage, Luma};

    fn texture() -> GrayImage {
        let value = |x: u32, y: u32| (255.0 * fractal(x as f32 / 9.0, y as f32 / 9.0, 4, 3)) as u8;
        GrayImage::from_fn(240, 200, |x, y| Luma([value(x, y)]))
    }

    #[test]
    fn a_turned_image_has_the_same_features() {
        let image = texture();
        let options = FeatureOptions { max_features: 400, ..Default::default() };
        let (a, b) = (detect(&image, &options), detect(&rotate90(&image), &options));
        let matches = cross_check(&a.descriptors, &b.descriptors);
        // The turn takes (x, y) to (height - 1 - y, x).
        let right = matches.iter().filter(|(i, j, _)| {
            let (p, q) = (a.keypoints[*i], b.keypoints[*j]);
            (q.x - (199.0 - p.y)).hypot(q.y - p.x) < 1.5
        });
        let (right, all) = (right.count(), matches.len());
        assert!(all > 200 && right * 10 > all * 8, "{right} of {all}");
    }

    #[test]
    fn features_are_spread_and_no_more_than_asked() {
        let image = texture();
        let found = detect(&image, &FeatureOptions { max_features: 120, ..Default::default() });
        assert!(found.keypoints.len() <= 124 && found.keypoints.len() == found.descriptors.len());
        for (left, top) in [(true, true), (true, false), (false, true), (false, false)] {
            let quarter = found.keypoints.iter().filter(|k| (k.x < 120.0) == left && (k.y < 100.0) == top);
            assert!(quarter.count() >= 15);
        }
    }

    #[test]
    fn nothing_in_a_flat_or_tiny_image() {
        for image in [GrayImage::new(200, 100), GrayImage::new(3, 2), GrayImage::new(0, 0)] {
            assert!(detect(&image, &FeatureOptions::default()).keypoints.is_empty());
        }
    }
}
