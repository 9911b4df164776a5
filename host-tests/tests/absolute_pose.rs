//! Solvers of absolute and upright pose: the truth, every solution's constraints, symmetries, degenerate inputs, any
//! bits.

use epipole::geometry::Pose;
use epipole::geometry::pose::{relative, upright};
use epipole::nalgebra::{Matrix3, Point3, Translation3, UnitQuaternion, Vector2, Vector3};
use epipole::real::lit;
use epipole::solvers::{
    absolute_orientation_npt, absolute_orientation_with_scale_npt, abspose_npt, abspose_planar,
    abspose_upright_2pt, decompose_projection, p3p, relpose_upright_3pt, resection_dlt, rotation_2pt,
    rotation_npt, translation_2pt, translation_npt,
};
use epipole::{InputError, Real};
use epipole_host_tests::matchers::{best, direction_error, pose_error, rotation_error, vector_f64};
use epipole_host_tests::scenes::{AbsoluteScene, Motion, Scene, Shape};
use epipole_host_tests::{for_each_case, in_both_scalars, share_of, tolerances};

fn scene(points: usize, seed: u64) -> AbsoluteScene {
    AbsoluteScene::generate(&Scene::new(Motion::General, points), seed)
}

fn first<T: Copy, const N: usize>(v: &[T]) -> [T; N] {
    std::array::from_fn(|i| v[i])
}

fn seen<T: Real>(pose: &Pose<T>, point: &Vector3<T>) -> Vector3<f64> {
    let q = UnitQuaternion::new_normalize(epipole::nalgebra::Quaternion::from(
        pose.rotation.coords.map(T::to_f64),
    ));
    q * vector_f64(point) + vector_f64(&pose.translation.vector)
}

/// The largest angle between a bearing and the point that the pose maps there, with a point at the camera's centre left
/// out; infinite for a pose that is not finite.
fn misfit<T: Real>(pose: &Pose<T>, bearings: &[Vector3<T>], points: &[Vector3<T>]) -> f64 {
    let errors = bearings.iter().zip(points).map(|(f, x)| direction_error(f, &seen(pose, x)));
    errors.fold(0.0, f64::max)
}

fn upright_pose(angle: f64, t: Vector3<f64>) -> Pose<f64> {
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
    Pose::from_parts(Translation3::from(t), rotation)
}

in_both_scalars! {
    fn p3p_recovers_the_pose<T>() {
        let wanted = if size_of::<T>() == 4 { 0.996 } else { 1.0 };
        share_of(3000, |seed, _| {
            let problem = scene(3, seed);
            let poses = p3p::<T>(&first(&problem.bearings()), &first(&problem.points()));
            let errors = poses.iter().map(|p| rotation_error(&p.rotation, &problem.pose.rotation));
            best(errors) < tolerances::SOLVED_ROTATION.of::<T>()
        })
        .assert_at_least(wanted);
    }

    fn p3p_solutions_see_the_points<T>() {
        for_each_case(2000, |seed, _| {
            let problem = scene(3, seed);
            let (bearings, points) = (first(&problem.bearings::<T>()), first(&problem.points::<T>()));
            for pose in p3p(&bearings, &points) {
                let error = misfit(&pose, &bearings, &points);
                assert!(error < tolerances::SOLVED_BEARING.of::<T>(), "{error:e}");
            }
        });
    }

    fn p3p_knows_no_order_and_no_world<T>() {
        share_of(500, |seed, rng| {
            let problem = scene(3, seed);
            let (f, x): ([Vector3<T>; 3], [Vector3<T>; 3]) = (first(&problem.bearings()), first(&problem.points()));
            let plain = p3p(&f, &x);
            let permuted = p3p(&[f[2], f[0], f[1]], &[x[2], x[0], x[1]]);
            let turn: UnitQuaternion<f64> = rng.rotation(3.0);
            let world = turn.cast_to::<T>();
            let moved = p3p(&f, &x.map(|x| world * x));
            plain.len() == permuted.len()
                && plain.len() == moved.len()
                && plain.iter().all(|a| {
                    let back = |b: &Pose<T>| b.rotation * world;
                    best(permuted.iter().map(|b| rotation_error(&a.rotation, &b.rotation))) < 1e-3
                        && best(moved.iter().map(|b| rotation_error(&a.rotation, &back(b)))) < 1e-3
                })
        })
        // A pair of solutions that merge may round to one, to two or to none.
        .assert_at_least(0.98);
    }

    fn p3p_degenerate_inputs<T>() {
        let v = |x: f64, y: f64, z: f64| Vector3::<T>::new(lit(x), lit(y), lit(z));
        let unit = |x: &Vector3<T>| x.map(T::to_f64).normalize().map(lit::<T>);
        let x = [v(1.0, 0.0, 4.0), v(-1.0, 0.5, 5.0), v(0.2, -1.0, 3.0)];
        let f = x.map(|x| unit(&x));
        // No three distinct points, or all on a line.
        assert!(p3p(&f, &[x[0]; 3]).is_empty());
        assert!(p3p(&f, &[x[0], x[0], x[1]]).is_empty());
        let line = [v(0.0, 0.0, 4.0), v(1.0, 0.0, 5.0), v(2.0, 0.0, 6.0)];
        assert!(p3p(&line.map(|x| unit(&x)), &line).is_empty());
        // Two equal bearings: one point behind the other. All equal: no triangle fits.
        let hidden = [v(0.5, 0.5, 4.0), v(1.0, 1.0, 8.0), v(0.2, -1.0, 3.0)];
        let g = hidden.map(|x| unit(&x));
        assert!(p3p(&g, &hidden).iter().all(|pose| misfit(pose, &g, &hidden) < 1e-2));
        assert!(p3p(&[f[0]; 3], &x).is_empty());
        // A point at the camera's centre has no bearing; at depth zero it has one like any other.
        let centre = [v(0.0, 0.0, 0.0), x[1], x[2]];
        for pose in p3p(&[v(0.0, 0.0, 1.0), f[1], f[2]], &centre) {
            assert!(misfit(&pose, &[f[1], f[2]], &centre[1..]) < 1e-2);
        }
        let beside = [v(3.0, 1.0, 0.0), x[1], x[2]];
        let poses = p3p(&beside.map(|x| unit(&x)), &beside);
        assert!(best(poses.iter().map(|p| rotation_error(&p.rotation, &UnitQuaternion::<f64>::identity()))) < 1e-3);
        // The danger cylinder: its circle through the points contains the centre, two solutions merge.
        let circle = |a: f64, h: f64| v(2.0 * a.sin(), h, 2.0 - 2.0 * a.cos());
        let danger = [circle(1.0, 0.3), circle(2.5, 0.3), circle(4.0, 0.3)];
        let g = danger.map(|x| unit(&x));
        let poses = p3p(&g, &danger);
        assert!(poses.iter().all(|pose| misfit(pose, &g, &danger) < 0.05));
        // The same triangle seen frontally: the cubic's leading coefficient is zero.
        let frontal = [v(0.0, 1.0, 5.0), v(-0.8, -0.6, 5.0), v(0.8, -0.6, 5.0)];
        for k in 0..3 {
            let points: [Vector3<T>; 3] = std::array::from_fn(|i| frontal[(i + k) % 3]);
            let poses = p3p(&points.map(|x| unit(&x)), &points);
            let errors = poses.iter().map(|p| rotation_error(&p.rotation, &UnitQuaternion::<f64>::identity()));
            assert!(best(errors) < tolerances::SOLVED_ROTATION.of::<T>(), "{k}");
        }
    }

    fn solvers_take_any_bits<T>() {
        let special =
            [T::ZERO, lit(f64::NAN), lit(f64::INFINITY), T::MIN_POSITIVE * T::EPSILON, T::MAX, -T::MAX, lit(1e-20), lit(1e20)];
        for_each_case(400, |seed, rng| {
            let problem = scene(3, seed);
            let (mut f, mut x): ([Vector3<T>; 3], [Vector3<T>; 3]) =
                (first(&problem.bearings()), first(&problem.points()));
            let value = special[rng.index(special.len())];
            let (i, k) = (rng.index(3), rng.index(3));
            if rng.index(2) == 0 { f[i][k] = value } else { x[i][k] = value }
            let finite = |pose: &Pose<T>| pose.to_homogeneous().iter().all(|v| v.to_f64().is_finite());
            assert!(p3p(&f, &x).iter().all(finite));
            assert!(relpose_upright_3pt(&f, &x).iter().all(finite));
            let (f2, x2) = (first::<_, 2>(&f), first::<_, 2>(&x));
            assert!(abspose_upright_2pt(&f2, &x2).iter().all(finite));
            let _ = (rotation_2pt(&f2, &x2), translation_2pt(&UnitQuaternion::identity(), &f2, &x2));
        });
    }

    fn scale_is_free<T>() {
        let scales: [f64; 2] = if size_of::<T>() == 4 { [1e-6, 1e6] } else { [1e-60, 1e60] };
        share_of(300, |seed, _| {
            let problem = scene(3, seed);
            let f = first(&problem.bearings::<T>());
            let x: [Vector3<T>; 3] = first(&problem.points());
            scales.iter().all(|&s| {
                let poses = p3p(&f, &x.map(|x| x * lit::<T>(s)));
                let two = abspose_upright_2pt(&first(&f), &first(&x.map(|x| x * lit::<T>(s))));
                let plain = abspose_upright_2pt::<T>(&first(&f), &first(&x));
                best(poses.iter().map(|p| rotation_error(&p.rotation, &problem.pose.rotation))) < 1e-2
                    && two.len() == plain.len()
            })
        })
        .assert_at_least(0.98);
    }

    fn upright_absolute_pose<T>() {
        share_of(2000, |seed, rng| {
            let two = Scene::new(Motion::General, 2).generate(seed);
            let pose = upright_pose(rng.range(-3.1, 3.1), rng.normal3());
            let camera: Vec<Vector3<f64>> = two.points.clone();
            let points: Vec<Vector3<T>> =
                camera.iter().map(|p| (pose.inverse() * Point3::from(*p)).coords.map(lit)).collect();
            let bearings: Vec<Vector3<T>> = camera.iter().map(|p| p.normalize().map(lit)).collect();
            let found = abspose_upright_2pt::<T>(&first(&bearings), &first(&points));
            assert!(found.iter().all(|p| misfit(p, &bearings, &points) < 0.02));
            best(found.iter().map(|p| rotation_error(&p.rotation, &pose.rotation)))
                < tolerances::SOLVED_ROTATION.of::<T>()
        })
        // Two points whose horizontal distance is tiny do not fix the heading in f32.
        .assert_at_least(if size_of::<T>() == 4 { 0.995 } else { 1.0 });
        // Any rotation fits a point above the other; two horizontal bearings fix no distance.
        let v = |x: f64, y: f64, z: f64| Vector3::<T>::new(lit(x), lit(y), lit(z));
        let pole = [v(1.0, 0.0, 4.0), v(1.0, 2.0, 4.0)];
        assert!(abspose_upright_2pt(&pole, &pole).is_empty());
        let level = [v(1.0, 0.0, 4.0), v(-1.0, 0.0, 3.0)];
        assert!(abspose_upright_2pt(&level, &level).is_empty());
        assert!(abspose_upright_2pt(&[pole[0]; 2], &[pole[0]; 2]).is_empty());
    }

    fn upright_relative_pose<T>() {
        share_of(2000, |seed, _| {
            let problem = Scene::new(Motion::Upright, 3).generate(seed);
            let (x1, x2) = problem.bearings::<T>();
            let poses = relpose_upright_3pt::<T>(&first(&x1), &first(&x2));
            for pose in poses.iter() {
                // Epipolar constraint, and rotation about y.
                let t = vector_f64(&pose.translation.vector);
                for (a, b) in x1.iter().zip(&x2) {
                    let y = vector_f64(&(pose.rotation * a));
                    assert!(t.cross(&y).dot(&vector_f64(b)).abs() < tolerances::UPRIGHT_EPIPOLAR.of::<T>());
                }
                assert!(pose.rotation.i == T::ZERO && pose.rotation.k == T::ZERO);
            }
            best(poses.iter().map(|p| pose_error(p, &problem.pose).0)) < tolerances::SOLVED_ROTATION.of::<T>()
        })
        .assert_at_least(if size_of::<T>() == 4 { 0.997 } else { 1.0 });
        let x = first::<_, 3>(&Scene::new(Motion::Upright, 3).generate(1).bearings::<T>().0);
        // No motion, and three equal bearings.
        assert!(relpose_upright_3pt(&x, &x).is_empty());
        assert!(relpose_upright_3pt(&[x[0]; 3], &[x[1]; 3]).is_empty());
    }

    fn upright_frames<T>() {
        for_each_case(200, |_, rng| {
            let g: Vector3<T> = (rng.direction() * rng.range(0.1, 20.0)).map(lit);
            let turn = upright(&g).expect("a direction");
            assert!(direction_error(&(turn * g), &Vector3::<f64>::y()) < tolerances::ROTATION.of::<T>());
            let square = turn * turn.transpose() - Matrix3::identity();
            assert!(square.iter().all(|v| v.to_f64().abs() < tolerances::ROTATION.of::<T>()));
            assert!(turn.determinant() > T::ZERO);
        });
        assert!(upright(&Vector3::<T>::zeros()).is_none());
        assert!(upright(&Vector3::<T>::new(lit(f64::NAN), T::ONE, T::ZERO)).is_none());
        let down = upright(&-Vector3::<T>::y()).expect("a direction");
        assert_eq!(down * -Vector3::<T>::y(), Vector3::y());
    }

    fn any_number_of_points<T>() {
        for shape in [Shape::Volume, Shape::Plane] {
            for count in [4, 6, 20] {
                share_of(100, |seed, _| {
                    let problem = AbsoluteScene::generate(&Scene::new(Motion::General, count).shape(shape), seed);
                    let (f, x) = (problem.bearings::<T>(), problem.points::<T>());
                    let poses = abspose_npt(&f, &x).expect("finite");
                    assert!(poses.iter().all(|p| p.to_homogeneous().iter().all(|v| v.to_f64().is_finite())));
                    poses.first().is_some_and(|p| {
                        rotation_error(&p.rotation, &problem.pose.rotation) < tolerances::SOLVED_ROTATION.of::<T>()
                    })
                })
                .assert_at_least(if count == 4 { 0.97 } else { 1.0 });
            }
        }
        let problem = scene(8, 3);
        let (mut f, x) = (problem.bearings::<T>(), problem.points::<T>());
        assert_eq!(abspose_npt(&f[..3], &x[..3]), Err(InputError::TooFew { given: 3, needed: 4 }));
        assert_eq!(abspose_npt(&f[..5], &x), Err(InputError::LengthMismatch { first: 5, second: 8 }));
        assert_eq!(abspose_npt(&f, &[x[0]; 8]).map(|p| p.len()), Ok(0));
        f[6].y = lit(f64::NAN);
        assert_eq!(abspose_npt(&f, &x), Err(InputError::NotFinite { array: 0, index: 6 }));
    }

    fn a_planar_target_has_two_poses<T>() {
        let square = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let mut two = 0;
        for_each_case(200, |_, rng| {
            let rotation = rng.rotation(1.0);
            let t = Vector3::new(rng.range(-2.0, 2.0), rng.range(-2.0, 2.0), rng.range(8.0, 30.0));
            let truth = Pose::from_parts(Translation3::from(t), rotation);
            let corners = square.map(|c| Vector2::<T>::new(lit(c[0]), lit(c[1])));
            let bearings = square.map(|c| (truth * Point3::new(c[0], c[1], 0.0)).coords.map(lit::<T>));
            let poses = abspose_planar(&bearings, &corners).expect("finite");
            let tolerance = if size_of::<T>() == 4 { 0.02 } else { 1e-6 };
            assert!(rotation_error(&poses[0].pose.rotation, &rotation) < tolerance);
            if poses.len() == 2 {
                two += 1;
                assert!(poses[0].rms_rad <= poses[1].rms_rad);
                // The second normal is mirrored in the line of sight, roughly.
                let normal = |p: &Pose<T>| vector_f64(&(p.rotation * Vector3::z()));
                let (a, b, s) = (normal(&poses[0].pose), normal(&poses[1].pose), t.normalize());
                assert!((a.dot(&s) - b.dot(&s)).abs() < 0.5);
            }
        });
        assert!(two > 120 || std::env::var("EPIPOLE_SEED").is_ok(), "{two}");
    }

    fn rotation_alone<T>() {
        for_each_case(500, |_, rng| {
            let truth = rng.rotation(3.1);
            let x1: Vec<Vector3<f64>> = (0..6).map(|_| rng.direction() * rng.range(0.1, 9.0)).collect();
            let a: Vec<Vector3<T>> = x1.iter().map(|x| x.map(lit)).collect();
            let b: Vec<Vector3<T>> = x1.iter().map(|x| (truth * x).map(lit)).collect();
            let all = rotation_npt(&a, &b).expect("finite").expect("spread");
            assert!(rotation_error(&all, &truth) < tolerances::ROTATION.of::<T>());
            let sine = x1[0].normalize().cross(&x1[1].normalize()).norm();
            let two = rotation_2pt(&first(&a), &first(&b)).expect("two directions");
            assert!(rotation_error(&two, &truth) < tolerances::ROTATION.of::<T>() / sine);
            // The two agree: least squares over two bearings is the symmetric construction.
            let same = rotation_npt(&a[..2], &b[..2]).expect("finite").expect("two directions");
            assert!(rotation_error(&two, &same) < tolerances::ROTATION.of::<T>() / sine);
        });
        let v = Vector3::<T>::x();
        assert!(rotation_2pt(&[v, v], &[v, Vector3::y()]).is_none());
        assert!(rotation_2pt(&[v, -v], &[v, Vector3::y()]).is_none());
        assert_eq!(rotation_npt(&[v, v, v], &[v, v, v]), Ok(None));
        assert_eq!(rotation_npt(&[v], &[v]), Err(InputError::TooFew { given: 1, needed: 2 }));
    }

    fn translation_alone<T>() {
        share_of(500, |seed, _| {
            let problem = Scene::new(Motion::General, 8).generate(seed);
            let (x1, x2) = problem.bearings::<T>();
            let rotation = problem.pose.rotation.cast_to::<T>();
            let all = translation_npt(&rotation, &x1, &x2).expect("finite");
            let two = translation_2pt(&rotation, &first(&x1), &first(&x2));
            let error = |t: Option<Vector3<T>>| {
                t.map_or(f64::INFINITY, |t| direction_error(&t, &problem.pose.translation.vector))
            };
            error(all) < tolerances::SOLVED_ROTATION.of::<T>() && error(two) < 1e-2
        })
        .assert_at_least(0.99);
        let x: Vec<Vector3<T>> = scene(5, 1).bearings();
        let still = UnitQuaternion::<T>::identity();
        assert_eq!(translation_npt(&still, &x, &x), Ok(None));
        assert_eq!(translation_2pt(&still, &first(&x), &first(&x)), None);
    }

    fn orientation_in_space<T>() {
        for_each_case(300, |_, rng| {
            let truth = Pose::from_parts(Translation3::from(rng.normal3()), rng.rotation(3.1));
            let scale = rng.range(0.1, 10.0);
            let a: Vec<Vector3<f64>> = (0..5).map(|_| rng.normal3()).collect();
            let to = |v: &Vector3<f64>| v.map(lit::<T>);
            let b: Vec<_> = a.iter().map(|x| to(&(truth * Point3::from(*x)).coords)).collect();
            let c: Vec<_> = a.iter().map(|x| to(&((truth.rotation * x) * scale + truth.translation.vector))).collect();
            let a: Vec<_> = a.iter().map(to).collect();
            let rigid = absolute_orientation_npt(&a, &b).expect("finite").expect("spread");
            let similar = absolute_orientation_with_scale_npt(&a, &c).expect("finite").expect("spread");
            let tolerance = 20.0 * tolerances::ROTATION.of::<T>();
            assert!(rotation_error(&rigid.rotation, &truth.rotation) < tolerance);
            assert!(rotation_error(&similar.isometry.rotation, &truth.rotation) < tolerance);
            assert!((similar.scaling().to_f64() / scale - 1.0).abs() < tolerance);
            // A mirror image still gets a rotation.
            let mirrored: Vec<_> = a.iter().map(|x| Vector3::new(-x.x, x.y, x.z)).collect();
            if let Some(pose) = absolute_orientation_npt(&a, &mirrored).expect("finite") {
                assert!(pose.rotation.to_rotation_matrix().matrix().determinant() > T::ZERO);
            }
        });
        let line: Vec<Vector3<T>> = (0..4).map(|i| Vector3::new(T::ONE, T::TWO, T::ONE) * lit::<T>(i as f64)).collect();
        assert_eq!(absolute_orientation_npt(&line, &line), Ok(None));
        assert_eq!(absolute_orientation_with_scale_npt(&[Vector3::<T>::x(); 3], &[Vector3::y(); 3]), Ok(None));
    }

    fn resection_of_an_unknown_camera<T>() {
        share_of(200, |seed, _| {
            let problem = scene(12, seed);
            let (pixels, points) = (problem.pixels::<T>(), problem.points::<T>());
            let Ok(Some(p)) = resection_dlt(&pixels, &points) else { return false };
            let Some(parts) = decompose_projection(&p) else { return false };
            // The sign and scale of P say nothing but which side is in front.
            let other = decompose_projection(&(p * lit::<T>(3.0))).expect("as before");
            assert!(rotation_error(&other.pose.rotation, &parts.pose.rotation) < tolerances::ROTATION.of::<T>());
            let focal = parts.calibration[(0, 0)].to_f64();
            rotation_error(&parts.pose.rotation, &problem.pose.rotation) < 10.0 * tolerances::SOLVED_ROTATION.of::<T>()
                && (focal / epipole_host_tests::scenes::FOCAL - 1.0).abs() < 0.02
        })
        .assert_at_least(if size_of::<T>() == 4 { 0.95 } else { 1.0 });
        let plane = AbsoluteScene::generate(&Scene::new(Motion::General, 12).shape(Shape::Plane), 5);
        assert_eq!(resection_dlt(&plane.pixels::<T>(), &plane.points()), Ok(None));
        assert_eq!(
            resection_dlt(&plane.pixels::<T>()[..5], &plane.points()[..5]),
            Err(InputError::TooFew { given: 5, needed: 6 })
        );
    }
}

/// A rotation rounded to another scalar.
trait CastTo {
    fn cast_to<T: Real>(&self) -> UnitQuaternion<T>;
}

impl CastTo for UnitQuaternion<f64> {
    fn cast_to<T: Real>(&self) -> UnitQuaternion<T> {
        UnitQuaternion::new_unchecked(epipole::nalgebra::Quaternion::from(self.coords.map(lit::<T>)))
    }
}

#[test]
fn relative_of_two_upright_poses_is_upright() {
    let (a, b) = (upright_pose(0.3, Vector3::x()), upright_pose(-1.2, Vector3::z()));
    let between = relative(&a, &b);
    assert!(between.rotation.i.abs() < 1e-15 && between.rotation.k.abs() < 1e-15);
}
