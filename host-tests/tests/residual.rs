//! Residuals: their definitions, Jacobians by central differences, degenerate inputs, any bits.

use epipole::Real;
use epipole::geometry::pose::{exp, retract};
use epipole::geometry::residual::{
    reprojection, reprojection_with_jacobians, sampson, sampson_bearing, sampson_with_jacobian,
    symmetric_epipolar_sq, symmetric_transfer_sq, transfer, transfer_with_jacobian,
};
use epipole::geometry::{BrownConrady, CameraModel, KannalaBrandt, Pinhole, Pose};
use epipole::nalgebra::{
    Matrix3, Matrix3x2, Quaternion, Translation3, UnitQuaternion, Vector2, Vector3, Vector6,
};
use epipole::real::lit;
use epipole_host_tests::matchers::matrix_f64;
use epipole_host_tests::scenes::{Motion, Scene, Shape, TwoView, calibration};
use epipole_host_tests::{Rng, for_each_case, in_both_scalars, tolerances};

fn scene(seed: u64) -> TwoView {
    Scene::new(Motion::General, 20).noise_px(1.0).generate(seed)
}

fn plane<T: Real>(x: &Vector3<f64>) -> Vector2<T> {
    Vector2::new(lit(x.x / x.z), lit(x.y / x.z))
}

fn f64_plane<T: Real>(x: &Vector2<T>) -> Vector2<f64> {
    x.map(T::to_f64)
}

/// The central difference of a function of a matrix by its entries.
fn by_matrix<const N: usize>(m: &Matrix3<f64>, f: impl Fn(&Matrix3<f64>) -> [f64; N]) -> [Matrix3<f64>; N] {
    let h = m.amax() * 1e-5;
    let mut result = [Matrix3::zeros(); N];
    for i in 0..3 {
        for j in 0..3 {
            let moved = |sign: f64| {
                let mut m = *m;
                m[(i, j)] += sign * h;
                f(&m)
            };
            let (plus, minus) = (moved(1.0), moved(-1.0));
            for k in 0..N {
                result[k][(i, j)] = (plus[k] - minus[k]) / (2.0 * h);
            }
        }
    }
    result
}

in_both_scalars! {
    /// To first order, the Sampson distance is the least change of the four coordinates that meets the constraint: it
    /// is compared with the change found by Newton's iteration along the gradient.
    fn sampson_is_the_distance_to_the_constraint<T>() {
        for_each_case(50, |seed, _| {
            let problem = scene(seed);
            let e = problem.essential();
            for (a, b) in problem.x1.iter().zip(&problem.x2) {
                let (mut u, mut v) = (a.xy(), b.xy());
                for _ in 0..10 {
                    let (line2, line1) = (e * u.push(1.0), e.transpose() * v.push(1.0));
                    let c = v.push(1.0).dot(&line2);
                    let d = line1.xy().norm_squared() + line2.xy().norm_squared();
                    (u, v) = (u - line1.xy() * (c / d), v - line2.xy() * (c / d));
                }
                let distance = ((u - a.xy()).norm_squared() + (v - b.xy()).norm_squared()).sqrt();
                let r = sampson(&e.map(lit::<T>), &plane(a), &plane(b)).unwrap().to_f64();
                // The first order leaves the square of the noise, 1/718; rounding of the inputs is absolute.
                let bound = 5e-3 * distance + 2.0 * tolerances::ROUNDING.of::<T>();
                assert!((r.abs() - distance).abs() < bound, "{r} {distance}");
            }
        });
    }

    /// In pixels of every camera, wherever in the image: a change of a pixel by the gradient's direction over the
    /// residual meets the constraint.
    fn sampson_of_bearings_is_in_pixels<T>() {
        let pinhole = Pinhole::new(lit::<T>(350.0), lit(340.0), lit(500.0), lit(400.0)).unwrap();
        let fisheye = KannalaBrandt::new(pinhole, [0.01, -0.005, 0.001, 0.0].map(lit)).unwrap();
        let radtan = BrownConrady::new(pinhole, [-0.2, 0.05, 0.001, -0.001, 0.0].map(lit)).unwrap();
        let cameras: [&dyn CameraModel<T>; 3] = [&pinhole, &fisheye, &radtan];
        for camera in cameras {
            for_each_case(100, |_, rng| {
                // A point seen exactly, then moved across the epipolar line by a known number of pixels in image 2.
                let r = rng.rotation(0.3).to_rotation_matrix().into_inner();
                let t = rng.direction();
                let point = Vector3::new(rng.range(-2.0, 2.0), rng.range(-2.0, 2.0), rng.range(3.0, 8.0));
                let e = (t.cross_matrix() * r).map(lit::<T>);
                let (first, second) = (point.map(lit), (r * point + t).map(lit));
                let (Some(u), Some(v)) = (camera.project(&first), camera.project(&second)) else { return };
                let (b1, j1) = camera.unproject_with_jacobian(&u).unwrap();
                let (b2, j2) = camera.unproject_with_jacobian(&v).unwrap();
                let (g1, g2) = ((e * j1).tr_mul(&b2).map(T::to_f64), j2.tr_mul(&(e * b1)).map(T::to_f64));
                let size = (g1.norm_squared() + g2.norm_squared()).sqrt();
                if size < 1e-4 {
                    return; // near the epipoles the constraint is not linear over a pixel
                }
                let error = rng.range(-0.5, 0.5);
                let (u, v) = (u + (g1 * (error / size)).map(lit), v + (g2 * (error / size)).map(lit));
                let (b1, j1) = camera.unproject_with_jacobian(&u).unwrap();
                let (b2, j2) = camera.unproject_with_jacobian(&v).unwrap();
                let found = sampson_bearing(&e, &b1, &b2, &j1, &j2).unwrap().to_f64();
                let bound = 0.02 * error.abs() + tolerances::PROJECTION_PX.of::<T>() * 2.0;
                assert!((found - error).abs() < bound, "{found} {error}");
            });
        }
        // On planes z = 1 with the Jacobian of the plane it is the plain one.
        let problem = scene(1);
        let e = problem.essential().map(lit::<T>);
        let j = Matrix3x2::new(T::ONE, T::ZERO, T::ZERO, T::ONE, T::ZERO, T::ZERO);
        for (a, b) in problem.x1.iter().zip(&problem.x2) {
            let (u, v) = (plane::<T>(a), plane::<T>(b));
            let general = sampson_bearing(&e, &u.push(T::ONE), &v.push(T::ONE), &j, &j).unwrap();
            let difference = (general - sampson(&e, &u, &v).unwrap()).to_f64();
            assert!(difference.abs() < tolerances::ROUNDING.of::<T>());
        }
    }

    fn sampson_jacobian_is_the_difference<T>() {
        for_each_case(20, |seed, _| {
            let problem = scene(seed);
            let e = problem.essential().map(lit::<T>);
            for (a, b) in problem.x1.iter().zip(&problem.x2) {
                let (u, v) = (plane::<T>(a), plane::<T>(b));
                let (r, jacobian) = sampson_with_jacobian(&e, &u, &v).unwrap();
                assert!((r - sampson(&e, &u, &v).unwrap()).to_f64().abs() < tolerances::ROUNDING.of::<T>());
                let (u, v) = (f64_plane(&u), f64_plane(&v));
                let [expected] = by_matrix(&matrix_f64(&e), |m| [sampson(m, &u, &v).unwrap()]);
                let error = (matrix_f64(&jacobian) - expected).amax() / expected.amax();
                assert!(error < tolerances::JACOBIAN.of::<T>(), "{error}");
                // A residual does not see the scale.
                let along = jacobian.dot(&e).to_f64() / jacobian.map(T::to_f64).norm();
                assert!(along.abs() < 10.0 * tolerances::ROUNDING.of::<T>(), "{along}");
            }
        });
    }

    fn symmetric_epipolar_is_the_sum_of_squared_line_distances<T>() {
        for_each_case(20, |seed, _| {
            let problem = scene(seed);
            let e = problem.essential();
            for (a, b) in problem.x1.iter().zip(&problem.x2) {
                let (line2, line1) = (e * a, e.transpose() * b);
                let d2 = b.dot(&line2) / line2.xy().norm();
                let d1 = a.dot(&line1) / line1.xy().norm();
                let found = symmetric_epipolar_sq(&e.map(lit::<T>), &plane(a), &plane(b)).unwrap().to_f64();
                let bound = 4.0 * tolerances::ROUNDING.of::<T>();
                assert!((found.sqrt() - d1.hypot(d2)).abs() < bound, "{found}");
            }
        });
    }

    fn exact_correspondences_have_no_residual<T>() {
        for_each_case(20, |seed, _| {
            let problem = Scene::new(Motion::General, 20).shape(Shape::Plane).generate(seed);
            let (e, h) = (problem.essential().map(lit::<T>), problem.homography());
            let (h, inverse) = (h.map(lit::<T>), h.try_inverse().unwrap().map(lit::<T>));
            for (a, b) in problem.x1.iter().zip(&problem.x2) {
                let (u, v) = (plane::<T>(a), plane::<T>(b));
                let bound = 5.0 * tolerances::ROUNDING.of::<T>();
                assert!(sampson(&e, &u, &v).unwrap().to_f64().abs() < bound);
                assert!(transfer(&h, &u, &v).unwrap().map(T::to_f64).norm() < bound);
                assert!(symmetric_transfer_sq(&h, &inverse, &u, &v).unwrap().to_f64().sqrt() < 4.0 * bound);
            }
        });
    }

    fn transfer_jacobian_is_the_difference<T>() {
        for_each_case(20, |seed, rng| {
            let problem = Scene::new(Motion::General, 10).shape(Shape::Plane).noise_px(2.0).generate(seed);
            let h = (problem.homography() * rng.range(-2.0, 2.0)).map(lit::<T>);
            for (a, b) in problem.x1.iter().zip(&problem.x2) {
                let (u, v) = (plane::<T>(a), plane::<T>(b));
                let (error, jacobian) = transfer_with_jacobian(&h, &u, &v).unwrap();
                assert_eq!(Some(error), transfer(&h, &u, &v));
                let (u, v) = (f64_plane(&u), f64_plane(&v));
                let expected = by_matrix(&matrix_f64(&h), |m| transfer(m, &u, &v).unwrap().into());
                let size = expected[0].amax().max(expected[1].amax());
                for (row, expected) in expected.iter().enumerate() {
                    for k in 0..9 {
                        let difference = jacobian[(row, k)].to_f64() - expected[(k / 3, k % 3)];
                        assert!(difference.abs() / size < tolerances::JACOBIAN.of::<T>(), "{row} {k}: {difference}");
                    }
                }
            }
        });
    }

    fn reprojection_jacobians_are_the_differences<T>() {
        let numbers = [350.0, 340.0, 500.0, 400.0];
        let (radtan, fisheye) = ([-0.2, 0.05, 0.001, -0.001, 0.0], [0.01, -0.005, 0.001, 0.0]);
        fn cameras<U: Real>(n: [f64; 4], r: [f64; 5], f: [f64; 4]) -> [Box<dyn CameraModel<U>>; 3] {
            let [fx, fy, cx, cy] = n.map(lit::<U>);
            let pinhole = Pinhole::new(fx, fy, cx, cy).unwrap();
            [
                Box::new(pinhole),
                Box::new(BrownConrady::new(pinhole, r.map(lit)).unwrap()),
                Box::new(KannalaBrandt::new(pinhole, f.map(lit)).unwrap()),
            ]
        }
        let exact = cameras::<f64>(numbers, radtan, fisheye);
        for (camera, exact) in cameras::<T>(numbers, radtan, fisheye).iter().zip(&exact) {
            for_each_case(100, |_, rng| {
                let q = rng.rotation(3.0);
                let q = Quaternion::new(lit::<T>(q.w), lit(q.i), lit(q.j), lit(q.k));
                let t = rng.normal3().map(lit);
                let pose = Pose::from_parts(Translation3::from(t), UnitQuaternion::new_unchecked(q));
                let seen = Vector3::new(rng.range(-2.0, 2.0), rng.range(-2.0, 2.0), rng.range(3.0, 8.0));
                let point = pose.rotation.inverse() * (seen.map(lit) - t);
                let pixel = Vector2::new(lit(rng.range(0.0, 1000.0)), lit(rng.range(0.0, 800.0)));
                let r = reprojection_with_jacobians(camera.as_ref(), &pose, &point, &pixel).unwrap();
                let plain = reprojection(camera.as_ref(), &pose, &point, &pixel).unwrap();
                let difference = (plain - r.residual).map(T::to_f64).norm();
                assert!(difference < 4.0 * tolerances::PROJECTION_PX.of::<T>(), "{difference}");

                let q = UnitQuaternion::new_normalize(Quaternion::from(pose.rotation.coords.map(T::to_f64)));
                let pose = Pose::from_parts(Translation3::from(t.map(T::to_f64)), q);
                let (point, pixel) = (point.map(T::to_f64), pixel.map(T::to_f64));
                let at = |pose: &Pose<f64>, point: &Vector3<f64>| {
                    reprojection(exact.as_ref(), pose, point, &pixel).unwrap()
                };
                let h = 1e-5;
                let mut worst: f64 = 0.0;
                let size = r.by_pose.map(T::to_f64).amax();
                for k in 0..6 {
                    let step = Vector6::ith(k, h);
                    let d = (at(&retract(&pose, &step), &point) - at(&retract(&pose, &-step), &point)) / (2.0 * h);
                    worst = worst.max((d - r.by_pose.column(k).map(T::to_f64)).amax() / size);
                }
                for k in 0..3 {
                    let step = Vector3::ith(k, h);
                    let d = (at(&pose, &(point + step)) - at(&pose, &(point - step))) / (2.0 * h);
                    worst = worst.max((d - r.by_point.column(k).map(T::to_f64)).amax() / size);
                }
                assert!(worst < tolerances::JACOBIAN.of::<T>(), "{worst}");
            });
        }
    }

    /// Pixels with F give what normalised points with E give, over the focal length.
    fn the_scale_of_the_matrix_and_of_the_image<T>() {
        let problem = scene(3);
        let (e, f) = (problem.essential(), problem.fundamental());
        let k = calibration();
        for (a, b) in problem.x1.iter().zip(&problem.x2) {
            let in_plane = sampson(&e.map(lit::<T>), &plane(a), &plane(b)).unwrap().to_f64();
            let in_pixels = sampson(&(f * 1e3).map(lit::<T>), &plane(&(k * a)), &plane(&(k * b))).unwrap().to_f64();
            let difference = in_pixels / 718.0 - in_plane;
            assert!(difference.abs() < 5.0 * tolerances::ROUNDING.of::<T>(), "{in_plane} {in_pixels}");
        }
    }

    fn degenerate_inputs_have_no_residual<T>() {
        let o = Vector2::<T>::zeros();
        let e = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0).map(lit::<T>); // t along z
        assert_eq!(sampson(&e, &o, &o), None, "both at the epipoles");
        assert_eq!(sampson_with_jacobian(&e, &o, &o), None);
        assert_eq!(symmetric_epipolar_sq(&e, &o, &Vector2::new(T::ONE, T::ONE)), None, "one at its epipole");
        assert_eq!(sampson(&Matrix3::zeros(), &o, &o), None, "no matrix");
        let huge = Matrix3::from_element(T::MAX * lit(1e-3));
        let far = Vector2::new(lit::<T>(1e3), lit(-1e3));
        assert_eq!(sampson(&huge, &far, &far), None, "the gradient overflows: not a residual of 0");
        assert_eq!(symmetric_epipolar_sq(&huge, &far, &far), None);
        assert_eq!(transfer(&huge, &(far * lit::<T>(1e3)), &far), None);
        let nan = Vector2::new(lit::<T>(f64::NAN), T::ZERO);
        assert_eq!(sampson(&e, &nan, &Vector2::new(T::ONE, T::ONE)), None);
        let h = Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0).map(lit::<T>);
        assert_eq!(transfer(&h, &o, &o), None, "to infinity");
        assert_eq!(transfer_with_jacobian(&h, &o, &o), None);
        assert_eq!(symmetric_transfer_sq(&h, &h, &o, &o), None);
        let camera = Pinhole::new(lit::<T>(500.0), lit(500.0), lit(320.0), lit(240.0)).unwrap();
        let behind = -Vector3::<T>::z();
        assert_eq!(reprojection(&camera, &Pose::identity(), &behind, &o), None);
        assert_eq!(reprojection_with_jacobians(&camera, &Pose::identity(), &behind, &o), None);
    }

    fn any_bits_give_finite_answers<T>() {
        let mut accepted = [0usize; 6];
        for_each_case(50_000, |_, rng| {
            let vector = |rng: &mut Rng| Vector2::new(rng.any_bits::<T>(), rng.any_bits());
            let m = Matrix3::from_columns(&[rng.any_vector::<T>(), rng.any_vector(), rng.any_vector()]);
            let (u, v) = (vector(rng), vector(rng));
            let mut check = |which: usize, answer: Option<bool>| {
                if let Some(finite) = answer {
                    accepted[which] += 1;
                    assert!(finite, "{which}: {m:?} {u:?} {v:?}");
                }
            };
            let finite = |x: &T| x.to_f64().is_finite();
            check(0, sampson(&m, &u, &v).map(|r| finite(&r)));
            check(1, sampson_with_jacobian(&m, &u, &v).map(|(r, j)| finite(&r) && j.iter().all(finite)));
            check(2, symmetric_epipolar_sq(&m, &u, &v).map(|r| finite(&r)));
            check(3, transfer_with_jacobian(&m, &u, &v).map(|(r, j)| r.iter().chain(j.iter()).all(finite)));
            check(4, symmetric_transfer_sq(&m, &m, &u, &v).map(|r| finite(&r)));
            let camera = Pinhole::new(lit::<T>(500.0), lit(500.0), lit(320.0), lit(240.0)).unwrap();
            let w = rng.normal3().map(lit::<T>);
            let pose = Pose::from_parts(Translation3::from(rng.any_vector::<T>()), exp(&w));
            let r = reprojection_with_jacobians(&camera, &pose, &rng.any_vector(), &u);
            check(5, r.map(|r| r.residual.iter().chain(r.by_pose.iter()).chain(r.by_point.iter()).all(finite)));
            let (j1, j2) = (Matrix3x2::from_columns(&[rng.any_vector::<T>(), rng.any_vector()]), Matrix3x2::identity());
            let r = sampson_bearing(&m, &rng.any_vector(), &rng.any_vector(), &j1, &j2);
            assert!(r.is_none_or(|r| finite(&r)));
        });
        assert!(accepted.iter().all(|n| *n > 300), "too few accepted: {accepted:?}");
    }
}
