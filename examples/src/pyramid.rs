//! A scale pyramid: the image at ever coarser sampling, each level with its exact map to full-resolution pixels.
//!
//! The centre of the top-left pixel is (0, 0), so a level's pixel `x` lies at `(x + 1/2) s - 1/2` of the full image.

use image::GrayImage;
use image::imageops::{FilterType, resize};
use imageproc::filter::gaussian_blur_f32;

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
    let mut out = Vec::with_capacity(levels);
    for i in 0..levels {
        let scale = factor.powi(i as i32);
        let (w, h) = ((width as f32 / scale).round() as u32, (height as f32 / scale).round() as u32);
        if w < min_side || h < min_side {
            break;
        }
        let level = if i == 0 { image.clone() } else { resize(image, w, h, FilterType::Triangle) };
        out.push(Level {
            smooth: gaussian_blur_f32(&level, 2.0),
            image: level,
            pixel_size: [width as f32 / w as f32, height as f32 / h as f32],
        });
    }
    out
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
