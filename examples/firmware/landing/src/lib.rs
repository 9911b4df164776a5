//! Landing on four infrared beacons: which blob is which beacon, and where the camera is.
//!
//! [`Tracker`] turns the blobs of the sensor into a [`Sighting`]; [`simulation`] holds a sensor that is not there, and a
//! descent to try it on.
//!
//! The pad's frame has x and y along the arms of a cross and z into the ground; the camera looks at it from z < 0. Beacons
//! stand at the ends of arms of 6, 8, 14 and 12 cm: no turn of the cross looks like another, not even foreshortened, so that
//! blobs need no order.
#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod simulation;
mod tracker;

pub use tracker::{PadPose, Sighting, Tracker};

use epipole::geometry::Pinhole;
use epipole::nalgebra::Vector2;

/// Where the beacons stand, metres, clockwise as the camera sees them.
pub const BEACONS: [Vector2<f32>; 4] =
    [Vector2::new(-0.06, 0.0), Vector2::new(0.0, -0.08), Vector2::new(0.14, 0.0), Vector2::new(0.0, 0.12)];

/// The sensor's camera by its field of view of 33 x 23 degrees: `512 / tan 16.5 deg`, `384 / tan 11.5 deg`. Good to some
/// per cent; calibrate your own.
#[must_use]
pub fn nominal_camera() -> Pinhole<f32> {
    // These parameters make a camera, as the test shows.
    Pinhole::new(1728.5, 1887.4, 511.5, 383.5).unwrap_or_else(|_| unreachable!())
}
