//! A scale pyramid: the image at ever coarser sampling, each level with its exact map to full-resolution pixels.
//!
//! The centre of the top-left pixel is (0, 0), so a level's pixel `x` lies at `(x + 1/2) s - 1/2` of the full image.

use image::GrayImage;
use image::imageops::{FilterType, resize};

/// One level: the image, a smoothed copy for binary tests, and the size of its pixel in full-resolution pixels.
pub struct Level {
    pub image: GrayImage,
    pub smooth: GrayImage,
    pub pixel_size: [f32; 2],
}

impl Level {
    /// From this level's pixels to full-resolution pixels.
    pub fn to_full(&self, x: f32, y: f32) -> [f32; 2] {
        [(x + 0.5) * self.pixel_size[0] - 0.5, (y + 0.5) * self.pixel_size[1] - 0.5]
    }

    /// From full-resolution pixels to this level's pixels.
    pub fn from_full(&self, x: f32, y: f32) -> [f32; 2] {
        [(x + 0.5) / self.pixel_size[0] - 0.5, (y + 0.5) / self.pixel_size[1] - 0.5]
    }
}

/// `levels` images, each `factor` times coarser than the one before; it stops where a side falls below `min_side`.
pub fn pyramid(image: &GrayImage, levels: usize, factor: f32, min_side: u32) -> Vec<Level> {
    let (width, height) = image.dimensions();
    let size = |i: usize| {
        let scale = factor.powi(i as i32);
        ((width as f32 / scale).round() as u32, (height as f32 / scale).round() as u32)
    };
    let sizes: Vec<(u32, u32)> =
        (0..levels).map(size).take_while(|(w, h)| *w >= min_side && *h >= min_side).collect();
    let level = |(w, h): (u32, u32)| {
        let same = (w, h) == (width, height);
        let level = if same { image.clone() } else { resize(image, w, h, FilterType::Triangle) };
        let pixel_size = [width as f32 / w as f32, height as f32 / h as f32];
        Level { smooth: blur(&level), image: level, pixel_size }
    };
    std::thread::scope(|scope| {
        let level = &level;
        let work: Vec<_> = sizes.into_iter().map(|size| scope.spawn(move || level(size))).collect();
        work.into_iter().map(|w| w.join().expect("pyramid thread")).collect()
    })
}

/// A Gaussian blur of 2 pixels, row by row and then column by column, the border repeated.
fn blur(image: &GrayImage) -> GrayImage {
    const RADIUS: usize = 6;
    const SIGMA: f32 = 2.0;
    let mut kernel: [f32; 2 * RADIUS + 1] =
        std::array::from_fn(|i| (-(i as f32 - RADIUS as f32).powi(2) / (2.0 * SIGMA * SIGMA)).exp());
    let total: f32 = kernel.iter().sum();
    kernel.iter_mut().for_each(|k| *k /= total);

    let (width, height) = (image.width() as usize, image.height() as usize);
    let mut padded = vec![0.0f32; width + 2 * RADIUS];
    let mut rows = vec![0.0f32; width * height];
    for (out, row) in rows.chunks_mut(width).zip(image.as_raw().chunks(width)) {
        for (i, p) in padded.iter_mut().enumerate() {
            *p = f32::from(row[i.saturating_sub(RADIUS).min(width - 1)]);
        }
        for (k, weight) in kernel.iter().enumerate() {
            out.iter_mut().zip(&padded[k..]).for_each(|(o, p)| *o += weight * p);
        }
    }
    let mut smooth = GrayImage::new(image.width(), image.height());
    let mut sum = vec![0.0f32; width];
    for (y, out) in smooth.chunks_mut(width).enumerate() {
        // Half a grey value, so that the conversion rounds to the nearest.
        sum.fill(0.5);
        for (k, weight) in kernel.iter().enumerate() {
            let row = (y + k).saturating_sub(RADIUS).min(height - 1);
            sum.iter_mut().zip(&rows[row * width..]).for_each(|(s, r)| *s += weight * r);
        }
        out.iter_mut().zip(&sum).for_each(|(o, s)| *o = *s as u8);
    }
    smooth
}

/// Bilinear interpolation, clamped to the border.
pub fn sample(image: &GrayImage, x: f32, y: f32) -> f32 {
    let (w, h) = (image.width() as usize, image.height() as usize);
    let x = x.clamp(0.0, (w - 1) as f32);
    let y = y.clamp(0.0, (h - 1) as f32);
    let (x0, y0) = ((x as usize).min(w.saturating_sub(2)), (y as usize).min(h.saturating_sub(2)));
    let (fx, fy) = (x - x0 as f32, y - y0 as f32);
    let (x1, y1) = ((x0 + 1).min(w - 1), (y0 + 1).min(h - 1));
    let data = image.as_raw();
    let at = |x: usize, y: usize| f32::from(data[y * w + x]);
    let top = at(x0, y0) + fx * (at(x1, y0) - at(x0, y0));
    let bottom = at(x0, y1) + fx * (at(x1, y1) - at(x0, y1));
    top + fy * (bottom - top)
}
