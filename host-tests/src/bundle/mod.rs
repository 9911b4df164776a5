//! Windows for tests and measurements: memory by run-time capacities, problems from files, synthetic flights.

pub mod flight;
pub mod odometer;
pub mod problem;
mod problem_file;

use epipole::Real;
use epipole::bundle::{
    FrameSlot, ObservationSlot, PointSlot, Window, WindowHeader, WindowMemory, scalars_len,
};

/// A window's memory on the heap.
pub struct HeapWindow<T: Real> {
    header: WindowHeader,
    frames: Vec<FrameSlot<T>>,
    points: Vec<PointSlot<T>>,
    observations: Vec<ObservationSlot<T>>,
    scalars: Vec<T>,
}

impl<T: Real> HeapWindow<T> {
    /// Memory of these capacities.
    pub fn new(frames: usize, points: usize, observations: usize) -> Self {
        Self {
            header: WindowHeader::EMPTY,
            frames: vec![FrameSlot::EMPTY; frames],
            points: vec![PointSlot::EMPTY; points],
            observations: vec![ObservationSlot::EMPTY; observations],
            scalars: vec![T::ZERO; scalars_len(frames)],
        }
    }

    /// Its size in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.header)
            + size_of_val(&*self.frames)
            + size_of_val(&*self.points)
            + size_of_val(&*self.observations)
            + size_of_val(&*self.scalars)
    }

    /// The window over it, as it was left.
    pub fn window(&mut self) -> Window<'_, T> {
        Window::new(WindowMemory {
            header: &mut self.header,
            frames: &mut self.frames,
            points: &mut self.points,
            observations: &mut self.observations,
            scalars: &mut self.scalars,
        })
        .expect("the memory fits")
    }
}
