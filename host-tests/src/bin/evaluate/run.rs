//! Runs an estimator on a file and judges its answer.

use std::time::Instant;

use epipole::Real;
use epipole::estimate::{self, RelativePoseOptions, TwoViewWorkspace};
use epipole::geometry::{Pinhole, Pose};
use epipole::nalgebra::{Matrix3, Vector2, Vector3};
use epipole::real::lit;
use epipole::robust::RansacOptions;

use crate::file::{Correspondence, CorrespondenceFile, Problem, Truth};
use crate::score::{Outcome, REFUSED, direction_error_deg, rotation_error_deg};

/// What the command line asks of every run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Settings {
    pub(crate) threshold_px: Option<f64>,
    pub(crate) confidence: Option<f64>,
    pub(crate) max_iterations: Option<u32>,
    pub(crate) max_correspondences: Option<usize>,
    pub(crate) seed: u64,
}

/// Judges the estimate of one file in one scalar.
pub(crate) fn run<T: Real>(problem: Problem, file: &CorrespondenceFile, settings: &Settings) -> Outcome {
    let chosen = select(&file.correspondences, settings.max_correspondences, settings.seed);
    let pixel = |p: &Vector2<f64>| Vector2::new(lit::<T>(p.x), lit::<T>(p.y));
    let x1: Vec<Vector2<T>> = chosen.iter().map(|c| pixel(&c.x1)).collect();
    let x2: Vec<Vector2<T>> = chosen.iter().map(|c| pixel(&c.x2)).collect();
    let Truth { intrinsics, rotation, translation } = &file.truth;
    match problem {
        Problem::RelativePose => {
            relative_pose(*intrinsics, (rotation, translation), &x1, &x2, default_threshold(file), settings)
        }
    }
}

/// The best `limit` correspondences by score, in a random order: a file is sorted, and an estimator must not profit.
fn select(all: &[Correspondence], limit: Option<usize>, seed: u64) -> Vec<Correspondence> {
    let mut chosen = all.to_vec();
    chosen.sort_by(|a, b| a.score.total_cmp(&b.score));
    chosen.truncate(limit.unwrap_or(usize::MAX));
    let mut state = seed;
    for i in (1..chosen.len()).rev() {
        chosen.swap(i, (next_random(&mut state) % (i as u64 + 1)) as usize);
    }
    chosen
}

/// SplitMix64 (Steele, Lea, Flood, OOPSLA 2014).
fn next_random(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The threshold where none is asked for: 1 px, or 2 px for images wider than 2000 pixels.
fn default_threshold(file: &CorrespondenceFile) -> f64 {
    if file.size.is_some_and(|[width, _]| width > 2000.0) { 2.0 } else { 1.0 }
}

fn refused(correspondences: usize, milliseconds: f64, refusal: String) -> Outcome {
    Outcome { errors: [REFUSED; 2], correspondences, inliers: 0, iterations: 0, milliseconds, refusal }
}

fn pinhole<T: Real>([fx, fy, cx, cy]: [f64; 4]) -> Pinhole<T> {
    Pinhole::new(lit(fx), lit(fy), lit(cx), lit(cy)).expect("the reader checked the intrinsics")
}

fn matrix<T: Real>(m: &Matrix3<T>) -> Matrix3<f64> {
    m.map(|x| x.to_f64())
}

/// Rotation and direction errors of a pose in degrees.
fn pose_errors<T: Real>(pose: &Pose<T>, (rotation, translation): (&Matrix3<f64>, &Vector3<f64>)) -> [f64; 2] {
    let found = matrix(pose.rotation.to_rotation_matrix().matrix());
    let t = pose.translation.vector.map(|x| x.to_f64());
    [rotation_error_deg(&found, rotation), direction_error_deg(&t, translation)]
}

fn relative_pose<T: Real>(
    intrinsics: [[f64; 4]; 2],
    truth: (&Matrix3<f64>, &Vector3<f64>),
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    default_threshold: f64,
    settings: &Settings,
) -> Outcome {
    let [camera1, camera2] = intrinsics.map(pinhole::<T>);
    let mut options = RelativePoseOptions::default();
    options.max_error_px = lit(settings.threshold_px.unwrap_or(default_threshold));
    settings.apply(&mut options.ransac);
    let mut memory = Memory::new(x1.len());
    let mut workspace = memory.workspace();
    let start = Instant::now();
    let answer = estimate::relative_pose(&camera1, &camera2, x1, x2, &options, &mut workspace);
    let milliseconds = 1e3 * start.elapsed().as_secs_f64();
    match answer {
        Err(error) => refused(x1.len(), milliseconds, error.to_string()),
        Ok(estimate) => {
            let report = &estimate.report;
            let (errors, refusal) = match estimate.pose() {
                Some(pose) => (pose_errors(&pose, truth), String::new()),
                None => ([REFUSED; 2], format!("{:?}", estimate.verdict)),
            };
            Outcome {
                errors,
                correspondences: x1.len(),
                inliers: report.inliers as usize,
                iterations: report.spent.iterations.into(),
                milliseconds,
                refusal,
            }
        }
    }
}

impl Settings {
    fn apply<T: Real>(&self, options: &mut RansacOptions<T>) {
        options.seed = self.seed;
        if let Some(confidence) = self.confidence {
            options.confidence = lit(confidence);
        }
        if let Some(n) = self.max_iterations {
            options.budget.max_iterations = n;
        }
    }
}

/// Memory of an estimation of any number of correspondences.
struct Memory<T> {
    numbers: Vec<T>,
    order: Vec<u32>,
    inliers: Vec<bool>,
}

impl<T: Real> Memory<T> {
    fn new(count: usize) -> Self {
        let count = count.next_multiple_of(4);
        Self { numbers: vec![T::ZERO; 4 * count], order: vec![0; count], inliers: vec![false; count] }
    }

    fn workspace(&mut self) -> TwoViewWorkspace<'_, T> {
        TwoViewWorkspace::from_slices(&mut self.numbers, &mut self.order, &mut self.inliers)
    }
}
