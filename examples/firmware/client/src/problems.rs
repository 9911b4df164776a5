//! Requests about scenes with known answers.

use epipole::estimate::{AbsolutePoseOptions, GravityPrior, RelativePoseOptions, RelativePosePrior};
use epipole::geometry::{BrownConrady, Camera, KannalaBrandt, Pinhole};
use epipole::nalgebra::{Matrix3, Vector2, Vector3};
use epipole_problems::two_view::FOCAL;
use epipole_problems::{Geometry, TwoView};
use epipole_wire::{absolute_pose_request, encoded_len, relative_pose_request, request_bytes};

/// A request about scene `k` with at most `most` correspondences, as it stands on the line: relative and absolute poses,
/// all models of cameras, with and without scores and gravity, in general, planar and still scenes.
#[must_use]
pub fn synthetic(k: u32, sequence: u16, most: usize, max_iterations: u32) -> Vec<u8> {
    let geometry = match k % 5 {
        0 | 1 => Geometry::Ransac,
        2 => Geometry::Planar,
        3 => Geometry::Upright,
        _ => Geometry::General,
    };
    let scene = TwoView::<100>::new(geometry, k);
    let [x1, mut x2] = scene.pixels::<f32>();
    if k % 35 == 4 {
        x2 = x1;
    }
    // Wrong matches are the first of a scene; the last of it are taken.
    let fisheye = k % 11 == 10;
    let count = if fisheye { 24 } else { 8 + (k as usize * 37) % 93 }.min(most);
    let from = if count > 40 { 100 - count } else { 30.min(100 - count) };
    let (x1, x2) = (&x1[from..from + count], &x2[from..from + count]);
    let points = &scene.points::<f32, 100>()[from..from + count];
    let scores: Vec<f32> = x1.iter().zip(points).map(|(x, p)| (x.x + p.z).abs()).collect();
    let scores = k.is_multiple_of(3).then_some(&scores[..]);
    let f = FOCAL as f32;
    let pinhole = Pinhole::new(f, f, 0.0, 0.0).expect("a camera");
    let camera: Camera<f32> = match k % 11 {
        10 => KannalaBrandt::new(pinhole, [0.01, -0.002, 0.0, 0.0]).expect("a camera").into(),
        8 | 9 => BrownConrady::new(pinhole, [-0.05, 0.01, 0.001, 0.0, 0.0]).expect("a camera").into(),
        _ => pinhole.into(),
    };
    let mut out = vec![0; encoded_len(request_bytes(count))];
    let length = if k % 4 == 3 {
        let mut options = AbsolutePoseOptions::default();
        options.ransac.budget.max_iterations = max_iterations;
        let (world, camera_gravity) = (Vector3::y(), Vector3::new(0.01, 1.0, 0.0));
        options.gravity =
            (k % 8 == 7).then_some(GravityPrior { world, camera: camera_gravity, sigma_rad: 0.02 });
        let pixels: Vec<Vector2<f32>> = x1.to_vec();
        absolute_pose_request(&mut out, sequence, &camera, &pixels, points, scores, &options, 0)
    } else {
        let mut options = RelativePoseOptions::default();
        options.ransac.budget.max_iterations = max_iterations;
        options.ransac.seed = u64::from(k);
        let rotation = scene.pose::<f32>().rotation;
        options.prior = match k % 6 {
            1 => Some(RelativePosePrior::Gravity {
                view1: Vector3::y(),
                view2: rotation * Vector3::y(),
                sigma_rad: 0.01,
            }),
            2 => Some(RelativePosePrior::Rotation { rotation, covariance: Matrix3::identity() * 1e-4 }),
            _ => None,
        };
        relative_pose_request(&mut out, sequence, [&camera; 2], [x1, x2], scores, &options, 0)
    };
    out.truncate(length.expect("there is room"));
    out
}
