//! The caller's workspace cut into the slices of an estimator: numbers, an order, a mask.

use core::marker::PhantomData;

use epipole::Real;

use crate::Status;
use crate::raw::{Bytes, Plain, bytes_of};

/// What every workspace and window is aligned to, bytes.
pub const WORKSPACE_ALIGN: usize = 8;
/// Numbers a correspondence in a two-view workspace of pinhole and Brown-Conrady cameras, and of pixels.
pub const TWO_VIEW_NUMBERS: usize = 4;
/// Numbers a correspondence in a two-view workspace where a camera is a fisheye.
pub const TWO_VIEW_WIDE_NUMBERS: usize = 18;
/// Numbers a correspondence in an absolute-pose workspace of a pinhole or Brown-Conrady camera.
pub const ABSOLUTE_POSE_NUMBERS: usize = 5;
/// Numbers a correspondence in an absolute-pose workspace of a fisheye.
pub const ABSOLUTE_POSE_WIDE_NUMBERS: usize = 12;

/// What every workspace must be aligned to, in bytes: `EPI_WORKSPACE_ALIGN`.
#[unsafe(export_name = "epi_workspace_align")]
pub extern "C" fn workspace_align() -> usize {
    WORKSPACE_ALIGN
}

/// Bytes of a workspace for `count` correspondences of `width` numbers; 0 where no memory is that large.
pub(crate) fn size<T>(width: usize, count: usize) -> usize {
    let each = width * size_of::<T>() + size_of::<u32>() + size_of::<bool>();
    count.checked_next_multiple_of(4).and_then(|count| count.checked_mul(each)).unwrap_or(0)
}

/// Memory lent by the caller, not yet used.
pub(crate) struct Memory<'a> {
    start: *mut u8,
    bytes: Bytes,
    lent: PhantomData<&'a mut [u8]>,
}

impl<'a> Memory<'a> {
    /// # Safety
    /// A pointer that is not null points to `size` bytes, which nobody else uses for the lifetime.
    pub(crate) unsafe fn new(pointer: *mut core::ffi::c_void, size: usize) -> Result<Self, Status> {
        let start = pointer.cast::<u8>();
        // No reference yet: the caller need not have written to the memory.
        let bytes = bytes_of(start.cast_const(), size)?;
        if !start.addr().is_multiple_of(WORKSPACE_ALIGN) {
            return Err(Status::Misaligned);
        }
        Ok(Self { start, bytes, lent: PhantomData })
    }

    pub(crate) fn bytes(&self) -> Bytes {
        self.bytes.clone()
    }

    #[cfg(feature = "bundle")]
    pub(crate) fn start(&self) -> *mut u8 {
        self.start
    }

    /// The slices of an estimation of `count` correspondences of `width` numbers of `T`, the mask cleared.
    pub(crate) fn cut<T: Real + Plain>(self, width: usize, count: usize) -> Result<Slices<'a, T>, Status> {
        let needed = size::<T>(width, count);
        if needed > self.bytes.len() || (needed == 0 && count > 0) {
            return Err(Status::Workspace);
        }
        let rounded = count.next_multiple_of(4);
        let numbers = self.start.cast::<T>();
        // SAFETY: `needed` bytes hold the three arrays one behind the other; the start is aligned to 8, and each array
        // is a multiple of four elements, so the next is aligned. Zeros are values of all three.
        unsafe {
            self.start.write_bytes(0, needed);
            let order = numbers.add(width * rounded).cast::<u32>();
            let inliers = order.add(rounded).cast::<bool>();
            Ok(Slices {
                numbers: core::slice::from_raw_parts_mut(numbers, width * rounded),
                order: core::slice::from_raw_parts_mut(order, rounded),
                inliers: core::slice::from_raw_parts_mut(inliers, rounded),
            })
        }
    }
}

/// What an estimator's workspace is made of.
pub(crate) struct Slices<'a, T> {
    pub(crate) numbers: &'a mut [T],
    pub(crate) order: &'a mut [u32],
    pub(crate) inliers: &'a mut [bool],
}
