//! A synthetic flight: a camera on a long bent path, tracks of landmarks that come into view and leave it.

use epipole::geometry::Pose;
use epipole::nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion, Vector2, Vector3};

use epipole::real::sin_cos;

pub use super::problem::centre;
use crate::Rng;

/// Metres between frames.
pub const STEP: f64 = 1.0;
/// `fx fy cx cy`, image 640 by 480.
pub const CAMERA: [f64; 4] = [400.0, 400.0, 319.5, 239.5];

/// The truth and the measurements of a flight.
#[derive(Clone, Debug)]
pub struct Flight {
    /// World to camera.
    pub poses: Vec<Pose<f64>>,
    /// Of each frame, the tracks seen in it and where.
    pub seen: Vec<Vec<(usize, Vector2<f64>)>>,
    /// The landmark of each track.
    pub landmarks: Vec<Vector3<f64>>,
}

impl Flight {
    /// A flight of so many frames, a metre apart on a circle of 40 m that rises and falls, with so many tracks in
    /// view and Gaussian noise on their pixels. The camera looks ahead and 35 degrees outwards.
    pub fn new(frames: usize, tracks: usize, sigma_px: f64, seed: u64) -> Self {
        let mut rng = Rng::new(seed);
        let mut flight = Self { poses: vec![], seen: vec![], landmarks: vec![] };
        let mut alive: Vec<usize> = vec![];
        for k in 0..frames {
            let angle = k as f64 * STEP / 40.0;
            // By the kernel's functions: the platform's differ in the last bit.
            let (sin, cos) = sin_cos(angle);
            let centre = Vector3::new(40.0 * cos, 1.5 * sin_cos(3.0 * angle).0, 40.0 * sin);
            let ahead = Vector3::new(-sin, 0.05 * sin_cos(2.0 * angle).1, cos);
            let down = Vector3::y();
            let right = down.cross(&ahead).normalize();
            let down = ahead.normalize().cross(&right);
            let look =
                Matrix3::from_rows(&[right.transpose(), down.transpose(), ahead.normalize().transpose()]);
            let sway = Rotation3::from_euler_angles(
                0.03 * sin_cos(0.7 * k as f64).0,
                35f64.to_radians(),
                0.05 * sin_cos(0.3 * k as f64).1,
            );
            let rotation =
                UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(sway.matrix() * look));
            let pose = Pose::from_parts(Translation3::from(-(rotation * centre)), rotation);
            alive.retain(|&track| rng.unit() > 0.05 && project(&pose, &flight.landmarks[track]).is_some());
            while alive.len() < tracks {
                let pixel = Vector2::new(rng.range(0.0, 639.0), rng.range(0.0, 479.0));
                let depth = rng.range(4.0, 25.0);
                let ray =
                    Vector3::new((pixel.x - CAMERA[2]) / CAMERA[0], (pixel.y - CAMERA[3]) / CAMERA[1], 1.0);
                let point = pose.inverse_transform_vector(&(ray * depth)) + centre;
                alive.push(flight.landmarks.len());
                flight.landmarks.push(point);
            }
            let seen = alive
                .iter()
                .filter_map(|&track| {
                    let noise = Vector2::new(rng.normal(), rng.normal()) * sigma_px;
                    Some((track, project(&pose, &flight.landmarks[track])? + noise))
                })
                .collect();
            flight.poses.push(pose);
            flight.seen.push(seen);
        }
        flight
    }

    /// The camera's centre in frame `k`.
    pub fn centre(&self, k: usize) -> Vector3<f64> {
        centre(&self.poses[k])
    }
}

fn project(pose: &Pose<f64>, x: &Vector3<f64>) -> Option<Vector2<f64>> {
    let y = pose.rotation * x + pose.translation.vector;
    if y.z < 1.0 {
        return None;
    }
    let p = Vector2::new(CAMERA[0] * y.x / y.z + CAMERA[2], CAMERA[1] * y.y / y.z + CAMERA[3]);
    (p.x >= 0.0 && p.x <= 639.0 && p.y >= 0.0 && p.y <= 479.0).then_some(p)
}
