//! Essential matrices: decomposition, choice by cheirality, projection, conversion to fundamental matrices.

use epipole::Real;
use epipole::geometry::cheirality::in_front_of_both;
use epipole::geometry::{Essential, Fundamental};
use epipole::nalgebra::{Matrix3, Vector3};
use epipole::real::lit;
use epipole_host_tests::cases::for_each_case;
use epipole_host_tests::in_both_scalars;
use epipole_host_tests::matchers::{best, essential_violation, matrix_f64, pose_error, projective_distance};
use epipole_host_tests::scenes::{Motion, Scene, calibration};
use epipole_host_tests::tolerances::{ESSENTIAL_CONSTRAINT, ROTATION};

const MOTIONS: [Motion; 4] = [Motion::General, Motion::Small, Motion::RandomPose, Motion::Forward];

fn random_matrix<T: Real>(rng: &mut epipole_host_tests::Rng) -> Matrix3<T> {
    Matrix3::from_fn(|_, _| lit(rng.normal()))
}

in_both_scalars! {
    fn one_of_the_four_poses_is_the_truth<T>() {
        for_each_case(2000, |seed, rng| {
            let truth = Scene::new(MOTIONS[rng.index(4)], 5).generate(seed).pose;
            let scale = [1e-30, 1e-15, 1.0, -3.0, 1e15, 1e30][rng.index(6)];
            let e = Essential::from_pose(&truth.cast::<T>()).0 * lit::<T>(scale);
            let poses = Essential(e).poses().unwrap();
            assert!(best(poses.iter().map(|p| {
                let (r, t) = pose_error(p, &truth);
                r.max(t)
            })) < 4.0 * ROTATION.of::<T>());
            for p in &poses {
                assert!(projective_distance(&Essential::from_pose(p).0, &e) < 4.0 * ROTATION.of::<T>());
            }
        });
    }

    fn cheirality_chooses_the_truth<T>() {
        for_each_case(1000, |seed, rng| {
            let scene = Scene::new([Motion::General, Motion::Small][rng.index(2)], 20).generate(seed);
            let (x1, x2) = scene.bearings::<T>();
            let e = Essential::from_pose(&scene.pose.cast::<T>());
            let found = e.pose_by_cheirality(&x1, &x2).unwrap();
            let (r, t) = pose_error(&found.pose, &scene.pose);
            assert!(r.max(t) < 4.0 * ROTATION.of::<T>());
            assert!(found.in_front >= 19 && found.runner_up < found.in_front);
            let counted = x1.iter().zip(&x2).filter(|(a, b)| in_front_of_both(&found.pose, a, b)).count();
            assert!(counted.abs_diff(found.in_front) <= 1);
        });
    }

    /// The single test of a pose against depths computed with the pose's own points.
    fn in_front_agrees_with_the_depths<T>() {
        for_each_case(1000, |seed, rng| {
            let scene = Scene::new(Motion::RandomPose, 5).generate(seed);
            let (x1, x2) = scene.bearings::<T>();
            let pose = scene.pose.cast::<T>();
            let k = rng.index(5);
            assert!(in_front_of_both(&pose, &x1[k], &x2[k]));
            assert!(!in_front_of_both(&pose, &-x1[k], &x2[k]));
            assert!(!in_front_of_both(&pose, &x1[k], &-x2[k]));
            assert!(!in_front_of_both(&pose, &(x1[k] * lit::<T>(f64::NAN)), &x2[k]));
            assert!(!in_front_of_both(&pose, &Vector3::zeros(), &x2[k]));
        });
    }

    fn nearest_is_essential_and_no_other_is_nearer<T>() {
        for_each_case(500, |seed, rng| {
            let m = random_matrix::<T>(rng);
            let e = Essential(m).nearest().unwrap();
            assert!(essential_violation(&e.0) < ESSENTIAL_CONSTRAINT.of::<T>());
            let distance = (matrix_f64(&m) - matrix_f64(&e.0)).norm();
            // Neighbours on the manifold: other frames and other scales.
            for _ in 0..5 {
                let (a, b) = (rng.rotation(0.1).to_rotation_matrix(), rng.rotation(0.1).to_rotation_matrix());
                let other = a.matrix() * matrix_f64(&e.0) * b.matrix() * rng.range(0.9, 1.1);
                assert!((matrix_f64(&m) - other).norm() > distance - 1e-5, "seed {seed}");
            }
        });
    }

    fn fundamental_and_back<T>() {
        for_each_case(200, |seed, _| {
            let scene = Scene::new(Motion::General, 8).generate(seed);
            let k = calibration().map(|v| lit::<T>(v));
            let e = Essential::from_pose(&scene.pose.cast::<T>());
            let f = e.to_fundamental(&k, &k).unwrap();
            let (p1, p2) = scene.homogeneous_pixels::<T>();
            for (a, b) in p1.iter().zip(&p2) {
                let line = matrix_f64(&f.0) * a.map(T::to_f64);
                let distance = line.dot(&b.map(T::to_f64)) / line.xy().norm();
                assert!(distance.abs() < if size_of::<T>() == 4 { 0.5 } else { 1e-9 }, "{distance} px");
            }
            let back = Essential::from_fundamental(&f, &k, &k);
            assert!(projective_distance(&back.0, &e.0) < 100.0 * ROTATION.of::<T>());
            assert!(e.to_fundamental(&Matrix3::zeros(), &k).is_none());
            let _: Fundamental<T> = f;
        });
    }

    fn malformed_and_degenerate_matrices_have_no_pose<T>() {
        let x = [Vector3::new(lit::<T>(0.1), lit(0.2), T::ONE); 5];
        let rank1 = Matrix3::new(1.0, 2.0, 3.0, 2.0, 4.0, 6.0, -1.0, -2.0, -3.0).map(|v| lit::<T>(v));
        for m in [Matrix3::zeros(), rank1] {
            assert!(Essential(m).twisted_pair().is_none() && Essential(m).poses().is_none());
            assert!(Essential(m).pose_by_cheirality(&x, &x).is_none() && Essential(m).nearest().is_none());
        }
        for bad in [f64::NAN, f64::INFINITY] {
            for k in 0..9 {
                let mut m = Essential::from_pose(&Scene::new(Motion::General, 5).generate(1).pose.cast::<T>()).0;
                m[k] = lit(bad);
                assert!(Essential(m).twisted_pair().is_none() && Essential(m).nearest().is_none());
            }
        }
        let e = Essential::from_pose(&Scene::new(Motion::General, 5).generate(1).pose.cast::<T>());
        assert!(e.pose_by_cheirality(&[], &[]).is_none());
    }
}
