//! Refinement of one model of two views on the caller's points, which are copied nowhere.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::blocks::{Block, BlockSlice, PlaneBlock};
use super::fundamental::FundamentalModel;
use super::homography::{HomographyModel, transfer_equations};
use super::lm::{Manifold, Minimum, NormalEquations, descend, normal_equations};
use super::relative_pose::{PoseModel, Scales};
use crate::geometry::pose::rotation_matrix;
use crate::geometry::{Fundamental, Homography, Pose};
use crate::input::{check_finite, check_lengths};
use crate::linalg::{LANES, pieces};
use crate::real::{abs, from_u32, is_finite, lit, max, sqrt};
use crate::robust::loss::Loss;
use crate::{InputError, Real};

/// Options of [`relative_pose`], [`homography`] and [`fundamental`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct RefineTwoViewOptions<T> {
    /// Loss of an error in the unit of the points. Default: squared.
    pub loss: Loss<T>,
    /// Passes over the correspondences at the most. Default 15.
    pub max_passes: u32,
}

impl<T: Real> Default for RefineTwoViewOptions<T> {
    fn default() -> Self {
        Self { loss: Loss::Squared, max_passes: 15 }
    }
}

/// A refined model.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct RefinedTwoView<M, T> {
    /// The model. The start where nothing could be improved.
    pub model: M,
    /// Sum of the losses, in the squared unit of the points.
    pub cost: T,
    /// The cost at the start.
    pub initial_cost: T,
    /// How many correspondences have a weight above zero.
    pub active: u32,
    /// Passes over the correspondences.
    pub passes: u32,
}

/// Blocks filled at a time.
const CHUNK: usize = 8;

/// A similarity of each view with one scale for both: coordinates near 1 keep the digits of single precision, and errors
/// in both views weigh alike.
#[derive(Clone, Copy)]
struct Frame<T> {
    centres: [[T; 2]; 2],
    /// Units of the points a unit of the frame.
    scale: T,
}

impl<T: Real> Frame<T> {
    /// The points as they are.
    fn none() -> Self {
        Self { centres: [[T::ZERO; 2]; 2], scale: T::ONE }
    }

    /// About the means, in units of the largest distance along an axis.
    fn about_means(views: [&[Vector2<T>]; 2]) -> Self {
        let share = T::ONE / from_u32(core::cmp::max(views[0].len(), 1) as u32);
        let centres = views.map(|view| {
            let sum = view.iter().fold([T::ZERO; 2], |sum, p| [sum[0] + p.x * share, sum[1] + p.y * share]);
            sum.map(|c| if is_finite(c) { c } else { T::ZERO })
        });
        let mut scale = T::ZERO;
        for (view, c) in views.iter().zip(centres) {
            for p in *view {
                scale = max(scale, max(abs(p.x - c[0]), abs(p.y - c[1])));
            }
        }
        Self { centres, scale: if scale > T::MIN_POSITIVE && is_finite(scale) { scale } else { T::ONE } }
    }

    /// Units of view `k` from the frame's.
    fn outward(&self, k: usize) -> Matrix3<T> {
        let c = if k == 0 { self.centres[0] } else { self.centres[1] };
        let o = T::ZERO;
        Matrix3::new(self.scale, o, c[0], o, self.scale, c[1], o, o, T::ONE)
    }

    /// The frame's units from those of view `k`.
    fn inward(&self, k: usize) -> Matrix3<T> {
        let c = if k == 0 { self.centres[0] } else { self.centres[1] };
        let (o, s) = (T::ZERO, T::ONE / self.scale);
        Matrix3::new(s, o, -c[0] * s, o, s, -c[1] * s, o, o, T::ONE)
    }
}

fn scaled<T: Real>(loss: &Loss<T>, factor: T) -> Loss<T> {
    match *loss {
        Loss::Squared => Loss::Squared,
        Loss::Truncated(k) => Loss::Truncated(k * factor),
        Loss::Huber(k) => Loss::Huber(k * factor),
        Loss::Cauchy(k) => Loss::Cauchy(k * factor),
        Loss::Tukey(k) => Loss::Tukey(k * factor),
        Loss::GemanMcClure(k) => Loss::GemanMcClure(k * factor),
    }
}

/// Minimises a loss over a model, with the points filled into blocks a few at a time. With fewer than `least` in play the
/// start stays.
fn minimise<T: Real, M: Manifold<T, P>, const P: usize>(
    [x1, x2]: [&[Vector2<T>]; 2],
    frame: &Frame<T>,
    start: &M,
    least: u32,
    options: &RefineTwoViewOptions<T>,
    equations: impl Fn(BlockSlice<'_, PlaneBlock<T>>, &M, &Loss<T>) -> NormalEquations<T, P>,
) -> RefinedTwoView<M, T> {
    let inverse = T::ONE / frame.scale;
    let loss = scaled(&options.loss, inverse);
    let [a, b] = frame.centres;
    let pass = |model: &M| {
        let mut sums = NormalEquations::zero();
        for (x1, x2) in pieces::<_, { CHUNK * LANES }>(x1).zip(pieces::<_, { CHUNK * LANES }>(x2)) {
            let mut blocks = [PlaneBlock::zero(); CHUNK];
            for (block, (x1, x2)) in blocks.iter_mut().zip(pieces::<_, LANES>(x1).zip(pieces::<_, LANES>(x2)))
            {
                for (lane, (p, q)) in x1.iter().zip(x2).enumerate() {
                    let point = [p.x - a[0], p.y - a[1], q.x - b[0], q.y - b[1]].map(|x| x * inverse);
                    block.write_lane(lane, &point);
                }
            }
            let filled = blocks.get(..x1.len().div_ceil(LANES)).unwrap_or(&blocks);
            sums.accumulate(&equations(BlockSlice { blocks: filled, count: x1.len() }, model, &loss));
        }
        sums
    };
    let initial_cost = pass(start).cost;
    let passes = core::cmp::max(options.max_passes, 2) - 1;
    let minimum: Minimum<M, T, P> = descend(start, least, passes, T::EPSILON * lit(4.0), pass, M::retract);
    let unit = frame.scale * frame.scale;
    RefinedTwoView {
        model: minimum.model,
        cost: minimum.equations.cost * unit,
        initial_cost: initial_cost * unit,
        active: minimum.equations.active,
        passes: minimum.passes + 1,
    }
}

fn check<T: Real>(x1: &[Vector2<T>], x2: &[Vector2<T>], needed: usize) -> Result<(), InputError> {
    check_lengths(x1, x2, needed)?;
    check_finite(x1, 0)?;
    check_finite(x2, 1)
}

/// The relative pose of least robust Sampson error near a start: `X2 = R X1 + t`, |t| = 1.
///
/// `min sum rho(r^2)`, `r = x2' E x1 / |(E x1, E' x2)_xy|`, `E = [t]x R`, by Levenberg and Marquardt's method with analytic
/// derivatives over five degrees of freedom.
///
/// # Input
/// Points of the planes z = 1, at least five, at most 2^32 - 1; a start with a translation that is not zero, of any length.
///
/// # Returns
/// The pose with |t| = 1; none where the start's numbers are not finite or its translation is zero.
///
/// # Errors
/// Different lengths, fewer than five, a coordinate that is not finite.
///
/// # Degeneracies
/// Directions that the points leave open stay as they started. A point behind a camera has no weight.
///
/// # Accuracy
/// The minimum to rounding, if the passes suffice.
///
/// # Cost
/// At most `max_passes` passes.
///
/// # References
/// P. Sampson, "Fitting conic sections to very scattered data", 1982; D. Marquardt, "An algorithm for least-squares
/// estimation of nonlinear parameters", SIAM Journal, 1963.
///
/// # Examples
/// ```
/// use epipole::geometry::Pose;
/// use epipole::nalgebra::{Point3, Vector2, Vector3};
/// use epipole::refine::{RefineTwoViewOptions, relative_pose};
/// let truth = Pose::new(Vector3::new(-0.6, 0.0, 0.8), Vector3::new(0.0, 0.1, 0.0));
/// let (mut x1, mut x2) = ([Vector2::zeros(); 20], [Vector2::zeros(); 20]);
/// for (k, (a, b)) in x1.iter_mut().zip(&mut x2).enumerate() {
///     let i = k as f64;
///     let p = Point3::new((1.7 * i).sin() * 2.0, (2.3 * i).cos(), 5.0 + 2.0 * (0.9 * i).sin());
///     let q = truth * p;
///     (*a, *b) = (Vector2::new(p.x / p.z, p.y / p.z), Vector2::new(q.x / q.z, q.y / q.z));
/// }
/// let start = Pose::new(Vector3::new(-0.5, 0.1, 0.8), Vector3::new(0.02, 0.09, 0.0));
/// let refined = relative_pose(&x1, &x2, &start, &RefineTwoViewOptions::default())?.unwrap();
/// assert!((refined.model.to_homogeneous() - truth.to_homogeneous()).norm() < 1e-9);
/// # Ok::<(), epipole::InputError>(())
/// ```
pub fn relative_pose<T: Real>(
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    start: &Pose<T>,
    options: &RefineTwoViewOptions<T>,
) -> Result<Option<RefinedTwoView<Pose<T>, T>>, InputError> {
    check(x1, x2, 5)?;
    let Some(model) = PoseModel::of(start) else { return Ok(None) };
    let refined = minimise([x1, x2], &Frame::none(), &model, 5, options, normal_equations::<T, _, _, 5>);
    Ok(Some(refined.map(|model| model.pose())))
}

/// The homography of least robust error near a start: `x2 ~ H x1`.
///
/// `min sum rho(2 e' (I + J J')^-1 e)` with the transfer error `e = H x1 - x2` and J the Jacobian of the transferred
/// point: to first order the squared distance to the nearest pair that H maps onto one another, doubled, so that it is
/// `|e|^2` where the scale is kept. Eight degrees of freedom.
///
/// # Input
/// Pixels or other points of two planes, at least four; a regular start.
///
/// # Returns
/// The homography with Frobenius norm 1; none where the start is singular or its numbers leave the range of `T`.
///
/// # Errors
/// Different lengths, fewer than four, a coordinate that is not finite.
///
/// # Degeneracies
/// Directions that the points leave open (three on a line of four) stay as they started.
///
/// # Accuracy
/// The minimum to rounding, in coordinates about the points' means.
///
/// # Cost
/// At most `max_passes` passes.
///
/// # References
/// O. Chum, T. Pajdla, P. Sturm, "The geometric error for homographies", CVIU 2005; D. Marquardt, 1963.
///
/// # Examples
/// ```
/// use epipole::geometry::Homography;
/// use epipole::nalgebra::{Matrix3, Vector2, Vector3};
/// use epipole::refine::{RefineTwoViewOptions, homography};
/// let truth = Matrix3::new(1.0, 0.02, 5.0, -0.01, 0.98, -3.0, 1e-5, 2e-5, 1.0);
/// let x1 = [(0.0, 0.0), (600.0, 10.0), (590.0, 400.0), (20.0, 380.0), (300.0, 150.0)].map(|(x, y)| Vector2::new(x, y));
/// let x2 = x1.map(|x| { let y = truth * Vector3::new(x.x, x.y, 1.0); Vector2::new(y.x / y.z, y.y / y.z) });
/// let start = Homography(Matrix3::identity());
/// let refined = homography(&x1, &x2, &start, &RefineTwoViewOptions::default())?.unwrap();
/// assert!(refined.cost < 1e-15 && refined.initial_cost > 10.0);
/// # Ok::<(), epipole::InputError>(())
/// ```
pub fn homography<T: Real>(
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    start: &Homography<T>,
    options: &RefineTwoViewOptions<T>,
) -> Result<Option<RefinedTwoView<Homography<T>, T>>, InputError> {
    check(x1, x2, 4)?;
    let frame = Frame::about_means([x1, x2]);
    let Some(model) = HomographyModel::new(&(frame.inward(1) * start.0 * frame.outward(0))) else {
        return Ok(None);
    };
    let refined = minimise([x1, x2], &frame, &model, 4, options, transfer_equations::<T, _, _, 8>);
    Ok(unit(&(frame.outward(1) * refined.model.0 * frame.inward(0))).map(|h| refined.map(|_| Homography(h))))
}

/// The fundamental matrix of least robust Sampson error near a start: `x2' F x1 = 0`, of rank 2.
///
/// `min sum rho(r^2)`, `r = x2' F x1 / |(F x1, F' x2)_xy|`, over the seven degrees of freedom of the matrices of rank 2 and
/// length 1.
///
/// # Input
/// Pixels, at least seven; a start, of any rank and scale, whose nearest matrix of rank 2 is unique.
///
/// # Returns
/// The matrix with Frobenius norm 1; none where the start has no nearest one, or numbers leave the range of `T`.
///
/// # Errors
/// Different lengths, fewer than seven, a coordinate that is not finite.
///
/// # Degeneracies
/// Points of a plane leave two directions open, which stay as they started.
///
/// # Accuracy
/// The minimum to rounding, in coordinates about the points' means.
///
/// # Cost
/// At most `max_passes` passes.
///
/// # References
/// P. Sampson, "Fitting conic sections to very scattered data", 1982; A. Bartoli, P. Sturm, "Nonlinear estimation of the
/// fundamental matrix with minimal parameters", IEEE TPAMI 2004; D. Marquardt, 1963.
///
/// # Examples
/// ```
/// use epipole::geometry::Fundamental;
/// use epipole::nalgebra::{Matrix3, Vector2};
/// use epipole::refine::{RefineTwoViewOptions, fundamental};
/// // A camera that moved sideways: corresponding points lie on one row.
/// let mut x1 = [Vector2::zeros(); 12];
/// for (k, x) in x1.iter_mut().enumerate() {
///     *x = Vector2::new((k * 97 % 640) as f64, (k * 61 % 480) as f64);
/// }
/// let mut x2 = x1;
/// for (k, x) in x2.iter_mut().enumerate() {
///     x.x -= 10.0 + (k * 7 % 20) as f64;
/// }
/// let start = Fundamental(Matrix3::new(0.0, 1e-5, 0.0, 0.0, 0.0, -1.0, 1e-3, 1.0, 0.0));
/// let refined = fundamental(&x1, &x2, &start, &RefineTwoViewOptions::default())?.unwrap();
/// assert!(refined.cost < 1e-12 && refined.initial_cost > 1e-3);
/// # Ok::<(), epipole::InputError>(())
/// ```
pub fn fundamental<T: Real>(
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    start: &Fundamental<T>,
    options: &RefineTwoViewOptions<T>,
) -> Result<Option<RefinedTwoView<Fundamental<T>, T>>, InputError> {
    check(x1, x2, 7)?;
    let frame = Frame::about_means([x1, x2]);
    let framed = frame.outward(1).transpose() * start.0 * frame.outward(0);
    let Some(model) = unit(&framed).and_then(|f| FundamentalModel::new(&f)) else { return Ok(None) };
    let refined = minimise([x1, x2], &frame, &model, 7, options, normal_equations::<T, _, _, 7>);
    let f = frame.inward(1).transpose() * refined.model.matrix * frame.inward(0);
    Ok(unit(&f).map(|f| refined.map(|_| Fundamental(f))))
}

/// A matrix at length 1; none where it is zero or leaves the range of `T`.
fn unit<T: Real>(m: &Matrix3<T>) -> Option<Matrix3<T>> {
    let size = m.iter().fold(T::ZERO, |size, &x| max(size, abs(x)));
    if !(size > T::MIN_POSITIVE && is_finite(m.sum())) {
        return None;
    }
    let m = m * (T::ONE / size);
    let m = m * (T::ONE / sqrt(m.norm_squared()));
    is_finite(m.norm_squared()).then_some(m)
}

impl<M, T> RefinedTwoView<M, T> {
    fn map<N>(self, of: impl FnOnce(M) -> N) -> RefinedTwoView<N, T> {
        let Self { model, cost, initial_cost, active, passes } = self;
        RefinedTwoView { model: of(model), cost, initial_cost, active, passes }
    }
}

impl<T: Real> PoseModel<T> {
    /// Of a pose with a translation of any length but zero; none where a number is not finite.
    pub(super) fn of(pose: &Pose<T>) -> Option<Self> {
        let rotation = rotation_matrix(&pose.rotation);
        let t = pose.translation.vector;
        let size = max(abs(t.x), max(abs(t.y), abs(t.z)));
        let t: Vector3<T> = t * (T::ONE / size);
        let translation = t * (T::ONE / sqrt(t.norm_squared()));
        (is_finite(translation.norm_squared()) && is_finite(rotation.norm_squared())).then(|| Self {
            rotation,
            translation,
            scales: Scales::unit(),
        })
    }
}
