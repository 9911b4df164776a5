//! Bundle adjustment of a sliding window, in fixed memory.
pub use constraint::PosePrior;
pub use covariance::FrameCovariance;
pub use error::{BundleError, WindowError};
pub use memory::{
    FrameHandle, FrameSlot, ObservationSlot, PointHandle, PointSlot, WindowHeader, WindowMemory,
    WindowStorage, prior_len, scalars_len, system_len,
};
pub use options::{BundleOptions, BundleReport, PointReport, Progress, Termination, Unknowns};
pub use window::Window;

mod constraint;
mod covariance;
mod error;
mod memory;
mod optimise;
mod options;
mod pass;
mod placement;
mod prior;
mod qr;
mod residual;
mod small;
mod square_root;
mod system;
mod window;
