//! The robust estimators, on 100 correspondences of which 30 are wrong.

use core::hint::black_box;

use epipole::estimate::{RelativePoseOptions, RelativePoseStorage, RelativePoseVerdict, relative_pose};
use epipole::geometry::Pinhole;
use epipole_problems::two_view::FOCAL;
use epipole_problems::{Geometry, TwoView};

use crate::row::{row, trial};

const N: usize = if cfg!(small_ram) { 40 } else { 100 };
/// Rotation error, rad, below which a problem counts as solved.
const SOLVED: f64 = 1e-2;

pub fn run() {
    let focal = FOCAL as f32;
    let Ok(camera) = Pinhole::new(focal, focal, 0.0, 0.0) else { return };
    let mut storage = RelativePoseStorage::<f32, N>::new();
    let mut workspace = storage.workspace();
    let mut options = RelativePoseOptions::<f32>::default();
    options.max_error_px = 2.0;
    options.ransac.confidence = 0.99;
    row("estimate::relative_pose", 0..if cfg!(small_ram) { 4 } else { 32 }, SOLVED, |k| {
        let scene = TwoView::<N>::new(Geometry::Ransac, k);
        let [x1, x2] = scene.pixels();
        trial(
            || relative_pose(&camera, &camera, black_box(&x1), black_box(&x2), &options, &mut workspace),
            |estimate| match estimate.as_ref().map(|e| &e.verdict) {
                Ok(RelativePoseVerdict::General(motion)) => scene.rotation_error(&motion.pose.rotation),
                Ok(RelativePoseVerdict::Planar(poses)) => {
                    poses.first().map_or(f64::INFINITY, |p| scene.rotation_error(&p.pose.rotation))
                }
                _ => f64::INFINITY,
            },
        )
    });
}
