//! Scenes that leave a robust estimator nothing to find, or no more than a verdict: every sample of a search is drawn, so these
//! tests take long. They enter nothing that other tests of the estimators do not, and no lines are counted here
//! (`.ci/instrument`).

use epipole::Real;
use epipole::estimate::{
    AbsolutePoseEstimate, AbsolutePoseOptions, AbsolutePoseStorage, AbsolutePoseVerdict, FundamentalEstimate,
    FundamentalOptions, FundamentalVerdict, HomographyEstimate, HomographyOptions, HomographyVerdict,
    Unobservable, absolute_pose, fundamental, homography,
};
use epipole::geometry::{CameraModel, Pose};
use epipole::nalgebra::{Point3, Vector2, Vector3};
use epipole::real::lit;
use epipole_host_tests::matchers::rotation_error;
use epipole_host_tests::scenes::{AbsoluteScene, Motion, Scene, Shape};
use epipole_host_tests::two_view::{Memory, scene_camera};
use epipole_host_tests::{Rng, for_each_case, in_both_scalars, share_of};

/// Correspondences of a scene of two views.
const N: usize = 200;
/// Of pixels and points.
const POINTS: usize = 100;

/// The seed of searches by default.
const SEED: u64 = 1;

fn scene(shape: Shape, outliers: f64) -> Scene {
    Scene::new(Motion::General, N).shape(shape).noise_px(0.5).outliers(outliers)
}

fn homography_of<T: Real>(
    (x1, x2): (Vec<Vector2<T>>, Vec<Vector2<T>>),
    max_error_px: f64,
    seed: u64,
) -> HomographyEstimate<T> {
    let mut options = HomographyOptions::default();
    options.max_error_px = lit(max_error_px);
    options.ransac.seed = seed;
    homography(&x1, &x2, &options, &mut Memory::new(x1.len()).workspace()).expect("well-formed")
}

fn fundamental_of<T: Real>((x1, x2): (Vec<Vector2<T>>, Vec<Vector2<T>>)) -> FundamentalEstimate<T> {
    let mut options = FundamentalOptions::default();
    options.max_error_px = lit(1.5);
    fundamental(&x1, &x2, &options, &mut Memory::new(x1.len()).workspace()).expect("well-formed")
}

fn pose_of<T: Real>(
    pixels: &[Vector2<T>],
    points: &[Vector3<T>],
    max_error_px: f64,
    seed: u64,
) -> AbsolutePoseEstimate<T> {
    let mut options = AbsolutePoseOptions::default();
    options.max_error_px = lit(max_error_px);
    options.ransac.seed = seed;
    let mut storage = AbsolutePoseStorage::<T, POINTS>::new();
    absolute_pose(&scene_camera(), pixels, points, &options, &mut storage.workspace()).expect("well-formed")
}

in_both_scalars! {
    fn homographies_of_degenerate_points<T>() {
        let verdict = |shape: Shape, seed: u64| {
            homography_of::<T>(scene(shape, 0.3).generate(seed).pixels(), 2.0, SEED).verdict
        };
        // A line seen along itself is but a few points.
        share_of(30, |seed, _| match verdict(Shape::Line, seed) {
            HomographyVerdict::Unobservable(why) => why == Unobservable::Collinear,
            other => panic!("{other:?}"),
        }).assert_at_least(0.8);
        for_each_case(30, |seed, _| {
            for distinct in [1, 2, 3] {
                let few = HomographyVerdict::Unobservable(Unobservable::TooFewDistinct);
                assert_eq!(verdict(Shape::Repeated(distinct), seed), few, "{distinct}");
            }
        });
        for_each_case(30, |seed, _| {
            let estimate = homography_of::<T>(scene(Shape::Plane, 1.0).generate(seed).pixels(), 2.0, SEED);
            assert_eq!(estimate.verdict, HomographyVerdict::NoConsensus);
            assert_eq!(estimate.report.inliers, 0);
        });
    }

    /// A hundred thousand samples find homographies that draw view 1 together, or into a cluster of view 2: of
    /// clusters three in four met one where chance was the area of a disc.
    fn wrong_matches_alone_have_no_homography<T>() {
        for_each_case(12, |seed, rng| {
            for (count, clusters) in [(50, 0), (N, 0), (N, 6)] {
                let mut view = || {
                    let anywhere = |rng: &mut Rng| Vector2::new(rng.range(0.0, 640.0), rng.range(0.0, 480.0));
                    let centres: Vec<_> = (0..clusters).map(|_| anywhere(rng)).collect();
                    let point = |_| match centres.get((rng.unit() * clusters as f64) as usize) {
                        Some(centre) => centre + Vector2::new(rng.normal(), rng.normal()) * 25.0,
                        None => anywhere(rng),
                    };
                    (0..count).map(point).map(|x| x.map(lit)).collect::<Vec<Vector2<T>>>()
                };
                let estimate = homography_of((view(), view()), 3.0, seed);
                assert!(matches!(estimate.verdict, HomographyVerdict::NoConsensus), "{:?}", estimate.verdict);
            }
        });
    }

    fn fundamental_matrices_of_degenerate_points<T>() {
        let verdict = |shape: Shape, seed: u64| {
            fundamental_of::<T>(scene(shape, 0.3).generate(seed).pixels()).verdict
        };
        // A line seen along itself is but a few points.
        share_of(30, |seed, _| match verdict(Shape::Line, seed) {
            FundamentalVerdict::Unobservable(why) => why == Unobservable::Collinear,
            other => panic!("{other:?}"),
        }).assert_at_least(0.8);
        for distinct in [1, 2, 3, 5, 7] {
            let few = FundamentalVerdict::Unobservable(Unobservable::TooFewDistinct);
            share_of(30, |seed, _| match verdict(Shape::Repeated(distinct), seed) {
                FundamentalVerdict::Found(_) => panic!("{distinct} points have no fundamental matrix"),
                other => other == few,
            }).assert_at_least(0.9);
        }
        for_each_case(5, |seed, _| {
            let estimate = fundamental_of::<T>(scene(Shape::Volume, 1.0).generate(seed).pixels());
            assert_eq!(estimate.verdict, FundamentalVerdict::NoConsensus);
            assert_eq!(estimate.report.inliers, 0);
        });
    }

    fn verdicts_on_poses<T>() {
        for_each_case(30, |seed, rng| {
            let problem = |shape: Shape, outliers: f64| {
                let scene = Scene::new(Motion::General, POINTS).shape(shape).noise_px(0.5).outliers(outliers);
                AbsoluteScene::generate(&scene, seed)
            };
            let verdict = |p: &AbsoluteScene| pose_of::<T>(&p.pixels(), &p.points(), 2.0, SEED).verdict;
            let line = verdict(&problem(Shape::Line, 0.0));
            assert!(matches!(line, AbsolutePoseVerdict::Unobservable(Unobservable::Collinear) | AbsolutePoseVerdict::NoConsensus), "{line:?}");
            let three = verdict(&problem(Shape::Repeated(3), 0.0));
            assert!(matches!(three, AbsolutePoseVerdict::Unobservable(Unobservable::TooFewDistinct)), "{three:?}");
            let none = verdict(&problem(Shape::Volume, 1.0));
            assert!(matches!(none, AbsolutePoseVerdict::NoConsensus | AbsolutePoseVerdict::TooFewInliers), "{none:?}");
            // All axes of the world point the wrong way: what was in front is behind.
            let p = problem(Shape::Volume, 0.2);
            let flipped: Vec<Vector3<T>> = p.points::<T>().iter().map(|x| -x).collect();
            let behind = pose_of::<T>(&p.pixels(), &flipped, 2.0, SEED).verdict;
            assert!(matches!(behind, AbsolutePoseVerdict::BehindCamera), "{behind:?}");
            // A small plane far away.
            let truth = Pose::new(Vector3::new(0.1, 0.2, 12.0), Vector3::new(0.5, 0.3 * rng.unit(), 0.0));
            let flat: Vec<Vector3<f64>> = (0..POINTS)
                .map(|_| Vector3::new(rng.range(-0.3, 0.3), rng.range(-0.3, 0.3), 0.0))
                .collect();
            let pixels: Vec<Vector2<T>> = flat
                .iter()
                .map(|x| {
                    let pixel = scene_camera::<f64>().project(&(truth * Point3::from(*x)).coords).expect("in front");
                    (pixel + Vector2::new(rng.normal(), rng.normal())).map(lit)
                })
                .collect();
            let flat: Vec<Vector3<T>> = flat.iter().map(|x| x.map(lit)).collect();
            let estimate = pose_of::<T>(&pixels, &flat, 3.0, SEED);
            let poses: Vec<Pose<T>> = match &estimate.verdict {
                AbsolutePoseVerdict::PlanarAmbiguity(poses) => poses.iter().map(|p| p.pose).collect(),
                AbsolutePoseVerdict::Pose(found) => vec![found.pose],
                other => panic!("{other:?}"),
            };
            let error = poses.iter().map(|p| rotation_error(&p.rotation, &truth.rotation)).fold(9.0, f64::min);
            assert!(error < 0.2, "{error} of {}", poses.len());
        });
    }

    /// A pose that takes one cluster of points to one of pixels has inliers by chance: of such scenes one in four had a pose
    /// where chance was the area of a disc.
    fn clusters_matched_wrongly_have_no_pose<T>() {
        share_of(30, |seed, rng| {
            let clusters: Vec<_> = (0..6).map(|_| (Vector2::new(rng.range(0.0, 640.0), rng.range(0.0, 480.0)), rng.normal3() * 4.0)).collect();
            let pixels: Vec<Vector2<T>> = (0..POINTS)
                .map(|_| (clusters[rng.index(6)].0 + Vector2::new(rng.normal(), rng.normal()) * 25.0).map(lit))
                .collect();
            let points: Vec<Vector3<T>> = (0..POINTS).map(|_| (clusters[rng.index(6)].1 + rng.normal3() * 0.3).map(lit)).collect();
            pose_of(&pixels, &points, 4.0, seed).pose().is_none()
        }).assert_at_least(0.96);
    }
}
