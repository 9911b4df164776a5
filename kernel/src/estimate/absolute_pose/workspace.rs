//! The memory of an absolute-pose estimation, owned by the caller.

use crate::Real;
use crate::estimate::workspace::impl_storage;
use crate::real::lit;
use crate::refine::blocks::Block;
use crate::refine::reprojection::{BearingPointBlock, PlanePointBlock};

/// Memory for up to `N` correspondences of an ordinary camera. `N` must be a multiple of 4 and not 0.
///
/// ```
/// use epipole::estimate::AbsolutePoseStorage;
/// let mut storage = AbsolutePoseStorage::<f32, 200>::new();
/// assert_eq!(storage.workspace().capacity(), 200);
/// ```
/// An impossible capacity does not compile:
/// ```compile_fail
/// let storage = epipole::estimate::AbsolutePoseStorage::<f32, 30>::new();
/// ```
#[derive(Clone, Debug)]
pub struct AbsolutePoseStorage<T, const N: usize> {
    numbers: [[T; 5]; N],
    order: [u32; N],
    inliers: [bool; N],
}

/// Memory for up to `N` correspondences of any camera, fisheye included: 2.4 times the numbers of
/// [`AbsolutePoseStorage`]. `N` must be a multiple of 4 and not 0.
#[derive(Clone, Debug)]
pub struct WideAbsolutePoseStorage<T, const N: usize> {
    numbers: [[T; 12]; N],
    order: [u32; N],
    inliers: [bool; N],
}

impl_storage!(AbsolutePoseStorage, 5, AbsolutePoseWorkspace);
impl_storage!(WideAbsolutePoseStorage, 12, AbsolutePoseWorkspace);

/// The caller's memory for an absolute-pose estimation, and after it the inlier mask.
#[derive(Debug)]
pub struct AbsolutePoseWorkspace<'a, T> {
    pub(super) numbers: &'a mut [T],
    pub(super) order: &'a mut [u32],
    pub(super) inliers: &'a mut [bool],
    pub(super) count: usize,
}

impl<'a, T: Real> AbsolutePoseWorkspace<'a, T> {
    /// A workspace over slices of any origin. `numbers` holds 5 a correspondence for an ordinary camera and 12 for a
    /// fisheye, in whole groups of 4 correspondences; `order` and `inliers` one a correspondence.
    #[must_use]
    pub fn from_slices(numbers: &'a mut [T], order: &'a mut [u32], inliers: &'a mut [bool]) -> Self {
        Self { numbers, order, inliers, count: 0 }
    }

    /// How many correspondences of an ordinary camera fit.
    #[must_use]
    pub fn capacity(&self) -> usize {
        self.capacity_of::<PlanePointBlock<T>>()
    }

    /// How many correspondences fit if the camera is a fisheye.
    #[must_use]
    pub fn wide_capacity(&self) -> usize {
        self.capacity_of::<BearingPointBlock<T>>()
    }

    pub(super) fn capacity_of<B: Block<T>>(&self) -> usize {
        let numbers = B::slice(self.numbers).len() * 4;
        [numbers, self.order.len(), self.inliers.len()].into_iter().fold(usize::MAX, core::cmp::min)
    }

    /// The inlier mask of the last estimate, one entry a correspondence; empty before the first.
    #[must_use]
    pub fn inliers(&self) -> &[bool] {
        self.inliers.get(..self.count).unwrap_or(&[])
    }
}
