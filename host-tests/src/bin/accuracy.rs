//! Accuracy of every solver in both scalars, on exact problems: `accuracy [--problems N] [--seed N] [--only NAME]`.
//!
//! Each row is a solver on a distribution of motions. An error is the best of a solver's answers against the truth:
//! the angle of rotation in radians, or what the row names; a problem without an answer counts as infinitely wrong.
//! "solved" is the share below 1e-3 (`f32`) or 1e-6 (`f64`). The ceiling is what the same solver makes of the same
//! points in `f64` after they were rounded to `f32`: what single precision cannot do better than.

use clap::Parser;
use epipole::Real;
use epipole::geometry::Pose;
use epipole::geometry::triangulation::ViewPair;
use epipole::nalgebra::{Matrix3, UnitQuaternion, Vector3};
use epipole::real::lit;
use epipole::solvers as s;
use epipole_host_tests::bundle::problem::cast_pose;
use epipole_host_tests::matchers::{
    best, direction_error, essential_error, pose_error, relative_distance, rotation_error, transfer_angle,
};
use epipole_host_tests::tolerances::SOLVED_ROTATION;
use epipole_host_tests::{AbsoluteScene, Motion, Scene, Shape};
use indicatif::{ProgressBar, ProgressStyle};

#[derive(Parser)]
#[command(about = "Accuracy of every solver in f32 and f64, beside what rounding the input to f32 allows")]
struct Arguments {
    /// Problems a row.
    #[arg(long, default_value_t = 2000)]
    problems: u64,
    /// Seed of the first problem of each row; the others follow.
    #[arg(long, default_value_t = 1_000_000)]
    seed: u64,
    /// Only solvers whose name contains this.
    #[arg(long, default_value = "")]
    only: String,
}

/// What a solver is given, and the truth.
struct Problem {
    /// Directions in view 1, or points in space.
    a: Vec<Vector3<f64>>,
    /// Directions in view 2, or in the camera.
    b: Vec<Vector3<f64>>,
    /// The pose that takes `a` into the frame of `b`.
    pose: Pose<f64>,
    /// The homography of a planar scene.
    homography: Matrix3<f64>,
    /// The point that the first directions meet in.
    point: Vector3<f64>,
}

/// Input in the scalar under test.
struct Input<T> {
    a: Vec<Vector3<T>>,
    b: Vec<Vector3<T>>,
    pose: Pose<T>,
}

impl Problem {
    /// The measurements, through `f32` if they are to be rounded, in the scalar `T`.
    fn input<T: Real>(&self, rounded: bool) -> Input<T> {
        let cast = |x: f64| if rounded { lit(f64::from(x as f32)) } else { lit::<T>(x) };
        let list = |list: &[Vector3<f64>]| list.iter().map(|v| v.map(cast)).collect();
        Input { a: list(&self.a), b: list(&self.b), pose: cast_pose(&self.pose) }
    }
}

/// How a row's problems come about.
#[derive(Clone, Copy)]
enum Kind {
    TwoView(Shape),
    Absolute,
    /// View 1 is the world, so that the pose turns about y alone.
    UprightAbsolute,
    /// Points in two frames.
    Clouds,
}

fn problem(kind: Kind, motion: Motion, points: usize, seed: u64) -> Problem {
    let absolute = |clouds: bool| {
        let scene = AbsoluteScene::generate(&Scene::new(motion, points), seed);
        let seen = |x: &Vector3<f64>| scene.pose.rotation * x + scene.pose.translation.vector;
        let b = if clouds { scene.points.iter().map(seen).collect() } else { scene.bearings() };
        let (homography, point) = (Matrix3::zeros(), Vector3::zeros());
        Problem { a: scene.points.clone(), b, pose: scene.pose, homography, point }
    };
    let two_view = |shape: Shape| {
        let scene = Scene::new(motion, points).shape(shape).generate(seed);
        let (a, b) = scene.bearings();
        let homography = scene.homography();
        (Problem { a, b, pose: scene.pose, homography, point: scene.points[0] }, scene.points)
    };
    match kind {
        Kind::TwoView(shape) => two_view(shape).0,
        Kind::Absolute => absolute(false),
        Kind::Clouds => absolute(true),
        Kind::UprightAbsolute => {
            let (problem, points) = two_view(Shape::Volume);
            Problem { a: points, ..problem }
        }
    }
}

/// The first `N` of a list.
fn first<T: Real, const N: usize>(list: &[Vector3<T>]) -> &[Vector3<T>; N] {
    list.first_chunk().expect("a problem has enough points")
}

fn of_essentials<'a, T: Real>(matrices: impl IntoIterator<Item = &'a Matrix3<T>>, problem: &Problem) -> f64 {
    best(matrices.into_iter().map(|e| essential_error(e, &problem.pose).0))
}

fn of_poses<'a, T: Real>(poses: impl IntoIterator<Item = &'a Pose<T>>, problem: &Problem) -> f64 {
    best(poses.into_iter().map(|p| pose_error(p, &problem.pose).0))
}

fn of_rotation<T: Real>(rotation: Option<UnitQuaternion<T>>, problem: &Problem) -> f64 {
    best(rotation.map(|r| rotation_error(&r, &problem.pose.rotation)))
}

/// The largest transfer error of the points that the homography was not made from.
fn of_homography<T: Real>(h: Option<Matrix3<T>>, used: usize, problem: &Problem) -> f64 {
    let others = &problem.a[used..];
    let worst = |h: Matrix3<T>| {
        let errors = others.iter().map(|x| transfer_angle(&h, x, &(problem.homography * x)));
        errors.fold(0.0, f64::max)
    };
    best(h.map(worst))
}

/// A solver's error on a problem, rounded to `f32` or not.
type Judge = fn(&Problem, bool) -> f64;

/// A solver in both scalars.
struct Solver {
    name: &'static str,
    kind: Kind,
    points: usize,
    f32: Judge,
    f64: Judge,
    motions: &'static [Motion],
}

const MOTIONS: &[Motion] = &[Motion::General, Motion::Small, Motion::RandomPose, Motion::Forward];
/// Motions under which a plane is seen from its front in both views.
const OF_PLANES: &[Motion] = &[Motion::General, Motion::Small, Motion::Forward];
/// The motion gives the range of depths alone.
const DEPTHS: &[Motion] = &[Motion::General, Motion::Small, Motion::Forward];
const VOLUME: Kind = Kind::TwoView(Shape::Volume);
const PLANE: Kind = Kind::TwoView(Shape::Plane);

/// A [`Solver`] whose judge is a generic function of the input and the problem.
macro_rules! solver {
    ($name:literal, $kind:expr, $points:expr, $motions:expr, $judge:expr) => {{
        fn judge<T: Real>(problem: &Problem, rounded: bool) -> f64 {
            let call: fn(&Input<T>, &Problem) -> f64 = $judge;
            call(&problem.input(rounded), problem)
        }
        Solver {
            name: $name,
            kind: $kind,
            points: $points,
            f32: judge::<f32>,
            f64: judge::<f64>,
            motions: $motions,
        }
    }};
}

fn five_points<T: Real>(input: &Input<T>, problem: &Problem) -> f64 {
    of_essentials(s::relpose_5pt(first(&input.a), first(&input.b)).iter().map(|e| &e.0), problem)
}

fn two_view_solvers() -> Vec<Solver> {
    vec![
        solver!("relpose_5pt", VOLUME, 5, MOTIONS, five_points),
        // In f64 there is nothing to widen.
        Solver {
            name: "relpose_5pt_wide",
            f32: |problem, rounded| {
                let input = problem.input::<f32>(rounded);
                let found = s::relpose_5pt_wide(first(&input.a), first(&input.b));
                of_essentials(found.iter().map(|e| &e.0), problem)
            },
            ..solver!("", VOLUME, 5, MOTIONS, five_points)
        },
        solver!("relpose_5pt_poses", VOLUME, 5, MOTIONS, |i, p| {
            of_poses(&s::relpose_5pt_poses(first(&i.a), first(&i.b)), p)
        }),
        solver!("relpose_7pt", VOLUME, 7, MOTIONS, |i, p| {
            of_essentials(s::relpose_7pt(first(&i.a), first(&i.b)).iter().map(|f| &f.0), p)
        }),
        solver!("relpose_8pt, n = 8", VOLUME, 8, MOTIONS, |i, p| {
            of_essentials(s::relpose_8pt(&i.a, &i.b).ok().flatten().iter().map(|e| &e.0), p)
        }),
        solver!("relpose_8pt, n = 20", VOLUME, 20, MOTIONS, |i, p| {
            of_essentials(s::relpose_8pt(&i.a, &i.b).ok().flatten().iter().map(|e| &e.0), p)
        }),
        solver!("relpose_upright_3pt", VOLUME, 3, &[Motion::Upright], |i, p| {
            of_poses(&s::relpose_upright_3pt(first(&i.a), first(&i.b)), p)
        }),
        solver!("rotation_2pt", VOLUME, 2, &[Motion::PureRotation], |i, p| {
            of_rotation(s::rotation_2pt(first(&i.a), first(&i.b)), p)
        }),
        solver!("rotation_npt, n = 20", VOLUME, 20, &[Motion::PureRotation], |i, p| {
            of_rotation(s::rotation_npt(&i.a, &i.b).ok().flatten(), p)
        }),
        solver!("translation_2pt (direction)", VOLUME, 2, MOTIONS, |i, p| {
            let t = s::translation_2pt(&i.pose.rotation, first(&i.a), first(&i.b));
            best(t.map(|t| direction_error(&t, &p.pose.translation.vector)))
        }),
        solver!("translation_npt, n = 20 (direction)", VOLUME, 20, MOTIONS, |i, p| {
            let t = s::translation_npt(&i.pose.rotation, &i.a, &i.b).ok().flatten();
            best(t.map(|t| direction_error(&t, &p.pose.translation.vector)))
        }),
        solver!("homography_4pt (transfer of others)", PLANE, 14, OF_PLANES, |i, p| {
            of_homography(s::homography_4pt(first(&i.a), first(&i.b)).map(|h| h.0), 4, p)
        }),
        solver!("homography_npt, n = 20 (transfer of others)", PLANE, 30, OF_PLANES, |i, p| {
            let found = s::homography_npt(&i.a[..20], &i.b[..20]).ok().flatten();
            of_homography(found.map(|h| h.0), 20, p)
        }),
        solver!("triangulate_midpoint (relative distance)", VOLUME, 1, OF_PLANES, |i, p| {
            let found = ViewPair::new(&i.pose).triangulate_midpoint(&i.a[0], &i.b[0]);
            best(found.point().map(|x| relative_distance(&x, &p.point)))
        }),
        solver!("triangulate_dlt (relative distance)", VOLUME, 1, OF_PLANES, |i, p| {
            let found = ViewPair::new(&i.pose).triangulate_dlt(&i.a[0], &i.b[0]);
            best(found.point().map(|x| relative_distance(&x, &p.point)))
        }),
        solver!("triangulate_optimal (relative distance)", VOLUME, 1, OF_PLANES, |i, p| {
            let found = ViewPair::new(&i.pose).triangulate_optimal(&i.a[0], &i.b[0]);
            best(found.point().map(|x| relative_distance(&x, &p.point)))
        }),
    ]
}

fn absolute_solvers() -> Vec<Solver> {
    vec![
        solver!("p3p", Kind::Absolute, 3, DEPTHS, |i, p| of_poses(&s::p3p(first(&i.b), first(&i.a)), p)),
        solver!("abspose_upright_2pt", Kind::UprightAbsolute, 2, &[Motion::Upright], |i, p| {
            of_poses(&s::abspose_upright_2pt(first(&i.b), first(&i.a)), p)
        }),
        solver!("abspose_npt, n = 20", Kind::Absolute, 20, DEPTHS, |i, p| {
            of_poses(s::abspose_npt(&i.b, &i.a).iter().flatten(), p)
        }),
        solver!("resection_dlt, n = 20", Kind::Absolute, 20, DEPTHS, |i, p| {
            let image: Vec<_> = i.b.iter().map(|x| x.xy() / x.z).collect();
            let found = s::resection_dlt(&image, &i.a).ok().flatten();
            let pose = found.and_then(|m| s::decompose_projection(&m)).map(|parts| parts.pose);
            of_poses(pose.iter(), p)
        }),
        solver!("absolute_orientation_npt, n = 20", Kind::Clouds, 20, DEPTHS, |i, p| {
            of_poses(s::absolute_orientation_npt(&i.a, &i.b).ok().flatten().iter(), p)
        }),
    ]
}

/// Errors of one solver in one way, sorted.
struct Errors(Vec<f64>);

impl Errors {
    fn new(mut errors: Vec<f64>) -> Self {
        errors.sort_by(f64::total_cmp);
        Self(errors)
    }

    fn quantile(&self, q: f64) -> f64 {
        self.0[((self.0.len() - 1) as f64 * q).round() as usize]
    }

    fn solved(&self, limit: f64) -> f64 {
        100.0 * self.0.partition_point(|e| *e < limit) as f64 / self.0.len() as f64
    }

    fn all(&self, limit: f64) -> String {
        let [median, p99, worst] = [0.5, 0.99, 1.0].map(|q| self.quantile(q));
        format!("{median:.1e} | {p99:.1e} | {worst:.1e} | {:.2}", self.solved(limit))
    }
}

fn main() {
    let arguments = Arguments::parse();
    let mut solvers = two_view_solvers();
    solvers.extend(absolute_solvers());
    solvers.retain(|solver| solver.name.contains(&arguments.only));
    let rows: usize = solvers.iter().map(|solver| solver.motions.len()).sum();
    let style = "{bar:40} {pos}/{len} problems, {eta} left: {msg}";
    let bar = ProgressBar::new(rows as u64 * arguments.problems)
        .with_style(ProgressStyle::with_template(style).expect("a valid template"));

    println!("{} exact problems a row, seeds from {}", arguments.problems, arguments.seed);
    println!();
    println!(
        "| solver | motion | f32 median | p99 | worst | solved % | ceiling p99 | solved % | f64 median | p99 | worst | \
         solved % |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    for solver in solvers {
        bar.set_message(solver.name);
        for &motion in solver.motions {
            let (mut single, mut ceiling, mut double) = (vec![], vec![], vec![]);
            for seed in arguments.seed..arguments.seed + arguments.problems {
                let problem = problem(solver.kind, motion, solver.points, seed);
                single.push((solver.f32)(&problem, true));
                ceiling.push((solver.f64)(&problem, true));
                double.push((solver.f64)(&problem, false));
                bar.inc(1);
            }
            let single = Errors::new(single).all(SOLVED_ROTATION.f32);
            let ceiling = Errors::new(ceiling);
            let ceiling =
                format!("{:.1e} | {:.2}", ceiling.quantile(0.99), ceiling.solved(SOLVED_ROTATION.f32));
            let double = Errors::new(double).all(SOLVED_ROTATION.f64);
            bar.suspend(|| println!("| {} | {motion:?} | {single} | {ceiling} | {double} |", solver.name));
        }
    }
    bar.finish_and_clear();
}
