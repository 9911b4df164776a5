//! The window as a view over its memory: adding, removing, reading.

use core::cell::Cell;

use nalgebra::{Vector2, Vector3};

use super::constraint::PosePrior;
use super::memory::{
    Distance, FrameHandle, FrameSlot, ObservationSlot, PointHandle, PointSlot, WindowHeader, WindowMemory,
    key, scalars_len,
};
use super::placement::Placement;
use super::small::{dot, sub};
use super::{WindowError, prior};
use crate::Real;
use crate::geometry::{Camera, Pose};
use crate::real::{abs, is_finite, lit, sqrt};

/// A sliding window of frames, points and observations in memory that the caller owns.
///
/// Nothing is allocated and nothing moves but observations, which are kept in order of point and frame. See the
/// [module](super) for an example.
#[derive(Debug)]
pub struct Window<'a, T: Real> {
    pub(super) header: &'a mut WindowHeader,
    pub(super) frames: &'a mut [FrameSlot<T>],
    pub(super) points: &'a mut [PointSlot<T>],
    pub(super) observations: &'a mut [ObservationSlot<T>],
    pub(super) scalars: &'a mut [T],
}

impl<'a, T: Real> Window<'a, T> {
    /// The window over `memory`, with what it holds already.
    ///
    /// # Errors
    /// [`WindowError::MemoryTooSmall`], [`WindowError::CapacityTooLarge`].
    pub fn new(memory: WindowMemory<'a, T>) -> Result<Self, WindowError> {
        memory.check()?;
        Ok(Self::over(memory))
    }

    pub(super) fn over(memory: WindowMemory<'a, T>) -> Self {
        let WindowMemory { header, frames, points, observations, scalars } = memory;
        Self { header, frames, points, observations, scalars }
    }

    /// Removes everything. Handles become stale.
    pub fn clear(&mut self) {
        self.header.observations = 0;
        self.header.prior_frames = 0;
        for slot in self.frames.iter_mut().filter(|f| f.is_live()) {
            *slot = FrameSlot { generation: slot.generation.wrapping_add(1), ..FrameSlot::EMPTY };
        }
        for slot in self.points.iter_mut().filter(|p| p.live) {
            *slot = PointSlot { generation: slot.generation.wrapping_add(1), ..PointSlot::EMPTY };
        }
    }

    /// Frames in the window.
    #[must_use]
    pub fn frame_count(&self) -> usize {
        self.frames.iter().filter(|f| f.is_live()).count()
    }

    /// Points in the window.
    #[must_use]
    pub fn point_count(&self) -> usize {
        self.points.iter().filter(|p| p.live).count()
    }

    /// Observations in the window.
    #[must_use]
    pub fn observation_count(&self) -> usize {
        self.header.observations
    }

    /// Adds a frame with its camera and its pose, world to camera.
    ///
    /// # Errors
    /// [`WindowError::NotFinite`], [`WindowError::FramesFull`].
    pub fn add_frame(&mut self, camera: Camera<T>, pose: &Pose<T>) -> Result<FrameHandle, WindowError> {
        let pose = Placement::from_pose(pose).ok_or(WindowError::NotFinite)?;
        let (index, slot) = (0u16..)
            .zip(self.frames.iter_mut())
            .find(|(_, f)| !f.is_live())
            .ok_or(WindowError::FramesFull)?;
        let generation = slot.generation;
        *slot = FrameSlot { camera: Some(camera), pose, generation, ..FrameSlot::EMPTY };
        Ok(FrameHandle { index, generation })
    }

    /// Adds a point of the world.
    ///
    /// # Errors
    /// [`WindowError::NotFinite`], [`WindowError::PointsFull`].
    pub fn add_point(&mut self, position: &Vector3<T>) -> Result<PointHandle, WindowError> {
        let position = finite_position(position)?;
        let (index, slot) =
            (0u16..).zip(self.points.iter_mut()).find(|(_, p)| !p.live).ok_or(WindowError::PointsFull)?;
        *slot = PointSlot { position, live: true, generation: slot.generation, ..PointSlot::EMPTY };
        Ok(PointHandle { index, generation: slot.generation })
    }

    /// Adds the observation of `point` by `frame` at `pixel`, each coordinate with the standard deviation `sigma_px`.
    /// A frame observes a point once at the most; the two handles name the observation from then on.
    ///
    /// # Errors
    /// [`WindowError::NotFinite`], [`WindowError::NotPositive`], [`WindowError::StaleFrame`],
    /// [`WindowError::StalePoint`], [`WindowError::DuplicateObservation`], [`WindowError::ObservationsFull`].
    ///
    /// # Cost
    /// Moves the observations of later points: free where points are added one after the other.
    pub fn add_observation(
        &mut self,
        frame: FrameHandle,
        point: PointHandle,
        pixel: &Vector2<T>,
        sigma_px: T,
    ) -> Result<(), WindowError> {
        self.frame(frame)?;
        self.point(point)?;
        let inverse_sigma = inverse_sigma(sigma_px)?;
        if !(is_finite(pixel.x) && is_finite(pixel.y)) {
            return Err(WindowError::NotFinite);
        }
        let new = ObservationSlot {
            pixel: [pixel.x, pixel.y],
            inverse_sigma,
            frame: frame.index,
            point: point.index,
        };
        let (at, found) = self.locate(frame, point);
        if found {
            return Err(WindowError::DuplicateObservation);
        }
        let count = self.header.observations;
        if count >= self.observations.len() {
            return Err(WindowError::ObservationsFull);
        }
        let mut carried = new;
        for slot in self.observations.iter_mut().take(count + 1).skip(at) {
            core::mem::swap(slot, &mut carried);
        }
        self.header.observations = count + 1;
        Ok(())
    }

    /// Removes a frame with its observations, its prior and its distances. A marginalisation prior that involves the
    /// frame gives up what it knows of it (the frame is projected out of it, as if it had been marginalised).
    ///
    /// # Errors
    /// [`WindowError::StaleFrame`].
    pub fn remove_frame(&mut self, frame: FrameHandle) -> Result<(), WindowError> {
        self.frame(frame)?;
        prior::project_out(self, frame.index);
        self.erase_frame(frame.index);
        Ok(())
    }

    pub(super) fn erase_frame(&mut self, index: u16) {
        self.retain_observations(|o| o.frame != index);
        for slot in self.frames.iter_mut() {
            if slot.distance.is_some_and(|d| d.other == index) {
                slot.distance = None;
            }
        }
        if let Some(slot) = self.frames.get_mut(index as usize) {
            *slot = FrameSlot { generation: slot.generation.wrapping_add(1), ..FrameSlot::EMPTY };
        }
    }

    /// Removes a point with its observations.
    ///
    /// # Errors
    /// [`WindowError::StalePoint`].
    pub fn remove_point(&mut self, point: PointHandle) -> Result<(), WindowError> {
        self.point(point)?;
        self.erase_point(point.index);
        self.retain_observations(|o| o.point != point.index);
        Ok(())
    }

    /// Takes the slot back; the observations are the caller's business.
    pub(super) fn erase_point(&mut self, index: u16) {
        if let Some(slot) = self.points.get_mut(index as usize) {
            *slot = PointSlot { generation: slot.generation.wrapping_add(1), ..PointSlot::EMPTY };
        }
    }

    /// Removes one observation; frame and point stay.
    ///
    /// # Errors
    /// [`WindowError::StaleFrame`], [`WindowError::StalePoint`], [`WindowError::NoSuchObservation`].
    pub fn remove_observation(&mut self, frame: FrameHandle, point: PointHandle) -> Result<(), WindowError> {
        self.frame(frame)?;
        self.point(point)?;
        if !self.locate(frame, point).1 {
            return Err(WindowError::NoSuchObservation);
        }
        let gone = key(point.index, frame.index);
        self.retain_observations(|o| o.key() != gone);
        Ok(())
    }

    /// Holds a frame where it is, or lets it go.
    ///
    /// # Errors
    /// [`WindowError::StaleFrame`].
    pub fn fix_frame(&mut self, frame: FrameHandle, fixed: bool) -> Result<(), WindowError> {
        self.frame_mut(frame)?.fixed = fixed;
        Ok(())
    }

    /// Holds a point where it is, or lets it go.
    ///
    /// # Errors
    /// [`WindowError::StalePoint`].
    pub fn fix_point(&mut self, point: PointHandle, fixed: bool) -> Result<(), WindowError> {
        self.point_mut(point)?.fixed = fixed;
        Ok(())
    }

    /// The pose of a frame, world to camera.
    ///
    /// # Errors
    /// [`WindowError::StaleFrame`].
    pub fn pose(&self, frame: FrameHandle) -> Result<Pose<T>, WindowError> {
        Ok(self.frame(frame)?.pose.pose())
    }

    /// Puts a frame at a pose. A marginalisation prior stays where it is.
    ///
    /// # Errors
    /// [`WindowError::StaleFrame`], [`WindowError::NotFinite`].
    pub fn set_pose(&mut self, frame: FrameHandle, pose: &Pose<T>) -> Result<(), WindowError> {
        let pose = Placement::from_pose(pose).ok_or(WindowError::NotFinite)?;
        self.frame_mut(frame)?.pose = pose;
        Ok(())
    }

    /// The position of a point in the world.
    ///
    /// # Errors
    /// [`WindowError::StalePoint`].
    pub fn position(&self, point: PointHandle) -> Result<Vector3<T>, WindowError> {
        Ok(self.point(point)?.position.into())
    }

    /// Puts a point at a position.
    ///
    /// # Errors
    /// [`WindowError::StalePoint`], [`WindowError::NotFinite`].
    pub fn set_position(&mut self, point: PointHandle, position: &Vector3<T>) -> Result<(), WindowError> {
        self.point_mut(point)?.position = finite_position(position)?;
        Ok(())
    }

    /// Sets or removes the prior of a frame's pose; a frame has one at the most.
    ///
    /// # Errors
    /// [`WindowError::StaleFrame`].
    pub fn set_pose_prior(
        &mut self,
        frame: FrameHandle,
        prior: Option<PosePrior<T>>,
    ) -> Result<(), WindowError> {
        self.frame_mut(frame)?.pose_prior = prior;
        Ok(())
    }

    /// Sets a known distance `|centre_a - centre_b|` with its standard deviation, both in the world's unit: what gives
    /// a monocular window its scale. A frame `a` has one at the most; setting it again replaces it.
    ///
    /// # Errors
    /// [`WindowError::StaleFrame`], [`WindowError::SameFrame`], [`WindowError::NotFinite`],
    /// [`WindowError::NotPositive`]; [`WindowError::ContradictoryFixedFrames`] where both are fixed elsewhere.
    pub fn set_distance(
        &mut self,
        a: FrameHandle,
        b: FrameHandle,
        distance: T,
        sigma: T,
    ) -> Result<(), WindowError> {
        let (first, second) = (self.frame(a)?, self.frame(b)?);
        if a == b {
            return Err(WindowError::SameFrame);
        }
        let inverse_sigma = inverse_sigma(sigma)?;
        if !is_finite(distance) {
            return Err(WindowError::NotFinite);
        }
        if !(distance > T::ZERO) {
            return Err(WindowError::NotPositive);
        }
        let distance = Distance { other: b.index, metres: distance, inverse_sigma };
        if first.fixed && second.fixed && contradicts(first, second, &distance) {
            return Err(WindowError::ContradictoryFixedFrames);
        }
        self.frame_mut(a)?.distance = Some(distance);
        Ok(())
    }

    /// Removes the distance set from a frame to another.
    ///
    /// # Errors
    /// [`WindowError::StaleFrame`].
    pub fn remove_distance(&mut self, a: FrameHandle) -> Result<(), WindowError> {
        self.frame_mut(a)?.distance = None;
        Ok(())
    }

    /// The frames of the window, by slot.
    pub fn frame_handles(&self) -> impl Iterator<Item = FrameHandle> + '_ {
        (0u16..)
            .zip(self.frames.iter())
            .filter(|(_, f)| f.is_live())
            .map(|(index, f)| FrameHandle { index, generation: f.generation })
    }

    /// The points of the window, by slot.
    pub fn point_handles(&self) -> impl Iterator<Item = PointHandle> + '_ {
        (0u16..)
            .zip(self.points.iter())
            .filter(|(_, p)| p.live)
            .map(|(index, p)| PointHandle { index, generation: p.generation })
    }

    /// The observations of a point: frame and pixel.
    ///
    /// # Errors
    /// [`WindowError::StalePoint`].
    pub fn observations_of(
        &self,
        point: PointHandle,
    ) -> Result<impl Iterator<Item = (FrameHandle, Vector2<T>)> + '_, WindowError> {
        self.point(point)?;
        Ok(self.group(point.index).iter().filter_map(|o| {
            let generation = self.frames.get(o.frame as usize)?.generation;
            Some((FrameHandle { index: o.frame, generation }, o.pixel.into()))
        }))
    }

    /// The observations of a point, in order of frame.
    pub(super) fn group(&self, point: u16) -> &[ObservationSlot<T>] {
        let live = self.live_observations();
        let start = live.partition_point(|o| o.point < point);
        let tail = live.split_at_checked(start).map_or(&[][..], |(_, tail)| tail);
        let count = tail.iter().take_while(|o| o.point == point).count();
        tail.split_at_checked(count).map_or(&[], |(group, _)| group)
    }

    pub(super) fn live_observations(&self) -> &[ObservationSlot<T>] {
        self.observations.split_at_checked(self.header.observations).map_or(&[], |(live, _)| live)
    }

    /// Where the observation stands or would stand, and whether it is there.
    fn locate(&self, frame: FrameHandle, point: PointHandle) -> (usize, bool) {
        let wanted = key(point.index, frame.index);
        let live = self.live_observations();
        let at = live.partition_point(|o| o.key() < wanted);
        (at, live.get(at).is_some_and(|o| o.key() == wanted))
    }

    pub(super) fn retain_observations(&mut self, keep: impl Fn(&ObservationSlot<T>) -> bool) {
        let count = self.header.observations;
        let cells = Cell::from_mut(&mut *self.observations).as_slice_of_cells();
        let mut free = cells.iter();
        let mut kept = 0;
        for cell in cells.iter().take(count) {
            let observation = cell.get();
            if keep(&observation)
                && let Some(target) = free.next()
            {
                target.set(observation);
                kept += 1;
            }
        }
        self.header.observations = kept;
    }

    pub(super) fn frame(&self, handle: FrameHandle) -> Result<&FrameSlot<T>, WindowError> {
        self.frames
            .get(handle.index as usize)
            .filter(|f| f.is_live() && f.generation == handle.generation)
            .ok_or(WindowError::StaleFrame)
    }

    fn frame_mut(&mut self, handle: FrameHandle) -> Result<&mut FrameSlot<T>, WindowError> {
        self.frames
            .get_mut(handle.index as usize)
            .filter(|f| f.is_live() && f.generation == handle.generation)
            .ok_or(WindowError::StaleFrame)
    }

    pub(super) fn point(&self, handle: PointHandle) -> Result<&PointSlot<T>, WindowError> {
        self.points
            .get(handle.index as usize)
            .filter(|p| p.live && p.generation == handle.generation)
            .ok_or(WindowError::StalePoint)
    }

    fn point_mut(&mut self, handle: PointHandle) -> Result<&mut PointSlot<T>, WindowError> {
        self.points
            .get_mut(handle.index as usize)
            .filter(|p| p.live && p.generation == handle.generation)
            .ok_or(WindowError::StalePoint)
    }

    pub(super) fn has_prior_memory(&self) -> bool {
        self.scalars.len() >= scalars_len(self.frames.len())
    }
}

/// Beyond five deviations.
pub(super) fn contradicts<T: Real>(a: &FrameSlot<T>, b: &FrameSlot<T>, distance: &Distance<T>) -> bool {
    let d = sub(&a.pose.centre, &b.pose.centre);
    abs(sqrt(dot(&d, &d)) - distance.metres) * distance.inverse_sigma > lit(5.0)
}

fn finite_position<T: Real>(position: &Vector3<T>) -> Result<[T; 3], WindowError> {
    let position = [position.x, position.y, position.z];
    if position.iter().all(|&x| is_finite(x)) { Ok(position) } else { Err(WindowError::NotFinite) }
}

fn inverse_sigma<T: Real>(sigma: T) -> Result<T, WindowError> {
    if !is_finite(sigma) {
        return Err(WindowError::NotFinite);
    }
    let inverse = T::ONE / sigma;
    if !(sigma > T::ZERO && is_finite(inverse)) {
        return Err(WindowError::NotPositive);
    }
    Ok(inverse)
}
