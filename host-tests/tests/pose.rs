//! The algebra of poses, by regime: near 0, small, in between, near pi, above pi.

use std::f64::consts::PI;

use epipole::Real;
use epipole::geometry::Pose;
use epipole::geometry::pose::{
    centre, exp, from_parts, left_jacobian, log, nearest_rotation, quaternion_from_matrix, relative, retract,
    rotation_angle, skew, tangent_basis, vector_angle,
};
use epipole::nalgebra::{Matrix3, Matrix3x2, Quaternion, Translation3, UnitQuaternion, Vector3, Vector6};
use epipole::real::lit;
use epipole_host_tests::matchers::{matrix_f64, rotation_error, rotation_matrix_error, vector_f64};
use epipole_host_tests::{Rng, for_each_case, in_both_scalars, tolerances};

/// Angles of a rotation vector, each with the regime's name.
const REGIMES: [(&str, f64, f64); 7] = [
    ("Zero", 0.0, 0.0),
    ("NearZero", 1e-12, 1e-3),
    ("Small", 1e-3, 0.999),
    ("AtTheSeriesEnd", 0.9999, 1.0001),
    ("Medium", 1.0, 3.0),
    ("NearPi", PI - 1e-3, PI - 1e-5),
    ("VeryNearPi", PI - 1e-6, PI - 1e-7),
];

/// Rotation vectors of every regime.
fn for_each_rotation<T: Real>(count: u64, mut case: impl FnMut(&str, Vector3<T>, &mut Rng)) {
    for (name, low, high) in REGIMES {
        for_each_case(count, |_, rng| {
            let w = rng.direction() * rng.range(low, high);
            case(name, w.map(lit), rng);
        });
    }
}

fn oracle(w: &Vector3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(*w)
}

fn quaternion<T: Real>(rng: &mut Rng, max_rad: f64) -> UnitQuaternion<T> {
    let q = rng.rotation(max_rad);
    UnitQuaternion::new_unchecked(Quaternion::new(lit(q.w), lit(q.i), lit(q.j), lit(q.k)))
}

fn pose<T: Real>(rng: &mut Rng) -> Pose<T> {
    Pose::from_parts(Translation3::from((rng.normal3() * 3.0).map(lit::<T>)), quaternion(rng, PI))
}

in_both_scalars! {
    /// nalgebra's exponential in `f64` of the same rounded vector is the oracle.
    fn exp_is_right<T>() {
        for_each_rotation::<T>(200, |name, w, _| {
            let error = rotation_error(&exp(&w), &oracle(&vector_f64(&w)));
            assert!(error < tolerances::ROTATION.of::<T>(), "{name} {w:?}: {error}");
            let norm = exp(&w).coords.map(T::to_f64).norm();
            assert!((norm - 1.0).abs() < tolerances::ROUNDING.of::<T>(), "{name}: {norm}");
        });
        for_each_case(200, |_, rng| {
            let w = (rng.direction() * rng.range(PI, 50.0)).map(lit::<T>);
            let error = rotation_error(&exp(&w), &oracle(&vector_f64(&w)));
            assert!(error < 10.0 * tolerances::ROTATION.of::<T>(), "AbovePi {w:?}: {error}");
        });
    }

    /// Relative to the vector, also near 0.
    fn log_inverts_exp<T>() {
        for_each_rotation::<T>(200, |name, w, _| {
            let back = log(&exp(&w));
            let (a, b) = (vector_f64(&back), vector_f64(&w));
            // Rounding may have carried an angle past pi, where the axis changes sign.
            let at_pi = b.norm() > PI - 8.0 * T::EPSILON.to_f64();
            let error = if at_pi { (a - b).norm().min((a + b).norm()) } else { (a - b).norm() };
            let error = error / b.norm().max(1e-300);
            assert!(error < tolerances::ROTATION.of::<T>(), "{name} {w:?} {back:?}: {error}");
            let negated = log(&UnitQuaternion::new_unchecked(-exp(&w).into_inner()));
            assert_eq!(negated, back, "{name}: q and -q are one rotation");
        });
    }

    fn log_is_at_most_pi<T>() {
        for_each_case(1000, |_, rng| {
            let w = log(&quaternion::<T>(rng, 2.0 * PI));
            assert!(vector_f64(&w).norm() <= PI + 2.0 * tolerances::ROTATION.of::<T>());
        });
        let half_turn = UnitQuaternion::new_unchecked(Quaternion::new(T::ZERO, T::ZERO, T::ONE, T::ZERO));
        assert!((log(&half_turn).y.to_f64() - PI).abs() < tolerances::ROTATION.of::<T>());
        assert_eq!(log(&UnitQuaternion::<T>::identity()), Vector3::zeros());
    }

    fn left_jacobian_is_the_difference<T>() {
        for_each_rotation::<T>(50, |name, w, _| {
            let analytic = matrix_f64(&left_jacobian(&w));
            let w = vector_f64(&w);
            let h = 1e-5;
            let difference = Matrix3::from_columns(&[0, 1, 2].map(|k| {
                let step = Vector3::ith(k, h);
                (oracle(&(w + step)) * oracle(&(w - step)).inverse()).scaled_axis() / (2.0 * h)
            }));
            let error = (analytic - difference).amax();
            assert!(error < tolerances::JACOBIAN.of::<T>(), "{name} {w:?}: {error}");
        });
    }

    fn retract_is_a_rotation_from_the_left<T>() {
        for_each_rotation::<T>(50, |name, w, rng| {
            let (pose, dt) = (pose::<T>(rng), rng.normal3().map(lit::<T>));
            let moved = retract(&pose, &Vector6::new(w.x, w.y, w.z, dt.x, dt.y, dt.z));
            let expected = oracle(&vector_f64(&w)) * pose.rotation.cast_f64();
            let error = rotation_error(&moved.rotation, &expected);
            assert!(error < tolerances::ROTATION.of::<T>(), "{name} {w:?}: {error}");
            assert_eq!(moved.translation.vector, pose.translation.vector + dt);
        });
        // A thousand steps do not drift from unit length.
        let step = Vector6::new(lit(0.01), lit(-0.02), lit(0.015), T::ZERO, T::ZERO, T::ZERO);
        let mut pose = Pose::<T>::identity();
        for _ in 0..1000 {
            pose = retract(&pose, &step);
        }
        let norm = pose.rotation.coords.map(T::to_f64).norm();
        assert!((norm - 1.0).abs() < tolerances::ROUNDING.of::<T>());
    }

    fn relative_pose_maps_view_1_to_view_2<T>() {
        for_each_case(200, |_, rng| {
            let (first, second, point) = (pose::<T>(rng), pose::<T>(rng), rng.normal3().map(lit::<T>));
            let image = |pose: &Pose<T>, p: &Vector3<T>| pose.rotation * p + pose.translation.vector;
            let error = image(&relative(&first, &second), &image(&first, &point)) - image(&second, &point);
            assert!(vector_f64(&error).norm() < 30.0 * tolerances::ROTATION.of::<T>());
            let error = image(&first, &centre(&first));
            assert!(vector_f64(&error).norm() < 30.0 * tolerances::ROTATION.of::<T>());
        });
    }

    /// An arc cosine would lose half of the digits near 0 and pi.
    fn rotation_angle_is_exact_at_any_angle<T>() {
        for_each_rotation::<T>(100, |name, w, rng| {
            let angle = vector_f64(&w).norm();
            let from_identity = rotation_angle(&UnitQuaternion::identity(), &exp(&w)).to_f64();
            // Relative: of tiny angles the chord keeps every digit that the quaternion's vector part has.
            let bound = tolerances::ROTATION.of::<T>();
            assert!((from_identity - angle).abs() <= bound * angle, "{name} {w:?}: {from_identity}");
            let a = quaternion::<T>(rng, PI);
            let b = UnitQuaternion::new_unchecked(-(a * exp(&w)).into_inner());
            let error = (rotation_angle(&a, &b).to_f64() - angle).abs();
            assert!(error < 2.0 * bound, "{name} {w:?}: {error}");
            let v = Vector3::new(T::ONE, T::ZERO, T::ZERO);
            let error = (vector_angle(&v, &(exp(&Vector3::new(T::ZERO, T::ZERO, lit(angle))) * v)).to_f64() - angle).abs();
            assert!(error < bound, "{name}: {error}");
        });
    }

    fn matrix_and_quaternion_are_one_rotation<T>() {
        for_each_rotation::<T>(100, |name, w, rng| {
            let q = exp(&w) * quaternion::<T>(rng, 1e-3);
            let r = q.to_rotation_matrix().into_inner();
            let error = rotation_error(&quaternion_from_matrix(&r), &q);
            assert!(error < tolerances::ROTATION.of::<T>(), "{name} {w:?}: {error}");
            let t = Vector3::new(T::ONE, T::TWO, T::HALF);
            assert_eq!(from_parts(&r, &t), Pose::from_parts(Translation3::from(t), quaternion_from_matrix(&r)));
        });
    }

    fn skew_is_the_cross_product<T>() {
        for_each_case(20, |_, rng| {
            let (a, b) = (rng.normal3().map(lit::<T>), rng.normal3().map(lit::<T>));
            assert!(vector_f64(&(skew(&a) * b - a.cross(&b))).norm() < tolerances::ROUNDING.of::<T>());
        });
    }

    /// Orthonormal and right-handed everywhere, the pole included.
    fn tangent_basis_is_orthonormal<T>() {
        let pole = Vector3::new(-2.0, -1.0, -2.0) / 3.0;
        let special = [Vector3::x(), Vector3::y(), Vector3::z(), pole, -pole];
        for_each_case(500, |_, rng| {
            let n = match rng.index(4) {
                0 => special[rng.index(5)] * [1.0, -1.0][rng.index(2)],
                1 => (pole + rng.normal3() * 10f64.powf(rng.range(-17.0, -1.0))).normalize(),
                _ => rng.direction(),
            };
            let n = n.map(lit::<T>);
            let basis: Matrix3x2<f64> = tangent_basis(&n).map(T::to_f64);
            let frame = Matrix3::from_columns(&[basis.column(0).into(), basis.column(1).into(), vector_f64(&n)]);
            let error = (frame.transpose() * frame - Matrix3::identity()).amax();
            assert!(error < tolerances::ROUNDING.of::<T>(), "{n:?}: {error}");
            assert!(frame.determinant() > 0.0);
        });
    }

    /// Also where all that is left of the difference from the pole is rounding.
    fn tangent_basis_is_orthonormal_a_rounding_from_the_pole<T>() {
        let pole = Vector3::new(-2.0, -1.0, -2.0) / 3.0;
        let unit = T::EPSILON.to_f64() / 4.0;
        let steps = || (-8..=8).map(|k| unit * f64::from(k));
        for n in steps().flat_map(|x| steps().flat_map(move |y| steps().map(move |z| Vector3::new(x, y, z)))) {
            let n = (pole + n).map(lit::<T>);
            if (vector_f64(&n).norm() - 1.0).abs() > T::EPSILON.to_f64() {
                continue;
            }
            let basis: Matrix3x2<f64> = tangent_basis(&n).map(T::to_f64);
            let frame = Matrix3::from_columns(&[basis.column(0).into(), basis.column(1).into(), vector_f64(&n)]);
            let error = (frame.transpose() * frame - Matrix3::identity()).amax();
            assert!(error < tolerances::ROUNDING.of::<T>(), "{n:?}: {error}");
        }
    }

    /// The basis turns by no more than a few times the angle by which a direction away from the pole turns.
    fn tangent_basis_is_continuous_but_at_the_pole<T>() {
        let pole = Vector3::new(-2.0, -1.0, -2.0) / 3.0;
        for_each_case(500, |_, rng| {
            let n = rng.direction();
            let distance = (n - pole).norm();
            if distance < 0.05 {
                return;
            }
            let step = 1e-3;
            let near = (n + rng.direction() * step).normalize();
            let change = (tangent_basis(&n.map(lit::<T>)) - tangent_basis(&near.map(lit::<T>))).map(T::to_f64);
            assert!(change.norm() < 8.0 * step / distance, "{n:?}: {}", change.norm());
        });
    }

    fn nearest_rotation_recovers_a_disturbed_one<T>() {
        for_each_case(200, |_, rng| {
            let r = rng.rotation(PI).to_rotation_matrix().into_inner();
            // A symmetric positive factor on the right leaves the nearest rotation as it is.
            let a = Matrix3::from_columns(&[rng.normal3(), rng.normal3(), rng.normal3()]) * 0.3;
            let stretched = (r * (Matrix3::identity() + a * a.transpose())).map(lit::<T>);
            let nearest = nearest_rotation(&stretched).unwrap();
            assert!(rotation_matrix_error(&nearest, &r) < 5.0 * tolerances::ROTATION.of::<T>());
            assert!((matrix_f64(&nearest).determinant() - 1.0).abs() < tolerances::ROTATION.of::<T>());
        });
        // A reflection has a nearest rotation where its singular values differ, none where they do not.
        let diagonal = |d: [f64; 3]| Matrix3::from_diagonal(&Vector3::from(d.map(lit::<T>)));
        let r = nearest_rotation(&diagonal([3.0, 2.0, -1.0])).unwrap();
        assert!((matrix_f64(&r) - Matrix3::identity()).amax() < tolerances::ROTATION.of::<T>());
        for none in [[1.0, 1.0, -1.0], [1.0, 0.0, 0.0], [0.0; 3], [f64::NAN, 1.0, 1.0], [1.0, f64::INFINITY, 1.0]] {
            assert_eq!(nearest_rotation(&diagonal(none)), None, "{none:?}");
        }
    }

    fn any_bits_give_a_finite_nearest_rotation<T>() {
        for_each_case(20_000, |_, rng| {
            let m = Matrix3::from_columns(&[rng.any_vector::<T>(), rng.any_vector(), rng.any_vector()]);
            if let Some(r) = nearest_rotation(&m) {
                assert!(r.iter().all(|x| x.to_f64().is_finite()), "{m:?} {r:?}");
            }
            // Huge and tiny finite vectors have a rotation too.
            let w = rng.any_vector::<T>();
            if w.iter().all(|x| x.to_f64().is_finite()) && vector_f64(&w).amax() < T::MAX.to_f64() / 2.0 {
                let norm = exp(&w).coords.map(T::to_f64).norm();
                assert!((norm - 1.0).abs() < tolerances::ROTATION.of::<T>(), "{w:?}: {norm}");
            }
        });
    }
}

/// The quaternion in `f64`, not normalised anew.
trait CastF64 {
    fn cast_f64(&self) -> UnitQuaternion<f64>;
}

impl<T: Real> CastF64 for UnitQuaternion<T> {
    fn cast_f64(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::new_unchecked(Quaternion::from(self.coords.map(T::to_f64)))
    }
}
