//! Triangulation: the truth, the definitions by other means, symmetries, degenerate inputs, any bits.

use epipole::geometry::pose::{centre, relative};
use epipole::geometry::residual::reprojection_with_jacobians;
use epipole::geometry::triangulation::{
    RefinePointError, Triangulation, View, ViewPair, depth_sigma, point_covariance, refine_point,
    triangulate_dlt,
};
use epipole::geometry::{Camera, CameraModel, KannalaBrandt, Pinhole, Pose};
use epipole::nalgebra::{
    Matrix2x3, Matrix3, Quaternion, SMatrix, Translation3, UnitQuaternion, Vector2, Vector3, Vector4,
};
use epipole::real::lit;
use epipole::{InputError, Real};
use epipole_host_tests::matchers::{direction_error, relative_distance, vector_f64};
use epipole_host_tests::scenes::{Motion, Scene, TwoView};
use epipole_host_tests::{Rng, for_each_case, in_both_scalars, tolerances};

type Method<T> = fn(&ViewPair<T>, &Vector3<T>, &Vector3<T>) -> Triangulation<T>;

/// The three methods of two views; the optimal one wants `z > 0`.
fn methods<T: Real>() -> [(&'static str, Method<T>); 3] {
    [
        ("midpoint", ViewPair::triangulate_midpoint),
        ("dlt", ViewPair::triangulate_dlt),
        ("optimal", ViewPair::triangulate_optimal),
    ]
}

fn cast<T: Real>(pose: &Pose<f64>) -> Pose<T> {
    let q = pose.rotation;
    let q = UnitQuaternion::new_unchecked(Quaternion::new(lit(q.w), lit(q.i), lit(q.j), lit(q.k)));
    Pose::from_parts(Translation3::from(pose.translation.vector.map(lit)), q)
}

/// The same problem in `f64` as the scalar `T` rounded it.
fn rounded<T: Real>(pose: &Pose<T>) -> Pose<f64> {
    let q = UnitQuaternion::new_normalize(Quaternion::from(pose.rotation.coords.map(T::to_f64)));
    Pose::from_parts(Translation3::from(pose.translation.vector.map(T::to_f64)), q)
}

fn apply(pose: &Pose<f64>, x: &Vector3<f64>) -> Vector3<f64> {
    pose.rotation * x + pose.translation.vector
}

fn parallax(problem: &TwoView, k: usize) -> f64 {
    ViewPair::new(&problem.pose).parallax(&problem.points[k])
}

/// The DLT by its definition: nalgebra's SVD of the matrix of every view's two equations, with the baseline 1.
fn dlt_by_svd(poses: &[Pose<f64>], bearings: &[Vector3<f64>]) -> Vector3<f64> {
    let origin = centre(&poses[0]);
    let scale = poses.iter().map(|p| (centre(p) - origin).norm()).fold(0.0, f64::max);
    dlt_by_svd_in(poses, bearings, scale)
}

fn dlt_by_svd_in(poses: &[Pose<f64>], bearings: &[Vector3<f64>], scale: f64) -> Vector3<f64> {
    let origin = centre(&poses[0]);
    // Rows of zeros change nothing.
    let mut a = SMatrix::<f64, 16, 4>::zeros();
    for (k, (pose, x)) in poses.iter().zip(bearings).enumerate() {
        let d = (pose.rotation.inverse() * x).normalize();
        let e1 = d.cross(&if d.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() }).normalize();
        for (row, b) in [e1, d.cross(&e1)].into_iter().enumerate() {
            let c = (centre(pose) - origin) / scale;
            a.set_row(2 * k + row, &Vector4::new(b.x, b.y, b.z, -b.dot(&c)).transpose());
        }
    }
    let svd = a.svd(false, true);
    let v_t = svd.v_t.unwrap();
    let v: Vector4<f64> = v_t.row(svd.singular_values.imin()).transpose();
    v.xyz() / v.w * scale + origin
}

fn image_cost(pose: &Pose<f64>, x: &Vector3<f64>, a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    let y = apply(pose, x);
    (x.xy() / x.z - a.xy() / a.z).norm_squared() + (y.xy() / y.z - b.xy() / b.z).norm_squared()
}

/// A world and `n` cameras round it that see every point, with their images.
struct Orbit {
    poses: Vec<Pose<f64>>,
    point: Vector3<f64>,
}

impl Orbit {
    fn new(rng: &mut Rng, n: usize) -> Self {
        let offset = rng.normal3() * 10.0;
        let poses = (0..n)
            .map(|_| {
                let rotation = rng.rotation(0.4);
                let c =
                    Vector3::new(rng.range(-1.5, 1.5), rng.range(-1.5, 1.5), rng.range(-1.0, 1.0)) + offset;
                Pose::from_parts(Translation3::from(-(rotation * c)), rotation)
            })
            .collect();
        let point = Vector3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(4.0, 9.0)) + offset;
        Self { poses, point }
    }

    fn bearings(&self) -> Vec<Vector3<f64>> {
        self.poses.iter().map(|p| apply(p, &self.point).normalize()).collect()
    }
}

in_both_scalars! {
    fn noise_free_points_are_recovered<T>() {
        for motion in [Motion::General, Motion::Small, Motion::RandomPose, Motion::Forward] {
            for_each_case(500, |seed, _| {
                let problem = Scene::new(motion, 10).generate(seed);
                let pair = ViewPair::new(&cast::<T>(&problem.pose));
                let (x1, x2) = problem.rays::<T>();
                for (k, truth) in problem.points.iter().enumerate() {
                    let angle = parallax(&problem, k);
                    // Of parallaxes near 0 or pi (a point on the baseline) f64 is tested, whose rounding is negligible.
                    if angle.sin() < if size_of::<T>() == 4 { 0.01 } else { 1e-4 } {
                        continue;
                    }
                    for (name, method) in methods::<T>() {
                        if name == "optimal" && motion == Motion::RandomPose {
                            continue;
                        }
                        // A random pose has points behind the second view's image plane, but none behind its bearing.
                        let Triangulation::Point(found) = method(&pair, &x1[k], &x2[k]) else {
                            panic!("{name} {motion:?} {k}: {:?}", method(&pair, &x1[k], &x2[k]));
                        };
                        let error = relative_distance(&found, truth);
                        assert!(error < tolerances::TRIANGULATED.of::<T>(), "{name} {motion:?} {k}: {error}");
                    }
                }
            });
        }
    }

    fn noise_free_points_of_many_views_are_recovered<T>() {
        for n in [2, 3, 10] {
            for_each_case(300, |_, rng| {
                let orbit = Orbit::new(rng, n);
                if n == 2 && ViewPair::new(&relative(&orbit.poses[0], &orbit.poses[1]))
                    .parallax(&apply(&orbit.poses[0], &orbit.point)) < 0.02 {
                    return;
                }
                let poses: Vec<_> = orbit.poses.iter().map(cast::<T>).collect();
                let bearings: Vec<_> = orbit.bearings().iter().map(|b| b.map(lit::<T>) * lit::<T>(rng.range(0.1, 9.0))).collect();
                let found = triangulate_dlt(&poses, &bearings).unwrap().point().expect("a point");
                let error = relative_distance(&found, &orbit.point);
                assert!(error < tolerances::TRIANGULATED.of::<T>(), "{n}: {error}");
            });
        }
    }

    /// With noise, each two-view method is what its name says, by other means in `f64`.
    fn methods_are_what_they_are_called<T>() {
        let bound = tolerances::TRIANGULATED.of::<T>();
        for_each_case(300, |seed, _| {
            let problem = Scene::new(Motion::General, 10).noise_px(1.0).generate(seed);
            let pose = cast::<T>(&problem.pose);
            let pair = ViewPair::new(&pose);
            let exact = rounded(&pose);
            let (x1, x2) = problem.rays::<T>();
            for k in 0..10 {
                if parallax(&problem, k) < 0.02 {
                    continue;
                }
                let (a, b) = (vector_f64(&x1[k]), vector_f64(&x2[k]));
                // Midpoint: least squares of the two depths.
                let (d, c) = (exact.rotation.inverse() * b, centre(&exact));
                let normal = Matrix3::from_columns(&[a, -d, a.cross(&d)]);
                let depths = normal.try_inverse().unwrap() * c;
                let midpoint = (a * depths.x + c + d * depths.y) / 2.0;
                if depths.x > 0.1 && depths.y > 0.1 {
                    let found = pair.triangulate_midpoint(&x1[k], &x2[k]).point().unwrap();
                    assert!(relative_distance(&found, &midpoint) < bound, "midpoint {found:?} {midpoint:?}");
                }
                let dlt = dlt_by_svd(&[Pose::identity(), exact], &[a, b]);
                if let Triangulation::Point(found) = pair.triangulate_dlt(&x1[k], &x2[k]) {
                    assert!(relative_distance(&found, &dlt) < bound, "dlt {found:?} {dlt:?}");
                } else {
                    assert!(dlt.z < 0.1 || apply(&exact, &dlt).z < 0.1, "no dlt point, but {dlt:?}");
                }
                // Optimal: no cheaper point nearby, nor those of the other methods.
                let Triangulation::Point(optimal) = pair.triangulate_optimal(&x1[k], &x2[k]) else { continue };
                let optimal = vector_f64(&optimal);
                let cost = |x: &Vector3<f64>| image_cost(&exact, x, &a, &b);
                let rounding = (tolerances::ROUNDING.of::<T>()).powi(2) * 10.0;
                let best = cost(&optimal) * (1.0 - 1e-6) - rounding - 1e-3 * cost(&optimal).sqrt() * tolerances::ROUNDING.of::<T>();
                assert!(best <= cost(&dlt) && best <= cost(&midpoint), "{} {}", cost(&optimal), cost(&dlt));
                for i in 0..3 {
                    for sign in [-1e-3, 1e-3] {
                        assert!(best <= cost(&(optimal + Vector3::ith(i, sign * optimal.norm()))));
                    }
                }
            }
        });
    }

    /// The N-view DLT is the last right singular vector; of two views it is the two-view DLT.
    fn the_dlt_of_many_views_is_the_null_vector<T>() {
        for n in [2, 3, 8] {
            for_each_case(200, |_, rng| {
                let orbit = Orbit::new(rng, n);
                let poses: Vec<_> = orbit.poses.iter().map(cast::<T>).collect();
                let noisy = |b: &Vector3<f64>| b + rng.normal3() * 1e-3;
                let bearings: Vec<_> = orbit.bearings().iter().map(noisy).map(|b| b.map(lit::<T>)).collect();
                let Triangulation::Point(found) = triangulate_dlt(&poses, &bearings).unwrap() else { return };
                let exact: Vec<_> = poses.iter().map(rounded).collect();
                let rays: Vec<_> = bearings.iter().map(vector_f64).collect();
                let origin = centre(&exact[0]);
                let scale = exact.iter().map(|p| (centre(p) - origin).amax()).fold(0.0, f64::max);
                let expected = dlt_by_svd_in(&exact, &rays, scale);
                let angle = (1..n).map(|k| {
                    ViewPair::new(&relative(&exact[0], &exact[k])).parallax(&apply(&exact[0], &expected))
                });
                if angle.fold(0.0, f64::max) > 0.05 {
                    let error = relative_distance(&found, &expected);
                    assert!(error < tolerances::TRIANGULATED.of::<T>(), "{n}: {error}");
                }
            });
        }
    }

    fn exchanging_the_views_gives_the_same_point<T>() {
        for_each_case(300, |seed, _| {
            let problem = Scene::new(Motion::General, 5).noise_px(0.5).generate(seed);
            let (forth, back) = (cast::<T>(&problem.pose), cast::<T>(&problem.pose.inverse()));
            let (x1, x2) = problem.rays::<T>();
            for k in 0..5 {
                if parallax(&problem, k) < 0.02 {
                    continue;
                }
                for (name, method) in methods::<T>() {
                    let a = method(&ViewPair::new(&forth), &x1[k], &x2[k]).point();
                    let b = method(&ViewPair::new(&back), &x2[k], &x1[k]).point();
                    if let (Some(a), Some(b)) = (a, b) {
                        let error = relative_distance(&b, &apply(&problem.pose, &vector_f64(&a)));
let bound = if name == "dlt" { tolerances::DLT_ORIGIN } else { tolerances::TRIANGULATED }.of::<T>();
                        assert!(error < bound, "{name}: {error}");
                    } else {
                        let near = problem.points[k].norm() < 3.0;
                        assert!(!near, "{name}: {a:?} {b:?}");
                    }
                }
            }
        });
    }

    /// The unit of length and the lengths of the bearings do not count: by powers of two, to the bit.
    fn scales_do_not_count<T>() {
        for_each_case(100, |seed, _| {
            let problem = Scene::new(Motion::General, 5).noise_px(0.5).generate(seed);
            let pose = cast::<T>(&problem.pose);
            let far = Pose::from_parts(Translation3::from(pose.translation.vector * lit::<T>(1024.0)), pose.rotation);
            let (x1, x2) = problem.rays::<T>();
            for k in 0..5 {
                for (name, method) in methods::<T>() {
                    let a = method(&ViewPair::new(&pose), &x1[k], &x2[k]).point();
                    let b = method(&ViewPair::new(&far), &(x1[k] * lit::<T>(4.0)), &(x2[k] * T::HALF)).point();
                    assert_eq!(a.map(|p| p * lit::<T>(1024.0)), b, "{name}");
                }
            }
        });
    }

    /// Bearings and baselines of any size: where there is an answer, it is right.
    fn sizes_far_from_one_do_not_spoil_a_point<T>() {
        let mut accepted = 0;
        for_each_case(2000, |seed, rng| {
            let problem = Scene::new(Motion::General, 1).noise_px(0.1).generate(seed);
            if parallax(&problem, 0) < 0.02 {
                return;
            }
            let mut size = |bits: i32| 2f64.powi(rng.index(2 * bits as usize) as i32 - bits);
            let (a, b, c) = (size(40), size(40), size(100));
            let t = problem.pose.translation.vector * c;
            let pose = cast::<T>(&Pose::from_parts(Translation3::from(t), problem.pose.rotation));
            let (x1, x2) = ((problem.x1[0] * a).map(lit::<T>), (problem.x2[0] * b).map(lit::<T>));
            for (k, (name, method)) in methods::<T>().into_iter().enumerate() {
                let Triangulation::Point(found) = method(&ViewPair::new(&pose), &x1, &x2) else { continue };
                let exact = methods::<f64>()[k].1(&ViewPair::new(&problem.pose), &problem.x1[0], &problem.x2[0]);
                let error = relative_distance(&found, &(exact.point().unwrap() * c));
                assert!(error < tolerances::TRIANGULATED.of::<T>(), "{name} {a:e} {b:e} {c:e}: {error}");
                accepted += 1;
            }
        });
        assert!(accepted > 500, "{accepted}");
    }

    /// In f32, depth at a parallax of 0.001 rad is as good as the rounded bearings allow.
    fn small_parallax_loses_no_more_than_the_input_does<T>() {
        for_each_case(300, |_, rng| {
            let pose = Pose::from_parts(Translation3::from(rng.direction()), rng.rotation(0.3));
            let ray = Vector3::new(rng.range(-0.5, 0.5), rng.range(-0.3, 0.3), 1.0);
            let point = ray * 10f64.powf(rng.range(1.0, 3.0));
            let pose32 = cast::<T>(&pose);
            let (x1, x2) = (point.normalize().map(lit::<T>), apply(&pose, &point).normalize().map(lit::<T>));
            let exact = ViewPair::new(&pose);
            let sine = exact.parallax(&point).sin();
            for (name, method) in methods::<T>() {
                let Triangulation::Point(found) = method(&ViewPair::new(&pose32), &x1, &x2) else {
                    assert!(sine < 100.0 * T::EPSILON.to_f64(), "{name}: no point at {sine}");
                    continue;
                };
                let error = relative_distance(&found, &point);
                assert!(error < 16.0 * T::EPSILON.to_f64() / sine, "{name} {sine}: {error}");
            }
        });
    }

    fn the_verdict_of_degenerate_rays<T>() {
        let v = |x: f64, y: f64, z: f64| Vector3::new(lit::<T>(x), lit(y), lit(z));
        let sideways = ViewPair::new(&Pose::<T>::translation(-T::ONE, T::ZERO, T::ZERO));
        let forward = ViewPair::new(&Pose::<T>::translation(T::ZERO, T::ZERO, -T::ONE));
        let still = ViewPair::new(&Pose::<T>::identity());
        let ahead = v(0.0, 0.0, 1.0);
        for (name, method) in methods::<T>() {
            let undetermined = |pair: &ViewPair<T>, a: Vector3<T>, b: Vector3<T>, what: &str| {
                assert_eq!(method(pair, &a, &b), Triangulation::Undetermined, "{name}: {what}");
            };
            assert_eq!(method(&sideways, &ahead, &ahead), Triangulation::AtInfinity { direction: ahead }, "{name}");
            let oblique = v(0.6, 0.0, 0.8);
            let Triangulation::AtInfinity { direction } = method(&sideways, &oblique, &(oblique * lit::<T>(3.0))) else {
                panic!("{name}: parallel")
            };
            assert!(direction_error(&direction, &oblique) < tolerances::ROUNDING.of::<T>());
            undetermined(&forward, ahead, ahead, "along the baseline");
            undetermined(&still, ahead, ahead, "no baseline, parallel");
            undetermined(&still, ahead, oblique, "no baseline");
            undetermined(&sideways, v(0.0, 0.0, 0.0), ahead, "a bearing of length 0");
            undetermined(&sideways, ahead, v(0.0, 0.0, 0.0), "a bearing of length 0");
            for bad in [f64::NAN, f64::INFINITY] {
                undetermined(&sideways, v(bad, 0.0, 1.0), ahead, "not finite");
                undetermined(&sideways, ahead, v(0.0, bad, 1.0), "not finite");
                undetermined(&ViewPair::new(&Pose::translation(lit(bad), T::ZERO, T::ZERO)), ahead, oblique, "baseline");
            }
            // Diverging rays meet behind both views.
            let behind = method(&sideways, &v(-0.1, 0.0, 1.0), &v(0.1, 0.0, 1.0));
            let Triangulation::Behind { point, view: 0, count: 2 } = behind else { panic!("{name}: {behind:?}") };
            assert!(relative_distance(&point, &v(0.5, 0.0, -5.0)) < tolerances::TRIANGULATED.of::<T>(), "{name}");
            assert_eq!(behind.point(), None);
            // The second camera has passed the point and still looks ahead.
            let passed = ViewPair::new(&Pose::translation(T::ZERO, T::ZERO, lit(-4.0)));
            let one = method(&passed, &v(0.5, 0.0, 1.0), &v(-0.5, 0.0, 1.0));
            assert!(matches!(one, Triangulation::Behind { view: 1, count: 1, .. }), "{name}: {one:?}");
            let passed = ViewPair::new(&Pose::translation(T::ZERO, T::ZERO, lit(4.0)));
            let one = method(&passed, &v(-0.5, 0.0, 1.0), &v(0.5, 0.0, 1.0));
            assert!(matches!(one, Triangulation::Behind { view: 0, count: 1, .. }), "{name}: {one:?}");
        }
        assert_eq!(sideways.triangulate_midpoint(&ahead, &-ahead), Triangulation::Undetermined, "antiparallel");
        assert_eq!(sideways.triangulate_optimal(&v(1.0, 0.0, 0.0), &ahead), Triangulation::Undetermined, "z = 0");
        assert_eq!(sideways.centre(), v(1.0, 0.0, 0.0));
    }

    fn the_verdict_of_degenerate_views<T>() {
        let v = |x: f64, y: f64, z: f64| Vector3::new(lit::<T>(x), lit(y), lit(z));
        let at = |x: f64, z: f64| Pose::<T>::translation(lit(-x), T::ZERO, lit(-z));
        let dlt = |poses: &[Pose<T>], bearings: &[Vector3<T>]| triangulate_dlt(poses, bearings).unwrap();
        let ahead = v(0.0, 0.0, 1.0);
        let row = [at(0.0, 0.0), at(1.0, 0.0), at(2.0, 0.0)];
        let track = [at(0.0, 0.0), at(0.0, 1.0), at(0.0, 2.0)];
        let Triangulation::AtInfinity { direction } = dlt(&row, &[ahead * T::TWO, ahead, ahead]) else { panic!() };
        assert!(direction_error(&direction, &ahead) < 10.0 * tolerances::ROUNDING.of::<T>());
        assert_eq!(dlt(&track, &[ahead; 3]), Triangulation::Undetermined, "along the baseline");
        assert_eq!(dlt(&[row[0]; 3], &[ahead; 3]), Triangulation::Undetermined, "no baseline");
        assert_eq!(dlt(&row, &[ahead, -ahead, ahead]), Triangulation::Undetermined, "antiparallel");
        assert_eq!(dlt(&row, &[ahead, v(0.0, 0.0, 0.0), ahead]), Triangulation::Undetermined, "length 0");
        let behind = dlt(&row, &[v(-0.1, 0.0, 1.0), v(0.0, 0.0, 1.0), v(0.1, 0.0, 1.0)]);
        let Triangulation::Behind { point, view: 0, count: 3 } = behind else { panic!("{behind:?}") };
        assert!(relative_distance(&point, &v(1.0, 0.0, -10.0)) < tolerances::TRIANGULATED.of::<T>());
        let passed = dlt(&[row[0], row[1], at(0.0, 9.0)], &[v(0.5, 0.0, 2.0), v(-0.5, 0.0, 2.0), v(-0.5, 0.0, 7.0)]);
        assert!(matches!(passed, Triangulation::Behind { view: 2, count: 1, .. }), "{passed:?}");

        let error = |poses: &[Pose<T>], bearings: &[Vector3<T>]| triangulate_dlt(poses, bearings).unwrap_err();
        assert_eq!(error(&row, &[ahead; 2]), InputError::LengthMismatch { first: 3, second: 2 });
        assert_eq!(error(&row[..1], &[ahead]), InputError::TooFew { given: 1, needed: 2 });
        assert_eq!(error(&[], &[]), InputError::TooFew { given: 0, needed: 2 });
        let nan = v(0.0, f64::NAN, 1.0);
        assert_eq!(error(&row, &[ahead, ahead, nan]), InputError::NotFinite { array: 1, index: 2 });
        assert_eq!(error(&[row[0], at(f64::INFINITY, 0.0)], &[ahead; 2]), InputError::NotFinite { array: 0, index: 1 });
    }

    /// Depths of a fisheye's rays beyond 90 degrees have the sign along the ray.
    fn bearings_beyond_90_degrees_are_in_front<T>() {
        let pair = ViewPair::new(&Pose::<T>::translation(T::ZERO, -T::ONE, T::ZERO));
        let point = Vector3::new(3.0, 0.5, -0.4);
        let x2 = point - Vector3::new(0.0, 1.0, 0.0);
        let (x1, x2) = (point.normalize().map(lit::<T>), x2.normalize().map(lit::<T>));
        for found in [pair.triangulate_midpoint(&x1, &x2), pair.triangulate_dlt(&x1, &x2)] {
            assert!(relative_distance(&found.point().unwrap(), &point) < tolerances::TRIANGULATED.of::<T>());
        }
    }

    /// In pixels of a fisheye: the optimal point of bearings is the one that the non-linear refinement finds.
    fn optimal_of_bearings_is_the_least_pixel_error<T>() {
        let pinhole = Pinhole::new(lit::<T>(300.0), lit(280.0), lit(400.0), lit(400.0)).unwrap();
        let camera = KannalaBrandt::new(pinhole, [0.01, -0.003, 0.0, 0.0].map(lit)).unwrap();
        for_each_case(200, |_, rng| {
            let pose = cast::<T>(&Pose::from_parts(Translation3::from(rng.direction()), rng.rotation(0.3)));
            let point = rng.direction() * rng.range(2.0, 5.0);
            let seen = [point, apply(&rounded(&pose), &point)].map(|p| camera.project(&p.map(lit)));
            let [Some(u1), Some(u2)] = seen else { return };
            if ViewPair::new(&rounded(&pose)).parallax(&point) < 0.1 || point.z < -1.0 {
                return;
            }
            let mut noise = || Vector2::new(rng.normal(), rng.normal()).map(|n| lit::<T>(0.5 * n));
            let (u1, u2) = (u1 + noise(), u2 + noise());
            let (Ok((b1, j1)), Ok((b2, j2))) = (camera.unproject_with_jacobian(&u1), camera.unproject_with_jacobian(&u2))
            else { return };
            let found = ViewPair::new(&pose).triangulate_optimal_bearings(&b1, &b2, &j1, &j2).point().unwrap();
            let views = [Pose::identity(), pose].map(|pose| View { camera: &camera, pose });
            let refined = refine_point(&views, &[u1, u2], &found).unwrap();
            assert!(refined.converged);
            let error = relative_distance(&found, &vector_f64(&refined.point));
            assert!(error < tolerances::LINEARISED_IMAGE.of::<T>(), "{error}");
        });
    }

    fn refinement_reaches_the_least_cost<T>() {
        let camera: Camera<T> = Pinhole::new(lit::<T>(500.0), lit(500.0), lit(320.0), lit(240.0)).unwrap().into();
        for n in [2, 4, 12] {
            for_each_case(100, |_, rng| {
                let orbit = Orbit::new(rng, n);
                let poses: Vec<_> = orbit.poses.iter().map(cast::<T>).collect();
                let views: Vec<_> = poses.iter().map(|pose| View { camera: &camera, pose: *pose }).collect();
                let mut pixels = Vec::new();
                for pose in &orbit.poses {
                    let exact = camera.project(&apply(pose, &orbit.point).map(lit)).unwrap();
                    pixels.push(exact + Vector2::new(rng.normal(), rng.normal()).map(|x| lit::<T>(0.3 * x)));
                }
                let start = (orbit.point + rng.normal3() * 0.2).map(lit::<T>);
                let refined = refine_point(&views, &pixels, &start).unwrap();
                let cost = |x: &Vector3<f64>| -> f64 {
                    poses.iter().zip(&pixels).map(|(pose, pixel)| {
                        let y = apply(&rounded(pose), x);
                        let projected = Vector2::new(500.0 * y.x / y.z + 320.0, 500.0 * y.y / y.z + 240.0);
                        (projected - pixel.map(T::to_f64)).norm_squared()
                    }).sum()
                };
                let point = vector_f64(&refined.point);
                let found = cost(&point);
                let rounding = n as f64 * tolerances::PROJECTION_PX.of::<T>() * (1.0 + found.sqrt());
                assert!(refined.converged, "{refined:?}");
                assert!((refined.cost_px_sq.to_f64() - found).abs() <= rounding, "{refined:?} {found}");
                let Some(covariance) = refined.covariance_per_px_sq else { panic!("{refined:?}") };
                // A step of a tenth of the standard deviation in any direction costs more.
                for _ in 0..6 {
                    let direction = rng.direction();
                    let sigma = depth_sigma(&covariance, &direction.map(lit::<T>)).to_f64();
                    assert!(found <= cost(&(point + direction * sigma * 0.1)) + rounding);
                }
            });
        }
    }

    fn refinement_names_what_is_wrong<T>() {
        let camera = Pinhole::new(lit::<T>(500.0), lit(500.0), lit(320.0), lit(240.0)).unwrap();
        let view = |x: f64| View { camera: &camera, pose: Pose::<T>::translation(lit(x), T::ZERO, T::ZERO) };
        let (views, pixels) = ([view(0.0), view(-1.0)], [Vector2::new(lit::<T>(445.0), lit(240.0)); 2]);
        let start = Vector3::new(T::ONE, T::ZERO, lit(4.0));
        let input = |e| RefinePointError::Input(e);
        let error = |views: &[View<T, Pinhole<T>>], pixels: &[Vector2<T>], start: &Vector3<T>| {
            refine_point(views, pixels, start).unwrap_err()
        };
        assert_eq!(error(&views, &pixels[..1], &start), input(InputError::LengthMismatch { first: 2, second: 1 }));
        assert_eq!(error(&views[..1], &pixels[..1], &start), input(InputError::TooFew { given: 1, needed: 2 }));
        let nan = Vector2::new(T::ZERO, lit(f64::NAN));
        assert_eq!(error(&views, &[pixels[0], nan], &start), input(InputError::NotFinite { array: 1, index: 1 }));
        let lost = [view(0.0), view(f64::INFINITY)];
        assert_eq!(error(&lost, &pixels, &start), input(InputError::NotFinite { array: 0, index: 1 }));
        let nowhere = Vector3::from_element(lit(f64::NAN));
        assert_eq!(error(&views, &pixels, &nowhere), input(InputError::NotFinite { array: 2, index: 0 }));
        assert_eq!(error(&views, &pixels, &-start), RefinePointError::NotVisible { view: 0 });
        assert_eq!(RefinePointError::NotVisible { view: 1 }.to_string(), "view 1 does not see the start");
        assert_eq!(RefinePointError::Unobservable.to_string(), "the views do not determine the point");
        assert_eq!(input(InputError::TooFew { given: 1, needed: 2 }).to_string(), "1 correspondences given, 2 needed");
        // The same view twice: no depth.
        let twice = [view(0.0), view(0.0)];
        let same = refine_point(&twice, &pixels, &start);
        let unobserved = |r: Result<_, _>| match r {
            Err(RefinePointError::Unobservable) => true,
            Ok(epipole::geometry::triangulation::RefinedPoint { covariance_per_px_sq, .. }) => covariance_per_px_sq.is_none(),
            Err(_) => false,
        };
        assert!(unobserved(same), "{same:?}");
    }

    /// `(sum Ji' Ji)^-1` in `f64`, and the covariance of angles by the same formula.
    fn covariances_are_the_inverse_information<T>() {
        let camera = Pinhole::new(lit::<T>(500.0), lit(520.0), lit(320.0), lit(240.0)).unwrap();
        for_each_case(200, |_, rng| {
            let orbit = Orbit::new(rng, 3);
            let mut jacobians: Vec<Matrix2x3<T>> = Vec::new();
            let (point, pixel) = (orbit.point.map(lit::<T>), Vector2::zeros());
            for pose in &orbit.poses {
                jacobians.push(reprojection_with_jacobians(&camera, &cast(pose), &point, &pixel).unwrap().by_point);
            }
            let information: Matrix3<f64> = jacobians.iter().map(|j| j.map(T::to_f64)).map(|j| j.transpose() * j).sum();
            let expected = information.try_inverse().unwrap() * 0.25;
            let found = point_covariance(&jacobians, T::HALF).unwrap().map(T::to_f64);
            let condition = information.symmetric_eigenvalues();
            let condition = (condition.max() / condition.min()).sqrt();
            let error = (found - expected).amax() / expected.amax();
            // The oracle squares the condition, in f64.
            let bound = 8.0 * condition * tolerances::ROUNDING.of::<T>() + 1e-14 * condition.powi(2);
            assert!(error < bound, "{error} {condition}");

            let pose = relative(&orbit.poses[0], &orbit.poses[1]);
            let x = apply(&orbit.poses[0], &orbit.point);
            let across = |v: Vector3<f64>| (Matrix3::identity() - v * v.transpose() / v.norm_squared()) / v.norm_squared();
            let information = across(x) + across(x - centre(&pose));
            let expected = information.try_inverse().unwrap() * 1e-6;
            let found = ViewPair::new(&cast::<T>(&pose)).covariance(&x.map(lit), lit(1e-3)).unwrap().map(T::to_f64);
            let error = (found - expected).amax() / expected.amax();
            let angle = ViewPair::new(&pose).parallax(&x);
            // The oracle squares the condition, in f64.
            let bound = 8.0 * tolerances::ROUNDING.of::<T>() / angle.min(1.0) + 1e-14 / angle.powi(2);
            assert!(error < bound, "{error} {angle}");
        });
        let pair = ViewPair::new(&Pose::<T>::translation(T::ONE, T::ZERO, T::ZERO));
        let sigma = lit::<T>(1e-3);
        for none in [[0.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [3.0, 0.0, 0.0], [f64::NAN, 0.0, 1.0], [0.0, 0.0, f64::INFINITY]] {
            assert_eq!(pair.covariance(&Vector3::from(none.map(lit::<T>)), sigma), None, "{none:?}");
        }
        assert_eq!(point_covariance::<T>(&[], sigma), None);
    }

    /// The errors of optimal points are spread as their covariances say (3 degrees of freedom).
    fn covariance_is_calibrated<T>() {
        let (mut sum, mut count) = (0.0, 0.0);
        let sigma = 0.3 / 718.0;
        for_each_case(400, |seed, _| {
            let problem = Scene::new(Motion::General, 5).noise_px(0.3).generate(seed);
            let pair = ViewPair::new(&cast::<T>(&problem.pose));
            let (x1, x2) = problem.rays::<T>();
            for (k, truth) in problem.points.iter().enumerate() {
                if parallax(&problem, k) < 0.05 {
                    continue;
                }
                let found = pair.triangulate_optimal(&x1[k], &x2[k]).point().unwrap();
                // Noise is isotropic on the plane z = 1: the Jacobians there, in units of the plane.
                let jacobian = |p: &Vector3<f64>, r: Matrix3<f64>| {
                    let j = Matrix2x3::new(1.0 / p.z, 0.0, -p.x / p.z / p.z, 0.0, 1.0 / p.z, -p.y / p.z / p.z);
                    (j * r).map(lit::<T>)
                };
                let jacobians = [
                    jacobian(truth, Matrix3::identity()),
                    jacobian(&apply(&problem.pose, truth), problem.rotation()),
                ];
                let covariance = point_covariance(&jacobians, lit(sigma)).unwrap().map(T::to_f64);
                let error = vector_f64(&found) - truth;
                sum += error.dot(&(covariance.try_inverse().unwrap() * error));
                count += 1.0;
            }
        });
        // Chi-square with 3 degrees of freedom: mean 3, variance 6; 99.9 % of the means of `count`.
        if count > 1000.0 {
            let half_width = 3.3 * (6.0f64 / count).sqrt();
            assert!((sum / count - 3.0).abs() < half_width, "{} of {count}", sum / count);
        }
    }

    /// Whatever the bits, an accepted answer is finite; and a point in front lies in front.
    fn any_bits_give_finite_answers<T>() {
        let finite = |v: &Vector3<T>| v.iter().all(|x| x.to_f64().is_finite());
        let mut accepted = [0usize; 4];
        for_each_case(200_000, |_, rng| {
            // Half of the cases have a real rotation: arbitrary matrices rarely let anything through.
            let r = match rng.index(2) {
                0 => rng.rotation(3.0).to_rotation_matrix().into_inner().map(lit::<T>),
                _ => Matrix3::from_columns(&[rng.any_vector(), rng.any_vector(), rng.any_vector()]),
            };
            let pair = ViewPair::from_parts(&r, &rng.any_vector());
            let (x1, x2) = (rng.any_vector::<T>(), rng.any_vector());
            for (k, (name, method)) in methods::<T>().into_iter().enumerate() {
                let answer = method(&pair, &x1, &x2);
                let ok = match answer {
                    Triangulation::Point(point) => {
                        accepted[k] += 1;
                        finite(&point)
                    }
                    Triangulation::Behind { point, view, count } => finite(&point) && view + count <= 2 && count > 0,
                    Triangulation::AtInfinity { direction } => {
                        (direction.map(T::to_f64).norm() - 1.0).abs() < tolerances::ROUNDING.of::<T>()
                    }
                    Triangulation::Undetermined => true,
                };
                assert!(ok, "{name} {pair:?} {x1:?} {x2:?}: {answer:?}");
            }
            let point = rng.any_vector::<T>();
            if let Some(covariance) = pair.covariance(&point, rng.any_bits()) {
                accepted[3] += 1;
                assert!(covariance.iter().all(|x| x.to_f64().is_finite()), "{pair:?} {point:?}");
            }
        });
        assert!(accepted.iter().all(|n| *n > 500), "too few accepted: {accepted:?}");
    }

    fn any_bits_of_many_views_give_finite_answers<T>() {
        let finite = |v: &Vector3<T>| v.iter().all(|x| x.to_f64().is_finite());
        let mut accepted = [0usize; 3];
        for_each_case(50_000, |_, rng| {
            let n = rng.index(5);
            let number = |rng: &mut Rng| if rng.index(3) == 0 { rng.any_bits::<T>() } else { lit(rng.normal()) };
            let poses: Vec<Pose<T>> = (0..n)
                .map(|_| {
                    let t = Vector3::from_fn(|_, _| number(rng));
                    let q = if rng.index(10) == 0 {
                        Quaternion::new(number(rng), number(rng), number(rng), number(rng))
                    } else {
                        let q = rng.rotation(3.0);
                        Quaternion::new(lit(q.w), lit(q.i), lit(q.j), lit(q.k))
                    };
                    Pose::from_parts(Translation3::from(t), UnitQuaternion::new_unchecked(q))
                })
                .collect();
            let bearings: Vec<_> = (0..n).map(|_| Vector3::from_fn(|_, _| number(rng))).collect();
            match triangulate_dlt(&poses, &bearings) {
                Ok(Triangulation::Point(point)) => {
                    accepted[0] += 1;
                    assert!(finite(&point), "{poses:?} {bearings:?}");
                }
                Ok(Triangulation::Behind { point, view, count }) => {
                    assert!(finite(&point) && count > 0 && view + count <= n, "{poses:?} {bearings:?}");
                }
                Ok(Triangulation::AtInfinity { direction }) => assert!(finite(&direction), "{poses:?} {bearings:?}"),
                Ok(_) | Err(_) => {}
            }
            let camera = Pinhole::new(lit::<T>(500.0), lit(500.0), lit(320.0), lit(240.0)).unwrap();
            let views: Vec<_> = poses.iter().map(|pose| View { camera: &camera, pose: *pose }).collect();
            let pixels: Vec<_> = (0..n).map(|_| Vector2::from_fn(|_, _| number(rng))).collect();
            let start = Vector3::from_fn(|_, _| number(rng));
            if let Ok(refined) = refine_point(&views, &pixels, &start) {
                accepted[1] += 1;
                assert!(finite(&refined.point) && refined.cost_px_sq.to_f64().is_finite(), "{refined:?}");
                if let Some(covariance) = refined.covariance_per_px_sq {
                    accepted[2] += 1;
                    assert!(covariance.iter().all(|x| x.to_f64().is_finite()), "{refined:?}");
                }
            }
        });
        assert!(accepted.iter().all(|n| *n > 100), "too few accepted: {accepted:?}");
    }
}
