//! Robust homography: the truth under outliers, covariance, verdicts, errors, repeated bits.

use epipole::estimate::{
    HomographyEstimate, HomographyOptions, HomographyStorage, HomographyVerdict, homography,
    homography_guided,
};
use epipole::geometry::Homography;
use epipole::nalgebra::{Matrix3, SVector, Vector2};
use epipole::real::lit;
use epipole::robust::{Guide, OptionsError, StopReason};
use epipole::{InputError, Real};
use epipole_host_tests::scenes::{Motion, Scene, Shape, TwoView, calibration};
use epipole_host_tests::tolerances::{ROBUST_EXACT_PX, ROBUST_SAME_PX};
use epipole_host_tests::{for_each_case, in_both_scalars, share_of};

const N: usize = 200;

fn plane(noise_px: f64, outliers: f64, seed: u64) -> TwoView {
    Scene::new(Motion::General, N).shape(Shape::Plane).noise_px(noise_px).outliers(outliers).generate(seed)
}

fn truth(scene: &TwoView) -> Homography<f64> {
    Homography(scene.homography()).to_pixels(&calibration(), &calibration()).expect("regular")
}

fn options<T: Real>(max_error_px: f64) -> HomographyOptions<T> {
    let mut options = HomographyOptions::default();
    options.max_error_px = lit(max_error_px);
    options
}

fn run<T: Real>(
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    options: &HomographyOptions<T>,
) -> HomographyEstimate<T> {
    let mut storage = HomographyStorage::<T, N>::new();
    homography(x1, x2, options, &mut storage.workspace()).expect("well-formed")
}

/// The largest distance in view 2 between where two homographies take the true points of view 1, pixels.
fn farthest<T: Real>(h: &Homography<T>, truth: &Homography<f64>, scene: &TwoView) -> f64 {
    let h = Homography(h.0.map(|x| x.to_f64()));
    let k = calibration();
    scene.points.iter().fold(0.0, |worst: f64, point| {
        let pixel = k * point / point.z;
        let both = h.transfer(&pixel.xy()).zip(truth.transfer(&pixel.xy()));
        worst.max(both.map_or(f64::INFINITY, |(a, b)| (a - b).norm()))
    })
}

in_both_scalars! {
    /// Noise as large as the threshold costs digits; it is not taken for another plane, which would make errors of 1.2 px 1.7.
    fn loud_noise_is_no_other_plane<T>() {
        let mut errors = Vec::new();
        for_each_case(60, |seed, _| {
            let scene = plane(1.0, 0.0, seed);
            let (x1, x2) = scene.pixels::<T>();
            let found = run(&x1, &x2, &options(1.0)).homography().expect("a plane");
            errors.push(farthest(&found, &truth(&scene), &scene));
        });
        errors.sort_by(f64::total_cmp);
        assert!(errors[30] < 1.45, "{}", errors[30]);
    }

    fn exact_points_give_the_exact_homography<T>() {
        for_each_case(30, |seed, _| {
            let scene = plane(0.0, 0.4, seed);
            let (x1, x2) = scene.pixels::<T>();
            let mut storage = HomographyStorage::<T, N>::new();
            let mut workspace = storage.workspace();
            let estimate = homography(&x1, &x2, &options(1.0), &mut workspace).unwrap();
            let error = farthest(&estimate.homography().unwrap(), &truth(&scene), &scene);
            assert!(error < ROBUST_EXACT_PX.of::<T>(), "{error}");
            for (&marked, &inlier) in workspace.inliers().iter().zip(&scene.inlier) {
                assert!(marked || !inlier);
            }
        });
    }

    fn the_truth_under_outliers<T>() {
        for outliers in [0.1, 0.5, 0.7] {
            share_of(40, |seed, _| {
                let scene = plane(1.0, outliers, seed);
                let (x1, x2) = scene.pixels::<T>();
                let estimate = run(&x1, &x2, &options(4.0));
                // 60 inliers with 1 px of noise in both views fix the plane to a few tenths of a pixel.
                let right = estimate.homography().is_some_and(|h| farthest(&h, &truth(&scene), &scene) < 4.0);
                right && (estimate.noise_px.to_f64() - 1.0).abs() < 0.3
            }).assert_at_least(0.97);
        }
    }

    fn a_turning_camera_has_a_homography<T>() {
        for_each_case(20, |seed, _| {
            let scene = Scene::new(Motion::PureRotation, N).noise_px(0.5).outliers(0.3).generate(seed);
            let (x1, x2) = scene.pixels::<T>();
            let h = run(&x1, &x2, &options(2.0)).homography().unwrap();
            assert!(farthest(&h, &truth(&scene), &scene) < 2.0);
        });
    }

    fn views_exchanged_and_pixels_rescaled<T>() {
        for_each_case(20, |seed, _| {
            let scene = plane(0.5, 0.3, seed);
            let (x1, x2) = scene.pixels::<T>();
            let forth = run(&x1, &x2, &options(2.0)).homography().unwrap();
            let back = run(&x2, &x1, &options(2.0)).homography().unwrap();
            let forth64 = Homography(forth.0.map(|x| x.to_f64()));
            // The error is symmetric to first order only.
            assert!(farthest(&back.inverse().unwrap(), &forth64, &scene) < 0.2);
            // Pixels of another size, counted from another corner.
            let moved = |p: &Vector2<T>| Vector2::new(p.x * lit(4.0) + lit(512.0), p.y * lit(4.0) - lit(256.0));
            let (y1, y2): (Vec<_>, Vec<_>) = (x1.iter().map(moved).collect(), x2.iter().map(moved).collect());
            let h = run(&y1, &y2, &options(8.0)).homography().unwrap().0.map(|x| x.to_f64());
            let s = Matrix3::new(4.0, 0.0, 512.0, 0.0, 4.0, -256.0, 0.0, 0.0, 1.0);
            let h = Homography(s.try_inverse().unwrap() * h * s);
            assert!(farthest(&h, &forth64, &scene) < ROBUST_SAME_PX.of::<T>());
        });
    }

    /// What is believed is not asked for more: fifteen of a hundred, thirty of two hundred.
    fn a_few_true_matches_have_one<T>() {
        share_of(20, |seed, _| {
            [100, N].iter().all(|&count| {
                let scene = Scene::new(Motion::General, count).shape(Shape::Plane).noise_px(0.8).outliers(0.85).generate(seed);
                let (x1, x2) = scene.pixels::<T>();
                let found = run(&x1, &x2, &options(3.0)).homography();
                found.is_some_and(|found| farthest(&found, &truth(&scene), &scene) < 30.0)
            })
        }).assert_at_least(0.95);
    }

    fn few_correspondences_prove_nothing<T>() {
        let (x1, x2) = plane(0.5, 0.0, 1).pixels::<T>();
        assert_eq!(run(&x1[..4], &x2[..4], &options(2.0)).verdict, HomographyVerdict::TooFewInliers);
        assert!(run(&x1[..12], &x2[..12], &options(2.0)).homography().is_some());
    }

    fn malformed_input_is_named_and_nothing_is_touched<T>() {
        let (x1, x2) = plane(0.5, 0.2, 1).pixels::<T>();
        let mut storage = HomographyStorage::<T, N>::new();
        let mut workspace = storage.workspace();
        let estimate = homography(&x1, &x2, &options(2.0), &mut workspace).unwrap();
        let before = workspace.inliers().to_vec();
        for (array, index, bad) in [(0, 7, f64::NAN), (1, 199, f64::INFINITY), (1, 0, -f64::INFINITY)] {
            let mut pixels = [x1.clone(), x2.clone()];
            pixels[array][index].y = lit(bad);
            let error = homography(&pixels[0], &pixels[1], &options(2.0), &mut workspace).unwrap_err();
            assert_eq!(error, InputError::NotFinite { array, index }.into());
        }
        let mut refused = |x1: &[_], x2: &[_], options: &_| homography(x1, x2, options, &mut workspace).unwrap_err();
        let (ok, none) = (options::<T>(2.0), &[][..]);
        assert_eq!(refused(&x1, &x2[..9], &ok), InputError::LengthMismatch { first: N, second: 9 }.into());
        assert_eq!(refused(&x1[..3], &x2[..3], &ok), InputError::TooFew { given: 3, needed: 4 }.into());
        assert_eq!(refused(none, none, &ok), InputError::TooFew { given: 0, needed: 4 }.into());
        let double = [x1.clone(), x1.clone()].concat();
        assert_eq!(refused(&double, &double, &ok), InputError::TooMany { given: 2 * N, capacity: N }.into());
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(refused(&x1, &x2, &options(bad)), OptionsError::MaxError.into());
            let mut wrong = ok;
            wrong.sigma_px = Some(lit(bad));
            assert_eq!(refused(&x1, &x2, &wrong), OptionsError::Sigma.into());
        }
        for bad in [0.0, 1.0, f64::NAN] {
            let mut wrong = ok;
            wrong.ransac.confidence = lit(bad);
            assert_eq!(refused(&x1, &x2, &wrong), OptionsError::Confidence.into());
        }
        let mut wrong = ok;
        wrong.ransac.budget.max_iterations = 0;
        assert_eq!(refused(&x1, &x2, &wrong), OptionsError::NoIterations.into());
        assert_eq!(workspace.inliers(), before);
        let guide = Guide { scores: Some(&[]), keep_going: None };
        let error = homography_guided(&x1, &x2, &ok, guide, &mut workspace).unwrap_err();
        assert_eq!(error, InputError::LengthMismatch { first: N, second: 0 }.into());
        assert_eq!(homography(&x1, &x2, &ok, &mut workspace).unwrap(), estimate);
    }

    fn any_numbers_are_answered<T>() {
        for_each_case(300, |_, rng| {
            let n = rng.index(30);
            let mut point = || {
                let v = rng.any_vector::<T>();
                Vector2::new(v.x, v.y)
            };
            let (x1, x2): (Vec<_>, Vec<_>) = (0..n).map(|_| (point(), point())).unzip();
            let mut storage = HomographyStorage::<T, N>::new();
            if let Ok(estimate) = homography(&x1, &x2, &options(1.0), &mut storage.workspace()) {
                assert!(estimate.noise_px.to_f64().is_finite());
                assert!(estimate.homography().is_none_or(|h| h.0.iter().all(|x| x.to_f64().is_finite())));
            }
        });
    }

    fn bits_repeat_whatever_the_capacity<T>() {
        let (x1, x2) = plane(1.0, 0.5, 3).pixels::<T>();
        let estimate = run(&x1, &x2, &options(3.0));
        assert_eq!(run(&x1, &x2, &options(3.0)), estimate);
        let mut storage = HomographyStorage::<T, 1024>::new();
        assert_eq!(homography(&x1, &x2, &options(3.0), &mut storage.workspace()).unwrap(), estimate);
        // A run that the caller ended is repeated by its number of iterations.
        let mut asked = 0;
        let mut keep_going = |_: &_| {
            asked += 1;
            asked < 2
        };
        let guide = Guide { scores: None, keep_going: Some(&mut keep_going) };
        let mut workspace = storage.workspace();
        let ended = homography_guided(&x1, &x2, &options(3.0), guide, &mut workspace).unwrap();
        assert_eq!(ended.report.stop, StopReason::Interrupted);
        let mut limited = options(3.0);
        limited.ransac.budget.max_iterations = ended.report.spent.iterations;
        assert_eq!(homography(&x1, &x2, &limited, &mut workspace).unwrap().verdict, ended.verdict);
    }

    fn scores_lead_to_the_inliers_sooner<T>() {
        let scene = plane(1.0, 0.7, 5);
        let (x1, x2) = scene.pixels::<T>();
        let scores: Vec<T> = scene.inlier.iter().map(|&inlier| lit(if inlier { 0.3 } else { 0.8 })).collect();
        let mut storage = HomographyStorage::<T, N>::new();
        let guide = Guide { scores: Some(&scores), keep_going: None };
        let guided = homography_guided(&x1, &x2, &options(4.0), guide, &mut storage.workspace()).unwrap();
        let h = guided.homography().unwrap();
        assert!(farthest(&h, &truth(&scene), &scene) < 3.0);
        assert!(guided.report.spent.solver_calls < 1_000);
    }
}

/// The normalised estimation error squared of the transferred corners: chi-squared with 8 degrees of freedom. Over 1000
/// trials its mean lies within 8 +- 0.25 with 95 % (deviation 4 / sqrt 1000 = 0.126).
#[test]
fn the_covariance_is_calibrated() {
    for (max_error_px, outliers) in [(4.24, 0.0), (2.83, 0.0), (4.24, 0.2)] {
        let (mut sum, mut count) = (0.0, 0);
        for_each_case(1000, |seed, _| {
            let scene = plane(1.0, outliers, seed);
            let (x1, x2) = scene.pixels::<f64>();
            let HomographyVerdict::Found(found) = run(&x1, &x2, &options(max_error_px)).verdict else {
                return;
            };
            let truth = truth(&scene);
            let mut error = SVector::<f64, 8>::zeros();
            for (k, corner) in found.corners.iter().enumerate() {
                let offset = found.homography.transfer(corner).unwrap() - truth.transfer(corner).unwrap();
                error.fixed_rows_mut::<2>(2 * k).copy_from(&offset);
            }
            let covariance = found.covariance.expect("a plane is fixed");
            sum += error.dot(&covariance.cholesky().expect("positive definite").solve(&error));
            count += 1;
        });
        let mean = sum / f64::from(count);
        assert!(count >= 990, "{count}");
        assert!((mean - 8.0).abs() < 0.5, "threshold {max_error_px}, outliers {outliers}: {mean}");
    }
}
