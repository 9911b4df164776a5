//! A sliding window run over a flight, frame after frame.

use std::collections::{HashMap, VecDeque};

use epipole::Real;
use epipole::bundle::{BundleOptions, FrameHandle, PointHandle, Window};
use epipole::geometry::{Camera, Pinhole, Pose};
use epipole::nalgebra::{Vector2, Vector3, Vector6};
use epipole::real::lit;
use epipole::robust::loss::Loss;

use super::HeapWindow;
use super::flight::{CAMERA, Flight, centre};
use super::problem::cast_pose;
use crate::Rng;

/// What makes room for a new frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Leaving {
    /// The oldest frame is marginalised.
    Oldest,
    /// The oldest frame and one from the middle are marginalised by turns, so that the window reaches twice as far back.
    Alternate,
    /// The oldest frame is removed, and the next oldest two are fixed where they are.
    Forget,
    /// None leaves: full bundle adjustment.
    Keep,
}

/// A window that follows a flight. The first two frames are given (they fix the gauge and the scale).
pub struct Odometer<T: Real> {
    memory: HeapWindow<T>,
    capacity: usize,
    leaving: Leaving,
    options: BundleOptions<T>,
    frames: VecDeque<(usize, FrameHandle)>,
    points: HashMap<usize, PointHandle>,
    waiting: HashMap<usize, Vec<(usize, Vector2<f64>)>>,
    /// Estimated poses so far, as they were when the frame was new.
    pub poses: Vec<Pose<f64>>,
    /// All is optimised with every so many frames, a new frame and its points alone in between.
    pub optimise_every: usize,
    /// Standard deviation of the distance between neighbouring frames, if it is measured.
    pub distance_sigma: Option<f64>,
}

impl<T: Real> Odometer<T> {
    /// A window of so many frames.
    pub fn new(capacity: usize, points: usize, leaving: Leaving) -> Self {
        Self {
            memory: HeapWindow::new(capacity, points, points * capacity.min(24)),
            capacity,
            leaving,
            options: BundleOptions { loss: Loss::Huber(lit(2.0)), ..BundleOptions::default() },
            frames: VecDeque::new(),
            points: HashMap::new(),
            waiting: HashMap::new(),
            poses: vec![],
            optimise_every: 1,
            distance_sigma: None,
        }
    }

    /// The window, and the handle of the newest frame.
    pub fn window(&mut self) -> (Window<'_, T>, FrameHandle) {
        let newest = self.frames.back().expect("a frame").1;
        (self.memory.window(), newest)
    }

    /// The poses of the frames that are in the window, by number.
    pub fn window_poses(&mut self) -> Vec<(usize, Pose<f64>)> {
        let window = self.memory.window();
        self.frames.iter().map(|(k, f)| (*k, cast_pose(&window.pose(*f).expect("live")))).collect()
    }

    /// The newest frame's error, squared and normalised by the covariance the window tells: six degrees of freedom. The
    /// error is the twist that leads from the estimate to the truth: where the heading is uncertain, positions spread
    /// along an arc, which is straight in a twist alone.
    pub fn normalised_error(&mut self, flight: &Flight) -> f64 {
        let k = self.poses.len() - 1;
        let (estimate, loss) = (self.poses[k], self.options.loss);
        let (mut window, newest) = self.window();
        let covariance = window.frame_covariance(newest, &loss).expect("an observable frame").motion;
        let e = twist(&(flight.poses[k] * estimate.inverse()));
        let covariance = covariance.map(|x| x.to_f64());
        let information = covariance.cholesky().expect("positive definite");
        e.dot(&information.solve(&e))
    }

    /// Takes the next frame of a flight in.
    pub fn step(&mut self, flight: &Flight, distance: Option<f64>) {
        let k = self.poses.len();
        let mut window = self.memory.window();
        if self.frames.len() == self.capacity {
            let middle = self.leaving == Leaving::Alternate && k % 2 == 1;
            let leaving = if middle { self.capacity / 2 } else { 0 };
            let (gone, handle) = self.frames.remove(leaving).expect("a full window");
            if self.leaving != Leaving::Forget {
                window.marginalise_frame(handle, &self.options.loss).expect("a live frame");
            } else {
                window.remove_frame(handle).expect("a live frame");
                for (_, f) in self.frames.iter().take(2) {
                    window.fix_frame(*f, true).expect("a live frame");
                }
            }
            self.points.retain(|_, p| window.position(*p).is_ok());
            for list in self.waiting.values_mut() {
                list.retain(|(f, _)| *f != gone);
            }
        }
        let c = CAMERA.map(lit::<T>);
        let camera: Camera<T> = Pinhole::new(c[0], c[1], c[2], c[3]).expect("a camera").into();
        let start = if k < 2 {
            flight.poses[k]
        } else {
            let [a, b] = [self.frames[self.frames.len() - 2], self.frames[self.frames.len() - 1]]
                .map(|(_, f)| cast_pose::<T, f64>(&window.pose(f).expect("live")));
            b * a.inverse() * b
        };
        let frame = window.add_frame(camera, &cast_pose(&start)).expect("room for a frame");
        window.fix_frame(frame, k < 2).expect("live");
        if let (Some(d), Some((_, last))) = (distance, self.frames.back())
            && let Some(sigma) = self.distance_sigma
            && k >= 2
        {
            window.set_distance(frame, *last, lit(d), lit(sigma)).expect("two frames");
        }
        self.frames.push_back((k, frame));
        let mut known = 0;
        for (track, pixel) in &flight.seen[k] {
            match self.points.get(track) {
                Some(point) => {
                    window.add_observation(frame, *point, &pixel.map(lit), T::ONE).expect("room");
                    known += 1;
                }
                None => self.waiting.entry(*track).or_default().push((k, *pixel)),
            }
        }
        if k >= 2 && known >= 6 {
            let _ = window.refine_frame(frame, &self.options);
        }
        // New points of tracks with enough parallax.
        let handle_of: HashMap<usize, FrameHandle> = self.frames.iter().copied().collect();
        for (track, _) in &flight.seen[k] {
            let Some(list) = self.waiting.get(track) else { continue };
            let (first, last) = (list[0], list[list.len() - 1]);
            if list.len() < 2 {
                continue;
            }
            let ray = |(f, pixel): (usize, Vector2<f64>)| {
                let pose: Pose<f64> = cast_pose(&window.pose(handle_of[&f]).expect("live"));
                let b =
                    Vector3::new((pixel.x - CAMERA[2]) / CAMERA[0], (pixel.y - CAMERA[3]) / CAMERA[1], 1.0);
                (centre(&pose), pose.rotation.inverse() * b.normalize())
            };
            let Some(x) = midpoint(ray(first), ray(last)) else { continue };
            let Ok(point) = window.add_point(&x.map(lit)) else { continue };
            for (f, pixel) in list {
                window
                    .add_observation(handle_of[f], point, &pixel.map(lit), T::ONE)
                    .expect("room for an observation");
            }
            let seen = window.point_report(point, lit(5.0)).expect("live");
            if seen.behind > 0 {
                window.remove_point(point).expect("live");
                continue;
            }
            self.points.insert(*track, point);
            self.waiting.remove(track);
        }
        if k >= 2 && (k + 1).is_multiple_of(self.optimise_every) {
            let _ = window.optimise(&self.options);
        }
        self.poses.push(cast_pose(&window.pose(frame).expect("live")));
        if self.leaving != Leaving::Keep {
            let now: std::collections::HashSet<usize> = flight.seen[k].iter().map(|s| s.0).collect();
            self.waiting.retain(|track, _| now.contains(track));
        }
    }
}

/// The point nearest to two rays, in front of both, with at least half a degree between them.
fn midpoint(a: (Vector3<f64>, Vector3<f64>), b: (Vector3<f64>, Vector3<f64>)) -> Option<Vector3<f64>> {
    let (d, cos) = (b.0 - a.0, a.1.dot(&b.1));
    let sin_sq = 1.0 - cos * cos;
    if sin_sq < 0.5f64.to_radians().powi(2) {
        return None;
    }
    let s = (d.dot(&a.1) - cos * d.dot(&b.1)) / sin_sq;
    let t = (cos * d.dot(&a.1) - d.dot(&b.1)) / sin_sq;
    (s > 0.5 && t > 0.5).then(|| (a.0 + a.1 * s + b.0 + b.1 * t) * 0.5)
}

/// The logarithm `(w, v)` of a pose.
fn twist(pose: &Pose<f64>) -> Vector6<f64> {
    let (w, t) = (pose.rotation.scaled_axis(), pose.translation.vector);
    let angle = w.norm();
    let bend = if angle < 1e-3 {
        1.0 / 12.0
    } else {
        (1.0 - angle * angle.sin() / (2.0 * (1.0 - angle.cos()))) / (angle * angle)
    };
    let v = t - w.cross(&t) * 0.5 + w.cross(&w.cross(&t)) * bend;
    Vector6::new(w.x, w.y, w.z, v.x, v.y, v.z)
}

/// Standard deviation of the distances that [`measured_flight`] measures between neighbouring frames.
const DISTANCE_SIGMA: f64 = 0.02;

/// Runs a window of 8 frames with measured distances over a flight with 1 px noise; `each` is called after every frame.
pub fn measured_flight<T: Real>(
    frames: usize,
    tracks: usize,
    seed: u64,
    mut each: impl FnMut(&mut Odometer<T>, &Flight, usize),
) -> (Odometer<T>, Flight) {
    let flight = Flight::new(frames, tracks, 1.0, seed);
    let mut odometer = Odometer::new(8, 4 * tracks, Leaving::Oldest);
    odometer.distance_sigma = Some(DISTANCE_SIGMA);
    let mut rng = Rng::new(seed + 1);
    for k in 0..frames {
        let step = if k > 0 { (flight.centre(k) - flight.centre(k - 1)).norm() } else { 1.0 };
        odometer.step(&flight, Some(step + DISTANCE_SIGMA * rng.normal()));
        each(&mut odometer, &flight, k);
    }
    (odometer, flight)
}

/// The normalised error squared of the last frame of a [`measured_flight`].
pub fn last_normalised_error<T: Real>(frames: usize, tracks: usize, seed: u64) -> f64 {
    let (mut odometer, flight) = measured_flight::<T>(frames, tracks, seed, |_, _, _| ());
    odometer.normalised_error(&flight)
}

/// Between which a chi-square variable lies in 95 of 100 cases, over its degrees of freedom (E. Wilson, M. Hilferty,
/// "The distribution of chi-square", PNAS 17(12), 1931).
pub fn chi_square_bounds(degrees: usize) -> [f64; 2] {
    let spread = 2.0 / (9.0 * degrees as f64);
    [-1.959964, 1.959964].map(|z| (1.0 - spread + z * spread.sqrt()).powi(3))
}
