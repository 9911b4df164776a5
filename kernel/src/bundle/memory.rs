//! The memory of a window: slices that the caller owns, and a storage type that owns them by constant capacities.

use super::constraint::PosePrior;
use super::placement::Placement;
use super::small::{M3, V3};
use super::{Window, WindowError};
use crate::Real;
use crate::geometry::Camera;

/// A frame of a window. Handles stay valid until the frame is removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FrameHandle {
    pub(super) index: u16,
    pub(super) generation: u16,
}

/// A point of a window. Handles stay valid until the point is removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PointHandle {
    pub(super) index: u16,
    pub(super) generation: u16,
}

impl FrameHandle {
    /// The handle as a number, for an interface that knows no types.
    #[must_use]
    pub const fn to_bits(self) -> u32 {
        (self.generation as u32) << 16 | self.index as u32
    }

    /// The handle of a number. Of one that no handle gave it names no frame, and a window says so.
    #[must_use]
    pub const fn from_bits(bits: u32) -> Self {
        Self { index: bits as u16, generation: (bits >> 16) as u16 }
    }

    /// The slot, from 0; slots of removed frames are used again.
    #[must_use]
    pub const fn index(self) -> usize {
        self.index as usize
    }
}

impl PointHandle {
    /// The handle as a number, for an interface that knows no types.
    #[must_use]
    pub const fn to_bits(self) -> u32 {
        (self.generation as u32) << 16 | self.index as u32
    }

    /// The handle of a number. Of one that no handle gave it names no point, and a window says so.
    #[must_use]
    pub const fn from_bits(bits: u32) -> Self {
        Self { index: bits as u16, generation: (bits >> 16) as u16 }
    }

    /// The slot, from 0; slots of removed points are used again.
    #[must_use]
    pub const fn index(self) -> usize {
        self.index as usize
    }
}

/// No column of the linear system: a fixed frame.
pub(super) const NO_SLOT: u16 = u16::MAX;

/// What a frame contributes to the point that is being eliminated, or to the prior's rows.
#[derive(Clone, Copy, Debug)]
pub(super) enum Work<T> {
    /// No valid observation of the point, or a frame that does not move.
    Nothing,
    Seen(Seen<T>),
    Chart(Chart<T>),
}

/// An observation of the point that is being eliminated, in the axes of its linearisation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen<T> {
    /// The point in the camera frame.
    pub(super) y: V3<T>,
    /// `-p`, `-q`: with the unit matrix the Jacobian of the plane point by the frame's translation.
    pub(super) plane: [T; 2],
    /// `P' W P`: elements 00, 01, 11.
    pub(super) info: [T; 3],
    /// `P' W r`
    pub(super) g: [T; 2],
    /// `P' W P D R`, then times `L^-T` with the factor of the point's block.
    pub(super) n: [V3<T>; 2],
    /// Jacobian of the plane point by the frame's rotation.
    pub(super) rotation: [V3<T>; 2],
    /// So many times was x taken for y, y for z and z for x: always 0 but for a fisheye that looks far to the side.
    pub(super) turn: u8,
    /// `P' W P` is diagonal, and nothing is turned.
    pub(super) plain: bool,
}

/// How far a frame has moved from where the prior is linearised, and the Jacobian of that.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chart<T> {
    pub(super) motion: [T; 6],
    pub(super) turn: M3<T>,
    pub(super) shift: M3<T>,
}

impl<T: Real> Chart<T> {
    pub(super) const IDENTITY: Self = Self {
        motion: [T::ZERO; 6],
        turn: Placement::IDENTITY.rotation,
        shift: Placement::IDENTITY.rotation,
    };
}

/// A known distance to another frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Distance<T> {
    pub(super) other: u16,
    pub(super) metres: T,
    pub(super) inverse_sigma: T,
}

/// Memory of one frame. Its content is the window's business.
#[derive(Clone, Copy, Debug)]
pub struct FrameSlot<T: Real> {
    pub(super) camera: Option<Camera<T>>,
    pub(super) pose: Placement<T>,
    pub(super) trial: Placement<T>,
    /// Where the marginalisation prior is linearised; means something only while `prior_column` is a column.
    pub(super) linearised: Placement<T>,
    pub(super) pose_prior: Option<PosePrior<T>>,
    pub(super) distance: Option<Distance<T>>,
    pub(super) work: Work<T>,
    pub(super) generation: u16,
    /// Column block in the linear system of the call that runs.
    pub(super) slot: u16,
    /// Column block in the marginalisation prior.
    pub(super) prior_column: u16,
    pub(super) fixed: bool,
}

impl<T: Real> FrameSlot<T> {
    /// A slot without a frame.
    pub const EMPTY: Self = Self {
        camera: None,
        pose: Placement::IDENTITY,
        trial: Placement::IDENTITY,
        linearised: Placement::IDENTITY,
        pose_prior: None,
        distance: None,
        work: Work::Nothing,
        generation: 0,
        slot: NO_SLOT,
        prior_column: NO_SLOT,
        fixed: false,
    };

    pub(super) fn is_live(&self) -> bool {
        self.camera.is_some()
    }
}

/// Memory of one point. Its content is the window's business.
#[derive(Clone, Copy, Debug)]
pub struct PointSlot<T: Real> {
    pub(super) position: V3<T>,
    pub(super) trial: V3<T>,
    pub(super) generation: u16,
    pub(super) live: bool,
    pub(super) fixed: bool,
}

impl<T: Real> PointSlot<T> {
    /// A slot without a point.
    pub const EMPTY: Self =
        Self { position: [T::ZERO; 3], trial: [T::ZERO; 3], generation: 0, live: false, fixed: false };
}

/// Memory of one observation. Its content is the window's business.
#[derive(Clone, Copy, Debug)]
pub struct ObservationSlot<T: Real> {
    pub(super) pixel: [T; 2],
    pub(super) inverse_sigma: T,
    pub(super) frame: u16,
    pub(super) point: u16,
}

impl<T: Real> ObservationSlot<T> {
    /// A slot without an observation.
    pub const EMPTY: Self =
        Self { pixel: [T::ZERO; 2], inverse_sigma: T::ZERO, frame: NO_SLOT, point: NO_SLOT };

    /// Observations stand in this order: by point, then by frame.
    pub(super) fn key(&self) -> u32 {
        key(self.point, self.frame)
    }
}

pub(super) const fn key(point: u16, frame: u16) -> u32 {
    (point as u32) << 16 | frame as u32
}

/// How much of the memory is in use. Lies beside the slices, so that a view can be made again at any time.
#[derive(Clone, Copy, Debug, Default)]
pub struct WindowHeader {
    pub(super) observations: usize,
    /// Frames in the marginalisation prior.
    pub(super) prior_frames: usize,
}

impl WindowHeader {
    /// Nothing in use.
    pub const EMPTY: Self = Self { observations: 0, prior_frames: 0 };
}

/// Scalars of the linear system of a window of that many frames: a triangle of 6x6 blocks, four vectors, four rows.
#[must_use]
pub const fn system_len(frames: usize) -> usize {
    18 * frames * (frames + 1) + 24 * frames + 16
}

/// Scalars of the marginalisation prior over that many frames: a packed upper triangle and its right-hand side.
#[must_use]
pub const fn prior_len(frames: usize) -> usize {
    let n = 6 * frames;
    n * (n + 1) / 2 + n
}

/// Scalars of a window that can marginalise: [`system_len`] and [`prior_len`]. The linear system alone is enough for a
/// window that never does.
#[must_use]
pub const fn scalars_len(frames: usize) -> usize {
    system_len(frames) + prior_len(frames)
}

/// The slices of a [`Window`]: capacities are their lengths, [`scalars_len`] tells the length of the last.
#[derive(Debug)]
pub struct WindowMemory<'a, T: Real> {
    /// Counts.
    pub header: &'a mut WindowHeader,
    /// One for every frame, at most 65,534.
    pub frames: &'a mut [FrameSlot<T>],
    /// One for every point, at most 65,534.
    pub points: &'a mut [PointSlot<T>],
    /// One for every observation.
    pub observations: &'a mut [ObservationSlot<T>],
    /// The linear system, and the prior behind it.
    pub scalars: &'a mut [T],
}

/// A window's memory by constant capacities. `SCALARS` must be [`scalars_len(FRAMES)`](scalars_len), or
/// [`system_len(FRAMES)`](system_len) for a window that never marginalises; another number does not compile.
///
/// For 8 frames, 100 points and 681 observations in `f32` it takes less than 24,000 bytes without and less than 29,000
/// bytes with the prior.
///
/// # Examples
/// ```
/// use epipole::bundle::{WindowStorage, scalars_len};
/// const SCALARS: usize = scalars_len(8);
/// let mut storage = WindowStorage::<f32, 8, 100, 700, SCALARS>::new();
/// assert_eq!(storage.window().frame_count(), 0);
/// ```
///
/// ```compile_fail
/// use epipole::bundle::{WindowStorage, scalars_len};
/// const SCALARS: usize = scalars_len(7);
/// let mut storage = WindowStorage::<f32, 8, 100, 700, SCALARS>::new(); // memory for 7 frames
/// ```
#[derive(Debug)]
pub struct WindowStorage<
    T: Real,
    const FRAMES: usize,
    const POINTS: usize,
    const OBSERVATIONS: usize,
    const SCALARS: usize,
> {
    header: WindowHeader,
    frames: [FrameSlot<T>; FRAMES],
    points: [PointSlot<T>; POINTS],
    observations: [ObservationSlot<T>; OBSERVATIONS],
    scalars: [T; SCALARS],
}

impl<T: Real, const F: usize, const P: usize, const O: usize, const S: usize> WindowStorage<T, F, P, O, S> {
    const CAPACITY: () = {
        assert!(F < NO_SLOT as usize && P < NO_SLOT as usize, "frames and points are counted in 16 bits");
        assert!(S == scalars_len(F) || S == system_len(F), "SCALARS must be scalars_len(FRAMES)");
    };

    /// An empty window.
    #[must_use]
    pub const fn new() -> Self {
        let () = Self::CAPACITY;
        Self {
            header: WindowHeader::EMPTY,
            frames: [FrameSlot::EMPTY; F],
            points: [PointSlot::EMPTY; P],
            observations: [ObservationSlot::EMPTY; O],
            scalars: [T::ZERO; S],
        }
    }

    /// The slices.
    pub fn memory(&mut self) -> WindowMemory<'_, T> {
        WindowMemory {
            header: &mut self.header,
            frames: &mut self.frames,
            points: &mut self.points,
            observations: &mut self.observations,
            scalars: &mut self.scalars,
        }
    }

    /// The window over this memory, as it was left.
    pub fn window(&mut self) -> Window<'_, T> {
        Window::over(self.memory())
    }
}

impl<T: Real, const F: usize, const P: usize, const O: usize, const S: usize> Default
    for WindowStorage<T, F, P, O, S>
{
    fn default() -> Self {
        Self::new()
    }
}

impl<'a, T: Real> WindowMemory<'a, T> {
    pub(super) fn check(&self) -> Result<(), WindowError> {
        if self.frames.len() >= NO_SLOT as usize || self.points.len() >= NO_SLOT as usize {
            return Err(WindowError::CapacityTooLarge);
        }
        let needed = system_len(self.frames.len());
        if self.scalars.len() < needed {
            return Err(WindowError::MemoryTooSmall { given: self.scalars.len(), needed });
        }
        Ok(())
    }
}
