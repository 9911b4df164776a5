//! `tests/layout.c` asserts in C that every struct has the size and the places that Rust gives it. `EPIPOLE_WRITE_HEADER=1 cargo
//! test -p epipole-capi --test layout` writes it.
#![cfg(target_pointer_width = "64")]

use std::fmt::Write as _;
use std::mem::offset_of;

use epipole_capi::{estimates::*, options::*, types::*, window::*};

macro_rules! layout {
    ($out:ident; $($name:ident $c:literal: $($field:ident)*;)*) => {$(
        layout!(@one $out $name $c f32 "f32": $($field)*);
        layout!(@one $out $name $c f64 "f64": $($field)*);
    )*};
    (@one $out:ident $name:ident $c:literal $scalar:ident $suffix:literal: $($field:ident)*) => {
        let c = concat!("epi_", $c, "_", $suffix);
        writeln!($out, "SIZE({c}, {});", size_of::<$name<$scalar>>()).unwrap();
        $(writeln!($out, "PLACE({c}, {}, {});", stringify!($field), offset_of!($name<$scalar>, $field)).unwrap();)*
    };
}

#[test]
fn the_committed_asserts_are_those_of_rust() {
    let mut out = String::from(
        "/* Made by kernel/capi/tests/layout.rs: sizes and places as Rust has them. */\n#include <epipole.h>\n\n\
         #define SIZE(type, size) _Static_assert(sizeof(type) == size, #type)\n\
         #define PLACE(type, field, place) _Static_assert(offsetof(type, field) == place, #type \".\" #field)\n\n",
    );
    layout!(out;
        Camera "camera": model fx fy cx cy distortion;
        RelativePoseOptions "relative_pose_options": size min_iterations max_iterations max_solver_calls max_residuals seed confidence max_error_px sigma_px least_motion_px prior_view1 prior_view2 prior_sigma_rad prior_rotation prior_covariance prior no_planes;
        SearchReport "search_report": residuals iterations solver_calls hypotheses refinements stop inliers cost miss_probability excluded_inlier_ratio rival_share;
        Pose "pose": rotation translation;
        RelativePoseEstimate "relative_pose_estimate": report verdict unobservable pose_count prior covariance_size noise_px prior_deviations poses normals baseline_over_distance covariance;
        HomographyOptions "homography_options": size min_iterations max_iterations max_solver_calls max_residuals seed confidence max_error_px sigma_px;
        HomographyEstimate "homography_estimate": report verdict unobservable has_covariance noise_px homography corners covariance;
        FundamentalOptions "fundamental_options": size min_iterations max_iterations max_solver_calls max_residuals seed confidence max_error_px sigma_px;
        FundamentalEstimate "fundamental_estimate": report verdict unobservable noise_px matrix;
        AbsolutePoseOptions "absolute_pose_options": size min_iterations max_iterations max_solver_calls max_residuals seed confidence max_error_px sigma_px gravity_world gravity_camera gravity_sigma_rad has_gravity;
        AbsolutePoseEstimate "absolute_pose_estimate": report verdict unobservable pose_count gravity has_covariance noise_px gravity_deviations rms_px poses covariance;
        RefinedRelativePose "refined_relative_pose": pose covariance has_covariance;
        RefineTwoViewOptions "refine_two_view_options": size max_passes loss loss_scale;
        RefinedTwoView "refined_two_view": matrix cost initial_cost active passes;
        RefineAbsolutePoseOptions "refine_absolute_pose_options": size max_passes loss has_prior loss_scale sigma_px prior_pose prior_information;
        RefinedAbsolutePose "refined_absolute_pose": pose covariance cost initial_cost has_covariance active passes;
        TriangulatedPoint "triangulated_point": point verdict view behind;
        RefinedPoint "refined_point": point cost_px_sq covariance_per_px_sq has_covariance converged evaluations;
        BundleOptions "bundle_options": size loss unknowns max_iterations max_evaluations loss_scale cost_tolerance initial_damping outlier_sigma;
        FrameCovariance "frame_covariance": pose centre motion;
        BundleReport "bundle_report": termination changed iterations evaluations observations outliers behind unused_points cost_before cost_after;
        PointReport "point_report": observations outliers behind rms_sigma;
    );
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/layout.c");
    if std::env::var_os("EPIPOLE_WRITE_HEADER").is_some() {
        std::fs::write(&path, &out).unwrap();
    }
    let committed = std::fs::read_to_string(&path).unwrap();
    assert_eq!(committed, out, "EPIPOLE_WRITE_HEADER=1 writes it");
}
