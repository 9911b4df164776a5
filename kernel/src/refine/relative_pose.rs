//! A relative pose as the model of refinement: rotation and direction of translation, five degrees of freedom.

use nalgebra::{ArrayStorage, Matrix3, SVector, Vector3};

use super::blocks::{EpipolarBlock, Frame, Sight, Slopes};
use super::lm::{EpipolarModel, Manifold, NormalEquations, Row};
use crate::Real;
use crate::geometry::Pose;
use crate::geometry::pose::{from_parts, tangent_basis};
use crate::linalg::vec3::{apart_sq, dot, scaled};
use crate::linalg::{cross, product};
use crate::real::sqrt;

/// A rotation, a unit translation, and the scales between normalised coordinates and the blocks' coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PoseModel<T: Real> {
    /// `R`.
    pub(crate) rotation: Matrix3<T>,
    /// `t`, of length 1.
    pub(crate) translation: Vector3<T>,
    /// Block coordinates are these scales times normalised ones.
    pub(crate) scales: Scales<T>,
}

/// Coordinates of the blocks over normalised coordinates: (x, y) of view 1 and of view 2. All 1 for bearings and
/// where both cameras have one focal length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scales<T> {
    /// View 1.
    pub(crate) view1: [T; 2],
    /// View 2.
    pub(crate) view2: [T; 2],
    /// Squared sine of the angle up to which rays count as parallel, so that their depths say nothing.
    pub(crate) parallel_sq: T,
    /// Squared distance from view 1, in baselines, of the nearest points that take part; zero where all do.
    pub(crate) nearest_sq: T,
}

impl<T: Real> Scales<T> {
    /// No scaling.
    #[must_use]
    pub(crate) fn unit() -> Self {
        Self { view1: [T::ONE; 2], view2: [T::ONE; 2], parallel_sq: T::ZERO, nearest_sq: T::ZERO }
    }

    /// `D2^-1 E D1^-1` with `D = diag(scales, 1)`.
    #[cfg_attr(not(small), inline)]
    #[cfg_attr(small, inline(never))]
    fn apply(&self, e: &Matrix3<T>) -> Matrix3<T> {
        between(e, self.inverse2(), self.inverse1())
    }

    /// `D2 H D1^-1`: a homography between normalised coordinates, for those of the blocks.
    #[cfg_attr(small, inline(never))]
    pub(crate) fn transfer(&self, h: &Matrix3<T>) -> Matrix3<T> {
        between(h, self.view2, self.inverse1())
    }

    /// `D2^-1 H D1`: the inverse of [`Scales::transfer`].
    pub(crate) fn transfer_back(&self, h: &Matrix3<T>) -> Matrix3<T> {
        between(h, self.inverse2(), self.view1)
    }

    /// Normalised coordinates over those of the blocks, view 1.
    #[inline]
    #[must_use]
    pub(crate) fn inverse1(&self) -> [T; 2] {
        [T::ONE / self.view1[0], T::ONE / self.view1[1]]
    }

    /// Normalised coordinates over those of the blocks, view 2.
    #[inline]
    #[must_use]
    pub(crate) fn inverse2(&self) -> [T; 2] {
        [T::ONE / self.view2[0], T::ONE / self.view2[1]]
    }
}

/// `diag(b, 1) M diag(a, 1)`
#[cfg_attr(not(small), inline(always))]
#[cfg_attr(small, inline(never))]
fn between<T: Real>(m: &Matrix3<T>, b: [T; 2], a: [T; 2]) -> Matrix3<T> {
    let m = &m.data.0;
    let column = |j: usize, s: T| [m[j][0] * b[0] * s, m[j][1] * b[1] * s, m[j][2] * s];
    Matrix3::from_data(ArrayStorage([column(0, a[0]), column(1, a[1]), column(2, T::ONE)]))
}

/// A rotation near `Exp(w)`: exact as a rotation, equal to the exponential to second order (Cayley's map of w / 2).
#[cfg_attr(not(small), inline)]
#[cfg_attr(small, inline(never))]
pub(crate) fn cayley<T: Real>(w: &Vector3<T>) -> Matrix3<T> {
    let h = scaled(&w.data.0[0], T::HALF);
    let s = T::TWO / (T::ONE + dot(&h, &h));
    let [x, y, z] = h;
    let one = T::ONE;
    Matrix3::new(
        one - s * (y * y + z * z),
        s * (x * y - z),
        s * (x * z + y),
        s * (x * y + z),
        one - s * (x * x + z * z),
        s * (y * z - x),
        s * (x * z - y),
        s * (y * z + x),
        one - s * (x * x + y * y),
    )
}

impl<T: Real> PoseModel<T> {
    /// The pose `X2 = R X1 + t`, |t| = 1.
    #[must_use]
    pub(crate) fn pose(&self) -> Pose<T> {
        from_parts(&self.rotation, &self.translation)
    }

    /// Squared distance of the rotation (the angle's square, of a small angle) and of the translation.
    #[cfg_attr(small, inline(never))]
    pub(crate) fn distance_sq(&self, other: &Self) -> T {
        let mut turn = T::ZERO;
        for (a, b) in self.rotation.data.0.iter().zip(&other.rotation.data.0) {
            turn += apart_sq(a, b);
        }
        turn * T::HALF + apart_sq(&self.translation.data.0[0], &other.translation.data.0[0])
    }

    /// `E = [t]x R`, column by column.
    #[inline]
    fn essential(&self) -> Matrix3<T> {
        cross(&self.translation, &self.rotation)
    }
}

/// The axes of a frame along the translation, and the views in it.
pub(crate) struct PoseFrame<T: Real> {
    axes: Matrix3<T>,
    pub(crate) views: Frame<T>,
    /// As in [`Scales`].
    pub(crate) parallel_sq: T,
    /// As in [`Scales`].
    pub(crate) nearest_sq: T,
}

impl<T: Real> PoseFrame<T> {
    /// Whether a right match may be where the rays meet: in front of both cameras, and not too near.
    #[cfg_attr(not(small), inline(always))]
    #[cfg_attr(small, inline(never))]
    pub(crate) fn admits(&self, sight: &Sight<T>) -> bool {
        sight.in_front(self.parallel_sq) && (self.nearest_sq == T::ZERO || sight.beyond(self.nearest_sq))
    }
}

impl<T: Real> Manifold<T, 5> for PoseModel<T> {
    #[cfg_attr(not(small), inline)]
    #[cfg_attr(small, inline(never))]
    fn matrix(&self) -> Matrix3<T> {
        self.scales.apply(&self.essential())
    }

    #[cfg_attr(not(small), inline)]
    #[cfg_attr(small, inline(never))]
    fn retract(&self, step: &SVector<T, 5>) -> Self {
        let s = &step.data.0[0];
        let basis = tangent_basis(&self.translation);
        let ([u, v], t) = (&basis.data.0, &self.translation.data.0[0]);
        let at = |k: usize| t[k] + u[k] * s[3] + v[k] * s[4];
        let t = [at(0), at(1), at(2)];
        Self {
            rotation: product(&cayley(&Vector3::new(s[0], s[1], s[2])), &self.rotation),
            translation: scaled(&t, T::ONE / sqrt(dot(&t, &t))).into(),
            scales: self.scales,
        }
    }
}

impl<T: Real> EpipolarModel<T, 5> for PoseModel<T> {
    type Frame = PoseFrame<T>;
    type Sight = Sight<T>;

    fn frame(&self) -> PoseFrame<T> {
        let [u, v] = tangent_basis(&self.translation).data.0;
        let axes = Matrix3::from_data(ArrayStorage([u, v, self.translation.data.0[0]]));
        let (s1, s2) = (self.scales.inverse1(), self.scales.inverse2());
        let (mut view1, mut view2) = (product(&axes.transpose(), &self.rotation), axes);
        for i in 0..3 {
            for k in 0..2 {
                view1.data.0[k][i] *= s1[k];
                view2.data.0[i][k] *= s2[k];
            }
        }
        let Scales { parallel_sq, nearest_sq, .. } = self.scales;
        PoseFrame { axes, views: Frame { view1, view2 }, parallel_sq, nearest_sq }
    }

    #[inline(always)]
    fn sight<B: EpipolarBlock<T>>(frame: &PoseFrame<T>, block: &B, l: usize) -> Sight<T> {
        block.sight(&frame.views, l)
    }

    #[inline(always)]
    fn inside<B: EpipolarBlock<T>>(frame: &PoseFrame<T>, block: &B, l: usize, limit: T) -> Option<Sight<T>> {
        let sight = block.sight(&frame.views, l);
        (sight.c * sight.c < limit * sight.d && frame.admits(&sight)).then_some(sight)
    }

    /// By a rotation of the frame, and by the translation along its first two axes:
    /// `sqrt(d) dr = p (dE y) - x (dE z)` with `p = x - a`, where `dE y = e3 x (w x y)` or `e_k x y`.
    #[inline(always)]
    fn row<B: EpipolarBlock<T>>(frame: &PoseFrame<T>, block: &B, l: usize, sight: &Sight<T>) -> Row<T, 5> {
        let &Sight { y, x, c, .. } = sight;
        let Slopes { inverse, z, a } = block.slopes(&frame.views, l, sight);
        let p = [x[0] - a[0], x[1] - a[1], x[2] - a[2]];
        let j = [
            p[0] * y[2] - x[0] * z[2],
            p[1] * y[2] - x[1] * z[2],
            (x[0] * z[0] + x[1] * z[1]) - (p[0] * y[0] + p[1] * y[1]),
            (y[1] * p[2] - y[2] * p[1]) - (z[1] * x[2] - z[2] * x[1]),
            (y[2] * p[0] - y[0] * p[2]) - (z[2] * x[0] - z[0] * x[2]),
        ];
        Row { c, inverse, j }
    }

    fn turn_back(frame: &PoseFrame<T>, sums: &mut NormalEquations<T, 5>) {
        let axes = &frame.axes.data.0;
        let turn = |v: [T; 3]| {
            let row = |i: usize| axes[0][i] * v[0] + axes[1][i] * v[1] + axes[2][i] * v[2];
            [row(0), row(1), row(2)]
        };
        let columns = &mut sums.hessian.data.0;
        for column in columns.iter_mut().chain(&mut sums.gradient.data.0) {
            [column[0], column[1], column[2]] = turn([column[0], column[1], column[2]]);
        }
        for p in 0..5 {
            let row = turn([columns[0][p], columns[1][p], columns[2][p]]);
            for q in 0..3 {
                columns[q][p] = row[q];
            }
        }
    }
}
