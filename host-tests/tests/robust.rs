//! The engine of `robust` on a problem of its own, and the golden table of the quality of `relative_pose`.

use std::fmt::Write;

use epipole::Real;
use epipole::estimate::{RelativePoseOptions, RelativePoseVerdict};
use epipole::linalg::LANES;
use epipole::real::lit;
use epipole::robust::{
    Budget, Estimator, Gate, RansacOptions, Sampler, Score, ScoreCounts, StopReason, Tally,
    iterations_needed, log_binomial_tail, miss_probability, probability_of_inlier_sample, rank_by_score,
    ransac, undetected_inlier_ratio,
};
use epipole_host_tests::matchers::pose_error;
use epipole_host_tests::scenes::{Motion, Scene, Shape};
use epipole_host_tests::two_view::estimate_scene;
use epipole_host_tests::{Rng, for_each_case};

/// The line y = a x + b through many points: the smallest problem with a sample, a score and a refinement.
struct Line<T> {
    points: Vec<(T, T)>,
}

impl<T: Real> Line<T> {
    fn new(rng: &mut Rng, inliers: usize, outliers: usize) -> Self {
        let mut points: Vec<(T, T)> = (0..inliers)
            .map(|_| {
                let x = rng.range(-5.0, 5.0);
                (lit(x), lit(0.5 * x + 1.0 + 0.01 * rng.normal()))
            })
            .collect();
        points.extend((0..outliers).map(|_| (lit(rng.range(-5.0, 5.0)), lit(rng.range(-5.0, 5.0)))));
        Self { points }
    }

    fn squared(&self, (a, b): (T, T), (x, y): (T, T)) -> T {
        let r = (y - a * x - b) * lit(20.0);
        r * r
    }
}

impl<T: Real> Estimator<T, 2> for Line<T> {
    type Model = (T, T);

    fn count(&self) -> u32 {
        self.points.len() as u32
    }

    fn generate(&self, sample: &[u32; 2], found: &mut impl FnMut(&(T, T))) -> bool {
        let [(x, y), (u, v)] = sample.map(|i| self.points[i as usize]);
        if x == u {
            return false;
        }
        let a = (v - y) / (u - x);
        found(&(a, y - a * x));
        true
    }

    fn score(&self, model: &(T, T), gate: &Gate<T>, counts: &mut ScoreCounts) -> Option<Score<T>> {
        let mut tally = Tally::new();
        for (k, chunk) in self.points.chunks(LANES).enumerate() {
            let mut squared = [T::ZERO; LANES];
            for (s, &p) in squared.iter_mut().zip(chunk) {
                *s = self.squared(*model, p);
            }
            tally.add_first(&squared, chunk.len());
            counts.residuals += chunk.len() as u32;
            if gate.rejects(tally.cost(), tally.inliers(), lit((LANES * (k + 1)) as f64)) {
                return None;
            }
        }
        Some(tally.score())
    }

    fn refine(&self, &(a, b): &(T, T), residuals: &mut u32) -> Option<(T, T)> {
        *residuals += self.points.len() as u32;
        let near = self.points.iter().filter(|&&p| self.squared((a, b), p) < T::ONE);
        let (mut n, mut sx, mut sy, mut sxx, mut sxy) = (T::ZERO, T::ZERO, T::ZERO, T::ZERO, T::ZERO);
        for &(x, y) in near {
            n += T::ONE;
            sx += x;
            sy += y;
            sxx += x * x;
            sxy += x * y;
        }
        let d = n * sxx - sx * sx;
        (d > T::ZERO).then(|| ((n * sxy - sx * sy) / d, (sy * sxx - sx * sxy) / d))
    }
}

fn engine_finds_the_line<T: Real>() {
    for_each_case(50, |_, rng| {
        let line = Line::<T>::new(rng, 40, 60);
        let options = RansacOptions::default();
        let consensus = ransac(&line, &options, None, 5, None);
        let ((a, b), score) = consensus.best.unwrap();
        assert!((a.to_f64() - 0.5).abs() < 0.01 && (b.to_f64() - 1.0).abs() < 0.02);
        assert!(score.inliers >= 39 && consensus.report.stop == StopReason::Confident);
        assert!(consensus.report.miss_probability <= lit(0.00101));
        assert_eq!((score.cost, score.inliers), (consensus.report.cost, consensus.report.inliers));
        let again = ransac(&line, &options, None, 5, None);
        assert_eq!(format!("{consensus:?}"), format!("{again:?}"));
    });
}

fn engine_obeys_its_limits<T: Real>() {
    for_each_case(20, |_, rng| {
        let line = Line::<T>::new(rng, 0, 100);
        let mut options = RansacOptions::<T>::default();
        let mut budget = Budget::default();
        budget.max_iterations = 37;
        options.budget = budget;
        let report = ransac(&line, &options, None, 5, None).report;
        assert_eq!((report.stop, report.spent.iterations), (StopReason::MaxIterations, 37));
        options.budget.max_residuals = 300;
        let report = ransac(&line, &options, None, 5, None).report;
        assert_eq!(report.stop, StopReason::MaxResiduals);
        assert!(report.spent.residuals <= 300 + 300);
        let mut asked = 0;
        let mut no = |_: &_| {
            asked += 1;
            false
        };
        let report = ransac(&line, &RansacOptions::default(), None, 5, Some(&mut no)).report;
        assert_eq!((report.stop, asked), (StopReason::Interrupted, 1));
    });
}

fn order_is_used<T: Real>() {
    for_each_case(20, |_, rng| {
        let line = Line::<T>::new(rng, 10, 190);
        let scores: Vec<T> = (0..200).map(|k| lit(k as f64)).collect();
        let mut order = vec![0u32; 200];
        rank_by_score(&scores, &mut order);
        let mut options = RansacOptions::default();
        options.budget.max_iterations = 30;
        let ((a, _), _) = ransac(&line, &options, Some(&order), 5, None).best.unwrap();
        assert!((a.to_f64() - 0.5).abs() < 0.02);
    });
}

/// Lines that are told apart, or not; that count as explaining the same points, or not.
struct Lines<T> {
    line: Line<T>,
    told_apart: bool,
    shared: bool,
}

impl<T: Real> Lines<T> {
    /// Two lines of which one has a point more, and so many points on neither.
    fn new(rng: &mut Rng, wrong: usize) -> Self {
        let mut line = Line::<T>::new(rng, 31, wrong);
        line.points.extend((0..30).map(|_| {
            let x = rng.range(-5.0, 5.0);
            (lit(x), lit(-0.5 * x - 1.0 + 0.01 * rng.normal()))
        }));
        Self { line, told_apart: false, shared: false }
    }
}

impl<T: Real> Estimator<T, 2> for Lines<T> {
    type Model = (T, T);
    const DISCOVERIES: u32 = 2;
    const RIVALLED_DISCOVERIES: u32 = 8;

    fn count(&self) -> u32 {
        self.line.count()
    }

    fn generate(&self, sample: &[u32; 2], found: &mut impl FnMut(&(T, T))) -> bool {
        self.line.generate(sample, found)
    }

    fn score(&self, model: &(T, T), gate: &Gate<T>, counts: &mut ScoreCounts) -> Option<Score<T>> {
        self.line.score(model, gate, counts)
    }

    fn refine(&self, model: &(T, T), residuals: &mut u32) -> Option<(T, T)> {
        self.line.refine(model, residuals)
    }

    fn differs(&self, a: &(T, T), b: &(T, T)) -> bool {
        self.told_apart && (a.0 - b.0).to_f64().abs() > 0.5
    }

    fn shares(&self, _: &(T, T), _: &(T, T), residuals: &mut u32) -> bool {
        *residuals += 1;
        self.shared
    }
}

/// Of two lines of which one has a point more, a search that tells them apart lasts longer and finds none that is worse.
fn a_rival_prolongs_the_search<T: Real>() {
    let (mut cases, mut longer) = (0, 0);
    for_each_case(50, |_, rng| {
        let mut lines = Lines::<T>::new(rng, 80);
        let once = ransac(&lines, &RansacOptions::default(), None, 5, None).report;
        lines.told_apart = true;
        let rivalled = ransac(&lines, &RansacOptions::default(), None, 5, None).report;
        assert!(rivalled.spent.iterations >= once.spent.iterations && rivalled.cost <= once.cost);
        assert!(once.rival_share == T::ZERO && (T::ZERO..=T::ONE).contains(&rivalled.rival_share));
        cases += 1;
        longer +=
            (rivalled.spent.iterations > once.spent.iterations && rivalled.rival_share > lit(0.9)) as u32;
    });
    assert!(longer > 0 || cases < 10);
}

/// A rival that explains the same points does not prolong a search of many samples, but is told.
fn a_rival_that_shares_is_none<T: Real>() {
    let (mut cases, mut longer) = (0, 0);
    for_each_case(50, |_, rng| {
        let mut lines = Lines::<T>::new(rng, 200);
        let once = ransac(&lines, &RansacOptions::default(), None, 5, None).report;
        lines.told_apart = true;
        let rivalled = ransac(&lines, &RansacOptions::default(), None, 5, None).report;
        lines.shared = true;
        let shared = ransac(&lines, &RansacOptions::default(), None, 5, None).report;
        assert_eq!((shared.spent.iterations, shared.cost), (once.spent.iterations, once.cost));
        cases += 1;
        let asked = shared.spent.residuals > once.spent.residuals && shared.rival_share > lit(0.9);
        longer += (asked && rivalled.spent.iterations > shared.spent.iterations) as u32;
    });
    assert!(longer > 0 || cases < 10);
}

fn probabilities<T: Real>() {
    assert_eq!(probability_of_inlier_sample::<T>(10, 10, 5), T::ONE);
    assert_eq!(iterations_needed::<T>(lit(0.99), 3, 100, 5), u32::MAX);
    let n = iterations_needed::<T>(lit(0.99), 50, 100, 5);
    assert!(miss_probability::<T>(n, 50, 100, 5) <= lit(0.0101));
    assert!(undetected_inlier_ratio::<T>(lit(0.99), n, 100, 5) <= lit(0.51));
    // P(B >= 3) of B(4, 1/2) is 5 / 16.
    let tail = log_binomial_tail::<T>(4, 3, lit(0.5)).to_f64();
    assert!(tail >= (5.0f64 / 16.0).ln() - 1e-6 && tail <= 0.0);
    let sample: [u32; 3] = Sampler::<T>::ranked(1, 9, 3).sample(0).unwrap();
    assert_eq!(sample, [0, 1, 2]);
}

macro_rules! both {
    ($($name:ident),*) => {
        mod f32 { $(#[test] fn $name() { super::$name::<f32>() })* }
        mod f64 { $(#[test] fn $name() { super::$name::<f64>() })* }
    };
}
both!(
    engine_finds_the_line,
    engine_obeys_its_limits,
    order_is_used,
    a_rival_prolongs_the_search,
    a_rival_that_shares_is_none,
    probabilities
);

/// Outlier share x number x scene: how many of ten problems end in the right verdict with a pose within 5 degrees, and
/// the iterations spent, as a committed table. `EPIPOLE_UPDATE_GOLDEN=1` writes it anew, on purpose.
#[test]
fn golden_quality_table() {
    let mut table = String::from("# scene points outliers right_of_10 iterations\n");
    let scenes = [
        ("general", Motion::General, Shape::Volume),
        ("small", Motion::Small, Shape::Volume),
        ("forward", Motion::Forward, Shape::Volume),
        ("planar", Motion::General, Shape::Plane),
        ("rotation", Motion::PureRotation, Shape::Volume),
        ("still", Motion::Still, Shape::Volume),
    ];
    for (name, motion, shape) in scenes {
        for points in [50, 100, 200] {
            for outliers in [0.1, 0.3, 0.5] {
                let (mut right, mut iterations) = (0, 0);
                for seed in 0..10 {
                    let problem = Scene::new(motion, points)
                        .shape(shape)
                        .noise_px(0.5)
                        .outliers(outliers)
                        .generate(seed);
                    let (estimate, _) =
                        estimate_scene::<f64>(&problem, &RelativePoseOptions::default()).unwrap();
                    iterations += estimate.report.spent.iterations;
                    let near = |pose| {
                        let (r, t) = pose_error(pose, &problem.pose);
                        r < 0.087 && t < 0.087
                    };
                    right += match &estimate.verdict {
                        RelativePoseVerdict::General(found) => shape == Shape::Volume && near(&found.pose),
                        RelativePoseVerdict::Planar(poses) => {
                            shape == Shape::Plane && poses.iter().any(|p| near(&p.pose))
                        }
                        RelativePoseVerdict::PureRotation(_) => motion == Motion::PureRotation,
                        RelativePoseVerdict::NoMotion => motion == Motion::Still,
                        _ => false,
                    } as u32;
                }
                writeln!(table, "{name} {points} {outliers} {right} {iterations}").unwrap();
            }
        }
    }
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/golden/relative_pose_quality.txt");
    if std::env::var_os("EPIPOLE_UPDATE_GOLDEN").is_some() {
        std::fs::write(path, &table).unwrap();
    }
    let golden = std::fs::read_to_string(path).expect("the golden table is committed");
    assert_eq!(table, golden, "quality changed; EPIPOLE_UPDATE_GOLDEN=1 accepts it");
}
