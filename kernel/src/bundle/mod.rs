//! Bundle adjustment of a sliding window, in fixed memory: frames, points and observations in, a consistent odometry
//! out, on a microcontroller.
//!
//! | what | where |
//! |---|---|
//! | memory, capacities | [`WindowStorage`], [`WindowMemory`], [`scalars_len`] |
//! | adding, removing, fixing, priors, distances | [`Window`], [`PosePrior`] |
//! | all frames and points | [`Window::optimise`], [`Window::optimise_while`] |
//! | a new frame alone, a point alone | [`Window::refine_frame`], [`Window::refine_point`] |
//! | dropping a frame, keeping what it said | [`Window::marginalise_frame`], [`Window::marginalise_point`] |
//! | how sure | [`Window::frame_covariance`], [`Window::point_covariance`], [`Window::point_report`] |
//!
//! # How it works
//! An iteration passes twice over the observations, which stand in order of their points. The first pass linearises a
//! point's observations, eliminates the point, and adds what is left to the frames' system, a triangle of 6x6 blocks.
//! With `y` the point in the camera, `D` the projection's Jacobian and `R` the rotation, an observation is
//! `r + D (w x y + v) + D R dx`, so a pair of frames costs one 3x3 product spread by two cross products. The second
//! pass, after the system is solved, computes the same Jacobians again, moves the point and compares the costs: nothing
//! is stored for an observation but what was measured. The change of the cost is summed point by point, which keeps it
//! meaningful in `f32` where the two costs no longer differ.
//!
//! A frame moves by a rotation about its own camera centre and a translation in its own axes: the world's origin may
//! be far away. Points are kept as XYZ.
//!
//! # Memory
//! `f32`, 8 frames, 100 points, 681 observations: less than 24 kB for everything one optimisation needs, 4.9 kB more for
//! the prior. An observation takes 16 bytes.
//!
//! # Examples
//! ```
//! use epipole::bundle::{BundleOptions, Termination, WindowStorage, scalars_len};
//! use epipole::geometry::{Camera, CameraModel, Pinhole, Pose};
//! use epipole::nalgebra::Vector3;
//!
//! const FRAMES: usize = 3;
//! let mut storage = WindowStorage::<f64, FRAMES, 8, 24, { scalars_len(FRAMES) }>::new();
//! let mut window = storage.window();
//! let camera: Camera<f64> = Pinhole::new(500.0, 500.0, 320.0, 240.0)?.into();
//!
//! // Three frames a metre apart, x to the right; the first two are known.
//! let truth = [0.0, 1.0, 2.0].map(|x| Pose::translation(-x, 0.0, 0.0));
//! let mut frames = [None; FRAMES];
//! for (k, pose) in truth.iter().enumerate() {
//!     let frame = window.add_frame(camera, pose)?;
//!     window.fix_frame(frame, k < 2)?;
//!     frames[k] = Some(frame);
//! }
//! let [Some(_), Some(_), Some(newest)] = frames else { unreachable!() };
//! for k in 0..8 {
//!     let k = f64::from(k);
//!     let x = Vector3::new(k - 3.0, (k * 1.7).sin(), 6.0 + (k * 2.3).cos());
//!     let point = window.add_point(&(x * 1.02))?; // two per cent off
//!     for (frame, pose) in frames.iter().flatten().zip(&truth) {
//!         let pixel = camera.project(&(pose * epipole::nalgebra::Point3::from(x)).coords).unwrap();
//!         window.add_observation(*frame, point, &pixel, 1.0)?;
//!     }
//! }
//! window.set_pose(newest, &Pose::translation(-1.9, 0.1, 0.0))?; // a bad guess
//!
//! let report = window.optimise(&BundleOptions::default())?;
//! assert_eq!(report.termination, Termination::Converged);
//! assert!(report.cost_after < 1e-9);
//! assert!((window.pose(newest)?.translation.vector - truth[2].translation.vector).norm() < 1e-6);
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```
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
