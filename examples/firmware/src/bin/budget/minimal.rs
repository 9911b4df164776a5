//! The minimal and linear solvers.

use core::hint::black_box;

use epipole::Solutions;
use epipole::geometry::Pose;
use epipole::solvers::{
    abspose_upright_2pt, homography_4pt, p3p, relpose_5pt, relpose_5pt_poses, relpose_8pt,
    relpose_upright_3pt,
};
use epipole_problems::{Geometry, TwoView};

use crate::row::{Trial, row, trial};

type Scene = TwoView<8>;

/// Rotation error, rad, or distance of matrices, below which a problem counts as solved.
const SOLVED: f64 = 1e-3;

fn best<const N: usize>(scene: &Scene, poses: &Solutions<Pose<f32>, N>) -> f64 {
    poses.iter().map(|p| scene.rotation_error(&p.rotation)).fold(f64::INFINITY, f64::min)
}

fn rows(name: &str, geometry: Geometry, run: impl Fn(&Scene) -> Trial) {
    for problems in if cfg!(small_ram) { [0..64, 0..0] } else { [0..256, 256..4096] } {
        if !problems.is_empty() {
            row(name, problems, SOLVED, |k| run(&Scene::new(geometry, k)));
        }
    }
}

pub fn run() {
    rows("relpose_5pt_poses", Geometry::General, |scene| {
        let [x1, x2] = scene.bearings();
        trial(|| relpose_5pt_poses::<f32>(black_box(&x1), black_box(&x2)), |poses| best(scene, poses))
    });
    rows("relpose_5pt", Geometry::General, |scene| {
        let [x1, x2] = scene.bearings();
        trial(
            || relpose_5pt::<f32>(black_box(&x1), black_box(&x2)),
            |found| found.iter().map(|e| scene.essential_error(&e.0)).fold(f64::INFINITY, f64::min),
        )
    });
    rows("relpose_8pt to pose", Geometry::General, |scene| {
        let [x1, x2] = scene.bearings::<f32, 8>();
        trial(
            || {
                let e = relpose_8pt(black_box(&x1), black_box(&x2)).ok().flatten();
                e.and_then(|e| e.pose_by_cheirality(&x1, &x2)).map(|found| found.pose)
            },
            |pose| pose.map_or(f64::INFINITY, |p| scene.rotation_error(&p.rotation)),
        )
    });
    rows("relpose_8pt", Geometry::General, |scene| {
        let [x1, x2] = scene.bearings::<f32, 8>();
        trial(
            || relpose_8pt(black_box(&x1), black_box(&x2)).ok().flatten(),
            |e| e.map_or(f64::INFINITY, |e| scene.essential_error(&e.0)),
        )
    });
    rows("p3p", Geometry::General, |scene| {
        let ([_, x2], points) = (scene.bearings(), scene.points());
        trial(|| p3p::<f32>(black_box(&x2), black_box(&points)), |poses| best(scene, poses))
    });
    rows("abspose_upright_2pt", Geometry::Upright, |scene| {
        let ([_, x2], points) = (scene.bearings(), scene.points());
        trial(|| abspose_upright_2pt::<f32>(black_box(&x2), black_box(&points)), |poses| best(scene, poses))
    });
    rows("relpose_upright_3pt", Geometry::Upright, |scene| {
        let [x1, x2] = scene.bearings();
        trial(|| relpose_upright_3pt::<f32>(black_box(&x1), black_box(&x2)), |poses| best(scene, poses))
    });
    rows("homography_4pt", Geometry::Planar, |scene| {
        let [x1, x2] = scene.bearings();
        trial(
            || homography_4pt::<f32>(black_box(&x1), black_box(&x2)),
            |h| h.map_or(f64::INFINITY, |h| scene.homography_error(&h.0)),
        )
    });
}
