//! Antialiased strokes, discs and text on an image.

use font8x8::{BASIC_FONTS, UnicodeFonts};
use image::{Rgb, RgbImage};

/// A colour and how much of it covers what lies below, 0 to 1.
#[derive(Clone, Copy, Debug)]
pub struct Paint {
    pub colour: [u8; 3],
    pub opacity: f32,
}

impl Paint {
    pub const fn new(colour: [u8; 3], opacity: f32) -> Self {
        Self { colour, opacity }
    }
}

fn blend(image: &mut RgbImage, x: i64, y: i64, paint: Paint, coverage: f32) {
    if x < 0 || y < 0 || x >= i64::from(image.width()) || y >= i64::from(image.height()) {
        return;
    }
    let Rgb(below) = image.get_pixel_mut(x as u32, y as u32);
    let weight = paint.opacity * coverage.clamp(0.0, 1.0);
    for (b, c) in below.iter_mut().zip(paint.colour) {
        *b = (f32::from(*b) + weight * (f32::from(c) - f32::from(*b))).round() as u8;
    }
}

/// A polyline with round ends; every pixel is painted once, however the line bends.
pub fn stroke(image: &mut RgbImage, points: &[[f32; 2]], width: f32, paint: Paint) {
    let reach = width / 2.0 + 1.0;
    let limit = [image.width() as f32 - 1.0, image.height() as f32 - 1.0];
    let bound = |axis: usize, side: f32, pick: fn(f32, f32) -> f32| {
        let extreme = points.iter().map(|p| p[axis]).reduce(pick).unwrap_or(0.0);
        (extreme + side * reach).clamp(0.0, limit[axis]) as usize
    };
    let (x0, x1) = (bound(0, -1.0, f32::min), bound(0, 1.0, f32::max));
    let (y0, y1) = (bound(1, -1.0, f32::min), bound(1, 1.0, f32::max));
    let columns = x1 + 1 - x0;
    let mut covered = vec![0.0f32; columns * (y1 + 1 - y0)];
    for pair in points.windows(2) {
        let [a, b] = [pair[0], pair[1]];
        let d = [b[0] - a[0], b[1] - a[1]];
        let length_sq = (d[0] * d[0] + d[1] * d[1]).max(1e-12);
        // One step a pixel of the longer axis; around each, the pixels that the stroke may touch.
        let steps = d[0].abs().max(d[1].abs()).ceil().max(1.0) as u32;
        for i in 0..=steps {
            let t = i as f32 / steps as f32;
            let span = |c: f32, low: usize, high: usize| {
                (((c - reach).max(0.0) as usize).max(low))..=(((c + reach).max(0.0) as usize).min(high))
            };
            for y in span(a[1] + t * d[1], y0, y1) {
                for x in span(a[0] + t * d[0], x0, x1) {
                    let r = [x as f32 - a[0], y as f32 - a[1]];
                    let along = ((r[0] * d[0] + r[1] * d[1]) / length_sq).clamp(0.0, 1.0);
                    let distance = (r[0] - along * d[0]).hypot(r[1] - along * d[1]);
                    let slot = &mut covered[(y - y0) * columns + x - x0];
                    *slot = slot.max((width / 2.0 + 0.5 - distance).clamp(0.0, 1.0));
                }
            }
        }
    }
    for (i, &coverage) in covered.iter().enumerate().filter(|c| *c.1 > 0.0) {
        blend(image, (x0 + i % columns) as i64, (y0 + i / columns) as i64, paint, coverage);
    }
}

/// A filled disc.
pub fn disc(image: &mut RgbImage, centre: [f32; 2], radius: f32, paint: Paint) {
    stroke(image, &[centre, centre], 2.0 * radius, paint);
}

/// A circle.
pub fn ring(image: &mut RgbImage, centre: [f32; 2], radius: f32, width: f32, paint: Paint) {
    let point = |i: i32| {
        let (sin, cos) = (i as f32 * std::f32::consts::TAU / 24.0).sin_cos();
        [centre[0] + radius * cos, centre[1] + radius * sin]
    };
    stroke(image, &(0..=24).map(point).collect::<Vec<_>>(), width, paint);
}

/// A filled rectangle.
pub fn fill(image: &mut RgbImage, x: i64, y: i64, width: i64, height: i64, paint: Paint) {
    for v in y..y + height {
        for u in x..x + width {
            blend(image, u, v, paint, 1.0);
        }
    }
}

/// Height of a line of text at scale 1, and width of a character.
pub const CHARACTER: i64 = 8;

/// Text with its top-left corner at (x, y), each dot `scale` pixels wide; returns where it ends.
pub fn text(image: &mut RgbImage, x: i64, y: i64, scale: i64, text: &str, paint: Paint) -> i64 {
    let mut pen = x;
    for character in text.chars() {
        let glyph = BASIC_FONTS.get(character).unwrap_or([0; 8]);
        for (row, bits) in glyph.iter().enumerate() {
            for column in (0..8).filter(|c| bits >> c & 1 == 1) {
                fill(image, pen + column * scale, y + row as i64 * scale, scale, scale, paint);
            }
        }
        pen += CHARACTER * scale;
    }
    pen
}
