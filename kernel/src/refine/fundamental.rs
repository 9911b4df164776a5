//! A fundamental matrix as the model of refinement: seven degrees of freedom.
//!
//! `F = U diag(cos a, sin a, 0) V'` with two rotations and an angle stays singular whatever the step.
//!
//! # References
//! A. Bartoli, P. Sturm, "Nonlinear estimation of the fundamental matrix with minimal parameters", TPAMI 2004.

use nalgebra::{Matrix3, SVector, Vector3};

use super::lm::Manifold;
use super::relative_pose::cayley;
use crate::Real;
use crate::linalg::svd3;
use crate::real::{abs, sqrt};

/// The factors of a fundamental matrix with |F| = 1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FundamentalModel<T: Real> {
    u: Matrix3<T>,
    v: Matrix3<T>,
    /// The two singular values, of which the squares sum to 1.
    s: [T; 2],
}

impl<T: Real> FundamentalModel<T> {
    /// The model nearest to a matrix; none where the matrix is not finite or of rank below 2.
    pub(crate) fn new(f: &Matrix3<T>) -> Option<Self> {
        let svd = svd3(f)?;
        let size = sqrt(svd.s.x * svd.s.x + svd.s.y * svd.s.y);
        if !(svd.s.y > T::EPSILON * svd.s.x && size > T::ZERO) {
            return None;
        }
        Some(Self { u: svd.u, v: svd.v, s: [svd.s.x / size, svd.s.y / size] })
    }

    fn product(&self, s: [T; 2]) -> Matrix3<T> {
        let (u, v) = (&self.u, &self.v);
        (u.column(0) * v.column(0).transpose()) * s[0] + (u.column(1) * v.column(1).transpose()) * s[1]
    }
}

impl<T: Real> Manifold<T, 7> for FundamentalModel<T> {
    fn matrix(&self) -> Matrix3<T> {
        self.product(self.s)
    }

    fn tangents(&self) -> [[T; 9]; 7] {
        let f = self.matrix();
        let mut result = [[T::ZERO; 9]; 7];
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        let row_major = |m: &Matrix3<T>| {
            let m = &m.data.0;
            [m[0][0], m[1][0], m[2][0], m[0][1], m[1][1], m[2][1], m[0][2], m[1][2], m[2][2]]
        };
        for (k, axis) in axes.iter().enumerate() {
            let skew = crate::geometry::pose::skew::<T>(axis);
            result[k] = row_major(&(skew * f));
            result[3 + k] = row_major(&(f * -skew));
        }
        result[6] = row_major(&self.product([-self.s[1], self.s[0]]));
        result
    }

    fn retract(&self, step: &SVector<T, 7>) -> Self {
        let d = &step.data.0[0];
        let [a, b] = self.s;
        let turned = [a - b * d[6], b + a * d[6]];
        let size = T::ONE / sqrt(turned[0] * turned[0] + turned[1] * turned[1]);
        Self {
            u: cayley(&Vector3::new(d[0], d[1], d[2])) * self.u,
            v: cayley(&Vector3::new(d[3], d[4], d[5])) * self.v,
            s: [turned[0] * size, turned[1] * size],
        }
    }
}

/// True where every point of a sample lies on the same side in the oriented epipolar sense: with `e` the epipole of
/// view 2, `e x x2` and `F x1` point the same way for all or the opposite way for all.
///
/// # References
/// O. Chum, T. Werner, J. Matas, "Epipolar geometry estimation via RANSAC benefits from the oriented epipolar
/// constraint", ICPR 2004.
pub(crate) fn oriented<T: Real>(f: &Matrix3<T>, x1: &[Vector3<T>], x2: &[Vector3<T>]) -> bool {
    let columns = [f.column(0).into_owned(), f.column(1).into_owned(), f.column(2).into_owned()];
    let products =
        [columns[1].cross(&columns[2]), columns[2].cross(&columns[0]), columns[0].cross(&columns[1])];
    let mut e = products[0];
    for p in &products[1..] {
        if p.norm_squared() > e.norm_squared() {
            e = *p;
        }
    }
    let (mut positive, mut negative) = (false, false);
    for (a, b) in x1.iter().zip(x2) {
        let side = e.cross(b).dot(&(f * a));
        positive |= side > T::ZERO;
        negative |= side < T::ZERO || abs(side) > T::MAX;
    }
    !(positive && negative)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tangents_agree_with_central_differences() {
        let m = Matrix3::<f64>::new(0.3, -0.7, 0.2, 0.9, 0.1, -0.4, 0.5, -0.6, 0.8);
        let model = FundamentalModel::new(&m).unwrap();
        assert!(model.matrix().determinant().abs() < 1e-15);
        for (k, tangent) in model.tangents().iter().enumerate() {
            let moved = |h: f64| {
                let mut step = SVector::<f64, 7>::zeros();
                step[k] = h;
                model.retract(&step).matrix()
            };
            let slope = (moved(1e-6) - moved(-1e-6)) / 2e-6;
            for i in 0..3 {
                for j in 0..3 {
                    assert!((slope[(i, j)] - tangent[3 * i + j]).abs() < 1e-9, "{k}");
                }
            }
        }
    }
}
