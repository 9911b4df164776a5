//! A window of bundle adjustment in the caller's memory: its head, then the kernel's slices, at places that the
//! capacities determine. The memory holds no address, so it may be copied elsewhere as a whole, within one process and
//! one build of the library: its layout is that build's own.

use core::ffi::c_void;
use core::marker::PhantomData;

use epipole::Real;
use epipole::bundle::{
    self, BundleError, FrameSlot, ObservationSlot, PointSlot, WindowError, WindowHeader, WindowMemory,
    scalars_len, system_len,
};

use crate::enums;
use crate::options::{Defaults, loss, loss_parts};
use crate::raw::{Bytes, Grows, Plain};
use crate::workspace::WORKSPACE_ALIGN;
use crate::{ABI_VERSION, Status};

/// Bytes of a window's head.
pub const WINDOW_HEAD: usize = 48;
/// Bytes of a frame in a window of `float`.
pub const WINDOW_FRAME_F32: usize = 520;
/// Bytes of a frame in a window of `double`.
pub const WINDOW_FRAME_F64: usize = 1024;
/// Bytes of a point in a window of `float`.
pub const WINDOW_POINT_F32: usize = 28;
/// Bytes of a point in a window of `double`.
pub const WINDOW_POINT_F64: usize = 56;
/// Bytes of an observation in a window of `float`.
pub const WINDOW_OBSERVATION_F32: usize = 16;
/// Bytes of an observation in a window of `double`.
pub const WINDOW_OBSERVATION_F64: usize = 32;
/// Frames, and points, that a window counts at the most.
pub const WINDOW_MAX: usize = 65534;

/// A window of frames, points and observations. Made by `epi_window_create`, in the caller's memory.
pub struct Window<T> {
    head: Head,
    scalar: PhantomData<T>,
}

/// The start of a window's memory.
#[derive(Clone, Copy)]
struct Head {
    magic: u32,
    frames: u32,
    points: u32,
    observations: u32,
    prior: u32,
    header: WindowHeader,
}

/// Bytes of a frame, a point, an observation; what tells a window from other memory.
trait Sizes: Real + Plain {
    const FRAME: usize;
    const POINT: usize;
    const OBSERVATION: usize;
    /// Tells a window's memory from any other, and from that of another ABI or another layout of the slots.
    const MAGIC: u32;
}

impl Sizes for f32 {
    const FRAME: usize = WINDOW_FRAME_F32;
    const POINT: usize = WINDOW_POINT_F32;
    const OBSERVATION: usize = WINDOW_OBSERVATION_F32;
    const MAGIC: u32 = magic::<Self>(0x4550_4932);
}

impl Sizes for f64 {
    const FRAME: usize = WINDOW_FRAME_F64;
    const POINT: usize = WINDOW_POINT_F64;
    const OBSERVATION: usize = WINDOW_OBSERVATION_F64;
    const MAGIC: u32 = magic::<Self>(0x4550_4934);
}

const fn magic<T: Real>(name: u32) -> u32 {
    let slots = [
        size_of::<Head>(),
        size_of::<FrameSlot<T>>(),
        size_of::<PointSlot<T>>(),
        size_of::<ObservationSlot<T>>(),
    ];
    let mut mixed = name ^ ABI_VERSION;
    let mut k = 0;
    while k < slots.len() {
        mixed = mixed.rotate_left(7).wrapping_mul(0x9e37_79b9) ^ slots[k] as u32;
        k += 1;
    }
    mixed
}

/// The macros of the header say on every target what the kernel needs.
const fn fits<T: Sizes>() {
    assert!(size_of::<Window<T>>() <= WINDOW_HEAD && align_of::<Window<T>>() <= WORKSPACE_ALIGN);
    assert!(size_of::<FrameSlot<T>>() <= T::FRAME && align_of::<FrameSlot<T>>() <= WORKSPACE_ALIGN);
    assert!(size_of::<PointSlot<T>>() <= T::POINT && align_of::<PointSlot<T>>() <= WORKSPACE_ALIGN);
    assert!(size_of::<ObservationSlot<T>>() <= T::OBSERVATION);
    assert!(align_of::<ObservationSlot<T>>() <= WORKSPACE_ALIGN && align_of::<T>() <= WORKSPACE_ALIGN);
}
const _: () = fits::<f32>();
const _: () = fits::<f64>();

/// How many of each a window holds.
#[derive(Clone, Copy)]
pub(crate) struct Capacities {
    pub(crate) frames: usize,
    pub(crate) points: usize,
    pub(crate) observations: usize,
    pub(crate) prior: bool,
}

/// Where the slices begin, and where the last ends.
struct Places {
    points: usize,
    observations: usize,
    scalars: usize,
    end: usize,
}

#[expect(private_bounds, reason = "the scalars of C are two")]
impl Capacities {
    fn scalars(&self) -> usize {
        if self.prior { scalars_len(self.frames) } else { system_len(self.frames) }
    }

    /// None where no memory is that large.
    fn places<T: Sizes>(&self) -> Option<Places> {
        if self.frames > WINDOW_MAX || self.points > WINDOW_MAX {
            return None;
        }
        u32::try_from(self.observations).ok()?;
        let after = |start: usize, each: usize, count: usize| {
            start.checked_add(each.checked_mul(count)?.checked_next_multiple_of(WORKSPACE_ALIGN)?)
        };
        // No fewer numbers than `scalars` will say, which must fit the width of `usize`.
        usize::try_from(36 * (self.frames as u64 + 1) * (self.frames as u64 + 1)).ok()?;
        let points = after(WINDOW_HEAD, T::FRAME, self.frames)?;
        let observations = after(points, T::POINT, self.points)?;
        let scalars = after(observations, T::OBSERVATION, self.observations)?;
        let end = after(scalars, size_of::<T>(), self.scalars())?;
        (end <= isize::MAX as usize).then_some(Places { points, observations, scalars, end })
    }

    /// Bytes of the window; 0 where no memory is that large.
    pub(crate) fn size<T: Sizes>(&self) -> usize {
        self.places::<T>().map_or(0, |places| places.end)
    }
}

/// The window's slices from its start.
///
/// # Safety
/// `start` points to the memory of these capacities, aligned, which nobody else uses for `'a`. Slots must have been
/// written once.
unsafe fn memory<'a, T: Sizes>(
    start: *mut u8,
    capacities: &Capacities,
    places: &Places,
) -> WindowMemory<'a, T> {
    // SAFETY: the slices lie one behind the other, each in its place (`fits`, `places`).
    unsafe {
        use core::slice::from_raw_parts_mut as slice;
        WindowMemory {
            header: &mut (*start.cast::<Window<T>>()).head.header,
            frames: slice(start.add(WINDOW_HEAD).cast(), capacities.frames),
            points: slice(start.add(places.points).cast(), capacities.points),
            observations: slice(start.add(places.observations).cast(), capacities.observations),
            scalars: slice(start.add(places.scalars).cast(), capacities.scalars()),
        }
    }
}

/// Makes an empty window of memory that has room for it.
#[expect(private_bounds, reason = "the scalars of C are two")]
pub(crate) fn create<T: Sizes>(
    memory: crate::workspace::Memory<'_>,
    capacities: &Capacities,
) -> Result<*mut Window<T>, Status> {
    let places = capacities.places::<T>().ok_or(Status::TooLarge)?;
    if memory.bytes().len() < places.end {
        return Err(Status::Workspace);
    }
    let start = memory.start();
    let window = start.cast::<Window<T>>();
    let head = Head {
        magic: T::MAGIC,
        frames: capacities.frames as u32,
        points: capacities.points as u32,
        observations: u32::try_from(capacities.observations).map_err(|_| Status::TooLarge)?,
        prior: u32::from(capacities.prior),
        header: WindowHeader::EMPTY,
    };
    // SAFETY: the memory is aligned, ours to write, and `places` are inside it.
    unsafe {
        let frames = start.add(WINDOW_HEAD).cast::<FrameSlot<T>>();
        (0..capacities.frames).for_each(|k| frames.add(k).write(FrameSlot::EMPTY));
        let points = start.add(places.points).cast::<PointSlot<T>>();
        (0..capacities.points).for_each(|k| points.add(k).write(PointSlot::EMPTY));
        let observations = start.add(places.observations).cast::<ObservationSlot<T>>();
        (0..capacities.observations).for_each(|k| observations.add(k).write(ObservationSlot::EMPTY));
        let scalars = start.add(places.scalars).cast::<T>();
        (0..capacities.scalars()).for_each(|k| scalars.add(k).write(T::ZERO));
        window.write(Window { head, scalar: PhantomData });
    }
    Ok(window)
}

/// A window that the caller lends, its head read.
pub(crate) struct Lent<'a, T> {
    start: *mut u8,
    capacities: Capacities,
    places: Places,
    lent: PhantomData<&'a mut T>,
}

#[expect(private_bounds, reason = "the scalars of C are two")]
impl<'a, T: Sizes> Lent<'a, T> {
    /// # Safety
    /// A pointer that is not null points to at least `WINDOW_HEAD` bytes; if `create` wrote them, to the window, which
    /// nobody else uses for `'a`.
    pub(crate) unsafe fn new(window: *mut Window<T>) -> Result<Self, Status> {
        if window.is_null() {
            return Err(Status::NullPointer);
        }
        if !window.addr().is_multiple_of(WORKSPACE_ALIGN) {
            return Err(Status::Misaligned);
        }
        // SAFETY: not null, aligned; any bits are numbers.
        let head = unsafe { window.cast::<Head>().read() };
        let capacities = Capacities {
            frames: head.frames as usize,
            points: head.points as usize,
            observations: head.observations as usize,
            prior: head.prior != 0,
        };
        let places = if head.magic == T::MAGIC { capacities.places::<T>() } else { None };
        let places = places.ok_or(Status::NotAWindow)?;
        Ok(Self { start: window.cast::<u8>(), capacities, places, lent: PhantomData })
    }

    pub(crate) fn bytes(&self) -> Bytes {
        let start = self.start.addr();
        start..start.saturating_add(self.places.end)
    }

    /// The kernel's window. To be called when no argument overlaps the memory.
    pub(crate) fn open(self) -> Result<bundle::Window<'a, T>, Status> {
        // SAFETY: `create` laid the memory out by the same capacities and wrote all slots; it is lent for `'a`.
        let memory = unsafe { memory::<T>(self.start, &self.capacities, &self.places) };
        bundle::Window::new(memory).map_err(Status::from)
    }
}

/// Memory lent for a window.
///
/// # Safety
/// As of [`Memory::new`](crate::workspace::Memory::new).
pub(crate) unsafe fn lend<'a>(
    memory: *mut c_void,
    size: usize,
) -> Result<crate::workspace::Memory<'a>, Status> {
    // SAFETY: passed on.
    unsafe { crate::workspace::Memory::new(memory, size) }
}

/// Options of `epi_window_optimise` and of what refines a part of a window.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct BundleOptions<T> {
    /// Of this struct, in bytes.
    pub size: u32,
    /// Of an observation's distance in standard deviations: one of `epi_loss`.
    pub loss: u32,
    /// Which unknowns move: one of `epi_unknowns`.
    pub unknowns: u32,
    /// Iterations at the most, rejected steps included.
    pub max_iterations: u32,
    /// Evaluations of observations at the most, three to an observation and iteration.
    pub max_evaluations: u32,
    /// Scale of the loss, standard deviations.
    pub loss_scale: T,
    /// Converged where an iteration lowers the cost by less than this share.
    pub cost_tolerance: T,
    /// Damping of the first iteration, relative to the diagonal.
    pub initial_damping: T,
    /// An observation further off than this many standard deviations is reported as an outlier.
    pub outlier_sigma: T,
}

/// What an optimisation did.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct BundleReport<T> {
    /// Why it ended: one of `epi_termination`.
    pub termination: u32,
    /// 1 if any frame or point has moved.
    pub changed: u32,
    /// Iterations, rejected steps included.
    pub iterations: u32,
    /// Evaluations of observations.
    pub evaluations: u32,
    /// Observations that counted.
    pub observations: u32,
    /// Of them, outliers afterwards. More than half: the result is not to be trusted.
    pub outliers: u32,
    /// Observations that did not count, the point being out of the camera's view.
    pub behind: u32,
    /// Free points that did not move, seen fewer than twice.
    pub unused_points: u32,
    /// `1/2 sum rho` of observations, priors and distances before.
    pub cost_before: T,
    /// The same after; never larger.
    pub cost_after: T,
}

/// How well the observations of one point agree with it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct PointReport<T> {
    /// Observations.
    pub observations: u32,
    /// Of them, outliers.
    pub outliers: u32,
    /// Of them, where the camera does not see the point.
    pub behind: u32,
    /// Root mean square of the distances, in standard deviations, of those that see it.
    pub rms_sigma: T,
}

/// What a window knows of a frame: covariances by rows.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct FrameCovariance<T> {
    /// Of the pose: rotation (rad), then translation, of `R <- Exp(w) R`, `t <- t + dt`.
    pub pose: [[T; 6]; 6],
    /// Of the camera's centre in the world.
    pub centre: [[T; 3]; 3],
    /// Of the motion in the camera's own frame: rotation (rad), then the translation v of `centre <- centre - R' v`.
    pub motion: [[T; 6]; 6],
}

// SAFETY: plain numbers that begin with the size.
unsafe impl<T: Real> Grows for BundleOptions<T> {
    const FIRST: usize = size_of::<Self>();
}
// SAFETY: plain numbers.
unsafe impl<T: Real> Grows for BundleReport<T> {
    const FIRST: usize = size_of::<Self>();
}
// SAFETY: plain numbers.
unsafe impl<T: Real> Grows for PointReport<T> {
    const FIRST: usize = size_of::<Self>();
}
// SAFETY: plain numbers.
unsafe impl<T: Plain> Plain for FrameCovariance<T> {}

impl<T: Real> Defaults for BundleOptions<T> {
    fn defaults(size: usize) -> Self {
        let kernel = bundle::BundleOptions::<T>::default();
        let (loss, loss_scale) = loss_parts(kernel.loss);
        Self {
            size: size as u32,
            loss,
            unknowns: enums::Unknowns::FramesAndPoints as u32,
            max_iterations: kernel.max_iterations,
            max_evaluations: kernel.max_evaluations,
            loss_scale,
            cost_tolerance: kernel.cost_tolerance,
            initial_damping: kernel.initial_damping,
            outlier_sigma: kernel.outlier_sigma,
        }
    }
}

impl<T: Real> BundleOptions<T> {
    pub(crate) fn to_kernel(self) -> Result<bundle::BundleOptions<T>, Status> {
        const BOTH: u32 = enums::Unknowns::FramesAndPoints as u32;
        const FRAMES: u32 = enums::Unknowns::Frames as u32;
        const POINTS: u32 = enums::Unknowns::Points as u32;
        Ok(bundle::BundleOptions {
            loss: loss(self.loss, self.loss_scale)?,
            unknowns: match self.unknowns {
                BOTH => bundle::Unknowns::FramesAndPoints,
                FRAMES => bundle::Unknowns::Frames,
                POINTS => bundle::Unknowns::Points,
                _ => return Err(Status::UnknownEnum),
            },
            max_iterations: self.max_iterations,
            max_evaluations: self.max_evaluations,
            cost_tolerance: self.cost_tolerance,
            initial_damping: self.initial_damping,
            outlier_sigma: self.outlier_sigma,
        })
    }
}

impl<T: Real> From<bundle::BundleReport<T>> for BundleReport<T> {
    fn from(kernel: bundle::BundleReport<T>) -> Self {
        use bundle::Termination as Kernel;
        use enums::Termination as C;
        let termination = match kernel.termination {
            Kernel::Converged => C::Converged,
            Kernel::IterationLimit => C::IterationLimit,
            Kernel::BudgetSpent => C::BudgetSpent,
            Kernel::Interrupted => C::Interrupted,
            Kernel::NoProgress => C::NoProgress,
            _ => C::Other,
        };
        Self {
            termination: termination as u32,
            changed: u32::from(kernel.changed),
            iterations: kernel.iterations,
            evaluations: kernel.evaluations,
            observations: kernel.observations as u32,
            outliers: kernel.outliers as u32,
            behind: kernel.behind as u32,
            unused_points: kernel.unused_points as u32,
            cost_before: kernel.cost_before,
            cost_after: kernel.cost_after,
        }
    }
}

impl<T: Real> From<bundle::PointReport<T>> for PointReport<T> {
    fn from(kernel: bundle::PointReport<T>) -> Self {
        Self {
            observations: kernel.observations as u32,
            outliers: kernel.outliers as u32,
            behind: kernel.behind as u32,
            rms_sigma: kernel.rms_sigma,
        }
    }
}

impl From<WindowError> for Status {
    fn from(error: WindowError) -> Self {
        match error {
            WindowError::MemoryTooSmall { .. } => Self::Workspace,
            WindowError::CapacityTooLarge => Self::TooLarge,
            WindowError::FramesFull => Self::FramesFull,
            WindowError::PointsFull => Self::PointsFull,
            WindowError::ObservationsFull => Self::ObservationsFull,
            WindowError::StaleFrame => Self::StaleFrame,
            WindowError::StalePoint => Self::StalePoint,
            WindowError::DuplicateObservation => Self::DuplicateObservation,
            WindowError::NoSuchObservation => Self::NoSuchObservation,
            WindowError::NotFinite => Self::NotFinite,
            WindowError::NotPositive => Self::NotPositive,
            WindowError::NotPositiveSemidefinite => Self::NotPositiveSemidefinite,
            WindowError::SameFrame => Self::SameFrame,
            WindowError::ContradictoryFixedFrames => Self::ContradictoryFixedFrames,
            WindowError::NoPriorMemory => Self::NoPriorMemory,
            _ => Self::Other,
        }
    }
}

impl From<BundleError> for Status {
    fn from(error: BundleError) -> Self {
        match error {
            BundleError::BadOption { .. } => Self::BadOption,
            BundleError::NothingFree => Self::NothingFree,
            BundleError::NoObservations => Self::NoObservations,
            BundleError::NoUsablePoint { .. } => Self::NoUsablePoint,
            BundleError::UnconstrainedFrame { .. } => Self::UnconstrainedFrame,
            BundleError::ContradictoryFixedFrames { .. } => Self::ContradictoryFixedFrames,
            BundleError::StaleFrame => Self::StaleFrame,
            BundleError::StalePoint => Self::StalePoint,
            BundleError::Unobservable => Self::Unobservable,
            _ => Self::Other,
        }
    }
}
