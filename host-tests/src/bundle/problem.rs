//! Bundle problems in memory, and the text formats they come in.

use std::path::Path;

use epipole::Real;
use epipole::bundle::{
    BundleError, BundleOptions, BundleReport, FrameHandle, PointHandle, Window, WindowError,
};
use epipole::geometry::{Camera, Pinhole, Pose, pose};
use epipole::nalgebra::{Matrix3, Vector2, Vector3};
use epipole::real::lit;
use epipole::robust::loss::Loss;

/// Frames, points and observations in `f64`.
#[derive(Clone, Debug, Default)]
pub struct Problem {
    /// One camera a frame.
    pub cameras: Vec<Pinhole64>,
    /// Poses to start from.
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

/// `fx fy cx cy`.
pub type Pinhole64 = [f64; 4];

impl Problem {
    /// The format of the harness's `gen.py`: header `P L M huber`, poses (R, t), points, observations in normalised
    /// coordinates, the truth. The focal length is 718, the first two poses are fixed.
    pub fn read_harness(path: &Path) -> std::io::Result<Self> {
        let text = std::fs::read_to_string(path)?;
        let mut numbers = text.split_ascii_whitespace().map(|w| w.parse::<f64>().expect("a number"));
        let mut next = || numbers.next().expect("a complete file");
        let (p, l, m) = (next() as usize, next() as usize, next() as usize);
        next();
        let pose = |next: &mut dyn FnMut() -> f64| {
            let r = Matrix3::from_row_iterator((0..9).map(|_| next()));
            let t = Vector3::from_iterator((0..3).map(|_| next()));
            pose::from_parts(&r, &t)
        };
        let point = |next: &mut dyn FnMut() -> f64| Vector3::from_iterator((0..3).map(|_| next()));
        let poses = (0..p).map(|_| pose(&mut next)).collect();
        let points = (0..l).map(|_| point(&mut next)).collect();
        let observations = (0..m)
            .map(|_| {
                let (i, j) = (next() as usize, next() as usize);
                (i, j, Vector2::new(718.0 * next(), 718.0 * next()))
            })
            .collect();
        let true_poses = (0..p).map(|_| pose(&mut next)).collect();
        let true_points = (0..l).map(|_| point(&mut next)).collect();
        let cameras = vec![[718.0, 718.0, 0.0, 0.0]; p];
        Ok(Self { cameras, poses, points, observations, true_poses, true_points, fixed: 2 })
    }

    /// Fills an empty window, each observation with one pixel of noise.
    pub fn fill<T: Real>(
        &self,
        window: &mut Window<'_, T>,
    ) -> Result<(Vec<FrameHandle>, Vec<PointHandle>), WindowError> {
        let c = lit::<T>;
        let mut frames = Vec::with_capacity(self.poses.len());
        for (i, (pose, k)) in self.poses.iter().zip(&self.cameras).enumerate() {
            let camera: Camera<T> =
                Pinhole::new(c(k[0]), c(k[1]), c(k[2]), c(k[3])).expect("a camera").into();
            let frame = window.add_frame(camera, &cast_pose(pose))?;
            window.fix_frame(frame, i < self.fixed)?;
            frames.push(frame);
        }
        let mut points = Vec::with_capacity(self.points.len());
        for x in &self.points {
            points.push(window.add_point(&x.map(c))?);
        }
        for (i, j, pixel) in &self.observations {
            window.add_observation(frames[*i], points[*j], &pixel.map(c), T::ONE)?;
        }
        Ok((frames, points))
    }

    /// `1/2 sum rho` at poses and points, in `f64`.
    pub fn cost(&self, poses: &[Pose<f64>], points: &[Vector3<f64>], loss: &Loss<f64>) -> f64 {
        let mut sum = 0.0;
        for (i, j, pixel) in &self.observations {
            let y = poses[*i].rotation * points[*j] + poses[*i].translation.vector;
            let k = self.cameras[*i];
            let r = Vector2::new(k[0] * y.x / y.z + k[2], k[1] * y.y / y.z + k[3]) - pixel;
            sum += 0.5 * loss.evaluate(r.norm_squared()).0;
        }
        sum
    }
}

/// A pose of another scalar.
pub fn cast_pose<A: Real, B: Real>(pose: &Pose<A>) -> Pose<B> {
    let c = |x: A| lit::<B>(x.to_f64());
    let q = pose.rotation.coords.map(c);
    let rotation = epipole::nalgebra::UnitQuaternion::new_unchecked(q.into());
    Pose::from_parts(pose.translation.vector.map(c).into(), rotation)
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

/// Optimises and returns the report: a shorthand for measurements.
pub fn optimise<T: Real>(
    window: &mut Window<'_, T>,
    options: &BundleOptions<T>,
) -> Result<BundleReport<T>, BundleError> {
    window.optimise(options)
}
