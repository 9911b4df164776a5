//! The fundamental matrices of seven correspondences.

use epipole::Real;
use epipole::geometry::Fundamental;
use epipole::nalgebra::{Matrix3, Vector3};
use epipole::real::lit;
use epipole::solvers::relpose_7pt;
use epipole_host_tests::cases::{for_each_case, share_of};
use epipole_host_tests::matchers::{
    best, epipolar_residual, essential_error, matrix_f64, projective_distance,
};
use epipole_host_tests::scenes::{Motion, Scene, Shape, calibration};
use epipole_host_tests::tolerances::{EPIPOLAR_RESIDUAL, GAUGE_SOLUTION, SOLVED_ROTATION};
use epipole_host_tests::{Rng, in_both_scalars};

const MOTIONS: [Motion; 4] = [Motion::General, Motion::Small, Motion::RandomPose, Motion::Forward];

fn solve<T: Real>(x1: &[Vector3<T>], x2: &[Vector3<T>]) -> Vec<Fundamental<T>> {
    relpose_7pt(x1.try_into().unwrap(), x2.try_into().unwrap()).into_iter().collect()
}

/// The share of noise-free problems that have to be solved: `f32` loses those whose points are ill-conditioned.
fn wanted<T: Real>() -> f64 {
    if size_of::<T>() == 4 { 0.995 } else { 1.0 }
}

/// Whether both lists hold the same matrices.
fn agree(a: &[Matrix3<f64>], b: &[Matrix3<f64>], tolerance: f64) -> bool {
    let covers = |a: &[Matrix3<f64>], b: &[Matrix3<f64>]| {
        a.iter().all(|m| best(b.iter().map(|n| projective_distance(m, n))) < tolerance)
    };
    covers(a, b) && covers(b, a)
}

in_both_scalars! {
    fn recovers_the_motion<T>() {
        for motion in MOTIONS {
            share_of(1000, |seed, _| {
                let scene = Scene::new(motion, 7).generate(seed);
                let (x1, x2) = scene.bearings::<T>();
                best(solve(&x1, &x2).iter().map(|f| essential_error(&f.0, &scene.pose).0)) < SOLVED_ROTATION.of::<T>()
            })
            .assert_at_least(wanted::<T>());
        }
    }

    fn recovers_f_between_raw_pixels<T>() {
        let k = calibration();
        share_of(1000, |seed, _| {
            let scene = Scene::new(Motion::General, 7).generate(seed);
            let (x1, x2) = scene.homogeneous_pixels::<T>();
            best(solve(&x1, &x2).iter().map(|f| {
                essential_error(&(k.transpose() * matrix_f64(&f.0) * k), &scene.pose).0
            })) < SOLVED_ROTATION.of::<T>()
        })
        .assert_at_least(wanted::<T>());
    }

    fn every_solution_satisfies_the_constraints<T>() {
        for_each_case(1000, |seed, rng| {
            // Random correspondences, too: they have solutions without a truth.
            let scene = Scene::new(MOTIONS[rng.index(4)], 7).noise_px(100.0 * rng.unit()).generate(seed);
            let (x1, x2) = scene.bearings::<T>();
            let solutions = solve(&x1, &x2);
            assert!((1..=3).contains(&solutions.len()));
            for f in &solutions {
                let tolerance = EPIPOLAR_RESIDUAL.of::<T>();
                assert!((matrix_f64(&f.0).norm() - 1.0).abs() < tolerance);
                assert!(matrix_f64(&f.0).determinant().abs() < tolerance);
                for (a, b) in x1.iter().zip(&x2) {
                    assert!(epipolar_residual(&f.0, a, b) < tolerance);
                }
            }
        });
    }

    fn order_length_and_frame_of_the_points_do_not_matter<T>() {
        share_of(500, |seed, rng| {
            let scene = Scene::new(MOTIONS[rng.index(4)], 7).noise_px(1.0).generate(seed);
            let (x1, x2) = scene.bearings::<f64>();
            let plain: Vec<_> = solve::<T>(&scene.bearings().0, &scene.bearings().1).iter().map(|f| matrix_f64(&f.0)).collect();
            let order = rng.permutation(7);
            let (r1, r2) = (rng.rotation(3.0), rng.rotation(3.0));
            let mut moved = |x: &[Vector3<f64>], r: &epipole::nalgebra::UnitQuaternion<f64>| -> Vec<Vector3<T>> {
                order.iter().map(|&k| (r * x[k] * rng.range(0.5, 2.0)).map(lit)).collect()
            };
            let (y1, y2) = (moved(&x1, &r1), moved(&x2, &r2));
            let back = |f: &Matrix3<T>| {
                r2.to_rotation_matrix().matrix().transpose() * matrix_f64(f) * r1.to_rotation_matrix().matrix()
            };
            let rotated: Vec<_> = solve(&y1, &y2).iter().map(|f| back(&f.0)).collect();
            let exchanged: Vec<_> = solve(&y2, &y1).iter().map(|f| back(&f.0.transpose())).collect();
            agree(&plain, &rotated, GAUGE_SOLUTION.of::<T>()) && agree(&plain, &exchanged, GAUGE_SOLUTION.of::<T>())
        })
        // The others have two solutions that nearly coincide, or nearly dependent equations.
        .assert_at_least(0.95);
    }

    fn coordinates_of_any_size<T>() {
        for scale in [1e-6, 1e6] {
            share_of(200, |seed, _| {
                let scene = Scene::new(Motion::General, 7).generate(seed);
                let (x1, x2) = scene.bearings::<T>();
                let scaled = |x: Vec<Vector3<T>>| -> Vec<_> { x.iter().map(|v| v * lit::<T>(scale)).collect() };
                best(solve(&scaled(x1), &scaled(x2)).iter().map(|f| essential_error(&f.0, &scene.pose).0)) < SOLVED_ROTATION.of::<T>()
            })
            .assert_at_least(wanted::<T>());
        }
    }

    fn degenerate_points_have_no_solution<T>() {
        let scenes = [
            ("no motion", Scene::new(Motion::Still, 7)),
            ("pure rotation", Scene::new(Motion::PureRotation, 7)),
            ("points on a plane", Scene::new(Motion::General, 7).shape(Shape::Plane)),
            ("points on a line", Scene::new(Motion::General, 7).shape(Shape::Line)),
            ("five distinct points", Scene::new(Motion::General, 7).shape(Shape::Repeated(5))),
            ("one point", Scene::new(Motion::General, 7).shape(Shape::Repeated(1))),
        ];
        for (name, scene) in scenes {
            println!("{name}");
            share_of(300, |seed, _| {
                let (x1, x2) = scene.generate(seed).bearings::<T>();
                solve(&x1, &x2).is_empty()
            })
            .assert_at_least(0.9);
        }
    }

    fn what_is_not_finite_has_no_solution_and_nothing_else_is_returned<T>() {
        let (x1, x2) = Scene::new(Motion::General, 7).generate(1).bearings::<T>();
        for k in 0..21 {
            for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let mut y1 = x1.clone();
                y1[k / 3][k % 3] = lit(bad);
                assert!(solve(&y1, &x2).is_empty() && solve(&x2, &y1).is_empty());
            }
        }
        for_each_case(20000, |_, rng: &mut Rng| {
            let x1: Vec<Vector3<T>> = (0..7).map(|_| rng.any_vector()).collect();
            let x2: Vec<Vector3<T>> = (0..7).map(|_| rng.any_vector()).collect();
            for f in solve(&x1, &x2) {
                assert!(f.0.iter().all(|x| x.to_f64().is_finite()));
            }
        });
    }
}
