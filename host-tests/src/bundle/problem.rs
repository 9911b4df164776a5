//! Bundle problems in memory.

use epipole::Real;
use epipole::bundle::{FrameHandle, PointHandle, Window, WindowError};
use epipole::geometry::{BrownConrady, Camera, CameraError, CameraModel, KannalaBrandt, Pinhole, Pose};
use epipole::nalgebra::{Matrix3, UnitQuaternion, Vector2, Vector3};
use epipole::real::lit;
use epipole::robust::loss::Loss;

/// Frames, points and observations in `f64`.
#[derive(Clone, Debug, Default)]
pub struct Problem {
    /// One camera a frame.
    pub cameras: Vec<Camera<f64>>,
    /// Poses to start from, world to camera.
    pub poses: Vec<Pose<f64>>,
    /// Points to start from.
    pub points: Vec<Vector3<f64>>,
    /// Frame, point, pixel.
    pub observations: Vec<(usize, usize, Vector2<f64>)>,
    /// True poses, where known.
    pub true_poses: Vec<Pose<f64>>,
    /// True points, where known.
    pub true_points: Vec<Vector3<f64>>,
    /// How many of the first frames are fixed.
    pub fixed: usize,
}

impl Problem {
    /// Fills an empty window, each observation with one pixel of noise.
    pub fn fill<T: Real>(
        &self,
        window: &mut Window<'_, T>,
    ) -> Result<(Vec<FrameHandle>, Vec<PointHandle>), WindowError> {
        let mut frames = Vec::with_capacity(self.poses.len());
        for (i, (pose, camera)) in self.poses.iter().zip(&self.cameras).enumerate() {
            let camera = cast_camera(camera).map_err(|_| WindowError::NotFinite)?;
            let frame = window.add_frame(camera, &cast_pose(pose))?;
            window.fix_frame(frame, i < self.fixed)?;
            frames.push(frame);
        }
        let mut points = Vec::with_capacity(self.points.len());
        for x in &self.points {
            points.push(window.add_point(&x.map(lit))?);
        }
        for (i, j, pixel) in &self.observations {
            window.add_observation(frames[*i], points[*j], &pixel.map(lit), T::ONE)?;
        }
        Ok((frames, points))
    }

    /// Squared residuals at poses and points, in `f64`; none for observations behind their camera.
    pub fn squared_residuals<'a>(
        &'a self,
        poses: &'a [Pose<f64>],
        points: &'a [Vector3<f64>],
    ) -> impl Iterator<Item = Option<f64>> + 'a {
        self.observations.iter().map(|(i, j, pixel)| {
            let y = poses[*i].rotation * points[*j] + poses[*i].translation.vector;
            Some((self.cameras[*i].project(&y)? - pixel).norm_squared())
        })
    }

    /// `1/2 sum rho` at poses and points, in `f64`.
    pub fn cost(&self, poses: &[Pose<f64>], points: &[Vector3<f64>], loss: &Loss<f64>) -> f64 {
        self.squared_residuals(poses, points).flatten().map(|squared| 0.5 * loss.evaluate(squared).0).sum()
    }

    /// The ray of an observation in the world: the camera's centre and a unit direction.
    pub fn ray(&self, o: &(usize, usize, Vector2<f64>)) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let bearing = self.cameras[o.0].unproject(&o.2).ok()?;
        let pose = &self.poses[o.0];
        Some((centre(pose), pose.rotation.inverse() * bearing))
    }

    /// As many frames and points as fit: the two frames that share most points, then always the frame that shares most
    /// points with those chosen; of their points those seen by most of them. Of each point all observations in the
    /// chosen frames, as long as there is room.
    pub fn choose(&self, frames: usize, points: usize, observations: usize) -> Self {
        let mut sees = vec![vec![false; self.points.len()]; self.poses.len()];
        for o in &self.observations {
            sees[o.0][o.1] = true;
        }
        let shared = |a: &[bool], b: &[bool]| a.iter().zip(b).filter(|(a, b)| **a && **b).count();
        let pairs = (0..sees.len()).flat_map(|a| (0..a).map(move |b| (b, a)));
        let Some((a, b)) = pairs.max_by_key(|&(a, b)| shared(&sees[a], &sees[b])) else {
            return self.clone();
        };
        let mut chosen = vec![a, b];
        let mut union: Vec<bool> = sees[a].iter().zip(&sees[b]).map(|(a, b)| *a || *b).collect();
        while chosen.len() < frames.min(self.poses.len()) {
            let rest = (0..sees.len()).filter(|i| !chosen.contains(i));
            let Some(next) = rest.max_by_key(|&i| shared(&sees[i], &union)) else { break };
            chosen.push(next);
            union.iter_mut().zip(&sees[next]).for_each(|(u, s)| *u |= s);
        }
        let seen_by = |j: usize| chosen.iter().filter(|&&i| sees[i][j]).count();
        let mut best: Vec<usize> = (0..self.points.len()).filter(|&j| seen_by(j) >= 2).collect();
        best.sort_by_key(|&j| (std::cmp::Reverse(seen_by(j)), j));
        let mut left = observations;
        best.truncate(points);
        best.retain(|&j| {
            let fits = seen_by(j) <= left;
            left -= if fits { seen_by(j) } else { 0 };
            fits
        });
        let pick = |poses: &[Pose<f64>]| chosen.iter().filter_map(|&i| poses.get(i).copied()).collect();
        let new_frame = |i: usize| chosen.iter().position(|&c| c == i);
        let mut new_point = vec![None; self.points.len()];
        best.iter().enumerate().for_each(|(new, &old)| new_point[old] = Some(new));
        let mut observations: Vec<_> =
            self.observations.iter().filter_map(|o| Some((new_frame(o.0)?, new_point[o.1]?, o.2))).collect();
        observations.sort_by_key(|o| (o.1, o.0));
        Self {
            cameras: chosen.iter().map(|&i| self.cameras[i]).collect(),
            poses: pick(&self.poses),
            true_poses: pick(&self.true_poses),
            points: best.iter().map(|&j| self.points[j]).collect(),
            true_points: best.iter().filter_map(|&j| self.true_points.get(j).copied()).collect(),
            observations,
            fixed: self.fixed,
        }
    }
}

/// The pinhole camera `fx fy cx cy`.
pub fn pinhole([fx, fy, cx, cy]: [f64; 4]) -> Result<Camera<f64>, CameraError> {
    Ok(Pinhole::new(fx, fy, cx, cy)?.into())
}

/// A camera of another scalar.
pub fn cast_camera<T: Real>(camera: &Camera<f64>) -> Result<Camera<T>, CameraError> {
    let p = camera.pinhole();
    let pinhole = Pinhole::new(lit(p.fx()), lit(p.fy()), lit(p.cx()), lit(p.cy()))?;
    Ok(match camera {
        Camera::BrownConrady(c) => BrownConrady::new(pinhole, c.distortion().map(lit))?.into(),
        Camera::KannalaBrandt(c) => KannalaBrandt::new(pinhole, c.coefficients().map(lit))?.into(),
        _ => pinhole.into(),
    })
}

/// A pose of another scalar.
pub fn cast_pose<A: Real, B: Real>(pose: &Pose<A>) -> Pose<B> {
    let c = |x: A| lit::<B>(x.to_f64());
    let rotation = UnitQuaternion::new_unchecked(pose.rotation.coords.map(c).into());
    Pose::from_parts(pose.translation.vector.map(c).into(), rotation)
}

/// The camera's centre in the world.
pub fn centre(pose: &Pose<f64>) -> Vector3<f64> {
    -(pose.rotation.inverse() * pose.translation.vector)
}

/// The point nearest to rays `(origin, unit direction)`; none where they are parallel.
pub fn nearest_to_rays(rays: &[(Vector3<f64>, Vector3<f64>)]) -> Option<Vector3<f64>> {
    let (mut a, mut b) = (Matrix3::zeros(), Vector3::zeros());
    for (origin, d) in rays {
        let across = Matrix3::identity() - d * d.transpose();
        a += across;
        b += across * origin;
    }
    let x = a.try_inverse()? * b;
    x.iter().all(|x| x.is_finite()).then_some(x)
}

/// Poses and points of a window, by handle.
pub fn read_back<T: Real>(
    window: &Window<'_, T>,
    frames: &[FrameHandle],
    points: &[PointHandle],
) -> (Vec<Pose<f64>>, Vec<Vector3<f64>>) {
    (
        frames.iter().map(|f| cast_pose(&window.pose(*f).expect("live"))).collect(),
        points.iter().map(|p| window.position(*p).expect("live").map(|x| x.to_f64())).collect(),
    )
}
