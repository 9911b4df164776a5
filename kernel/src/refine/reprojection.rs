//! Correspondences of pixels and world points in fixed lanes, and their reprojection residual.
//!
//! With `Y = R X + t` the residual in pixels is `(a'Y, b'Y) / c'Y`, whatever the lens: on a plane `a = (fx, 0, -u)`,
//! `b = (0, fy, -v)`, `c = (0, 0, 1)` with the pixel (u, v) freed of distortion, counted from the principal point. For
//! a fisheye `c` is the bearing and the rows `a`, `b` are the pseudo-inverse of its derivative by the pixel: the
//! residual to first order, exact at zero.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::blocks::{Block, BlockSlice};
use super::lm::NormalEquations;
use super::relative_pose::cayley;
use crate::Real;
use crate::geometry::Pose;
use crate::geometry::pose::{from_parts, rotation_matrix};
use crate::linalg::{LANES, Lanes};
use crate::real::from_u32;
use crate::robust::loss::Loss;

/// A pose with its rotation as a matrix.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraPose<T: Real> {
    /// `R`.
    pub(crate) rotation: Matrix3<T>,
    /// `t`.
    pub(crate) translation: Vector3<T>,
}

impl<T: Real> CameraPose<T> {
    /// The pose of a solver.
    pub(crate) fn new(pose: &Pose<T>) -> Self {
        Self { rotation: rotation_matrix(&pose.rotation), translation: pose.translation.vector }
    }

    /// As the public type.
    pub(crate) fn pose(&self) -> Pose<T> {
        from_parts(&self.rotation, &self.translation)
    }

    /// `R <- Exp(w) R`, `t <- t + dt` with the step `(w, dt)`, to second order.
    #[inline]
    pub(crate) fn retract(&self, step: &SVector<T, 6>) -> Self {
        let s = &step.data.0[0];
        Self {
            rotation: cayley(&Vector3::new(s[0], s[1], s[2])) * self.rotation,
            translation: self.translation + Vector3::new(s[3], s[4], s[5]),
        }
    }
}

/// Four correspondences of a pixel and a world point. `focal` is (fx, fy).
pub(crate) trait ReprojectionBlock<T: Real>: Block<T> {
    /// The world points.
    fn points(&self) -> [&Lanes<T>; 3];

    /// `(a'Y, b'Y, c'Y)`: residuals times the depth, and the depth.
    fn scaled_residual(&self, y: &[Lanes<T>; 3], focal: [T; 2]) -> [Lanes<T>; 3];

    /// The rows a, b, c of a lane.
    fn rows(&self, lane: usize, focal: [T; 2]) -> [[T; 3]; 3];

    /// The pixels of these correspondences with the points of others: wrong correspondences. Another observation of the same
    /// point is none, and gets a pixel that no point reaches.
    fn mispaired(&self, other: &Self) -> Self;
}

/// u, v, then X, Y, Z of the world point.
pub(crate) type PlanePointBlock<T> = [Lanes<T>; 5];

/// a, b, c, then X, Y, Z of the world point.
pub(crate) type BearingPointBlock<T> = [Lanes<T>; 12];

impl<T: Real> ReprojectionBlock<T> for PlanePointBlock<T> {
    #[inline]
    fn points(&self) -> [&Lanes<T>; 3] {
        [&self[2], &self[3], &self[4]]
    }

    #[inline]
    fn scaled_residual(&self, y: &[Lanes<T>; 3], focal: [T; 2]) -> [Lanes<T>; 3] {
        let mut r = [[T::ZERO; LANES]; 2];
        for l in 0..LANES {
            r[0][l] = focal[0] * y[0][l] - self[0][l] * y[2][l];
            r[1][l] = focal[1] * y[1][l] - self[1][l] * y[2][l];
        }
        [r[0], r[1], y[2]]
    }

    #[inline]
    fn rows(&self, l: usize, focal: [T; 2]) -> [[T; 3]; 3] {
        let zero = T::ZERO;
        [[focal[0], zero, -self[0][l]], [zero, focal[1], -self[1][l]], [zero, zero, T::ONE]]
    }

    fn mispaired(&self, other: &Self) -> Self {
        let mut block = [self[0], self[1], other[2], other[3], other[4]];
        for l in 0..LANES {
            if same_point(self.points(), other.points(), l) {
                block[0][l] = T::MAX;
            }
        }
        block
    }
}

impl<T: Real> ReprojectionBlock<T> for BearingPointBlock<T> {
    #[inline]
    fn points(&self) -> [&Lanes<T>; 3] {
        [&self[9], &self[10], &self[11]]
    }

    #[inline]
    fn scaled_residual(&self, y: &[Lanes<T>; 3], _: [T; 2]) -> [Lanes<T>; 3] {
        let mut r = [[T::ZERO; LANES]; 3];
        for k in 0..3 {
            for l in 0..LANES {
                r[k][l] =
                    self[3 * k][l] * y[0][l] + self[3 * k + 1][l] * y[1][l] + self[3 * k + 2][l] * y[2][l];
            }
        }
        r
    }

    #[inline]
    fn rows(&self, l: usize, _: [T; 2]) -> [[T; 3]; 3] {
        let mut rows = [[T::ZERO; 3]; 3];
        for k in 0..3 {
            rows[k] = [self[3 * k][l], self[3 * k + 1][l], self[3 * k + 2][l]];
        }
        rows
    }

    fn mispaired(&self, other: &Self) -> Self {
        let mut block = *self;
        (block[9], block[10], block[11]) = (other[9], other[10], other[11]);
        for l in 0..LANES {
            if same_point(self.points(), other.points(), l) {
                (block[0][l], block[1][l], block[2][l]) = (T::MAX, T::MAX, T::MAX);
            }
        }
        block
    }
}

fn same_point<T: Real>(a: [&Lanes<T>; 3], b: [&Lanes<T>; 3], l: usize) -> bool {
    a.iter().zip(b).all(|(a, b)| a.get(l) == b.get(l))
}

/// `R X` of four points.
#[inline]
fn rotate<T: Real>(rotation: &Matrix3<T>, x: &[&Lanes<T>; 3]) -> [Lanes<T>; 3] {
    let m = &rotation.data.0;
    let mut y = [[T::ZERO; LANES]; 3];
    for i in 0..3 {
        for l in 0..LANES {
            y[i][l] = m[0][i] * x[0][l] + m[1][i] * x[1][l] + m[2][i] * x[2][l];
        }
    }
    y
}

#[inline]
fn translate<T: Real>(y: &mut [Lanes<T>; 3], t: &Vector3<T>) {
    for (lanes, &t) in y.iter_mut().zip(&t.data.0[0]) {
        for value in lanes {
            *value += t;
        }
    }
}

/// The squared residuals of a block in px^2 times the squared depth, and the depth: positive in front.
#[inline]
pub(crate) fn squared<T: Real, B: ReprojectionBlock<T>>(
    block: &B,
    pose: &CameraPose<T>,
    focal: [T; 2],
) -> (Lanes<T>, Lanes<T>) {
    let mut y = rotate(&pose.rotation, &block.points());
    translate(&mut y, &pose.translation);
    let [u, v, depth] = block.scaled_residual(&y, focal);
    let mut square = [T::ZERO; LANES];
    for l in 0..LANES {
        square[l] = u[l] * u[l] + v[l] * v[l];
    }
    (square, depth)
}

struct Sums<T> {
    hessian: [[Lanes<T>; 6]; 6],
    gradient: [Lanes<T>; 6],
    cost: Lanes<T>,
}

impl<T: Real> Sums<T> {
    /// Adds the lanes of a block of which the first `filled` count.
    #[inline]
    fn add<B: ReprojectionBlock<T>>(
        &mut self,
        block: &B,
        pose: &CameraPose<T>,
        focal: [T; 2],
        loss: &Loss<T>,
        filled: usize,
    ) {
        let rotated = rotate(&pose.rotation, &block.points());
        let mut y = rotated;
        translate(&mut y, &pose.translation);
        let scaled = block.scaled_residual(&y, focal);
        // d r / d Y = (a - r c) / depth; by w of Y = Exp(w) R X + t: R X x (d r / d Y).
        let mut jacobian = [[[T::ZERO; LANES]; 6]; 2];
        let mut residual = [[T::ZERO; LANES]; 2];
        let mut weight = [T::ZERO; LANES];
        for l in 0..LANES {
            let rows = block.rows(l, focal);
            // Lanes that are not filled must not bring an infinity into the sums.
            let inverse = if l < filled { T::ONE / scaled[2][l] } else { T::ZERO };
            for k in 0..2 {
                let r = scaled[k][l] * inverse;
                residual[k][l] = r;
                let g = [
                    (rows[k][0] - r * rows[2][0]) * inverse,
                    (rows[k][1] - r * rows[2][1]) * inverse,
                    (rows[k][2] - r * rows[2][2]) * inverse,
                ];
                let x = [rotated[0][l], rotated[1][l], rotated[2][l]];
                jacobian[k][0][l] = x[1] * g[2] - x[2] * g[1];
                jacobian[k][1][l] = x[2] * g[0] - x[0] * g[2];
                jacobian[k][2][l] = x[0] * g[1] - x[1] * g[0];
                jacobian[k][3][l] = g[0];
                jacobian[k][4][l] = g[1];
                jacobian[k][5][l] = g[2];
            }
            if l < filled {
                let (cost, w) =
                    loss.evaluate(residual[0][l] * residual[0][l] + residual[1][l] * residual[1][l]);
                self.cost[l] += cost;
                weight[l] = w;
            }
        }
        for p in 0..6 {
            let mut weighted = [[T::ZERO; LANES]; 2];
            for l in 0..LANES {
                weighted[0][l] = weight[l] * jacobian[0][p][l];
                weighted[1][l] = weight[l] * jacobian[1][p][l];
                self.gradient[p][l] += weighted[0][l] * residual[0][l] + weighted[1][l] * residual[1][l];
            }
            for q in 0..6 {
                if q <= p {
                    for l in 0..LANES {
                        self.hessian[p][q][l] +=
                            weighted[0][l] * jacobian[0][q][l] + weighted[1][l] * jacobian[1][q][l];
                    }
                }
            }
        }
    }
}

#[inline]
fn total<T: Real>(lanes: &Lanes<T>) -> T {
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3])
}

/// One pass over all correspondences. Those behind the camera or beyond the loss's support are left out; the others
/// are packed into full blocks first, so that derivatives are computed for them alone.
pub(crate) fn normal_equations<T: Real, B: ReprojectionBlock<T>>(
    data: BlockSlice<'_, B>,
    pose: &CameraPose<T>,
    focal: [T; 2],
    loss: &Loss<T>,
) -> NormalEquations<T, 6> {
    let zero = [T::ZERO; LANES];
    let mut sums = Sums { hessian: [[zero; 6]; 6], gradient: [zero; 6], cost: zero };
    let support = loss.support();
    let limit = support.unwrap_or(T::MAX);
    let mut active = 0u32;
    let mut pending = B::zero();
    let mut filled = 0usize;
    let mut left = data.count;
    for block in data.blocks {
        let (square, depth) = squared(block, pose, focal);
        for l in 0..LANES {
            if l < left && depth[l] > T::ZERO && square[l] < limit * (depth[l] * depth[l]) {
                pending.set_lane(filled, block, l);
                filled += 1;
                active += 1;
                if filled == LANES {
                    sums.add(&pending, pose, focal, loss, LANES);
                    filled = 0;
                }
            }
        }
        left = left.saturating_sub(LANES);
    }
    if filled > 0 {
        sums.add(&pending, pose, focal, loss, filled);
    }
    let mut hessian = SMatrix::<T, 6, 6>::zeros();
    let mut gradient = SVector::<T, 6>::zeros();
    for p in 0..6 {
        gradient.data.0[0][p] = total(&sums.gradient[p]);
        for q in 0..6 {
            let (a, b) = if q <= p { (p, q) } else { (q, p) };
            hessian.data.0[q][p] = total(&sums.hessian[a][b]);
        }
    }
    let outside = from_u32::<T>((data.count as u32).saturating_sub(active));
    let beyond = support.map_or(T::ZERO, |limit| loss.evaluate(limit).0);
    NormalEquations { hessian, gradient, cost: total(&sums.cost) + outside * beyond, active }
}
