//! How a relative pose moves with its correspondences: the implicit function theorem at the minimum.

use nalgebra::{Matrix3, SMatrix, Vector2, Vector3};

use super::lm::Manifold;
use super::relative_pose::PoseModel;
use crate::geometry::Pose;
use crate::geometry::pose::{skew, tangent_basis};
use crate::input::{check_finite, check_lengths};
use crate::linalg::Ldlt;
use crate::real::sqrt;
use crate::{InputError, Real};

/// The derivatives of a relative pose by the correspondences that it was fitted to.
///
/// At the minimum of `sum r_i^2 / 2` (Sampson errors) the gradient `g(theta, z)` is zero, so that
/// `d theta / d z_i = -(dg / d theta)^-1 dg / d z_i`, with all second derivatives: exact also where the residuals are not
/// small. `theta` is w of `R <- Exp(w) R`, then t along the two columns of
/// [`tangent_basis`](crate::geometry::pose::tangent_basis) of t; `z_i` is x1, y1, x2, y2.
///
/// # Input
/// `pose`: the minimum of the squared errors, as [`relative_pose`](super::relative_pose) finds it; its translation is
/// taken at length 1. Points of the planes z = 1, inliers alone. For pixels divide by the focal length.
///
/// # Returns
/// True where `jacobians[i]` was written for every correspondence; false, and nothing is written, where the
/// correspondences leave a direction of the pose open, the pose is no minimum, or its numbers are not finite.
///
/// # Errors
/// Slices of different lengths (`jacobians` too), fewer than five, a coordinate that is not finite.
///
/// # Degeneracies
/// As those of the pose: a pure rotation or a line answer false or, to rounding, large numbers.
///
/// # Accuracy
/// That of the pose as a minimum; relative to the largest entry about `EPSILON` times the condition of the equations.
///
/// # Cost
/// Two passes of about 600 operations a correspondence.
///
/// # References
/// R. M. Haralick, "Propagating covariance in computer vision", ICPR 1994; O. Faugeras, "Three-Dimensional Computer
/// Vision", MIT Press, 1993, section 5.6 (the theorem); P. Sampson, 1982 (the error).
///
/// # Examples
/// ```
/// use epipole::geometry::Pose;
/// use epipole::nalgebra::{Point3, SMatrix, Vector2, Vector3};
/// use epipole::refine::relative_pose_jacobian;
/// let pose = Pose::new(Vector3::new(-0.6, 0.0, 0.8), Vector3::new(0.0, 0.1, 0.0));
/// let (mut x1, mut x2) = ([Vector2::zeros(); 20], [Vector2::zeros(); 20]);
/// for (k, (a, b)) in x1.iter_mut().zip(&mut x2).enumerate() {
///     let i = k as f64;
///     let p = Point3::new((1.7 * i).sin() * 2.0, (2.3 * i).cos(), 5.0 + 2.0 * (0.9 * i).sin());
///     let q = pose * p;
///     (*a, *b) = (Vector2::new(p.x / p.z, p.y / p.z), Vector2::new(q.x / q.z, q.y / q.z));
/// }
/// let mut jacobians = [SMatrix::zeros(); 20];
/// assert!(relative_pose_jacobian(&pose, &x1, &x2, &mut jacobians)?);
/// // The covariance of the pose of points with a noise of one thousandth.
/// let covariance = jacobians.iter().map(|j| j * j.transpose() * 1e-6).sum::<SMatrix<f64, 5, 5>>();
/// assert!((0..5).all(|i| covariance[(i, i)] > 0.0 && covariance[(i, i)] < 1e-3));
/// # Ok::<(), epipole::InputError>(())
/// ```
pub fn relative_pose_jacobian<T: Real>(
    pose: &Pose<T>,
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    jacobians: &mut [SMatrix<T, 5, 4>],
) -> Result<bool, InputError> {
    check_lengths(x1, x2, 5)?;
    if jacobians.len() != x1.len() {
        return Err(InputError::LengthMismatch { first: x1.len(), second: jacobians.len() });
    }
    check_finite(x1, 0)?;
    check_finite(x2, 1)?;
    let Some(model) = PoseModel::of(pose) else { return Ok(false) };
    let curve = Curve::new(&model);
    let mut hessian = SMatrix::<T, 5, 5>::zeros();
    for (a, b) in x1.iter().zip(x2) {
        let r = Residual::new(&curve, a, b);
        for p in 0..5 {
            for q in 0..=p {
                let second = r.second(&r.first[p], &r.first[q], &Row::of(&curve.second[p][q], a, b));
                hessian.data.0[q][p] += r.slope[p] * r.slope[q] + r.value * second;
            }
        }
    }
    let Some(factors) = Ldlt::new(&hessian) else { return Ok(false) };
    for ((a, b), jacobian) in x1.iter().zip(x2).zip(jacobians) {
        let r = Residual::new(&curve, a, b);
        let mut mixed = SMatrix::<T, 5, 4>::zeros();
        for k in 0..4 {
            let by_point = Row::by_coordinate(&curve.matrix, a, b, k);
            let slope = r.derivative(&by_point);
            for p in 0..5 {
                let second = r.second(&r.first[p], &by_point, &Row::by_coordinate(&curve.first[p], a, b, k));
                mixed.data.0[k][p] = -(r.slope[p] * slope + r.value * second);
            }
        }
        *jacobian = factors.solve(&mixed);
    }
    Ok(true)
}

/// An essential matrix and its derivatives along the pose.
struct Curve<T: Real> {
    matrix: Matrix3<T>,
    first: [Matrix3<T>; 5],
    /// The lower triangle.
    second: [[Matrix3<T>; 5]; 5],
}

impl<T: Real> Curve<T> {
    fn new(model: &PoseModel<T>) -> Self {
        let (r, t) = (&model.rotation, &model.translation);
        let matrix = model.matrix();
        let basis = tangent_basis(t);
        let along: [Vector3<T>; 2] = [basis.column(0).into(), basis.column(1).into()];
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| skew(&axis));
        let t = skew(t);
        let mut first = [Matrix3::zeros(); 5];
        let mut second = [[Matrix3::zeros(); 5]; 5];
        for p in 0..3 {
            first[p] = t * axes[p] * r;
            for q in 0..=p {
                second[p][q] = t * (axes[p] * axes[q] + axes[q] * axes[p]) * r * T::HALF;
            }
        }
        for k in 0..2 {
            let u = skew(&along[k]);
            first[3 + k] = u * r;
            for q in 0..3 {
                second[3 + k][q] = u * axes[q] * r;
            }
            // Along the sphere t bends back to the origin.
            second[3 + k][3 + k] = -matrix;
        }
        Self { matrix, first, second }
    }
}

/// `c = x2' M x1` and the parts of both epipolar lines that its gradient consists of; linear in M.
#[derive(Clone, Copy)]
struct Row<T> {
    c: T,
    lines: [T; 4],
}

impl<T: Real> Row<T> {
    fn of(m: &Matrix3<T>, a: &Vector2<T>, b: &Vector2<T>) -> Self {
        let m = &m.data.0;
        let row = |i: usize| m[0][i] * a.x + m[1][i] * a.y + m[2][i];
        let column = |j: usize| m[j][0] * b.x + m[j][1] * b.y + m[j][2];
        let (l0, l1, l2) = (row(0), row(1), row(2));
        Self { c: b.x * l0 + b.y * l1 + l2, lines: [l0, l1, column(0), column(1)] }
    }

    /// Its derivative by x1, y1, x2 or y2.
    fn by_coordinate(m: &Matrix3<T>, a: &Vector2<T>, b: &Vector2<T>, k: usize) -> Self {
        let full = Self::of(m, a, b);
        let (m, o) = (&m.data.0, T::ZERO);
        match k {
            0 => Self { c: full.lines[2], lines: [m[0][0], m[0][1], o, o] },
            1 => Self { c: full.lines[3], lines: [m[1][0], m[1][1], o, o] },
            2 => Self { c: full.lines[0], lines: [o, o, m[0][0], m[1][0]] },
            _ => Self { c: full.lines[1], lines: [o, o, m[0][1], m[1][1]] },
        }
    }

    fn dot(&self, other: &Self) -> T {
        let (a, b) = (&self.lines, &other.lines);
        (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3])
    }
}

/// `r = c / sqrt(d)`, `d` the squared length of the gradient of c, and its derivatives along the pose.
struct Residual<T> {
    row: Row<T>,
    first: [Row<T>; 5],
    /// 1 / d, its square root; both zero where a point lies on both epipoles.
    inverse: T,
    root: T,
    value: T,
    slope: [T; 5],
}

impl<T: Real> Residual<T> {
    fn new(curve: &Curve<T>, a: &Vector2<T>, b: &Vector2<T>) -> Self {
        let row = Row::of(&curve.matrix, a, b);
        let d = row.dot(&row);
        let inverse = if d > T::MIN_POSITIVE { T::ONE / d } else { T::ZERO };
        let root = sqrt(inverse);
        let first = curve.first.each_ref().map(|lines| Row::of(lines, a, b));
        let mut residual = Self { row, first, inverse, root, value: row.c * root, slope: [T::ZERO; 5] };
        for p in 0..5 {
            residual.slope[p] = residual.derivative(&first[p]);
        }
        residual
    }

    /// The derivative of r in a direction in which `c` and the lines change by `x`.
    fn derivative(&self, x: &Row<T>) -> T {
        (x.c - self.row.c * self.row.dot(x) * self.inverse) * self.root
    }

    /// The second derivative in two directions in which they change by `x` and `y`, and together by `xy`.
    fn second(&self, x: &Row<T>, y: &Row<T>, xy: &Row<T>) -> T {
        let (dx, dy) = (self.row.dot(x), self.row.dot(y));
        let c = self.row.c;
        let dxy = x.dot(y) + self.row.dot(xy);
        let bend = x.c * dy + y.c * dx + c * dxy - (T::ONE + T::TWO) * c * dx * dy * self.inverse;
        (xy.c - bend * self.inverse) * self.root
    }
}
