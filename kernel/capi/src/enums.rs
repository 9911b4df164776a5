//! Enumerations. A struct holds their values as `uint32_t`; an unknown value of an input is an error.

/// A robust estimation asks, before every eighth iteration: may I go on? A window before every one. 0 means no.
/// `context` is what the caller gave.
pub type KeepGoing = Option<unsafe extern "C" fn(context: *mut core::ffi::c_void, iterations: u32) -> i32>;

/// The lens of a camera, and what `distortion` holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum CameraModel {
    /// No distortion.
    Pinhole = 0,
    /// Radial and tangential distortion: `k1 k2 p1 p2 k3`, OpenCV's order.
    BrownConrady = 1,
    /// Fisheye: `k1 k2 k3 k4`, OpenCV's `fisheye`.
    KannalaBrandt = 2,
}

/// How a point of two views is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum TriangulationMethod {
    /// The middle of the shortest line between the rays: fastest.
    Midpoint = 0,
    /// The null vector of the homogeneous system.
    Dlt = 1,
    /// Least reprojection error on the planes z = 1; bearings with `z <= 0` have none.
    Optimal = 2,
}

/// What rays determine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum TriangulationVerdict {
    /// A point in front of every view.
    Point = 0,
    /// The best fit lies behind a view.
    Behind = 1,
    /// Parallel rays: the unit direction in place of a point.
    AtInfinity = 2,
    /// Nothing: no baseline, rays along it, or numbers out of range. Zeros in place of a point.
    Undetermined = 3,
}

/// What two views say about the motion between them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum RelativePoseVerdict {
    /// A general motion: `poses[0]`, covariance 5x5.
    General = 0,
    /// All inliers on one plane: one or two poses, the more likely first, each with its plane and an 8x8 covariance.
    Planar = 1,
    /// The camera turned in place: the rotation of `poses[0]`, its translation zero; covariance 3x3.
    PureRotation = 2,
    /// Every inlier stayed where it was.
    NoMotion = 3,
    /// The inliers agree, and no pose follows: see `unobservable`.
    Unobservable = 4,
    /// So few correspondences that chance could explain them.
    TooFewInliers = 5,
    /// No model explains more correspondences than chance.
    NoConsensus = 6,
    /// A verdict that this version of the header does not name.
    Other = 7,
    /// A general motion unless the scene is a plane, which `no_planes` left unexamined: `poses[0]`, covariance 5x5.
    GeneralOrPlanar = 8,
}

/// Why inliers that agree fix no model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Unobservable {
    /// The verdict is another.
    No = 0,
    /// They lie on one line in an image.
    Collinear = 1,
    /// They are repetitions of too few distinct points.
    TooFewDistinct = 2,
    /// A reason that this version of the header does not name.
    Other = 3,
}

/// Why a search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum StopReason {
    /// The confidence was reached: of the inliers found, or that no consensus of any use is there.
    Confident = 0,
    /// `max_iterations` was reached.
    MaxIterations = 1,
    /// `max_solver_calls` was reached.
    MaxSolverCalls = 2,
    /// `max_residuals` was reached.
    MaxResiduals = 3,
    /// The caller answered no. The same input with `max_iterations` set to the reported iterations gives the same bits.
    Interrupted = 4,
    /// A reason that this version of the header does not name.
    Other = 5,
}

/// How much a residual r counts; the scale k is `loss_scale`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Loss {
    /// r^2; the scale is ignored.
    Squared = 0,
    /// min(r^2, k^2).
    Truncated = 1,
    /// r^2 up to k, linear beyond.
    Huber = 2,
    /// k^2 ln(1 + r^2 / k^2).
    Cauchy = 3,
    /// Tukey's biweight, constant beyond k.
    Tukey = 4,
    /// r^2 / (1 + r^2 / k^2).
    GemanMcClure = 5,
}

/// What correspondences say about a homography.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum HomographyVerdict {
    /// A homography and its uncertainty.
    Found = 0,
    /// The inliers agree, and many homographies explain them: see `unobservable`.
    Unobservable = 1,
    /// So few correspondences that chance could explain them.
    TooFewInliers = 2,
    /// No homography explains more correspondences than chance.
    NoConsensus = 3,
    /// A verdict that this version of the header does not name.
    Other = 4,
}

/// What correspondences say about the epipolar geometry of two images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum FundamentalVerdict {
    /// A fundamental matrix.
    Found = 0,
    /// All inliers agree with one homography, which is the matrix of the answer.
    Planar = 1,
    /// The inliers agree, and no epipolar geometry follows: see `unobservable`.
    Unobservable = 2,
    /// So few correspondences that chance could explain them.
    TooFewInliers = 3,
    /// No epipolar geometry explains more correspondences than chance.
    NoConsensus = 4,
    /// A verdict that this version of the header does not name.
    Other = 5,
}

/// What pixels of known points say about the camera's pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum AbsolutePoseVerdict {
    /// One pose.
    Pose = 0,
    /// Two poses of a plane that fit alike, the more likely first.
    PlanarAmbiguity = 1,
    /// The inliers agree, and no pose follows: see `unobservable`.
    Unobservable = 2,
    /// The points agree only behind the camera: an axis of a frame is reversed.
    BehindCamera = 3,
    /// Something agrees, on no more correspondences than chance explains.
    TooFewInliers = 4,
    /// No pose explains more correspondences than chance.
    NoConsensus = 5,
    /// A verdict that this version of the header does not name.
    Other = 6,
}

/// What became of a prior.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum PriorFit {
    /// None was given, or no pose found.
    None = 0,
    /// It took part in the refinement.
    Fits = 1,
    /// The correspondences contradict it, and it was left aside.
    Contradicted = 2,
    /// Something that this version of the header does not name.
    Other = 3,
}

/// Which unknowns of a window move. Fixed frames and fixed points never do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Unknowns {
    /// Frames and points.
    FramesAndPoints = 0,
    /// Frames alone.
    Frames = 1,
    /// Points alone.
    Points = 2,
}

/// Why the optimisation of a window ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Termination {
    /// The cost falls no further than the tolerance.
    Converged = 0,
    /// `max_iterations` are done.
    IterationLimit = 1,
    /// The next iteration would exceed `max_evaluations`.
    BudgetSpent = 2,
    /// The caller answered no.
    Interrupted = 3,
    /// No step lowers the cost, however strongly damped.
    NoProgress = 4,
    /// A reason that this version of the header does not name.
    Other = 5,
}

/// What is known of a relative pose beforehand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum RelativePosePrior {
    /// Nothing; the fields of the others are ignored.
    None = 0,
    /// The direction of gravity in both views.
    Gravity = 1,
    /// The rotation.
    Rotation = 2,
}
