//! Absolute pose as the engine's problem: P3P or upright hypotheses, reprojection scores, refinement.

use nalgebra::{Matrix3, Vector3};

use crate::Real;
use crate::linalg::{LANES, Lanes};
use crate::real::{from_u32, is_finite, lit, sqrt};
use crate::refine::blocks::BlockSlice;
use crate::refine::lm::{Minimum, descend};
use crate::refine::reprojection::{CameraPose, ReprojectionBlock, normal_equations, squared};
use crate::robust::loss::Loss;
use crate::robust::{Estimator, Gate, Score, ScoreCounts, Tally};
use crate::solvers::{abspose_upright_2pt, p3p};

use super::search::Gravity;

/// Blocks scored between two looks at the gate.
const CHUNK: usize = 2;
/// Passes over the data in one local optimisation.
const LOCAL_PASSES: u32 = 8;

/// Correspondences and what a score of them needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct PoseProblem<'a, T, B> {
    pub(super) data: BlockSlice<'a, B>,
    pub(super) focal: [T; 2],
    pub(super) threshold: T,
    /// -1 to look for poses with the points behind the camera.
    pub(super) facing: T,
    /// Blocks between two that are scored one after the other.
    pub(super) stride: usize,
}

impl<'a, T: Real, B: ReprojectionBlock<T>> PoseProblem<'a, T, B> {
    pub(super) fn new(data: BlockSlice<'a, B>, focal: [T; 2], threshold: T) -> Self {
        let blocks = data.blocks.len();
        // Near the golden ratio, so that early blocks are spread over an input sorted by quality.
        let first = blocks * 5 / 8;
        let stride = (first..first + 64).find(|&stride| coprime(stride, blocks)).unwrap_or(1);
        Self { data, focal, threshold, facing: T::ONE, stride }
    }

    /// The unit bearing and the point of a correspondence; none where the pixel has no bearing.
    #[inline]
    pub(super) fn correspondence(&self, index: u32) -> Option<(Vector3<T>, Vector3<T>)> {
        let block = self.data.blocks.get(index as usize / LANES)?;
        for lane in 0..LANES {
            if lane == index as usize % LANES {
                // The direction on which both residuals vanish.
                let [a, b, _] = block.rows(lane, self.focal).map(|row| Vector3::new(row[0], row[1], row[2]));
                let ray = a.cross(&b);
                let bearing = ray * (self.facing / sqrt(ray.norm_squared()));
                let [x, y, z] = block.points();
                return is_finite(bearing.x).then_some((bearing, Vector3::new(x[lane], y[lane], z[lane])));
            }
        }
        None
    }

    /// Squared residuals of a block in units of the squared threshold; of a point behind the camera, 1.
    #[cfg_attr(not(small), inline)]
    #[cfg_attr(small, inline(never))]
    pub(super) fn relative(&self, block: &B, pose: &CameraPose<T>, scale: T) -> Lanes<T> {
        let (square, depth) = squared(block, pose, self.focal);
        let mut relative = [T::ZERO; LANES];
        for l in 0..LANES {
            let front = depth[l] * self.facing > T::ZERO;
            let s = square[l] * scale / (depth[l] * depth[l]);
            relative[l] = if front { s } else { T::ONE };
        }
        relative
    }

    pub(super) fn scale(&self) -> T {
        T::ONE / (self.threshold * self.threshold)
    }

    /// Calls `each` with every block in order, its squared residuals in units of the squared threshold and how many
    /// lanes count.
    pub(super) fn for_each_block(&self, pose: &CameraPose<T>, mut each: impl FnMut(&B, &Lanes<T>, usize)) {
        let scale = self.scale();
        let mut left = self.data.count;
        for block in self.data.blocks {
            each(block, &self.relative(block, pose, scale), core::cmp::min(left, LANES));
            left = left.saturating_sub(LANES);
        }
    }

    /// Calls `each` with the world point of every inlier: through a pointer where code is to be small.
    pub(super) fn for_each_inlier(&self, pose: &CameraPose<T>, mut each: impl FnMut(Vector3<T>)) {
        if cfg!(small) {
            self.each_inlier::<dyn FnMut(_) + '_>(pose, &mut each);
        } else {
            self.each_inlier(pose, &mut each);
        }
    }

    fn each_inlier<F: FnMut(Vector3<T>) + ?Sized>(&self, pose: &CameraPose<T>, each: &mut F) {
        self.for_each_block(pose, |block, relative, filled| {
            let [x, y, z] = block.points();
            for l in 0..LANES {
                if l < filled && relative[l] < T::ONE {
                    each(Vector3::new(x[l], y[l], z[l]));
                }
            }
        });
    }

    /// The pose that minimises the loss, and the deviation from a known direction if one is given.
    pub(super) fn optimise(
        &self,
        pose: &CameraPose<T>,
        loss: &Loss<T>,
        gravity: Option<&Gravity<T>>,
        passes: u32,
        tolerance: T,
    ) -> Minimum<CameraPose<T>, T, 6> {
        let equations = |pose: &CameraPose<T>| {
            let mut sums = normal_equations(self.data, pose, self.focal, loss);
            if let Some(gravity) = gravity {
                gravity.direction.add(&mut sums, &pose.rotation, gravity.weight);
            }
            sums
        };
        descend(pose, 3, passes, tolerance, equations, CameraPose::retract)
    }

    fn score(&self, pose: &CameraPose<T>, gate: &Gate<T>, counts: &mut ScoreCounts) -> Option<Score<T>> {
        let blocks = self.data.blocks;
        let scale = self.scale();
        let mut tally = Tally::new();
        let (mut at, mut seen) = (0usize, 0u32);
        // The last block may not be full; it is left to the end.
        let full = self.data.count / LANES;
        for _ in 0..blocks.len().div_ceil(CHUNK) {
            for _ in 0..CHUNK {
                if at < full
                    && (seen as usize) < LANES * full
                    && let Some(block) = blocks.get(at)
                {
                    tally.add(&self.relative(block, pose, scale));
                    seen += LANES as u32;
                }
                at += self.stride;
                if at >= blocks.len() {
                    at -= blocks.len();
                }
            }
            if gate.rejects(tally.cost(), tally.inliers(), from_u32(seen)) {
                counts.add_rejected(seen, tally.inliers().to_u32());
                return None;
            }
        }
        counts.add(self.data.count as u32);
        if let Some(block) = blocks.get(full) {
            tally.add_first(&self.relative(block, pose, scale), self.data.count - full * LANES);
        }
        Some(tally.score())
    }

    fn refine(&self, pose: &CameraPose<T>, residuals: &mut u32) -> Option<CameraPose<T>> {
        if self.facing < T::ZERO {
            return None;
        }
        let loss = Loss::Truncated(self.threshold);
        let minimum = self.optimise(pose, &loss, None, LOCAL_PASSES, lit(1e-4));
        *residuals = residuals.saturating_add(minimum.passes.saturating_mul(self.data.count as u32));
        Some(minimum.model)
    }
}

fn coprime(mut a: usize, mut b: usize) -> bool {
    for _ in 0..128 {
        if b == 0 {
            break;
        }
        (a, b) = (b, a % b);
    }
    a == 1
}

impl<T: Real, B: ReprojectionBlock<T>> Estimator<T, 3> for PoseProblem<'_, T, B> {
    type Model = CameraPose<T>;

    fn count(&self) -> u32 {
        self.data.count as u32
    }

    fn generate(&self, sample: &[u32; 3], found: &mut impl FnMut(&CameraPose<T>)) -> bool {
        let [Some(a), Some(b), Some(c)] = sample.map(|index| self.correspondence(index)) else {
            return false;
        };
        for pose in p3p(&[a.0, b.0, c.0], &[a.1, b.1, c.1]) {
            found(&CameraPose::new(&pose));
        }
        true
    }

    fn score(&self, pose: &CameraPose<T>, gate: &Gate<T>, counts: &mut ScoreCounts) -> Option<Score<T>> {
        self.score(pose, gate, counts)
    }

    fn refine(&self, pose: &CameraPose<T>, residuals: &mut u32) -> Option<CameraPose<T>> {
        self.refine(pose, residuals)
    }
}

/// The same problem with gravity known: samples of two.
#[derive(Clone, Copy, Debug)]
pub(super) struct UprightProblem<'a, T: Real, B> {
    pub(super) problem: PoseProblem<'a, T, B>,
    /// Turns the world upright.
    pub(super) world: Matrix3<T>,
    /// Turns the camera upright.
    pub(super) camera: Matrix3<T>,
}

impl<T: Real, B: ReprojectionBlock<T>> Estimator<T, 2> for UprightProblem<'_, T, B> {
    type Model = CameraPose<T>;

    fn count(&self) -> u32 {
        self.problem.data.count as u32
    }

    fn generate(&self, sample: &[u32; 2], found: &mut impl FnMut(&CameraPose<T>)) -> bool {
        let [Some(a), Some(b)] = sample.map(|index| self.problem.correspondence(index)) else {
            return false;
        };
        let bearings = [self.camera * a.0, self.camera * b.0];
        let points = [self.world * a.1, self.world * b.1];
        for pose in abspose_upright_2pt(&bearings, &points) {
            let upright = CameraPose::new(&pose);
            let back = self.camera.transpose();
            found(&CameraPose {
                rotation: back * upright.rotation * self.world,
                translation: back * upright.translation,
            });
        }
        true
    }

    fn score(&self, pose: &CameraPose<T>, gate: &Gate<T>, counts: &mut ScoreCounts) -> Option<Score<T>> {
        self.problem.score(pose, gate, counts)
    }

    fn refine(&self, pose: &CameraPose<T>, residuals: &mut u32) -> Option<CameraPose<T>> {
        self.problem.refine(pose, residuals)
    }
}
