//! What a function answers: a count or 0, or one of these codes.

use core::ffi::{CStr, c_char};

use epipole::InputError;
use epipole::estimate::{AbsolutePoseError, TwoViewError};
use epipole::geometry::CameraError;
use epipole::geometry::triangulation::RefinePointError;
use epipole::robust::OptionsError;

/// Grows with every change of the ABI that an older program would notice.
pub const ABI_VERSION: u32 = 1;

/// Why a function did nothing: negative codes, after which nothing that the caller owns has changed, but for the content
/// of a workspace. Functions answer `int32_t`: one of these, or a count from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i32)]
pub enum Status {
    /// Done.
    Ok = 0,
    /// A pointer is null that must not be.
    NullPointer = -1,
    /// A pointer is not aligned for its type, or a workspace not to `EPI_WORKSPACE_ALIGN`.
    Misaligned = -2,
    /// An output overlaps another argument.
    Overlap = -3,
    /// A count of elements whose bytes no memory holds.
    TooLarge = -4,
    /// An output holds fewer elements than the function may write.
    Capacity = -5,
    /// A workspace is smaller than its size query says.
    Workspace = -6,
    /// The size of a struct is none that this version knows.
    StructSize = -7,
    /// An integer is no value of its enumeration.
    UnknownEnum = -8,
    /// Fewer points than the problem needs.
    TooFew = -9,
    /// A number is NaN or infinite.
    NotFinite = -10,
    /// A focal length is not positive, or a camera's parameter not finite.
    Camera = -11,
    /// The four numbers of a rotation are no unit quaternion.
    Rotation = -12,
    /// `max_error_px` is not positive and finite.
    MaxError = -13,
    /// `sigma_px` is neither 0 nor positive and finite.
    Sigma = -14,
    /// `confidence` is not between 0 and 1.
    Confidence = -15,
    /// `max_iterations` is 0.
    NoIterations = -16,
    /// A gravity prior needs two directions and a positive uncertainty.
    Gravity = -17,
    /// A view does not see the point.
    NotVisible = -18,
    /// What was asked for is not determined.
    Unobservable = -19,
    /// The memory holds no window of this scalar.
    NotAWindow = -20,
    /// All frames are taken.
    FramesFull = -21,
    /// All points are taken.
    PointsFull = -22,
    /// All observations are taken.
    ObservationsFull = -23,
    /// The frame is no longer in the window.
    StaleFrame = -24,
    /// The point is no longer in the window.
    StalePoint = -25,
    /// The frame already observes the point.
    DuplicateObservation = -26,
    /// The frame does not observe the point.
    NoSuchObservation = -27,
    /// A standard deviation or a distance is zero or less.
    NotPositive = -28,
    /// An information matrix is not positive semi-definite.
    NotPositiveSemidefinite = -29,
    /// A distance between a frame and itself.
    SameFrame = -30,
    /// Fixed frames contradict a distance between them.
    ContradictoryFixedFrames = -31,
    /// The window was created without memory for a prior.
    NoPriorMemory = -32,
    /// An option is NaN, or zero or less where it must be positive.
    BadOption = -33,
    /// Every frame and every point is fixed, or there is none.
    NothingFree = -34,
    /// No observation of a live frame and point.
    NoObservations = -35,
    /// Each point is seen fewer than twice, or lies behind its cameras.
    NoUsablePoint = -36,
    /// A free frame has no observation of a usable point, no prior and no distance.
    UnconstrainedFrame = -37,
    /// A prior needs finite directions or a rotation, and a positive uncertainty.
    Prior = -38,
    /// The pose to start from has a translation of zero.
    Start = -39,
    /// An error that this version of the header does not name.
    Other = -40,
}

impl Status {
    /// Every code, in falling order.
    pub const ALL: [Self; 41] = [
        Self::Ok,
        Self::NullPointer,
        Self::Misaligned,
        Self::Overlap,
        Self::TooLarge,
        Self::Capacity,
        Self::Workspace,
        Self::StructSize,
        Self::UnknownEnum,
        Self::TooFew,
        Self::NotFinite,
        Self::Camera,
        Self::Rotation,
        Self::MaxError,
        Self::Sigma,
        Self::Confidence,
        Self::NoIterations,
        Self::Gravity,
        Self::NotVisible,
        Self::Unobservable,
        Self::NotAWindow,
        Self::FramesFull,
        Self::PointsFull,
        Self::ObservationsFull,
        Self::StaleFrame,
        Self::StalePoint,
        Self::DuplicateObservation,
        Self::NoSuchObservation,
        Self::NotPositive,
        Self::NotPositiveSemidefinite,
        Self::SameFrame,
        Self::ContradictoryFixedFrames,
        Self::NoPriorMemory,
        Self::BadOption,
        Self::NothingFree,
        Self::NoObservations,
        Self::NoUsablePoint,
        Self::UnconstrainedFrame,
        Self::Prior,
        Self::Start,
        Self::Other,
    ];

    const fn text(self) -> &'static CStr {
        match self {
            Self::Ok => c"success",
            Self::NullPointer => c"a pointer is null",
            Self::Misaligned => c"a pointer is not aligned",
            Self::Overlap => c"an output overlaps another argument",
            Self::TooLarge => c"a count is larger than any memory",
            Self::Capacity => c"an output holds too few elements",
            Self::Workspace => c"the workspace is too small",
            Self::StructSize => c"the size of a struct is none of this version",
            Self::UnknownEnum => c"an integer is no value of its enumeration",
            Self::TooFew => c"fewer points than the problem needs",
            Self::NotFinite => c"a number is not finite",
            Self::Camera => c"a camera parameter is out of range",
            Self::Rotation => c"a rotation is no unit quaternion",
            Self::MaxError => c"max_error_px must be positive and finite",
            Self::Sigma => c"sigma_px must be 0 or positive and finite",
            Self::Confidence => c"confidence must lie between 0 and 1",
            Self::NoIterations => c"max_iterations must not be 0",
            Self::Gravity => c"a gravity prior needs two directions and a positive uncertainty",
            Self::NotVisible => c"a view does not see the point",
            Self::Unobservable => c"not determined by the observations",
            Self::NotAWindow => c"the memory holds no window of this scalar",
            Self::FramesFull => c"no room for another frame",
            Self::PointsFull => c"no room for another point",
            Self::ObservationsFull => c"no room for another observation",
            Self::StaleFrame => c"the frame is no longer in the window",
            Self::StalePoint => c"the point is no longer in the window",
            Self::DuplicateObservation => c"the frame already observes the point",
            Self::NoSuchObservation => c"the frame does not observe the point",
            Self::NotPositive => c"a deviation or a distance is not positive",
            Self::NotPositiveSemidefinite => c"an information matrix is not positive semi-definite",
            Self::SameFrame => c"a distance needs two frames",
            Self::ContradictoryFixedFrames => c"fixed frames contradict a distance",
            Self::NoPriorMemory => c"the window has no memory for a prior",
            Self::BadOption => c"an option is out of range",
            Self::NothingFree => c"no free frame or point",
            Self::NoObservations => c"no observations",
            Self::NoUsablePoint => c"no point is seen twice",
            Self::UnconstrainedFrame => c"nothing constrains a free frame",
            Self::Prior => c"a prior needs finite directions or a rotation, and a positive uncertainty",
            Self::Start => c"the pose to start from has a translation of zero",
            Self::Other => c"an error without a name in this version",
        }
    }
}

/// The ABI of this library, to be compared with `EPI_ABI_VERSION`.
#[unsafe(export_name = "epi_abi_version")]
pub extern "C" fn abi_version() -> u32 {
    ABI_VERSION
}

/// What a status means: a sentence that is always there, also for a number that is no status.
#[unsafe(export_name = "epi_status_string")]
pub extern "C" fn status_string(status: i32) -> *const c_char {
    let known = Status::ALL.iter().find(|known| **known as i32 == if status > 0 { 0 } else { status });
    known.map_or(c"unknown status", |known| known.text()).as_ptr()
}

/// The answer of a function: a count, or the code of its error.
pub(crate) fn answer(call: impl FnOnce() -> Result<usize, Status>) -> i32 {
    match call() {
        // Counts are of elements in caller memory; beyond i32 they saturate.
        Ok(count) => i32::try_from(count).unwrap_or(i32::MAX),
        Err(status) => status as i32,
    }
}

impl From<InputError> for Status {
    fn from(error: InputError) -> Self {
        match error {
            InputError::TooFew { .. } => Self::TooFew,
            InputError::TooMany { .. } => Self::Workspace,
            InputError::NotFinite { .. } => Self::NotFinite,
            _ => Self::Other,
        }
    }
}

impl From<OptionsError> for Status {
    fn from(error: OptionsError) -> Self {
        match error {
            OptionsError::MaxError => Self::MaxError,
            OptionsError::Sigma => Self::Sigma,
            OptionsError::Confidence => Self::Confidence,
            OptionsError::NoIterations => Self::NoIterations,
            _ => Self::Other,
        }
    }
}

impl From<TwoViewError> for Status {
    fn from(error: TwoViewError) -> Self {
        match error {
            TwoViewError::Input(error) => error.into(),
            TwoViewError::Options(error) => error.into(),
            TwoViewError::Pose => Self::Start,
            TwoViewError::Prior => Self::Prior,
            _ => Self::Other,
        }
    }
}

impl From<AbsolutePoseError> for Status {
    fn from(error: AbsolutePoseError) -> Self {
        match error {
            AbsolutePoseError::Input(error) => error.into(),
            AbsolutePoseError::Options(error) => error.into(),
            AbsolutePoseError::Gravity => Self::Gravity,
            _ => Self::Other,
        }
    }
}

impl From<CameraError> for Status {
    fn from(_: CameraError) -> Self {
        Self::Camera
    }
}

impl From<RefinePointError> for Status {
    fn from(error: RefinePointError) -> Self {
        match error {
            RefinePointError::Input(error) => error.into(),
            RefinePointError::NotVisible { .. } => Self::NotVisible,
            RefinePointError::Unobservable => Self::Unobservable,
            _ => Self::Other,
        }
    }
}
