//! Robust absolute pose: the truth under outliers, covariance, priors, verdicts, errors, repeated bits.

use epipole::estimate::{
    AbsolutePoseError, AbsolutePoseEstimate, AbsolutePoseOptions, AbsolutePoseStorage, AbsolutePoseVerdict,
    GravityPrior, PriorFit, WideAbsolutePoseStorage, absolute_pose, absolute_pose_guided,
};
use epipole::geometry::pose::log;
use epipole::geometry::{CameraModel, KannalaBrandt, Pinhole, Pose};
use epipole::nalgebra::{Matrix6, Point3, Vector2, Vector3, Vector6};
use epipole::real::lit;
use epipole::refine::{PosePrior, RefineAbsolutePoseOptions, absolute_pose as refine_pose};
use epipole::robust::{Guide, OptionsError, Progress};
use epipole::{InputError, Real};
use epipole_host_tests::matchers::{rotation_error, vector_f64};
use epipole_host_tests::scenes::{AbsoluteScene, CENTRE, FOCAL, Motion, Scene, Shape};
use epipole_host_tests::{for_each_case, in_both_scalars, share_of};

const N: usize = 100;

fn camera<T: Real>() -> Pinhole<T> {
    Pinhole::new(lit(FOCAL), lit(FOCAL), lit(CENTRE.0), lit(CENTRE.1)).expect("positive")
}

fn problem(shape: Shape, noise_px: f64, outliers: f64, seed: u64) -> AbsoluteScene {
    let scene = Scene::new(Motion::General, N).shape(shape).noise_px(noise_px).outliers(outliers);
    AbsoluteScene::generate(&scene, seed)
}

fn run<T: Real>(
    pixels: &[Vector2<T>],
    points: &[Vector3<T>],
    options: &AbsolutePoseOptions<T>,
) -> AbsolutePoseEstimate<T> {
    let mut storage = AbsolutePoseStorage::<T, N>::new();
    absolute_pose(&camera(), pixels, points, options, &mut storage.workspace()).expect("well-formed")
}

fn options<T: Real>(max_error_px: f64) -> AbsolutePoseOptions<T> {
    let mut options = AbsolutePoseOptions::default();
    options.max_error_px = lit(max_error_px);
    options
}

in_both_scalars! {
    fn the_pose_under_outliers<T>() {
        for outliers in [0.0, 0.3, 0.6] {
            share_of(60, |seed, _| {
                let p = problem(Shape::Volume, 1.0, outliers, seed);
                let estimate = run::<T>(&p.pixels(), &p.points(), &options(3.0));
                let again = run::<T>(&p.pixels(), &p.points(), &options(3.0));
                assert_eq!(estimate, again);
                estimate.pose().is_some_and(|pose| {
                    let moved = vector_f64(&pose.translation.vector) - p.pose.translation.vector;
                    rotation_error(&pose.rotation, &p.pose.rotation) < 5e-3 && moved.norm() < 0.15
                })
            })
            .assert_at_least(1.0);
        }
    }

    fn a_gravity_prior_helps_or_is_left_aside<T>() {
        let mut iterations = [0u32; 2];
        for_each_case(30, |seed, rng| {
            let p = problem(Shape::Volume, 1.0, 0.5, seed);
            let (pixels, points) = (p.pixels::<T>(), p.points::<T>());
            let plain = run(&pixels, &points, &options(3.0));
            let down = Vector3::new(0.0, 1.0, 0.2);
            let prior = |error_rad: f64, rng: &mut epipole_host_tests::Rng| {
                let axis = down.cross(&rng.direction()).normalize() * error_rad;
                let camera = p.pose.rotation * (epipole::nalgebra::UnitQuaternion::new(axis) * down);
                let mut options = options(3.0);
                options.gravity = Some(GravityPrior { world: down.map(lit::<T>), camera: camera.map(lit), sigma_rad: lit(0.009) });
                options
            };
            let aided = run(&pixels, &points, &prior(0.006, rng));
            assert!(matches!(aided.gravity, Some(PriorFit::Fits(_))), "{:?}", aided.gravity);
            let error = |e: &AbsolutePoseEstimate<T>| rotation_error(&e.pose().expect("a pose").rotation, &p.pose.rotation);
            assert!(error(&aided) < 5e-3);
            iterations[0] += plain.report.spent.iterations;
            iterations[1] += aided.report.spent.iterations;
            let wrong = run(&pixels, &points, &prior(0.17, rng));
            assert!(matches!(wrong.gravity, Some(PriorFit::Contradicted(_))), "{:?}", wrong.gravity);
            let apart = rotation_error(&wrong.pose().expect("a pose").rotation, &plain.pose().expect("a pose").rotation);
            assert!(apart < 1e-3, "{apart}");
        });
        assert!(iterations[1] * 2 < iterations[0] || std::env::var("EPIPOLE_SEED").is_ok(), "{iterations:?}");
    }

    /// A prior does no harm where the correspondences are far better than the threshold says, and the covariance knows.
    fn a_prior_does_not_outweigh_good_correspondences<T>() {
        let (mut plain, mut aided, mut predicted) = (0.0, 0.0, 0.0);
        for_each_case(40, |seed, rng| {
            let p = problem(Shape::Volume, 0.1, 0.2, seed);
            let (pixels, points) = (p.pixels::<T>(), p.points::<T>());
            let down = Vector3::new(0.0, 1.0, 0.2).normalize();
            let tilt = down.cross(&rng.direction()).normalize() * (1e-3 * rng.normal());
            let seen = p.pose.rotation * (epipole::nalgebra::UnitQuaternion::new(tilt) * down);
            let gravity = GravityPrior { world: down.map(lit::<T>), camera: seen.map(lit), sigma_rad: lit(1e-3) };
            for (gravity, squares) in [(None, &mut plain), (Some(gravity), &mut aided)] {
                let mut options = options::<T>(4.0);
                options.gravity = gravity;
                let AbsolutePoseVerdict::Pose(found) = run(&pixels, &points, &options).verdict else { panic!("a volume") };
                let error = rotation_error(&found.pose.rotation, &p.pose.rotation).powi(2);
                *squares += error;
                if gravity.is_some() {
                    let covariance = found.covariance.expect("a volume").map(T::to_f64);
                    predicted += covariance.fixed_view::<3, 3>(0, 0).trace();
                }
            }
        });
        assert!(aided < 1.1 * plain, "{aided:e} {plain:e}");
        assert!(aided < 1.5 * predicted, "{aided:e} {predicted:e}");
    }

    /// What is believed is not asked for more: eight of ten, and six without a wrong one among them.
    fn a_few_right_matches_have_a_pose<T>() {
        share_of(30, |seed, _| {
            [(6, 0.0), (10, 0.2), (50, 0.8)].iter().all(|&(count, outliers)| {
                let scene = Scene::new(Motion::General, count).noise_px(1.0).outliers(outliers);
                let p = AbsoluteScene::generate(&scene, seed);
                let pose = run::<T>(&p.pixels(), &p.points(), &options(4.0)).pose();
                pose.is_some_and(|pose| rotation_error(&pose.rotation, &p.pose.rotation) < 0.05)
            })
        }).assert_at_least(0.96);
    }

    /// Another observation of a point is no accident, whichever pixel of that point it is paired with.
    fn points_seen_many_times_have_a_pose<T>() {
        share_of(30, |seed, rng| {
            let p = problem(Shape::Volume, 1.0, 0.0, seed);
            let (seen, known) = (p.pixels::<T>(), p.points::<T>());
            let points: Vec<_> = (0..N).map(|k| known[k % 10]).collect();
            let pixels: Vec<_> = (0..N)
                .map(|k| match k / 10 {
                    0 | 5 => seen[k % 10] + Vector2::new(rng.normal(), rng.normal()).map(lit),
                    _ => Vector2::new(rng.range(0.0, 640.0), rng.range(0.0, 480.0)).map(lit),
                })
                .collect();
            let pose = run::<T>(&pixels, &points, &options(4.0)).pose();
            pose.is_some_and(|pose| rotation_error(&pose.rotation, &p.pose.rotation) < 0.05)
        }).assert_at_least(0.9);
    }

    fn both_searches_of_a_prior_share_one_budget<T>() {
        for_each_case(10, |seed, _| {
            let p = problem(Shape::Volume, 1.0, 0.6, seed);
            let (pixels, points) = (p.pixels::<T>(), p.points::<T>());
            let mut options = options(3.0);
            // Wrong by a right angle.
            options.gravity = Some(GravityPrior { world: Vector3::y(), camera: Vector3::x(), sigma_rad: lit(0.009) });
            for limit in [8, 40, 200, 2_000] {
                let mut storage = AbsolutePoseStorage::<T, N>::new();
                let mut asked = 0;
                let mut keep_going = |spent: &Progress| {
                    assert!(spent.iterations >= asked, "counts never start again");
                    asked = spent.iterations;
                    spent.iterations < limit
                };
                let guide = Guide { scores: None, keep_going: Some(&mut keep_going) };
                let ended = absolute_pose_guided(&camera(), &pixels, &points, &options, guide, &mut storage.workspace())
                    .expect("well-formed");
                let mut again = options;
                again.ransac.budget.max_iterations = ended.report.spent.iterations;
                let again = run(&pixels, &points, &again);
                assert_eq!((again.verdict, again.gravity), (ended.verdict, ended.gravity));
                assert_eq!(again.report.spent.iterations, ended.report.spent.iterations);
                assert!(ended.report.spent.iterations <= limit + 8);
            }
        });
    }

    fn malformed_input_is_named<T>() {
        let p = problem(Shape::Volume, 0.0, 0.0, 1);
        let (mut pixels, mut points) = (p.pixels::<T>(), p.points::<T>());
        let mut storage = AbsolutePoseStorage::<T, 8>::new();
        let mut call = |pixels: &[Vector2<T>], points: &[Vector3<T>], options: &AbsolutePoseOptions<T>| {
            absolute_pose(&camera(), pixels, points, options, &mut storage.workspace()).err()
        };
        let plain = options(2.0);
        let input = |error| Some(AbsolutePoseError::Input(error));
        assert_eq!(call(&pixels[..7], &points[..6], &plain), input(InputError::LengthMismatch { first: 7, second: 6 }));
        assert_eq!(call(&pixels[..3], &points[..3], &plain), input(InputError::TooFew { given: 3, needed: 4 }));
        assert_eq!(call(&pixels[..9], &points[..9], &plain), input(InputError::TooMany { given: 9, capacity: 8 }));
        points[5].z = lit(f64::INFINITY);
        assert_eq!(call(&pixels[..8], &points[..8], &plain), input(InputError::NotFinite { array: 1, index: 5 }));
        pixels[2].x = lit(f64::NAN);
        assert_eq!(call(&pixels[..8], &points[..8], &plain), input(InputError::NotFinite { array: 0, index: 2 }));
        assert_eq!(call(&pixels, &points, &options(-1.0)), Some(AbsolutePoseError::Options(OptionsError::MaxError)));
        let mut odd = plain;
        odd.gravity = Some(GravityPrior { world: Vector3::zeros(), camera: Vector3::y(), sigma_rad: T::ONE });
        assert_eq!(call(&pixels, &points, &odd), Some(AbsolutePoseError::Gravity));
    }
}

#[test]
fn the_covariance_is_that_of_the_errors() {
    let (mut scatter, mut predicted, mut count) = (Matrix6::zeros(), Matrix6::zeros(), 0.0);
    let base = problem(Shape::Volume, 0.0, 0.0, 7);
    for_each_case(400, |_, rng| {
        let noisy: Vec<Vector2<f64>> = base
            .pixels()
            .iter()
            .map(|x: &Vector2<f64>| x + Vector2::new(rng.normal(), rng.normal()))
            .collect();
        let estimate = run::<f64>(&noisy, &base.points(), &options(6.0));
        let AbsolutePoseVerdict::Pose(found) = &estimate.verdict else { panic!("{:?}", estimate.verdict) };
        let w = log(&(found.pose.rotation * base.pose.rotation.inverse()));
        let t = found.pose.translation.vector - base.pose.translation.vector;
        let error = Vector6::new(w.x, w.y, w.z, t.x, t.y, t.z);
        scatter += error * error.transpose();
        predicted += found.covariance.expect("a volume");
        count += 1.0;
    });
    if count > 300.0 {
        // 400 samples give a variance to 7 %: four of those.
        for k in 0..6 {
            let ratio = scatter[(k, k)] / predicted[(k, k)];
            assert!((ratio - 1.0).abs() < 0.28, "{k}: {ratio}");
        }
    }
}

#[test]
fn a_fisheye_camera() {
    let fisheye = KannalaBrandt::new(
        Pinhole::new(300.0, 300.0, 400.0, 300.0).expect("positive"),
        [0.02, -0.005, 0.001, 0.0],
    )
    .expect("monotone");
    for_each_case(20, |_, rng| {
        let truth = Pose::new(rng.normal3() * 0.3, rng.direction() * 0.2);
        let (mut pixels, mut points) = (Vec::new(), Vec::new());
        while pixels.len() < N {
            let x = truth.inverse() * Point3::from(rng.direction() * rng.range(2.0, 8.0));
            if let Some(pixel) = fisheye.project(&(truth * x).coords) {
                let wrong = pixels.len() % 4 == 0;
                let at =
                    if wrong { Vector2::new(rng.range(0.0, 800.0), rng.range(0.0, 600.0)) } else { pixel };
                pixels.push(at + Vector2::new(rng.normal(), rng.normal()) * 0.3);
                points.push(x.coords);
            }
        }
        let mut storage = WideAbsolutePoseStorage::<f64, N>::new();
        let estimate = absolute_pose(&fisheye, &pixels, &points, &options(1.5), &mut storage.workspace())
            .expect("well-formed");
        let pose = estimate.pose().expect("a pose");
        assert!(rotation_error(&pose.rotation, &truth.rotation) < 3e-3);
        let refined = refine_pose(&fisheye, &pixels, &points, &pose, &RefineAbsolutePoseOptions::default())
            .expect("well-formed");
        assert!(refined.cost <= refined.initial_cost);
        assert!(rotation_error(&refined.pose.rotation, &truth.rotation) < 3e-3);
    });
}

#[test]
fn a_prior_weighs_what_it_says() {
    let p = problem(Shape::Volume, 1.0, 0.0, 3);
    let (pixels, points) = (p.pixels::<f64>(), p.points::<f64>());
    let away = Pose::from_parts(
        (p.pose.translation.vector + Vector3::new(0.5, 0.0, 0.0)).into(),
        epipole::nalgebra::UnitQuaternion::new(Vector3::new(0.0, 0.02, 0.0)) * p.pose.rotation,
    );
    let refine = |information: f64, count: usize| {
        let mut options = RefineAbsolutePoseOptions::default();
        options.prior = Some(PosePrior { pose: away, information: Matrix6::identity() * information });
        refine_pose(&camera(), &pixels[..count], &points[..count], &p.pose, &options).expect("well-formed")
    };
    let distance =
        |pose: &Pose<f64>, to: &Pose<f64>| (pose.translation.vector - to.translation.vector).norm();
    // A certain prior is obeyed, a vague one is not, and without points it is all there is.
    assert!(distance(&refine(1e12, N).pose, &away) < 1e-4);
    assert!(distance(&refine(1e-9, N).pose, &p.pose) < 0.1);
    let alone = refine(1.0, 0);
    assert!(
        distance(&alone.pose, &away) < 1e-6 && rotation_error(&alone.pose.rotation, &away.rotation) < 1e-6
    );
    assert!(alone.covariance.is_some());
}
