//! Relative pose of two calibrated views from five points.

mod cubics;
mod hidden;
mod polish;

use nalgebra::{Matrix3, Vector3};

use self::cubics::essential_cubics;
use self::hidden::{determinant, unknowns};
use crate::geometry::{Essential, Pose};
use crate::linalg::four::Four;
use crate::linalg::null_space;
use crate::linalg::poly::{projective_roots_10, real_roots_10};
use crate::real::{abs, lit, min};
use crate::{Real, Solutions};

/// Error of the polynomial's coefficients relative to the sum of their magnitudes, in `EPSILON`.
const POLYNOMIAL_ERROR: f64 = 4.0;
/// A root that this error may move farther is looked for again with the polynomial expanded about it.
const SPREAD: f64 = 0.02;
/// Newton steps at the most; a root that is well determined takes one.
const STEPS: u32 = 8;
/// Two unit vectors whose cosine is within this many `EPSILON` of 1 are the same solution.
const SAME: f64 = 32.0;

/// The essential matrices that five bearing pairs allow: up to ten, each of unit Frobenius norm.
///
/// `x2' E x1 = 0` for each pair, `E E' E - tr(E E') E / 2 = 0`, `det E = 0`.
///
/// # Input
/// Bearings in the frames of camera 1 and camera 2, of any length other than zero (unit length is best: the rows
/// of the linear system are weighted by the product of the lengths).
///
/// # Returns
/// 0 to 10 matrices, in an order that is fixed for an input and has no meaning.
///
/// # Degeneracies
/// No solution where the five equations are linearly dependent (a repeated pair, for example) or a number is not finite.
///
/// # Accuracy
/// Noise-free problems of a 1241x376 camera with a rotation error below 1e-6 rad in `f64`: 99.98 to 100 % (5000 each of five kinds of motion), real
/// roots lost against a solution of 31 digits at most 0.015 %, none spurious or twice. Below 1e-3 rad in `f32`: 99.5 % of random poses, 98.9 %
/// of small motions (99.9 % of both have a solution at all with the rounded bearings), 94 to 95 % of forward motions.
///
/// # Cost
/// No iteration before the roots; then at most 20 Newton steps a root (4 or 5 usual) and 8 a candidate matrix (1 or 2).
/// Where roots crowd (four of ten `f32` samples) the polynomial is expanded a second time about them.
///
/// # References
/// D. Nistér, "An efficient solution to the five-point relative pose problem", IEEE Transactions on Pattern Analysis
/// and Machine Intelligence, 2004, for the elimination and the polynomial. Not his: the null space by reflections, orthonormal rows before
/// the determinant, the roots in Bernstein's basis, the Newton steps on the essential matrices.
///
/// # Examples
/// ```
/// use epipole::nalgebra::{Rotation3, Vector3};
/// let (r, t) = (Rotation3::from_euler_angles(0.1_f64, -0.2, 0.05), Vector3::new(1.0, 0.2, -0.1));
/// let x1 = [[-1.0, 0.5, 4.0], [1.0, 1.0, 5.0], [0.0, -1.0, 6.0], [-0.5, -0.3, 3.0], [1.0, -0.7, 7.0]].map(Vector3::from);
/// let x2 = x1.map(|x| r * x + t);
/// let truth = (t.cross_matrix() * r.matrix()).normalize();
/// let solutions = epipole::solvers::relpose_5pt(&x1, &x2);
/// assert!(solutions.iter().any(|e| (e.0 - truth).norm().min((e.0 + truth).norm()) < 1e-12));
/// ```
pub fn relpose_5pt<T: Real>(x1: &[Vector3<T>; 5], x2: &[Vector3<T>; 5]) -> Solutions<Essential<T>, 10> {
    solve::<T, T>(x1, x2)
}

/// [`relpose_5pt`] with the polynomial of degree 10 and its roots in `f64`, for a core with a double-precision unit.
///
/// # Accuracy
/// Below 1e-3 rad: 99.6 % of random poses, 99.2 % of small motions.
///
/// # Examples
/// ```
/// use epipole::nalgebra::{Rotation3, Vector3};
/// let (r, t) = (Rotation3::from_euler_angles(0.1_f32, -0.2, 0.05), Vector3::new(1.0, 0.2, -0.1));
/// let x1 = [[-1.0, 0.5, 4.0], [1.0, 1.0, 5.0], [0.0, -1.0, 6.0], [-0.5, -0.3, 3.0], [1.0, -0.7, 7.0]].map(Vector3::from);
/// let x2 = x1.map(|x| r * x + t);
/// let truth = (t.cross_matrix() * r.matrix()).normalize();
/// let solutions = epipole::solvers::relpose_5pt_wide(&x1, &x2);
/// assert!(solutions.iter().any(|e| (e.0 - truth).norm().min((e.0 + truth).norm()) < 1e-4));
/// ```
pub fn relpose_5pt_wide(x1: &[Vector3<f32>; 5], x2: &[Vector3<f32>; 5]) -> Solutions<Essential<f32>, 10> {
    solve::<f32, f64>(x1, x2)
}

/// The poses of view 2 in the frame of view 1 that five bearing pairs allow with all five points in front of both
/// cameras: [`relpose_5pt`], then the choice among the four poses of each essential matrix.
///
/// `X2 = R X1 + t`, `|t| = 1`.
///
/// # Returns
/// 0 to 10 poses, at most one of each essential matrix, in the order of [`relpose_5pt`].
///
/// # Examples
/// ```
/// use epipole::geometry::Pose;
/// use epipole::nalgebra::{Point3, UnitQuaternion, Vector3};
/// let truth = Pose::from_parts(Vector3::new(0.6, 0.0, 0.8).into(), UnitQuaternion::from_euler_angles(0.1_f64, 0.2, 0.3));
/// let x1 = [[-1.0, 0.5, 4.0], [1.0, 1.0, 5.0], [0.0, -1.0, 6.0], [-0.5, -0.3, 3.0], [1.0, -0.7, 7.0]].map(Vector3::from);
/// let x2 = x1.map(|x| (truth * Point3::from(x)).coords);
/// let poses = epipole::solvers::relpose_5pt_poses(&x1, &x2);
/// assert!(poses.iter().any(|p| (p.to_homogeneous() - truth.to_homogeneous()).norm() < 1e-12));
/// ```
pub fn relpose_5pt_poses<T: Real>(x1: &[Vector3<T>; 5], x2: &[Vector3<T>; 5]) -> Solutions<Pose<T>, 10> {
    let mut poses = Solutions::new();
    for e in &relpose_5pt(x1, x2) {
        if let Some(pose) = e.twisted_pair().and_then(|pair| pair.pose_with_all_in_front(x1, x2)) {
            poses.push(pose);
        }
    }
    poses
}

#[inline]
fn solve<T: Real, W: Real>(x1: &[Vector3<T>; 5], x2: &[Vector3<T>; 5]) -> Solutions<Essential<T>, 10> {
    let mut found = Found { coefficients: [[T::ZERO; 4]; 10], len: 0 };
    let mut rows = [[T::ZERO; 9]; 5];
    for ((row, a), b) in rows.iter_mut().zip(x1).zip(x2) {
        *row = [
            b.x * a.x,
            b.x * a.y,
            b.x * a.z,
            b.y * a.x,
            b.y * a.y,
            b.y * a.z,
            b.z * a.x,
            b.z * a.y,
            b.z * a.z,
        ];
    }
    let Some(null) = null_space::<T, 5, 9, 4>(&rows) else { return Solutions::new() };
    let mut basis = [[T::ZERO; 4]; 9];
    for (k, vector) in null.iter().enumerate() {
        for (row, &v) in basis.iter_mut().zip(vector) {
            row[k] = v;
        }
    }
    let Some(rows) = hidden::eliminate(&mut essential_cubics(&basis)) else { return Solutions::new() };

    let error = lit::<W>(POLYNOMIAL_ERROR) * lit(T::EPSILON.to_f64());
    let narrow = |v: W| lit::<T>(v.to_f64());
    let [inside, outside] = projective_roots_10(&determinant::<T, W>(&rows), error);
    let mut candidates = Candidates::new();
    inside.as_slice().iter().for_each(|&x| candidates.push(narrow(x), T::ONE));
    outside.as_slice().iter().for_each(|&x| candidates.push(T::ONE, narrow(x)));
    found.add(&basis, &candidates, |num, den| unknowns(&rows, num, den));

    // Where roots crowd, the coefficients do not tell them apart: there the polynomial is expanded anew.
    let (a, b) = (inside.least_determined(), outside.least_determined());
    let (turned, centre) = if b.spread > a.spread { (true, b) } else { (false, a) };
    if centre.spread > lit(SPREAD) {
        let shift = narrow(centre.x);
        let near = rows.map(|r| if turned { r.reversed() } else { r }.shifted(shift));
        let radius = min(lit::<W>(4.0) * centre.spread, W::ONE);
        let mut det = determinant::<T, W>(&near);
        let mut power = W::ONE;
        for c in &mut det {
            *c *= power;
            power *= radius;
        }
        let mut candidates = Candidates::new();
        real_roots_10(&det, error)
            .as_slice()
            .iter()
            .for_each(|&x| candidates.push(narrow(x * radius), T::ONE));
        found.add(&basis, &candidates, |num, den| {
            let [x, y, z, w] = unknowns(&near, num, den);
            let z = z + w.times(shift);
            if turned { [x, y, w, z] } else { [x, y, z, w] }
        });
    }

    let mut solutions = Solutions::new();
    for c in found.coefficients.iter().take(found.len) {
        let e = basis.map(|b| (b[0] * c[0] + b[1] * c[1]) + (b[2] * c[2] + b[3] * c[3]));
        solutions.push(Essential(Matrix3::new(e[0], e[1], e[2], e[3], e[4], e[5], e[6], e[7], e[8])));
    }
    solutions
}

/// Roots of the polynomial as pairs of numerators and denominators, in groups of four.
struct Candidates<T> {
    groups: [[Four<T>; 2]; 6],
    len: usize,
}

impl<T: Real> Candidates<T> {
    #[inline]
    fn new() -> Self {
        // Unused lanes repeat z = 0.
        Self { groups: [[Four::splat(T::ZERO), Four::splat(T::ONE)]; 6], len: 0 }
    }

    #[inline]
    fn push(&mut self, num: T, den: T) {
        if let Some([n, d]) = self.groups.get_mut(self.len / 4) {
            (n.0[self.len % 4], d.0[self.len % 4]) = (num, den);
            self.len += 1;
        }
    }
}

/// Solutions, as unit vectors of the coefficients of the four basis matrices.
struct Found<T> {
    coefficients: [[T; 4]; 10],
    len: usize,
}

impl<T: Real> Found<T> {
    /// Newton from each candidate; keeps those that arrive at an essential matrix not found before.
    #[inline(always)]
    fn add(
        &mut self,
        basis: &[[T; 4]; 9],
        candidates: &Candidates<T>,
        start: impl Fn(Four<T>, Four<T>) -> [Four<T>; 4],
    ) {
        let mut left = candidates.len;
        for &[num, den] in candidates.groups.iter().take(candidates.len.div_ceil(4)) {
            self.add_group(basis, start(num, den), left);
            left = left.saturating_sub(4);
        }
    }

    /// The first `count` of four candidates.
    #[inline(never)]
    fn add_group(&mut self, basis: &[[T; 4]; 9], mut c: [Four<T>; 4], count: usize) {
        let mut arrived = [0, 1, 2, 3].map(|k| k >= count);
        let threshold = Four::splat(T::EPSILON);
        let mut near = [false; 4];
        for _ in 0..STEPS {
            let (next, step_sq) = polish::newton_step(basis, &c);
            c = polish::select(near, &c, &next);
            let small = threshold.greater(step_sq);
            for k in 0..4 {
                near[k] |= small[k];
                arrived[k] |= small[k];
            }
            if arrived == [true; 4] {
                break;
            }
        }
        for k in 0..4 {
            if k < count && near[k] {
                self.keep([c[0].0[k], c[1].0[k], c[2].0[k], c[3].0[k]]);
            }
        }
    }

    #[inline]
    fn keep(&mut self, c: [T; 4]) {
        let one = T::ONE - lit::<T>(SAME) * T::EPSILON;
        for k in self.coefficients.iter().take(self.len) {
            let cos = (k[0] * c[0] + k[1] * c[1]) + (k[2] * c[2] + k[3] * c[3]);
            if abs(cos) > one {
                return;
            }
        }
        if let Some(slot) = self.coefficients.get_mut(self.len) {
            *slot = c;
            self.len += 1;
        }
    }
}
