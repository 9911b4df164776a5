//! `epipole::geometry` and `epipole::linalg` on real scenes.

use epipole::geometry::triangulation::{Triangulation, View, ViewPair, refine_point, triangulate_dlt};
use epipole::geometry::{
    BrownConrady, Camera, CameraModel, Essential, Homography, KannalaBrandt, Pinhole, Pose, pose as p,
    residual,
};
use epipole::linalg;
use epipole::nalgebra::{Matrix3, Matrix6, Vector2, Vector6};
use epipole::{Real, real::lit};
use epipole_exercise::Sink;

use crate::{Geometry, TwoView};

/// One camera of each model, with the distortion of ordinary lenses.
pub(super) fn models<T: Real>() -> [Option<Camera<T>>; 3] {
    let c = lit::<T>;
    let Ok(pinhole) = Pinhole::new(c(458.0), c(457.0), c(367.0), c(248.0)) else { return [None; 3] };
    [
        Some(pinhole.into()),
        BrownConrady::new(pinhole, [-0.283, 0.0739, 1.9e-4, 1.8e-5, 0.0].map(c)).ok().map(Camera::from),
        KannalaBrandt::new(pinhole, [-0.0138, 0.0201, -0.0127, 0.0025].map(c)).ok().map(Camera::from),
    ]
}

pub(super) fn cameras<T: Real>(sink: &mut Sink) {
    for camera in models::<T>().iter().flatten() {
        for step in 0..32u32 {
            let (u, v) = (f64::from(step % 8) * 100.0 + 10.0, f64::from(step / 8) * 130.0 + 20.0);
            let bearing = camera.unproject_with_jacobian(&Vector2::new(lit(u), lit(v)));
            sink.flag(bearing.is_ok());
            if let Ok((bearing, jacobian)) = bearing {
                sink.finite(&bearing);
                sink.finite(&jacobian);
                if let Some((pixel, jacobian)) = camera.project_with_jacobian(&bearing) {
                    sink.finite(&pixel);
                    sink.finite(&jacobian);
                }
            }
        }
    }
}

pub(super) fn poses<T: Real>(sink: &mut Sink) {
    for k in 0..8 {
        let (a, b) = (TwoView::<1>::new(Geometry::General, k), TwoView::<1>::new(Geometry::General, k + 8));
        let (a, b) = (a.pose::<T>(), b.pose::<T>());
        let relative = p::relative(&a, &b);
        sink.finite_pose(&relative);
        let w = p::log(&relative.rotation);
        sink.finite(&w);
        sink.finite(&p::exp(&w).coords);
        sink.finite(&p::left_jacobian(&w));
        sink.finite(&p::centre(&a));
        sink.finite_pose(&p::retract(&a, &Vector6::repeat(lit(0.01))));
        sink.finite(&[p::rotation_angle(&a.rotation, &b.rotation)]);
        sink.finite(&p::tangent_basis(&a.translation.vector));
        sink.finite(p::upright(&b.translation.vector).iter().flatten());
    }
}

pub(super) fn motions_of_matrices<T: Real>(sink: &mut Sink) {
    for k in 0..8 {
        let scene = TwoView::<8>::new(Geometry::General, k);
        let [x1, x2] = scene.bearings::<T, 8>();
        let e = Essential::from_pose(&scene.pose::<T>());
        for pose in e.poses().iter().flatten() {
            sink.finite_pose(pose);
        }
        if let Some(found) = e.pose_by_cheirality(&x1, &x2) {
            sink.finite_pose(&found.pose);
            sink.count(found.in_front);
        }
        sink.finite(e.nearest().iter().flat_map(|e| &e.0));
        let scene = TwoView::<8>::new(Geometry::Planar, k);
        let [x1, _] = scene.bearings::<T, 8>();
        let h = Homography((scene.rotation + scene.translation * scene.plane.transpose()).map(lit::<T>));
        for motion in h.motions().iter().chain(&h.visible_motions(&x1)) {
            sink.finite_pose(&motion.pose);
            sink.finite(&motion.normal);
        }
    }
}

pub(super) fn triangulation<T: Real>(sink: &mut Sink) {
    for k in 0..8 {
        let scene = TwoView::<8>::new(Geometry::Ransac, k);
        let [x1, x2] = scene.bearings::<T, 8>();
        let pose = scene.pose::<T>();
        let pair = ViewPair::new(&pose);
        let poses = [Pose::identity(), pose];
        let focal = lit::<T>(crate::two_view::FOCAL);
        let Ok(camera) = Pinhole::new(focal, focal, T::ZERO, T::ZERO) else { return };
        let pixels = scene.pixels::<T>();
        for ((a, b), i) in x1.iter().zip(&x2).zip(0usize..) {
            for answer in [
                pair.triangulate_midpoint(a, b),
                pair.triangulate_dlt(a, b),
                pair.triangulate_optimal(&(a / a.z), &(b / b.z)),
                triangulate_dlt(&poses, &[*a, *b]).unwrap_or(Triangulation::Undetermined),
            ] {
                let Some(point) = answer.point() else { continue };
                sink.finite(&point);
                sink.finite(&[pair.parallax(&point)]);
                sink.finite(pair.covariance(&point, lit(0.002)).iter().flatten());
                let views = poses.map(|pose| View { camera: &camera, pose });
                let pixel = |view: usize| {
                    pixels.get(view).and_then(|x| x.get(i)).copied().unwrap_or_else(Vector2::zeros)
                };
                if let Ok(refined) = refine_point(&views, &[pixel(0), pixel(1)], &point) {
                    sink.finite(&refined.point);
                    sink.finite(&[refined.cost_px_sq]);
                }
            }
        }
    }
}

pub(super) fn residuals<T: Real>(sink: &mut Sink) {
    let scene = TwoView::<32>::new(Geometry::Ransac, 0);
    let pose = scene.pose::<T>();
    let e = Essential::from_pose(&pose).0;
    let h: Matrix3<T> = scene.rotation.map(lit);
    for ((a, b), x) in scene.x1.iter().zip(&scene.x2).zip(&scene.points) {
        let (a, b, x) = (a.map(lit::<T>), b.map(lit::<T>), x.map(lit::<T>));
        if let Some((r, jacobian)) = residual::sampson_with_jacobian(&e, &a, &b) {
            sink.finite(&[r]);
            sink.finite(&jacobian);
        }
        sink.finite(residual::symmetric_epipolar_sq(&e, &a, &b).iter());
        if let Some((r, jacobian)) = residual::transfer_with_jacobian(&h, &a, &b) {
            sink.finite(&r);
            sink.finite(&jacobian);
        }
        for camera in models::<T>().iter().flatten() {
            let pixel = Vector2::new(lit(300.0), lit(200.0));
            if let Some(r) = residual::reprojection_with_jacobians(camera, &pose, &x, &pixel) {
                sink.finite(&r.residual);
                sink.finite(&r.by_pose);
                sink.finite(&r.by_point);
            }
        }
    }
}

pub(super) fn decompositions<T: Real>(sink: &mut Sink) {
    for k in 0..8 {
        let scene = TwoView::<8>::new(Geometry::General, k);
        let [x1, x2] = scene.bearings::<T, 8>();
        let mut rows = [[T::ZERO; 9]; 8];
        for ((row, a), b) in rows.iter_mut().zip(&x1).zip(&x2) {
            for (x, value) in row.iter_mut().zip((b * a.transpose()).transpose().iter()) {
                *x = *value;
            }
        }
        let vector = linalg::null_space::<T, 8, 9, 1>(&rows);
        sink.finite(vector.iter().flatten().flatten());
        let mut qr = linalg::RowQr::<T, 9>::new();
        qr.fold(rows);
        sink.finite(qr.least_singular().iter().flat_map(|least| &least.vector));
        let m = x1.iter().zip(&x2).fold(Matrix3::zeros(), |m, (a, b)| m + b * a.transpose());
        if let Some(svd) = linalg::svd3(&m) {
            sink.finite(&svd.u);
            sink.finite(&svd.s);
            sink.finite(&svd.v);
        }
        if let Some(eigen) = linalg::symmetric_eigen(&(m.transpose() * m)) {
            sink.finite(&eigen.values);
            sink.finite(&eigen.vectors);
        }
        let a = Matrix6::from_fn(|i, j| {
            let value = rows.get(i).and_then(|row| row.get(j)).copied().unwrap_or(T::ZERO);
            if i == j { value + T::TWO } else { value }
        });
        if let Some(lu) = linalg::Lu::new(&a) {
            sink.finite(&lu.inverse());
            sink.finite(&[lu.determinant()]);
        }
        if let Some(ldlt) = linalg::Ldlt::new(&(a.transpose() * a)) {
            sink.finite(&ldlt.inverse());
        }
        // Polynomials whose roots are coordinates of the scene.
        let [a, b, c, d] = [x1[0].x, x1[1].x, x1[2].x, x1[3].x];
        sink.finite(&linalg::quadratic_roots(&[a * b, -(a + b), T::ONE]));
        sink.finite(&linalg::cubic_roots(&[-a * b * c, a * b + b * c + c * a, -(a + b + c), T::ONE]));
        sink.finite(&linalg::quartic_roots(&[a * b * c * d, c, d, -(a + b), T::ONE]));
        sink.finite(linalg::poly::real_roots_10(&[a, b, c, d, c, -a, b, -d, c, a, b], T::EPSILON).as_slice());
    }
}
