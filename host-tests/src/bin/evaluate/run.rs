//! Runs an estimator on a file and judges its answer.

use std::fmt::{Debug, Display};
use std::time::{Duration, Instant};

use epipole::Real;
use epipole::estimate::{
    self, FundamentalOptions, HomographyOptions, HomographyVerdict, RelativePoseEstimate,
    RelativePoseOptions, RelativePoseVerdict, TwoViewWorkspace,
};
use epipole::geometry::{CameraModel, Essential, Fundamental, Pinhole, Pose};
use epipole::nalgebra::{Matrix3, SMatrix, Vector2, Vector3};
use epipole::real::lit;
use epipole::robust::{Guide, Progress, RansacOptions, RansacReport};

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
    /// After it no sample is drawn any more.
    pub(crate) time_budget: Option<Duration>,
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

/// Errors of an answer and its spread, or why there is none.
type Judged = Result<([f64; 2], f64), String>;

/// The doubt of an answer: its spread over the square of the share of inliers, since a wrong model's few inliers can
/// agree very well, and over what no rival explains, since a right model has no equal.
pub(crate) fn doubt<T: Real>(spread: f64, report: &RansacReport<T>, count: usize) -> f64 {
    let share = f64::from(report.inliers) / count as f64;
    spread / (share * share * (1.02 - report.rival_share.to_f64()))
}

/// The root of a covariance's trace; infinite without one.
pub(crate) fn spread<T: Real, const N: usize>(covariance: Option<SMatrix<T, N, N>>) -> f64 {
    covariance.map_or(f64::INFINITY, |c| (0..N).map(|i| c[(i, i)].to_f64()).sum::<f64>().sqrt())
}

/// A plane's two poses explain the image alike: a radian comes on top.
fn spread_of_pose<T: Real>(found: &RelativePoseEstimate<T>) -> f64 {
    match &found.verdict {
        RelativePoseVerdict::General(motion) => spread(motion.covariance),
        RelativePoseVerdict::Planar(poses) => {
            1.0 + poses.first().map_or(f64::INFINITY, |p| spread(p.covariance))
        }
        _ => f64::INFINITY,
    }
}

/// Times an estimation; then its answer and the inlier mask are judged.
fn judge<T: Real, A, E: Display>(
    count: usize,
    settings: &Settings,
    call: impl FnOnce(Guide<'_, T>, &mut TwoViewWorkspace<'_, T>) -> Result<A, E>,
    read: impl FnOnce(&A, &[bool]) -> (RansacReport<T>, Judged),
) -> Outcome {
    let mut memory = Memory::new(count);
    let mut workspace = memory.workspace();
    let start = Instant::now();
    let mut keep_going = settings.keep_going(start);
    let guide = Guide { scores: None, keep_going: Some(&mut keep_going) };
    let answer = call(guide, &mut workspace);
    let milliseconds = 1e3 * start.elapsed().as_secs_f64();
    let (report, errors) = match answer {
        Ok(answer) => {
            let (report, errors) = read(&answer, workspace.inliers());
            (Some(report), errors)
        }
        Err(error) => (None, Err(error.to_string())),
    };
    let (found, spread) = *errors.as_ref().unwrap_or(&([REFUSED; 2], f64::INFINITY));
    Outcome {
        errors: found,
        doubt: report.map_or(f64::INFINITY, |report| doubt(spread, &report, count)),
        correspondences: count,
        inliers: report.map_or(0, |report| report.inliers),
        iterations: report.map_or(0, |report| report.spent.iterations),
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
        settings,
        |guide, workspace| {
            estimate::relative_pose_guided(&camera1, &camera2, x1, x2, &options, guide, workspace)
        },
        |found, _| {
            let errors = found.pose().map(|pose| (pose_errors(&pose, truth), spread_of_pose(found)));
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
        settings,
        |guide, workspace| estimate::fundamental_guided(x1, x2, &options, guide, workspace),
        |found, inliers| {
            let chosen = found.fundamental().and_then(|f| pose(&f, inliers));
            // There is no covariance of F: the inliers alone tell.
            let errors = chosen.map(|chosen| (pose_errors(&chosen.pose, truth), 1.0));
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
        settings,
        |guide, workspace| estimate::homography_guided(x1, x2, &options, guide, workspace),
        |found, _| {
            let errors = match &found.verdict {
                HomographyVerdict::Found(found) => {
                    let error = transfer_error_px(truth, &matrix(&found.homography.0), size);
                    Some(([error; 2], spread(found.covariance)))
                }
                _ => None,
            };
            (found.report, errors.ok_or_else(|| name(&found.verdict)))
        },
    )
}

impl Settings {
    /// "May I go on?" of a run that began at `start`.
    pub(crate) fn keep_going(&self, start: Instant) -> impl FnMut(&Progress) -> bool {
        let budget = self.time_budget;
        move |_| budget.is_none_or(|budget| start.elapsed() < budget)
    }

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
