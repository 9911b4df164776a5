//! What the tests share: seeded random numbers, scene generators, matchers that know the symmetries, and the one table
//! of tolerances.
//!
//! Scenes and truths are made in `f64`; measurements are rounded to the scalar under test where they are handed out, so
//! that one seed is the same problem in `f32` and `f64`.
//!
//! A failing case prints its seed; `EPIPOLE_SEED=<seed> cargo test -p epipole-host-tests <test>` runs that case alone.

pub mod bundle;
pub mod cases;
pub mod dial;
pub mod matchers;
pub mod oracle;
pub mod rng;
pub mod scenes;
pub mod source;
pub mod tolerances;
pub mod two_view;

pub use cases::{Share, for_each_case, share_of};
pub use rng::Rng;
pub use scenes::{AbsoluteScene, Motion, Scene, Shape, TwoView};

/// The README's examples, compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
pub struct Readme;
