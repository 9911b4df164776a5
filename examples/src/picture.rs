//! The picture of two views: both images side by side, matches, epipolar lines, a legend.

use epipole::geometry::{Camera, CameraModel};
use epipole::nalgebra::{Isometry3, Vector2};
use image::imageops::{FilterType, replace, resize};
use image::{Rgb, RgbImage};

use crate::canvas::{CHARACTER, Paint, disc, fill, ring, stroke, text};
use crate::matching::Match;

const INLIER: [u8; 3] = [60, 225, 120];
const OUTLIER: [u8; 3] = [255, 70, 50];
const EPIPOLAR: [[u8; 3]; 6] =
    [[255, 214, 64], [64, 200, 255], [255, 120, 220], [255, 150, 50], [170, 140, 255], [240, 240, 240]];
const PAPER: [u8; 3] = [22, 24, 28];
const GAP: i64 = 8;
/// At most so many match lines are drawn, spread over the image: more would hide it.
const MAX_LINES: usize = 90;

/// What the picture shows.
pub struct Scene<'a> {
    pub images: [&'a RgbImage; 2],
    pub cameras: [Camera<f64>; 2],
    /// `X2 = R X1 + t`.
    pub pose: Isometry3<f64>,
    pub matches: &'a [Match],
    pub inliers: &'a [bool],
    /// Second line of the legend.
    pub caption: &'a str,
}

/// The picture, scaled so that it is at most `max_width` pixels wide.
pub fn draw(scene: &Scene<'_>, max_width: u32) -> RgbImage {
    let [a, b] = scene.images;
    let scale = ((max_width as f32 - GAP as f32) / (a.width() + b.width()) as f32).min(1.0);
    let [a, b] = [a, b].map(|image| shrink(image, scale));
    let lettering = if a.width() + b.width() < 1500 { 1 } else { 2 };
    let line_height = CHARACTER * lettering + 4 * lettering;
    let (height, legend) = (i64::from(a.height().max(b.height())), 2 * line_height + 8 * lettering);
    let width = i64::from(a.width()) + GAP + i64::from(b.width());
    let mut canvas = RgbImage::from_pixel(width as u32, (height + legend) as u32, Rgb(PAPER));
    replace(&mut canvas, &a, 0, 0);
    replace(&mut canvas, &b, i64::from(a.width()) + GAP, 0);

    let shift = (i64::from(a.width()) + GAP) as f32;
    let place = |view: usize, p: [f64; 2]| {
        let at = |x: f64| (x as f32 + 0.5) * scale - 0.5;
        [at(p[0]) + if view == 1 { shift } else { 0.0 }, at(p[1])]
    };
    let is_inlier = |want: bool| {
        scene.matches.iter().zip(scene.inliers).filter(move |(_, i)| **i == want).map(|(m, _)| m)
    };
    // What lies deeper is painted first: outliers, then inliers, then the epipolar lines.
    for (want, colour, opacity) in [(false, OUTLIER, 0.30), (true, INLIER, 0.45)] {
        let group: Vec<&Match> = is_inlier(want).collect();
        let lines = if want { MAX_LINES } else { MAX_LINES / 2 };
        for m in spread(&group, lines) {
            let line = [place(0, m.x1), place(1, m.x2)];
            stroke(&mut canvas, &line, 1.2, Paint::new(colour, opacity));
        }
        for m in group {
            for p in [place(0, m.x1), place(1, m.x2)] {
                disc(&mut canvas, p, 1.8, Paint::new(colour, 0.9));
            }
        }
    }
    let inliers: Vec<&Match> = is_inlier(true).collect();
    let sizes = [(a.width(), a.height()), (b.width(), b.height())].map(|(w, h)| [w as f32, h as f32]);
    let back = scene.pose.inverse();
    let views = [(1, 0, &scene.pose), (0, 1, &back)];
    for (m, colour) in spread(&inliers, EPIPOLAR.len()).into_iter().zip(EPIPOLAR) {
        for (view, other, pose) in views {
            let [own, shown] = if view == 1 { [m.x1, m.x2] } else { [m.x2, m.x1] };
            let pixels = epipolar_line(&scene.cameras[other], &scene.cameras[view], pose, own);
            let offset = if view == 1 { shift } else { 0.0 };
            for part in inside(&pixels, |p| place(view, p), offset, sizes[view]) {
                stroke(&mut canvas, &part, 1.8, Paint::new(colour, 0.9));
            }
            ring(&mut canvas, place(view, shown), 6.0, 2.0, Paint::new(colour, 1.0));
        }
    }

    let white = Paint::new([235, 235, 235], 1.0);
    let (mut pen, top) = (6 * lettering, height + 6 * lettering);
    let entries = [
        (INLIER, format!("{} inliers", inliers.len())),
        (OUTLIER, format!("{} outliers", scene.matches.len() - inliers.len())),
        (EPIPOLAR[0], "epipolar lines, with their points".to_string()),
    ];
    for (colour, label) in entries {
        fill(&mut canvas, pen, top, CHARACTER * lettering, 7 * lettering, Paint::new(colour, 1.0));
        pen = text(&mut canvas, pen + 12 * lettering, top, lettering, &label, white) + 16 * lettering;
    }
    text(&mut canvas, 6 * lettering, top + line_height, lettering, scene.caption, white);
    canvas
}

/// The image at the picture's scale, dimmed so that the lines stand out.
fn shrink(image: &RgbImage, scale: f32) -> RgbImage {
    let size = |n: u32| ((n as f32 * scale).round() as u32).max(1);
    let mut out = if scale < 1.0 {
        resize(image, size(image.width()), size(image.height()), FilterType::Triangle)
    } else {
        image.clone()
    };
    for Rgb(p) in out.pixels_mut() {
        let grey = p.iter().map(|&c| u32::from(c)).sum::<u32>() as f32 / 3.0;
        *p = p.map(|c| (0.85 * (0.75 * f32::from(c) + 0.25 * grey)) as u8);
    }
    out
}

/// At most `n` matches far from each other: each next one is the farthest from those taken (in both images).
fn spread<'a>(matches: &[&'a Match], n: usize) -> Vec<&'a Match> {
    let distance = |a: &Match, b: &Match| {
        let d = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).hypot(p[1] - q[1]);
        d(a.x1, b.x1).min(d(a.x2, b.x2))
    };
    let mut taken: Vec<&Match> = matches.iter().copied().take(1).collect();
    let mut nearest = vec![f64::MAX; matches.len()];
    while let Some(&last) = taken.last() {
        for (d, m) in nearest.iter_mut().zip(matches) {
            *d = d.min(distance(m, last));
        }
        let farthest = nearest.iter().zip(matches).max_by(|a, b| a.0.total_cmp(b.0));
        match farthest {
            Some((&d, &m)) if d > 0.0 && taken.len() < n => taken.push(m),
            _ => break,
        }
    }
    taken
}

/// Where the epipolar plane of `pixel` of one camera appears in the other: points of a line, or of a curve under
/// distortion.
fn epipolar_line(
    from: &Camera<f64>,
    to: &Camera<f64>,
    pose: &Isometry3<f64>,
    pixel: [f64; 2],
) -> Vec<Option<[f64; 2]>> {
    const STEPS: i32 = 4000;
    let Ok(bearing) = from.unproject(&Vector2::from(pixel)) else {
        return Vec::new();
    };
    // The whole plane of the ray and the baseline, in equal steps around the other camera, for |t| = 1.
    (0..=STEPS)
        .map(|i| {
            let angle = f64::from(i) / f64::from(STEPS) * std::f64::consts::TAU;
            let point = pose.rotation * (bearing * angle.sin()) + pose.translation.vector * angle.cos();
            to.project(&point).map(|p| [p.x, p.y])
        })
        .collect()
}

/// The runs of the curve that lie in the picture's frame, on the canvas.
fn inside(
    pixels: &[Option<[f64; 2]>],
    place: impl Fn([f64; 2]) -> [f32; 2],
    offset: f32,
    size: [f32; 2],
) -> Vec<Vec<[f32; 2]>> {
    let mut runs = vec![Vec::new()];
    for p in pixels {
        let p = p.map(&place).filter(|p| {
            p[0] >= offset && p[1] >= 0.0 && p[0] <= offset + size[0] - 1.0 && p[1] <= size[1] - 1.0
        });
        match (p, runs.last_mut()) {
            (Some(p), Some(run)) => run.push(p),
            (None, Some(run)) if !run.is_empty() => runs.push(Vec::new()),
            _ => {}
        }
    }
    runs.retain(|run| run.len() > 1);
    runs
}
