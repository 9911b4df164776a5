//! Relative pose of two calibrated views from five points.

mod cubics;
mod hidden;
mod polish;

use nalgebra::{Matrix3, Vector3};

use crate::geometry::{Essential, Pose};
use crate::linalg::null_space;
use crate::linalg::poly::real_roots_10;
use crate::real::lit;
const NEAR: f64 = 64.0;
const STEPS: u32 = 3;
const DUP: f64 = 64.0;
use crate::{Real, Solutions};

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
/// # References
/// D. Nistér, "An efficient solution to the five-point relative pose problem", IEEE Transactions on Pattern Analysis
/// and Machine Intelligence, 2004.
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
    let mut solutions = Solutions::new();
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
    let Some(null) = null_space::<T, 5, 9, 4>(&rows) else { return solutions };
    let basis: [[T; 4]; 9] = core::array::from_fn(|i| {
        let n = [null[0][i], null[1][i], null[2][i], null[3][i]];
        let h = T::HALF;
        let (a, b, c, d) = ((n[0] + n[1]) * h, (n[0] - n[1]) * h, (n[2] + n[3]) * h, (n[2] - n[3]) * h);
        [a + c, b + d, a - c, b - d]
    });
    let Some(hidden) = hidden::eliminate(cubics::essential_cubics(&basis)) else { return solutions };
    let near = <W as Real>::from_f64(NEAR * T::EPSILON.to_f64());
    let [inside, outside] = real_roots_10(&hidden::determinant::<T, W>(&hidden), near);
    let narrow = |v: &W| <T as Real>::from_f64(v.to_f64());
    let inside = inside.as_slice().iter().map(|x| [narrow(x), T::ONE]);
    let outside = outside.as_slice().iter().map(|x| [T::ONE, narrow(x)]);
    let mut kept = [[T::ZERO; 4]; 10];
    for root in inside.chain(outside) {
        let Some(mut c) = hidden::unknowns(&hidden, root) else { continue };
        let mut step_sq = T::MAX;
        for _ in 0..STEPS {
            (c, step_sq) = polish::newton_step(&basis, &c);
            if step_sq <= T::EPSILON {
                break;
            }
        }
        if step_sq <= T::EPSILON {
            let mut twice = false;
            for k in kept.iter() {
                let mut d = T::ZERO;
                let mut e = T::ZERO;
                for i in 0..4 {
                    d += (k[i] - c[i]) * (k[i] - c[i]);
                    e += (k[i] + c[i]) * (k[i] + c[i]);
                }
                twice |= d < lit::<T>(DUP) * T::EPSILON || e < lit::<T>(DUP) * T::EPSILON;
            }
            if twice {
                continue;
            }
            let e = polish::combine(&basis, &c);
            if let Some(k) = kept.get_mut(solutions.len()) {
                *k = c;
            }
            solutions.push(Essential(Matrix3::new(e[0], e[1], e[2], e[3], e[4], e[5], e[6], e[7], e[8])));
        }
    }
    solutions
}
