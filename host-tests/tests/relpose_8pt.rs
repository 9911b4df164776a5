//! The essential and the fundamental matrix of eight and more correspondences.

use epipole::geometry::{Essential, Fundamental};
use epipole::nalgebra::{Matrix3, SMatrix, Vector3};
use epipole::real::lit;
use epipole::solvers::{fundamental_8pt, relpose_8pt};
use epipole::{InputError, Real};
use epipole_host_tests::cases::{for_each_case, share_of};
use epipole_host_tests::matchers::{essential_error, essential_violation, matrix_f64, projective_distance};
use epipole_host_tests::scenes::{Motion, Scene, Shape, calibration};
use epipole_host_tests::tolerances::{
    ESSENTIAL_CONSTRAINT, GAUGE_SOLUTION, NULL_VECTOR_P99, SOLVED_ROTATION,
};
use epipole_host_tests::{Rng, in_both_scalars};

const MOTIONS: [Motion; 4] = [Motion::General, Motion::Small, Motion::RandomPose, Motion::Forward];

fn essential<T: Real>(x1: &[Vector3<T>], x2: &[Vector3<T>]) -> Option<Essential<T>> {
    relpose_8pt(x1, x2).unwrap()
}

fn fundamental<T: Real>(x1: &[Vector3<T>], x2: &[Vector3<T>]) -> Option<Fundamental<T>> {
    fundamental_8pt(x1, x2).unwrap()
}

/// Whitening by nalgebra's Cholesky factor, equations and rank 2 by its singular values; the two least of the equations.
fn oracle(x1: &[Vector3<f64>], x2: &[Vector3<f64>]) -> (Matrix3<f64>, [f64; 2]) {
    let whitening = |x: &[Vector3<f64>]| {
        let moments: Matrix3<f64> = x.iter().map(|v| v * v.transpose()).sum();
        moments.cholesky().unwrap().l().try_inverse().unwrap()
    };
    let (t1, t2) = (whitening(x1), whitening(x2));
    // Rows of zeros after the last.
    let a = SMatrix::<f64, 50, 9>::from_fn(|k, c| {
        if k < x1.len() { (t2 * x2[k])[c / 3] * (t1 * x1[k])[c % 3] } else { 0.0 }
    });
    let svd = a.svd(false, true);
    let least = [svd.singular_values[8], svd.singular_values[7]];
    let f = Matrix3::from_row_slice(svd.v_t.unwrap().row(8).transpose().as_slice());
    let mut svd = f.svd(true, true);
    svd.singular_values[2] = 0.0;
    (t2.transpose() * svd.recompose().unwrap() * t1, least)
}

in_both_scalars! {
    fn recovers_the_motion<T>() {
        for motion in MOTIONS {
            for points in [8, 9, 20, 33] {
                share_of(300, |seed, _| {
                    let scene = Scene::new(motion, points).generate(seed);
                    let (x1, x2) = scene.bearings::<T>();
                    essential(&x1, &x2).is_some_and(|e| essential_error(&e.0, &scene.pose).0 < SOLVED_ROTATION.of::<T>())
                })
                .assert_at_least(if size_of::<T>() == 4 { 0.99 } else { 1.0 });
            }
        }
    }

    fn null_vector_of_eight_points_is_accurate<T>() {
        // Against the solver in f64 on the same rounded points.
        let mut errors: Vec<f64> = (0..4000)
            .map(|seed| {
                let (x1, x2) = Scene::new(MOTIONS[seed as usize % 4], 8).generate(seed).bearings::<T>();
                let wide = |x: &[Vector3<T>]| -> Vec<Vector3<f64>> { x.iter().map(|v| v.map(T::to_f64)).collect() };
                let truth = essential(&wide(&x1), &wide(&x2)).unwrap();
                essential(&x1, &x2).map_or(f64::INFINITY, |e| projective_distance(&e.0, &truth.0))
            })
            .collect();
        errors.sort_by(f64::total_cmp);
        let p99 = errors[errors.len() * 99 / 100];
        assert!(p99 <= NULL_VECTOR_P99.of::<T>(), "p99 {p99:e}");
    }

    fn the_estimate_is_essential_or_of_rank_2<T>() {
        for_each_case(500, |seed, rng| {
            let scene = Scene::new(MOTIONS[rng.index(4)], 8 + rng.index(30)).noise_px(20.0 * rng.unit()).generate(seed);
            let (x1, x2) = scene.bearings::<T>();
            let e = essential(&x1, &x2).unwrap();
            assert!(essential_violation(&e.0) < ESSENTIAL_CONSTRAINT.of::<T>(), "{}", essential_violation(&e.0));
            assert!((matrix_f64(&e.0).norm() - 1.0).abs() < ESSENTIAL_CONSTRAINT.of::<T>());
            let f = matrix_f64(&fundamental(&x1, &x2).unwrap().0);
            assert!(f.determinant().abs() < ESSENTIAL_CONSTRAINT.of::<T>());
        });
    }

    fn fundamental_minimises_the_whitened_residual<T>() {
        for points in [8, 9, 10, 20, 33, 50] {
            share_of(200, |seed, rng| {
                let scene = Scene::new(MOTIONS[rng.index(4)], points).noise_px(1.0).generate(seed);
                let (y1, y2) = scene.bearings::<T>();
                let wide = |x: &[Vector3<T>]| -> Vec<Vector3<f64>> { x.iter().map(|v| v.map(T::to_f64)).collect() };
                let (truth, least) = oracle(&wide(&y1), &wide(&y2));
                // Where two singular values are nearly the same there is no one vector.
                least[0] > 0.8 * least[1]
                    || projective_distance(&fundamental(&y1, &y2).unwrap().0, &truth) < GAUGE_SOLUTION.of::<T>()
            })
            .assert_at_least(0.99);
        }
    }

    fn fundamental_does_not_depend_on_the_calibration<T>() {
        let k = calibration();
        share_of(300, |seed, rng| {
            let scene = Scene::new([Motion::General, Motion::Forward][rng.index(2)], 20).noise_px(1.0).generate(seed);
            let normalised = fundamental(&scene.rays::<T>().0, &scene.rays::<T>().1).unwrap();
            let (p1, p2) = scene.homogeneous_pixels::<T>();
            let pixels = matrix_f64(&fundamental(&p1, &p2).unwrap().0);
            projective_distance(&normalised.0, &(k.transpose() * pixels * k)) < GAUGE_SOLUTION.of::<T>()
        })
        .assert_at_least(0.98);
    }

    fn order_and_frame_do_not_matter<T>() {
        share_of(300, |seed, rng| {
            let points = [8, 20][rng.index(2)];
            let scene = Scene::new(MOTIONS[rng.index(4)], points).noise_px(1.0).generate(seed);
            let (x1, x2) = scene.bearings::<f64>();
            let plain = essential(&scene.bearings::<T>().0, &scene.bearings::<T>().1).unwrap();
            let order = rng.permutation(points);
            let (r1, r2) = (rng.rotation(3.0), rng.rotation(3.0));
            let y1: Vec<Vector3<T>> = order.iter().map(|&k| (r1 * x1[k]).map(lit)).collect();
            let y2: Vec<Vector3<T>> = order.iter().map(|&k| (r2 * x2[k]).map(lit)).collect();
            let back = |e: Matrix3<f64>| r2.to_rotation_matrix().matrix().transpose() * e * r1.to_rotation_matrix().matrix();
            let rotated = back(matrix_f64(&essential(&y1, &y2).unwrap().0));
            let exchanged = back(matrix_f64(&essential(&y2, &y1).unwrap().0).transpose());
            projective_distance(&plain.0, &rotated).max(projective_distance(&plain.0, &exchanged)) < GAUGE_SOLUTION.of::<T>()
        })
        .assert_at_least(0.95);
    }

    fn degenerate_points_have_no_estimate<T>() {
        for points in [8, 20] {
            let scenes = [
                ("no motion", Scene::new(Motion::Still, points)),
                ("pure rotation", Scene::new(Motion::PureRotation, points)),
                ("points on a plane", Scene::new(Motion::General, points).shape(Shape::Plane)),
                ("points on a line", Scene::new(Motion::General, points).shape(Shape::Line)),
                ("six distinct points", Scene::new(Motion::General, points).shape(Shape::Repeated(6))),
                ("one point", Scene::new(Motion::General, points).shape(Shape::Repeated(1))),
            ];
            for (name, scene) in scenes {
                println!("{points} points: {name}");
                share_of(1500, |seed, _| {
                    let (x1, x2) = scene.generate(seed).bearings::<T>();
                    essential(&x1, &x2).is_none() && fundamental(&x1, &x2).is_none()
                })
                .assert_at_least(0.998);
            }
        }
    }

    fn malformed_input_is_named<T>() {
        let (x1, x2) = Scene::new(Motion::General, 12).generate(1).bearings::<T>();
        let both = |a: &[Vector3<T>], b: &[Vector3<T>]| {
            let error = relpose_8pt(a, b).unwrap_err();
            assert_eq!(fundamental_8pt(a, b).unwrap_err(), error);
            error
        };
        assert_eq!(both(&x1, &x2[..11]), InputError::LengthMismatch { first: 12, second: 11 });
        assert_eq!(both(&x1[..7], &x2[..7]), InputError::TooFew { given: 7, needed: 8 });
        for points in [8, 12] {
            for index in 0..points {
                for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                    for coordinate in 0..3 {
                        let mut y = x1[..points].to_vec();
                        y[index][coordinate] = lit(bad);
                        assert_eq!(both(&y, &x2[..points]), InputError::NotFinite { array: 0, index });
                        assert_eq!(both(&x2[..points], &y), InputError::NotFinite { array: 1, index });
                    }
                }
            }
        }
    }

    fn any_numbers_give_a_finite_answer_or_none<T>() {
        for_each_case(20000, |_, rng: &mut Rng| {
            let points = 8 + rng.index(4);
            let x1: Vec<Vector3<T>> = (0..points).map(|_| rng.any_vector()).collect();
            let x2: Vec<Vector3<T>> = (0..points).map(|_| rng.any_vector()).collect();
            for m in [relpose_8pt(&x1, &x2).ok().flatten().map(|e| e.0), fundamental_8pt(&x1, &x2).ok().flatten().map(|f| f.0)].into_iter().flatten() {
                assert!(m.iter().all(|x| x.to_f64().is_finite()));
            }
        });
        for scale in [1e-6, 1e6] {
            let scene = Scene::new(Motion::General, 12).generate(2);
            let (x1, x2) = scene.bearings::<T>();
            let scaled = |x: Vec<Vector3<T>>| -> Vec<_> { x.iter().map(|v| v * lit::<T>(scale)).collect() };
            let e = essential(&scaled(x1), &scaled(x2)).unwrap();
            assert!(essential_error(&e.0, &scene.pose).0 < SOLVED_ROTATION.of::<T>());
        }
    }
}
