//! All memory that a server needs.

use epipole::nalgebra::{Vector2, Vector3};
use epipole_wire::{Decoder, encoded_len, reply_bytes, request_bytes};

/// Bytes for the longest request about `correspondences`, or for the longest answer, whichever is more: both live in one
/// buffer, one after the other.
#[must_use]
pub const fn frame_bytes(correspondences: usize) -> usize {
    let (request, reply) = (request_bytes(correspondences), encoded_len(reply_bytes(correspondences)));
    if request > reply { request } else { reply }
}

/// Memory for up to `N` correspondences of ordinary cameras, or `5 N / 18` (relative pose) and `5 N / 12` (absolute pose)
/// where a camera is a fisheye; `N` must be a multiple of 4 and not 0.
///
/// ```
/// use epipole_server::{Memory, frame_bytes};
/// static MEMORY: Memory<200, { frame_bytes(200) }> = Memory::new();
/// ```
pub struct Memory<const N: usize, const BYTES: usize> {
    frame: [u8; BYTES],
    numbers: [[f32; 5]; N],
    order: [u32; N],
    inliers: [bool; N],
    first: [Vector2<f32>; N],
    second: [Vector2<f32>; N],
    points: [Vector3<f32>; N],
    scores: [f32; N],
}

/// The correspondences and the estimators' workspace.
pub(crate) struct Slices<'m> {
    pub(crate) numbers: &'m mut [f32],
    pub(crate) order: &'m mut [u32],
    pub(crate) inliers: &'m mut [bool],
    /// Of view 1, or of the only view.
    pub(crate) first: &'m mut [Vector2<f32>],
    /// Of view 2.
    pub(crate) second: &'m mut [Vector2<f32>],
    /// Of the world.
    pub(crate) points: &'m mut [Vector3<f32>],
    pub(crate) scores: &'m mut [f32],
}

impl<const N: usize, const BYTES: usize> Memory<N, BYTES> {
    /// Empty memory.
    #[must_use]
    pub const fn new() -> Self {
        const { assert!(N > 0 && N.is_multiple_of(4), "the capacity is a multiple of 4") };
        const { assert!(N <= u16::MAX as usize, "a frame counts correspondences in 16 bits") };
        const { assert!(BYTES == frame_bytes(N), "BYTES is frame_bytes(N)") };
        Self {
            frame: [0; BYTES],
            numbers: [[0.0; 5]; N],
            order: [0; N],
            inliers: [false; N],
            first: [Vector2::new(0.0, 0.0); N],
            second: [Vector2::new(0.0, 0.0); N],
            points: [Vector3::new(0.0, 0.0, 0.0); N],
            scores: [0.0; N],
        }
    }

    pub(crate) fn split(&mut self) -> (Decoder<'_>, Slices<'_>) {
        let slices = Slices {
            numbers: self.numbers.as_flattened_mut(),
            order: &mut self.order,
            inliers: &mut self.inliers,
            first: &mut self.first,
            second: &mut self.second,
            points: &mut self.points,
            scores: &mut self.scores,
        };
        (Decoder::new(&mut self.frame), slices)
    }
}

impl<const N: usize, const BYTES: usize> Default for Memory<N, BYTES> {
    fn default() -> Self {
        Self::new()
    }
}
