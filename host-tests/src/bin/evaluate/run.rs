//! Runs an estimator on a file and judges its answer.

use std::fmt::{Debug, Display};
use std::time::Instant;

use epipole::Real;
use epipole::estimate::{self, FundamentalOptions, HomographyOptions, RelativePoseOptions, TwoViewWorkspace};
use epipole::geometry::{CameraModel, Essential, Fundamental, Pinhole, Pose};
use epipole::nalgebra::{Matrix3, Vector2, Vector3};
use epipole::real::lit;
use epipole::robust::{RansacOptions, RansacReport};

use crate::file::{Correspondence, CorrespondenceFile, Problem, TruePose, Truth};
use crate::score::{Outcome, REFUSED, direction_error_deg, rotation_error_deg, transfer_error_px};

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
    match (&file.truth, problem) {
        (Truth::Homography(truth), _) => homography(truth, file, &x1, &x2, settings),
        (Truth::Pose(truth), Problem::Fundamental) => {
            fundamental(truth, &x1, &x2, default_threshold(file), settings)
        }
        (Truth::Pose(truth), _) => relative_pose(truth, &x1, &x2, default_threshold(file), settings),
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
pub(crate) fn next_random(state: &mut u64) -> u64 {
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

pub(crate) fn pinhole<T: Real>([fx, fy, cx, cy]: [f64; 4]) -> Pinhole<T> {
    Pinhole::new(lit(fx), lit(fy), lit(cx), lit(cy)).expect("the reader checked the intrinsics")
}

fn matrix<T: Real>(m: &Matrix3<T>) -> Matrix3<f64> {
    m.map(|x| x.to_f64())
}

/// Rotation and direction errors of a pose in degrees.
fn pose_errors<T: Real>(pose: &Pose<T>, truth: &TruePose) -> [f64; 2] {
    let found = matrix(pose.rotation.to_rotation_matrix().matrix());
    let t = pose.translation.vector.map(|x| x.to_f64());
    [rotation_error_deg(&found, &truth.rotation), direction_error_deg(&t, &truth.translation)]
}

/// Errors of an answer, or why there is none.
type Judged = Result<[f64; 2], String>;

/// Times an estimation; then its answer and the inlier mask are judged.
fn judge<T: Real, A, E: Display>(
    count: usize,
    call: impl FnOnce(&mut TwoViewWorkspace<'_, T>) -> Result<A, E>,
    read: impl FnOnce(&A, &[bool]) -> (RansacReport<T>, Judged),
) -> Outcome {
    let mut memory = Memory::new(count);
    let mut workspace = memory.workspace();
    let start = Instant::now();
    let answer = call(&mut workspace);
    let milliseconds = 1e3 * start.elapsed().as_secs_f64();
    let (inliers, iterations, errors) = match answer {
        Ok(answer) => {
            let (report, errors) = read(&answer, workspace.inliers());
            (report.inliers, report.spent.iterations, errors)
        }
        Err(error) => (0, 0, Err(error.to_string())),
    };
    Outcome {
        errors: *errors.as_ref().unwrap_or(&[REFUSED; 2]),
        correspondences: count,
        inliers,
        iterations,
        milliseconds,
        refusal: errors.err().unwrap_or_default(),
    }
}

/// The name of a verdict, without what it carries.
pub(crate) fn name(verdict: &impl Debug) -> String {
    let text = format!("{verdict:?}");
    text.split(['(', '{', ' ']).next().unwrap_or_default().into()
}

fn relative_pose<T: Real>(
    truth: &TruePose,
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    default_threshold: f64,
    settings: &Settings,
) -> Outcome {
    let [camera1, camera2] = truth.intrinsics.map(pinhole::<T>);
    let mut options = RelativePoseOptions::default();
    options.max_error_px = lit(settings.threshold_px.unwrap_or(default_threshold));
    settings.apply(&mut options.ransac);
    judge(
        x1.len(),
        |workspace| estimate::relative_pose(&camera1, &camera2, x1, x2, &options, workspace),
        |found, _| {
            let errors = found.pose().map(|pose| pose_errors(&pose, truth));
            (found.report, errors.ok_or_else(|| name(&found.verdict)))
        },
    )
}

/// The pose that follows from F by the intrinsics and the inliers' cheirality, because one cannot see in a matrix how
/// wrong it is.
fn fundamental<T: Real>(
    truth: &TruePose,
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    default_threshold: f64,
    settings: &Settings,
) -> Outcome {
    let cameras = truth.intrinsics.map(pinhole::<T>);
    let mut options = FundamentalOptions::default();
    options.max_error_px = lit(settings.threshold_px.unwrap_or(default_threshold));
    settings.apply(&mut options.ransac);
    let pose = |f: &Fundamental<T>, inliers: &[bool]| {
        let bearings = |camera: &Pinhole<T>, x: &[Vector2<T>]| -> Vec<Vector3<T>> {
            let kept = x.iter().zip(inliers).filter(|(_, inlier)| **inlier);
            kept.filter_map(|(x, _)| camera.unproject(x).ok()).collect()
        };
        let essential =
            Essential::from_fundamental(f, &cameras[0].matrix(), &cameras[1].matrix()).nearest()?;
        essential.pose_by_cheirality(&bearings(&cameras[0], x1), &bearings(&cameras[1], x2))
    };
    judge(
        x1.len(),
        |workspace| estimate::fundamental(x1, x2, &options, workspace),
        |found, inliers| {
            let chosen = found.fundamental().and_then(|f| pose(&f, inliers));
            let errors = chosen.map(|chosen| pose_errors(&chosen.pose, truth));
            (found.report, errors.ok_or_else(|| name(&found.verdict)))
        },
    )
}

fn homography<T: Real>(
    truth: &Matrix3<f64>,
    file: &CorrespondenceFile,
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    settings: &Settings,
) -> Outcome {
    let mut options = HomographyOptions::default();
    if let Some(threshold) = settings.threshold_px {
        options.max_error_px = lit(threshold);
    }
    settings.apply(&mut options.ransac);
    // A file that does not tell the size of its image: as far as its correspondences reach.
    let reach = |axis: usize| file.correspondences.iter().map(|c| c.x1[axis] + 1.0).fold(1.0, f64::max);
    let size = file.size.unwrap_or_else(|| [reach(0), reach(1)]);
    judge(
        x1.len(),
        |workspace| estimate::homography(x1, x2, &options, workspace),
        |found, _| {
            let errors = found.homography().map(|h| [transfer_error_px(truth, &matrix(&h.0), size); 2]);
            (found.report, errors.ok_or_else(|| name(&found.verdict)))
        },
    )
}

impl Settings {
    pub(crate) fn apply<T: Real>(&self, options: &mut RansacOptions<T>) {
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
