//! Solvers of absolute pose, rotation and translation at their limits: extreme scales, any order of the points, and a
//! table of degenerate inputs for each.

use epipole::geometry::Pose;
use epipole::nalgebra::{Point3, Translation3, UnitQuaternion, Vector2, Vector3};
use epipole::real::lit;
use epipole::solvers::{
    abspose_npt, abspose_planar, abspose_upright_2pt, decompose_projection, relpose_upright_3pt,
    resection_dlt, rotation_2pt, rotation_npt, translation_2pt, translation_npt,
};
use epipole::{InputError, Real};
use epipole_host_tests::matchers::{best, direction_error, pose_error, rotation_error};
use epipole_host_tests::scenes::{AbsoluteScene, Motion, Scene};
use epipole_host_tests::{for_each_case, in_both_scalars, share_of, tolerances};

fn scene(points: usize, seed: u64) -> AbsoluteScene {
    AbsoluteScene::generate(&Scene::new(Motion::General, points), seed)
}

fn first<T: Copy, const N: usize>(v: &[T]) -> [T; N] {
    std::array::from_fn(|i| v[i])
}

fn v<T: Real>(x: f64, y: f64, z: f64) -> Vector3<T> {
    Vector3::new(lit(x), lit(y), lit(z))
}

/// In another order.
fn reordered<T: Copy>(v: &[T], order: &[usize]) -> Vec<T> {
    order.iter().map(|&i| v[i]).collect()
}

/// Factors at which squares are still numbers, and their fourth powers are not all.
fn scales<T: Real>() -> [f64; 2] {
    if size_of::<T>() == 4 { [1e-9, 1e9] } else { [1e-60, 1e60] }
}

fn finite<T: Real>(pose: &Pose<T>) -> bool {
    pose.to_homogeneous().iter().all(|x| x.to_f64().is_finite())
}

fn rounded<T: Real>(q: &UnitQuaternion<f64>) -> UnitQuaternion<T> {
    UnitQuaternion::new_unchecked(epipole::nalgebra::Quaternion::from(q.coords.map(lit::<T>)))
}

/// A square target seen from in front, and the bearings of its corners.
fn target<T: Real>(rotation: &UnitQuaternion<f64>, scale: f64) -> (Vec<Vector3<T>>, Vec<Vector2<T>>) {
    let pose = Pose::from_parts(Translation3::new(0.4, -0.3, 9.0), *rotation);
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [0.2, 0.5]];
    let bearings = corners.map(|c| (pose * Point3::new(c[0], c[1], 0.0)).coords.map(lit)).to_vec();
    (bearings, corners.map(|c| Vector2::new(lit(c[0] * scale), lit(c[1] * scale))).to_vec())
}

in_both_scalars! {
    /// The unit of the world and the lengths of the bearings mean nothing.
    fn scale_means_nothing<T>() {
        for scale in scales::<T>() {
            let s = lit::<T>(scale);
            // Of bearings the solvers take products of two or four.
            let b = lit::<T>(if scale < 1.0 { scale.powf(0.25) } else { scale.sqrt().sqrt() });
            share_of(100, |seed, rng| {
                let problem = scene(8, seed);
                let (f, x) = (problem.bearings::<T>(), problem.points::<T>());
                let f: Vec<_> = f.iter().map(|f| f * b).collect();
                let x: Vec<_> = x.iter().map(|x| x * s).collect();
                let close = |q: &UnitQuaternion<T>| rotation_error(q, &problem.pose.rotation) < 1e-3;
                let npt = abspose_npt(&f, &x).expect("finite");
                let turn = rng.rotation(0.5);
                let (corners, points) = target::<T>(&turn, scale);
                let planar = abspose_planar(&corners, &points).expect("finite");
                npt.first().is_some_and(|p| close(&p.rotation))
                    && planar.first().is_some_and(|p| rotation_error(&p.pose.rotation, &turn) < 2e-2)
            })
            .assert_at_least(1.0);
            share_of(100, |seed, _| {
                let problem = scene(12, seed);
                let x: Vec<_> = problem.points::<T>().iter().map(|x| x * s).collect();
                let found = resection_dlt(&problem.pixels::<T>(), &x).expect("finite");
                let parts = found.and_then(|p| decompose_projection(&p));
                parts.is_some_and(|p| rotation_error(&p.pose.rotation, &problem.pose.rotation) < 1e-2)
            })
            .assert_at_least(if size_of::<T>() == 4 { 0.95 } else { 1.0 });
            share_of(100, |seed, _| {
                let problem = Scene::new(Motion::Upright, 8).generate(seed);
                let (x1, x2) = problem.bearings::<T>();
                let (x1, x2): (Vec<_>, Vec<_>) = (x1.iter().map(|x| x * b).collect(), x2.iter().map(|x| x * b).collect());
                let truth = problem.pose;
                let rotation = rounded::<T>(&truth.rotation);
                let along = |t: Option<Vector3<T>>| t.is_some_and(|t| direction_error(&t, &truth.translation.vector) < 1e-2);
                let y: Vec<_> = x1.iter().map(|x| rotation * x).collect();
                let turned = |q: Option<UnitQuaternion<T>>| q.is_some_and(|q| rotation_error(&q, &truth.rotation) < 1e-3);
                let three = relpose_upright_3pt(&first(&x1), &first(&x2));
                along(translation_npt(&rotation, &x1, &x2).expect("finite"))
                    && along(translation_2pt(&rotation, &first(&x1), &first(&x2)))
                    && turned(rotation_npt(&x1, &y).expect("finite"))
                    && turned(rotation_2pt(&first(&x1), &first(&y)))
                    && best(three.iter().map(|p| pose_error(p, &truth).0)) < 1e-3
            })
            .assert_at_least(0.97);
        }
    }

    /// The order of the points means nothing.
    fn order_means_nothing<T>() {
        let tolerance = tolerances::SOLVED_ROTATION.of::<T>();
        for_each_case(100, |seed, rng| {
            let problem = scene(9, seed);
            let order = rng.permutation(9);
            let (f, x, pixels) = (problem.bearings::<T>(), problem.points::<T>(), problem.pixels::<T>());
            let (g, y) = (reordered(&f, &order), reordered(&x, &order));
            let (a, b) = (abspose_npt(&f, &x).expect("finite"), abspose_npt(&g, &y).expect("finite"));
            assert!(rotation_error(&a[0].rotation, &b[0].rotation) < tolerance);
            let dlt = |pixels: &[Vector2<T>], x: &[Vector3<T>]| {
                resection_dlt(pixels, x).expect("finite").and_then(|p| decompose_projection(&p))
            };
            if let (Some(a), Some(b)) = (dlt(&pixels, &x), dlt(&reordered(&pixels, &order), &y)) {
                assert!(rotation_error(&a.pose.rotation, &b.pose.rotation) < 0.05);
            }
            let turn = rng.rotation(0.6);
            let (corners, points) = target::<T>(&turn, 1.0);
            let order = rng.permutation(5);
            let (a, b) = (
                abspose_planar(&corners, &points).expect("finite"),
                abspose_planar(&reordered(&corners, &order), &reordered(&points, &order)).expect("finite"),
            );
            assert!(rotation_error(&a[0].pose.rotation, &b[0].pose.rotation) < 20.0 * tolerance);

            let two = Scene::new(Motion::General, 7).generate(seed);
            let (x1, x2) = two.bearings::<T>();
            let order = rng.permutation(7);
            let (p1, p2) = (reordered(&x1, &order), reordered(&x2, &order));
            let rotation = rounded::<T>(&two.pose.rotation);
            let (a, b) = (translation_npt(&rotation, &x1, &x2), translation_npt(&rotation, &p1, &p2));
            if let (Some(a), Some(b)) = (a.expect("finite"), b.expect("finite")) {
                assert!(direction_error(&a, &b) < tolerance);
            }
            let y: Vec<_> = x1.iter().map(|x| rotation * x).collect();
            let (a, b) = (rotation_npt(&x1, &y), rotation_npt(&p1, &reordered(&y, &order)));
            let (a, b) = (a.expect("finite").expect("spread"), b.expect("finite").expect("spread"));
            assert!(rotation_error(&a, &b) < tolerance);
            let swapped = |v: &[Vector3<T>]| [v[1], v[0]];
            let (a, b) = (rotation_2pt(&first(&x1), &first(&y)), rotation_2pt(&swapped(&x1), &swapped(&y)));
            if let (Some(a), Some(b)) = (a, b) {
                assert!(rotation_error(&a, &b) < tolerance);
            }
        });
        share_of(300, |seed, _| {
            let problem = Scene::new(Motion::Upright, 3).generate(seed);
            let (x1, x2) = problem.bearings::<T>();
            let plain = relpose_upright_3pt::<T>(&first(&x1), &first(&x2));
            let other = relpose_upright_3pt(&[x1[2], x1[0], x1[1]], &[x2[2], x2[0], x2[1]]);
            plain.len() == other.len()
                && plain.iter().all(|a| best(other.iter().map(|b| rotation_error(&a.rotation, &b.rotation))) < 1e-3)
        })
        // Two roots that merge may be lost together; a point nearly on the baseline changes sides.
        .assert_at_least(0.97);
    }

    fn absolute_pose_of_degenerate_points<T>() {
        let x: [Vector3<T>; 6] = [
            v(1.0, 0.0, 4.0), v(-1.0, 0.5, 5.0), v(0.2, -1.0, 3.0), v(0.6, 0.8, 6.0), v(-0.7, -0.6, 4.5), v(0.1, 0.3, 7.0),
        ];
        let here = |p: &Pose<T>| rotation_error(&p.rotation, &UnitQuaternion::<f64>::identity());
        let tolerance = 10.0 * tolerances::SOLVED_ROTATION.of::<T>();
        // A point at depth zero has a bearing like any other; two equal bearings are points behind one another.
        let mut beside = x;
        beside[2] = v(3.0, 1.0, 0.0);
        let mut hidden = x;
        hidden[5] = hidden[0] * lit::<T>(2.0);
        // The camera's centre and the points on one circular cylinder.
        let danger = std::array::from_fn::<_, 6, _>(|i| {
            let a = 0.8 + 0.7 * i as f64;
            v(2.0 * a.sin(), 0.4 * (i as f64) - 1.0, 2.0 - 2.0 * a.cos())
        });
        for points in [&beside, &hidden, &danger] {
            let poses = abspose_npt(points, points).expect("finite");
            assert!(best(poses.iter().map(here)) < tolerance, "{points:?}");
            let pair: [Vector3<T>; 2] = first(points);
            assert!(best(abspose_upright_2pt(&pair, &pair).iter().map(here)) < tolerance);
        }
        // A point at the camera's centre has no bearing: whatever was measured for it does no harm to the numbers.
        let mut centre = x;
        centre[1] = Vector3::zeros();
        let mut f = centre;
        f[1] = v(0.0, 0.0, 1.0);
        assert!(abspose_npt(&f, &centre).expect("finite").iter().all(finite));
        assert!(abspose_upright_2pt(&[f[0], f[1]], &[centre[0], centre[1]]).iter().all(finite));
        // A bearing of length zero.
        assert!(abspose_npt(&centre, &x).expect("finite").iter().all(finite));
        assert!(abspose_upright_2pt(&[centre[0], centre[1]], &[x[0], x[1]]).iter().all(finite));
        // One bearing for all, one point for all; points on a line.
        assert_eq!(abspose_npt(&[x[0]; 6], &x).map(|p| p.len()), Ok(0));
        assert_eq!(abspose_npt(&x, &[x[0]; 6]).map(|p| p.len()), Ok(0));
        let line = std::array::from_fn::<_, 6, _>(|i| v(i as f64 - 2.0, 0.5, 5.0 + 0.3 * i as f64));
        for pose in abspose_npt(&line, &line).expect("finite") {
            assert!(line.iter().all(|x| direction_error(x, &(pose * Point3::from(*x)).coords) < tolerance));
        }
        assert_eq!(resection_dlt(&[Vector2::zeros(); 6], &x), Ok(None));
        assert_eq!(resection_dlt(&x.map(|x| x.xy() / x.z), &line), Ok(None));
        assert_eq!(resection_dlt(&x.map(|x| x.xy() / x.z), &[x[0]; 6]), Ok(None));
    }

    fn planar_target_of_degenerate_points<T>() {
        let (f, x) = target::<T>(&UnitQuaternion::from_euler_angles(0.3, -0.2, 0.1), 1.0);
        assert_eq!(abspose_planar(&f[..3], &x[..3]), Err(InputError::TooFew { given: 3, needed: 4 }));
        assert_eq!(abspose_planar(&f[..4], &x), Err(InputError::LengthMismatch { first: 4, second: 5 }));
        assert_eq!(abspose_planar(&f, &[x[0]; 5]).map(|p| p.len()), Ok(0));
        assert_eq!(abspose_planar(&[f[0]; 5], &x).map(|p| p.len()), Ok(0));
        let mut wrong = x.clone();
        wrong[3].x = lit(f64::INFINITY);
        assert_eq!(abspose_planar(&f, &wrong), Err(InputError::NotFinite { array: 1, index: 3 }));
        // Seen edge on, corners that coincide, corners on a line, a bearing of length zero: numbers all the same.
        let edge: Vec<Vector3<T>> = x.iter().map(|x| Vector3::new(x.x, T::ZERO, lit::<T>(9.0) + x.y)).collect();
        let line: Vec<Vector2<T>> = x.iter().map(|x| Vector2::new(x.x, x.x + x.x)).collect();
        let mut twice = x.clone();
        twice[1] = twice[0];
        let mut blind = f.clone();
        blind[2] = Vector3::zeros();
        for (f, x) in [(&edge, &x), (&f, &line), (&f, &twice), (&blind, &x)] {
            let poses = abspose_planar(f, x).expect("finite");
            assert!(poses.iter().all(|p| finite(&p.pose) && p.rms_rad.to_f64().is_finite()), "{f:?} {x:?}");
        }
    }

    fn rotation_and_translation_of_degenerate_bearings<T>() {
        let (a, b, c) = (v::<T>(0.1, 0.2, 1.0), v::<T>(-0.4, 0.1, 1.0), v::<T>(0.3, -0.5, 0.8));
        let zero = Vector3::zeros();
        // One bearing repeated, opposite bearings, a bearing of length zero.
        for pair in [[a, a], [a, -a], [a, zero], [zero, zero]] {
            assert_eq!(rotation_2pt(&pair, &pair), None, "{pair:?}");
            assert!(rotation_npt(&pair, &pair).expect("finite").is_none(), "{pair:?}");
            let still = UnitQuaternion::identity();
            assert_eq!(translation_2pt(&still, &pair, &pair), None, "{pair:?}");
            assert_eq!(translation_npt(&still, &pair, &pair), Ok(None), "{pair:?}");
        }
        let turn = rounded::<T>(&UnitQuaternion::from_euler_angles(0.1, 0.3, -0.2));
        // Pure rotation has no translation.
        let (x1, x2) = ([a, b], [turn * a, turn * b]);
        for t in [translation_2pt(&turn, &x1, &x2), translation_npt(&turn, &x1, &x2).expect("finite")] {
            assert!(t.is_none_or(|t| t.iter().all(|x| x.to_f64().is_finite())));
        }
        // Points in one plane with the baseline; a point on the baseline; a point at the centre of a camera, one at depth
        // zero.
        let t = v::<T>(0.5, 0.0, 0.0);
        let seen = |x: &Vector3<T>| x + t;
        let level = [v(1.0, 0.0, 4.0), v(-2.0, 0.0, 5.0)];
        let still = UnitQuaternion::identity();
        assert_eq!(translation_2pt(&still, &level, &level.map(|x| seen(&x))), None);
        assert_eq!(translation_npt(&still, &level, &level.map(|x| seen(&x))), Ok(None));
        let ahead = [v(3.0, 0.0, 0.0), b * lit::<T>(5.0), c * lit::<T>(4.0)];
        let found = translation_npt(&still, &ahead, &ahead.map(|x| seen(&x))).expect("finite");
        assert!(found.is_some_and(|found| direction_error(&found, &t) < 1e-3));
        let centre = [zero, b * lit::<T>(5.0), c * lit::<T>(4.0)];
        let found = translation_npt(&still, &centre, &centre.map(|x| seen(&x))).expect("finite");
        assert!(found.is_none_or(|found| found.iter().all(|x| x.to_f64().is_finite())));
        let beside = [v(0.5, 2.0, 0.0), b * lit::<T>(5.0), c * lit::<T>(4.0)];
        let found = translation_npt(&still, &beside, &beside.map(|x| seen(&x))).expect("finite");
        assert!(found.is_some_and(|found| direction_error(&found, &t) < 1e-3));
    }

    fn upright_relative_pose_of_degenerate_points<T>() {
        let truth = Pose::from_parts(
            Translation3::new(0.6, 0.0, 0.0),
            UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.2),
        );
        let run = |x: [[f64; 3]; 3]| {
            let x1 = x.map(Vector3::<f64>::from);
            let x2 = x1.map(|x| (truth * Point3::from(x)).coords);
            relpose_upright_3pt(&x1.map(|x| x.map(lit::<T>)), &x2.map(|x| x.map(lit)))
        };
        let close = |x: [[f64; 3]; 3]| {
            let errors = run(x).iter().map(|p| {
                let (r, t) = pose_error(p, &truth);
                r.max(t)
            }).collect::<Vec<_>>();
            best(errors)
        };
        let tolerance = 10.0 * tolerances::SOLVED_ROTATION.of::<T>();
        let centre = truth.inverse().translation.vector;
        let epipolar = |s: f64| {
            let x = Vector3::new(0.5, 0.8, 4.0) * s + centre * (1.0 - s);
            [x.x, x.y, x.z]
        };
        // Any two of the three in one plane with the baseline.
        let (p, q, other) = ([0.5, 0.8, 4.0], epipolar(1.7), [-1.0, -0.5, 5.0]);
        for points in [[p, q, other], [other, p, q], [q, other, p]] {
            assert!(close(points) < tolerance, "{points:?}: {:e}", close(points));
        }
        // At depth zero of view 1, beside it.
        assert!(close([[3.0, 1.0, 0.0], p, other]) < tolerance);
        // A horizontal plane through both centres fixes no rotation; a point at a centre has no bearing; a line of points.
        for points in [
            [[1.0, 0.0, 4.0], [-1.0, 0.0, 3.0], [0.3, 0.0, 5.0]],
            [[0.0, 0.0, 0.0], p, other],
            [[centre.x, centre.y, centre.z], p, other],
            [p, p, other],
            [p, [1.0, 1.6, 8.0], [2.0, 3.2, 16.0]],
        ] {
            assert!(run(points).iter().all(finite), "{points:?}");
        }
        // Rotation alone.
        let x1 = [v::<T>(0.1, 0.2, 1.0), v(-0.4, 0.1, 1.0), v(0.3, -0.5, 0.8)];
        let turn = rounded::<T>(&truth.rotation);
        assert!(relpose_upright_3pt(&x1, &x1.map(|x| turn * x)).iter().all(finite));
    }
}
