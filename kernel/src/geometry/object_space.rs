//! The object-space error of an absolute pose: how far the points are from their lines of sight.
//!
//! `sum |(I - f f') (R X + t)|^2` is, with the best `t` for each `R`, a quadratic form in the nine entries of `R`. A few
//! dozen numbers then stand for any number of correspondences, and every local minimum over the rotations is found by
//! descending from the best of a fixed set of rotations.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::Pose;
use super::pose::{from_parts, retract};
use crate::linalg::Ldlt;
use crate::real::{from_u32, lit, max, sqrt};
use crate::{Real, Solutions};

/// Starts that are descended from.
const STARTS: usize = 12;
/// Steps of one descent at the most.
const MAX_STEPS: usize = 25;
/// Steps on the angles at the end.
const POLISH: usize = 6;

/// A local minimum: the pose, and the root mean square angle between bearings and points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fit<T: Real> {
    pub(crate) pose: Pose<T>,
    pub(crate) rms_rad: T,
}

/// The quadratic form of some correspondences.
struct ObjectSpace<T: Real> {
    /// Block (i, j) of the form, i <= j, belongs to the rows i and j of R.
    blocks: [[Matrix3<T>; 3]; 3],
    /// `t = - sum_j solve[j] row_j'`: column k of `solve[j]` belongs to entry k of row j.
    solve: [Matrix3<T>; 3],
    /// Sum of the bearings.
    gaze: Vector3<T>,
}

impl<T: Real> ObjectSpace<T> {
    /// Unit bearings with points about their mean; none where the translation is not determined.
    fn new(pairs: impl Iterator<Item = (Vector3<T>, Vector3<T>)>) -> Option<Self> {
        let zero = Matrix3::zeros();
        let mut blocks = [[zero; 3]; 3];
        // lever[j] = sum q_j x', q_j the column j of Q = I - f f'
        let mut lever = [zero; 3];
        let mut total = zero;
        let mut gaze = Vector3::zeros();
        for (f, x) in pairs {
            let q = Matrix3::identity() - f * f.transpose();
            let xx = x * x.transpose();
            for i in 0..3 {
                for j in i..3 {
                    blocks[i][j] += xx * q[(i, j)];
                }
                lever[i] += q.column(i) * x.transpose();
            }
            total += q;
            gaze += f;
        }
        let inverse = Ldlt::new(&total)?.inverse();
        let solve = [inverse * lever[0], inverse * lever[1], inverse * lever[2]];
        for i in 0..3 {
            for j in i..3 {
                blocks[i][j] -= lever[i].transpose() * solve[j];
            }
        }
        Some(Self { blocks, solve, gaze })
    }

    fn translation(&self, r: &Matrix3<T>) -> Vector3<T> {
        let row = |j: usize| r.row(j).transpose();
        -(self.solve[0] * row(0) + self.solve[1] * row(1) + self.solve[2] * row(2))
    }

    /// The form applied to a matrix.
    fn apply(&self, r: &Matrix3<T>) -> Matrix3<T> {
        let row = |j: usize| r.row(j).transpose();
        let b = &self.blocks;
        let (r0, r1, r2) = (row(0), row(1), row(2));
        let a0 = b[0][0] * r0 + b[0][1] * r1 + b[0][2] * r2;
        let a1 = b[0][1].transpose() * r0 + b[1][1] * r1 + b[1][2] * r2;
        let a2 = b[0][2].transpose() * r0 + b[1][2].transpose() * r1 + b[2][2] * r2;
        Matrix3::from_rows(&[a0.transpose(), a1.transpose(), a2.transpose()])
    }

    fn cost(&self, r: &Matrix3<T>) -> T {
        inner(r, &self.apply(r))
    }

    /// The local minimum below `r`, by damped Gauss-Newton steps on the rotations.
    fn descend(&self, r: &Matrix3<T>) -> Matrix3<T> {
        let mut best = *r;
        let mut cost = self.cost(r);
        let mut damping = lit::<T>(1e-3);
        for _ in 0..MAX_STEPS {
            // d (Exp(w) R) = [e_k]x R
            let turned = [Vector3::x(), Vector3::y(), Vector3::z()]
                .map(|axis: Vector3<T>| super::pose::skew(&axis) * best);
            let applied = self.apply(&best);
            let mut gradient = Vector3::zeros();
            let mut hessian = Matrix3::zeros();
            for k in 0..3 {
                gradient[k] = inner(&turned[k], &applied);
                let image = self.apply(&turned[k]);
                for l in 0..3 {
                    hessian[(k, l)] = inner(&turned[l], &image);
                }
            }
            let size = max(max(hessian[(0, 0)], hessian[(1, 1)]), hessian[(2, 2)]);
            let mut damped = hessian;
            for k in 0..3 {
                damped[(k, k)] += damping * hessian[(k, k)] + size * T::EPSILON;
            }
            let Some(factors) = Ldlt::new(&damped) else { break };
            let step = -factors.solve(&gradient);
            let turn = super::pose::exp(&step).to_rotation_matrix().into_inner();
            let next = turn * best;
            let next_cost = self.cost(&next);
            if next_cost < cost {
                let small = step.norm_squared() < T::EPSILON;
                (best, cost) = (next, next_cost);
                damping *= lit(0.1);
                if small {
                    break;
                }
            } else {
                if step.norm_squared() < T::EPSILON {
                    break;
                }
                damping *= lit(16.0);
            }
        }
        best
    }
}

fn inner<T: Real>(a: &Matrix3<T>, b: &Matrix3<T>) -> T {
    let mut sum = T::ZERO;
    for (x, y) in a.iter().zip(b.iter()) {
        sum += *x * *y;
    }
    sum
}

/// The local minima of the object-space error that see the points in front, refined on the angles and sorted by them.
/// `bearings` are unit vectors; the input must be finite.
pub(crate) fn fits<T: Real>(
    pairs: impl Iterator<Item = (Vector3<T>, Vector3<T>)> + Clone,
    count: u32,
    extra: impl Fn(&Pose<T>) -> Option<Pose<T>>,
) -> Solutions<Fit<T>, 4> {
    let mut found: Solutions<Fit<T>, 4> = Solutions::new();
    let share = T::ONE / from_u32(core::cmp::max(count, 1));
    let mut mean = Vector3::zeros();
    for (_, x) in pairs.clone() {
        mean += x * share;
    }
    let mut spread = T::ZERO;
    for (_, x) in pairs.clone() {
        spread += (x - mean).norm_squared() * share;
    }
    let scale = sqrt(spread);
    let inverse = T::ONE / scale;
    // What rounding leaves of equal points is no spread.
    let tiny = T::EPSILON * lit::<T>(16.0) * sqrt(mean.norm_squared());
    if !(scale > tiny && inverse > T::ZERO) {
        return found;
    }
    let centred = pairs.map(|(f, x)| (f, (x - mean) * inverse));
    let Some(space) = ObjectSpace::new(centred.clone()) else { return found };

    let mut starts = [(T::MAX, Matrix3::identity()); STARTS];
    let mut offer = |rotation: Matrix3<T>| {
        // Minima with the points behind the camera are as many; they are not descended to.
        if !(space.translation(&rotation).dot(&space.gaze) > T::ZERO) {
            return;
        }
        let mut moving = (space.cost(&rotation), rotation);
        for start in &mut starts {
            if moving.0 < start.0 {
                core::mem::swap(start, &mut moving);
            }
        }
    };
    for cube in cube_rotations::<T>() {
        for base in tilts::<T>() {
            offer(cube * base);
        }
    }
    // Several starts lead to one minimum.
    let mut minima = [None::<Matrix3<T>>; 2 * STARTS];
    let mut keep = |rotation: Matrix3<T>| {
        for known in &mut minima {
            match known {
                Some(known) if (*known - rotation).norm_squared() < lit(1e-6) => return,
                Some(_) => {}
                None => {
                    *known = Some(rotation);
                    break;
                }
            }
        }
        let pose = from_parts(&rotation, &space.translation(&rotation));
        if let Some(fit) = polish(centred.clone(), count, &pose) {
            insert(&mut found, fit);
        }
    };
    for (cost, start) in starts {
        if cost < T::MAX {
            let rotation = space.descend(&start);
            keep(rotation);
            if let Some(other) = extra(&from_parts(&rotation, &space.translation(&rotation))) {
                keep(space.descend(&other.rotation.to_rotation_matrix().into_inner()));
            }
        }
    }
    // Back to the points as they were given.
    let mut result = Solutions::new();
    for fit in &found {
        let t = fit.pose.translation.vector * scale - fit.pose.rotation * mean;
        let pose = Pose::from_parts(nalgebra::Translation3::from(t), fit.pose.rotation);
        result.push(Fit { pose, rms_rad: fit.rms_rad });
    }
    result
}

/// Inserts a fit by its error unless it is known.
fn insert<T: Real>(found: &mut Solutions<Fit<T>, 4>, fit: Fit<T>) {
    let same = |a: &Pose<T>, b: &Pose<T>| {
        let turn = (a.rotation.inverse() * b.rotation).coords.xyz().norm_squared();
        turn < lit(1e-5)
    };
    let mut sorted = Solutions::new();
    let mut moving = Some(fit);
    for known in found.iter() {
        if let Some(fit) = moving {
            if same(&known.pose, &fit.pose) {
                if known.rms_rad <= fit.rms_rad {
                    moving = None;
                } else {
                    sorted.push(fit);
                    moving = None;
                    continue;
                }
            } else if fit.rms_rad < known.rms_rad {
                sorted.push(fit);
                moving = None;
            }
        }
        sorted.push(*known);
    }
    if let Some(fit) = moving {
        sorted.push(fit);
    }
    *found = sorted;
}

/// Gauss-Newton on the sines of the angles between bearings and points, from the points themselves; none where a point
/// is not in front or the error is not finite.
fn polish<T: Real>(
    pairs: impl Iterator<Item = (Vector3<T>, Vector3<T>)> + Clone,
    count: u32,
    start: &Pose<T>,
) -> Option<Fit<T>> {
    let mut best: Option<Fit<T>> = None;
    let mut pose = *start;
    for _ in 0..POLISH {
        let mut hessian = Matrix6::zeros();
        let mut gradient = Vector6::zeros();
        let mut sum = T::ZERO;
        let mut front = true;
        for (f, x) in pairs.clone() {
            let rotated = pose.rotation * x;
            let y = rotated + pose.translation.vector;
            front &= f.dot(&y) > T::ZERO;
            let inverse = T::ONE / sqrt(y.norm_squared());
            let direction = y * inverse;
            let residual = f.cross(&direction);
            sum += residual.norm_squared();
            // d residual = [f]x (I - d d') / |y| (w x RX + dt)
            let by_point =
                super::pose::skew(&f) * (Matrix3::identity() - direction * direction.transpose()) * inverse;
            let by_rotation = -by_point * super::pose::skew(&rotated);
            let mut j = [[T::ZERO; 6]; 3];
            for (i, row) in j.iter_mut().enumerate() {
                for k in 0..3 {
                    row[k] = by_rotation[(i, k)];
                    row[3 + k] = by_point[(i, k)];
                }
            }
            for (i, row) in j.iter().enumerate() {
                for p in 0..6 {
                    gradient[p] += row[p] * residual[i];
                    for q in 0..6 {
                        hessian[(p, q)] += row[p] * row[q];
                    }
                }
            }
        }
        let rms_rad = sqrt(sum / from_u32(core::cmp::max(count, 1)));
        if !(front && rms_rad <= T::MAX) {
            break;
        }
        if best.is_some_and(|best| best.rms_rad <= rms_rad) {
            break;
        }
        best = Some(Fit { pose, rms_rad });
        let Some(factors) = Ldlt::new(&hessian) else { break };
        pose = retract(&pose, &-factors.solve(&gradient));
    }
    best
}

/// The 24 rotations that map the coordinate axes onto themselves.
fn cube_rotations<T: Real>() -> impl Iterator<Item = Matrix3<T>> {
    const PERMUTATIONS: [([usize; 3], bool); 6] = [
        ([0, 1, 2], true),
        ([1, 2, 0], true),
        ([2, 0, 1], true),
        ([0, 2, 1], false),
        ([1, 0, 2], false),
        ([2, 1, 0], false),
    ];
    PERMUTATIONS.into_iter().flat_map(|(columns, even)| {
        (0..4u32).map(move |signs| {
            let sign = |bit: u32| if signs & bit == 0 { T::ONE } else { -T::ONE };
            let (a, b) = (sign(1), sign(2));
            let c = if even { a * b } else { -(a * b) };
            let mut m = Matrix3::zeros();
            for (i, (column, value)) in columns.into_iter().zip([a, b, c]).enumerate() {
                if column < 3 {
                    m[(i, column)] = value;
                }
            }
            m
        })
    })
}

/// The identity and a rotation by 60 degrees about (1, 1, 1), which lies between those of the cube.
fn tilts<T: Real>() -> [Matrix3<T>; 2] {
    let (a, b) = (lit(2.0 / 3.0), lit(-1.0 / 3.0));
    [Matrix3::identity(), Matrix3::new(a, b, a, a, a, b, b, a, a)]
}
