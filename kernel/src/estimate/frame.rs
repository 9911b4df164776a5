//! The coordinates in which uncalibrated models are estimated: pixels about a centre, in units of their spread.

use nalgebra::{Matrix3, Vector2};

use super::load::fill;
use super::workspace::TwoViewWorkspace;
use crate::Real;
use crate::geometry::{Fundamental, Homography};
use crate::real::{abs, is_finite, lit, max, sqrt};
use crate::refine::blocks::PlaneBlock;

/// Correspondences looked at for the centre and the spread.
const LOOKED_AT: usize = 15;

/// The centre of each view's pixels and one scale for both, so that errors in both views weigh alike. Single precision
/// keeps its digits, whatever the size of the images. (R. Hartley, "In defense of the eight-point algorithm", 1997;
/// medians in place of means, so that one wild point does not move the frame.)
#[derive(Clone, Copy, Debug)]
pub(super) struct PixelFrame<T> {
    /// Pixel at the origin of view 1.
    pub(super) centre1: [T; 2],
    /// Pixel at the origin of view 2.
    pub(super) centre2: [T; 2],
    /// Pixels a unit.
    pub(super) pixels: T,
}

/// The median of a short list.
fn median<T: Real>(values: [T; LOOKED_AT]) -> T {
    let mut rising = [T::MAX; LOOKED_AT];
    for mut value in values {
        for entry in &mut rising {
            if value < *entry {
                core::mem::swap(entry, &mut value);
            }
        }
    }
    rising[LOOKED_AT / 2]
}

impl<T: Real> PixelFrame<T> {
    /// The frame of two lists of as many pixels, from some of them evenly spread. A unit is no less than `least_pixels`.
    fn new(x1: &[Vector2<T>], x2: &[Vector2<T>], least_pixels: T) -> Self {
        let mut values = [[T::ZERO; LOOKED_AT]; 4];
        for k in 0..LOOKED_AT {
            let index = (2 * k + 1) * x1.len() / (2 * LOOKED_AT);
            if let (Some(p), Some(q)) = (x1.get(index), x2.get(index)) {
                for (list, value) in values.iter_mut().zip([p.x, p.y, q.x, q.y]) {
                    list[k] = value;
                }
            }
        }
        let centre = values.map(median);
        let mut spread = T::ZERO;
        for (list, centre) in values.iter().zip(centre) {
            spread = max(spread, median(list.map(|value| abs(value - centre))));
        }
        // Half of the points lie within the spread: twice that is about the size of the image's half.
        let pixels = max(spread * T::TWO, least_pixels);
        Self { centre1: [centre[0], centre[1]], centre2: [centre[2], centre[3]], pixels }
    }

    /// Fills the workspace with the correspondences in the frame of their pixels.
    pub(super) fn load(
        x1: &[Vector2<T>],
        x2: &[Vector2<T>],
        max_error_px: T,
        workspace: &mut TwoViewWorkspace<'_, T>,
    ) -> Self {
        let frame = Self::new(x1, x2, max_error_px * lit(8.0));
        let scale = T::ONE / frame.pixels;
        let (a, b) = (frame.centre1, frame.centre2);
        let points = x1.iter().zip(x2).map(|(p, q)| {
            [(p.x - a[0]) * scale, (p.y - a[1]) * scale, (q.x - b[0]) * scale, (q.y - b[1]) * scale]
        });
        fill::<T, PlaneBlock<T>, 4>(workspace.numbers, points);
        workspace.count = x1.len();
        frame
    }

    /// Coordinates from pixels of view 1.
    fn normaliser1(&self) -> Matrix3<T> {
        affine(T::ONE / self.pixels, self.centre1.map(|c| -c / self.pixels))
    }

    /// Coordinates from pixels of view 2.
    fn normaliser2(&self) -> Matrix3<T> {
        affine(T::ONE / self.pixels, self.centre2.map(|c| -c / self.pixels))
    }

    /// A homography between pixels, of length 1, of one between coordinates; none where it leaves the range of `T`.
    pub(super) fn homography(&self, h: &Matrix3<T>) -> Option<Homography<T>> {
        unit(&(affine(self.pixels, self.centre2) * h * self.normaliser1())).map(Homography)
    }

    /// A fundamental matrix of pixels, of length 1, of one of coordinates; none where it leaves the range of `T`.
    pub(super) fn fundamental(&self, f: &Matrix3<T>) -> Option<Fundamental<T>> {
        unit(&(self.normaliser2().transpose() * f * self.normaliser1())).map(Fundamental)
    }

    /// A distance in pixels; 0 where it leaves the range of `T`.
    pub(super) fn distance_px(&self, distance: T) -> T {
        let px = distance * self.pixels;
        if is_finite(px) { px } else { T::ZERO }
    }
}

fn unit<T: Real>(m: &Matrix3<T>) -> Option<Matrix3<T>> {
    let size = sqrt(m.norm_squared());
    (size > T::ZERO && size <= T::MAX).then(|| m * (T::ONE / size)).filter(|m| is_finite(m.norm_squared()))
}

/// `x <- scale x + shift`.
fn affine<T: Real>(scale: T, shift: [T; 2]) -> Matrix3<T> {
    let (o, l) = (T::ZERO, T::ONE);
    Matrix3::new(scale, o, shift[0], o, scale, shift[1], o, o, l)
}
