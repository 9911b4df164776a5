//! Relative pose of two calibrated views from five points.

mod cubics;
mod hidden;
mod polish;

use nalgebra::{Matrix3, Vector3};

use self::cubics::essential_cubics;
use self::hidden::{HiddenRow, determinant, unknowns};
use crate::geometry::{Essential, Pose};
use crate::linalg::batch::{BATCH, Batch};
use crate::linalg::null_space_of_columns;
use crate::linalg::poly::{LeastDetermined, projective_roots_10, real_roots_10};
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
/// Noise-free problems of a 1241x376 camera with a rotation error below 1e-6 rad in `f64`: 99.98 to 100 % (5000 each of
/// five kinds of motion), real roots lost against a solution of 31 digits at most 0.015 %, none spurious or twice.
/// Below 1e-3 rad in `f32`: 99.5 % of random poses, 98.9 % of small motions (99.9 % of both have a solution at all with
/// the rounded bearings), 94 to 95 % of forward motions.
///
/// # Cost
/// No iteration before the roots; then at most 20 Newton steps a root (4 or 5 usual) and 8 a candidate matrix (1 or 2).
/// Where roots crowd (four of ten `f32` samples) the polynomial is expanded a second time about them.
///
/// # References
/// D. Nistér, "An efficient solution to the five-point relative pose problem", IEEE Transactions on Pattern Analysis
/// and Machine Intelligence, 2004, for the elimination and the polynomial. Not his: the null space by reflections,
/// orthonormal rows before the determinant, the roots in Bernstein's basis, the Newton steps on the essential matrices.
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
    let mut found = Found::new();
    solve::<T, T>(x1, x2, &mut found);
    found.solutions()
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
    let mut found = Found::new();
    solve::<f32, f64>(x1, x2, &mut found);
    found.solutions()
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
    let mut found = Found::new();
    solve::<T, T>(x1, x2, &mut found);
    let mut poses = Solutions::new();
    found.poses(x1, x2, &mut poses);
    poses
}

/// The bearing pairs' solutions, with the polynomial and its roots in the scalar `W`.
#[inline(never)]
fn solve<T: Real, W: Real>(x1: &[Vector3<T>; 5], x2: &[Vector3<T>; 5], found: &mut Found<T>) {
    let mut rows = [HiddenRow::ZERO; 3];
    if null_basis(x1, x2, &mut found.basis).is_none() || hidden_rows(&found.basis, &mut rows).is_none() {
        return;
    }
    let [inside, outside] = found.add_roots(&rows, Chart::<T, W>::Line);
    // Where roots crowd, the coefficients do not tell them apart: there the polynomial is expanded anew.
    let (turned, centre) = if outside.spread > inside.spread { (true, outside) } else { (false, inside) };
    if centre.spread > lit(SPREAD) {
        let shift = narrow(centre.x);
        for row in &mut rows {
            if turned {
                row.reverse();
            }
            row.shift(shift);
        }
        let radius = min(lit::<W>(4.0) * centre.spread, W::ONE);
        found.add_roots(&rows, Chart::Disc { radius, shift, turned });
    }
}

/// An orthonormal basis, element by element, of the matrices that the five equations leave.
#[inline(never)]
fn null_basis<T: Real>(x1: &[Vector3<T>; 5], x2: &[Vector3<T>; 5], basis: &mut [[T; 4]; 9]) -> Option<()> {
    let mut columns = [[T::ZERO; 5]; 9];
    for r in 0..5 {
        let (a, b) = (&x1[r].data.0[0], &x2[r].data.0[0]);
        for i in 0..3 {
            for j in 0..3 {
                columns[3 * i + j][r] = b[i] * a[j];
            }
        }
    }
    *basis = null_space_of_columns(columns)?;
    Some(())
}

/// The three equations that the coefficients of the basis matrices satisfy.
#[inline(never)]
fn hidden_rows<T: Real>(basis: &[[T; 4]; 9], rows: &mut [HiddenRow<T>; 3]) -> Option<()> {
    let mut cubics = [[T::ZERO; 20]; 10];
    essential_cubics(basis, &mut cubics);
    hidden::eliminate(&mut cubics, rows)
}

#[inline(always)]
fn narrow<T: Real, W: Real>(v: W) -> T {
    lit(v.to_f64())
}

/// Where roots are looked for.
enum Chart<T, W> {
    /// On the whole projective line.
    Line,
    /// Up to `radius` from `shift`, about which the rows stand expanded; `turned`: of the reciprocal.
    Disc { radius: W, shift: T, turned: bool },
}

/// Roots of the polynomial: first those in [-1, 1], then the reciprocals of the others.
struct Candidates<T> {
    roots: [T; 24],
    inside: usize,
    len: usize,
}

impl<T: Real> Candidates<T> {
    /// Adds roots, each times `scale`.
    #[cfg_attr(not(small), inline)]
    #[cfg_attr(small, inline(never))]
    fn extend<W: Real>(&mut self, roots: &[W], scale: W) {
        for &root in roots {
            if let Some(slot) = self.roots.get_mut(self.len) {
                *slot = narrow(root * scale);
                self.len += 1;
            }
        }
    }
}

/// Solutions, as unit vectors of the coefficients of the four basis matrices.
struct Found<T> {
    basis: [[T; 4]; 9],
    coefficients: [[T; 4]; 10],
    len: usize,
}

impl<T: Real> Found<T> {
    #[inline]
    fn new() -> Self {
        Self { basis: [[T::ZERO; 4]; 9], coefficients: [[T::ZERO; 4]; 10], len: 0 }
    }

    /// Apart from the solver, whose frame would else lie on top of this one's.
    #[inline(never)]
    fn poses(&self, x1: &[Vector3<T>; 5], x2: &[Vector3<T>; 5], poses: &mut Solutions<Pose<T>, 10>) {
        for e in self.matrices() {
            let Some(pair) = e.twisted_pair() else { continue };
            if let Some(pose) = pair.pose_with_all_in_front(x1, x2) {
                poses.push(pose);
            }
        }
    }

    #[inline]
    fn solutions(&self) -> Solutions<Essential<T>, 10> {
        let mut solutions = Solutions::new();
        self.matrices().for_each(|e| {
            solutions.push(e);
        });
        solutions
    }

    #[inline]
    fn matrices(&self) -> impl Iterator<Item = Essential<T>> {
        self.coefficients.iter().take(self.len).map(|c| {
            let mut e = [T::ZERO; 9];
            for (e, b) in e.iter_mut().zip(&self.basis) {
                *e = (b[0] * c[0] + b[1] * c[1]) + (b[2] * c[2] + b[3] * c[3]);
            }
            Essential(Matrix3::new(e[0], e[1], e[2], e[3], e[4], e[5], e[6], e[7], e[8]))
        })
    }

    /// Adds the solutions that belong to the roots of the rows' determinant. The roots that are the least determined.
    #[inline(never)]
    fn add_roots<W: Real>(
        &mut self,
        rows: &[HiddenRow<T>; 3],
        chart: Chart<T, W>,
    ) -> [LeastDetermined<W>; 2] {
        let error = lit::<W>(POLYNOMIAL_ERROR) * lit(T::EPSILON.to_f64());
        let mut polynomial = determinant::<T, W>(rows);
        let mut candidates = Candidates { roots: [T::ZERO; 24], inside: 24, len: 0 };
        let worst;
        let mut scale = W::ONE;
        match chart {
            Chart::Line => {
                let [inside, outside] = projective_roots_10(&polynomial, error);
                candidates.extend(inside.as_slice(), W::ONE);
                candidates.inside = candidates.len;
                candidates.extend(outside.as_slice(), W::ONE);
                worst = [inside.least_determined(), outside.least_determined()];
            }
            Chart::Disc { radius, .. } => {
                for c in &mut polynomial {
                    *c *= scale;
                    scale *= radius;
                }
                let roots = real_roots_10(&polynomial, error);
                candidates.extend(roots.as_slice(), radius);
                worst = [roots.least_determined(); 2];
            }
        }
        let expansion = match chart {
            Chart::Line => None,
            Chart::Disc { shift, turned, .. } => Some((shift, turned)),
        };
        self.add::<BATCH>(&candidates, rows, expansion);
        worst
    }

    /// Newton from each candidate, `L` side by side; keeps those that arrive at an essential matrix not found before.
    #[inline(always)]
    fn add<const L: usize>(
        &mut self,
        candidates: &Candidates<T>,
        rows: &[HiddenRow<T>; 3],
        expansion: Option<(T, bool)>,
    ) {
        let mut first = 0;
        for roots in candidates.roots.chunks_exact(L).take(candidates.len.div_ceil(L)) {
            let [mut num, mut den] = [Batch::<T, L>::splat(T::ONE); 2];
            for (k, &root) in roots.iter().take(L).enumerate() {
                if first + k < candidates.inside { num.0[k] = root } else { den.0[k] = root }
            }
            let mut c = unknowns(rows, num, den);
            if let Some((shift, turned)) = expansion {
                c[2] = c[2] + c[3].times(shift);
                if turned {
                    c.swap(2, 3);
                }
            }
            self.add_group(c, candidates.len - first);
            first += L;
        }
    }

    /// The first `count` of `L` candidates.
    #[inline(always)]
    fn add_group<const L: usize>(&mut self, mut c: [Batch<T, L>; 4], count: usize) {
        let (mut arrived, mut near) = ([false; L], [false; L]);
        for k in 0..L {
            arrived[k] = k >= count;
        }
        let threshold = Batch::splat(T::EPSILON);
        for _ in 0..STEPS {
            let (next, step_sq) = polish::newton_step(&self.basis, &c);
            c = polish::select(near, &c, &next);
            let small = threshold.greater(step_sq);
            for k in 0..L {
                near[k] |= small[k];
                arrived[k] |= small[k];
            }
            if arrived == [true; L] {
                break;
            }
        }
        for k in 0..L {
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
