//! `epipole::geometry`: what runs once a correspondence, a point or a hypothesis.

use epipole::Real;
use epipole::geometry::triangulation::{View, ViewPair, refine_point, triangulate_dlt};
use epipole::geometry::{
    BrownConrady, CameraModel, Essential, Fundamental, Homography, KannalaBrandt, Pinhole, Pose, cheirality,
    pose, residual,
};
use epipole::nalgebra::{Matrix3, Matrix3x2, Vector2, Vector3, Vector6};
use epipole::real::lit;
use epipole_host_tests::bundle::problem::cast_pose;
use epipole_host_tests::two_view::scene_camera;
use epipole_host_tests::{Motion, Rng, Scene, Shape, TwoView};

use crate::Run;

const PROBLEMS: u64 = 32;

crate::both_scalars! {
    essential_from_pose, essential_nearest, essential_poses, essential_pose_by_cheirality_of_5,
    in_front_of_both, fundamental_nearest, homography_motions,
    homography_visible_motions_of_4, triangulate_midpoint, triangulate_dlt_pair, triangulate_dlt_of_5_views,
    triangulate_optimal, triangulate_optimal_bearings, refine_point_of_5_views, pair_covariance, sampson,
    sampson_with_jacobian, sampson_bearing, symmetric_epipolar_sq, transfer_with_jacobian, symmetric_transfer_sq,
    reprojection, reprojection_with_jacobians, pinhole_unproject, brown_conrady_project, brown_conrady_unproject,
    kannala_brandt_project, kannala_brandt_unproject, rotation_exp, rotation_log, retract, nearest_rotation,
}

fn scenes(points: usize) -> impl Iterator<Item = TwoView> {
    (0..PROBLEMS).map(move |seed| Scene::new(Motion::General, points).noise_px(0.5).generate(seed))
}

fn planes(points: usize) -> impl Iterator<Item = TwoView> {
    let scene = Scene::new(Motion::General, points).shape(Shape::Plane).noise_px(0.5);
    (0..PROBLEMS).map(move |seed| scene.generate(seed))
}

fn essentials<T: Real>() -> Vec<Essential<T>> {
    scenes(1).map(|scene| Essential(scene.essential().map(lit))).collect()
}

fn essential_from_pose<T: Real>() -> Run {
    let poses = scenes(1).map(|scene| cast_pose::<f64, T>(&scene.pose)).collect();
    Run::each(poses, |pose| Essential::from_pose(pose))
}

fn essential_nearest<T: Real>() -> Run {
    let mut rng = Rng::new(1);
    let near = |scene: TwoView| {
        let e = scene.essential().normalize();
        Essential((e + Matrix3::from_fn(|_, _| 0.01 * rng.normal())).map(lit::<T>))
    };
    Run::each(scenes(1).map(near).collect(), |e| e.nearest())
}

fn essential_poses<T: Real>() -> Run {
    Run::each(essentials::<T>(), |e| e.poses())
}

/// E with the bearings of five points.
type WithFive<T> = (Essential<T>, Vec<Vector3<T>>, Vec<Vector3<T>>);

fn essentials_with_five<T: Real>() -> Vec<WithFive<T>> {
    let with = |scene: TwoView| {
        let (x1, x2) = scene.bearings();
        (Essential(scene.essential().map(lit)), x1, x2)
    };
    scenes(5).map(with).collect()
}

fn essential_pose_by_cheirality_of_5<T: Real>() -> Run {
    Run::each(essentials_with_five::<T>(), |(e, x1, x2)| e.pose_by_cheirality(x1, x2))
}

/// The pose of view 2 and one point's bearings.
type Rays<T> = (Pose<T>, Vector3<T>, Vector3<T>);

fn rays<T: Real>() -> Vec<Rays<T>> {
    let with = |scene: TwoView| {
        let (x1, x2) = scene.bearings();
        (cast_pose(&scene.pose), x1[0], x2[0])
    };
    scenes(1).map(with).collect()
}

fn in_front_of_both<T: Real>() -> Run {
    Run::each(rays::<T>(), |(pose, x1, x2)| cheirality::in_front_of_both(pose, x1, x2))
}

fn fundamental_nearest<T: Real>() -> Run {
    let mut rng = Rng::new(2);
    let near = |scene: TwoView| {
        let f = scene.essential().normalize();
        Fundamental((f + Matrix3::from_fn(|_, _| 0.01 * rng.normal())).map(lit::<T>))
    };
    Run::each(scenes(1).map(near).collect(), |f| f.nearest())
}

fn homography_motions<T: Real>() -> Run {
    let homographies = planes(1).map(|scene| Homography(scene.homography().map(lit::<T>))).collect();
    Run::each(homographies, |h| h.motions())
}

fn homography_visible_motions_of_4<T: Real>() -> Run {
    let with = |scene: TwoView| (Homography(scene.homography().map(lit::<T>)), scene.bearings::<T>().0);
    Run::each(planes(4).map(with).collect(), |(h, x1)| h.visible_motions(x1))
}

fn view_pairs<T: Real>() -> Vec<(ViewPair<T>, Vector3<T>, Vector3<T>)> {
    rays().into_iter().map(|(pose, x1, x2)| (ViewPair::new(&pose), x1, x2)).collect()
}

fn triangulate_midpoint<T: Real>() -> Run {
    Run::each(view_pairs::<T>(), |(views, x1, x2)| views.triangulate_midpoint(x1, x2))
}

fn triangulate_dlt_pair<T: Real>() -> Run {
    Run::each(view_pairs::<T>(), |(views, x1, x2)| views.triangulate_dlt(x1, x2))
}

fn triangulate_optimal<T: Real>() -> Run {
    Run::each(view_pairs::<T>(), |(views, x1, x2)| views.triangulate_optimal(x1, x2))
}

/// Derivatives of two bearings by their pixels.
fn bearing_jacobians<T: Real>() -> [Matrix3x2<T>; 2] {
    [0.2, -0.3].map(|x| {
        let pixel = Vector2::new(lit::<T>(620.5 + 718.0 * x), lit(150.0));
        scene_camera().unproject_with_jacobian(&pixel).expect("a pixel of the image").1
    })
}

fn triangulate_optimal_bearings<T: Real>() -> Run {
    let [j1, j2] = bearing_jacobians::<T>();
    Run::each(view_pairs::<T>(), move |(views, x1, x2)| views.triangulate_optimal_bearings(x1, x2, &j1, &j2))
}

fn pair_covariance<T: Real>() -> Run {
    let with =
        |scene: TwoView| (ViewPair::new(&cast_pose::<f64, T>(&scene.pose)), scene.points[0].map(lit::<T>));
    let sigma = lit(1e-3);
    Run::each(scenes(1).map(with).collect(), move |(views, point)| views.covariance(point, sigma))
}

/// A point seen by five cameras: poses, pixels, and the point.
type FiveViews<T> = (Vec<Pose<T>>, Vec<Vector2<T>>, Vector3<T>);

fn five_views<T: Real>() -> Vec<FiveViews<T>> {
    let mut rng = Rng::new(3);
    let with = |scene: TwoView| {
        let point = scene.points[0];
        let mut poses = Vec::new();
        let mut pixels = Vec::new();
        for k in 0..5 {
            let pose = Pose::translation(0.4 * f64::from(k), 0.1 * rng.normal(), 0.1 * rng.normal());
            let seen = scene_camera::<f64>().project(&(point + pose.translation.vector)).expect("in front");
            poses.push(cast_pose(&pose));
            pixels.push((seen + Vector2::new(rng.normal(), rng.normal())).map(lit));
        }
        (poses, pixels, point.map(lit))
    };
    scenes(1).map(with).collect()
}

fn triangulate_dlt_of_5_views<T: Real>() -> Run {
    let camera = scene_camera::<T>();
    let with = |(poses, pixels, _): FiveViews<T>| {
        let bearings = pixels.iter().map(|x| camera.unproject(x).expect("a pixel")).collect::<Vec<_>>();
        (poses, bearings)
    };
    Run::each(five_views().into_iter().map(with).collect(), |(poses, bearings)| {
        triangulate_dlt(poses, bearings)
    })
}

fn refine_point_of_5_views<T: Real>() -> Run {
    let camera = scene_camera::<T>();
    Run::each(five_views::<T>(), move |(poses, pixels, point)| {
        let views: [View<'_, T, Pinhole<T>>; 5] =
            std::array::from_fn(|k| View { camera: &camera, pose: poses[k] });
        refine_point(&views, pixels, &(point * lit::<T>(1.05)))
    })
}

/// A matrix and a correspondence in pixels.
type InPixels<T> = (Matrix3<T>, Vector2<T>, Vector2<T>);

fn in_pixels<T: Real>(
    scenes: impl Iterator<Item = TwoView>,
    of: fn(&TwoView) -> Matrix3<f64>,
) -> Vec<InPixels<T>> {
    let with = |scene: TwoView| {
        let (x1, x2) = scene.pixels();
        (of(&scene).map(lit), x1[0], x2[0])
    };
    scenes.map(with).collect()
}

fn pixel_homography(scene: &TwoView) -> Matrix3<f64> {
    let k = epipole_host_tests::scenes::calibration();
    Homography(scene.homography()).to_pixels(&k, &k).expect("a calibration is regular").0
}

fn sampson<T: Real>() -> Run {
    Run::each(in_pixels::<T>(scenes(1), TwoView::fundamental), |(f, x1, x2)| residual::sampson(f, x1, x2))
}

fn sampson_with_jacobian<T: Real>() -> Run {
    Run::each(in_pixels::<T>(scenes(1), TwoView::fundamental), |(f, x1, x2)| {
        residual::sampson_with_jacobian(f, x1, x2)
    })
}

fn sampson_bearing<T: Real>() -> Run {
    let [j1, j2] = bearing_jacobians::<T>();
    Run::each(essentials_with_five::<T>(), move |(e, x1, x2)| {
        residual::sampson_bearing(&e.0, &x1[0], &x2[0], &j1, &j2)
    })
}

fn symmetric_epipolar_sq<T: Real>() -> Run {
    Run::each(in_pixels::<T>(scenes(1), TwoView::fundamental), |(f, x1, x2)| {
        residual::symmetric_epipolar_sq(f, x1, x2)
    })
}

fn transfer_with_jacobian<T: Real>() -> Run {
    Run::each(in_pixels::<T>(planes(1), pixel_homography), |(h, x1, x2)| {
        residual::transfer_with_jacobian(h, x1, x2)
    })
}

fn symmetric_transfer_sq<T: Real>() -> Run {
    let with_inverse = |(h, x1, x2): InPixels<T>| (h, Homography(h).inverse().expect("regular").0, x1, x2);
    let problems = in_pixels::<T>(planes(1), pixel_homography).into_iter().map(with_inverse).collect();
    Run::each(problems, |(h, inverse, x1, x2)| residual::symmetric_transfer_sq(h, inverse, x1, x2))
}

/// A pose, a point of the first view's frame, and its pixel in the second.
fn seen<T: Real>() -> Vec<(Pose<T>, Vector3<T>, Vector2<T>)> {
    let with = |scene: TwoView| (cast_pose(&scene.pose), scene.points[0].map(lit), scene.pixels().1[0]);
    scenes(1).map(with).collect()
}

fn reprojection<T: Real>() -> Run {
    let camera = scene_camera::<T>();
    Run::each(seen::<T>(), move |(pose, point, pixel)| residual::reprojection(&camera, pose, point, pixel))
}

fn reprojection_with_jacobians<T: Real>() -> Run {
    let camera = scene_camera::<T>();
    Run::each(seen::<T>(), move |(pose, point, pixel)| {
        residual::reprojection_with_jacobians(&camera, pose, point, pixel)
    })
}

fn project<T: Real>(camera: impl CameraModel<T> + 'static) -> Run {
    let points = scenes(1).map(|scene| scene.points[0].map(lit::<T>)).collect();
    Run::each(points, move |point| camera.project_with_jacobian(point))
}

fn unproject<T: Real>(camera: impl CameraModel<T> + 'static) -> Run {
    let pixels = scenes(1).map(|scene| scene.pixels::<T>().0[0]).collect();
    Run::each(pixels, move |pixel| camera.unproject(pixel))
}

fn brown_conrady<T: Real>() -> BrownConrady<T> {
    let distortion = [-0.28, 0.07, 2e-4, 1e-5, 0.0].map(lit);
    BrownConrady::new(scene_camera(), distortion).expect("an ordinary lens")
}

fn kannala_brandt<T: Real>() -> KannalaBrandt<T> {
    let coefficients = [3e-3, 7e-4, -2e-3, 2e-4].map(lit);
    KannalaBrandt::new(scene_camera(), coefficients).expect("an ordinary fisheye")
}

fn pinhole_unproject<T: Real>() -> Run {
    unproject(scene_camera::<T>())
}

fn brown_conrady_project<T: Real>() -> Run {
    project(brown_conrady::<T>())
}

fn brown_conrady_unproject<T: Real>() -> Run {
    unproject(brown_conrady::<T>())
}

fn kannala_brandt_project<T: Real>() -> Run {
    project(kannala_brandt::<T>())
}

fn kannala_brandt_unproject<T: Real>() -> Run {
    unproject(kannala_brandt::<T>())
}

fn small_turns<T: Real>() -> Vec<Vector3<T>> {
    let mut rng = Rng::new(4);
    (0..PROBLEMS).map(|_| (rng.direction() * rng.range(0.0, 0.5)).map(lit)).collect()
}

fn rotation_exp<T: Real>() -> Run {
    Run::each(small_turns::<T>(), |w| pose::exp(w))
}

fn rotation_log<T: Real>() -> Run {
    Run::each(small_turns::<T>().iter().map(pose::exp).collect(), |q| pose::log(q))
}

fn retract<T: Real>() -> Run {
    let steps = rays::<T>().into_iter().zip(small_turns::<T>());
    let steps = steps.map(|((pose, ..), w)| (pose, Vector6::new(w.x, w.y, w.z, w.z, w.x, w.y))).collect();
    Run::each(steps, |(pose, step)| pose::retract(pose, step))
}

fn nearest_rotation<T: Real>() -> Run {
    let mut rng = Rng::new(5);
    let near =
        |scene: TwoView| (scene.rotation() + Matrix3::from_fn(|_, _| 0.01 * rng.normal())).map(lit::<T>);
    Run::each(scenes(1).map(near).collect(), |m| pose::nearest_rotation(m))
}
