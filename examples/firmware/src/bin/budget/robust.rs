//! The robust estimators, on 100 correspondences of which 30 are wrong, and on correspondences that are all wrong.

use core::hint::black_box;

use epipole::estimate::{
    AbsolutePoseOptions, AbsolutePoseStorage, FundamentalOptions, FundamentalStorage, GravityPrior,
    HomographyOptions, HomographyStorage, RelativePoseOptions, RelativePosePrior, RelativePoseStorage,
    absolute_pose, fundamental, homography, relative_pose,
};
use epipole::geometry::triangulation::ViewPair;
use epipole::geometry::{CameraModel, Pinhole, Pose};
use epipole::nalgebra::{Matrix3, Vector3, Vector6};
use epipole::refine::{self, RefineAbsolutePoseOptions};
use epipole_problems::two_view::FOCAL;
use epipole_problems::{Geometry, TwoView};

use crate::row::{PROBLEMS, Trial, row, trial, workspace};

const N: usize = if cfg!(small_ram) { 24 } else { 100 };
/// Rotation error, rad, below which a problem counts as solved.
const SOLVED: f64 = 1e-2;

type Scene = TwoView<N>;

fn rows(name: &str, geometry: Geometry, mut run: impl FnMut(&Scene) -> Trial) {
    let count = if cfg!(small_ram) { 4 } else { (PROBLEMS / 8).min(32) };
    row(name, "ransac", 0..count, SOLVED, |k| run(&scene(geometry, k)));
    if !cfg!(small_ram) {
        row(name, "all wrong", 0..(PROBLEMS / 64).clamp(1, 4), SOLVED, |k| {
            let mut wrong = scene(geometry, k);
            wrong.x2 = scene(geometry, k + 77).x2;
            run(&wrong)
        });
    }
}

/// A scene with noise and wrong matches.
fn scene(geometry: Geometry, k: u32) -> Scene {
    let scene = Scene::new(geometry, k);
    if geometry == Geometry::Ransac { scene } else { scene.spoiled() }
}

fn rotation_error(scene: &Scene, pose: Option<Pose<f32>>) -> f64 {
    pose.map_or(f64::INFINITY, |p| scene.rotation_error(&p.rotation))
}

pub fn run() {
    let focal = FOCAL as f32;
    let Ok(camera) = Pinhole::new(focal, focal, 0.0, 0.0) else { return };
    workspace::<RelativePoseStorage<f32, 200>>("estimate_relative_pose");
    workspace::<AbsolutePoseStorage<f32, 200>>("estimate_absolute_pose");
    workspace::<HomographyStorage<f32, 200>>("estimate_homography");
    workspace::<FundamentalStorage<f32, 200>>("estimate_fundamental");
    let mut storage = RelativePoseStorage::<f32, N>::new();
    let mut workspace = storage.workspace();
    let mut options = RelativePoseOptions::<f32>::default();
    options.max_error_px = 2.0;
    options.ransac.confidence = 0.99;
    options.ransac.budget.max_iterations = 300;
    for gravity in [false, true] {
        let name = if gravity { "estimate_relative_pose, gravity" } else { "estimate_relative_pose" };
        rows(name, Geometry::Ransac, |scene| {
            let [x1, x2] = scene.pixels();
            let (view1, view2) = (Vector3::y(), scene.pose::<f32>().rotation * Vector3::y());
            let mut options = options;
            options.prior = gravity.then_some(RelativePosePrior::Gravity { view1, view2, sigma_rad: 0.009 });
            trial(
                || relative_pose(&camera, &camera, black_box(&x1), black_box(&x2), &options, &mut workspace),
                |estimate| rotation_error(scene, estimate.as_ref().ok().and_then(|e| e.pose())),
            )
        });
    }
    let mut points = [None; N];
    for planes in [true, false] {
        options.planes = planes;
        let name = ["estimate_relative_pose and points, no planes", "estimate_relative_pose and points"]
            [planes as usize];
        rows(name, Geometry::Ransac, |scene| {
            let [x1, x2] = scene.pixels();
            trial(
                || {
                    let (x1, x2) = (black_box(&x1), black_box(&x2));
                    let estimate = relative_pose(&camera, &camera, x1, x2, &options, &mut workspace).ok()?;
                    let pair = ViewPair::new(&estimate.pose()?);
                    for (point, ((a, b), &inlier)) in
                        points.iter_mut().zip(x1.iter().zip(x2).zip(workspace.inliers()))
                    {
                        *point = None;
                        if inlier && let (Ok(a), Ok(b)) = (camera.unproject(a), camera.unproject(b)) {
                            *point = pair.triangulate_midpoint(&a, &b).point();
                        }
                    }
                    Some(estimate)
                },
                |estimate| rotation_error(scene, estimate.as_ref().and_then(|e| e.pose())),
            )
        });
    }
    black_box(&points);
    let mut options = AbsolutePoseOptions::<f32>::default();
    options.max_error_px = 2.0;
    options.ransac.confidence = 0.99;
    options.ransac.budget.max_iterations = 300;
    let mut storage = AbsolutePoseStorage::<f32, N>::new();
    let mut workspace = storage.workspace();
    for gravity in [false, true] {
        let name = if gravity { "estimate_absolute_pose, gravity" } else { "estimate_absolute_pose" };
        rows(name, Geometry::Ransac, |scene| {
            let ([_, x2], points) = (scene.pixels(), scene.points::<f32, N>());
            let (world, camera_g) = (Vector3::y(), scene.pose::<f32>().rotation * Vector3::y());
            let mut options = options;
            options.gravity = gravity.then_some(GravityPrior { world, camera: camera_g, sigma_rad: 0.01 });
            trial(
                || absolute_pose(&camera, black_box(&x2), black_box(&points), &options, &mut workspace),
                |estimate| rotation_error(scene, estimate.as_ref().ok().and_then(|e| e.pose())),
            )
        });
    }
    matrices();
    rows("refine_absolute", Geometry::Ransac, |scene| {
        let ([_, x2], points) = (scene.pixels::<f32>(), scene.points::<f32, N>());
        let delta = Vector6::from([0.004, -0.003, 0.005, 0.01, 0.02, -0.01]);
        let start = epipole::geometry::pose::retract(&scene.pose::<f32>(), &delta);
        let right = (N * 3 / 10)..N;
        let (x2, points) = (&x2[right.clone()], &points[right]);
        let options = RefineAbsolutePoseOptions::default();
        trial(
            || refine::absolute_pose(&camera, black_box(x2), black_box(points), black_box(&start), &options),
            |refined| rotation_error(scene, refined.as_ref().ok().map(|r| r.pose)),
        )
    });
}

fn matrices() {
    let mut storage = RelativePoseStorage::<f32, N>::new();
    let mut workspace = storage.workspace();
    let mut options = HomographyOptions::<f32>::default();
    options.ransac.confidence = 0.99;
    options.ransac.budget.max_iterations = 300;
    rows("estimate_homography", Geometry::Planar, |scene| {
        let [x1, x2] = scene.pixels::<f32>();
        trial(
            || homography(black_box(&x1), black_box(&x2), &options, &mut workspace),
            |estimate| {
                let h = estimate.as_ref().ok().and_then(|e| e.homography());
                h.map_or(f64::INFINITY, |h| {
                    let k = Matrix3::from_diagonal(&Vector3::new(FOCAL, FOCAL, 1.0));
                    let inverse = Matrix3::from_diagonal(&Vector3::new(1.0 / FOCAL, 1.0 / FOCAL, 1.0));
                    scene.homography_error(&(inverse * h.0.map(f64::from) * k))
                })
            },
        )
    });
    let mut options = FundamentalOptions::<f32>::default();
    options.ransac.confidence = 0.99;
    options.ransac.budget.max_iterations = 300;
    rows("estimate_fundamental", Geometry::Ransac, |scene| {
        let [x1, x2] = scene.pixels::<f32>();
        trial(
            || fundamental(black_box(&x1), black_box(&x2), &options, &mut workspace),
            |estimate| match estimate.as_ref().ok().and_then(|e| e.fundamental()) {
                Some(f) => {
                    let k = Matrix3::from_diagonal(&Vector3::new(FOCAL, FOCAL, 1.0));
                    scene.essential_error(&(k * f.0.map(f64::from) * k))
                }
                None => f64::INFINITY,
            },
        )
    });
}
