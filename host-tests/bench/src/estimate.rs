//! `epipole::estimate` and `epipole::refine`, on scenes with outliers and 1 px of noise.

use epipole::Real;
use epipole::estimate::{
    self as e, AbsolutePoseOptions, AbsolutePoseWorkspace, FundamentalOptions, GravityPrior,
    HomographyOptions, RelativePoseOptions,
};
use epipole::geometry::{Pose, pose};
use epipole::nalgebra::{Vector2, Vector3, Vector6};
use epipole::real::lit;
use epipole::refine::{self, RefineAbsolutePoseOptions};
use epipole_host_tests::bundle::problem::cast_pose;
use epipole_host_tests::two_view::{Memory, scene_camera};
use epipole_host_tests::{AbsoluteScene, Motion, Scene, Shape, TwoView};

use crate::Run;

const PROBLEMS: u64 = 4;

crate::both_scalars! {
    relative_pose_of_100_with_30_outliers, relative_pose_of_200_with_100_outliers, relative_pose_of_plane,
    relative_pose_of_rotation, relative_pose_of_200_outliers, refine_relative_pose_of_100, homography_of_100_with_30_outliers,
    fundamental_of_100_with_30_outliers, absolute_pose_of_100_with_30_outliers, absolute_pose_with_gravity,
    refine_absolute_pose_of_100,
}

fn scene(motion: Motion, points: usize, outliers: f64) -> Scene {
    Scene::new(motion, points).noise_px(1.0).outliers(outliers)
}

fn generated(scene: Scene) -> impl Iterator<Item = TwoView> {
    (0..PROBLEMS).map(move |seed| scene.generate(seed))
}

/// Runs `call` on the pixels of each problem, over memory made before.
fn two_view<T: Real, X: 'static, O>(
    scene: Scene,
    with: impl Fn(&TwoView) -> X,
    call: impl Fn(&[Vector2<T>], &[Vector2<T>], &X, &mut e::TwoViewWorkspace<'_, T>) -> O + 'static,
) -> Run {
    let problems: Vec<_> = generated(scene).map(|problem| (problem.pixels::<T>(), with(&problem))).collect();
    let mut memory = Memory::new(scene.points);
    Run {
        calls: problems.len(),
        body: Box::new(move || {
            for ((x1, x2), extra) in std::hint::black_box(&problems) {
                std::hint::black_box(&call(x1, x2, extra, &mut memory.workspace()));
            }
        }),
    }
}

fn relative_pose<T: Real>(scene: Scene) -> Run {
    let camera = scene_camera::<T>();
    let options = RelativePoseOptions::default();
    two_view(
        scene,
        |_| (),
        move |x1, x2, (), workspace| e::relative_pose(&camera, &camera, x1, x2, &options, workspace),
    )
}

fn relative_pose_of_100_with_30_outliers<T: Real>() -> Run {
    relative_pose::<T>(scene(Motion::General, 100, 0.3))
}

fn relative_pose_of_200_with_100_outliers<T: Real>() -> Run {
    relative_pose::<T>(scene(Motion::General, 200, 0.5))
}

fn relative_pose_of_plane<T: Real>() -> Run {
    relative_pose::<T>(scene(Motion::General, 100, 0.3).shape(Shape::Plane))
}

fn relative_pose_of_rotation<T: Real>() -> Run {
    relative_pose::<T>(scene(Motion::PureRotation, 100, 0.3))
}

fn relative_pose_of_200_outliers<T: Real>() -> Run {
    let camera = scene_camera::<T>();
    let mut options = RelativePoseOptions::default();
    options.ransac.budget.max_iterations = 200;
    two_view(
        scene(Motion::General, 200, 1.0),
        |_| (),
        move |x1, x2, (), workspace| e::relative_pose(&camera, &camera, x1, x2, &options, workspace),
    )
}

/// The truth, a little moved: where a refinement starts.
fn moved<T: Real>(truth: &Pose<f64>) -> Pose<T> {
    cast_pose(&pose::retract(truth, &Vector6::new(0.01, -0.01, 0.01, 0.02, 0.02, -0.02)))
}

fn refine_relative_pose_of_100<T: Real>() -> Run {
    let camera = scene_camera::<T>();
    let options = RelativePoseOptions::default();
    let start = |problem: &TwoView| moved::<T>(&problem.pose);
    two_view(scene(Motion::General, 100, 0.0), start, move |x1, x2, start, workspace| {
        e::refine_relative_pose(&camera, &camera, x1, x2, start, &options, workspace)
    })
}

fn homography_of_100_with_30_outliers<T: Real>() -> Run {
    let scene = scene(Motion::General, 100, 0.3).shape(Shape::Plane);
    let options = HomographyOptions::default();
    two_view::<T, _, _>(
        scene,
        |_| (),
        move |x1, x2, (), workspace| e::homography(x1, x2, &options, workspace),
    )
}

fn fundamental_of_100_with_30_outliers<T: Real>() -> Run {
    let options = FundamentalOptions::default();
    two_view::<T, _, _>(
        scene(Motion::General, 100, 0.3),
        |_| (),
        move |x1, x2, (), workspace| e::fundamental(x1, x2, &options, workspace),
    )
}

fn absolute_scenes(outliers: f64) -> Vec<AbsoluteScene> {
    (0..PROBLEMS).map(|seed| AbsoluteScene::generate(&scene(Motion::General, 100, outliers), seed)).collect()
}

fn absolute_pose<T: Real>(options: impl Fn(&AbsoluteScene) -> AbsolutePoseOptions<T>) -> Run {
    let camera = scene_camera::<T>();
    let problems: Vec<_> =
        absolute_scenes(0.3).iter().map(|s| (s.pixels::<T>(), s.points::<T>(), options(s))).collect();
    let (mut numbers, mut order, mut inliers) = (vec![T::ZERO; 500], vec![0; 100], vec![false; 100]);
    Run {
        calls: problems.len(),
        body: Box::new(move || {
            for (x, points, options) in std::hint::black_box(&problems) {
                let mut workspace =
                    AbsolutePoseWorkspace::from_slices(&mut numbers, &mut order, &mut inliers);
                std::hint::black_box(&e::absolute_pose(&camera, x, points, options, &mut workspace));
            }
        }),
    }
}

fn absolute_pose_of_100_with_30_outliers<T: Real>() -> Run {
    absolute_pose::<T>(|_| AbsolutePoseOptions::default())
}

fn absolute_pose_with_gravity<T: Real>() -> Run {
    absolute_pose::<T>(|scene| {
        let mut options = AbsolutePoseOptions::default();
        let camera = (scene.pose.rotation * Vector3::y()).map(lit);
        options.gravity = Some(GravityPrior { world: Vector3::y(), camera, sigma_rad: lit(0.005) });
        options
    })
}

fn refine_absolute_pose_of_100<T: Real>() -> Run {
    let camera = scene_camera::<T>();
    let problems = absolute_scenes(0.0)
        .iter()
        .map(|s| (s.pixels::<T>(), s.points::<T>(), moved::<T>(&s.pose)))
        .collect();
    let options = RefineAbsolutePoseOptions::default();
    Run::each(problems, move |(x, points, start)| refine::absolute_pose(&camera, x, points, start, &options))
}
