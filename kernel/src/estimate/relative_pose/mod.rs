//! The relative pose of two calibrated views.

use nalgebra::Vector2;

use super::chance::EXPLAINED_SIGMAS;
use super::error::TwoViewError;
use super::load::{Units, check_pixels, load_bearings, load_planes};
use super::workspace::RelativePoseWorkspace;
use crate::geometry::{CameraModel, Pose};
use crate::linalg::LANES;
use crate::real::is_finite;
use crate::real::lit;
use crate::refine::blocks::{BearingBlock, BlockSlice, EpipolarBlock, PlaneBlock};
use crate::robust::budget::check_noise;
use crate::robust::{Guide, Progress, RansacOptions, RansacReport, ransac};
use crate::{InputError, Real};

mod aided;
mod covariance;
mod evidence;
mod hypothesis;
mod in_front;
mod judge;
mod nearest;
mod options;
mod planar;
mod prior;
mod rotation;
mod verdict;

use aided::ranked;
use hypothesis::PoseProblem;
use judge::{Judge, Left, count_of};
pub use options::RelativePoseOptions;
use prior::KnownRotation;
pub use prior::RelativePosePrior;
pub use verdict::{
    GeneralMotion, PlanarPose, PureRotation, RelativePoseEstimate, RelativePoseVerdict, Unobservable,
};

/// Malformed input or options of [`relative_pose`].
pub type RelativePoseError = TwoViewError;

/// The pose of view 2 in the frame of view 1 from pixel correspondences, many of which may be wrong, or why there is
/// none: `X2 = R X1 + t`, |t| = 1.
///
/// Five-point hypotheses that keep their points in front of both cameras, scored by the truncated squared Sampson error
/// `r^2 = c^2 / (|J1' E' f2|^2 + |J2' E f1|^2)`, `c = f2' E f1`, in pixels, the Jacobians J being those of the bearings (or
/// of the points of the plane z = 1) by the pixels; refined on their inliers with five degrees of freedom. Then the
/// simplest of no motion, a rotation, a plane and a general motion that the data leave standing is the verdict: a
/// simpler model falls where correspondences that it does not explain agree with the pose more often than chance (at most
/// 0.03 accidents expected, 0.0001 against a rotation; the chance is measured on mispaired correspondences), or where the
/// errors along the epipolar lines (of a plane: its own) are larger than those across; a plane also where the pose's lines
/// fit far better than its own. A model explains what lies within 5 sigma, where sigma is the larger of the option's and of
/// the one that the residuals show.
///
/// With a [`RelativePosePrior`] the hypotheses come from three correspondences and the vertical, or from two and the
/// rotation; each is polished on a few correspondences within a threshold as wide as the prior's uncertainty, and the
/// prior is a residual of every refinement, weighed against the option's sigma or, of the last one, the noise seen where
/// that is less. Then the prior is tested against what the same correspondences say without it (Wald's test at one in
/// 10,000), and its consensus against a short search without it. A prior that fails is reported as
/// [`PriorFit::Contradicted`](super::PriorFit), and the verdict is, bit for bit, that of the search without it with what is
/// left of the budget.
///
/// # Input
/// Cameras, and at least 5 pixels of each view, at most the workspace's capacity. A pixel that a lens model does not
/// reach is an outlier.
///
/// # Returns
/// A verdict with covariances, and a report; after it the workspace's `inliers()` is the mask of the verdict's model. The
/// report's `rival_share` tells whether the search's samples led to another pose as well, some ten degrees away or more,
/// that explains almost as much (of the search that a plane did not prolong): of poses of real pairs that were wrong by more
/// than 5 degrees it was 0.98 in the median, of the others 0.5 to 0.7.
///
/// # Errors
/// [`RelativePoseError`], with everything untouched.
///
/// # Degeneracies
/// See [`RelativePoseVerdict`]: none of them ends in a general pose, but planes where
/// [`planes`](RelativePoseOptions::planes) leaves them unexamined, of which the verdict then says so. A plane is the verdict
/// where it explains at least 17 in 20 inliers, or over 16 where another motion, 3 degrees away and next to one of the
/// plane's, explains as much but for what three of them are worth; no pose of repetitions of fewer than six points, for five
/// have up to ten (with two in five matches wrong, and more, up to half of those scenes have one all the same); no motion
/// where the mean square motion is below the noise, or where the views hardly differ
/// ([`RelativePoseOptions::least_motion_px`]).
///
/// # Accuracy
/// That of a maximum-likelihood fit to the inliers (Tukey's loss, ending at six standard deviations of the noise found,
/// with more than 150 inliers at fewer, down to 3.5, and at 0.8 to 2.6 thresholds), in `f32` as in `f64`. Wrong
/// correspondences that agree by accident seem to lie near the cameras, where they would move the pose as hundreds of
/// others do: what lies nearer than a limit counts as an outlier where the translation is more certain without, at most a
/// quarter of what agrees; how many of them there are is measured on mispaired correspondences. The
/// covariances are those of M-estimates with the noise found: over 1,000 scenes of 100 points, with no and with 20 %
/// outliers, the mean normalised squared errors lie within their 95 % bounds, but for the few poses led astray.
///
/// # Cost
/// At most `max_iterations` samples, by itself as many as the confidence needs for the inliers found, and without a
/// prior as many again, 60 at the least and 300 at the most, each with two correspondences off the plane, where a plane
/// holds more than 16 in 20 of those, for there poses that differ hardly differ in cost. Where nothing is found, as many as
/// the fewest inliers that chance does not explain take (13 of 50, 17 of 100), which by the default takes 3 hundredths of a
/// second for 50 correspondences on a desktop computer, a third for 200: firmware sets a budget, or [`Guide::keep_going`]. Beyond a
/// budget of residuals at most one refinement (five passes over 256 correspondences at the most, with a prior one, one score of
/// all, two over 256 to compare it with the best, and six over 32 to try a rotation), and the verdict's passes. A budget of fewer
/// than n residuals, of 4 n with a prior, scores nothing. At half outliers a prior takes less than a third of the
/// samples; a contradicted one costs its own search, of as many samples as a fifth of inliers needs, and one more
/// verdict.
/// After 32 samples every other one (every fourth where there are scores) is of near correspondences: with few samples and
/// most correspondences wrong it is those that find the pose.
///
/// # References
/// D. Nister, "An efficient solution to the five-point relative pose problem", TPAMI 2004 (the minimal problem);
/// P. Sampson, "Fitting conic sections to very scattered data", 1982 (the error); the engine:
/// [`ransac`](crate::robust::ransac); the verdicts: P. Torr, "An assessment of information criteria for motion model
/// selection", CVPR 1997, and L. Moisan, B. Stival, "A probabilistic criterion to detect rigid point matches between two
/// images", IJCV 2004; the smaller samples: [`relpose_upright_3pt`](crate::solvers::relpose_upright_3pt),
/// [`translation_2pt`](crate::solvers::translation_2pt); the test of the prior: A. Wald, "Tests of statistical hypotheses
/// concerning several parameters when the number of observations is large", Transactions of the AMS, 1943.
///
/// # Examples
/// ```
/// use epipole::estimate::{RelativePoseOptions, RelativePoseStorage, relative_pose};
/// use epipole::geometry::{CameraModel, Pinhole, Pose};
/// use epipole::nalgebra::{Point3, Vector2, Vector3};
///
/// let camera = Pinhole::new(500.0, 500.0, 320.0, 240.0).unwrap();
/// let truth = Pose::new(Vector3::new(-1.0, 0.0, 0.0), Vector3::new(0.0, 0.1, 0.0));
/// let (mut x1, mut x2) = ([Vector2::zeros(); 60], [Vector2::zeros(); 60]);
/// for k in 0..60 {
///     let i = k as f64;
///     let point = Point3::new((1.7 * i).sin() * 2.0, (2.3 * i).cos(), 5.0 + 2.0 * (0.9 * i).sin());
///     x1[k] = camera.project(&point.coords).unwrap();
///     x2[k] = camera.project(&(truth * point).coords).unwrap();
///     if k % 3 == 0 {
///         x2[k] = Vector2::new((i * 77.0) % 640.0, (i * 31.0) % 480.0); // A wrong match.
///     }
/// }
/// let mut storage = RelativePoseStorage::<f64, 60>::new();
/// let mut workspace = storage.workspace();
/// let estimate =
///     relative_pose(&camera, &camera, &x1, &x2, &RelativePoseOptions::default(), &mut workspace).unwrap();
/// let pose = estimate.pose().unwrap();
/// assert!(pose.rotation.angle_to(&truth.rotation) < 1e-6);
/// assert!((pose.translation.vector - truth.translation.vector).norm() < 1e-6);
/// assert!(!workspace.inliers()[0] && workspace.inliers()[1]);
///
/// // Gravity, known to half a degree in both views, makes samples of three do, and enters the refinement.
/// use epipole::estimate::{PriorFit, RelativePosePrior};
/// let down = Vector3::new(0.0, 1.0, 0.1);
/// let mut options = RelativePoseOptions::default();
/// options.prior =
///     Some(RelativePosePrior::Gravity { view1: down, view2: truth.rotation * down, sigma_rad: 0.009 });
/// let aided = relative_pose(&camera, &camera, &x1, &x2, &options, &mut workspace).unwrap();
/// assert!(matches!(aided.prior, Some(PriorFit::Fits(_))));
/// // Wrong by far more than it says, it changes nothing.
/// options.prior = Some(RelativePosePrior::Gravity { view1: down, view2: Vector3::x(), sigma_rad: 0.009 });
/// let unaided = relative_pose(&camera, &camera, &x1, &x2, &options, &mut workspace).unwrap();
/// assert!(matches!(unaided.prior, Some(PriorFit::Contradicted(_))));
/// assert_eq!(unaided.verdict, estimate.verdict);
/// ```
// Inlined, as the next: the options' constants and the camera's type then reach it.
#[inline(always)]
pub fn relative_pose<T: Real>(
    camera1: &impl CameraModel<T>,
    camera2: &impl CameraModel<T>,
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    options: &RelativePoseOptions<T>,
    workspace: &mut RelativePoseWorkspace<'_, T>,
) -> Result<RelativePoseEstimate<T>, RelativePoseError> {
    relative_pose_guided(camera1, camera2, x1, x2, options, Guide::none(), workspace)
}

/// [`relative_pose`], with match scores for ordered sampling, or with a caller's "may I go on?".
///
/// # Input
/// As [`relative_pose`], and a [`Guide`]. Scores pay where the better matches are right more often: a wrong order costs
/// little, since the pool of samples grows to all correspondences.
///
/// # Returns
/// As [`relative_pose`]. A run that the guide ended is repeated bit for bit by a budget of as many iterations as the report
/// tells.
///
/// # Errors
/// As [`relative_pose`], and [`InputError::LengthMismatch`] where there are scores but not one for each correspondence.
///
/// # Cost
/// As [`relative_pose`], and about `2 n log2 n` comparisons for the order of the scores.
///
/// # References
/// O. Chum, J. Matas, "Matching with PROSAC", CVPR 2005.
///
/// # Examples
/// ```
/// use epipole::estimate::{RelativePoseOptions, RelativePoseStorage, relative_pose_guided};
/// use epipole::geometry::Pinhole;
/// use epipole::nalgebra::Vector2;
/// use epipole::robust::{Guide, Progress, StopReason};
///
/// // Matches without sense, and a timer that lets the search do 24 iterations.
/// let camera = Pinhole::new(500.0_f32, 500.0, 320.0, 240.0)?;
/// let x1: [_; 40] = core::array::from_fn(|i| Vector2::new((i * 97 % 640) as f32, (i * 61 % 480) as f32));
/// let x2: [_; 40] = core::array::from_fn(|i| Vector2::new((i * 53 % 640) as f32, (i * 89 % 480) as f32));
/// let mut keep_going = |spent: &Progress| spent.iterations < 24;
/// let guide = Guide { scores: None, keep_going: Some(&mut keep_going) };
/// let mut storage = RelativePoseStorage::<f32, 40>::new();
/// let options = RelativePoseOptions::default();
/// let estimate =
///     relative_pose_guided(&camera, &camera, &x1, &x2, &options, guide, &mut storage.workspace())?;
/// assert_eq!(estimate.report.stop, StopReason::Interrupted);
/// assert_eq!((estimate.report.spent.iterations, estimate.pose()), (24, None));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
// Inlined: of options without a prior and cameras that are never a fisheye the compiler then drops what serves them.
#[inline(always)]
pub fn relative_pose_guided<T: Real>(
    camera1: &impl CameraModel<T>,
    camera2: &impl CameraModel<T>,
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    options: &RelativePoseOptions<T>,
    guide: Guide<'_, T>,
    workspace: &mut RelativePoseWorkspace<'_, T>,
) -> Result<RelativePoseEstimate<T>, RelativePoseError> {
    let sigma_px = check_noise(options.max_error_px, options.sigma_px)?;
    options.ransac.check()?;
    // Taken out here, where the compiler still sees the options.
    let (planes, known) = (options.planes, options.known()?);
    let lens = load(camera1, camera2, x1, x2, &guide, workspace)?;
    // In place of the result, for a verdict is large.
    let mut result = Ok(RelativePoseEstimate {
        verdict: RelativePoseVerdict::NoConsensus,
        general: None,
        prior: None,
        noise_px: T::ZERO,
        report: RansacReport::none(),
    });
    if let Ok(found) = &mut result {
        match lens {
            Lens::Rectilinear(units) => {
                estimate::<T, PlaneBlock<T>>(
                    units, sigma_px, options, planes, known, guide, workspace, found,
                );
            }
            Lens::Wide(units) => {
                estimate::<T, BearingBlock<T>>(
                    units, sigma_px, options, planes, known, guide, workspace, found,
                );
            }
        }
    }
    result
}

/// Into which blocks the correspondences were loaded.
enum Lens<T> {
    /// Points of two planes.
    Rectilinear(Units<T>),
    /// Bearings.
    Wide(Units<T>),
}

/// Checks the input and loads it; nothing is touched in case of an error. Inlined: for cameras that are never a fisheye the
/// compiler then drops all that works on bearings.
#[inline(always)]
fn load<T: Real>(
    camera1: &impl CameraModel<T>,
    camera2: &impl CameraModel<T>,
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    guide: &Guide<'_, T>,
    workspace: &mut RelativePoseWorkspace<'_, T>,
) -> Result<Lens<T>, InputError> {
    let planes = camera1.rectilinear().zip(camera2.rectilinear());
    let capacity = match planes {
        Some(_) => workspace.capacity_of::<PlaneBlock<T>>(),
        None => workspace.capacity_of::<BearingBlock<T>>(),
    };
    check_pixels(x1, x2, 5, capacity)?;
    guide.check(x1.len())?;
    workspace.count = x1.len();
    Ok(match planes {
        Some((a, b)) => Lens::Rectilinear(load_planes(camera1, camera2, [a, b], x1, x2, workspace)),
        None => Lens::Wide(load_bearings(camera1, camera2, x1, x2, workspace)),
    })
}

/// A relative pose refined on all correspondences that agree with it, and its covariance; none where fewer than six do or
/// they leave a direction open.
///
/// The Sampson errors in pixels under Tukey's loss, which ends where that of [`relative_pose`] does, over the five degrees
/// of freedom of the pose, by Levenberg and Marquardt's method with analytic derivatives. A prior of the options takes part
/// where it fits the pose refined without it.
///
/// # Input
/// Cameras and pixels as [`relative_pose`] takes them; a pose with a translation that is not zero, of any length.
///
/// # Returns
/// The pose with |t| = 1, and the 5x5 covariance; [`TwoViewWorkspace::inliers`](super::TwoViewWorkspace::inliers) is the mask
/// of its inliers.
///
/// # Errors
/// [`RelativePoseError`], with everything untouched: as [`relative_pose`], but for the options of its search; and
/// [`RelativePoseError::Pose`](super::TwoViewError::Pose).
///
/// # Degeneracies
/// What leaves a direction open has no answer: points on a line, a pure rotation, fewer than six inliers. A plane is no
/// degeneracy of the refinement, but its twin pose is as good: [`relative_pose`] tells both.
///
/// # Accuracy
/// `f32` differs from `f64` by a thousandth of the rotation's standard deviation, by a hundredth in one case of a hundred
/// (100 points, 0.5 px of noise).
///
/// # Cost
/// At most 12 passes over the correspondences, three times as many with a prior. Where accidents are expected, 13 more over 508
/// of them at the most tell what is too near, and where something is, all of it is done twice.
///
/// # References
/// P. Sampson, "Fitting conic sections to very scattered data", 1982; A. Beaton, J. Tukey, "The fitting of power series",
/// Technometrics, 1974 (the loss).
///
/// # Examples
/// ```
/// use epipole::estimate::{RelativePoseOptions, RelativePoseStorage, refine_relative_pose};
/// use epipole::geometry::{CameraModel, Pinhole, Pose};
/// use epipole::nalgebra::{Point3, Vector3};
///
/// let camera = Pinhole::new(500.0_f64, 500.0, 320.0, 240.0)?;
/// let truth = Pose::new(Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.0, 0.05, 0.0));
/// let points: [_; 30] = core::array::from_fn(|i| {
///     let i = i as f64;
///     Point3::new(3.0 * (1.7 * i).sin(), 2.0 * (2.3 * i).cos(), 7.0 + 2.0 * (0.9 * i).sin())
/// });
/// let x1 = points.map(|x| camera.project(&x.coords).unwrap());
/// let x2 = points.map(|x| camera.project(&(truth * x).coords).unwrap());
/// // A degree and a tenth of the baseline off.
/// let start = Pose::new(Vector3::new(1.0, 0.1, 0.0), Vector3::new(0.017, 0.05, 0.0));
/// let mut storage = RelativePoseStorage::<f64, 32>::new();
/// let mut options = RelativePoseOptions::default();
/// options.max_error_px = 20.0; // so that the start has inliers
/// let refined =
///     refine_relative_pose(&camera, &camera, &x1, &x2, &start, &options, &mut storage.workspace())?.unwrap();
/// assert!(refined.pose.rotation.angle_to(&truth.rotation) < 1e-6);
/// assert!((refined.pose.translation.vector - truth.translation.vector).norm() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn refine_relative_pose<T: Real>(
    camera1: &impl CameraModel<T>,
    camera2: &impl CameraModel<T>,
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    pose: &Pose<T>,
    options: &RelativePoseOptions<T>,
    workspace: &mut RelativePoseWorkspace<'_, T>,
) -> Result<Option<GeneralMotion<T>>, RelativePoseError> {
    let sigma_px = check_noise(options.max_error_px, options.sigma_px)?;
    let t = &pose.translation.vector;
    let finite = pose.rotation.coords.iter().chain(t.iter()).all(|&x| is_finite(x));
    if !finite || t.iter().all(|&x| x == T::ZERO) {
        return Err(RelativePoseError::Pose);
    }
    let known = options.known()?;
    let lens = load(camera1, camera2, x1, x2, &Guide::none(), workspace)?;
    Ok(match lens {
        Lens::Rectilinear(units) => {
            refine::<T, PlaneBlock<T>>(units, sigma_px, pose, options, known, workspace)
        }
        Lens::Wide(units) => refine::<T, BearingBlock<T>>(units, sigma_px, pose, options, known, workspace),
    })
}

fn refine<T: Real, B: EpipolarBlock<T>>(
    units: Units<T>,
    sigma_px: T,
    pose: &Pose<T>,
    options: &RelativePoseOptions<T>,
    known: Option<KnownRotation<T>>,
    workspace: &mut RelativePoseWorkspace<'_, T>,
) -> Option<GeneralMotion<T>> {
    let count = workspace.count;
    let blocks = B::slice(workspace.numbers);
    let blocks = blocks.get(..count.div_ceil(LANES)).unwrap_or(blocks);
    let threshold = options.max_error_px / units.pixels;
    let problem = PoseProblem::new(BlockSlice { blocks, count }, units.scales, threshold);
    let judge = Judge { problem: &problem, sigma: sigma_px / units.pixels, least_motion: T::ZERO, seed: 0 };
    let mask = workspace.inliers.get_mut(..count).unwrap_or_default();
    let plain = judge.refined(pose, mask)?;
    match known.filter(|known| known.fits(&plain)) {
        Some(known) => {
            let problem = PoseProblem { prior: Some((&known, judge.sigma * judge.sigma)), ..problem };
            let aided = Judge { problem: &problem, ..judge }.refined(&plain.pose, mask);
            // The mask is of the last refinement: without an aided one, of the plain one again.
            if aided.is_some() { aided } else { judge.refined(pose, mask) }
        }
        None => Some(plain),
    }
}

/// The smallest consensus of interest to the search; the verdict asks for more where chance demands it.
const LEAST_INLIERS: u32 = 10;

/// The verdict on loaded correspondences. Inlined: of options without a prior the compiler then drops what uses one.
#[inline(always)]
fn estimate<T: Real, B: EpipolarBlock<T>>(
    units: Units<T>,
    sigma_px: T,
    options: &RelativePoseOptions<T>,
    planes: bool,
    known: Option<KnownRotation<T>>,
    guide: Guide<'_, T>,
    workspace: &mut RelativePoseWorkspace<'_, T>,
    found: &mut RelativePoseEstimate<T>,
) {
    match known {
        Some(known) => {
            let search =
                |judge: &Judge<'_, '_, T, B>, _, mask: &mut [bool], order: &mut [u32], found: &mut _| {
                    aided::judge(judge, &known, options, guide, mask, order, found);
                };
            judged(units, sigma_px, options, [false, planes], workspace, found, search);
        }
        None => {
            // Here, where the compiler sees whether there are scores.
            let ranked = ranked(guide.scores, workspace.order, workspace.count).is_some();
            let search =
                |judge: &Judge<'_, '_, T, B>, seen, mask: &mut [bool], order: &mut [u32], found: &mut _| {
                    plain(judge, &options.ransac, seen, guide.keep_going, mask, order, found);
                };
            judged(units, sigma_px, options, [ranked, planes], workspace, found, search);
        }
    }
}

/// The search without a prior, ranked by the order if that is one, and its verdict, with a look for planes or without.
fn plain<T: Real, B: EpipolarBlock<T>>(
    judge: &Judge<'_, '_, T, B>,
    options: &RansacOptions<T>,
    [ranked, planes]: [bool; 2],
    mut keep_going: Option<&mut dyn FnMut(&Progress) -> bool>,
    mask: &mut [bool],
    order: &mut [u32],
    found: &mut RelativePoseEstimate<T>,
) {
    let ranks = if ranked { order.get(..mask.len()) } else { None };
    let ask = keep_going.as_mut().map(|ask| &mut **ask as &mut dyn FnMut(&_) -> bool);
    let consensus = ransac::<T, _, 5>(judge.problem, options, ranks, LEAST_INLIERS, ask);
    found.report = consensus.report;
    let budget = options.budget.less(&consensus.report.spent);
    let searched = consensus.report.spent.iterations;
    judge.judge(&consensus, planes, &mut Left { searched, budget, keep_going }, mask, order, found);
}

/// The verdict by a way to search and judge; what the compiler is to see of the options is passed through.
#[inline(never)]
fn judged<T: Real, B: EpipolarBlock<T>>(
    units: Units<T>,
    sigma_px: T,
    options: &RelativePoseOptions<T>,
    seen: [bool; 2],
    workspace: &mut RelativePoseWorkspace<'_, T>,
    found: &mut RelativePoseEstimate<T>,
    search: impl FnOnce(&Judge<'_, '_, T, B>, [bool; 2], &mut [bool], &mut [u32], &mut RelativePoseEstimate<T>),
) {
    let count = workspace.count;
    let blocks = B::slice(workspace.numbers);
    let blocks = blocks.get(..count.div_ceil(LANES)).unwrap_or(blocks);
    let data = BlockSlice { blocks, count };
    let problem = PoseProblem::new(data, units.scales, options.max_error_px / units.pixels);
    let judge = Judge {
        problem: &problem,
        sigma: sigma_px / units.pixels,
        least_motion: options.least_motion_px.unwrap_or(sigma_px * lit(EXPLAINED_SIGMAS)) / units.pixels,
        seed: options.ransac.seed,
    };
    let mask = workspace.inliers.get_mut(..count).unwrap_or_default();
    search(&judge, seen, mask, workspace.order, found);
    found.report.inliers = count_of(mask, true);
    found.noise_px *= units.pixels;
}
