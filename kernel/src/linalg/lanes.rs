//! Numbers side by side, for sums whose order is the same on every target.

/// Correspondences worked on side by side. Fixed in the source.
pub const LANES: usize = 4;

/// One number a lane.
pub type Lanes<T> = [T; LANES];
