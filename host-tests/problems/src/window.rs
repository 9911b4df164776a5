//! A short flight for bundle adjustment: frames along a curve above scattered points, noisy pixels, a disturbed start.

use epipole::Real;
use epipole::bundle::{FrameHandle, PointHandle, Window, WindowError};
use epipole::geometry::{Camera, CameraModel, Pinhole, Pose, pose};
use epipole::nalgebra::{Vector2, Vector3, Vector6};
use epipole::real::{lit, sin_cos};

use crate::random::SplitMix64;
use crate::two_view::cast_pose;

/// The camera's parameters `fx fy cx cy`, pixels.
pub const CAMERA: [f64; 4] = [458.0, 457.0, 367.0, 248.0];
/// The image's size, pixels.
pub const SIZE: [f64; 2] = [752.0, 480.0];
/// Metres between frames.
const STEP: f64 = 0.25;

/// The handles of a filled window.
pub type Handles<const F: usize, const P: usize> = ([Option<FrameHandle>; F], [Option<PointHandle>; P]);

/// A flight whose points are known by their numbers: everything is computed when it is asked for.
#[derive(Clone, Copy, Debug)]
pub struct Flight {
    /// Chooses noise and points.
    pub seed: u64,
}

impl Flight {
    /// The true pose of a frame: a slow turn, forward and sideways.
    #[must_use]
    pub fn pose(&self, frame: u32) -> Pose<f64> {
        let s = f64::from(frame) * STEP;
        let (sin, cos) = sin_cos(0.4 * s);
        let rotation = pose::exp(&Vector3::new(0.03 * sin, -0.08 * s + 0.02 * cos, 0.04 * cos));
        let centre = Vector3::new(s, 0.2 * sin, 0.35 * s);
        Pose::from_parts((-(rotation * centre)).into(), rotation)
    }

    /// The true position of a point: 1 to 2 steps of the path for each `per_frame` points.
    #[must_use]
    pub fn point(&self, point: u32, per_frame: u32) -> Vector3<f64> {
        let mut random =
            SplitMix64(self.seed ^ (0x9E37 + u64::from(point)).wrapping_mul(0xD6E8_FEB8_6659_FD93));
        let s = f64::from(point / per_frame) * STEP;
        let ahead = random.between(4.0, 9.0);
        let aside = random.between(-0.55, 0.55) * ahead;
        let (sin, cos) = sin_cos(0.08 * s);
        // In the frame at `s`, then in the world.
        Vector3::new(
            s + cos * aside + sin * ahead,
            random.between(-0.4, 0.4) * ahead,
            0.35 * s - sin * aside + cos * ahead,
        )
    }

    /// Where a frame sees a point, with one pixel of noise; none where it is out of sight.
    #[must_use]
    pub fn pixel(&self, frame: u32, point: u32, position: &Vector3<f64>) -> Option<Vector2<f64>> {
        let [fx, fy, cx, cy] = CAMERA;
        let camera = Pinhole::new(fx, fy, cx, cy).ok()?;
        let pose = self.pose(frame);
        let pixel = camera.project(&(pose.rotation * position + pose.translation.vector))?;
        let inside = pixel.x >= 0.0 && pixel.x < SIZE[0] && pixel.y >= 0.0 && pixel.y < SIZE[1];
        let mut noise = SplitMix64(
            self.seed ^ (u64::from(frame) << 32 | u64::from(point)).wrapping_mul(0xA076_1D64_78BD_642F),
        );
        noise.bits();
        inside.then(|| pixel + Vector2::from(noise.normal_pair()))
    }

    /// The camera.
    #[must_use]
    pub fn camera<T: Real>(&self) -> Option<Camera<T>> {
        let [fx, fy, cx, cy] = CAMERA.map(lit::<T>);
        Some(Pinhole::new(fx, fy, cx, cy).ok()?.into())
    }

    /// A pose some centimetres and tenths of a degree beside the true one.
    #[must_use]
    pub fn guess<T: Real>(&self, frame: u32) -> Pose<T> {
        let mut random = SplitMix64(self.seed ^ u64::from(frame).wrapping_mul(0xE703_7ED1_A0B4_28DB));
        random.bits();
        let delta = Vector6::from_fn(|i, _| random.between(-1.0, 1.0) * if i < 3 { 0.01 } else { 0.03 });
        cast_pose(&pose::retract(&self.pose(frame), &delta))
    }

    /// Fills an empty window with the first frames and points; the first two frames are exact and fixed.
    ///
    /// # Errors
    /// The window's, where it has no room.
    pub fn fill<T: Real, const F: usize, const P: usize>(
        &self,
        window: &mut Window<'_, T>,
    ) -> Result<Handles<F, P>, WindowError> {
        let mut frames = [None; F];
        let mut points = [None; P];
        let Some(camera) = self.camera() else { return Ok((frames, points)) };
        for (slot, k) in frames.iter_mut().zip(0u32..) {
            let exact = k < 2;
            let start = if exact { cast_pose(&self.pose(k)) } else { self.guess(k) };
            let frame = window.add_frame(camera, &start)?;
            window.fix_frame(frame, exact)?;
            *slot = Some(frame);
        }
        for (slot, j) in points.iter_mut().zip(0u32..) {
            let position = self.point(j, P as u32);
            let off = 1.0 + 0.02 * SplitMix64(u64::from(j)).between(-1.0, 1.0);
            let point = window.add_point(&(position * off).map(lit::<T>))?;
            for (frame, k) in frames.iter().flatten().zip(0u32..) {
                if let Some(pixel) = self.pixel(k, j, &position) {
                    window.add_observation(*frame, point, &pixel.map(lit::<T>), T::ONE)?;
                }
            }
            *slot = Some(point);
        }
        Ok((frames, points))
    }
}
