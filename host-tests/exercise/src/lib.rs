//! Calls every public function of `epipole` on arbitrary bytes, in both scalars, without a panic path of its own.
//!
//! Three checks share it: the fuzz targets feed it bytes and demand that what is promised finite is finite; the image of
//! `host-tests/no-panic` links it and proves that no panic path is left; and its hashes compare bits between machines.
#![no_std]
#![forbid(unsafe_code)]

mod bundle;
mod estimate;
mod geometry;
mod linalg;
mod refine;
mod robust;
mod sink;
mod solvers;
mod source;
mod window_calls;

pub use sink::Sink;
pub use source::Source;

/// One group of functions, in both scalars.
#[derive(Clone, Copy)]
pub struct Capability {
    /// What is called, as a path in `epipole`.
    pub name: &'static str,
    /// In single precision.
    pub f32: fn(&mut Source<'_>, &mut Sink),
    /// In double precision.
    pub f64: fn(&mut Source<'_>, &mut Sink),
}

macro_rules! capabilities {
    ($($module:ident: $($function:ident)*;)*) => {
        &[$($(Capability {
            name: concat!(stringify!($module), "::", stringify!($function)),
            f32: $module::$function::<f32>,
            f64: $module::$function::<f64>,
        },)*)*]
    };
}

/// Every capability.
pub const CAPABILITIES: &[Capability] = capabilities! {
    linalg: scalar null_space row_qr lu ldlt symmetric_eigen svd3 polynomials;
    geometry: pose rotations pinhole brown_conrady kannala_brandt any_camera residuals two_view_triangulation
        many_view_triangulation essential homography fundamental;
    solvers: relpose_5pt relpose_7pt relpose_8pt homography absolute_minimal absolute_linear partial_motions;
    robust: losses sampling_and_stopping scoring engine;
    refine: two_views;
    bundle: window random_calls;
    estimate: two_view_relative_pose two_view_matrices absolute;
};
