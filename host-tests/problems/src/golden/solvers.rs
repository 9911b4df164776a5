//! `epipole::solvers` on exact scenes.

use epipole::Real;
use epipole::solvers as s;
use epipole_exercise::Sink;

use crate::{Geometry, TwoView};

const SCENES: u32 = 8;

fn scenes(geometry: Geometry) -> impl Iterator<Item = TwoView<8>> {
    (0..SCENES).map(move |k| TwoView::new(geometry, k))
}

pub(super) fn relpose_5pt<T: Real>(sink: &mut Sink) {
    for scene in scenes(Geometry::General) {
        let [x1, x2] = scene.bearings::<T, 5>();
        for e in &s::relpose_5pt(&x1, &x2) {
            sink.finite(&e.0);
        }
        for pose in &s::relpose_5pt_poses(&x1, &x2) {
            sink.finite_pose(pose);
        }
        let [x1, x2] = scene.bearings::<f32, 5>();
        for e in &s::relpose_5pt_wide(&x1, &x2) {
            sink.finite(&e.0);
        }
    }
}

pub(super) fn relpose_7pt<T: Real>(sink: &mut Sink) {
    for scene in scenes(Geometry::General) {
        let [x1, x2] = scene.bearings::<T, 7>();
        for f in &s::relpose_7pt(&x1, &x2) {
            sink.finite(&f.0);
        }
    }
}

pub(super) fn relpose_8pt<T: Real>(sink: &mut Sink) {
    for scene in scenes(Geometry::General) {
        let [x1, x2] = scene.bearings::<T, 8>();
        for e in s::relpose_8pt(&x1, &x2).iter().flatten() {
            sink.finite(&e.0);
        }
        for f in s::fundamental_8pt(&x1, &x2).iter().flatten() {
            sink.finite(&f.0);
        }
    }
}

pub(super) fn relpose_upright_3pt<T: Real>(sink: &mut Sink) {
    for scene in scenes(Geometry::Upright) {
        let [x1, x2] = scene.bearings::<T, 3>();
        for pose in &s::relpose_upright_3pt(&x1, &x2) {
            sink.finite_pose(pose);
        }
    }
}

pub(super) fn homography<T: Real>(sink: &mut Sink) {
    for scene in scenes(Geometry::Planar) {
        let [x1, x2] = scene.bearings::<T, 4>();
        if let Some(h) = s::homography_4pt(&x1, &x2) {
            sink.finite(&h.0);
        }
        let [x1, x2] = scene.bearings::<T, 8>();
        for h in s::homography_npt(&x1, &x2).iter().flatten() {
            sink.finite(&h.0);
        }
    }
}

pub(super) fn p3p<T: Real>(sink: &mut Sink) {
    for scene in scenes(Geometry::General) {
        let [_, bearings] = scene.bearings::<T, 3>();
        for pose in &s::p3p(&bearings, &scene.points()) {
            sink.finite_pose(pose);
        }
    }
}

pub(super) fn abspose_upright_2pt<T: Real>(sink: &mut Sink) {
    for scene in scenes(Geometry::Upright) {
        let [_, bearings] = scene.bearings::<T, 2>();
        for pose in &s::abspose_upright_2pt(&bearings, &scene.points()) {
            sink.finite_pose(pose);
        }
    }
}

pub(super) fn abspose_npt<T: Real>(sink: &mut Sink) {
    for scene in scenes(Geometry::General) {
        let [_, bearings] = scene.bearings::<T, 8>();
        for pose in s::abspose_npt(&bearings, &scene.points::<T, 8>()).iter().flatten() {
            sink.finite_pose(pose);
        }
    }
}

pub(super) fn abspose_planar<T: Real>(sink: &mut Sink) {
    // A target on its own plane z = 0, seen by a camera in front of it.
    for scene in scenes(Geometry::General) {
        let pose = scene.pose::<T>();
        let target = scene.x1.map(|x| x.map(epipole::real::lit::<T>));
        let bearings = target.map(|x| {
            let mut seen = pose.rotation * x.push(T::ZERO) + pose.translation.vector;
            seen.z += T::TWO + T::TWO;
            seen
        });
        for found in s::abspose_planar(&bearings, &target).iter().flatten() {
            sink.finite_pose(&found.pose);
            sink.finite(&[found.rms_rad]);
        }
    }
}

pub(super) fn resection<T: Real>(sink: &mut Sink) {
    for scene in scenes(Geometry::General) {
        let [_, pixels] = scene.pixels::<T>();
        let projection = s::resection_dlt(&pixels, &scene.points::<T, 8>());
        for p in projection.iter().flatten() {
            sink.finite(p);
            if let Some(parts) = s::decompose_projection(p) {
                sink.finite(&parts.calibration);
                sink.finite_pose(&parts.pose);
            }
        }
    }
}

pub(super) fn rotation<T: Real>(sink: &mut Sink) {
    for scene in scenes(Geometry::General) {
        let [x1, _] = scene.bearings::<T, 8>();
        let pose = scene.pose::<T>();
        let x2 = x1.map(|x| pose.rotation * x);
        if let Some(q) = s::rotation_2pt(&[x1[0], x1[1]], &[x2[0], x2[1]]) {
            sink.finite(&q.coords);
        }
        for q in s::rotation_npt(&x1, &x2).iter().flatten() {
            sink.finite(&q.coords);
        }
    }
}

pub(super) fn translation<T: Real>(sink: &mut Sink) {
    for scene in scenes(Geometry::General) {
        let [x1, x2] = scene.bearings::<T, 8>();
        let rotation = scene.pose::<T>().rotation;
        if let Some(t) = s::translation_2pt(&rotation, &[x1[0], x1[1]], &[x2[0], x2[1]]) {
            sink.finite(&t);
        }
        for t in s::translation_npt(&rotation, &x1, &x2).iter().flatten() {
            sink.finite(t);
        }
    }
}

pub(super) fn absolute_orientation<T: Real>(sink: &mut Sink) {
    for scene in scenes(Geometry::General) {
        let (a, pose) = (scene.points::<T, 8>(), scene.pose::<T>());
        let b = a.map(|x| (pose.rotation * x + pose.translation.vector) * T::TWO);
        for found in s::absolute_orientation_npt(&a, &b).iter().flatten() {
            sink.finite_pose(found);
        }
        for found in s::absolute_orientation_with_scale_npt(&a, &b).iter().flatten() {
            sink.finite_pose(&found.isometry);
            sink.finite(&[found.scaling()]);
        }
    }
}
