//! Robust absolute pose: `bench_ransac_abspose_*` takes pixels and world points, writes R row-major and t, and returns
//! the number of inliers; a negative number where there is no pose.

use std::cell::RefCell;
use std::slice::{from_raw_parts, from_raw_parts_mut};

use epipole::Real;
use epipole::estimate::{AbsolutePoseOptions, AbsolutePoseWorkspace, absolute_pose};
use epipole::geometry::{Pinhole, Pose};
use epipole::nalgebra::{Vector2, Vector3};

/// Memory kept between calls, as a caller would.
struct Memory<T> {
    pixels: Vec<Vector2<T>>,
    points: Vec<Vector3<T>>,
    numbers: Vec<T>,
    order: Vec<u32>,
    inliers: Vec<bool>,
}

impl<T: Real> Memory<T> {
    const fn new() -> Self {
        Self {
            pixels: Vec::new(),
            points: Vec::new(),
            numbers: Vec::new(),
            order: Vec::new(),
            inliers: Vec::new(),
        }
    }

    fn pose(
        &mut self,
        pixels: &[T],
        points: &[T],
        k: &[T],
        options: &AbsolutePoseOptions<T>,
    ) -> Option<(Pose<T>, u32)> {
        self.pixels.clear();
        self.pixels.extend(pixels.chunks_exact(2).map(|p| Vector2::new(p[0], p[1])));
        self.points.clear();
        self.points.extend(points.chunks_exact(3).map(|p| Vector3::new(p[0], p[1], p[2])));
        let capacity = self.pixels.len().next_multiple_of(4);
        if self.order.len() < capacity {
            self.numbers.resize(5 * capacity, T::ZERO);
            self.order.resize(capacity, 0);
            self.inliers.resize(capacity, false);
        }
        let camera = Pinhole::new(k[0], k[1], k[2], k[3]).ok()?;
        let mut workspace =
            AbsolutePoseWorkspace::from_slices(&mut self.numbers, &mut self.order, &mut self.inliers);
        let estimate = absolute_pose(&camera, &self.pixels, &self.points, options, &mut workspace).ok()?;
        Some((estimate.pose()?, estimate.report.inliers))
    }
}

macro_rules! export {
    ($t:ty, $name:ident, $memory:ident) => {
        thread_local! {
            static $memory: RefCell<Memory<$t>> = const { RefCell::new(Memory::new()) };
        }

        /// # Safety
        /// The arrays have the lengths that the comparison programs state.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(
            pixels: *const $t,
            points: *const $t,
            n: i32,
            k: *const $t,
            threshold: $t,
            confidence: $t,
            max_iterations: i32,
            seed: u64,
            out: *mut $t,
        ) -> i32 {
            let count = n as usize;
            // SAFETY: as the caller promises.
            let (pixels, points, k, out) = unsafe {
                (
                    from_raw_parts(pixels, 2 * count),
                    from_raw_parts(points, 3 * count),
                    from_raw_parts(k, 4),
                    from_raw_parts_mut(out, 12),
                )
            };
            let mut options = AbsolutePoseOptions::default();
            options.max_error_px = threshold;
            options.ransac.confidence = confidence;
            options.ransac.seed = seed;
            options.ransac.budget.max_iterations = max_iterations.max(1) as u32;
            match $memory.with_borrow_mut(|memory| memory.pose(pixels, points, k, &options)) {
                Some((pose, inliers)) => {
                    crate::poses::write_pose(&pose, out);
                    inliers as i32
                }
                None => -1,
            }
        }
    };
}

export!(f64, bench_ransac_abspose_f64, MEMORY_F64);
export!(f32, bench_ransac_abspose_f32, MEMORY_F32);
