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
//! point's observations, eliminates the point, and adds what is left to the frames' system, a triangle of 6x6 blocks. A
//! pixel depends on the direction of its point alone, so its Jacobian by the point `y` of the camera frame is `P D` with
//! `D = [1 0 -p; 0 1 -q]`, `p = y0 / y2`, `q = y1 / y2`: with the frame's motion `(w, v)` and the point's `dx`, an
//! observation is `r + P D (w x y + v + R dx)`, and a pair of frames costs one 2x2 product spread by `D` and two cross
//! products. The second pass, after the system is solved, computes the same Jacobians again, moves the point and compares
//! the costs: nothing is stored for an observation but what was measured. The change of the cost is summed point by
//! point, which keeps it meaningful in `f32` where the two costs no longer differ. While the cost falls by less than a
//! tenth, iterations keep the factored system and renew its right-hand side.
//!
//! A frame moves by a rotation about its own camera centre and a translation in its own axes: the world's origin may
//! be far away.
//!
//! Points are kept as XYZ. Bearing and inverse depth in the frame that saw a point first, adjusted by the same method on
//! 6 synthetic windows of 5 frames and 50 points, reach the same costs in as many iterations (34.3 against 34.3 on
//! average); with all points ten times as far away, hardly any parallax, XYZ reached the lower cost in all 6, and costs
//! 2.4 to 5.6 times lower after five iterations (`bundle_points` in `host-tests`, 2026-11-26). An anchor would also tie
//! every observation to two frames.
//!
//! # Memory and work
//! 8 frames, 100 points, 681 observations in `f32` take 23,856 bytes for everything one optimisation needs, 28,752 with
//! the prior (4,896 more; the test `memory_is_as_published`). A frame takes 516 bytes, a point 28, an observation 16.
//!
//! On a window of that size with 685 observations, two frames fixed, an iteration takes 1.03 million instructions with a
//! new system and 0.54 million with a kept one, 0.84 million on average over the first five, which end on
//! average no higher than five of Ceres (x86-64, callgrind, `-C no-vectorize-loops -C no-vectorize-slp`, 2026-11-26).
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
