//! A path seen from above, beside the truth where it is known.

use epipole::nalgebra::Vector3;
use image::{Rgb, RgbImage};

use crate::canvas::{CHARACTER, Paint, disc, fill, stroke, text};

const SIZE: [u32; 2] = [900, 700];
const MARGIN: f64 = 60.0;
const OURS: [u8; 3] = [60, 200, 255];
const TRUTH: [u8; 3] = [255, 200, 60];

/// Draws the x-z plane, z up, with a grid whose spacing is written beside it.
pub fn draw_track(centres: &[Vector3<f64>], truth: Option<&[Vector3<f64>]>) -> RgbImage {
    let mut canvas = RgbImage::from_pixel(SIZE[0], SIZE[1], Rgb([22, 24, 28]));
    let all = || centres.iter().chain(truth.unwrap_or(&[]));
    let range = |value: fn(&Vector3<f64>) -> f64| {
        all().map(value).fold([f64::MAX, f64::MIN], |[a, b], v| [a.min(v), b.max(v)])
    };
    let (x, z) = (range(|c| c.x), range(|c| c.z));
    let room = [f64::from(SIZE[0]) - 2.0 * MARGIN, f64::from(SIZE[1]) - 2.0 * MARGIN];
    let scale = (room[0] / (x[1] - x[0]).max(1e-9)).min(room[1] / (z[1] - z[0]).max(1e-9));
    let middle = [(x[0] + x[1]) / 2.0, (z[0] + z[1]) / 2.0];
    let place = |x: f64, z: f64| {
        [
            (f64::from(SIZE[0]) / 2.0 + scale * (x - middle[0])) as f32,
            (f64::from(SIZE[1]) / 2.0 - scale * (z - middle[1])) as f32,
        ]
    };
    // A round spacing: 1, 2 or 5 times a power of ten, about 80 pixels.
    let power = 10f64.powf((80.0 / scale).log10().floor());
    let spacing = [1.0, 2.0, 5.0, 10.0].map(|k| k * power).into_iter().find(|s| s * scale >= 80.0);
    let spacing = spacing.unwrap_or(10.0 * power);
    let faint = Paint::new([255, 255, 255], 0.12);
    let reach = 1 + (f64::from(SIZE[0].max(SIZE[1])) / (scale * spacing)) as i32;
    let nearest = middle.map(|m| (m / spacing).round());
    for k in -reach..=reach {
        let [u, v] = nearest.map(|n| (n + f64::from(k)) * spacing);
        let (far, px) = (f64::from(reach) * spacing, 1.0);
        stroke(&mut canvas, &[place(u, middle[1] - far), place(u, middle[1] + far)], px, faint);
        stroke(&mut canvas, &[place(middle[0] - far, v), place(middle[0] + far, v)], px, faint);
    }
    let lines = [(truth.unwrap_or(&[]), TRUTH, 5.0), (centres, OURS, 2.0)];
    for (points, colour, width) in lines {
        let points: Vec<[f32; 2]> = points.iter().map(|c| place(c.x, c.z)).collect();
        stroke(&mut canvas, &points, width, Paint::new(colour, 0.9));
        for p in points {
            disc(&mut canvas, p, width * 0.5 + 1.5, Paint::new(colour, 1.0));
        }
    }
    let mut pen = 16;
    let entries = [(OURS, "epipole", true), (TRUTH, "ground truth", truth.is_some())];
    for (colour, label, _) in entries.into_iter().filter(|e| e.2) {
        fill(&mut canvas, pen, 16, 2 * CHARACTER, 2 * CHARACTER - 2, Paint::new(colour, 1.0));
        pen = text(&mut canvas, pen + 24, 16, 2, label, Paint::new([235; 3], 1.0)) + 32;
    }
    let unit = if truth.is_some() { "m" } else { "baselines" };
    text(&mut canvas, pen, 16, 2, &format!("grid {spacing} {unit}"), Paint::new([170; 3], 1.0));
    canvas
}
