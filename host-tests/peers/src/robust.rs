//! Robust estimators: pixels in, a model and the number of inliers out; a negative number where there is none.

use std::cell::RefCell;
use std::slice::from_raw_parts;

use epipole::Real;
use epipole::estimate::{
    FundamentalOptions, HomographyOptions, RelativePoseEstimate, RelativePoseOptions, RelativePoseVerdict,
    TwoViewWorkspace, fundamental, homography, relative_pose_guided,
};
use epipole::geometry::{Pinhole, Pose};
use epipole::nalgebra::Vector2;
use epipole::robust::Guide;

/// Memory kept between calls, as a caller would.
struct Memory<T> {
    x1: Vec<Vector2<T>>,
    x2: Vec<Vector2<T>>,
    numbers: Vec<T>,
    order: Vec<u32>,
    inliers: Vec<bool>,
}

impl<T: Real> Memory<T> {
    const fn new() -> Self {
        Self { x1: Vec::new(), x2: Vec::new(), numbers: Vec::new(), order: Vec::new(), inliers: Vec::new() }
    }

    /// Copies the caller's pixels and makes room for as many correspondences.
    fn load(&mut self, x1: &[T], x2: &[T]) {
        let points = |from: &[T], to: &mut Vec<Vector2<T>>| {
            to.clear();
            to.extend(from.chunks_exact(2).map(|p| Vector2::new(p[0], p[1])));
        };
        points(x1, &mut self.x1);
        points(x2, &mut self.x2);
        let capacity = self.x1.len().next_multiple_of(4);
        if self.order.len() < capacity {
            self.numbers.resize(4 * capacity, T::ZERO);
            self.order.resize(capacity, 0);
            self.inliers.resize(capacity, false);
        }
    }
}

thread_local! {
    static MEMORY_F32: RefCell<Memory<f32>> = const { RefCell::new(Memory::new()) };
    static MEMORY_F64: RefCell<Memory<f64>> = const { RefCell::new(Memory::new()) };
}

/// Threshold, confidence, iterations and seed of a call.
struct Call<T> {
    max_error_px: T,
    confidence: T,
    max_iterations: i32,
    seed: u64,
}

fn relative_pose<T: Real>(
    memory: &mut Memory<T>,
    x1: &[T],
    x2: &[T],
    k: &[T],
    call: &Call<T>,
    scores: Option<&[T]>,
) -> Option<RelativePoseEstimate<T>> {
    memory.load(x1, x2);
    let camera = Pinhole::new(k[0], k[1], k[2], k[3]).ok()?;
    let mut options = RelativePoseOptions::default();
    options.max_error_px = call.max_error_px;
    options.ransac.confidence = call.confidence;
    options.ransac.seed = call.seed;
    options.ransac.budget.max_iterations = call.max_iterations.max(1) as u32;
    let mut workspace =
        TwoViewWorkspace::from_slices(&mut memory.numbers, &mut memory.order, &mut memory.inliers);
    let mut guide = Guide::none();
    guide.scores = scores;
    relative_pose_guided(&camera, &camera, &memory.x1, &memory.x2, &options, guide, &mut workspace).ok()
}

/// R row-major, then t.
fn write_pose<T: Real>(pose: &Pose<T>, out: &mut [T]) {
    let rotation = pose.rotation.to_rotation_matrix().into_inner().transpose();
    for (o, v) in out.iter_mut().zip(rotation.iter().chain(pose.translation.vector.iter())) {
        *o = *v;
    }
}

macro_rules! relative_pose_symbols {
    ($t:ty, $memory:ident, $plain:ident, $scored:ident, $verdict:ident) => {
        /// # Safety
        /// The arrays have the lengths that the comparison programs state.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $plain(
            x1: *const $t,
            x2: *const $t,
            n: i32,
            k: *const $t,
            threshold: $t,
            confidence: $t,
            max_iterations: i32,
            seed: u64,
            out: *mut $t,
        ) -> i32 {
            unsafe {
                $scored(x1, x2, n, k, threshold, confidence, max_iterations, seed, out, std::ptr::null())
            }
        }

        /// # Safety
        /// The arrays have the lengths that the comparison programs state; the scores may be absent.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $scored(
            x1: *const $t,
            x2: *const $t,
            n: i32,
            k: *const $t,
            threshold: $t,
            confidence: $t,
            max_iterations: i32,
            seed: u64,
            out: *mut $t,
            scores: *const $t,
        ) -> i32 {
            let count = n as usize;
            let (x1, x2, k, out, scores) = unsafe {
                (
                    from_raw_parts(x1, 2 * count),
                    from_raw_parts(x2, 2 * count),
                    from_raw_parts(k, 4),
                    std::slice::from_raw_parts_mut(out, 12),
                    (!scores.is_null()).then(|| from_raw_parts(scores, count)),
                )
            };
            let call = Call { max_error_px: threshold, confidence, max_iterations, seed };
            let estimate = $memory.with_borrow_mut(|memory| relative_pose(memory, x1, x2, k, &call, scores));
            match estimate {
                Some(estimate) => match estimate.pose() {
                    Some(pose) => {
                        write_pose(&pose, out);
                        estimate.report.inliers as i32
                    }
                    None => -1,
                },
                None => -2,
            }
        }

        /// # Safety
        /// The arrays have the lengths that the comparison programs state.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $verdict(
            x1: *const $t,
            x2: *const $t,
            n: i32,
            k: *const $t,
            threshold: $t,
            confidence: $t,
            max_iterations: i32,
            seed: u64,
            out: *mut $t,
        ) -> i32 {
            let count = n as usize;
            let (x1, x2, k, out) = unsafe {
                (
                    from_raw_parts(x1, 2 * count),
                    from_raw_parts(x2, 2 * count),
                    from_raw_parts(k, 4),
                    std::slice::from_raw_parts_mut(out, 24),
                )
            };
            let call = Call { max_error_px: threshold, confidence, max_iterations, seed };
            let estimate = $memory.with_borrow_mut(|memory| relative_pose(memory, x1, x2, k, &call, None));
            match estimate.map(|estimate| estimate.verdict) {
                Some(RelativePoseVerdict::General(motion)) => {
                    write_pose(&motion.pose, out);
                    0
                }
                Some(RelativePoseVerdict::Planar(poses)) => {
                    // One pose where the other twin is not visible: it stands for both.
                    for (half, pose) in out.chunks_exact_mut(12).zip(poses.iter().cycle()) {
                        write_pose(&pose.pose, half);
                    }
                    1
                }
                Some(RelativePoseVerdict::PureRotation(_)) => 2,
                Some(RelativePoseVerdict::NoMotion) => 3,
                Some(_) => 4,
                None => -1,
            }
        }
    };
}

relative_pose_symbols!(
    f64,
    MEMORY_F64,
    bench_ransac_relpose_f64,
    bench_ransac_relpose_scores_f64,
    bench_verdict_relpose_f64
);
relative_pose_symbols!(
    f32,
    MEMORY_F32,
    bench_ransac_relpose_f32,
    bench_ransac_relpose_scores_f32,
    bench_verdict_relpose_f32
);

macro_rules! matrix_symbol {
    ($t:ty, $memory:ident, $name:ident, $estimate:ident, $options:ident, $matrix:ident) => {
        /// # Safety
        /// The arrays have the lengths that the comparison programs state; the calibration is not read.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(
            x1: *const $t,
            x2: *const $t,
            n: i32,
            _k: *const $t,
            threshold: $t,
            confidence: $t,
            max_iterations: i32,
            seed: u64,
            out: *mut $t,
        ) -> i32 {
            let count = n as usize;
            let (x1, x2, out) = unsafe {
                (
                    from_raw_parts(x1, 2 * count),
                    from_raw_parts(x2, 2 * count),
                    std::slice::from_raw_parts_mut(out, 9),
                )
            };
            $memory.with_borrow_mut(|memory| {
                memory.load(x1, x2);
                let mut options = $options::default();
                options.max_error_px = threshold;
                options.ransac.confidence = confidence;
                options.ransac.seed = seed;
                options.ransac.budget.max_iterations = max_iterations.max(1) as u32;
                let mut workspace = TwoViewWorkspace::from_slices(
                    &mut memory.numbers,
                    &mut memory.order,
                    &mut memory.inliers,
                );
                let Ok(estimate) = $estimate(&memory.x1, &memory.x2, &options, &mut workspace) else {
                    return -2;
                };
                let Some(matrix) = estimate.$matrix() else { return -1 };
                for (o, v) in out.iter_mut().zip(matrix.0.transpose().iter()) {
                    *o = *v;
                }
                estimate.report.inliers as i32
            })
        }
    };
}

matrix_symbol!(f64, MEMORY_F64, bench_ransac_homography_f64, homography, HomographyOptions, homography);
matrix_symbol!(f32, MEMORY_F32, bench_ransac_homography_f32, homography, HomographyOptions, homography);
matrix_symbol!(f64, MEMORY_F64, bench_ransac_fundamental_f64, fundamental, FundamentalOptions, fundamental);
matrix_symbol!(f32, MEMORY_F32, bench_ransac_fundamental_f32, fundamental, FundamentalOptions, fundamental);
