//! The pose of a calibrated camera from pixels of known points.
//!
//! Longer than other files: options, error, entry points and the judgement share one flow, whose pieces no other file calls.

use core::fmt;

use nalgebra::{Matrix6, Vector2, Vector3};

use super::Unobservable;
use super::prior::{Direction, PriorFit};
use crate::geometry::pose::{skew, upright};
use crate::geometry::{CameraModel, Pose};
use crate::linalg::{LANES, Ldlt};
use crate::real::{abs, from_u32, is_finite, lit, ln, max, sqrt};
use crate::refine::blocks::{Block, BlockSlice};
use crate::refine::reprojection::{BearingPointBlock, CameraPose, PlanePointBlock, ReprojectionBlock};
use crate::robust::budget::check_noise;
use crate::robust::loss::Loss;
use crate::robust::{
    Consensus, Guide, OptionsError, RansacOptions, iterations_needed, log_binomial_tail, rank_by_score,
    ransac,
};
use crate::{InputError, Real, Solutions};

mod hypothesis;
mod shape;
mod verdict;
mod workspace;

use hypothesis::{PoseProblem, UprightProblem};
use shape::{Shape, shape_of_inliers};
pub use verdict::{AbsolutePose, AbsolutePoseEstimate, AbsolutePoseVerdict};
pub use workspace::{AbsolutePoseStorage, AbsolutePoseWorkspace, WideAbsolutePoseStorage};

/// Gravity as an inertial unit knows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GravityPrior<T: Real> {
    /// Its direction in the world's frame, of any length.
    pub world: Vector3<T>,
    /// Its direction in the camera's frame, of any length.
    pub camera: Vector3<T>,
    /// Standard deviation of the angle between the two, rad.
    pub sigma_rad: T,
}

/// Options of [`absolute_pose`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct AbsolutePoseOptions<T: Real> {
    /// Largest reprojection error of an inlier, pixels. Default 2.
    pub max_error_px: T,
    /// Standard deviation of the noise of one image coordinate, pixels. Default: half of `max_error_px`.
    pub sigma_px: Option<T>,
    /// Gravity, if known: then samples are of two correspondences instead of three, and it enters the refinement. A
    /// prior that contradicts the correspondences is left aside and reported. Default none.
    pub gravity: Option<GravityPrior<T>>,
    /// Confidence, iterations, budgets and seed.
    pub ransac: RansacOptions<T>,
}

impl<T: Real> Default for AbsolutePoseOptions<T> {
    fn default() -> Self {
        Self { max_error_px: T::TWO, sigma_px: None, gravity: None, ransac: RansacOptions::default() }
    }
}

/// Malformed input or options. Outputs are untouched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum AbsolutePoseError {
    /// The correspondences cannot be used.
    Input(InputError),
    /// An option is out of its range.
    Options(OptionsError),
    /// A direction of the gravity prior has no length or is not finite, or its uncertainty is not positive and finite.
    Gravity,
}

impl fmt::Display for AbsolutePoseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Input(error) => error.fmt(f),
            Self::Options(error) => error.fmt(f),
            Self::Gravity => f.write_str("the gravity prior needs two directions and a positive uncertainty"),
        }
    }
}

impl core::error::Error for AbsolutePoseError {}

impl From<InputError> for AbsolutePoseError {
    fn from(error: InputError) -> Self {
        Self::Input(error)
    }
}

impl From<OptionsError> for AbsolutePoseError {
    fn from(error: OptionsError) -> Self {
        Self::Options(error)
    }
}

/// The fewest correspondences: three leave up to four poses.
const NEEDED: usize = 4;
/// A second pose of a plane is told from the first if it is this much less likely (the logarithm of 100).
const LOG_ODDS: f64 = 4.6;
/// A consensus is believed if chance makes one like it with less than this probability (the logarithm of 5 %).
const LOG_CHANCE: f64 = -3.0;
/// Samples drawn at the most to find out that the points lie behind the camera.
const MAX_BEHIND: u32 = 300;
/// Standard deviations beyond which a prior is contradicted.
const PRIOR_SIGMAS: f64 = 4.0;

/// The pose of a camera from pixels of known points, many of which may be wrong, or why there is none.
///
/// `x ~ project(R X + t)`.
///
/// # Input
/// `pixels[i]` is where the camera sees `points[i]` (the world's frame, any unit); at least four, at most the
/// workspace's capacity.
///
/// # Returns
/// An [`AbsolutePoseVerdict`] with the report of the search; the inlier mask stands in the workspace.
///
/// # Errors
/// [`AbsolutePoseError`]: different lengths, fewer than four, more than the capacity, a coordinate that is not finite
/// (array 0 the pixels, 1 the points), an option out of range. Nothing has been written then.
///
/// # Degeneracies
/// Inliers on a line or on fewer than four distinct points: `Unobservable`. On a plane far away or small, two poses fit
/// alike: `PlanarAmbiguity` with both. Points that fit only behind the camera: `BehindCamera`.
///
/// # Accuracy
/// That of least squares on the inliers: no pose of less truncated squared error is near. Distortion is removed from
/// the pixels beforehand; [`refine::absolute_pose`](crate::refine::absolute_pose) measures in the distorted image.
///
/// # Cost
/// Bounded by [`Budget`](crate::robust::Budget); a contradicted gravity prior costs one more search.
///
/// # References
/// M. Fischler, R. Bolles, "Random sample consensus", Communications of the ACM, 1981; O. Chum, J. Matas, J. Kittler,
/// "Locally optimized RANSAC", DAGM 2003; G. Schweighofer, A. Pinz, "Robust pose estimation from a planar target", IEEE
/// TPAMI 2006 (the second pose of a plane).
///
/// # Examples
/// ```
/// use epipole::estimate::{AbsolutePoseOptions, AbsolutePoseStorage, absolute_pose};
/// use epipole::geometry::{CameraModel, Pinhole, Pose};
/// use epipole::nalgebra::{Point3, Vector2, Vector3};
///
/// let camera = Pinhole::new(500.0, 500.0, 320.0, 240.0)?;
/// let truth = Pose::new(Vector3::new(-1.0, 0.0, 0.0), Vector3::new(0.0, 0.1, 0.0));
/// let (mut pixels, mut points) = ([Vector2::zeros(); 60], [Vector3::zeros(); 60]);
/// for k in 0..60 {
///     let i = k as f64;
///     points[k] = Vector3::new((1.7 * i).sin() * 2.0, (2.3 * i).cos(), 5.0 + 2.0 * (0.9 * i).sin());
///     pixels[k] = camera.project(&(truth * Point3::from(points[k])).coords).unwrap();
///     if k % 3 == 0 {
///         pixels[k] = Vector2::new((i * 77.0) % 640.0, (i * 31.0) % 480.0); // A wrong match.
///     }
/// }
/// let mut storage = AbsolutePoseStorage::<f64, 60>::new();
/// let mut workspace = storage.workspace();
/// let options = AbsolutePoseOptions::default();
/// let estimate = absolute_pose(&camera, &pixels, &points, &options, &mut workspace)?;
/// let pose = estimate.pose().unwrap();
/// assert!((pose.to_homogeneous() - truth.to_homogeneous()).norm() < 1e-8);
/// assert!(!workspace.inliers()[0] && workspace.inliers()[1]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn absolute_pose<T: Real>(
    camera: &impl CameraModel<T>,
    pixels: &[Vector2<T>],
    points: &[Vector3<T>],
    options: &AbsolutePoseOptions<T>,
    workspace: &mut AbsolutePoseWorkspace<'_, T>,
) -> Result<AbsolutePoseEstimate<T>, AbsolutePoseError> {
    absolute_pose_guided(camera, pixels, points, options, Guide::none(), workspace)
}

/// [`absolute_pose`], with match scores for ordered sampling, or with a caller's "may I go on?".
///
/// # Input
/// As [`absolute_pose`], and a [`Guide`].
///
/// # Returns
/// As [`absolute_pose`]. A run that the guide ended is repeated bit for bit by a budget of as many iterations as the report
/// tells.
///
/// # Errors
/// As [`absolute_pose`], and [`InputError::LengthMismatch`](crate::InputError) where there are scores but not one for each
/// correspondence.
///
/// # Cost
/// As [`absolute_pose`], and about `2 n log2 n` comparisons for the order of the scores.
///
/// # References
/// O. Chum, J. Matas, "Matching with PROSAC", CVPR 2005.
///
/// # Examples
/// See [`relative_pose_guided`](super::relative_pose_guided) and [`homography_guided`](super::homography_guided), which
/// take a guide alike.
pub fn absolute_pose_guided<T: Real>(
    camera: &impl CameraModel<T>,
    pixels: &[Vector2<T>],
    points: &[Vector3<T>],
    options: &AbsolutePoseOptions<T>,
    guide: Guide<'_, T>,
    workspace: &mut AbsolutePoseWorkspace<'_, T>,
) -> Result<AbsolutePoseEstimate<T>, AbsolutePoseError> {
    let sigma_px = check_noise(options.max_error_px, options.sigma_px)?;
    options.ransac.check()?;
    let gravity = match &options.gravity {
        Some(prior) => Some(Gravity::new(prior, sigma_px).ok_or(AbsolutePoseError::Gravity)?),
        None => None,
    };
    let focal = camera.rectilinear();
    let capacity = match focal {
        Some(_) => workspace.capacity_of::<PlanePointBlock<T>>(),
        None => workspace.capacity_of::<BearingPointBlock<T>>(),
    };
    check(pixels, points, capacity)?;
    if let Some(scores) = guide.scores
        && scores.len() != pixels.len()
    {
        return Err(InputError::LengthMismatch { first: pixels.len(), second: scores.len() }.into());
    }
    workspace.count = pixels.len();
    // Points about their mean: the digits of f32 are not spent on a distant origin.
    let mut mean = Vector3::zeros();
    let share = T::ONE / from_u32(points.len() as u32);
    for point in points {
        mean += point * share;
    }
    let task = Task { options, sigma_px, gravity, mean };
    let pairs = pixels.iter().zip(points).map(|(pixel, point)| (pixel, point - mean));
    Ok(match focal {
        Some((fx, fy)) => {
            fill::<T, PlanePointBlock<T>, 5>(
                workspace.numbers,
                pairs.map(|(pixel, p)| {
                    let [u, v] = match camera.unproject(pixel) {
                        Ok(f) if f.z > T::ZERO => [fx * f.x / f.z, fy * f.y / f.z],
                        _ => [lit(f64::NAN); 2],
                    };
                    [u, v, p.x, p.y, p.z]
                }),
            );
            estimate::<T, PlanePointBlock<T>>(&task, [fx, fy], guide, workspace)
        }
        None => {
            fill::<T, BearingPointBlock<T>, 12>(
                workspace.numbers,
                pairs.map(|(pixel, p)| bearing_rows(camera, pixel, &p)),
            );
            estimate::<T, BearingPointBlock<T>>(&task, [camera.focal(); 2], guide, workspace)
        }
    })
}

fn check<T: Real>(pixels: &[Vector2<T>], points: &[Vector3<T>], capacity: usize) -> Result<(), InputError> {
    let given = pixels.len();
    if given != points.len() {
        return Err(InputError::LengthMismatch { first: given, second: points.len() });
    }
    if given < NEEDED {
        return Err(InputError::TooFew { given, needed: NEEDED });
    }
    if given > capacity {
        return Err(InputError::TooMany { given, capacity });
    }
    for (index, p) in pixels.iter().enumerate() {
        if !(is_finite(p.x) && is_finite(p.y)) {
            return Err(InputError::NotFinite { array: 0, index });
        }
    }
    for (index, p) in points.iter().enumerate() {
        if !(is_finite(p.x) && is_finite(p.y) && is_finite(p.z)) {
            return Err(InputError::NotFinite { array: 1, index });
        }
    }
    Ok(())
}

/// The rows a, b, c of a pixel, then its point: c the bearing, a and b the pseudo-inverse of its derivative.
fn bearing_rows<T: Real>(camera: &impl CameraModel<T>, pixel: &Vector2<T>, p: &Vector3<T>) -> [T; 12] {
    let nan = lit(f64::NAN);
    let Ok((f, j)) = camera.unproject_with_jacobian(pixel) else {
        return [nan, nan, nan, nan, nan, nan, nan, nan, nan, p.x, p.y, p.z];
    };
    let (j0, j1) = (j.column(0), j.column(1));
    let (uu, uv, vv) = (j0.dot(&j0), j0.dot(&j1), j1.dot(&j1));
    let inverse = T::ONE / (uu * vv - uv * uv);
    let a = (j0 * vv - j1 * uv) * inverse;
    let b = (j1 * uu - j0 * uv) * inverse;
    [a.x, a.y, a.z, b.x, b.y, b.z, f.x, f.y, f.z, p.x, p.y, p.z]
}

/// Writes correspondences into blocks, four side by side; the lanes left in the last block are zero.
fn fill<T: Real, B: Block<T>, const W: usize>(numbers: &mut [T], mut from: impl Iterator<Item = [T; W]>) {
    for block in B::slice_mut(numbers) {
        *block = B::zero();
        for lane in 0..LANES {
            let Some(numbers) = from.next() else { return };
            block.write_lane(lane, &numbers);
        }
    }
}

/// A gravity prior, checked.
#[derive(Clone, Copy, Debug)]
struct Gravity<T: Real> {
    direction: Direction<T>,
    /// Weight of the squared chord between the two, px^2.
    weight: T,
    sigma_rad: T,
}

impl<T: Real> Gravity<T> {
    fn new(prior: &GravityPrior<T>, sigma_px: T) -> Option<Self> {
        if !(is_finite(prior.sigma_rad) && prior.sigma_rad > T::ZERO) {
            return None;
        }
        let ratio = sigma_px / prior.sigma_rad;
        let direction = Direction::new(&prior.world, &prior.camera)?;
        Some(Self { direction, weight: ratio * ratio, sigma_rad: prior.sigma_rad })
    }

    /// The angle between the two in standard deviations.
    fn deviation(&self, pose: &CameraPose<T>) -> T {
        self.direction.turn_between(&pose.rotation) / self.sigma_rad
    }
}

/// What is asked of the loaded correspondences.
struct Task<'a, T: Real> {
    options: &'a AbsolutePoseOptions<T>,
    sigma_px: T,
    gravity: Option<Gravity<T>>,
    /// Subtracted from the points.
    mean: Vector3<T>,
}

/// The verdict on loaded correspondences.
fn estimate<T: Real, B: ReprojectionBlock<T>>(
    task: &Task<'_, T>,
    focal: [T; 2],
    guide: Guide<'_, T>,
    workspace: &mut AbsolutePoseWorkspace<'_, T>,
) -> AbsolutePoseEstimate<T> {
    let count = workspace.count;
    let blocks = B::slice(workspace.numbers);
    let data = BlockSlice { blocks: blocks.get(..count.div_ceil(LANES)).unwrap_or(blocks), count };
    let problem = PoseProblem::new(data, focal, task.options.max_error_px);
    let order = match guide.scores {
        Some(scores) => {
            rank_by_score(scores, workspace.order);
            workspace.order.get(..count)
        }
        None => None,
    };
    let (consensus, gravity) = search(task, &problem, order, guide.keep_going);
    workspace.inliers.iter_mut().take(count).for_each(|inlier| *inlier = false);
    let mut estimate = AbsolutePoseEstimate {
        verdict: AbsolutePoseVerdict::NoConsensus,
        gravity: None,
        noise_px: T::ZERO,
        report: consensus.report,
    };
    let found = consensus.models[0].map(|(model, _)| model);
    let believed = found.filter(|_| beyond_chance(task, &problem, &consensus));
    // Points behind the camera show a depth-reversed shape that a part of them fits in front, too.
    let few = 2 * consensus.report.inliers < count as u32;
    if few && behind_camera(task, &problem, &consensus) {
        estimate.verdict = AbsolutePoseVerdict::BehindCamera;
        return estimate;
    }
    let Some(model) = believed else {
        if found.is_some() && consensus.report.inliers > 3 {
            estimate.verdict = AbsolutePoseVerdict::TooFewInliers;
        }
        return estimate;
    };
    estimate.gravity = gravity;
    let gravity = match gravity {
        Some(PriorFit::Fits(_)) => task.gravity.as_ref(),
        _ => None,
    };
    let loss = Loss::Truncated(problem.threshold);
    let best = problem.optimise(&model, &loss, gravity, 12, lit(1e-6));
    let mut mask = workspace.inliers.iter_mut();
    problem.for_each_block(&best.model, |_, relative, filled| {
        for (inlier, &s) in mask.by_ref().take(filled).zip(relative) {
            *inlier = s < T::ONE;
        }
    });
    let finish = |pose: &CameraPose<T>, sums: &crate::refine::lm::NormalEquations<T, 6>| {
        let variance = variance(task, &problem, sums);
        let active = from_u32::<T>(core::cmp::max(sums.active, 1));
        AbsolutePose {
            pose: shifted(&pose.pose(), &task.mean),
            covariance: covariance(&sums.hessian, variance, &(pose.rotation * task.mean)),
            rms_px: sqrt(squares(&problem, sums) / active),
        }
    };
    let first = finish(&best.model, &best.equations);
    estimate.noise_px = sqrt(variance(task, &problem, &best.equations));
    estimate.verdict = match shape_of_inliers(&problem, &best.model) {
        Shape::Repeated => AbsolutePoseVerdict::Unobservable(Unobservable::TooFewDistinct),
        Shape::Line => AbsolutePoseVerdict::Unobservable(Unobservable::Collinear),
        Shape::Volume => AbsolutePoseVerdict::Pose(first),
        Shape::Flat { twin } => {
            let second = problem.optimise(&twin, &loss, gravity, 20, lit(1e-6));
            let turned = (second.model.rotation - best.model.rotation).norm_squared();
            let moved = (second.model.translation - best.model.translation).norm_squared();
            let same = turned < lit(1e-4) && moved < lit::<T>(1e-4) * best.model.translation.norm_squared();
            let noise = estimate.noise_px * estimate.noise_px;
            let worse = second.equations.cost - best.equations.cost;
            if !same && worse < lit::<T>(2.0 * LOG_ODDS) * max(noise, T::MIN_POSITIVE) {
                let mut poses = Solutions::new();
                let second = finish(&second.model, &second.equations);
                let (first, second) = if worse < T::ZERO { (second, first) } else { (first, second) };
                poses.push(first);
                poses.push(second);
                AbsolutePoseVerdict::PlanarAmbiguity(poses)
            } else {
                AbsolutePoseVerdict::Pose(first)
            }
        }
    };
    estimate
}

/// The consensus by what priors there are, and what became of the prior.
fn search<T: Real, B: ReprojectionBlock<T>>(
    task: &Task<'_, T>,
    problem: &PoseProblem<'_, T, B>,
    order: Option<&[u32]>,
    mut keep_going: Option<&mut dyn FnMut(&crate::robust::Progress) -> bool>,
) -> (Consensus<CameraPose<T>, T>, Option<PriorFit<T>>) {
    let options = &task.options.ransac;
    let Some(gravity) = &task.gravity else {
        return (ransac::<T, _, 3>(problem, options, order, NEEDED as u32, keep_going), None);
    };
    let deviations_of = |consensus: &Consensus<CameraPose<T>, T>| {
        consensus.models[0].map_or(T::MAX, |(model, _)| gravity.deviation(&model))
    };
    let limit = lit(PRIOR_SIGMAS);
    let upright_frame = |v: &Vector3<T>| upright(v).unwrap_or_else(nalgebra::Matrix3::identity);
    let aided = UprightProblem {
        problem: *problem,
        world: upright_frame(&gravity.direction.from),
        camera: upright_frame(&gravity.direction.to),
    };
    // Reborrowed, for the second search may need it.
    let again = keep_going.as_mut().map(|ask| &mut **ask as &mut dyn FnMut(&_) -> bool);
    let first = ransac::<T, _, 2>(&aided, options, order, NEEDED as u32, again);
    let deviations = deviations_of(&first);
    // Where less than 30 % agree, or the optimum has left the prior, the prior must win against a search without it.
    let share = from_u32::<T>(first.report.inliers) / from_u32(problem.data.count as u32);
    if deviations < limit && share > lit(0.3) {
        return (first, Some(PriorFit::Fits(deviations)));
    }
    let second = ransac::<T, _, 3>(problem, options, order, NEEDED as u32, keep_going);
    let chosen = if second.report.cost < first.report.cost { second } else { first };
    let deviations = deviations_of(&chosen);
    let fit =
        if deviations < limit { PriorFit::Fits(deviations) } else { PriorFit::Contradicted(deviations) };
    (chosen, chosen.models[0].map(|_| fit))
}

/// True where the consensus is larger than what wrong correspondences make up.
fn beyond_chance<T: Real, B: ReprojectionBlock<T>>(
    task: &Task<'_, T>,
    problem: &PoseProblem<'_, T, B>,
    consensus: &Consensus<CameraPose<T>, T>,
) -> bool {
    let report = &consensus.report;
    if (report.inliers as usize) < NEEDED {
        return false;
    }
    // A wrong pose puts a point within the threshold of its pixel as often as the disc's share of the image's extent.
    let mut extent = T::ZERO;
    let zero = CameraPose { rotation: nalgebra::Matrix3::zeros(), translation: Vector3::z() };
    problem.for_each_block(&zero, |block, _, filled| {
        for l in 0..filled {
            let [a, b, _] = block.rows(l, problem.focal);
            let size = max(abs(a[2]), abs(b[2]));
            extent = if size > extent { size } else { extent };
        }
    });
    let radius = task.options.max_error_px / max(extent, task.options.max_error_px * T::TWO);
    let chance = radius * radius;
    let tried = from_u32::<T>(core::cmp::max(report.spent.hypotheses, 1));
    let tail = log_binomial_tail(problem.data.count as u32 - 3, report.inliers - 3, chance);
    ln(tried) + tail < lit(LOG_CHANCE)
}

/// True where poses with the points behind the camera find a consensus twice as large as the one in front.
fn behind_camera<T: Real, B: ReprojectionBlock<T>>(
    task: &Task<'_, T>,
    problem: &PoseProblem<'_, T, B>,
    in_front: &Consensus<CameraPose<T>, T>,
) -> bool {
    let count = problem.data.count as u32;
    let wanted = core::cmp::max(2 * in_front.report.inliers, NEEDED as u32);
    let mirrored = PoseProblem { facing: -T::ONE, ..*problem };
    let mut options = task.options.ransac;
    let needed = iterations_needed(options.confidence, wanted, count, 3);
    options.budget.max_iterations =
        core::cmp::min(options.budget.max_iterations, core::cmp::min(needed, MAX_BEHIND));
    let behind = ransac::<T, _, 3>(&mirrored, &options, None, wanted, None);
    behind.report.inliers >= wanted && beyond_chance(task, &mirrored, &behind)
}

/// The sum of the inliers' squared residuals, px^2.
fn squares<T: Real, B: ReprojectionBlock<T>>(
    problem: &PoseProblem<'_, T, B>,
    sums: &crate::refine::lm::NormalEquations<T, 6>,
) -> T {
    let outside = from_u32::<T>((problem.data.count as u32).saturating_sub(sums.active));
    max(sums.cost - outside * problem.threshold * problem.threshold, T::ZERO)
}

/// The variance of an image coordinate: of the residuals if there are enough, otherwise the one assumed.
fn variance<T: Real, B: ReprojectionBlock<T>>(
    task: &Task<'_, T>,
    problem: &PoseProblem<'_, T, B>,
    sums: &crate::refine::lm::NormalEquations<T, 6>,
) -> T {
    let freedom = (2 * sums.active).saturating_sub(6);
    if freedom < 10 { task.sigma_px * task.sigma_px } else { squares(problem, sums) / from_u32(freedom) }
}

/// The covariance for points that are not counted from their mean: `t = t' - R mean`.
fn covariance<T: Real>(hessian: &Matrix6<T>, variance: T, turned_mean: &Vector3<T>) -> Option<Matrix6<T>> {
    let about_mean = Ldlt::new(hessian)?.inverse() * variance;
    let mut j = Matrix6::identity();
    let lever = skew(turned_mean);
    for p in 0..3 {
        for q in 0..3 {
            j.data.0[q][3 + p] = lever.data.0[q][p];
        }
    }
    Some(j * about_mean * j.transpose())
}

fn shifted<T: Real>(pose: &Pose<T>, mean: &Vector3<T>) -> Pose<T> {
    let translation = pose.translation.vector - pose.rotation * mean;
    Pose::from_parts(nalgebra::Translation3::from(translation), pose.rotation)
}
