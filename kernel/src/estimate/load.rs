//! Checks of the input and its conversion into the blocks that scoring reads.

use nalgebra::Vector2;

use super::workspace::TwoViewWorkspace;
use crate::geometry::CameraModel;
use crate::input::{check_finite, check_lengths};
use crate::linalg::LANES;
use crate::real::lit;
use crate::refine::blocks::{BearingBlock, Block, PlaneBlock};
use crate::refine::relative_pose::Scales;
use crate::{InputError, Real};

/// Checks two lists of pixels against each other, the minimal number and the capacity.
pub(super) fn check_pixels<T: Real>(
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    needed: usize,
    capacity: usize,
) -> Result<(), InputError> {
    check_lengths(x1, x2, needed)?;
    let given = x1.len();
    if given > capacity {
        return Err(InputError::TooMany { given, capacity });
    }
    check_finite(x1, 0)?;
    check_finite(x2, 1)
}

/// How pixels became block coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Units<T> {
    /// Pixels a unit of the blocks' coordinates.
    pub(super) pixels: T,
    /// Block coordinates over normalised ones.
    pub(super) scales: Scales<T>,
}

/// The common scale of two cameras: the mean of their focal lengths.
fn common_focal<T: Real>(camera1: &impl CameraModel<T>, camera2: &impl CameraModel<T>) -> T {
    (camera1.focal() + camera2.focal()) * T::HALF
}

/// Fills plane blocks. A pixel that the lens model does not reach becomes NaN, which is no inlier of anything.
pub(super) fn load_planes<T: Real>(
    camera1: &impl CameraModel<T>,
    camera2: &impl CameraModel<T>,
    focals: [(T, T); 2],
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    workspace: &mut TwoViewWorkspace<'_, T>,
) -> Units<T> {
    let pixels = common_focal(camera1, camera2);
    let scale = |(fx, fy): (T, T)| [fx / pixels, fy / pixels];
    let scales = Scales { view1: scale(focals[0]), view2: scale(focals[1]), ..Scales::unit() };
    let points = x1.iter().zip(x2).map(|(p, q)| {
        let a = plane_point(camera1, p, scales.view1);
        let b = plane_point(camera2, q, scales.view2);
        [a[0], a[1], b[0], b[1]]
    });
    fill::<T, PlaneBlock<T>, 4>(workspace.numbers, points);
    Units { pixels, scales }
}

fn plane_point<T: Real>(camera: &impl CameraModel<T>, pixel: &Vector2<T>, scale: [T; 2]) -> [T; 2] {
    match camera.unproject(pixel) {
        Ok(f) if f.z > T::ZERO => {
            let inverse = T::ONE / f.z;
            [f.x * inverse * scale[0], f.y * inverse * scale[1]]
        }
        _ => [lit(f64::NAN); 2],
    }
}

/// Fills bearing blocks, with the metric of each pixel.
pub(super) fn load_bearings<T: Real>(
    camera1: &impl CameraModel<T>,
    camera2: &impl CameraModel<T>,
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    workspace: &mut TwoViewWorkspace<'_, T>,
) -> Units<T> {
    let pixels = common_focal(camera1, camera2);
    let points = x1.iter().zip(x2).map(|(p, q)| {
        let (f, m) = bearing(camera1, p, pixels);
        let (g, n) = bearing(camera2, q, pixels);
        [
            f[0], f[1], f[2], g[0], g[1], g[2], m[0], m[1], m[2], m[3], m[4], m[5], n[0], n[1], n[2], n[3],
            n[4], n[5],
        ]
    });
    fill::<T, BearingBlock<T>, 18>(workspace.numbers, points);
    Units { pixels, scales: Scales::unit() }
}

/// A bearing and `J J'` for pixels of the common scale.
fn bearing<T: Real>(camera: &impl CameraModel<T>, pixel: &Vector2<T>, pixels: T) -> ([T; 3], [T; 6]) {
    match camera.unproject_with_jacobian(pixel) {
        Ok((f, j)) => {
            let j = j * pixels;
            let entry = |a: usize, b: usize| j[(a, 0)] * j[(b, 0)] + j[(a, 1)] * j[(b, 1)];
            let m = [entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)];
            ([f.x, f.y, f.z], m)
        }
        Err(_) => ([lit(f64::NAN); 3], [lit(f64::NAN); 6]),
    }
}

/// Writes points into blocks, four side by side; the lanes left in the last block are zero.
pub(super) fn fill<T: Real, B: Block<T>, const W: usize>(
    numbers: &mut [T],
    mut points: impl Iterator<Item = [T; W]>,
) {
    for block in B::slice_mut(numbers) {
        *block = B::zero();
        for lane in 0..LANES {
            let Some(point) = points.next() else { return };
            block.write_lane(lane, &point);
        }
    }
}
