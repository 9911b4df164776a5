//! Epipoles and epipolar lines, and the nearest matrices of rank 2 and of essential form.

use epipole::geometry::{Essential, Fundamental};
use epipole::nalgebra::{Matrix3, Vector3};
use epipole::real::lit;
use epipole_host_tests::cases::for_each_case;
use epipole_host_tests::in_both_scalars;
use epipole_host_tests::matchers::{axis_error, matrix_f64};
use epipole_host_tests::scenes::{Motion, Scene, calibration};
use epipole_host_tests::tolerances::{EPIPOLE, FACTORISATION};

in_both_scalars! {
    fn epipoles_are_the_images_of_the_other_camera<T>() {
        let k = calibration();
        for_each_case(500, |seed, _| {
            let scene = Scene::new(Motion::General, 12).generate(seed);
            let t = scene.pose.translation.vector;
            let centre2 = -(scene.pose.rotation.inverse() * t);
            for (f, e1, e2) in [(scene.fundamental(), k * centre2, k * t), (scene.essential(), centre2, t)] {
                let f = Fundamental(f.map(lit::<T>));
                let (a, b) = (f.epipole1().unwrap(), f.epipole2().unwrap());
                assert!(axis_error(&a, &e1) < EPIPOLE.of::<T>(), "{:e}", axis_error(&a, &e1));
                assert!(axis_error(&b, &e2) < EPIPOLE.of::<T>(), "{:e}", axis_error(&b, &e2));
            }
        });
    }

    fn lines_pass_through_the_point_and_the_epipole<T>() {
        for_each_case(300, |seed, _| {
            let scene = Scene::new(Motion::General, 12).generate(seed);
            let f = Fundamental(scene.essential().map(lit::<T>));
            let (x1, x2) = scene.bearings::<T>();
            let on = |line: Vector3<T>, x: &Vector3<T>| {
                let (line, x) = (line.map(T::to_f64), x.map(T::to_f64));
                line.dot(&x).abs() / line.norm() < EPIPOLE.of::<T>()
            };
            for (a, b) in x1.iter().zip(&x2) {
                // A line of the epipole's neighbourhood has no direction.
                if matrix_f64(&f.0).norm() * 0.01 < f.line2(a).map(T::to_f64).norm().min(f.line1(b).map(T::to_f64).norm()) {
                    assert!(on(f.line2(a), b) && on(f.line2(a), &f.epipole2().unwrap()));
                    assert!(on(f.line1(b), a) && on(f.line1(b), &f.epipole1().unwrap()));
                }
            }
        });
    }

    fn nearest_matrices_are_those_of_the_singular_values<T>() {
        for_each_case(3000, |seed, rng| {
            let (u, v) = (rng.rotation(3.1).to_rotation_matrix(), rng.rotation(3.1).to_rotation_matrix());
            // From exact to far from rank 2: down to the decomposition that answers where powers do not converge.
            let s2 = rng.range(0.2, 1.0);
            let s3 = s2 * [1e-12, 1e-3, rng.range(0.0, 0.5), rng.range(0.5, 0.99)][seed as usize % 4];
            let sign = if rng.unit() < 0.5 { -1.0 } else { 1.0 };
            let part = |s: Vector3<f64>| u.matrix() * Matrix3::from_diagonal(&s) * v.matrix() * sign;
            let m = part(Vector3::new(1.0, s2, s3)).map(lit::<T>);
            let gap = s2 - s3;
            let tolerance = FACTORISATION.of::<T>() / gap;
            let f = Fundamental(m).nearest().unwrap();
            assert!((matrix_f64(&f.0) - part(Vector3::new(1.0, s2, 0.0))).norm() < tolerance);
            let e = Essential(m).nearest().unwrap();
            let middle = (1.0 + s2) / 2.0;
            assert!((matrix_f64(&e.0) - part(Vector3::new(middle, middle, 0.0))).norm() < tolerance);
        });
    }

    fn rank_1_and_not_finite_have_no_answer<T>() {
        let rank1 = Vector3::new(T::ONE, T::TWO, T::HALF) * Vector3::new(T::TWO, -T::ONE, T::ONE).transpose();
        let mut nan = Matrix3::<T>::identity();
        nan[(1, 2)] = lit(f64::NAN);
        let mut infinite = Matrix3::<T>::identity();
        infinite[(0, 1)] = lit(f64::INFINITY);
        for m in [rank1, Matrix3::zeros(), nan, infinite] {
            let f = Fundamental(m);
            assert!(f.epipole1().is_none() && f.epipole2().is_none(), "{m}");
            assert!(f.nearest().is_none() && Essential(m).nearest().is_none());
        }
    }
}
