//! The generators keep what they promise: exact scenes satisfy the constraints, outliers are as many as asked for.

use epipole::nalgebra::{UnitQuaternion, Vector3};
use epipole_host_tests::matchers::{
    direction_error, epipolar_residual, essential_error, essential_violation, pose_error,
    projective_distance, rotation_error, transfer_angle,
};
use epipole_host_tests::tolerances::ROUNDING;
use epipole_host_tests::{AbsoluteScene, Motion, Rng, Scene, Shape, for_each_case, in_both_scalars};

const MOTIONS: [Motion; 7] = [
    Motion::General,
    Motion::Small,
    Motion::RandomPose,
    Motion::Forward,
    Motion::Upright,
    Motion::PureRotation,
    Motion::Still,
];

in_both_scalars! {
    fn exact_correspondences_satisfy_the_epipolar_constraint<T>() {
        for_each_case(40, |seed, _| {
            for motion in MOTIONS {
                let problem = Scene::new(motion, 12).generate(seed);
                let (x1, x2) = problem.bearings::<T>();
                if problem.pose.translation.vector.norm() > 0.0 {
                    let e = problem.essential();
                    assert!(essential_violation(&e) < 1e-14);
                    assert!(essential_error(&e, &problem.pose).0 < 1e-7);
                    for (a, b) in x1.iter().zip(&x2) {
                        assert!(epipolar_residual(&e, a, b) < ROUNDING.of::<T>());
                    }
                } else {
                    for (a, b) in x1.iter().zip(&x2) {
                        assert!(transfer_angle(&problem.rotation(), a, b) < ROUNDING.of::<T>());
                    }
                }
            }
        });
    }

    fn planar_scenes_obey_their_homography<T>() {
        for_each_case(40, |seed, _| {
            let problem = Scene::new(Motion::General, 12).shape(Shape::Plane).generate(seed);
            let (x1, x2) = problem.rays::<T>();
            for (a, b) in x1.iter().zip(&x2) {
                assert!(transfer_angle(&problem.homography(), a, b) < ROUNDING.of::<T>());
            }
        });
    }

    fn absolute_scenes_project_to_their_measurements<T>() {
        for_each_case(40, |seed, _| {
            let scene = AbsoluteScene::generate(&Scene::new(Motion::General, 12), seed);
            for (point, bearing) in scene.points.iter().zip(scene.bearings::<T>()) {
                let seen = scene.pose * epipole::nalgebra::Point3::from(*point);
                assert!(direction_error(&seen.coords, &bearing) < ROUNDING.of::<T>());
            }
        });
    }
}

#[test]
fn noise_and_outliers_are_as_asked_for() {
    let problem = Scene::new(Motion::General, 2000).noise_px(1.0).outliers(0.3).generate(1);
    assert_eq!(problem.inlier.iter().filter(|&&ok| !ok).count(), 600);
    let (pixels, _) = problem.pixels::<f64>();
    let exact = problem.points.iter().map(|p| p.xy() / p.z * 718.0);
    let variance =
        pixels.iter().zip(exact).map(|(measured, exact)| (measured.x - 620.5 - exact.x).powi(2)).sum::<f64>()
            / 2000.0;
    assert!((0.9..1.1).contains(&variance), "{variance}");
}

#[test]
fn repeated_points_and_lines_are_degenerate() {
    let problem = Scene::new(Motion::General, 30).shape(Shape::Repeated(3)).generate(4);
    assert_eq!(problem.x1[0], problem.x1[3]);
    assert_ne!(problem.x1[0], problem.x1[1]);
    let line = Scene::new(Motion::General, 10).shape(Shape::Line).generate(4);
    let direction = line.points[1] - line.points[0];
    for point in &line.points[2..] {
        assert!((point - line.points[0]).cross(&direction).norm() < 1e-12 * direction.norm() * point.norm());
    }
}

#[test]
fn a_seed_is_a_problem() {
    let scene = Scene::new(Motion::General, 10).noise_px(1.0).outliers(0.2);
    assert_eq!(scene.generate(7).x2, scene.generate(7).x2);
    assert_ne!(scene.generate(7).x2, scene.generate(8).x2);
}

#[test]
fn matchers_know_the_symmetries_and_see_differences() {
    for_each_case(100, |_, rng| {
        let q = rng.rotation(3.0);
        let minus = UnitQuaternion::new_unchecked(-q.into_inner());
        assert!(rotation_error(&q, &minus) < 1e-7);
        let turned = q * UnitQuaternion::from_scaled_axis(Vector3::new(1e-6, 0.0, 0.0));
        assert!((rotation_error(&q, &turned) - 1e-6).abs() < 1e-12);
        let problem = Scene::new(Motion::General, 5).generate(rng.next_u64());
        let e = problem.essential();
        assert!(projective_distance(&(e * -3.0), &e) < 1e-14);
        assert!(projective_distance(&e, &e.transpose()) > 1e-3);
        let mut opposite = problem.pose;
        opposite.translation.vector *= -2.0;
        assert!((pose_error(&opposite, &problem.pose).1 - std::f64::consts::PI).abs() < 1e-7);
        assert_eq!(direction_error(&Vector3::new(f32::NAN, 0.0, 1.0), &Vector3::<f64>::z()), f64::INFINITY);
        assert_eq!(direction_error(&Vector3::<f32>::zeros(), &Vector3::<f64>::z()), f64::INFINITY);
    });
}

#[test]
fn the_generator_of_random_numbers_is_uniform_and_normal() {
    let mut rng = Rng::new(0);
    let n = 100_000;
    let (mut mean, mut square) = (0.0, 0.0);
    let mut counts = [0; 10];
    for _ in 0..n {
        let x = rng.normal();
        mean += x / f64::from(n);
        square += x * x / f64::from(n);
        counts[rng.index(10)] += 1;
    }
    assert!(mean.abs() < 0.02 && (square - 1.0).abs() < 0.03);
    assert!(counts.iter().all(|c| (9_500..10_500).contains(c)));
    let mut order = rng.permutation(50);
    order.sort_unstable();
    assert!(order.into_iter().eq(0..50));
}

#[test]
fn scenes_of_both_scalars_are_the_same_problem() {
    let problem = Scene::new(Motion::General, 5).generate(3);
    for (a, b) in problem.rays::<f32>().0.iter().zip(problem.rays::<f64>().0) {
        assert_eq!(*a, b.map(|x| x as f32));
    }
}
