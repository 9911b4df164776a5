//! What a window refuses.

use core::fmt;

/// Why a window could not be made or changed. It is as it was before the call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum WindowError {
    /// The slice of scalars is shorter than [`scalars_len`](super::scalars_len) asks.
    MemoryTooSmall {
        /// Its length.
        given: usize,
        /// The length asked for.
        needed: usize,
    },
    /// More frames or points than a 16-bit index reaches.
    CapacityTooLarge,
    /// All frame slots are taken.
    FramesFull,
    /// All point slots are taken.
    PointsFull,
    /// All observation slots are taken.
    ObservationsFull,
    /// The handle's frame is no longer in the window.
    StaleFrame,
    /// The handle's point is no longer in the window.
    StalePoint,
    /// The frame already has an observation of the point.
    DuplicateObservation,
    /// The frame has no observation of the point.
    NoSuchObservation,
    /// A pose, a position, a measurement or a deviation is NaN or infinite.
    NotFinite,
    /// A standard deviation or a distance is zero or less.
    NotPositive,
    /// An information matrix is not positive semi-definite.
    NotPositiveSemidefinite,
    /// A distance between a frame and itself.
    SameFrame,
    /// A distance between two fixed frames whose centres are not that far apart (beyond five deviations).
    ContradictoryFixedFrames,
    /// The window was given no memory for a prior: see [`scalars_len`](super::scalars_len).
    NoPriorMemory,
}

impl fmt::Display for WindowError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match *self {
            Self::MemoryTooSmall { given, needed } => {
                return write!(f, "{given} scalars of memory given, {needed} needed");
            }
            Self::CapacityTooLarge => "more frames or points than a 16-bit index reaches",
            Self::FramesFull => "no room for another frame",
            Self::PointsFull => "no room for another point",
            Self::ObservationsFull => "no room for another observation",
            Self::StaleFrame => "the frame is no longer in the window",
            Self::StalePoint => "the point is no longer in the window",
            Self::DuplicateObservation => "the frame already observes the point",
            Self::NoSuchObservation => "the frame does not observe the point",
            Self::NotFinite => "a number is not finite",
            Self::NotPositive => "a deviation or a distance is not positive",
            Self::NotPositiveSemidefinite => "the information matrix is not positive semi-definite",
            Self::SameFrame => "a distance needs two frames",
            Self::ContradictoryFixedFrames => "the fixed frames contradict the distance",
            Self::NoPriorMemory => "the window has no memory for a prior",
        })
    }
}

impl core::error::Error for WindowError {}

/// Why a window could not be optimised, or a covariance not be told. The window is as it was before the call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum BundleError {
    /// An option is NaN, or zero or less where it must be positive.
    BadOption {
        /// Its name.
        option: &'static str,
    },
    /// Every frame and every point is fixed, or there is none.
    NothingFree,
    /// No observation of a live frame and point.
    NoObservations,
    /// No point of the window can be used: each is seen fewer than twice, or lies behind its cameras.
    NoUsablePoint {
        /// Observations whose point the camera cannot see where frame and point are now.
        behind: usize,
    },
    /// A free frame has no observation of a usable point, no prior and no distance.
    UnconstrainedFrame {
        /// Its slot: [`FrameHandle::index`](super::FrameHandle::index).
        frame: usize,
    },
    /// Two fixed frames contradict the distance set between them (beyond five deviations).
    ContradictoryFixedFrames {
        /// Slot of the frame that holds the distance.
        frame: usize,
    },
    /// The handle's frame is no longer in the window.
    StaleFrame,
    /// The handle's point is no longer in the window.
    StalePoint,
    /// What was asked for is not determined by the observations and priors of the window.
    Unobservable,
}

impl fmt::Display for BundleError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::BadOption { option } => write!(f, "option {option} is out of range"),
            Self::NothingFree => f.write_str("no free frame or point"),
            Self::NoObservations => f.write_str("no observations"),
            Self::NoUsablePoint { behind } => {
                write!(f, "no point is seen twice ({behind} observations behind their camera)")
            }
            Self::UnconstrainedFrame { frame } => write!(f, "nothing constrains frame {frame}"),
            Self::ContradictoryFixedFrames { frame } => {
                write!(f, "fixed frame {frame} contradicts its distance to another")
            }
            Self::StaleFrame => f.write_str("the frame is no longer in the window"),
            Self::StalePoint => f.write_str("the point is no longer in the window"),
            Self::Unobservable => f.write_str("not determined by the observations"),
        }
    }
}

impl core::error::Error for BundleError {}
