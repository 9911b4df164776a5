//! `epipole::solvers`: exact scenes, 1 px of noise where a solver takes more points than it needs.

use epipole::Real;
use epipole::nalgebra::{Matrix3x4, Vector2, Vector3};
use epipole::real::lit;
use epipole::solvers as s;
use epipole_host_tests::{AbsoluteScene, Motion, Scene, Shape};

use crate::{Case, Run};

const PROBLEMS: u64 = 32;

crate::both_scalars! {
    relpose_5pt, relpose_5pt_poses, relpose_7pt, relpose_8pt, relpose_8pt_of_20, fundamental_8pt, relpose_upright_3pt,
    homography_4pt, homography_npt_of_20, p3p, abspose_upright_2pt, abspose_npt_of_20, abspose_planar_of_20,
    resection_dlt_of_20, decompose_projection, rotation_2pt, rotation_npt_of_20, translation_2pt, translation_npt_of_20,
    absolute_orientation_npt_of_20, absolute_orientation_with_scale_npt_of_20,
}

/// The 5-point solver that takes `f32` and works in `f64` where it matters.
pub(crate) const RELPOSE_5PT_WIDE: Case = Case {
    name: "relpose_5pt_wide",
    scalar: "f32",
    prepare: || {
        Run::each(minimal::<f32, 5>(Scene::new(Motion::General, 5)), |(x1, x2)| s::relpose_5pt_wide(x1, x2))
    },
};

/// Bearings of both views.
type Pair<T, const N: usize> = ([Vector3<T>; N], [Vector3<T>; N]);

fn array<X: Copy, const N: usize>(list: &[X]) -> [X; N] {
    std::array::from_fn(|i| list[i])
}

fn minimal<T: Real, const N: usize>(scene: Scene) -> Vec<Pair<T, N>> {
    (0..PROBLEMS)
        .map(|seed| {
            let (x1, x2) = scene.generate(seed).bearings();
            (array(&x1), array(&x2))
        })
        .collect()
}

fn general<T: Real, const N: usize>() -> Vec<Pair<T, N>> {
    minimal(Scene::new(Motion::General, N).noise_px(if N > 8 { 1.0 } else { 0.0 }))
}

/// Pixels instead of bearings, for the fundamental matrix.
fn pixels<T: Real, const N: usize>() -> Vec<Pair<T, N>> {
    let scene = Scene::new(Motion::General, N);
    (0..PROBLEMS)
        .map(|seed| {
            let (x1, x2) = scene.generate(seed).homogeneous_pixels();
            (array(&x1), array(&x2))
        })
        .collect()
}

/// Bearings and points in the world.
fn absolute<T: Real, const N: usize>() -> Vec<Pair<T, N>> {
    let scene = Scene::new(Motion::General, N).noise_px(if N > 3 { 1.0 } else { 0.0 });
    (0..PROBLEMS)
        .map(|seed| {
            let problem = AbsoluteScene::generate(&scene, seed);
            (array(&problem.bearings()), array(&problem.points()))
        })
        .collect()
}

fn relpose_5pt<T: Real>() -> Run {
    Run::each(general::<T, 5>(), |(x1, x2)| s::relpose_5pt(x1, x2))
}

fn relpose_5pt_poses<T: Real>() -> Run {
    Run::each(general::<T, 5>(), |(x1, x2)| s::relpose_5pt_poses(x1, x2))
}

fn relpose_7pt<T: Real>() -> Run {
    Run::each(general::<T, 7>(), |(x1, x2)| s::relpose_7pt(x1, x2))
}

fn relpose_8pt<T: Real>() -> Run {
    Run::each(general::<T, 8>(), |(x1, x2)| s::relpose_8pt(x1, x2))
}

fn relpose_8pt_of_20<T: Real>() -> Run {
    Run::each(general::<T, 20>(), |(x1, x2)| s::relpose_8pt(x1, x2))
}

fn fundamental_8pt<T: Real>() -> Run {
    Run::each(pixels::<T, 8>(), |(x1, x2)| s::fundamental_8pt(x1, x2))
}

fn relpose_upright_3pt<T: Real>() -> Run {
    Run::each(minimal::<T, 3>(Scene::new(Motion::Upright, 3)), |(x1, x2)| s::relpose_upright_3pt(x1, x2))
}

fn homography_4pt<T: Real>() -> Run {
    let scene = Scene::new(Motion::General, 4).shape(Shape::Plane);
    Run::each(minimal::<T, 4>(scene), |(x1, x2)| s::homography_4pt(x1, x2))
}

fn homography_npt_of_20<T: Real>() -> Run {
    let scene = Scene::new(Motion::General, 20).shape(Shape::Plane).noise_px(1.0);
    Run::each(minimal::<T, 20>(scene), |(x1, x2)| s::homography_npt(x1, x2))
}

fn p3p<T: Real>() -> Run {
    Run::each(absolute::<T, 3>(), |(bearings, points)| s::p3p(bearings, points))
}

fn abspose_upright_2pt<T: Real>() -> Run {
    // A camera in the world's frame turned about y alone: view 2 of an upright motion, with view 1 as the world.
    let problems = (0..PROBLEMS)
        .map(|seed| {
            let problem = Scene::new(Motion::Upright, 2).generate(seed);
            let points: [Vector3<T>; 2] = std::array::from_fn(|i| problem.points[i].map(lit));
            (array::<_, 2>(&problem.bearings::<T>().1), points)
        })
        .collect();
    Run::each(problems, |(bearings, points)| s::abspose_upright_2pt(bearings, points))
}

fn abspose_npt_of_20<T: Real>() -> Run {
    Run::each(absolute::<T, 20>(), |(bearings, points)| s::abspose_npt(bearings, points))
}

fn abspose_planar_of_20<T: Real>() -> Run {
    let problems = absolute::<T, 20>()
        .into_iter()
        .map(|(_, points)| {
            let flat = points.map(|p| p.xy());
            let tilt = epipole::geometry::pose::exp(&Vector3::new(lit(0.3), lit(-0.2), lit(0.1)));
            (flat.map(|p| tilt * p.push(T::ZERO) + Vector3::new(T::ZERO, T::ZERO, lit(30.0))), flat)
        })
        .collect::<Vec<([Vector3<T>; 20], [Vector2<T>; 20])>>();
    Run::each(problems, |(bearings, points)| s::abspose_planar(bearings, points))
}

fn resection_dlt_of_20<T: Real>() -> Run {
    let problems = (0..PROBLEMS)
        .map(|seed| {
            let problem = AbsoluteScene::generate(&Scene::new(Motion::General, 20).noise_px(1.0), seed);
            (problem.pixels::<T>(), problem.points::<T>())
        })
        .collect();
    Run::each(problems, |(pixels, points)| s::resection_dlt(pixels, points))
}

fn decompose_projection<T: Real>() -> Run {
    let k = epipole_host_tests::scenes::calibration();
    let problems = (0..PROBLEMS)
        .map(|seed| {
            let pose = AbsoluteScene::generate(&Scene::new(Motion::General, 1), seed).pose;
            let r = pose.rotation.to_rotation_matrix().into_inner();
            let mut p = Matrix3x4::zeros();
            p.fixed_columns_mut::<3>(0).copy_from(&r);
            p.set_column(3, &pose.translation.vector);
            (k * p).map(lit::<T>)
        })
        .collect();
    Run::each(problems, |p| s::decompose_projection(p))
}

fn rotation_2pt<T: Real>() -> Run {
    Run::each(minimal::<T, 2>(Scene::new(Motion::PureRotation, 2)), |(x1, x2)| s::rotation_2pt(x1, x2))
}

fn rotation_npt_of_20<T: Real>() -> Run {
    let scene = Scene::new(Motion::PureRotation, 20).noise_px(1.0);
    Run::each(minimal::<T, 20>(scene), |(x1, x2)| s::rotation_npt(x1, x2))
}

/// Bearings with the true rotation between them.
fn with_rotation<T: Real, const N: usize>() -> Vec<(epipole::nalgebra::UnitQuaternion<T>, Pair<T, N>)> {
    let scene = Scene::new(Motion::General, N);
    let turn = |seed| scene.generate(seed).rotation().map(lit::<T>);
    let rotations = (0..PROBLEMS).map(|seed| epipole::geometry::pose::quaternion_from_matrix(&turn(seed)));
    rotations.zip(minimal(scene)).collect()
}

fn translation_2pt<T: Real>() -> Run {
    Run::each(with_rotation::<T, 2>(), |(r, (x1, x2))| s::translation_2pt(r, x1, x2))
}

fn translation_npt_of_20<T: Real>() -> Run {
    Run::each(with_rotation::<T, 20>(), |(r, (x1, x2))| s::translation_npt(r, x1, x2))
}

/// The same points in two frames.
fn clouds<T: Real, const N: usize>() -> Vec<Pair<T, N>> {
    (0..PROBLEMS)
        .map(|seed| {
            let problem = AbsoluteScene::generate(&Scene::new(Motion::General, N), seed);
            let moved = |x: &Vector3<f64>| problem.pose.rotation * x + problem.pose.translation.vector;
            let b: Vec<Vector3<T>> = problem.points.iter().map(|x| moved(x).map(lit)).collect();
            (array(&problem.points()), array(&b))
        })
        .collect()
}

fn absolute_orientation_npt_of_20<T: Real>() -> Run {
    Run::each(clouds::<T, 20>(), |(a, b)| s::absolute_orientation_npt(a, b))
}

fn absolute_orientation_with_scale_npt_of_20<T: Real>() -> Run {
    Run::each(clouds::<T, 20>(), |(a, b)| s::absolute_orientation_with_scale_npt(a, b))
}
