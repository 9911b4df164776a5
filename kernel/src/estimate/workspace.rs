//! The memory of a two-view estimation, owned by the caller.

use crate::Real;
use crate::real::lit;
use crate::refine::blocks::{BearingBlock, Block, PlaneBlock};

/// Memory for up to `N` correspondences of two ordinary cameras. `N` must be a multiple of 4 and not 0.
///
/// ```
/// use epipole::estimate::TwoViewStorage;
/// let mut storage = TwoViewStorage::<f32, 200>::new();
/// assert_eq!(storage.workspace().capacity(), 200);
/// ```
/// An impossible capacity does not compile:
/// ```compile_fail
/// let storage = epipole::estimate::TwoViewStorage::<f32, 30>::new();
/// ```
#[derive(Clone, Debug)]
pub struct TwoViewStorage<T, const N: usize> {
    numbers: [[T; 4]; N],
    order: [u32; N],
    inliers: [bool; N],
}

/// Memory for up to `N` correspondences of any two cameras, fisheye included: 4.5 times the numbers of
/// [`TwoViewStorage`]. `N` must be a multiple of 4 and not 0.
#[derive(Clone, Debug)]
pub struct WideTwoViewStorage<T, const N: usize> {
    numbers: [[T; 18]; N],
    order: [u32; N],
    inliers: [bool; N],
}

/// Storage of `$width` numbers a correspondence, and its view as a `$workspace`.
macro_rules! impl_storage {
    ($name:ident, $width:literal, $workspace:ident) => {
        impl<T: Real, const N: usize> $name<T, N> {
            /// Empty memory.
            #[must_use]
            pub fn new() -> Self {
                const { assert!(N > 0 && N.is_multiple_of(4), "the capacity is a multiple of 4") };
                Self { numbers: [[lit(0.0); $width]; N], order: [0; N], inliers: [false; N] }
            }

            /// The view that estimators take; it does not depend on the capacity's type.
            pub fn workspace(&mut self) -> $workspace<'_, T> {
                $workspace::from_slices(self.numbers.as_flattened_mut(), &mut self.order, &mut self.inliers)
            }
        }

        impl<T: Real, const N: usize> Default for $name<T, N> {
            fn default() -> Self {
                Self::new()
            }
        }
    };
}
pub(super) use impl_storage;

impl_storage!(TwoViewStorage, 4, TwoViewWorkspace);
impl_storage!(WideTwoViewStorage, 18, TwoViewWorkspace);

/// The caller's memory for a two-view estimation, and after it the inlier mask.
#[derive(Debug)]
pub struct TwoViewWorkspace<'a, T> {
    pub(super) numbers: &'a mut [T],
    pub(super) order: &'a mut [u32],
    pub(super) inliers: &'a mut [bool],
    pub(super) count: usize,
}

/// The memory of [`relative_pose`](super::relative_pose).
pub type RelativePoseStorage<T, const N: usize> = TwoViewStorage<T, N>;

/// The workspace of [`relative_pose`](super::relative_pose).
pub type RelativePoseWorkspace<'a, T> = TwoViewWorkspace<'a, T>;

impl<'a, T: Real> TwoViewWorkspace<'a, T> {
    /// A workspace over slices of any origin. `numbers` holds 4 a correspondence for ordinary cameras and 18 for
    /// fisheye cameras, in whole groups of 4 correspondences; `order` and `inliers` one a correspondence.
    #[must_use]
    pub fn from_slices(numbers: &'a mut [T], order: &'a mut [u32], inliers: &'a mut [bool]) -> Self {
        Self { numbers, order, inliers, count: 0 }
    }

    /// How many correspondences of ordinary cameras fit.
    #[must_use]
    pub fn capacity(&self) -> usize {
        self.capacity_of::<PlaneBlock<T>>()
    }

    /// How many correspondences fit if one of the cameras is a fisheye.
    #[must_use]
    pub fn wide_capacity(&self) -> usize {
        self.capacity_of::<BearingBlock<T>>()
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
