//! The essential matrices and poses of five bearing pairs.

use epipole::Real;
use epipole::geometry::Essential;
use epipole::geometry::cheirality::in_front_of_both;
use epipole::nalgebra::{Matrix3, Vector3};
use epipole::real::lit;
use epipole::solvers::{relpose_5pt, relpose_5pt_poses, relpose_5pt_wide};
use epipole_host_tests::cases::{for_each_case, share_of};
use epipole_host_tests::in_both_scalars;
use epipole_host_tests::matchers::{
    best, epipolar_residual, essential_error, essential_violation, matrix_f64, pose_error,
    projective_distance,
};
use epipole_host_tests::oracle::essential_matrices;
use epipole_host_tests::scenes::{Motion, Scene};
use epipole_host_tests::tolerances::{
    EPIPOLAR_RESIDUAL, ESSENTIAL_CONSTRAINT, FIVE_POINT_CONSTRAINT, FIVE_POINT_ROOT, SOLVED_ROTATION,
};

const MOTIONS: [Motion; 4] = [Motion::General, Motion::Small, Motion::RandomPose, Motion::Forward];

type Solver = fn(&[Vector3<f32>; 5], &[Vector3<f32>; 5]) -> epipole::Solutions<Essential<f32>, 10>;
type Pairs<T> = ([Vector3<T>; 5], [Vector3<T>; 5]);

fn pairs<T: Real>(motion: Motion, noise_px: f64, seed: u64) -> Pairs<T> {
    let (x1, x2) = Scene::new(motion, 5).noise_px(noise_px).generate(seed).bearings();
    (x1.try_into().unwrap(), x2.try_into().unwrap())
}

/// The share of noise-free problems that have to be solved.
fn wanted<T: Real>(motion: Motion) -> f64 {
    match (size_of::<T>() == 4, motion) {
        (false, _) => 0.999,
        // Points of a car's view, 5 to 50 m ahead: four of the five equations nearly repeat one another.
        (true, Motion::Forward) => 0.93,
        (true, Motion::Small) => 0.97,
        (true, _) => 0.99,
    }
}

in_both_scalars! {
    fn recovers_the_motion<T>() {
        for motion in MOTIONS {
            share_of(2000, |seed, _| {
                let truth = Scene::new(motion, 5).generate(seed).pose;
                let (x1, x2) = pairs::<T>(motion, 0.0, seed);
                best(relpose_5pt(&x1, &x2).iter().map(|e| essential_error(&e.0, &truth).0)) < SOLVED_ROTATION.of::<T>()
            })
            .assert_at_least(wanted::<T>(motion));
        }
    }

    fn recovers_the_pose<T>() {
        for motion in [Motion::General, Motion::Small] {
            share_of(1000, |seed, _| {
                let truth = Scene::new(motion, 5).generate(seed).pose;
                let (x1, x2) = pairs::<T>(motion, 0.0, seed);
                let poses = relpose_5pt_poses(&x1, &x2);
                for pose in &poses {
                    assert!(x1.iter().zip(&x2).all(|(a, b)| in_front_of_both(pose, a, b)));
                }
                best(poses.iter().map(|p| pose_error(p, &truth).0)) < SOLVED_ROTATION.of::<T>()
            })
            .assert_at_least(wanted::<T>(motion) - 0.005);
        }
    }

    fn every_solution_satisfies_the_constraints<T>() {
        for_each_case(1000, |seed, rng| {
            let (x1, x2) = pairs::<T>(MOTIONS[rng.index(4)], 100.0 * rng.unit(), seed);
            for e in &relpose_5pt(&x1, &x2) {
                assert!((matrix_f64(&e.0).norm() - 1.0).abs() < ESSENTIAL_CONSTRAINT.of::<T>());
                assert!(essential_violation(&e.0) < FIVE_POINT_CONSTRAINT.of::<T>(), "{}", essential_violation(&e.0));
                for (a, b) in x1.iter().zip(&x2) {
                    assert!(epipolar_residual(&e.0, a, b) < EPIPOLAR_RESIDUAL.of::<T>());
                }
            }
        });
    }

    fn malformed_input_has_no_solution<T>() {
        let (x1, x2) = pairs::<T>(Motion::General, 0.0, 1);
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for k in 0..5 {
                for axis in 0..3 {
                    let mut y = x1;
                    y[k][axis] = lit(bad);
                    assert!(relpose_5pt(&y, &x2).is_empty() && relpose_5pt(&x2, &y).is_empty());
                    assert!(relpose_5pt_poses(&y, &x2).is_empty());
                }
            }
        }
    }

    fn dependent_equations_have_no_solution<T>() {
        let (x1, x2) = pairs::<T>(Motion::General, 0.0, 2);
        for (k, l) in [(0, 1), (1, 4), (2, 3)] {
            let (mut y1, mut y2) = (x1, x2);
            (y1[k], y2[k]) = (x1[l], x2[l]);
            assert!(relpose_5pt(&y1, &y2).is_empty(), "repeated pair {k} {l}");
            let (mut y1, y2) = (x1, x2);
            y1[k] = Vector3::zeros();
            assert!(relpose_5pt(&y1, &y2).is_empty(), "zero bearing {k}");
        }
        assert!(relpose_5pt(&[x1[0]; 5], &[x2[0]; 5]).is_empty());
    }

    /// Pure rotation, no motion, points on a line, wild scales: whatever is returned is finite and essential.
    fn degenerate_scenes_give_sound_matrices<T>() {
        for_each_case(300, |seed, rng| {
            let motion = if rng.index(2) == 0 { Motion::PureRotation } else { Motion::Still };
            let (mut x1, x2) = pairs::<T>(motion, 0.0, seed);
            if rng.index(2) == 0 {
                let (a, b) = (x1[0], x1[1]);
                for (k, x) in x1.iter_mut().enumerate() {
                    *x = a + (b - a) * lit::<T>(k as f64);
                }
            }
            let scale = [1e-30, 1e-18, 1e-9, 1.0, 1e9, 1e18, 1e30][rng.index(7)];
            let x1 = x1.map(|x| x * lit::<T>(scale));
            for e in &relpose_5pt(&x1, &x2) {
                assert!(essential_violation(&e.0) < FIVE_POINT_CONSTRAINT.of::<T>());
            }
            for pose in &relpose_5pt_poses(&x1, &x2) {
                assert!(pose.to_homogeneous().iter().all(|v| v.to_f64().is_finite()));
            }
        });
    }
}

fn covers(a: &[Matrix3<f64>], b: &[Matrix3<f64>]) -> usize {
    b.iter().filter(|m| best(a.iter().map(|n| projective_distance(*m, n))) > FIVE_POINT_ROOT.f64).count()
}

/// Roots lost, spurious and found twice, against the double-double solver, as shares of the real roots.
#[test]
fn finds_every_real_root_once() {
    let (mut roots, mut lost, mut spurious, mut twice) = (0, 0, 0, 0);
    for_each_case(4000, |seed, rng| {
        let motion = MOTIONS[seed as usize % 4];
        let noise_px = if rng.index(2) == 0 { 0.0 } else { 1.0 };
        let (x1, x2) = pairs::<f64>(motion, noise_px, seed);
        let truth = essential_matrices(&x1, &x2);
        let found: Vec<_> = relpose_5pt(&x1, &x2).into_iter().map(|e| e.0).collect();
        let missing = covers(&found, &truth);
        let excess = covers(&truth, &found);
        roots += truth.len();
        lost += missing;
        spurious += excess;
        twice += (found.len() - excess).saturating_sub(truth.len() - missing);
    });
    let share = |n: usize| n as f64 / roots.max(1) as f64;
    println!("{roots} real roots: {lost} lost, {spurious} spurious, {twice} twice");
    assert!(share(lost) <= 5e-4 && share(spurious) <= 5e-4 && share(twice) <= 5e-4);
}

#[test]
fn order_length_and_frame_of_the_points_do_not_matter() {
    share_of(500, |seed, rng| {
        let (x1, x2) = pairs::<f64>(MOTIONS[rng.index(4)], 1.0, seed);
        let solutions: Vec<_> = relpose_5pt(&x1, &x2).into_iter().map(|e| e.0).collect();
        let order = rng.permutation(5);
        let (r1, r2) = (rng.rotation(3.0).to_rotation_matrix(), rng.rotation(3.0).to_rotation_matrix());
        let lengths: Vec<f64> = (0..5).map(|_| rng.range(0.1, 10.0)).collect();
        let y1 = std::array::from_fn(|k| r1 * x1[order[k]] * lengths[k]);
        let y2 = std::array::from_fn(|k| r2 * x2[order[k]]);
        let turned: Vec<_> =
            relpose_5pt(&y1, &y2).iter().map(|e| r2.inverse().matrix() * e.0 * r1.matrix()).collect();
        covers(&solutions, &turned) == 0 && covers(&turned, &solutions) == 0
    })
    // One in hundreds has a pair of roots so close that rounding decides whether it is real.
    .assert_at_least(0.995);
}

#[test]
fn exchanging_the_views_transposes() {
    share_of(500, |seed, rng| {
        let (x1, x2) = pairs::<f64>(MOTIONS[rng.index(4)], 1.0, seed);
        let forward: Vec<_> = relpose_5pt(&x1, &x2).into_iter().map(|e| e.0).collect();
        let backward: Vec<_> = relpose_5pt(&x2, &x1).into_iter().map(|e| e.0.transpose()).collect();
        covers(&forward, &backward) == 0 && covers(&backward, &forward) == 0
    })
    .assert_at_least(0.995);
}

#[test]
fn wide_solves_more_small_motions() {
    let solved = |solve: Solver| {
        share_of(2000, |seed, _| {
            let truth = Scene::new(Motion::Small, 5).generate(seed).pose;
            let (x1, x2) = pairs::<f32>(Motion::Small, 0.0, seed);
            best(solve(&x1, &x2).iter().map(|e| essential_error(&e.0, &truth).0)) < SOLVED_ROTATION.f32
        })
    };
    let (wide, pure) = (solved(relpose_5pt_wide), solved(relpose_5pt));
    wide.assert_at_least(0.985);
    assert!(wide.failed.len() <= pure.failed.len());
}
