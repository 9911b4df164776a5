//! Entry points in single precision, each an exported function: `examples/firmware/measure` links the archive once for
//! every function, with all that it does not reach left out, and once for all of them. With the feature `alone` it holds the
//! relative pose with points alone: the compiler then sees every call, as in a firmware that needs nothing else, with
//! `no_planes` one that does without the look at planes.
#![no_std]
#![cfg_attr(feature = "alone", allow(dead_code, unused_imports))]
#![allow(improper_ctypes_definitions)]

use epipole::bundle::{BundleOptions, BundleReport, Window};
use epipole::estimate::*;
use epipole::geometry::triangulation::{Triangulation, ViewPair};
use epipole::geometry::{
    BrownConrady, Camera, CameraModel, CheiralPose, Essential, Homography, KannalaBrandt, Pinhole,
    PlaneMotion, Pose,
};
use epipole::nalgebra::{UnitQuaternion, Vector2, Vector3};
use epipole::refine::{RefineAbsolutePoseOptions, RefinedAbsolutePose};
use epipole::robust::loss::Loss;
use epipole::{Solutions, solvers as s};

type V2 = Vector2<f32>;
type V3 = Vector3<f32>;
type P = Pose<f32>;

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

/// Exports `$name`, which writes the value of an expression of its arguments.
macro_rules! entries {
    ($($name:ident($($x:ident: $t:ty),*) -> $r:ty = $e:expr;)*) => {
        $(#[unsafe(no_mangle)] pub extern "C" fn $name($($x: $t,)* out: &mut $r) { *out = $e; })*
    };
}

entries! {
    estimate_relative_pose_and_points(c: &Pinhole<f32>, a: &[V2], b: &[V2], max_error_px: f32,
        w: &mut RelativePoseWorkspace<'_, f32>, points: &mut [Option<V3>])
        -> Result<RelativePoseEstimate<f32>, RelativePoseError> = with_points(c, a, b, max_error_px, w, points);
}

#[cfg(not(feature = "alone"))]
entries! {
    relpose_5pt(a: &[V3; 5], b: &[V3; 5]) -> Solutions<Essential<f32>, 10> = s::relpose_5pt(a, b);
    relpose_5pt_poses(a: &[V3; 5], b: &[V3; 5]) -> Solutions<P, 10> = s::relpose_5pt_poses(a, b);
    relpose_7pt(a: &[V3; 7], b: &[V3; 7]) -> Solutions<epipole::geometry::Fundamental<f32>, 3> = s::relpose_7pt(a, b);
    relpose_8pt(a: &[V3], b: &[V3]) -> Option<Essential<f32>> = s::relpose_8pt(a, b).ok().flatten();
    relpose_8pt_to_pose(a: &[V3], b: &[V3]) -> Option<CheiralPose<f32>> = s::relpose_8pt(a, b).ok().flatten().and_then(|e| e.pose_by_cheirality(a, b));
    relpose_upright_3pt(a: &[V3; 3], b: &[V3; 3]) -> Solutions<P, 4> = s::relpose_upright_3pt(a, b);
    homography_4pt(a: &[V3; 4], b: &[V3; 4]) -> Option<Homography<f32>> = s::homography_4pt(a, b);
    homography_npt(a: &[V3], b: &[V3]) -> Option<Homography<f32>> = s::homography_npt(a, b).ok().flatten();
    p3p(a: &[V3; 3], b: &[V3; 3]) -> Solutions<P, 4> = s::p3p(a, b);
    abspose_upright_2pt(a: &[V3; 2], b: &[V3; 2]) -> Solutions<P, 2> = s::abspose_upright_2pt(a, b);
    abspose_npt(a: &[V3], b: &[V3]) -> Option<Solutions<P, 4>> = s::abspose_npt(a, b).ok();
    abspose_planar(a: &[V3], b: &[V2]) -> Option<Solutions<s::PlanarTargetPose<f32>, 2>> = s::abspose_planar(a, b).ok();
    rotation_2pt(a: &[V3; 2], b: &[V3; 2]) -> Option<UnitQuaternion<f32>> = s::rotation_2pt(a, b);
    pose_by_cheirality(e: &Essential<f32>, a: &[V3], b: &[V3]) -> Option<CheiralPose<f32>> = e.pose_by_cheirality(a, b);
    homography_motions(h: &Homography<f32>) -> Solutions<PlaneMotion<f32>, 4> = h.motions();
    triangulate_midpoint(p: &P, a: &V3, b: &V3) -> Triangulation<f32> = ViewPair::new(p).triangulate_midpoint(a, b);
    triangulate_optimal(p: &P, a: &V3, b: &V3) -> Triangulation<f32> = ViewPair::new(p).triangulate_optimal(a, b);
    pinhole_unproject(c: &Pinhole<f32>, x: &V2) -> Option<V3> = c.unproject(x).ok();
    brown_conrady_unproject(c: &BrownConrady<f32>, x: &V2) -> Option<V3> = c.unproject(x).ok();
    kannala_brandt_unproject(c: &KannalaBrandt<f32>, x: &V2) -> Option<V3> = c.unproject(x).ok();
    estimate_relative_pose(c: &Pinhole<f32>, a: &[V2], b: &[V2], o: &RelativePoseOptions<f32>, w: &mut RelativePoseWorkspace<'_, f32>)
        -> Option<RelativePoseEstimate<f32>> = relative_pose(c, c, a, b, o, w).ok();
    estimate_absolute_pose(c: &Pinhole<f32>, a: &[V2], b: &[V3], o: &AbsolutePoseOptions<f32>, w: &mut AbsolutePoseWorkspace<'_, f32>)
        -> Option<AbsolutePoseEstimate<f32>> = absolute_pose(c, a, b, o, w).ok();
    estimate_homography(a: &[V2], b: &[V2], o: &HomographyOptions<f32>, w: &mut HomographyWorkspace<'_, f32>)
        -> Option<HomographyEstimate<f32>> = homography(a, b, o, w).ok();
    estimate_fundamental(a: &[V2], b: &[V2], o: &FundamentalOptions<f32>, w: &mut FundamentalWorkspace<'_, f32>)
        -> Option<FundamentalEstimate<f32>> = fundamental(a, b, o, w).ok();
    refine_absolute(c: &Pinhole<f32>, a: &[V2], b: &[V3], start: &P, o: &RefineAbsolutePoseOptions<f32>)
        -> Option<RefinedAbsolutePose<f32>> = epipole::refine::absolute_pose(c, a, b, start, o).ok();
    window_optimise(w: &mut Window<'_, f32>, o: &BundleOptions<f32>) -> Option<BundleReport<f32>> = w.optimise(o).ok();
    window_fill(w: &mut Window<'_, f32>, c: &Camera<f32>, p: &P, x: &V3, u: &V2) -> bool = fill(w, c, p, x, u).is_some();
    window_marginalise(w: &mut Window<'_, f32>, loss: &Loss<f32>) -> bool = oldest(w, loss).is_some();
}

/// A relative pose and the points of its inliers, by options that the compiler sees: what none of them asks for (priors) is
/// left out.
#[inline(always)]
fn with_points(
    camera: &Pinhole<f32>,
    x1: &[V2],
    x2: &[V2],
    max_error_px: f32,
    workspace: &mut RelativePoseWorkspace<'_, f32>,
    points: &mut [Option<V3>],
) -> Result<RelativePoseEstimate<f32>, RelativePoseError> {
    let mut options = RelativePoseOptions::default();
    options.max_error_px = max_error_px;
    options.planes = !cfg!(feature = "no_planes");
    let estimate = relative_pose(camera, camera, x1, x2, &options, workspace);
    if let Ok(estimate) = &estimate
        && let Some(pose) = estimate.pose()
    {
        let pair = ViewPair::new(&pose);
        let views = x1.iter().zip(x2).zip(workspace.inliers());
        for (point, ((a, b), &inlier)) in points.iter_mut().zip(views) {
            *point = None;
            if inlier && let (Ok(a), Ok(b)) = (camera.unproject(a), camera.unproject(b)) {
                *point = pair.triangulate_midpoint(&a, &b).point();
            }
        }
    }
    estimate
}

fn fill(window: &mut Window<'_, f32>, camera: &Camera<f32>, pose: &P, point: &V3, pixel: &V2) -> Option<()> {
    let frame = window.add_frame(*camera, pose).ok()?;
    let point = window.add_point(point).ok()?;
    window.add_observation(frame, point, pixel, 1.0).ok()
}

fn oldest(window: &mut Window<'_, f32>, loss: &Loss<f32>) -> Option<usize> {
    let frame = window.frame_handles().next()?;
    window.marginalise_frame(frame, loss).ok()
}
