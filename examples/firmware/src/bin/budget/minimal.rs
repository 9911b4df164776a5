//! The minimal and linear solvers, and what is asked of a few points.

use core::hint::black_box;

use epipole::Solutions;
use epipole::geometry::triangulation::ViewPair;
use epipole::geometry::{BrownConrady, CameraModel, Essential, Homography, KannalaBrandt, Pinhole, Pose};
use epipole::nalgebra::{Matrix3, Vector2, Vector3};
use epipole::solvers as s;
use epipole_problems::{Geometry, TwoView};

use crate::row::{PROBLEMS, Trial, row, trial};

type Scene = TwoView<8>;

/// Rotation error, rad, or distance of matrices, below which a problem counts as solved.
const SOLVED: f64 = 1e-3;

fn best<const N: usize>(scene: &Scene, poses: &Solutions<Pose<f32>, N>) -> f64 {
    poses.iter().map(|p| scene.rotation_error(&p.rotation)).fold(f64::INFINITY, f64::min)
}

fn best_essential<'a>(scene: &Scene, found: impl Iterator<Item = &'a Matrix3<f32>>) -> f64 {
    found.map(|e| scene.essential_error(e)).fold(f64::INFINITY, f64::min)
}

/// The problems with a known figure, all others, and hostile ones: pairs that belong to different scenes, and points
/// that coincide.
fn rows(name: &str, geometry: Geometry, run: impl Fn(&Scene) -> Trial) {
    if cfg!(small_ram) {
        row(name, "0..32", 0..32, SOLVED, |k| run(&Scene::new(geometry, k)));
        return;
    }
    row(name, "0..256", 0..PROBLEMS.min(256), SOLVED, |k| run(&Scene::new(geometry, k)));
    if PROBLEMS > 256 {
        row(name, "256..4096", 256..PROBLEMS, SOLVED, |k| run(&Scene::new(geometry, k)));
    }
    row(name, "hostile", 0..(PROBLEMS / 4).min(512), SOLVED, |k| {
        let mut scene = Scene::new(geometry, k);
        let other = Scene::new(geometry, k + 1);
        scene.x2 = other.x2;
        match k % 16 {
            13 => (scene.x1, scene.x2) = (scene.x1.map(|_| scene.x1[0]), scene.x2.map(|_| scene.x2[0])),
            14 => scene.x2 = scene.x1,
            15 => scene.x1 = scene.x1.map(|x| Vector2::new(x.x, 0.0)),
            _ => {}
        }
        run(&scene)
    });
}

pub fn run() {
    rows("relpose_5pt_poses", Geometry::General, |scene| {
        let [x1, x2] = scene.bearings();
        trial(|| s::relpose_5pt_poses::<f32>(black_box(&x1), black_box(&x2)), |poses| best(scene, poses))
    });
    rows("relpose_5pt", Geometry::General, |scene| {
        let [x1, x2] = scene.bearings();
        trial(
            || s::relpose_5pt::<f32>(black_box(&x1), black_box(&x2)),
            |found| best_essential(scene, found.iter().map(|e| &e.0)),
        )
    });
    rows("relpose_7pt", Geometry::General, |scene| {
        let [x1, x2] = scene.bearings();
        trial(
            || s::relpose_7pt::<f32>(black_box(&x1), black_box(&x2)),
            |found| best_essential(scene, found.iter().map(|f| &f.0)),
        )
    });
    rows("relpose_8pt to pose", Geometry::General, |scene| {
        let [x1, x2] = scene.bearings::<f32, 8>();
        trial(
            || {
                let e = s::relpose_8pt(black_box(&x1), black_box(&x2)).ok().flatten();
                e.and_then(|e| e.pose_by_cheirality(&x1, &x2)).map(|found| found.pose)
            },
            |pose| pose.map_or(f64::INFINITY, |p| scene.rotation_error(&p.rotation)),
        )
    });
    rows("relpose_8pt", Geometry::General, |scene| {
        let [x1, x2] = scene.bearings::<f32, 8>();
        trial(
            || s::relpose_8pt(black_box(&x1), black_box(&x2)).ok().flatten(),
            |e| best_essential(scene, e.iter().map(|e| &e.0)),
        )
    });
    rows("relpose_upright_3pt", Geometry::Upright, |scene| {
        let [x1, x2] = scene.bearings();
        trial(|| s::relpose_upright_3pt::<f32>(black_box(&x1), black_box(&x2)), |poses| best(scene, poses))
    });
    rows("homography_4pt", Geometry::Planar, |scene| {
        let [x1, x2] = scene.bearings();
        trial(
            || s::homography_4pt::<f32>(black_box(&x1), black_box(&x2)),
            |h| h.map_or(f64::INFINITY, |h| scene.homography_error(&h.0)),
        )
    });
    rows("homography_npt", Geometry::Planar, |scene| {
        let [x1, x2] = scene.bearings::<f32, 8>();
        trial(
            || s::homography_npt(black_box(&x1), black_box(&x2)).ok().flatten(),
            |h| h.map_or(f64::INFINITY, |h| scene.homography_error(&h.0)),
        )
    });
    rows("p3p", Geometry::General, |scene| {
        let ([_, x2], points) = (scene.bearings(), scene.points());
        trial(|| s::p3p::<f32>(black_box(&x2), black_box(&points)), |poses| best(scene, poses))
    });
    rows("abspose_upright_2pt", Geometry::Upright, |scene| {
        let ([_, x2], points) = (scene.bearings(), scene.points());
        trial(
            || s::abspose_upright_2pt::<f32>(black_box(&x2), black_box(&points)),
            |poses| best(scene, poses),
        )
    });
    rows("abspose_npt", Geometry::General, |scene| {
        let ([_, x2], points) = (scene.bearings::<f32, 8>(), scene.points::<f32, 8>());
        trial(
            || s::abspose_npt(black_box(&x2), black_box(&points)).unwrap_or_default(),
            |poses| best(scene, poses),
        )
    });
    rows("abspose_planar", Geometry::Planar, |scene| {
        // The plane's own frame: the target on z = 0, seen by view 2 through the plane's homography.
        let pose = scene.pose::<f32>();
        let target = scene.x1.map(|x| x.map(|c| c as f32));
        let seen = target.map(|x| pose.rotation * Vector3::new(x.x, x.y, 4.0) + pose.translation.vector);
        trial(
            || s::abspose_planar(black_box(&seen), black_box(&target)).unwrap_or_default(),
            |found| {
                found.iter().map(|f| scene.rotation_error(&f.pose.rotation)).fold(f64::INFINITY, f64::min)
            },
        )
    });
    rows("rotation_2pt", Geometry::General, |scene| {
        let [x1, _] = scene.bearings::<f32, 2>();
        let rotation = scene.pose::<f32>().rotation;
        let x2 = x1.map(|x| rotation * x);
        trial(
            || s::rotation_2pt(black_box(&x1), black_box(&x2)),
            |q| q.map_or(f64::INFINITY, |q| scene.rotation_error(&q)),
        )
    });
    rows("pose_by_cheirality", Geometry::General, |scene| {
        let [x1, x2] = scene.bearings::<f32, 8>();
        let e = Essential::from_pose(&scene.pose::<f32>());
        trial(
            || black_box(&e).pose_by_cheirality(black_box(&x1), black_box(&x2)),
            |found| found.map_or(f64::INFINITY, |f| scene.rotation_error(&f.pose.rotation)),
        )
    });
    rows("homography_motions", Geometry::Planar, |scene| {
        let h = scene.rotation + scene.translation * scene.plane.transpose();
        let h = Homography(h.map(|x| x as f32));
        trial(
            || black_box(&h).motions(),
            |m| m.iter().map(|m| scene.rotation_error(&m.pose.rotation)).fold(f64::INFINITY, f64::min),
        )
    });
    points();
}

/// What is asked of single points; solved where the point is within a thousandth.
fn points() {
    rows("triangulate_midpoint", Geometry::General, |scene| {
        let ([x1, x2], pose) = (scene.bearings::<f32, 1>(), scene.pose::<f32>());
        trial(
            || {
                ViewPair::new(black_box(&pose))
                    .triangulate_midpoint(black_box(&x1[0]), black_box(&x2[0]))
                    .point()
            },
            |point| relative(point, &scene.points::<f32, 1>()[0]),
        )
    });
    rows("triangulate_optimal", Geometry::General, |scene| {
        let ([x1, x2], pose) = (scene.bearings::<f32, 1>(), scene.pose::<f32>());
        let (a, b) = (x1[0] / x1[0].z, x2[0] / x2[0].z);
        trial(
            || ViewPair::new(black_box(&pose)).triangulate_optimal(black_box(&a), black_box(&b)).point(),
            |point| relative(point, &scene.points::<f32, 1>()[0]),
        )
    });
    let Ok(pinhole) = Pinhole::new(458.0_f32, 457.0, 367.0, 248.0) else { return };
    unproject("pinhole_unproject", &pinhole);
    if let Ok(camera) = BrownConrady::new(pinhole, [-0.283, 0.0739, 1.9e-4, 1.8e-5, 0.0]) {
        unproject("brown_conrady_unproject", &camera);
    }
    if let Ok(camera) = KannalaBrandt::new(pinhole, [-0.0138, 0.0201, -0.0127, 0.0025]) {
        unproject("kannala_brandt_unproject", &camera);
    }
}

fn relative(found: &Option<Vector3<f32>>, truth: &Vector3<f32>) -> f64 {
    found.map_or(f64::INFINITY, |x| {
        f64::from(epipole::real::sqrt((x - truth).norm_squared() / truth.norm_squared()))
    })
}

/// Pixels within 240 of the principal point; solved where the way back ends within a thousandth of a radian.
fn unproject(name: &str, camera: &impl CameraModel<f32>) {
    rows(name, Geometry::General, |scene| {
        let x = scene.x1[0];
        let ray = Vector3::new(x.x as f32, x.y as f32, 1.0);
        let pixel = camera.project(&ray).unwrap_or_else(Vector2::zeros);
        trial(
            || camera.unproject(black_box(&pixel)).ok(),
            |found| {
                found.map_or(f64::INFINITY, |f| f64::from(epipole::geometry::pose::vector_angle(&f, &ray)))
            },
        )
    });
}
