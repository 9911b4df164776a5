//! A fundamental matrix as the model of refinement: rank 2 and length 1, seven degrees of freedom.

use nalgebra::{Matrix3, SVector, Vector3};

use super::blocks::EpipolarBlock;
use super::lm::{EpipolarModel, Manifold, Row};
use crate::Real;
use crate::geometry::pose::tangent_basis;
use crate::linalg::least_singular3;
use crate::real::sqrt;

/// `F` of rank 2 with |F| = 1 and its epipoles.
///
/// With `U = (a, b)` a basis of the plane orthogonal to `e2` and `V = (c, d)` one orthogonal to `e1`, `F = U G V'` with a
/// 2x2 matrix `G` of length 1: three parameters for `G` and two for each epipole.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FundamentalModel<T: Real> {
    /// `F`.
    pub(crate) matrix: Matrix3<T>,
    /// The unit vector with `F e1 = 0`.
    pub(crate) epipole1: Vector3<T>,
    /// The unit vector with `F' e2 = 0`.
    pub(crate) epipole2: Vector3<T>,
}

impl<T: Real> FundamentalModel<T> {
    /// The nearest matrix of rank 2; none where there is no single one.
    pub(crate) fn new(f: &Matrix3<T>) -> Option<Self> {
        let (epipole2, epipole1) = least_singular3(f)?;
        Self::project(f, &epipole1, &epipole2)
    }

    /// The part of a matrix that has the given epipoles, at length 1.
    fn project(f: &Matrix3<T>, epipole1: &Vector3<T>, epipole2: &Vector3<T>) -> Option<Self> {
        let f = f - (f * epipole1) * epipole1.transpose();
        let f = f - epipole2 * f.tr_mul(epipole2).transpose();
        let size = sqrt(f.norm_squared());
        let usable = size > T::ZERO && size <= T::MAX;
        usable.then(|| Self { matrix: f * (T::ONE / size), epipole1: *epipole1, epipole2: *epipole2 })
    }

    fn bases(&self) -> [[Vector3<T>; 2]; 2] {
        [self.epipole1, self.epipole2].map(|e| {
            let basis = tangent_basis(&e);
            [basis.column(0).into_owned(), basis.column(1).into_owned()]
        })
    }

    /// The derivatives of `F` by its parameters, row by row.
    fn tangents(&self) -> [[T; 9]; 7] {
        let mut result = [[T::ZERO; 9]; 7];
        for (tangent, direction) in result.iter_mut().zip(self.directions(&self.bases())) {
            for (row, entries) in direction.transpose().data.0.iter().zip(tangent.as_chunks_mut::<3>().0) {
                *entries = *row;
            }
        }
        result
    }

    /// The derivatives of `F` by `G` (three directions orthogonal to it), `e1` and `e2`.
    fn directions(&self, [[c, d], [a, b]]: &[[Vector3<T>; 2]; 2]) -> [Matrix3<T>; 7] {
        let (fc, fd) = (self.matrix * c, self.matrix * d);
        let (fa, fb) = (self.matrix.tr_mul(a), self.matrix.tr_mul(b));
        let g = [a.dot(&fc), a.dot(&fd), b.dot(&fc), b.dot(&fd)];
        let outer = |g: [T; 4]| a * (c * g[0] + d * g[1]).transpose() + b * (c * g[2] + d * g[3]).transpose();
        let (e1, e2) = (self.epipole1.transpose(), &self.epipole2);
        [
            outer([-g[1], g[0], -g[3], g[2]]),
            outer([-g[2], g[3], g[0], -g[1]]),
            outer([-g[3], -g[2], g[1], g[0]]),
            -(fc * e1),
            -(fd * e1),
            -(e2 * fa.transpose()),
            -(e2 * fb.transpose()),
        ]
    }
}

impl<T: Real> Manifold<T, 7> for FundamentalModel<T> {
    #[inline]
    fn matrix(&self) -> Matrix3<T> {
        self.matrix
    }

    fn retract(&self, step: &SVector<T, 7>) -> Self {
        let s = &step.data.0[0];
        let bases = self.bases();
        let directions = self.directions(&bases);
        let moved = self.matrix + directions[0] * s[0] + directions[1] * s[1] + directions[2] * s[2];
        let moved = moved + directions[3] * s[3] + directions[4] * s[4];
        let moved = moved + directions[5] * s[5] + directions[6] * s[6];
        let unit = |e: Vector3<T>| e * (T::ONE / sqrt(e.norm_squared()));
        let [[c, d], [a, b]] = bases;
        let epipole1 = unit(self.epipole1 + c * s[3] + d * s[4]);
        let epipole2 = unit(self.epipole2 + a * s[5] + b * s[6]);
        // A step too large for any matrix to be left leaves the model where it is.
        Self::project(&moved, &epipole1, &epipole2).unwrap_or(*self)
    }
}

impl<T: Real> EpipolarModel<T, 7> for FundamentalModel<T> {
    type Frame = (Matrix3<T>, [[T; 9]; 7]);
    type Sight = ();

    fn frame(&self) -> Self::Frame {
        (self.matrix, self.tangents())
    }

    #[inline(always)]
    fn sight<B: EpipolarBlock<T>>(_: &Self::Frame, _: &B, _: usize) {}

    #[inline(always)]
    fn inside<B: EpipolarBlock<T>>((matrix, _): &Self::Frame, block: &B, l: usize, limit: T) -> Option<()> {
        let (c, d) = block.residual_of(matrix, l);
        (c * c < limit * d).then_some(())
    }

    #[inline(always)]
    fn row<B: EpipolarBlock<T>>((matrix, tangents): &Self::Frame, block: &B, l: usize, _: &()) -> Row<T, 7> {
        let (c, inverse, g) = block.gradient(matrix, l);
        let along = |tangent: &[T; 9]| {
            let mut sum = g[0] * tangent[0];
            for k in 1..9 {
                sum += g[k] * tangent[k];
            }
            sum
        };
        Row { c, inverse, j: tangents.each_ref().map(along) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::refine::blocks::{BlockSlice, PlaneBlock};
    use crate::refine::lm::normal_equations;
    use crate::robust::loss::Loss;

    fn model() -> FundamentalModel<f64> {
        FundamentalModel::new(&Matrix3::new(0.3, -0.2, 0.5, 0.1, 0.4, -0.7, -0.6, 0.8, 0.2)).unwrap()
    }

    #[test]
    fn the_model_keeps_rank_and_length_in_any_step() {
        let step = SVector::<f64, 7>::from_fn(|i, _| 0.3 * (i as f64 + 1.0).sin());
        for model in [model(), model().retract(&step)] {
            assert!((model.matrix.norm() - 1.0).abs() < 1e-14);
            assert!((model.matrix * model.epipole1).norm() < 1e-14);
            assert!((model.matrix.transpose() * model.epipole2).norm() < 1e-14);
        }
    }

    #[test]
    fn tangents_are_orthogonal_to_the_scale_and_agree_with_differences() {
        let model = model();
        for (p, tangent) in model.tangents().iter().enumerate() {
            let tangent = Matrix3::from_row_slice(tangent);
            assert!(tangent.dot(&model.matrix).abs() < 1e-14);
            let mut step = SVector::<f64, 7>::zeros();
            step[p] = 1e-6;
            let difference = (model.retract(&step).matrix - model.retract(&-step).matrix) / 2e-6;
            assert!((difference - tangent).norm() < 1e-9, "{p}: {difference} {tangent}");
        }
    }

    #[test]
    fn sums_agree_with_central_differences() {
        let mut blocks: [PlaneBlock<f64>; 3] = [[[0.0; 4]; 4]; 3];
        for (i, x) in blocks.iter_mut().flatten().flatten().enumerate() {
            *x = ((i * i) as f64 * 0.7).sin();
        }
        let (model, data) = (model(), BlockSlice { blocks: &blocks, count: 11 });
        for loss in [Loss::Squared, Loss::Tukey(3.0)] {
            let sums = normal_equations::<_, _, _, 7>(data, &model, &loss);
            for p in 0..7 {
                let h = 1e-6;
                let moved = |h: f64| {
                    let mut step = SVector::<f64, 7>::zeros();
                    step[p] = h;
                    normal_equations::<_, _, _, 7>(data, &model.retract(&step), &loss).cost
                };
                let slope = (moved(h) - moved(-h)) / (4.0 * h);
                assert!((slope - sums.gradient[p]).abs() < 1e-7, "{p} {loss:?} {slope} {}", sums.gradient[p]);
            }
        }
    }
}
