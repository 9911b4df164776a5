//! The reduced linear system of the frames: a lower triangle of 6x6 blocks, its Cholesky factor and its solution.

use super::memory::system_len;
use super::small::{M3, V3, cross};
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
    /// The gradient before elimination.
    pub(super) gradient: &'a mut [[T; 6]],
    /// Diagonal of the damping.
    pub(super) damping: &'a mut [[T; 6]],
    /// The step; a row of the constraints while there is no step.
    pub(super) step: &'a mut [[T; 6]],
    /// What lies behind: the marginalisation prior.
    pub(super) prior: &'a [T],
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
        let (gradient, vectors) = vectors.split_at_mut_checked(used)?;
        let (damping, vectors) = vectors.split_at_mut_checked(used)?;
        let (step, _) = vectors.split_at_mut_checked(used)?;
        Some(Self { blocks, rhs, gradient, damping, step, prior })
    }

    pub(super) fn clear(&mut self) {
        self.blocks.fill([[T::ZERO; 6]; 6]);
        self.rhs.fill([T::ZERO; 6]);
        self.gradient.fill([T::ZERO; 6]);
    }

    /// Adds a row `J d + r` of a constraint.
    pub(super) fn add_row(&mut self, row: &[T], r: T) {
        let rows = row.as_chunks::<6>().0;
        let mut blocks = self.blocks.iter_mut();
        for (a, (ja, (rhs, gradient))) in
            rows.iter().zip(self.rhs.iter_mut().zip(self.gradient.iter_mut())).enumerate()
        {
            if ja.iter().all(|&x| x == T::ZERO) {
                blocks.by_ref().take(a + 1).for_each(drop);
                continue;
            }
            for k in 0..6 {
                rhs[k] -= ja[k] * r;
                gradient[k] += ja[k] * r;
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
        let Self { blocks, damping, .. } = self;
        for (a, damping) in damping.iter_mut().enumerate() {
            let Some(block) = blocks.get_mut(block_index(a, a)) else { return false };
            for k in 0..6 {
                damping[k] = lambda * block[k][k];
                block[k][k] += damping[k];
            }
        }
        for a in 0..damping.len() {
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
            for p in left.iter() {
                subtract_product(target, p, p);
            }
            if !factor(target) {
                return false;
            }
        }
        true
    }

    /// The step, of the factored system.
    pub(super) fn solve(&mut self) {
        let Self { blocks, rhs, step, .. } = self;
        for a in 0..rhs.len() {
            let Some(row) = blocks.get(block_index(a, 0)..=block_index(a, a)) else { return };
            let Some((done, rest)) = step.split_at_mut_checked(a) else { return };
            let (Some(x), Some(b), Some((diagonal, row))) = (rest.first_mut(), rhs.get(a), row.split_last())
            else {
                return;
            };
            let mut sum = *b;
            for (l, y) in row.iter().zip(done.iter()) {
                for i in 0..6 {
                    for j in 0..6 {
                        sum[i] -= l[i][j] * y[j];
                    }
                }
            }
            *x = forward(diagonal, &sum);
        }
        for a in (0..rhs.len()).rev() {
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

/// Adds `G_a C G_b'` to a block, with `G = [[y]x; I]`: what a camera-frame 3x3 block means for the motions of two
/// frames that see the point at `ya` and `yb`.
#[inline(always)]
pub(super) fn add_spread<T: Real>(block: &mut Block<T>, ya: &V3<T>, c: &M3<T>, yb: &V3<T>) {
    // Columns of [ya]x C, by rows of the result.
    let columns = [
        cross(ya, &[c[0][0], c[1][0], c[2][0]]),
        cross(ya, &[c[0][1], c[1][1], c[2][1]]),
        cross(ya, &[c[0][2], c[1][2], c[2][2]]),
    ];
    for i in 0..3 {
        let above = [columns[0][i], columns[1][i], columns[2][i]];
        let turned = cross(yb, &above);
        let low = cross(yb, &c[i]);
        for j in 0..3 {
            block[i][j] += turned[j];
            block[i][j + 3] += above[j];
            block[i + 3][j] += low[j];
            block[i + 3][j + 3] += c[i][j];
        }
    }
}

/// Adds `G g` to a vector.
#[inline(always)]
pub(super) fn add_spread_vector<T: Real>(to: &mut [T; 6], y: &V3<T>, g: &V3<T>) {
    let turn = cross(y, g);
    for k in 0..3 {
        to[k] += turn[k];
        to[k + 3] += g[k];
    }
}
