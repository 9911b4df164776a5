//! `refine::{relative_pose, homography, fundamental}` on the caller's points, and the derivative of a pose by them.

use epipole::InputError;
use epipole::Real;
use epipole::geometry::pose::{log, retract, tangent_basis};
use epipole::geometry::{Fundamental, Homography, Pose};
use epipole::nalgebra::{Matrix3, SMatrix, SVector, Vector2, Vector3, Vector6};
use epipole::real::{is_finite, lit};
use epipole::refine::{RefineTwoViewOptions, fundamental, homography, relative_pose, relative_pose_jacobian};
use epipole::robust::loss::Loss;
use epipole_host_tests::matchers::pose_error;
use epipole_host_tests::scenes::{FOCAL, Motion, Scene, Shape, TwoView};
use epipole_host_tests::{Rng, for_each_case, in_both_scalars};

/// Points of the planes z = 1.
fn points<T: Real>(problem: &TwoView) -> (Vec<Vector2<T>>, Vec<Vector2<T>>) {
    let plane = |v: &Vector3<f64>| Vector2::new(lit(v.x / v.z), lit(v.y / v.z));
    (problem.x1.iter().map(plane).collect(), problem.x2.iter().map(plane).collect())
}

fn cast<T: Real>(pose: &Pose<f64>) -> Pose<T> {
    let q = pose.rotation.coords.map(lit);
    Pose::from_parts(
        pose.translation.vector.map(lit).into(),
        epipole::nalgebra::UnitQuaternion::new_unchecked(epipole::nalgebra::Quaternion::from(q)),
    )
}

fn near(pose: &Pose<f64>, size: f64, rng: &mut Rng) -> Pose<f64> {
    let (w, t) = (rng.direction() * size, rng.direction() * size * pose.translation.vector.norm());
    retract(pose, &Vector6::new(w.x, w.y, w.z, t.x, t.y, t.z))
}

fn plenty<T: Real>() -> RefineTwoViewOptions<T> {
    let mut options = RefineTwoViewOptions::default();
    options.max_passes = 60;
    options
}

/// The difference of two poses in the five parameters of the first.
fn apart(from: &Pose<f64>, to: &Pose<f64>) -> SVector<f64, 5> {
    let w = log(&(to.rotation * from.rotation.inverse()));
    let d = tangent_basis(&from.translation.vector).transpose() * to.translation.vector;
    SVector::from([w.x, w.y, w.z, d.x, d.y])
}

in_both_scalars! {
    fn exact_points_give_the_truth<T>() {
        let tolerance = if size_of::<T>() == 4 { 2e-4 } else { 1e-9 };
        for_each_case(30, |seed, rng| {
            let problem = Scene::new(Motion::General, 43).generate(seed);
            let (x1, x2) = points::<T>(&problem);
            let start = near(&problem.pose, 0.03, rng);
            let refined = relative_pose(&x1, &x2, &cast(&start), &plenty()).unwrap().unwrap();
            let (r, t) = pose_error(&refined.model, &problem.pose);
            assert!(r < tolerance && t < 10.0 * tolerance, "{r} {t}");
            assert!(refined.cost <= refined.initial_cost && refined.active > 30 && refined.passes <= 60);

            // In pixels: the epipolar and the transfer error of every pair vanish.
            let (p1, p2) = problem.pixels::<T>();
            let spoilt = |m: &Matrix3<f64>, rng: &mut Rng| {
                (m / m.norm()).map(|x| x * (1.0 + 0.02 * rng.normal())).map(lit::<T>)
            };
            let start = Fundamental(spoilt(&problem.fundamental(), rng));
            let refined = fundamental(&p1, &p2, &start, &plenty()).unwrap().unwrap();
            let rms = (refined.cost.to_f64() / 43.0).sqrt();
            assert!(rms < if size_of::<T>() == 4 { 2e-3 } else { 1e-8 }, "{rms}");
            let f = refined.model.0.map(Real::to_f64);
            assert!((f.norm() - 1.0).abs() < 1e-6);

            let plane = Scene::new(Motion::General, 21).shape(Shape::Plane).generate(seed);
            let (p1, p2) = plane.pixels::<T>();
            let k = epipole_host_tests::scenes::calibration();
            let h = k * plane.homography() * k.try_inverse().unwrap();
            let start = Homography((h / h.norm()).map(lit::<T>) + Matrix3::identity() * lit::<T>(1e-6));
            let refined = homography(&p1, &p2, &start, &plenty()).unwrap().unwrap();
            let rms = (refined.cost.to_f64() / 21.0).sqrt();
            assert!(rms < if size_of::<T>() == 4 { 5e-3 } else { 1e-8 }, "{rms} from {}", refined.initial_cost);
        });
    }

    /// A robust loss holds against outliers that squares follow; the cost never rises.
    fn a_loss_holds_against_outliers<T>() {
        for_each_case(20, |seed, rng| {
            let problem = Scene::new(Motion::General, 80).noise_px(0.5).outliers(0.2).generate(seed);
            let (x1, x2) = points::<T>(&problem);
            let start = cast(&near(&problem.pose, 0.005, rng));
            let mut robust = plenty();
            robust.loss = Loss::Tukey(lit(4.0 / FOCAL));
            let error = |options: &_| {
                let refined = relative_pose(&x1, &x2, &start, options).unwrap().unwrap();
                assert!(refined.cost <= refined.initial_cost);
                pose_error(&refined.model, &problem.pose).0
            };
            assert!(error(&robust) < 0.01);
        });
    }

    fn malformed_input_is_named<T>() {
        let problem = Scene::new(Motion::General, 12).generate(3);
        let (mut x1, x2) = points::<T>(&problem);
        let (pose, options) = (cast::<T>(&problem.pose), RefineTwoViewOptions::default());
        let mut jacobians = vec![SMatrix::<T, 5, 4>::zeros(); 12];
        assert_eq!(relative_pose(&x1[..4], &x2[..4], &pose, &options).unwrap_err(), InputError::TooFew { given: 4, needed: 5 });
        assert_eq!(relative_pose(&x1[..7], &x2, &pose, &options).unwrap_err(), InputError::LengthMismatch { first: 7, second: 12 });
        let short = relative_pose_jacobian(&pose, &x1, &x2, &mut jacobians[..9]).unwrap_err();
        assert_eq!(short, InputError::LengthMismatch { first: 12, second: 9 });
        let mut still = pose;
        still.translation.vector = Vector3::zeros();
        assert!(relative_pose(&x1, &x2, &still, &options).unwrap().is_none());
        assert!(!relative_pose_jacobian(&still, &x1, &x2, &mut jacobians).unwrap());
        let zero = Matrix3::zeros();
        assert!(homography(&x1, &x2, &Homography(zero), &options).unwrap().is_none());
        assert!(fundamental(&x1, &x2, &Fundamental(zero), &options).unwrap().is_none());
        x1[8].y = lit(f64::NAN);
        let nan = InputError::NotFinite { array: 0, index: 8 };
        assert_eq!(relative_pose(&x1, &x2, &pose, &options).unwrap_err(), nan);
        assert_eq!(homography(&x2, &x1, &Homography(zero), &options).unwrap_err(), InputError::NotFinite { array: 1, index: 8 });
        assert_eq!(fundamental(&x1, &x2, &Fundamental(zero), &options).unwrap_err(), nan);
        assert_eq!(relative_pose_jacobian(&pose, &x1, &x2, &mut jacobians).unwrap_err(), nan);
        assert!(jacobians.iter().all(|j| *j == SMatrix::<T, 5, 4>::zeros()));
    }

    /// Extreme but finite numbers end, with a finite model or none.
    fn extreme_numbers<T>() {
        for_each_case(40, |_, rng| {
            let scale = 10f64.powf(rng.range(-36.0, 36.0));
            let mut some = || (0..12).map(|_| Vector2::new(rng.normal(), rng.normal()).map(|x| lit::<T>(x * scale))).collect::<Vec<_>>();
            let (x1, x2) = (some(), some());
            let m = Matrix3::from_fn(|_, _| rng.normal()).map(lit::<T>);
            let options = RefineTwoViewOptions::default();
            if let Some(refined) = homography(&x1, &x2, &Homography(m), &options).unwrap() {
                assert!(refined.model.0.iter().all(|&x| is_finite(x)));
            }
            if let Some(refined) = fundamental(&x1, &x2, &Fundamental(m), &options).unwrap() {
                assert!(refined.model.0.iter().all(|&x| is_finite(x)));
            }
            let pose = cast::<T>(&Pose::new(rng.direction(), rng.direction()));
            if let Some(refined) = relative_pose(&x1, &x2, &pose, &options).unwrap() {
                assert!(refined.model.to_homogeneous().iter().all(|&x| is_finite(x)));
            }
        });
    }

    /// The derivative in this scalar is that of double precision.
    fn derivatives_of_both_scalars_agree<T>() {
        for_each_case(20, |seed, _| {
            let problem = Scene::new(Motion::General, 40).noise_px(1.0).generate(seed);
            let (x1, x2) = points::<f64>(&problem);
            let pose = relative_pose(&x1, &x2, &problem.pose, &plenty()).unwrap().unwrap().model;
            let mut wide = vec![SMatrix::zeros(); 40];
            assert!(relative_pose_jacobian(&pose, &x1, &x2, &mut wide).unwrap());
            let (y1, y2) = points::<T>(&problem);
            let mut jacobians = vec![SMatrix::zeros(); 40];
            assert!(relative_pose_jacobian(&cast::<T>(&pose), &y1, &y2, &mut jacobians).unwrap());
            let largest = wide.iter().map(|j| j.amax()).fold(0.0, f64::max);
            for (a, b) in jacobians.iter().zip(&wide) {
                let apart = (a.map(Real::to_f64) - b).amax() / largest;
                assert!(apart < if size_of::<T>() == 4 { 5e-3 } else { 1e-12 }, "{apart}");
            }
        });
    }
}

/// Refined again with a coordinate moved, the pose moves as its derivative says, at a noise at which the curvature
/// counts.
#[test]
fn the_derivative_is_that_of_differences() {
    for_each_case(12, |seed, rng| {
        let problem = Scene::new(Motion::General, 30).noise_px(2.0).generate(seed);
        let (x1, x2) = points::<f64>(&problem);
        let fit = |x1: &[Vector2<f64>], x2: &[Vector2<f64>], start: &Pose<f64>| {
            relative_pose(x1, x2, start, &plenty()).unwrap().unwrap()
        };
        let first = fit(&x1, &x2, &problem.pose);
        if first.active < 30 {
            // A point that noise took behind a camera has no weight: nothing to compare.
            return;
        }
        let pose = fit(&x1, &x2, &first.model).model;
        let mut jacobians = vec![SMatrix::zeros(); 30];
        assert!(relative_pose_jacobian(&pose, &x1, &x2, &mut jacobians).unwrap());
        let largest = jacobians.iter().map(|j: &SMatrix<f64, 5, 4>| j.amax()).fold(0.0, f64::max);
        for _ in 0..6 {
            let (i, k) = (rng.index(30), rng.index(4));
            let h = 2e-4;
            let moved = |h: f64| {
                let (mut y1, mut y2) = (x1.clone(), x2.clone());
                if k < 2 {
                    y1[i][k] += h
                } else {
                    y2[i][k - 2] += h
                }
                apart(&pose, &fit(&y1, &y2, &pose).model)
            };
            let difference = (moved(h) - moved(-h)) / (2.0 * h);
            let error = (difference - jacobians[i].column(k)).amax() / largest;
            assert!(error < 1e-4, "{i} {k}: {error}: {difference} {}", jacobians[i].column(k));
        }
    });
}

/// The matrices move with the frame in which the points are given.
#[test]
fn refinement_commutes_with_similarities() {
    for_each_case(10, |seed, _| {
        let problem = Scene::new(Motion::General, 40).noise_px(1.0).generate(seed);
        let (p1, p2) = problem.pixels::<f64>();
        let start = problem.fundamental();
        let (s, c) = (0.01, Vector2::new(30.0, -70.0));
        let map = |p: &Vector2<f64>| (p - c) * s;
        let back = Matrix3::new(1.0 / s, 0.0, c.x, 0.0, 1.0 / s, c.y, 0.0, 0.0, 1.0);
        let plain = fundamental(&p1, &p2, &Fundamental(start), &plenty()).unwrap().unwrap();
        let (q1, q2): (Vec<_>, Vec<_>) = (p1.iter().map(map).collect(), p2.iter().map(map).collect());
        let moved = Fundamental(back.transpose() * start * back);
        let other = fundamental(&q1, &q2, &moved, &plenty()).unwrap().unwrap();
        assert!((plain.cost * s * s / other.cost - 1.0).abs() < 1e-9, "{} {}", plain.cost, other.cost);
    });
}
