//! The window of bundle adjustment: recovery, memory, handles, degenerate windows, budgets, covariances.

use epipole::Real;
use epipole::bundle::{
    BundleError, BundleOptions, FrameHandle, PointHandle, PosePrior, Termination, Unknowns, Window,
    WindowError, WindowMemory, WindowStorage, prior_len, scalars_len, system_len,
};
use epipole::geometry::{Camera, CameraModel, KannalaBrandt, Pinhole, Pose};
use epipole::nalgebra::{Matrix6, UnitQuaternion, Vector2, Vector3};
use epipole::real::lit;
use epipole::robust::loss::Loss;
use epipole_host_tests::Rng;
use epipole_host_tests::bundle::HeapWindow;
use epipole_host_tests::bundle::flight::centre;
use epipole_host_tests::bundle::problem::{Problem, cast_pose, pinhole, read_back};

/// Five frames in a row, 40 points, noise, a share of gross errors, a start that is off.
fn problem(seed: u64, sigma_px: f64, gross: f64) -> Problem {
    let mut rng = Rng::new(seed);
    let mut p = Problem { fixed: 2, ..Problem::default() };
    for k in 0..5 {
        let rotation: UnitQuaternion<f64> = rng.rotation(0.1);
        let c = Vector3::new(0.5 * k as f64, 0.1 * rng.normal(), 0.1 * rng.normal());
        p.true_poses.push(Pose::from_parts((-(rotation * c)).into(), rotation));
        p.cameras.push(pinhole([500.0, 500.0, 320.0, 240.0]).unwrap());
    }
    while p.true_points.len() < 40 {
        let x = Vector3::new(rng.range(-2.0, 4.0), rng.range(-2.0, 2.0), rng.range(4.0, 9.0));
        let j = p.true_points.len();
        let mut spoilt = false;
        for (i, pose) in p.true_poses.iter().enumerate() {
            let y = pose.rotation * x + pose.translation.vector;
            let mut pixel = Vector2::new(500.0 * y.x / y.z + 320.0, 500.0 * y.y / y.z + 240.0);
            pixel += Vector2::new(rng.normal(), rng.normal()) * sigma_px;
            // One in a point at the most: with more of them a robust minimum need not be the truth.
            if rng.unit() < gross && !spoilt {
                spoilt = true;
                pixel.x += rng.range(20.0, 40.0);
            }
            p.observations.push((i, j, pixel));
        }
        p.true_points.push(x);
    }
    for (i, pose) in p.true_poses.iter().enumerate() {
        let off = if i < 2 { 0.0 } else { 1.0 };
        let turn: UnitQuaternion<f64> = rng.rotation(0.02 * off);
        p.poses.push(Pose::from_parts(
            (pose.translation.vector + rng.normal3() * 0.05 * off).into(),
            turn * pose.rotation,
        ));
    }
    p.points = p.true_points.iter().map(|x| x * (1.0 + 0.05 * rng.normal())).collect();
    p
}

fn filled<T: Real>(p: &Problem) -> (HeapWindow<T>, Vec<FrameHandle>, Vec<PointHandle>) {
    let mut memory = HeapWindow::<T>::new(p.poses.len() + 1, p.points.len() + 1, p.observations.len() + 8);
    let (frames, points) = p.fill(&mut memory.window()).unwrap();
    (memory, frames, points)
}

/// Largest error of rotation and centre.
fn worst_errors<T: Real>(p: &Problem, losses: &[Loss<T>]) -> (f64, f64) {
    let (mut memory, frames, points) = filled::<T>(p);
    let mut window = memory.window();
    for loss in losses {
        let options = BundleOptions { loss: *loss, max_iterations: 60, ..BundleOptions::default() };
        let report = window.optimise(&options).unwrap();
        assert!(report.cost_after <= report.cost_before, "{report:?}");
    }
    let (poses, _) = read_back(&window, &frames, &points);
    poses.iter().zip(&p.true_poses).fold((0.0, 0.0), |(turn, shift): (f64, f64), (estimate, truth)| {
        (
            turn.max((estimate.rotation * truth.rotation.inverse()).angle()),
            shift.max((centre(estimate) - centre(truth)).norm()),
        )
    })
}

fn recovers_the_truth<T: Real>(rotation_rad: f64, centre_m: f64) {
    for seed in 0..10 {
        let (turn, shift) = worst_errors::<T>(&problem(seed, 0.0, 0.0), &[Loss::Huber(lit(1.5))]);
        assert!(turn < rotation_rad && shift < centre_m, "seed {seed}: {turn} {shift}");
        // Gross errors: Huber first, for a redescending loss needs a good start.
        let p = problem(seed, 0.0, 0.05);
        let (turn, shift) = worst_errors::<T>(&p, &[Loss::Huber(lit(1.5))]);
        for loss in [Loss::Tukey(lit(5.0)), Loss::GemanMcClure(lit(2.0)), Loss::Cauchy(lit(0.3))] {
            let (a, b) = worst_errors::<T>(&p, &[Loss::Huber(lit(1.5)), loss]);
            assert!(a < 1e-3 && b < 5e-3, "seed {seed} {loss:?}: {a} {b}");
            assert!(a <= turn && b <= shift, "seed {seed} {loss:?}: {a} {b}, Huber {turn} {shift}");
        }
    }
}

#[test]
fn recovers_the_truth_f64() {
    recovers_the_truth::<f64>(1e-7, 1e-6);
}

#[test]
fn recovers_the_truth_f32() {
    recovers_the_truth::<f32>(1e-5, 1e-4);
}

#[test]
fn f32_finds_the_minimum_of_f64() {
    for seed in 0..10 {
        let p = problem(seed, 1.0, 0.05);
        let loss = Loss::Huber(1.0);
        let cost = |double: bool| {
            let (poses, points) = if double {
                let (mut memory, f, x) = filled::<f64>(&p);
                let mut window = memory.window();
                let _ = window
                    .optimise(&BundleOptions { loss, max_iterations: 60, ..Default::default() })
                    .unwrap();
                read_back(&window, &f, &x)
            } else {
                let (mut memory, f, x) = filled::<f32>(&p);
                let mut window = memory.window();
                let loss = Loss::Huber(1.0);
                let _ = window
                    .optimise(&BundleOptions { loss, max_iterations: 60, ..Default::default() })
                    .unwrap();
                read_back(&window, &f, &x)
            };
            p.cost(&poses, &points, &loss)
        };
        let (single, double) = (cost(false), cost(true));
        assert!(single <= double * (1.0 + 1e-5), "seed {seed}: {single} {double}");
    }
}

/// At the minimum the cost's central differences vanish in every direction of a free frame and point: cost, residuals
/// and Jacobians agree. Through a fisheye, so that the camera's Jacobian is put to use.
#[test]
fn the_minimum_is_stationary() {
    let mut p = problem(3, 1.0, 0.05);
    p.observations.retain(|(i, j, _)| (i + j) % 4 != 0);
    let camera: Camera<f64> =
        KannalaBrandt::new(Pinhole::new(500.0, 500.0, 320.0, 240.0).unwrap(), [0.02, -0.01, 0.003, 0.0])
            .unwrap()
            .into();
    let mut memory = HeapWindow::<f64>::new(5, 40, 200);
    let mut window = memory.window();
    let frames: Vec<_> = p.poses.iter().map(|pose| window.add_frame(camera, pose).unwrap()).collect();
    let points: Vec<_> = p.points.iter().map(|x| window.add_point(x).unwrap()).collect();
    for (i, j, pixel) in &p.observations {
        window.add_observation(frames[*i], points[*j], pixel, 1.3).unwrap();
    }
    // The gauge by priors and a distance, so that these are in the sum too.
    let information = Matrix6::from_fn(|i, j| if i == j { 900.0 } else { 25.0 });
    window.set_pose_prior(frames[0], Some(PosePrior::full(&p.true_poses[0], &information).unwrap())).unwrap();
    window
        .set_pose_prior(frames[3], Some(PosePrior::rotation(&p.true_poses[3].rotation, 0.01).unwrap()))
        .unwrap();
    window
        .set_pose_prior(frames[4], Some(PosePrior::position(&centre(&p.true_poses[4]), 0.03).unwrap()))
        .unwrap();
    window.set_distance(frames[2], frames[1], 0.52, 0.01).unwrap();
    let options = BundleOptions {
        loss: Loss::Cauchy(2.0),
        cost_tolerance: 1e-15,
        max_iterations: 200,
        ..BundleOptions::default()
    };
    let _ = window.optimise(&options).unwrap();
    // No iteration: the report of the cost alone.
    let still = BundleOptions { max_iterations: 0, ..options };
    let cost = |window: &mut Window<'_, f64>| window.optimise(&still).unwrap().cost_after;
    let best = cost(&mut window);
    let h = 1e-4;
    for frame in &frames {
        let pose = window.pose(*frame).unwrap();
        for k in 0..6 {
            let [up, down] = [h, -h].map(|h| {
                let mut d = [0.0; 6];
                d[k] = h;
                let turn = UnitQuaternion::from_scaled_axis(Vector3::new(d[0], d[1], d[2]));
                let shift = Vector3::new(d[3], d[4], d[5]);
                let moved = Pose::from_parts((pose.translation.vector + shift).into(), turn * pose.rotation);
                window.set_pose(*frame, &moved).unwrap();
                cost(&mut window)
            });
            window.set_pose(*frame, &pose).unwrap();
            let (slope, bend) = ((up - down) / (2.0 * h), (up + down - 2.0 * best) / (h * h));
            // The Newton step that is left, against the deviation that the curvature tells.
            assert!(bend > 0.0 && (slope / bend).abs() < 1e-3 / bend.sqrt(), "{k}: {slope} {bend}");
        }
    }
    for point in &points {
        let x = window.position(*point).unwrap();
        for k in 0..3 {
            let [up, down] = [h, -h].map(|h| {
                let mut moved = x;
                moved[k] += h;
                window.set_position(*point, &moved).unwrap();
                cost(&mut window)
            });
            window.set_position(*point, &x).unwrap();
            let (slope, bend) = ((up - down) / (2.0 * h), (up + down - 2.0 * best) / (h * h));
            assert!(bend > 0.0 && (slope / bend).abs() < 1e-3 / bend.sqrt(), "{k}: {slope} {bend}");
        }
    }
}

#[test]
fn poses_alone_and_points_alone() {
    let p = problem(1, 0.0, 0.0);
    let options = BundleOptions { max_iterations: 50, ..BundleOptions::default() };
    // Points from known poses.
    let known = Problem { poses: p.true_poses.clone(), ..p.clone() };
    let (mut memory, _, points) = filled::<f64>(&known);
    let mut window = memory.window();
    let first = window.refine_point(points[0], &options).unwrap();
    assert!(first.changed && (window.position(points[0]).unwrap() - p.true_points[0]).norm() < 1e-5);
    assert_eq!(window.position(points[1]).unwrap(), p.points[1], "another point moved");
    let _ = window.optimise(&BundleOptions { unknowns: Unknowns::Points, ..options }).unwrap();
    for (point, truth) in points.iter().zip(&p.true_points) {
        assert!((window.position(*point).unwrap() - truth).norm() < 1e-5);
    }
    // A pose from known points.
    let known = Problem { points: p.true_points.clone(), ..p.clone() };
    let (mut memory, frames, _) = filled::<f64>(&known);
    let mut window = memory.window();
    let _ = window.refine_frame(frames[4], &options).unwrap();
    let off = |window: &Window<'_, f64>, k: usize| {
        (centre(&window.pose(frames[k]).unwrap()) - centre(&p.true_poses[k])).norm()
    };
    assert!(off(&window, 4) < 1e-5 && off(&window, 3) > 1e-3);
    let _ = window.optimise(&BundleOptions { unknowns: Unknowns::Frames, ..options }).unwrap();
    assert!(off(&window, 3) < 1e-5 && off(&window, 2) < 1e-5);
}

#[test]
fn a_point_report_tells_what_disagrees() {
    // All at the truth, one pixel of the first point 12 deviations off.
    let mut p = problem(1, 0.0, 0.0);
    (p.poses, p.points) = (p.true_poses.clone(), p.true_points.clone());
    p.observations[3].2.x += 12.0;
    assert_eq!((p.observations[3].0, p.observations[3].1), (3, 0));
    let (mut memory, frames, points) = filled::<f64>(&p);
    let mut window = memory.window();
    let report = window.point_report(points[0], 5.0).unwrap();
    assert_eq!((report.observations, report.outliers, report.behind), (5, 1, 0));
    assert!((report.rms_sigma - 12.0 / 5.0_f64.sqrt()).abs() < 1e-9, "{}", report.rms_sigma);
    assert_eq!(window.point_report(points[0], 13.0).unwrap().outliers, 0);
    // A camera that has turned its back sees nothing, which is no distance.
    let turn = UnitQuaternion::from_euler_angles(0.0, std::f64::consts::PI, 0.0);
    window.set_pose(frames[3], &(Pose::from_parts(Vector3::zeros().into(), turn) * p.poses[3])).unwrap();
    let report = window.point_report(points[0], 5.0).unwrap();
    assert_eq!((report.observations, report.outliers, report.behind), (5, 0, 1));
    assert!(report.rms_sigma < 1e-9);
    window.remove_point(points[0]).unwrap();
    assert_eq!(window.point_report(points[0], 5.0), Err(BundleError::StalePoint));
}

/// Points on all sides but straight behind: beyond 76 degrees off the axis the linearisation turns its axes.
fn a_fisheye_sees_to_the_side<T: Real>(tolerance: f64, most_iterations: u32) {
    let mut rng = Rng::new(31);
    let lens = KannalaBrandt::new(Pinhole::new(190.0, 190.0, 255.0, 257.0).unwrap(), [0.01, 0.001, 0.0, 0.0]);
    let exact: Camera<f64> = lens.unwrap().into();
    let c = lit::<T>;
    let pinhole = Pinhole::new(c(190.0), c(190.0), c(255.0), c(257.0)).unwrap();
    let camera: Camera<T> =
        KannalaBrandt::new(pinhole, [c(0.01), c(0.001), T::ZERO, T::ZERO]).unwrap().into();
    let mut memory = HeapWindow::<T>::new(5, 60, 300);
    let mut window = memory.window();
    let (mut truth, mut frames) = (vec![], vec![]);
    for k in 0..5 {
        let rotation: UnitQuaternion<f64> = rng.rotation(0.2);
        let centre = Vector3::new(0.4 * k as f64, 0.2 * rng.normal(), 0.2 * rng.normal());
        truth.push(Pose::from_parts((-(rotation * centre)).into(), rotation));
        let off = if k < 2 { 0.0 } else { 1.0 };
        let turn: UnitQuaternion<f64> = rng.rotation(0.02 * off);
        let shift = Vector3::new(rng.normal(), rng.normal(), rng.normal()) * 0.02 * off;
        let start = Pose::from_parts((-(turn * rotation * (centre + shift))).into(), turn * rotation);
        frames.push(window.add_frame(camera, &cast_pose(&start)).unwrap());
        window.fix_frame(frames[k], k < 2).unwrap();
    }
    let mut sideways = 0;
    while window.point_count() < 60 {
        let x = Vector3::new(rng.normal(), rng.normal(), rng.normal()).normalize() * rng.range(2.0, 6.0);
        let ys: Vec<_> = truth.iter().map(|p| p.rotation * x + p.translation.vector).collect();
        if ys.iter().any(|y| y.z / y.norm() < -0.8) {
            continue;
        }
        let noise = Vector3::new(rng.normal(), rng.normal(), rng.normal()) * 0.02;
        let point = window.add_point(&(x + noise).map(lit)).unwrap();
        for (frame, y) in frames.iter().zip(&ys) {
            sideways += usize::from(y.z.abs() < 0.2 * y.norm());
            let pixel = exact.project(y).unwrap();
            window.add_observation(*frame, point, &pixel.map(lit), T::ONE).unwrap();
        }
    }
    assert!(sideways > 30, "{sideways}");
    let options = BundleOptions { loss: Loss::Squared, ..BundleOptions::default() };
    let report = window.optimise(&options).unwrap();
    assert_eq!((report.termination, report.behind), (Termination::Converged, 0));
    // A wrong Jacobian needs more.
    assert!(report.iterations <= most_iterations, "{} iterations", report.iterations);
    for (frame, truth) in frames.iter().zip(&truth) {
        let error = (centre(&cast_pose(&window.pose(*frame).unwrap())) - centre(truth)).norm();
        assert!(error < tolerance, "{error}");
    }
}

#[test]
fn a_fisheye_sees_to_the_side_f64() {
    a_fisheye_sees_to_the_side::<f64>(1e-6, 8);
}

#[test]
fn a_fisheye_sees_to_the_side_f32() {
    a_fisheye_sees_to_the_side::<f32>(1e-4, 12);
}

#[test]
fn a_known_distance_gives_the_scale() {
    let p = problem(2, 0.3, 0.0);
    let (mut memory, frames, _) = filled::<f64>(&p);
    let mut window = memory.window();
    window.fix_frame(frames[1], false).unwrap();
    window.set_distance(frames[4], frames[0], 4.0, 0.001).unwrap();
    let _ = window.optimise(&BundleOptions { max_iterations: 100, ..BundleOptions::default() }).unwrap();
    let [a, b] = [0, 4].map(|k| centre(&window.pose(frames[k]).unwrap()));
    assert!(((a - b).norm() - 4.0).abs() < 0.01, "{}", (a - b).norm());
    assert_eq!(window.set_distance(frames[1], frames[1], 1.0, 0.1), Err(WindowError::SameFrame));
    assert_eq!(window.set_distance(frames[1], frames[0], 0.0, 0.1), Err(WindowError::NotPositive));
}

#[test]
fn memory_is_as_published() {
    const SYSTEM: usize = system_len(8);
    const ALL: usize = scalars_len(8);
    assert_eq!(ALL, SYSTEM + prior_len(8));
    assert!(size_of::<WindowStorage<f32, 8, 100, 681, SYSTEM>>() <= 24_000);
    assert!(size_of::<WindowStorage<f32, 8, 100, 681, ALL>>() <= 29_000);
    let mut storage = WindowStorage::<f32, 8, 100, 681, ALL>::new();
    let WindowMemory { header, frames, points, observations, scalars } = storage.memory();
    let short = scalars.split_at_mut(SYSTEM - 1).0;
    let told =
        Window::new(WindowMemory { header, frames, points, observations, scalars: short }).unwrap_err();
    assert_eq!(told, WindowError::MemoryTooSmall { given: SYSTEM - 1, needed: SYSTEM });
}

#[test]
fn handles_and_capacities() {
    let mut storage = WindowStorage::<f64, 2, 2, 3, { system_len(2) }>::new();
    let mut window = storage.window();
    let camera: Camera<f64> = Pinhole::new(500.0, 500.0, 320.0, 240.0).unwrap().into();
    let pose = Pose::identity();
    let f = [(); 2].map(|()| window.add_frame(camera, &pose).unwrap());
    assert_eq!(window.add_frame(camera, &pose), Err(WindowError::FramesFull));
    let bad = Pose::translation(f64::NAN, 0.0, 0.0);
    assert_eq!(window.set_pose(f[0], &bad), Err(WindowError::NotFinite));
    let x = Vector3::new(0.0, 0.0, 5.0);
    let p = [(); 2].map(|()| window.add_point(&x).unwrap());
    assert_eq!(window.add_point(&x), Err(WindowError::PointsFull));
    assert_eq!(window.set_position(p[0], &(x * f64::INFINITY)), Err(WindowError::NotFinite));
    let pixel = Vector2::new(320.0, 240.0);
    for (frame, point) in [(f[1], p[1]), (f[0], p[0]), (f[1], p[0])] {
        window.add_observation(frame, point, &pixel, 1.0).unwrap();
    }
    assert_eq!(window.add_observation(f[1], p[0], &pixel, 1.0), Err(WindowError::DuplicateObservation));
    assert_eq!(window.add_observation(f[0], p[1], &pixel, 1.0), Err(WindowError::ObservationsFull));
    let nan = Vector2::new(1.0, f64::NAN);
    assert_eq!(window.add_observation(f[0], p[1], &nan, 1.0), Err(WindowError::NotFinite));
    assert_eq!(window.add_observation(f[0], p[1], &pixel, 0.0), Err(WindowError::NotPositive));
    assert_eq!(window.remove_observation(f[0], p[1]), Err(WindowError::NoSuchObservation));
    assert_eq!(window.marginalise_frame(f[0], &Loss::Squared), Err(WindowError::NoPriorMemory));
    let seen: Vec<_> = window.observations_of(p[0]).unwrap().map(|o| o.0).collect();
    assert_eq!(seen, f);
    window.remove_frame(f[0]).unwrap();
    assert_eq!(window.observation_count(), 2);
    assert_eq!(window.pose(f[0]), Err(WindowError::StaleFrame));
    let again = window.add_frame(camera, &pose).unwrap();
    assert!(again.index() == f[0].index() && again != f[0]);
    assert_eq!(window.remove_frame(f[0]), Err(WindowError::StaleFrame));
    window.remove_point(p[0]).unwrap();
    assert_eq!(window.position(p[0]), Err(WindowError::StalePoint));
    assert_eq!((window.frame_count(), window.point_count(), window.observation_count()), (2, 1, 1));
    // The view is made again and finds everything.
    assert_eq!(storage.window().observation_count(), 1);
    storage.window().clear();
    assert_eq!(storage.window().position(p[1]), Err(WindowError::StalePoint));
}

/// The bits of everything that may not change where a window is refused.
fn state(window: &Window<'_, f64>) -> Vec<u64> {
    let poses = window.frame_handles().flat_map(|f| {
        let pose = window.pose(f).unwrap();
        pose.rotation.coords.iter().chain(&pose.translation.vector).map(|x| x.to_bits()).collect::<Vec<_>>()
    });
    let points = window.point_handles().flat_map(|p| {
        let x = window.position(p).unwrap();
        let seen = window
            .observations_of(p)
            .unwrap()
            .flat_map(|(f, pixel)| [f.index() as u64, pixel.x.to_bits(), pixel.y.to_bits()]);
        x.iter().map(|x| x.to_bits()).chain(seen).collect::<Vec<_>>()
    });
    poses.chain(points).collect()
}

#[test]
fn degenerate_windows() {
    let options = BundleOptions::<f64>::default();
    type Change = fn(&mut Window<'_, f64>, &[FrameHandle], &[PointHandle]);
    let table: [(&str, Change, BundleError); 7] = [
        (
            "no observations",
            |w, f, _| {
                f.iter().for_each(|f| {
                    let all: Vec<_> = w.point_handles().collect();
                    all.into_iter().for_each(|p| {
                        let _ = w.remove_observation(*f, p);
                    });
                })
            },
            BundleError::NoObservations,
        ),
        (
            "one frame",
            |w, f, _| f[1..].iter().for_each(|f| w.remove_frame(*f).unwrap()),
            BundleError::NoUsablePoint { behind: 0 },
        ),
        (
            "points seen once",
            |w, f, p| {
                p.iter().enumerate().for_each(|(j, p)| {
                    f.iter().enumerate().for_each(|(i, f)| {
                        if i != j % f.index().max(3) {
                            let _ = w.remove_observation(*f, *p);
                        }
                    })
                })
            },
            BundleError::NoUsablePoint { behind: 0 },
        ),
        (
            "all behind",
            |w, _, p| {
                p.iter().for_each(|p| {
                    let x = w.position(*p).unwrap();
                    w.set_position(*p, &-x).unwrap();
                })
            },
            BundleError::NoUsablePoint { behind: 200 },
        ),
        (
            "a frame without observations",
            |w, f, p| p.iter().for_each(|p| w.remove_observation(f[4], *p).unwrap()),
            BundleError::UnconstrainedFrame { frame: 4 },
        ),
        (
            "all fixed",
            |w, f, p| {
                f.iter().for_each(|f| w.fix_frame(*f, true).unwrap());
                p.iter().for_each(|p| w.fix_point(*p, true).unwrap());
            },
            BundleError::NothingFree,
        ),
        (
            "contradictory fixed frames",
            |w, f, _| {
                w.fix_frame(f[1], false).unwrap();
                w.set_distance(f[1], f[0], 9.0, 0.1).unwrap();
                w.fix_frame(f[1], true).unwrap();
            },
            BundleError::ContradictoryFixedFrames { frame: 1 },
        ),
    ];
    for (name, change, error) in table {
        let (mut memory, frames, points) = filled::<f64>(&problem(5, 1.0, 0.0));
        let mut window = memory.window();
        change(&mut window, &frames, &points);
        let before = state(&window);
        assert_eq!(window.optimise(&options).unwrap_err(), error, "{name}");
        assert_eq!(state(&window), before, "{name}: the window changed");
    }
    // What is not a measurement is not taken in.
    let (mut memory, frames, points) = filled::<f64>(&problem(5, 1.0, 0.0));
    let mut window = memory.window();
    window.remove_observation(frames[3], points[0]).unwrap();
    let before = state(&window);
    for (pixel, sigma, error) in [
        (Vector2::new(f64::NAN, 1.0), 1.0, WindowError::NotFinite),
        (Vector2::new(1.0, f64::INFINITY), 1.0, WindowError::NotFinite),
        (Vector2::new(1.0, 1.0), f64::NAN, WindowError::NotFinite),
        (Vector2::new(1.0, 1.0), -1.0, WindowError::NotPositive),
    ] {
        assert_eq!(window.add_observation(frames[3], points[0], &pixel, sigma), Err(error));
    }
    assert_eq!(state(&window), before);
    // One point seen once does no harm and stays where it is.
    let (mut memory, frames, points) = filled::<f64>(&problem(5, 1.0, 0.0));
    let mut window = memory.window();
    for frame in &frames[1..] {
        window.remove_observation(*frame, points[7]).unwrap();
    }
    let there = window.position(points[7]).unwrap();
    let report = window.optimise(&options).unwrap();
    assert_eq!((report.unused_points, window.position(points[7]).unwrap()), (1, there));
    assert_eq!(
        window.set_distance(frames[1], frames[0], 9.0, 0.1),
        Err(WindowError::ContradictoryFixedFrames)
    );
    let bad = BundleOptions { loss: Loss::Huber(f64::NAN), ..options };
    assert_eq!(window.optimise(&bad), Err(BundleError::BadOption { option: "loss" }));
    let not_semidefinite = Matrix6::from_diagonal_element(-1.0);
    assert!(PosePrior::full(&Pose::identity(), &not_semidefinite).is_err());
}

#[test]
fn budgets_and_interruption() {
    let p = problem(4, 1.0, 0.05);
    let run = |options: BundleOptions<f64>, limit: u32| {
        let (mut memory, _, _) = filled::<f64>(&p);
        let mut window = memory.window();
        window.optimise_while(&options, |progress| progress.iterations < limit).unwrap()
    };
    let options = BundleOptions::default();
    let interrupted = run(options, 2);
    assert_eq!((interrupted.termination, interrupted.iterations), (Termination::Interrupted, 2));
    assert!(interrupted.changed && interrupted.cost_after < interrupted.cost_before);
    let none = run(options, 0);
    assert!(!none.changed && none.cost_after == none.cost_before);
    let limited = run(BundleOptions { max_iterations: 3, ..options }, 99);
    assert_eq!((limited.termination, limited.iterations), (Termination::IterationLimit, 3));
    let spent = run(BundleOptions { max_evaluations: 1500, ..options }, 99);
    assert_eq!(spent.termination, Termination::BudgetSpent);
    assert!(spent.evaluations <= 1500 && spent.iterations == 2);
    assert_eq!(run(options, 99).termination, Termination::Converged);
}

/// The spread of estimates over noise is what the covariance tells.
#[test]
fn covariances_are_those_of_the_spread() {
    let truth = problem(6, 0.0, 0.0);
    let clean =
        Problem { poses: truth.true_poses.clone(), points: truth.true_points.clone(), ..truth.clone() };
    let options = BundleOptions { loss: Loss::Squared, ..BundleOptions::default() };
    let (mut frame_sum, mut point_sum, runs) = (0.0, 0.0, 200);
    let mut rng = Rng::new(77);
    for _ in 0..runs {
        let mut noisy = clean.clone();
        for (_, _, pixel) in &mut noisy.observations {
            *pixel += Vector2::new(rng.normal(), rng.normal());
        }
        let (mut memory, frames, points) = filled::<f64>(&noisy);
        let mut window = memory.window();
        let _ = window.optimise(&options).unwrap();
        let told = window.frame_covariance(frames[4], &Loss::Squared).unwrap();
        let (pose, true_pose) = (window.pose(frames[4]).unwrap(), &truth.true_poses[4]);
        let turn = (pose.rotation * true_pose.rotation.inverse()).scaled_axis();
        let shift = pose.translation.vector - true_pose.translation.vector;
        let e = epipole::nalgebra::Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z);
        frame_sum += e.dot(&told.pose.cholesky().unwrap().solve(&e));
        let of_point = window.point_covariance(points[3], &Loss::Squared).unwrap();
        let d = window.position(points[3]).unwrap() - truth.true_points[3];
        point_sum += d.dot(&of_point.cholesky().unwrap().solve(&d));
    }
    // Means of chi-squared over its degrees of freedom: deviations sqrt(2 / (6 * 200)) and sqrt(2 / (3 * 200)).
    let (frame, point) = (frame_sum / (6 * runs) as f64, point_sum / (3 * runs) as f64);
    assert!((frame - 1.0).abs() < 0.15 && (point - 1.0).abs() < 0.2, "{frame} {point}");
    // Without the gauge nothing is determined.
    let (mut memory, frames, points) = filled::<f64>(&clean);
    let mut window = memory.window();
    window.fix_frame(frames[1], false).unwrap();
    assert_eq!(window.frame_covariance(frames[4], &Loss::Squared), Err(BundleError::Unobservable));
    assert!(window.point_covariance(points[3], &Loss::Squared).is_err());
    assert_eq!(window.frame_covariance(frames[0], &Loss::Squared), Err(BundleError::NothingFree));
}
