//! Two-view problems through the estimators: options, memory and the pixels of a scene in one call.

use epipole::Real;
use epipole::estimate::{
    RelativePoseError, RelativePoseEstimate, RelativePoseOptions, TwoViewWorkspace, relative_pose,
};
use epipole::geometry::Pinhole;
use epipole::nalgebra::Vector2;
use epipole::real::lit;

use crate::scenes::{CENTRE, FOCAL, TwoView};

/// The scenes' camera.
pub fn scene_camera<T: Real>() -> Pinhole<T> {
    Pinhole::new(lit(FOCAL), lit(FOCAL), lit(CENTRE.0), lit(CENTRE.1)).expect("the scenes' camera is valid")
}

/// Memory for ordinary cameras, on the heap.
pub struct Memory<T> {
    numbers: Vec<T>,
    order: Vec<u32>,
    inliers: Vec<bool>,
}

impl<T: Real> Memory<T> {
    /// Room for `capacity` correspondences.
    pub fn new(capacity: usize) -> Self {
        let capacity = capacity.next_multiple_of(4);
        Self {
            numbers: vec![T::ZERO; 18 * capacity],
            order: vec![0; capacity],
            inliers: vec![false; capacity],
        }
    }

    /// The workspace of that memory.
    pub fn workspace(&mut self) -> TwoViewWorkspace<'_, T> {
        TwoViewWorkspace::from_slices(&mut self.numbers, &mut self.order, &mut self.inliers)
    }
}

/// The estimate of a scene, and the inlier mask.
pub fn estimate_scene<T: Real>(
    problem: &TwoView,
    options: &RelativePoseOptions<T>,
) -> Result<(RelativePoseEstimate<T>, Vec<bool>), RelativePoseError> {
    let (x1, x2) = problem.pixels::<T>();
    estimate_pixels(&x1, &x2, options)
}

/// The estimate of pixels of the scenes' camera, and the inlier mask.
pub fn estimate_pixels<T: Real>(
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    options: &RelativePoseOptions<T>,
) -> Result<(RelativePoseEstimate<T>, Vec<bool>), RelativePoseError> {
    let camera = scene_camera();
    let mut memory = Memory::new(x1.len());
    let mut workspace = memory.workspace();
    let estimate = relative_pose(&camera, &camera, x1, x2, options, &mut workspace)?;
    Ok((estimate, workspace.inliers().to_vec()))
}
