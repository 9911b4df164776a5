//! Homographies: the solvers of four and of N points, and the motions that a homography allows.

use epipole::geometry::{Homography, PlaneMotion, Pose};
use epipole::nalgebra::{Matrix3, Translation3, UnitQuaternion, Vector2, Vector3};
use epipole::real::lit;
use epipole::solvers::{homography_4pt, homography_npt};
use epipole::{InputError, Real};
use epipole_host_tests::cases::{for_each_case, share_of};
use epipole_host_tests::matchers::{
    axis_error, direction_error, matrix_f64, projective_distance, rotation_error, transfer_angle,
};
use epipole_host_tests::scenes::{Motion, Scene, Shape, TwoView, calibration};
use epipole_host_tests::tolerances::{
    FACTORISATION, GAUGE_SOLUTION, PLANE_MOTION, ROTATION, TRANSFER_FOUR, TRANSFER_P99,
};
use epipole_host_tests::{Rng, in_both_scalars};

const MOTIONS: [Motion; 4] = [Motion::General, Motion::Small, Motion::RandomPose, Motion::Forward];

fn four<T: Real>(x1: &[Vector3<T>], x2: &[Vector3<T>]) -> Option<Homography<T>> {
    homography_4pt(x1[..4].try_into().unwrap(), x2[..4].try_into().unwrap())
}

fn many<T: Real>(x1: &[Vector3<T>], x2: &[Vector3<T>]) -> Option<Homography<T>> {
    homography_npt(x1, x2).unwrap()
}

/// Whether three of the four points go round clockwise in one view and anticlockwise in the other.
fn turned_over<T: Real>(x1: &[Vector3<T>], x2: &[Vector3<T>]) -> bool {
    let turn = |x: &[Vector3<T>], [i, j, k]: [usize; 3]| x[i].cross(&x[j]).dot(&x[k]) > T::ZERO;
    [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]
        .into_iter()
        .any(|triple| turn(x1, triple) != turn(x2, triple))
}

fn planar(motion: Motion, points: usize) -> Scene {
    Scene::new(motion, points).shape(Shape::Plane)
}

/// The largest transfer error of the exact points, in radians.
fn transfer<T: Real>(h: Option<Homography<T>>, scene: &TwoView) -> f64 {
    let Some(h) = h else { return f64::INFINITY };
    scene.x1.iter().zip(&scene.x2).map(|(a, b)| transfer_angle(&h.0, a, b)).fold(0.0, f64::max)
}

fn p99(mut errors: Vec<f64>) -> f64 {
    errors.sort_by(f64::total_cmp);
    errors[errors.len() * 99 / 100]
}

/// A motion whose plane both cameras see from its front.
fn motion(rng: &mut Rng, baseline: f64) -> PlaneMotion<f64> {
    let rotation = rng.rotation(0.5);
    let normal = (rng.normal3() * 0.4 + Vector3::z()).normalize();
    let t = rng.direction() * baseline;
    PlaneMotion { pose: Pose::from_parts(Translation3::from(t), rotation), normal }
}

fn motion_error<T: Real>(m: &PlaneMotion<T>, truth: &PlaneMotion<f64>) -> f64 {
    let t = (m.pose.translation.vector.map(T::to_f64) - truth.pose.translation.vector).norm();
    let n = direction_error(&m.normal, &truth.normal) * truth.pose.translation.vector.norm();
    rotation_error(&m.pose.rotation, &truth.pose.rotation).max(t).max(n)
}

in_both_scalars! {
    fn four_points_recover_the_transfer<T>() {
        for motion in MOTIONS {
            let errors: Vec<f64> = (0..8000)
                .map(|seed| {
                    let scene = planar(motion, 4).generate(seed);
                    let (x1, x2) = scene.bearings::<T>();
                    transfer(four(&x1, &x2), &scene)
                })
                .collect();
            let p99 = p99(errors);
            assert!(p99 <= TRANSFER_P99.of::<T>(), "{motion:?} {p99:e}");
        }
    }

    fn many_points_recover_the_transfer<T>() {
        for points in [4, 5, 11, 40] {
            let errors = |rays: bool| (0..500)
                .map(|seed| {
                    let scene = planar(MOTIONS[seed as usize % 4], points).generate(seed);
                    let (x1, x2) = if rays { scene.rays::<T>() } else { scene.bearings() };
                    transfer(many(&x1, &x2), &scene)
                })
                .collect();
            for rays in [true, false] {
                let p99 = p99(errors(rays));
                assert!(p99 <= TRANSFER_P99.of::<T>() * 3.0, "{points} {p99:e}");
            }
        }
    }

    fn the_four_points_are_met_with_positive_factors<T>() {
        share_of(2000, |seed, rng| {
            let scene = planar(MOTIONS[rng.index(4)], 4).noise_px(3.0 * rng.unit()).generate(seed);
            let (x1, x2) = scene.bearings::<T>();
            // Noise can turn a thin triangle over, which no camera sees: then, and only then, there is no answer.
            let Some(h) = four(&x1, &x2) else { return turned_over(&x1, &x2) };
            assert!(matrix_f64(&h.0).determinant() > 0.0);
            let last = matrix_f64(&h.0) * x1[3].map(T::to_f64) - x2[3].map(T::to_f64);
            assert!(x1.iter().zip(&x2).all(|(a, b)| (h.0 * a).dot(b) > T::ZERO));
            last.norm() < TRANSFER_FOUR.of::<T>()
                && x1.iter().zip(&x2).all(|(a, b)| transfer_angle(&h.0, a, b) < TRANSFER_FOUR.of::<T>())
        })
        .assert_at_least(0.99);
    }

    fn order_length_and_exchange_do_not_matter<T>() {
        share_of(500, |seed, rng| {
            let scene = planar(MOTIONS[rng.index(4)], 4).noise_px(0.5).generate(seed);
            let (x1, x2) = scene.bearings::<T>();
            let Some(h) = four(&x1, &x2) else { return false };
            let order = rng.permutation(4);
            let y1: Vec<Vector3<T>> = order.iter().map(|&k| x1[k] * lit::<T>(rng.range(0.5, 2.0))).collect();
            let y2: Vec<Vector3<T>> = order.iter().map(|&k| x2[k] * lit::<T>(rng.range(0.5, 2.0))).collect();
            let (Some(moved), Some(back)) = (four(&y1, &y2), four(&y2, &y1)) else { return false };
            let back = matrix_f64(&back.0).try_inverse().unwrap();
            projective_distance(&h.0, &moved.0).max(projective_distance(&h.0, &back)) < GAUGE_SOLUTION.of::<T>()
        })
        .assert_at_least(0.98);
    }

    fn the_estimate_of_many_points_does_not_depend_on_the_calibration<T>() {
        let k = calibration();
        for_each_case(200, |seed, rng| {
            let scene = planar([Motion::General, Motion::Forward][rng.index(2)], 15).noise_px(1.0).generate(seed);
            let (x1, x2) = scene.rays::<T>();
            let (p1, p2) = scene.homogeneous_pixels::<T>();
            let pixels = Homography(matrix_f64(&many(&p1, &p2).unwrap().0)).to_normalised(&k, &k).unwrap();
            let normalised = many(&x1, &x2).unwrap();
            assert!(projective_distance(&normalised.0, &pixels.0) < GAUGE_SOLUTION.of::<T>());
            let again = pixels.to_pixels(&k, &k).unwrap();
            assert!(projective_distance(&again.0, &many(&p1, &p2).unwrap().0) < 1e-12);
        });
    }

    fn degenerate_points_have_no_homography<T>() {
        let point = |u: f64, v: f64| Vector3::new(lit::<T>(u), lit(v), T::ONE);
        let square = [point(0.0, 0.0), point(1.0, 0.0), point(1.0, 1.0), point(0.0, 1.0)];
        assert!(four(&square, &square).is_some());
        // Three on a line, in either view, whichever is the fourth.
        let line = [point(0.1, 0.3), point(0.3, 0.7), point(0.6, 1.3), point(1.0, 0.0)];
        for turn in 0..4 {
            let mut line = line;
            line.rotate_left(turn);
            for bearings in [line, line.map(|p| p / epipole::real::sqrt(p.norm_squared()))] {
                assert!(four(&bearings, &square).is_none() && four(&square, &bearings).is_none());
                assert!(many(&bearings, &bearings).is_none());
            }
        }
        // Two that coincide, at any length.
        for (i, j) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
            let mut twice = square;
            twice[i] = twice[j] * lit::<T>(3.0);
            assert!(four(&twice, &square).is_none() && four(&square, &twice).is_none() && four(&twice, &twice).is_none());
            assert!(many(&twice, &twice).is_none());
        }
        // A mirrored view, and one in which a diagonal is crossed.
        let mirrored = square.map(|p| Vector3::new(-p.x, p.y, p.z));
        assert!(four(&square, &mirrored).is_none());
        let crossed = [square[0], square[2], square[1], square[3]];
        assert!(four(&square, &crossed).is_none());
        for shape in [Shape::Line, Shape::Repeated(3), Shape::Repeated(1)] {
            // All but those in f32 whose three points make so thin a triangle that rounding looks like a fourth point.
            share_of(1000, |seed, _| {
                let (x1, x2) = Scene::new(Motion::General, 9).shape(shape).generate(seed).bearings::<T>();
                many(&x1, &x2).is_none()
            })
            .assert_at_least(0.998);
        }
    }

    fn malformed_input_is_named<T>() {
        let (x1, x2) = planar(Motion::General, 6).generate(3).bearings::<T>();
        assert_eq!(homography_npt(&x1, &x2[..5]).unwrap_err(), InputError::LengthMismatch { first: 6, second: 5 });
        assert_eq!(homography_npt(&x1[..3], &x2[..3]).unwrap_err(), InputError::TooFew { given: 3, needed: 4 });
        for index in 0..6 {
            for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let mut y = x1.clone();
                y[index].y = lit(bad);
                assert_eq!(homography_npt(&y, &x2).unwrap_err(), InputError::NotFinite { array: 0, index });
                assert_eq!(homography_npt(&x2, &y).unwrap_err(), InputError::NotFinite { array: 1, index });
                if index < 4 {
                    assert!(four(&y, &x2).is_none() && four(&x2, &y).is_none());
                }
            }
        }
        for_each_case(20000, |_, rng: &mut Rng| {
            let x1: Vec<Vector3<T>> = (0..5).map(|_| rng.any_vector()).collect();
            let x2: Vec<Vector3<T>> = (0..5).map(|_| rng.any_vector()).collect();
            for h in [four(&x1, &x2), homography_npt(&x1, &x2).ok().flatten()].into_iter().flatten() {
                assert!(h.0.iter().all(|x| x.to_f64().is_finite()));
            }
        });
    }

    fn coordinates_of_any_size<T>() {
        for scale in [1e-6, 1e6] {
            let scene = planar(Motion::General, 6).generate(4);
            let (x1, x2) = scene.bearings::<T>();
            let scaled = |x: Vec<Vector3<T>>| -> Vec<_> { x.iter().map(|v| v * lit::<T>(scale)).collect() };
            let (y1, y2) = (scaled(x1), scaled(x2));
            assert!(transfer(four(&y1, &y2), &scene) < TRANSFER_FOUR.of::<T>() * 10.0);
            assert!(transfer(many(&y1, &y2), &scene) < TRANSFER_FOUR.of::<T>() * 10.0);
        }
    }

    fn motions_hold_the_truth_and_all_give_the_homography<T>() {
        for_each_case(2000, |_, rng| {
            let baseline = 10f64.powf(rng.range(-3.0, -0.2));
            let truth = motion(rng, baseline);
            let scale = if rng.unit() < 0.5 { -1.0 } else { 1.0 } * 10f64.powf(rng.range(-6.0, 6.0));
            let h = Homography((truth.homography().0 * scale).map(lit::<T>));
            let motions = h.motions();
            assert_eq!(motions.len(), 4);
            for m in &motions {
                assert!(projective_distance(&m.homography().0, &h.0) < FACTORISATION.of::<T>() * 3.0);
                let r = m.pose.rotation.coords.map(T::to_f64).norm();
                assert!((r - 1.0).abs() < ROTATION.of::<T>());
            }
            let error = motions.iter().map(|m| motion_error(m, &truth)).fold(f64::INFINITY, f64::min);
            assert!(error < PLANE_MOTION.of::<T>(), "{error:e} {}", truth.pose.translation.vector.norm());
        });
    }

    fn a_pure_rotation_has_one_motion<T>() {
        for_each_case(500, |_, rng| {
            let rotation: UnitQuaternion<f64> = rng.rotation(3.0);
            let scale = rng.normal();
            let h = Homography((rotation.to_rotation_matrix().matrix() * scale).map(lit::<T>));
            let motions = h.motions();
            assert_eq!(motions.len(), 1);
            assert!(rotation_error(&motions[0].pose.rotation, &rotation) < ROTATION.of::<T>());
            assert_eq!((motions[0].pose.translation.vector, motions[0].normal), (Vector3::zeros(), Vector3::zeros()));
        });
    }

    fn a_translation_along_the_normal_has_two<T>() {
        for sign in [1.0, -1.0] {
            let n = Vector3::new(0.0, 0.6, 0.8);
            let truth = PlaneMotion { pose: Pose::from_parts(Translation3::from(n * 0.25 * sign), UnitQuaternion::identity()), normal: n };
            let motions = Homography(truth.homography().0.map(lit::<T>)).motions();
            assert_eq!(motions.len(), 2);
            assert!(motions.iter().any(|m| motion_error(m, &truth) < PLANE_MOTION.of::<T>()));
        }
    }

    fn singular_and_not_finite_have_none<T>() {
        let mut h = Matrix3::<T>::identity();
        h[(2, 2)] = T::ZERO;
        assert!(Homography(h).motions().is_empty() && Homography(h).inverse().is_none());
        assert!(Homography(Matrix3::<T>::zeros()).motions().is_empty());
        for bad in [f64::NAN, f64::INFINITY] {
            h[(2, 2)] = lit(bad);
            assert!(Homography(h).motions().is_empty() && Homography(h).inverse().is_none());
        }
    }

    fn visible_motions_keep_the_truth<T>() {
        let mut single = 0;
        for_each_case(500, |seed, rng| {
            let scene = planar(MOTIONS[rng.index(4)], 30).generate(seed);
            let (normal, distance) = scene.plane.unwrap();
            let truth = PlaneMotion {
                pose: Pose::from_parts(Translation3::from(scene.pose.translation.vector / distance), scene.pose.rotation),
                normal,
            };
            let h = Homography(scene.homography().map(lit::<T>));
            let visible = h.visible_motions(&scene.bearings::<T>().0);
            assert!(visible.len() == 1 || visible.len() == 2, "{}", visible.len());
            assert!(visible.iter().any(|m| motion_error(m, &truth) < PLANE_MOTION.of::<T>()));
            // The plane's other side is never among them.
            assert!(visible.iter().all(|m| axis_error(&m.normal, &normal) > 0.1 || direction_error(&m.normal, &normal) < 0.2));
            single += usize::from(visible.len() == 1);
        });
        assert!(single > 0, "points that rule a twin out are among the scenes");
    }

    fn inverse_and_transfer<T>() {
        for_each_case(500, |_, rng| {
            let h = Homography(motion(rng, 0.3).homography().0.map(lit::<T>));
            let inverse = h.inverse().unwrap();
            assert!((matrix_f64(&(h.0 * inverse.0)) - Matrix3::identity()).norm() < FACTORISATION.of::<T>() * 3.0);
            let x = Vector2::new(lit::<T>(0.3 * rng.normal()), lit(0.3 * rng.normal()));
            let back = inverse.transfer(&h.transfer(&x).unwrap()).unwrap();
            assert!((back - x).map(T::to_f64).norm() < FACTORISATION.of::<T>() * 10.0);
        });
        let mut h = Matrix3::<T>::identity();
        h[(2, 0)] = -T::ONE;
        assert!(Homography(h).transfer(&Vector2::new(T::ONE, T::ONE)).is_none());
        let k = Matrix3::<T>::zeros();
        assert!(Homography(h).to_pixels(&k, &k).is_none() && Homography(h).to_normalised(&k, &k).is_none());
    }
}
