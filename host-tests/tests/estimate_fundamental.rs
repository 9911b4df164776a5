//! Robust fundamental matrix: the truth under outliers, dominant planes, verdicts, errors, repeated bits.

use epipole::estimate::{
    FundamentalEstimate, FundamentalOptions, FundamentalStorage, FundamentalVerdict, fundamental,
    fundamental_guided,
};
use epipole::nalgebra::{Matrix3, Vector2};
use epipole::real::lit;
use epipole::refine::{self, RefineTwoViewOptions};
use epipole::robust::{Guide, OptionsError, StopReason};
use epipole::{InputError, Real};
use epipole_host_tests::scenes::{Motion, Scene, Shape, TwoView, calibration};
use epipole_host_tests::tolerances::{ROBUST_EXACT_PX, ROBUST_SAME_PX};
use epipole_host_tests::{for_each_case, in_both_scalars, share_of};

const N: usize = 200;

fn scene(motion: Motion, noise_px: f64, outliers: f64, seed: u64) -> TwoView {
    Scene::new(motion, N).noise_px(noise_px).outliers(outliers).generate(seed)
}

fn options<T: Real>(max_error_px: f64) -> FundamentalOptions<T> {
    let mut options = FundamentalOptions::default();
    options.max_error_px = lit(max_error_px);
    options
}

fn run<T: Real>(
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    options: &FundamentalOptions<T>,
) -> FundamentalEstimate<T> {
    let mut storage = FundamentalStorage::<T, N>::new();
    fundamental(x1, x2, options, &mut storage.workspace()).expect("well-formed")
}

/// The mean distance of the true pixels from their epipolar lines in both views, pixels.
fn distance<T: Real>(f: &Matrix3<T>, scene: &TwoView) -> f64 {
    let f = f.map(|x| x.to_f64());
    let k = calibration();
    let distances = scene.points.iter().map(|point| {
        let x1 = k * point / point.z;
        let moved = (scene.pose * epipole::nalgebra::Point3::from(*point)).coords;
        let x2 = k * moved / moved.z;
        let (line1, line2) = (f.transpose() * x2, f * x1);
        0.5 * x2.dot(&line2).abs() * (1.0 / line1.xy().norm() + 1.0 / line2.xy().norm())
    });
    distances.sum::<f64>() / scene.points.len() as f64
}

in_both_scalars! {
    fn exact_points_give_the_exact_matrix<T>() {
        for_each_case(20, |seed, _| {
            let scene = scene(Motion::General, 0.0, 0.0, seed);
            let (x1, x2) = scene.pixels::<T>();
            let mut storage = FundamentalStorage::<T, N>::new();
            let mut workspace = storage.workspace();
            let f = fundamental(&x1, &x2, &options(1.0), &mut workspace).unwrap().fundamental().unwrap();
            let error = distance(&f.0, &scene);
            assert!(error < ROBUST_EXACT_PX.of::<T>(), "{error}");
            let size = f.0.norm().to_f64();
            assert!((size - 1.0).abs() < 1e-5 && f.epipole1().is_some());
            for (&marked, &inlier) in workspace.inliers().iter().zip(&scene.inlier) {
                assert!(marked || !inlier);
            }
        });
    }

    fn the_truth_under_outliers<T>() {
        for (motion, outliers) in [(Motion::General, 0.1), (Motion::General, 0.5), (Motion::Forward, 0.4)] {
            share_of(30, |seed, _| {
                let scene = scene(motion, 1.0, outliers, seed);
                let (x1, x2) = scene.pixels::<T>();
                let estimate = run(&x1, &x2, &options(2.0));
                estimate.fundamental().is_some_and(|f| distance(&f.0, &scene) < 1.5)
            }).assert_at_least(0.96);
        }
    }

    /// Wrong matches that lie on their epipolar lines have the leverage of points close by.
    fn accidents_do_not_bend_it<T>() {
        for motion in [Motion::General, Motion::Forward] {
            let (mut all, mut inliers_alone) = (0.0, 0.0);
            for_each_case(40, |seed, _| {
                let scene = scene(motion, 1.0, 0.6, seed);
                let (x1, x2) = scene.pixels::<T>();
                let Some(f) = run(&x1, &x2, &options(2.0)).fundamental() else { return };
                let (y1, y2): (Vec<_>, Vec<_>) =
                    x1.iter().zip(&x2).zip(&scene.inlier).filter(|(_, inlier)| **inlier).map(|(x, _)| x).unzip();
                let best = refine::fundamental(&y1, &y2, &f, &RefineTwoViewOptions::default()).unwrap().unwrap();
                all += distance(&f.0, &scene);
                inliers_alone += distance(&best.model.0, &scene);
            });
            assert!(all < 1.3 * inliers_alone, "{motion:?}: {all} px with wrong matches, {inliers_alone} without");
        }
    }

    /// A near object that tells most of the epipoles takes part, though wrong matches seem to lie as near.
    fn a_near_object_is_kept<T>() {
        share_of(60, |seed, _| {
            let scene = Scene::new(Motion::General, N).shape(Shape::NearObject(30)).noise_px(1.0).outliers(0.6);
            let scene = scene.generate(seed);
            let (x1, x2) = scene.pixels::<T>();
            run(&x1, &x2, &options(2.0)).fundamental().is_some_and(|f| distance(&f.0, &scene) < 1.0)
        }).assert_at_least(0.9);
    }

    fn views_exchanged_and_pixels_rescaled<T>() {
        for_each_case(10, |seed, _| {
            let scene = scene(Motion::General, 0.5, 0.3, seed);
            let (x1, x2) = scene.pixels::<T>();
            let forth = distance(&run(&x1, &x2, &options(1.5)).fundamental().unwrap().0, &scene);
            let back = run(&x2, &x1, &options(1.5)).fundamental().unwrap().0.transpose();
            assert!((distance(&back, &scene) - forth).abs() < ROBUST_SAME_PX.of::<T>());
            let moved = |p: &Vector2<T>| Vector2::new(p.x * lit(4.0) + lit(512.0), p.y * lit(4.0) - lit(256.0));
            let (y1, y2): (Vec<_>, Vec<_>) = (x1.iter().map(moved).collect(), x2.iter().map(moved).collect());
            let f = run(&y1, &y2, &options(6.0)).fundamental().unwrap().0.map(|x| x.to_f64());
            let s = Matrix3::new(4.0, 0.0, 512.0, 0.0, 4.0, -256.0, 0.0, 0.0, 1.0);
            let error = distance(&(s.transpose() * f * s), &scene);
            assert!((error - forth).abs() < ROBUST_SAME_PX.of::<T>());
        });
    }

    fn a_plane_or_a_turning_camera_gives_its_homography<T>() {
        for_each_case(20, |seed, _| {
            for scene in [Scene::new(Motion::General, N).shape(Shape::Plane), Scene::new(Motion::PureRotation, N)] {
                let (x1, x2) = scene.noise_px(0.5).outliers(0.3).generate(seed).pixels::<T>();
                let verdict = run(&x1, &x2, &options(1.5)).verdict;
                assert!(matches!(verdict, FundamentalVerdict::Planar(_)), "{verdict:?}");
            }
        });
    }

    /// Without noise a sample's equations are dependent and its seven points have no finite number of matrices.
    fn an_exact_plane_is_found_at_once<T>() {
        for_each_case(20, |seed, _| {
            let plane = Scene::new(Motion::General, N).shape(Shape::Plane);
            for scene in [plane, Scene::new(Motion::PureRotation, N), Scene::new(Motion::Still, N)] {
                for (outliers, most) in [(0.0, 20), (0.3, 200)] {
                    let (x1, x2) = scene.outliers(outliers).generate(seed).pixels::<T>();
                    let estimate = run(&x1, &x2, &options(1.0));
                    assert!(matches!(estimate.verdict, FundamentalVerdict::Planar(_)), "{:?}", estimate.verdict);
                    assert!(estimate.report.spent.iterations <= most, "{:?}", estimate.report);
                }
            }
        });
    }

    /// Three quarters of the inliers on a plane: seven of them seldom include the two off it that are needed.
    fn a_dominant_plane_does_not_mislead<T>() {
        share_of(30, |seed, _| {
            let flat = Scene::new(Motion::General, N).shape(Shape::Plane).noise_px(0.5).outliers(0.2).generate(seed);
            // Points at other depths under the same motion take the place of a quarter.
            let mut scene = flat;
            for i in (0..N).step_by(4).filter(|&i| scene.inlier[i]).collect::<Vec<_>>() {
                let point = scene.points[i] * (1.0 + 0.3 * ((i * 37 % 17) as f64 / 17.0) + 0.1);
                let moved = (scene.pose * epipole::nalgebra::Point3::from(point)).coords;
                (scene.points[i], scene.x1[i], scene.x2[i]) = (point, point / point.z, moved / moved.z);
            }
            let (x1, x2) = scene.pixels::<T>();
            run(&x1, &x2, &options(1.5)).fundamental().is_some_and(|f| distance(&f.0, &scene) < 1.5)
        }).assert_at_least(0.9);
    }

    fn few_correspondences_prove_nothing<T>() {
        let (x1, x2) = scene(Motion::General, 0.5, 0.0, 1).pixels::<T>();
        assert_eq!(run(&x1[..7], &x2[..7], &options(1.5)).verdict, FundamentalVerdict::TooFewInliers);
        assert!(run(&x1[..30], &x2[..30], &options(1.5)).fundamental().is_some());
    }

    fn malformed_input_is_named_and_nothing_is_touched<T>() {
        let (x1, x2) = scene(Motion::General, 0.5, 0.2, 1).pixels::<T>();
        let mut storage = FundamentalStorage::<T, N>::new();
        let mut workspace = storage.workspace();
        let estimate = fundamental(&x1, &x2, &options(1.5), &mut workspace).unwrap();
        let before = workspace.inliers().to_vec();
        for (array, index, bad) in [(0, 7, f64::NAN), (1, 199, f64::INFINITY), (1, 0, -f64::INFINITY)] {
            let mut pixels = [x1.clone(), x2.clone()];
            pixels[array][index].x = lit(bad);
            let error = fundamental(&pixels[0], &pixels[1], &options(1.5), &mut workspace).unwrap_err();
            assert_eq!(error, InputError::NotFinite { array, index }.into());
        }
        let mut refused = |x1: &[_], x2: &[_], options: &_| fundamental(x1, x2, options, &mut workspace).unwrap_err();
        let ok = options::<T>(1.5);
        assert_eq!(refused(&x1, &x2[..9], &ok), InputError::LengthMismatch { first: N, second: 9 }.into());
        assert_eq!(refused(&x1[..6], &x2[..6], &ok), InputError::TooFew { given: 6, needed: 7 }.into());
        let double = [x1.clone(), x1.clone()].concat();
        assert_eq!(refused(&double, &double, &ok), InputError::TooMany { given: 2 * N, capacity: N }.into());
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(refused(&x1, &x2, &options(bad)), OptionsError::MaxError.into());
            let mut wrong = ok;
            wrong.sigma_px = Some(lit(bad));
            assert_eq!(refused(&x1, &x2, &wrong), OptionsError::Sigma.into());
        }
        let mut wrong = ok;
        wrong.ransac.confidence = lit(1.0);
        assert_eq!(refused(&x1, &x2, &wrong), OptionsError::Confidence.into());
        let mut wrong = ok;
        wrong.ransac.budget.max_iterations = 0;
        assert_eq!(refused(&x1, &x2, &wrong), OptionsError::NoIterations.into());
        assert_eq!(workspace.inliers(), before);
        let guide = Guide { scores: Some(&[]), keep_going: None };
        let error = fundamental_guided(&x1, &x2, &ok, guide, &mut workspace).unwrap_err();
        assert_eq!(error, InputError::LengthMismatch { first: N, second: 0 }.into());
        assert_eq!(fundamental(&x1, &x2, &ok, &mut workspace).unwrap(), estimate);
    }

    fn any_numbers_are_answered<T>() {
        for_each_case(100, |_, rng| {
            let n = rng.index(30);
            let mut point = || {
                let v = rng.any_vector::<T>();
                Vector2::new(v.x, v.y)
            };
            let (x1, x2): (Vec<_>, Vec<_>) = (0..n).map(|_| (point(), point())).unzip();
            let mut storage = FundamentalStorage::<T, N>::new();
            let mut options = options(1.0);
            options.ransac.budget.max_iterations = 200;
            if let Ok(estimate) = fundamental(&x1, &x2, &options, &mut storage.workspace()) {
                assert!(estimate.noise_px.to_f64().is_finite());
                assert!(estimate.fundamental().is_none_or(|f| f.0.iter().all(|x| x.to_f64().is_finite())));
            }
        });
    }

    fn bits_repeat_whatever_the_capacity<T>() {
        let (x1, x2) = scene(Motion::General, 1.0, 0.4, 3).pixels::<T>();
        let estimate = run(&x1, &x2, &options(2.0));
        assert_eq!(run(&x1, &x2, &options(2.0)), estimate);
        let mut storage = FundamentalStorage::<T, 1024>::new();
        let mut workspace = storage.workspace();
        assert_eq!(fundamental(&x1, &x2, &options(2.0), &mut workspace).unwrap(), estimate);
        // A run that the caller ended is repeated by its number of iterations.
        let mut asked = 0;
        let mut keep_going = |_: &_| {
            asked += 1;
            asked < 3
        };
        let guide = Guide { scores: None, keep_going: Some(&mut keep_going) };
        let ended = fundamental_guided(&x1, &x2, &options(2.0), guide, &mut workspace).unwrap();
        assert_eq!(ended.report.stop, StopReason::Interrupted);
        let mut limited = options(2.0);
        limited.ransac.budget.max_iterations = ended.report.spent.iterations;
        assert_eq!(fundamental(&x1, &x2, &limited, &mut workspace).unwrap().verdict, ended.verdict);
    }

    fn scores_lead_to_the_inliers_sooner<T>() {
        let scene = scene(Motion::General, 1.0, 0.6, 5);
        let (x1, x2) = scene.pixels::<T>();
        let scores: Vec<T> = scene.inlier.iter().map(|&inlier| lit(if inlier { 0.3 } else { 0.8 })).collect();
        let mut storage = FundamentalStorage::<T, N>::new();
        let mut options = options(2.0);
        options.ransac.budget.max_iterations = 100;
        let guide = Guide { scores: Some(&scores), keep_going: None };
        let guided = fundamental_guided(&x1, &x2, &options, guide, &mut storage.workspace()).unwrap();
        assert!(guided.fundamental().is_some_and(|f| distance(&f.0, &scene) < 1.5));
    }
}
