//! The reduced linear system of the frames: a lower triangle of 6x6 blocks, its Cholesky factor and its solution.

use super::memory::{Seen, system_len};
use super::small::cross;
use crate::Real;
use crate::real::sqrt;

/// Row by row.
pub(super) type Block<T> = [[T; 6]; 6];

/// The linear system in the window's scalars.
pub(super) struct System<'a, T> {
    /// Lower triangle, block row by block row.
    pub(super) blocks: &'a mut [Block<T>],
    /// Minus the reduced gradient.
    pub(super) rhs: &'a mut [[T; 6]],
    /// The step; a row of the constraints while there is no step.
    pub(super) step: &'a mut [[T; 6]],
    /// The step before, and the right-hand side it was taken from.
    last_step: &'a mut [[T; 6]],
    last_rhs: &'a mut [[T; 6]],
    /// What lies behind: the marginalisation prior.
    pub(super) prior: &'a [T],
    /// The blocks are the factor of an earlier iteration, and stay: only the right-hand side is filled.
    pub(super) lagged: bool,
}

/// Where block `(a, b)`, `b <= a`, stands.
#[inline(always)]
pub(super) const fn block_index(a: usize, b: usize) -> usize {
    a * (a + 1) / 2 + b
}

impl<'a, T: Real> System<'a, T> {
    /// For `used` column blocks of a window with the capacity `frames`.
    pub(super) fn of(scalars: &'a mut [T], frames: usize, used: usize) -> Option<Self> {
        let (system, prior) = scalars.split_at_mut_checked(system_len(frames))?;
        let (blocks, vectors) = system.split_at_mut_checked(18 * frames * (frames + 1))?;
        let blocks = blocks.as_chunks_mut::<6>().0.as_chunks_mut::<6>().0;
        let (blocks, _) = blocks.split_at_mut_checked(block_index(used, 0))?;
        let vectors = vectors.as_chunks_mut::<6>().0;
        let (rhs, vectors) = vectors.split_at_mut_checked(used)?;
        let (step, vectors) = vectors.split_at_mut_checked(used)?;
        let (last_step, vectors) = vectors.split_at_mut_checked(used)?;
        let (last_rhs, _) = vectors.split_at_mut_checked(used)?;
        Some(Self { blocks, rhs, step, last_step, last_rhs, prior, lagged: false })
    }

    pub(super) fn clear(&mut self) {
        if !self.lagged {
            self.blocks.fill([[T::ZERO; 6]; 6]);
        }
        self.rhs.fill([T::ZERO; 6]);
    }

    /// Adds a row `J d + r` of a constraint.
    pub(super) fn add_row(&mut self, row: &[T], r: T) {
        let rows = row.as_chunks::<6>().0;
        let mut blocks = self.blocks.iter_mut();
        for (a, (ja, rhs)) in rows.iter().zip(self.rhs.iter_mut()).enumerate() {
            if ja.iter().all(|&x| x == T::ZERO) {
                blocks.by_ref().take(a + 1).for_each(drop);
                continue;
            }
            for k in 0..6 {
                rhs[k] -= ja[k] * r;
            }
            if self.lagged {
                continue;
            }
            for (jb, block) in rows.iter().zip(blocks.by_ref().take(a + 1)) {
                for i in 0..6 {
                    for j in 0..6 {
                        block[i][j] += ja[i] * jb[j];
                    }
                }
            }
        }
    }

    /// Adds `lambda` times the diagonal, and factors. False where the matrix is not positive definite.
    pub(super) fn damp_and_factor(&mut self, lambda: T) -> bool {
        if self.lagged {
            return true;
        }
        let Self { blocks, rhs, .. } = self;
        for a in 0..rhs.len() {
            let Some((above, row)) = blocks.split_at_mut_checked(block_index(a, 0)) else { return false };
            for b in 0..a {
                // L_ab = (S_ab - sum L_ak L_bk') L_bb^-T
                let Some((left, rest)) = row.split_at_mut_checked(b) else { return false };
                let Some(target) = rest.first_mut() else { return false };
                let Some(other) = above.get(block_index(b, 0)..=block_index(b, b)) else { return false };
                for (p, q) in left.iter().zip(other) {
                    subtract_product(target, p, q);
                }
                let Some(diagonal) = other.last() else { return false };
                for line in target.iter_mut() {
                    *line = forward(diagonal, line);
                }
            }
            let Some((left, rest)) = row.split_at_mut_checked(a) else { return false };
            let Some(target) = rest.first_mut() else { return false };
            for k in 0..6 {
                target[k][k] += lambda * target[k][k];
            }
            for p in left.iter() {
                subtract_square(target, p);
            }
            if !factor(target) {
                return false;
            }
        }
        true
    }

    /// Keeps the step and what it was taken from, for a lagged system to learn from.
    pub(super) fn remember(&mut self) {
        for (to, from) in self.last_step.iter_mut().zip(self.step.iter()) {
            *to = *from;
        }
        for (to, from) in self.last_rhs.iter_mut().zip(self.rhs.iter()) {
            *to = *from;
        }
    }

    /// The step, of the factored system; of a lagged one with the curvature that the last step met (one pair of
    /// BFGS).
    pub(super) fn solve(&mut self) {
        for (to, from) in self.step.iter_mut().zip(self.rhs.iter()) {
            *to = *from;
        }
        if !self.lagged {
            self.apply_inverse();
            return;
        }
        for (y, b) in self.last_rhs.iter_mut().zip(self.rhs.iter()) {
            for k in 0..6 {
                y[k] -= b[k];
            }
        }
        let met = product(self.last_step, self.last_rhs);
        if !(met > T::ZERO) {
            self.apply_inverse();
            return;
        }
        let along = product(self.last_step, self.step) / met;
        for (x, y) in self.step.iter_mut().zip(self.last_rhs.iter()) {
            for k in 0..6 {
                x[k] -= along * y[k];
            }
        }
        self.apply_inverse();
        let along = along - product(self.last_rhs, self.step) / met;
        for (x, s) in self.step.iter_mut().zip(self.last_step.iter()) {
            for k in 0..6 {
                x[k] += along * s[k];
            }
        }
    }

    /// Solves the factored system for the right-hand side in `step`.
    fn apply_inverse(&mut self) {
        let Self { blocks, step, .. } = self;
        for a in 0..step.len() {
            let Some(row) = blocks.get(block_index(a, 0)..=block_index(a, a)) else { return };
            let Some((done, rest)) = step.split_at_mut_checked(a) else { return };
            let (Some(x), Some((diagonal, row))) = (rest.first_mut(), row.split_last()) else { return };
            for (l, y) in row.iter().zip(done.iter()) {
                for i in 0..6 {
                    for j in 0..6 {
                        x[i] -= l[i][j] * y[j];
                    }
                }
            }
            *x = forward(diagonal, x);
        }
        for a in (0..step.len()).rev() {
            let Some(row) = blocks.get(block_index(a, 0)..=block_index(a, a)) else { return };
            let Some((before, rest)) = step.split_at_mut_checked(a) else { return };
            let (Some(x), Some((diagonal, row))) = (rest.first_mut(), row.split_last()) else { return };
            *x = backward(diagonal, x);
            for (l, y) in row.iter().zip(before.iter_mut()) {
                for i in 0..6 {
                    for j in 0..6 {
                        y[j] -= l[i][j] * x[i];
                    }
                }
            }
        }
    }
}

fn product<T: Real>(a: &[[T; 6]], b: &[[T; 6]]) -> T {
    let mut sum = T::ZERO;
    for (a, b) in a.iter().zip(b) {
        for k in 0..6 {
            sum += a[k] * b[k];
        }
    }
    sum
}

/// `t -= p q'`
#[inline(always)]
fn subtract_product<T: Real>(t: &mut Block<T>, p: &Block<T>, q: &Block<T>) {
    for i in 0..6 {
        for j in 0..6 {
            let mut sum = p[i][0] * q[j][0];
            for k in 1..6 {
                sum += p[i][k] * q[j][k];
            }
            t[i][j] -= sum;
        }
    }
}

/// `t -= p p'`, lower triangle.
#[inline(always)]
fn subtract_square<T: Real>(t: &mut Block<T>, p: &Block<T>) {
    for i in 0..6 {
        for j in 0..=i {
            let mut sum = p[i][0] * p[j][0];
            for k in 1..6 {
                sum += p[i][k] * p[j][k];
            }
            t[i][j] -= sum;
        }
    }
}

/// Cholesky in place, lower triangle; the diagonal holds the inverses.
#[inline(always)]
fn factor<T: Real>(s: &mut Block<T>) -> bool {
    let floor = T::EPSILON;
    for i in 0..6 {
        for j in 0..i {
            let mut sum = s[i][j];
            for k in 0..j {
                sum -= s[i][k] * s[j][k];
            }
            s[i][j] = sum * s[j][j];
        }
        let mut pivot = s[i][i];
        let whole = pivot;
        for k in 0..i {
            pivot -= s[i][k] * s[i][k];
        }
        if !(pivot > floor * whole && pivot > T::ZERO && pivot <= T::MAX) {
            return false;
        }
        s[i][i] = T::ONE / sqrt(pivot);
    }
    true
}

/// `L^-1 b`
#[inline(always)]
fn forward<T: Real>(l: &Block<T>, b: &[T; 6]) -> [T; 6] {
    let mut x = *b;
    for i in 0..6 {
        for j in 0..i {
            x[i] -= l[i][j] * x[j];
        }
        x[i] *= l[i][i];
    }
    x
}

/// `L^-T b`
#[inline(always)]
fn backward<T: Real>(l: &Block<T>, b: &[T; 6]) -> [T; 6] {
    let mut x = *b;
    for i in (0..6).rev() {
        for j in i + 1..6 {
            x[i] -= l[j][i] * x[j];
        }
        x[i] *= l[i][i];
    }
    x
}

/// `K J_b` for a 2x2 matrix: rotation, then translation.
#[inline(always)]
fn times_jacobian<T: Real>(k: &[[T; 2]; 2], b: &Seen<T>) -> [[T; 6]; 2] {
    k.map(|[x, y]| {
        let [r, s] = &b.rotation;
        [x * r[0] + y * s[0], x * r[1] + y * s[1], x * r[2] + y * s[2], x, y, x * b.plane[0] + y * b.plane[1]]
    })
}

/// Adds `J_a' K J_b` to a block: what a 2x2 matrix of the plane points means for the motions of two frames.
#[inline(always)]
pub(super) fn add_spread<T: Real>(block: &mut Block<T>, a: &Seen<T>, k: &[[T; 2]; 2], b: &Seen<T>) {
    let [t, u] = times_jacobian(k, b);
    let ([r, s], [p, q]) = (&a.rotation, a.plane);
    for j in 0..6 {
        for i in 0..3 {
            block[i][j] += r[i] * t[j] + s[i] * u[j];
        }
        block[5][j] += p * t[j] + q * u[j];
        block[3][j] += t[j];
        block[4][j] += u[j];
    }
}

/// The lower triangle of [`add_spread`] for one frame and a symmetric matrix.
#[inline(always)]
pub(super) fn add_square_spread<T: Real>(block: &mut Block<T>, a: &Seen<T>, k: &[[T; 2]; 2]) {
    let [t, u] = times_jacobian(k, a);
    let ([r, s], [p, q]) = (&a.rotation, a.plane);
    for j in 0..6 {
        for i in j..3 {
            block[i][j] += r[i] * t[j] + s[i] * u[j];
        }
        block[5][j] += p * t[j] + q * u[j];
        if j < 4 {
            block[3][j] += t[j];
        }
        if j < 5 {
            block[4][j] += u[j];
        }
    }
}

/// [`add_spread`] for linearisations of which one or both have turned axes.
#[inline(never)]
pub(super) fn add_turned<T: Real>(block: &mut Block<T>, a: &Seen<T>, k: &[[T; 2]; 2], b: &Seen<T>) {
    let mut spread = [[T::ZERO; 6]; 6];
    add_spread(&mut spread, a, k, b);
    for (i, row) in spread.iter().enumerate() {
        let Some(to) = block.get_mut(turned(i, a.turn)) else { continue };
        for (j, x) in row.iter().enumerate() {
            if let Some(to) = to.get_mut(turned(j, b.turn)) {
                *to += *x;
            }
        }
    }
}

/// Subtracts `J' g` from a vector.
#[inline(always)]
pub(super) fn subtract_spread_vector<T: Real>(to: &mut [T; 6], a: &Seen<T>, g: [T; 2]) {
    let force = [g[0], g[1], a.plane[0] * g[0] + a.plane[1] * g[1]];
    let moment = cross(&a.y, &force);
    let spread = [moment[0], moment[1], moment[2], force[0], force[1], force[2]];
    if a.turn == 0 {
        for k in 0..6 {
            to[k] -= spread[k];
        }
        return;
    }
    for (k, x) in spread.iter().enumerate() {
        if let Some(to) = to.get_mut(turned(k, a.turn)) {
            *to -= *x;
        }
    }
}

/// The axis of the camera that axis `i` of a turned linearisation is.
#[inline(always)]
fn turned(i: usize, turn: u8) -> usize {
    let axis = (i % 3 + turn as usize) % 3;
    if i < 3 { axis } else { axis + 3 }
}
