//! Every function of C gives the bits of the function of Rust that it stands for, in both scalars.

use epipole::bundle::{self, WindowStorage, scalars_len};
use epipole::estimate::{
    self, AbsolutePoseStorage, TwoViewStorage, WideAbsolutePoseStorage, WideTwoViewStorage,
};
use epipole::geometry::triangulation::{self as tri, Triangulation, View, ViewPair};
use epipole::geometry::{
    self as geo, BrownConrady, CameraModel, Essential, Fundamental, Homography, KannalaBrandt, Pinhole,
    residual,
};
use epipole::nalgebra::{Matrix3, Matrix6, SMatrix, UnitQuaternion, Vector2, Vector3, Vector6};
use epipole::robust::loss::Loss;
use epipole::{Real, refine, solvers};
use epipole_capi::enums::{PriorFit, RelativePosePrior, RelativePoseVerdict, TriangulationMethod};
use epipole_capi::types::{Camera, Pose};
use epipole_capi::{Status, estimates as out, options as opt, window as win};

/// The numbers of a value, by rows.
trait Numbers<T: Real> {
    fn numbers(&self) -> Vec<T>;
}
impl<T: Real, const R: usize, const C: usize> Numbers<T> for SMatrix<T, R, C> {
    fn numbers(&self) -> Vec<T> {
        self.transpose().iter().copied().collect()
    }
}
impl<T: Real> Numbers<T> for geo::Pose<T> {
    fn numbers(&self) -> Vec<T> {
        self.rotation.coords.iter().chain(self.translation.vector.iter()).copied().collect()
    }
}
impl<T: Real> Numbers<T> for Pose<T> {
    fn numbers(&self) -> Vec<T> {
        self.rotation.iter().chain(&self.translation).copied().collect()
    }
}
impl<T: Real> Numbers<T> for UnitQuaternion<T> {
    fn numbers(&self) -> Vec<T> {
        self.coords.iter().copied().collect()
    }
}
fn all<T: Real, V: Numbers<T>>(values: impl IntoIterator<Item = V>) -> Vec<T> {
    values.into_iter().flat_map(|v| v.numbers()).collect()
}
fn pose_of<T: Real>(pose: &geo::Pose<T>) -> Pose<T> {
    let n = pose.numbers();
    Pose { rotation: [n[0], n[1], n[2], n[3]], translation: [n[4], n[5], n[6]] }
}

/// Points in front of two cameras, and what they see of them.
struct Scene<T: Real> {
    camera: Pinhole<T>,
    pose: geo::Pose<T>,
    points: Vec<Vector3<T>>,
    pixels: [Vec<Vector2<T>>; 2],
    bearings: [Vec<Vector3<T>>; 2],
}

fn number<T: Real>(x: f64) -> T {
    epipole::real::lit(x)
}

fn scene<T: Real>(count: usize) -> Scene<T> {
    let camera = Pinhole::new(number(500.0), number(510.0), number(320.0), number(240.0)).unwrap();
    let w = Vector3::new(0.02, 0.1, -0.03).map(number::<T>);
    let t = Vector3::new(-0.6, 0.1, 0.3).map(number::<T>);
    let pose = geo::Pose::from_parts(t.into(), geo::pose::exp(&w));
    let point = |k: usize| {
        let k = k as f64;
        Vector3::new(2.0 * (1.7 * k).sin(), (2.3 * k).cos(), 5.0 + 2.0 * (0.9 * k).sin()).map(number)
    };
    let points: Vec<Vector3<T>> = (0..count).map(point).collect();
    let see = |x: Vector3<T>| camera.project(&x).unwrap();
    let pixels = [
        points.iter().map(|x| see(*x)).collect::<Vec<_>>(),
        points.iter().map(|x| see(pose.rotation * x + pose.translation.vector)).collect::<Vec<_>>(),
    ];
    let bearings = pixels.clone().map(|list| list.iter().map(|p| camera.unproject(p).unwrap()).collect());
    Scene { camera, pose, points, pixels, bearings }
}

fn camera_of<T: Real>(camera: &Pinhole<T>) -> Camera<T> {
    let distortion = [T::ZERO; 8];
    Camera {
        model: CameraModel_::Pinhole as u32,
        fx: camera.fx(),
        fy: camera.fy(),
        cx: camera.cx(),
        cy: camera.cy(),
        distortion,
    }
}
use epipole_capi::enums::CameraModel as CameraModel_;

macro_rules! round_trips {
    ($S:ident) => {
        mod $S {
            use super::*;
            use epipole_capi::$S::{
                camera::*, estimate::*, geometry::*, refine::*, residual::*, solvers::*, triangulation::*,
                window::*,
            };

            type S = $S;
            type M = Matrix3<S>;

            /// The pointer of vectors or poses as numbers.
            fn flat<V>(values: &[V]) -> *const S {
                values.as_ptr().cast()
            }

            /// Calls with room for 160 numbers, which must begin with those wanted and be untouched behind them.
            fn same(name: &str, answer: usize, want: &[S], call: impl FnOnce(*mut S) -> i32) {
                let mut got = [S::from_bits(7); 160];
                assert_eq!(call(got.as_mut_ptr()), answer as i32, "{name}");
                for (k, got) in got.iter().enumerate() {
                    let want = want.get(k).copied().unwrap_or(S::from_bits(7));
                    assert_eq!(got.to_bits(), want.to_bits(), "{name}, number {k}: {got} for {want}");
                }
            }

            #[test]
            fn solvers_() {
                let Scene { pose, points, bearings: [x1, x2], pixels, .. } = scene::<S>(12);
                let (a, b) = (flat(&x1), flat(&x2));
                let (w, u) = (flat(&points), flat(&pixels[0]));
                macro_rules! n {
                    ($x:ident, $n:literal) => {
                        &$x[..$n].try_into().unwrap()
                    };
                }
                // SAFETY: arrays of the sizes that the functions ask for.
                unsafe {
                    let e = solvers::relpose_5pt(n!(x1, 5), n!(x2, 5));
                    same("5pt", e.len(), &all(e.iter().map(|e| e.0)), |o| relpose_5pt(a, b, o, 10));
                    let p = solvers::relpose_5pt_poses(n!(x1, 5), n!(x2, 5));
                    assert!(!e.is_empty() && !p.is_empty());
                    same("5pt poses", p.len(), &all(p.iter().copied()), |o| {
                        relpose_5pt_poses(a, b, o.cast(), 10)
                    });
                    let f = solvers::relpose_7pt(n!(x1, 7), n!(x2, 7));
                    same("7pt", f.len(), &all(f.iter().map(|f| f.0)), |o| relpose_7pt(a, b, o, 3));
                    let e = solvers::relpose_8pt(&x1, &x2).unwrap().unwrap();
                    same("8pt", 1, &e.0.numbers(), |o| relpose_8pt(a, b, 12, o));
                    let f = solvers::fundamental_8pt(&x1, &x2).unwrap().unwrap();
                    same("F 8pt", 1, &f.0.numbers(), |o| fundamental_8pt(a, b, 12, o));
                    let p = solvers::relpose_upright_3pt(n!(x1, 3), n!(x2, 3));
                    let upright = |o: *mut S| relpose_upright_3pt(a, b, o.cast(), 4);
                    same("upright 3pt", p.len(), &all(p.iter().copied()), upright);
                    let h = solvers::homography_4pt(n!(x1, 4), n!(x1, 4)).unwrap();
                    same("H 4pt", 1, &h.0.numbers(), |o| homography_4pt(a, a, o));
                    let h = solvers::homography_npt(&x1, &x2).unwrap().unwrap();
                    same("H npt", 1, &h.0.numbers(), |o| homography_npt(a, b, 12, o));
                    let p = solvers::p3p(n!(x2, 3), n!(points, 3));
                    assert!(!p.is_empty());
                    same("p3p", p.len(), &all(p.iter().copied()), |o| p3p(b, w, o.cast(), 4));
                    let p = solvers::abspose_upright_2pt(n!(x1, 2), n!(points, 2));
                    let upright = |o: *mut S| abspose_upright_2pt(a, w, o.cast(), 2);
                    same("upright 2pt", p.len(), &all(p.iter().copied()), upright);
                    let p = solvers::abspose_npt(&x2, &points).unwrap();
                    same("npt", p.len(), &all(p.iter().copied()), |o| abspose_npt(b, w, 12, o.cast(), 4));
                    let flat_points: Vec<Vector2<S>> = points.iter().map(|x| x.xy()).collect();
                    let seen: Vec<Vector3<S>> = flat_points
                        .iter()
                        .map(|x| pose * epipole::nalgebra::Point3::new(x.x, x.y, 0.0))
                        .map(|x| x.coords + Vector3::z() * 4.0)
                        .collect();
                    let t = solvers::abspose_planar(&seen, &flat_points).unwrap();
                    let mut rms = [0.0; 2];
                    let planar = |o: *mut S| {
                        abspose_planar(flat(&seen), flat(&flat_points), 12, o.cast(), rms.as_mut_ptr(), 2)
                    };
                    same("planar", t.len(), &all(t.iter().map(|t| t.pose)), planar);
                    assert!(t.iter().zip(rms).all(|(t, rms)| t.rms_rad.to_bits() == rms.to_bits()));
                    let p = solvers::resection_dlt(&pixels[0], &points).unwrap().unwrap();
                    same("resection", 1, &p.numbers(), |o| resection_dlt(u, w, 12, o));
                    let parts = solvers::decompose_projection(&p).unwrap();
                    let mut decomposed = Pose::default();
                    same("decomposition", 1, &parts.calibration.numbers(), |o| {
                        decompose_projection(flat(&[p.transpose()]), o, &mut decomposed)
                    });
                    assert_eq!(decomposed, pose_of(&parts.pose));
                    let q = solvers::rotation_2pt(n!(x1, 2), n!(x2, 2)).unwrap();
                    same("R 2pt", 1, &q.numbers(), |o| rotation_2pt(a, b, o));
                    let q = solvers::rotation_npt(&x1, &x2).unwrap().unwrap();
                    same("R npt", 1, &q.numbers(), |o| rotation_npt(a, b, 12, o));
                    let turn = [pose.rotation];
                    let q = flat(&turn);
                    let t = solvers::translation_2pt(&pose.rotation, n!(x1, 2), n!(x2, 2)).unwrap();
                    same("t 2pt", 1, &t.numbers(), |o| translation_2pt(q, a, b, o));
                    let t = solvers::translation_npt(&pose.rotation, &x1, &x2).unwrap().unwrap();
                    same("t npt", 1, &t.numbers(), |o| translation_npt(q, a, b, 12, o));
                    let p = solvers::absolute_orientation_npt(&points, &x2).unwrap().unwrap();
                    same("orientation", 1, &p.numbers(), |o| absolute_orientation_npt(w, b, 12, o.cast()));
                    let p = solvers::absolute_orientation_with_scale_npt(&points, &x2).unwrap().unwrap();
                    let mut scale = 0.0;
                    same("similarity", 1, &p.isometry.numbers(), |o| {
                        absolute_orientation_with_scale_npt(w, b, 12, o.cast(), &mut scale)
                    });
                    assert_eq!(scale.to_bits(), p.scaling().to_bits());
                }
            }

            #[test]
            fn geometry_() {
                let Scene { camera, pose, points, bearings: [x1, x2], pixels, .. } = scene::<S>(12);
                let (a, b, p) = (flat(&x1), flat(&x2), &pose_of(&pose));
                let matrix = |m: &M| [m.transpose()];
                let (r, t) = (pose.rotation.to_rotation_matrix().into_inner(), pose.translation.vector);
                let k = matrix(&camera.matrix());
                let e = Essential::from_pose(&pose);
                let f = e.to_fundamental(&camera.matrix(), &camera.matrix()).unwrap();
                let n = Vector3::new(0.1, -0.2, 1.0).normalize();
                let h = Homography(r + t * n.transpose() / 5.0);
                // SAFETY: arrays of the sizes that the functions ask for.
                unsafe {
                    let from = |o: *mut S| pose_from_matrix(flat(&matrix(&r)), flat(&[t]), o.cast());
                    same("pose", 1, &geo::pose::from_parts(&r, &t).numbers(), from);
                    let mut t2 = [0.0; 3];
                    same("matrix", 1, &r.numbers(), |o| pose_matrix(p, o, t2.as_mut_ptr()));
                    assert_eq!(t2, [t.x, t.y, t.z]);
                    let other = pose_of(&pose.inverse());
                    let relative = geo::pose::relative(&pose, &pose.inverse());
                    same("relative", 1, &relative.numbers(), |o| pose_relative(p, &other, o.cast()));
                    same("centre", 1, &geo::pose::centre(&pose).numbers(), |o| pose_centre(p, o));
                    let delta = Vector6::new(0.1, -0.2, 0.3, 1.0, 2.0, -1.0);
                    let moved = geo::pose::retract(&pose, &delta);
                    same("retract", 1, &moved.numbers(), |o| pose_retract(p, flat(&[delta]), o.cast()));
                    same("exp", 1, &geo::pose::exp(&t).numbers(), |o| rotation_exp(flat(&[t]), o));
                    let log = geo::pose::log(&pose.rotation);
                    same("log", 1, &log.numbers(), |o| rotation_log(flat(&[pose.rotation]), o));
                    let rough = r * 1.1 + M::from_element(0.01);
                    let nearest = geo::pose::nearest_rotation(&rough).unwrap();
                    same("nearest R", 1, &nearest.numbers(), |o| nearest_rotation(flat(&matrix(&rough)), o));
                    same("upright", 1, &geo::pose::upright(&n).unwrap().numbers(), |o| {
                        upright(flat(&[n]), o)
                    });
                    same("tangents", 1, &geo::pose::tangent_basis(&n).numbers(), |o| {
                        tangent_basis(flat(&[n]), o)
                    });
                    same("E", 1, &e.0.numbers(), |o| essential_from_pose(p, o));
                    let (em, fm, hm) = (matrix(&e.0), matrix(&f.0), matrix(&h.0));
                    let (em, fm, hm, k) = (flat(&em), flat(&fm), flat(&hm), flat(&k));
                    let back = Essential::from_fundamental(&f, &camera.matrix(), &camera.matrix());
                    same("E of F", 1, &back.0.numbers(), |o| essential_from_fundamental(fm, k, k, o));
                    same("F", 1, &f.0.numbers(), |o| essential_to_fundamental(em, k, k, o));
                    let rough = matrix(&rough);
                    let nearest = Essential(rough[0].transpose()).nearest().unwrap();
                    same("nearest E", 1, &nearest.0.numbers(), |o| essential_nearest(flat(&rough), o));
                    same("poses", 4, &all(e.poses().unwrap()), |o| essential_poses(em, o.cast(), 4));
                    let best = e.pose_by_cheirality(&x1, &x2).unwrap();
                    let mut votes = [0; 2];
                    same("cheirality", 1, &best.pose.numbers(), |o| {
                        essential_pose_by_cheirality(em, a, b, 12, o.cast(), votes.as_mut_ptr())
                    });
                    assert_eq!(votes.map(|v| v as usize), [best.in_front, best.runner_up]);
                    let nearest = Fundamental(rough[0].transpose()).nearest().unwrap();
                    same("nearest F", 1, &nearest.0.numbers(), |o| fundamental_nearest(flat(&rough), o));
                    let mut e2 = [0.0; 3];
                    same("epipoles", 1, &f.epipole1().unwrap().numbers(), |o| {
                        fundamental_epipoles(fm, o, e2.as_mut_ptr())
                    });
                    assert_eq!(Vector3::from(e2), f.epipole2().unwrap());
                    let mut normals = [Vector3::<S>::zeros(); 4];
                    let motions = h.motions();
                    same("motions", motions.len(), &all(motions.iter().map(|m| m.pose)), |o| {
                        homography_motions(hm, o.cast(), normals.as_mut_ptr().cast(), 4)
                    });
                    assert!(motions.len() > 1 && motions.iter().zip(normals).all(|(m, n)| m.normal == n));
                    let motions = h.visible_motions(&x1);
                    same("visible", motions.len(), &all(motions.iter().map(|m| m.pose)), |o| {
                        homography_visible_motions(hm, a, 12, o.cast(), normals.as_mut_ptr().cast(), 4)
                    });
                    let of = h.to_pixels(&camera.matrix(), &camera.matrix()).unwrap();
                    same("to pixels", 1, &of.0.numbers(), |o| homography_to_pixels(hm, k, k, o));
                    let of = h.to_normalised(&camera.matrix(), &camera.matrix()).unwrap();
                    same("to normalised", 1, &of.0.numbers(), |o| homography_to_normalised(hm, k, k, o));
                    let inverse = h.inverse().unwrap();
                    same("inverse", 1, &inverse.0.numbers(), |o| homography_inverse(hm, o));
                    let mut mask = [9; 12];
                    let (u1, u2) = (&pixels[0], &pixels[1]);
                    let (v1, v2) = (flat(u1), flat(u2));
                    let moved = u1.iter().map(|u| h.transfer(u).unwrap());
                    same("transfer", 12, &all(moved), |o| {
                        homography_transfer(hm, v1, 12, o, mask.as_mut_ptr())
                    });
                    assert_eq!(mask, [1; 12]);
                    let inside =
                        x1.iter().zip(&x2).map(|(a, b)| geo::cheirality::in_front_of_both(&pose, a, b));
                    let inside: Vec<u8> = inside.map(u8::from).collect();
                    assert_eq!(
                        in_front_of_both(p, a, b, 12, mask.as_mut_ptr()) as usize,
                        inside.iter().filter(|i| **i == 1).count()
                    );
                    assert_eq!(mask, *inside);

                    let pairs = || u1.iter().zip(u2);
                    let m = mask.as_mut_ptr();
                    let want: Vec<S> = pairs().map(|(a, b)| residual::sampson(&f.0, a, b).unwrap()).collect();
                    same("sampson", 12, &want, |o| sampson(fm, v1, v2, 12, o, m));
                    let want: Vec<S> =
                        pairs().map(|(a, b)| residual::symmetric_epipolar_sq(&f.0, a, b).unwrap()).collect();
                    same("epipolar", 12, &want, |o| symmetric_epipolar_sq(fm, v1, v2, 12, o, m));
                    let want = pairs().map(|(a, b)| residual::transfer(&h.0, a, b).unwrap());
                    same("transfer error", 12, &all(want), |o| transfer(hm, v1, v2, 12, o, m));
                    let want: Vec<S> = pairs()
                        .map(|(a, b)| residual::symmetric_transfer_sq(&h.0, &inverse.0, a, b).unwrap())
                        .collect();
                    let back = matrix(&inverse.0);
                    same("symmetric transfer", 12, &want, |o| {
                        symmetric_transfer_sq(hm, flat(&back), v1, v2, 12, o, m)
                    });
                    let c = camera_of(&camera);
                    let want = points
                        .iter()
                        .zip(u1)
                        .map(|(x, u)| residual::reprojection(&camera, &pose, x, u).unwrap());
                    same("reprojection", 12, &all(want), |o| {
                        reprojection(&c, p, flat(&points), v1, 12, o, m)
                    });
                    let want =
                        residual::reprojection_with_jacobians(&camera, &pose, &points[0], &u1[0]).unwrap();
                    let (mut by_point, mut residual) = ([0.0; 6], [0.0; 2]);
                    same("Jacobians", 1, &want.by_pose.numbers(), |o| {
                        reprojection_with_jacobians(
                            &c,
                            p,
                            flat(&points),
                            v1,
                            residual.as_mut_ptr(),
                            o,
                            by_point.as_mut_ptr(),
                        )
                    });
                    assert_eq!(by_point.to_vec(), want.by_point.numbers());
                    assert_eq!(Vector2::from(residual), want.residual);

                    let pair = ViewPair::new(&pose);
                    for (method, kernel) in [
                        (
                            TriangulationMethod::Midpoint,
                            ViewPair::triangulate_midpoint
                                as fn(&ViewPair<S>, &Vector3<S>, &Vector3<S>) -> Triangulation<S>,
                        ),
                        (TriangulationMethod::Dlt, ViewPair::triangulate_dlt),
                        (TriangulationMethod::Optimal, ViewPair::triangulate_optimal),
                    ] {
                        let want = x1.iter().zip(&x2).map(|(a, b)| kernel(&pair, a, b).point().unwrap());
                        same("triangulation", 12, &all(want), |o| {
                            triangulate(p, method as u32, a, b, 12, o, m)
                        });
                    }
                    let angles: Vec<S> = points.iter().map(|x| pair.parallax(x)).collect();
                    same("parallax", 12, &angles, |o| parallax(p, flat(&points), 12, o));
                    let want = pair.covariance(&points[0], 1e-3).unwrap();
                    same("covariance", 1, &want.numbers(), |o| point_covariance(p, flat(&points), 1e-3, o));
                    let poses = [geo::Pose::identity(), pose];
                    let c_poses = poses.map(|p| pose_of(&p));
                    let mut found = Default::default();
                    assert_eq!(triangulate_dlt(c_poses.as_ptr(), flat(&[x1[0], x2[0]]), 2, &mut found), 1);
                    let want = tri::triangulate_dlt(&poses, &[x1[0], x2[0]]).unwrap().point().unwrap();
                    assert_eq!(Vector3::from(found.point), want);
                    let mut refined = Default::default();
                    let seen = [u1[0], u2[0]];
                    assert_eq!(
                        refine_point(
                            [c; 2].as_ptr(),
                            c_poses.as_ptr(),
                            flat(&seen),
                            2,
                            flat(&points),
                            &mut refined
                        ),
                        1
                    );
                    let want = tri::refine_point(
                        &poses.map(|pose| View { camera: &camera, pose }),
                        &seen,
                        &points[0],
                    )
                    .unwrap();
                    assert_eq!(Vector3::from(refined.point), want.point);
                    assert_eq!(refined.cost_px_sq.to_bits(), want.cost_px_sq.to_bits());
                    assert_eq!(refined.evaluations, want.evaluations);
                }
            }

            #[test]
            fn cameras() {
                let Scene { camera, points, pixels, .. } = scene::<S>(12);
                let mut c = camera_of(&camera);
                let brown = [-0.2, 0.05, 1e-3, -2e-3, 0.01];
                let fisheye = [0.02, -0.01, 3e-3, -1e-3];
                let models: [geo::Camera<S>; 3] = [
                    camera.into(),
                    BrownConrady::new(camera, brown).unwrap().into(),
                    KannalaBrandt::new(camera, fisheye).unwrap().into(),
                ];
                for (model, kernel) in (0..).zip(models) {
                    c.model = model;
                    c.distortion = Default::default();
                    let (from, len): (&[S], _) = if model == 1 { (&brown, 5) } else { (&fisheye, 4) };
                    c.distortion[..len].copy_from_slice(from);
                    let mut mask = [9; 12];
                    // SAFETY: arrays of the sizes that the functions ask for.
                    unsafe {
                        let want = points.iter().map(|x| kernel.project(x).unwrap());
                        same("project", 12, &all(want), |o| {
                            camera_project(&c, flat(&points), 12, o, mask.as_mut_ptr())
                        });
                        let want = pixels[0].iter().map(|u| kernel.unproject(u).unwrap());
                        same("unproject", 12, &all(want), |o| {
                            camera_unproject(&c, flat(&pixels[0]), 12, o, mask.as_mut_ptr())
                        });
                        assert_eq!(mask, [1; 12]);
                        let (u, j) = kernel.project_with_jacobian(&points[0]).unwrap();
                        let mut pixel = [0.0; 2];
                        same("projection's", 1, &j.numbers(), |o| {
                            camera_project_with_jacobian(&c, flat(&points), pixel.as_mut_ptr(), o)
                        });
                        assert_eq!(Vector2::from(pixel), u);
                        let (f, j) = kernel.unproject_with_jacobian(&pixels[0][0]).unwrap();
                        let mut bearing = [0.0; 3];
                        same("unprojection's", 1, &j.numbers(), |o| {
                            camera_unproject_with_jacobian(&c, flat(&pixels[0]), bearing.as_mut_ptr(), o)
                        });
                        assert_eq!(Vector3::from(bearing), f);
                    }
                }
            }

            #[test]
            fn estimators() {
                let Scene { camera, pose, points, pixels: [u1, mut u2], .. } = scene::<S>(60);
                u2.iter_mut().step_by(4).for_each(|u| *u = Vector2::new(u.y + 37.0, u.x * 0.5));
                let c = camera_of(&camera);
                let fish = KannalaBrandt::new(camera, [0.0; 4]).unwrap();
                let c_fish = Camera { model: 2, ..c };
                let scores: Vec<S> = (0..60).map(|k| (k * 7 % 60) as S).collect();
                let mut workspace = vec![0u64; 4000];
                let size = workspace.len() * 8;
                let room = workspace.as_mut_ptr().cast();
                let mut mask = [9u8; 60];
                let m = mask.as_mut_ptr();
                unsafe extern "C" fn yes(asked: *mut std::ffi::c_void, _: u32) -> i32 {
                    // SAFETY: the counter below.
                    unsafe { *asked.cast::<u32>() += 1 };
                    1
                }
                let mut asked = 0u32;
                let context: *mut std::ffi::c_void = (&raw mut asked).cast();
                macro_rules! options {
                    ($name:ident, $default:ident) => {{
                        let mut options = std::mem::MaybeUninit::<opt::$name<S>>::zeroed();
                        {
                            assert_eq!($default(options.as_mut_ptr(), size_of::<opt::$name<S>>()), 0);
                            options.assume_init()
                        }
                    }};
                }
                macro_rules! zero {
                    ($t:ty) => {
                        std::mem::zeroed::<$t>()
                    };
                }
                let flags = |w: &[bool]| w.iter().map(|&i| u8::from(i)).collect::<Vec<_>>();
                // SAFETY: arrays of the sizes that the functions ask for.
                unsafe {
                    let mut o = options!(RelativePoseOptions, relative_pose_options_default);
                    let mut e = zero!(out::RelativePoseEstimate<S>);
                    let e_size = size_of_val(&e);
                    let mut storage = TwoViewStorage::<S, 60>::new();
                    let mut w = storage.workspace();
                    let want =
                        estimate::relative_pose(&camera, &camera, &u1, &u2, &Default::default(), &mut w)
                            .unwrap();
                    let n =
                        relative_pose(&c, &c, flat(&u1), flat(&u2), 60, &o, room, size, &mut e, e_size, m);
                    assert_eq!((n, e.verdict), (1, RelativePoseVerdict::General as u32));
                    let estimate::RelativePoseVerdict::General(motion) = &want.verdict else { panic!() };
                    assert_eq!(e.poses[0], pose_of(&motion.pose));
                    assert_eq!(e.covariance[0][..25], motion.covariance.unwrap().numbers());
                    assert_eq!(
                        (e.noise_px, e.report.cost, e.report.iterations),
                        (want.noise_px, want.report.cost, want.report.spent.iterations)
                    );
                    assert_eq!(mask.to_vec(), flags(w.inliers()));
                    // Beside a plane.
                    assert_eq!((e.has_general, want.general), (0, None));
                    let beside = estimate::RelativePoseEstimate { general: Some(*motion), ..want.clone() };
                    let c_beside = out::RelativePoseEstimate::from(&beside);
                    assert_eq!((c_beside.has_general, c_beside.general.has_covariance), (1, 1));
                    assert_eq!(c_beside.general.pose, pose_of(&motion.pose));
                    assert_eq!(
                        c_beside.general.covariance.as_flattened(),
                        motion.covariance.unwrap().numbers()
                    );

                    let mut wide = WideTwoViewStorage::<S, 60>::new();
                    let mut w = wide.workspace();
                    let mut ask = |_: &epipole::robust::Progress| true;
                    let guide = epipole::robust::Guide { scores: Some(&scores), keep_going: Some(&mut ask) };
                    let want = estimate::relative_pose_guided(
                        &fish,
                        &camera,
                        &u1,
                        &u2,
                        &Default::default(),
                        guide,
                        &mut w,
                    )
                    .unwrap();
                    let n = relative_pose_guided(
                        &c_fish,
                        &c,
                        flat(&u1),
                        flat(&u2),
                        scores.as_ptr(),
                        60,
                        &o,
                        Some(yes),
                        context,
                        room,
                        size,
                        &mut e,
                        e_size,
                        m,
                    );
                    assert_eq!(n, 1);
                    assert_eq!((e.poses[0], asked > 0), (pose_of(&want.pose().unwrap()), true));
                    assert_eq!(mask.to_vec(), flags(w.inliers()));

                    let mut kernel = estimate::RelativePoseOptions::default();
                    let covariance = M::identity() * 1e-6;
                    kernel.prior =
                        Some(estimate::RelativePosePrior::Rotation { rotation: pose.rotation, covariance });
                    o.prior = RelativePosePrior::Rotation as u32;
                    o.prior_rotation = pose_of(&pose).rotation;
                    (0..3).for_each(|k| o.prior_covariance[k][k] = 1e-6);
                    let want = estimate::relative_pose(
                        &camera,
                        &camera,
                        &u1,
                        &u2,
                        &kernel,
                        &mut storage.workspace(),
                    )
                    .unwrap();
                    assert!(
                        relative_pose(&c, &c, flat(&u1), flat(&u2), 60, &o, room, size, &mut e, e_size, m)
                            >= 1
                    );
                    assert_eq!(
                        (e.poses[0], e.prior),
                        (pose_of(&want.pose().unwrap()), PriorFit::Fits as u32)
                    );
                    let down = Vector3::new(0.0, 1.0, 0.0);
                    let view2 = pose.rotation * down;
                    kernel.prior =
                        Some(estimate::RelativePosePrior::Gravity { view1: down, view2, sigma_rad: 0.01 });
                    (o.prior, o.prior_sigma_rad) = (RelativePosePrior::Gravity as u32, 0.01);
                    (o.prior_view1, o.prior_view2) = (down.into(), view2.into());
                    let want = estimate::relative_pose(
                        &camera,
                        &camera,
                        &u1,
                        &u2,
                        &kernel,
                        &mut storage.workspace(),
                    )
                    .unwrap();
                    assert!(
                        relative_pose(&c, &c, flat(&u1), flat(&u2), 60, &o, room, size, &mut e, e_size, m)
                            >= 1
                    );
                    assert_eq!(
                        (e.poses[0], e.prior != 0),
                        (pose_of(&want.pose().unwrap()), want.prior.is_some())
                    );

                    o.prior = RelativePosePrior::None as u32;
                    // No motion is larger than this.
                    o.least_motion_px = 1e4;
                    let found =
                        relative_pose(&c, &c, flat(&u1), flat(&u2), 60, &o, room, size, &mut e, e_size, m);
                    assert_eq!((found, e.verdict), (0, RelativePoseVerdict::NoMotion as u32));
                    o.least_motion_px = S::NAN;
                    let found =
                        relative_pose(&c, &c, flat(&u1), flat(&u2), 60, &o, room, size, &mut e, e_size, m);
                    assert_eq!(found, Status::NotFinite as i32);
                    o.least_motion_px = -1.0;
                    o.no_planes = 1;
                    let found =
                        relative_pose(&c, &c, flat(&u1), flat(&u2), 60, &o, room, size, &mut e, e_size, m);
                    assert_eq!((found, e.verdict), (1, RelativePoseVerdict::GeneralOrPlanar as u32));
                    o.no_planes = 0;
                    let start = pose_of(&pose);
                    let mut refined = zero!(out::RefinedRelativePose<S>);
                    let mut w = storage.workspace();
                    let want = estimate::refine_relative_pose(
                        &camera,
                        &camera,
                        &u1,
                        &u2,
                        &pose,
                        &Default::default(),
                        &mut w,
                    )
                    .unwrap()
                    .unwrap();
                    let n = refine_relative_pose(
                        &c,
                        &c,
                        flat(&u1),
                        flat(&u2),
                        60,
                        &start,
                        &o,
                        room,
                        size,
                        &mut refined,
                        size_of::<out::RefinedRelativePose<S>>(),
                        m,
                    );
                    assert_eq!((n, refined.pose), (1, pose_of(&want.pose)));
                    assert_eq!(refined.covariance.concat(), want.covariance.unwrap().numbers());

                    let o = options!(FundamentalOptions, fundamental_options_default);
                    let mut e = zero!(out::FundamentalEstimate<S>);
                    let e_size = size_of_val(&e);
                    let want = estimate::fundamental(&u1, &u2, &Default::default(), &mut storage.workspace())
                        .unwrap();
                    assert_eq!(fundamental(flat(&u1), flat(&u2), 60, &o, room, size, &mut e, e_size, m), 1);
                    assert_eq!(e.matrix.concat(), want.fundamental().unwrap().0.numbers());
                    let guide = epipole::robust::Guide { scores: Some(&scores), keep_going: None };
                    let want = estimate::fundamental_guided(
                        &u1,
                        &u2,
                        &Default::default(),
                        guide,
                        &mut storage.workspace(),
                    )
                    .unwrap();
                    assert_eq!(
                        fundamental_guided(
                            flat(&u1),
                            flat(&u2),
                            scores.as_ptr(),
                            60,
                            &o,
                            None,
                            context,
                            room,
                            size,
                            &mut e,
                            e_size,
                            m
                        ),
                        1
                    );
                    assert_eq!(e.matrix.concat(), want.fundamental().unwrap().0.numbers());

                    let o = options!(HomographyOptions, homography_options_default);
                    let h = Homography(M::new(1.1, 0.1, 5.0, -0.05, 0.9, 30.0, 1e-4, -2e-4, 1.0));
                    let mut v2: Vec<Vector2<S>> = u1.iter().map(|u| h.transfer(u).unwrap()).collect();
                    v2.iter_mut().step_by(4).for_each(|u| *u = Vector2::new(u.y + 37.0, u.x * 0.5));
                    let mut e = zero!(out::HomographyEstimate<S>);
                    let e_size = size_of_val(&e);
                    let want = estimate::homography(&u1, &v2, &Default::default(), &mut storage.workspace())
                        .unwrap();
                    assert_eq!(homography(flat(&u1), flat(&v2), 60, &o, room, size, &mut e, e_size, m), 1);
                    let estimate::HomographyVerdict::Found(model) = &want.verdict else { panic!() };
                    assert_eq!(e.homography.concat(), model.homography.0.numbers());
                    assert_eq!(e.covariance.concat(), model.covariance.unwrap().numbers());
                    assert_eq!(e.corners.map(Vector2::from), model.corners);
                    let guide = epipole::robust::Guide { scores: Some(&scores), keep_going: None };
                    let want = estimate::homography_guided(
                        &u1,
                        &v2,
                        &Default::default(),
                        guide,
                        &mut storage.workspace(),
                    )
                    .unwrap();
                    assert_eq!(
                        homography_guided(
                            flat(&u1),
                            flat(&v2),
                            scores.as_ptr(),
                            60,
                            &o,
                            None,
                            context,
                            room,
                            size,
                            &mut e,
                            e_size,
                            m
                        ),
                        1
                    );
                    assert_eq!(e.homography.concat(), want.homography().unwrap().0.numbers());

                    let mut o = options!(RefineTwoViewOptions, refine_two_view_options_default);
                    let mut kernel = refine::RefineTwoViewOptions::default();
                    kernel.loss = Loss::Cauchy(1.5);
                    (o.loss, o.loss_scale) = (Loss_::Cauchy as u32, 1.5);
                    let mut r = zero!(out::RefinedTwoView<S>);
                    let r_size = size_of_val(&r);
                    let rough = Homography(h.0 * 1.001);
                    let want = refine::homography(&u1, &v2, &rough, &kernel).unwrap().unwrap();
                    let numbers = rough.0.numbers();
                    let begin = numbers.as_ptr();
                    assert_eq!(refine_homography(flat(&u1), flat(&v2), 60, begin, &o, &mut r, r_size), 1);
                    assert_eq!(r.matrix.concat(), want.model.0.numbers());
                    assert_eq!(
                        (r.cost, r.initial_cost, r.active, r.passes),
                        (want.cost, want.initial_cost, want.active, want.passes)
                    );
                    let rough =
                        estimate::fundamental(&u1, &u2, &Default::default(), &mut storage.workspace())
                            .unwrap()
                            .fundamental()
                            .unwrap();
                    let want = refine::fundamental(&u1, &u2, &rough, &kernel).unwrap().unwrap();
                    let numbers = rough.0.numbers();
                    let begin = numbers.as_ptr();
                    assert_eq!(refine_fundamental(flat(&u1), flat(&u2), 60, begin, &o, &mut r, r_size), 1);
                    assert_eq!((r.matrix.concat(), r.cost), (want.model.0.numbers(), want.cost));
                    let zeros = [0.0; 9];
                    assert_eq!(
                        refine_fundamental(flat(&u1), flat(&u2), 60, zeros.as_ptr(), &o, &mut r, r_size),
                        0
                    );
                    let (mut wrong, mut index) = (u1.clone(), 7);
                    assert_eq!(find_not_finite(flat(&wrong), 120, &mut index), 0);
                    wrong[31].y = S::INFINITY;
                    assert_eq!(
                        refine_fundamental(flat(&wrong), flat(&u2), 60, begin, &o, &mut r, r_size),
                        Status::NotFinite as i32
                    );
                    assert_eq!((find_not_finite(flat(&wrong), 120, &mut index), index / 2), (1, 31));

                    let mut o = options!(AbsolutePoseOptions, absolute_pose_options_default);
                    let mut e = zero!(out::AbsolutePoseEstimate<S>);
                    let e_size = size_of_val(&e);
                    let mut storage = AbsolutePoseStorage::<S, 60>::new();
                    let want = estimate::absolute_pose(
                        &camera,
                        &u2,
                        &points,
                        &Default::default(),
                        &mut storage.workspace(),
                    )
                    .unwrap();
                    assert_eq!(
                        absolute_pose(&c, flat(&u2), flat(&points), 60, &o, room, size, &mut e, e_size, m),
                        1
                    );
                    let estimate::AbsolutePoseVerdict::Pose(found) = &want.verdict else { panic!() };
                    assert_eq!((e.poses[0], e.rms_px[0]), (pose_of(&found.pose), found.rms_px));
                    assert_eq!(e.covariance[0].concat(), found.covariance.unwrap().numbers());
                    let down = Vector3::new(0.0, 1.0, 0.0);
                    let gravity =
                        estimate::GravityPrior { world: down, camera: pose.rotation * down, sigma_rad: 0.01 };
                    let mut kernel = estimate::AbsolutePoseOptions::default();
                    kernel.gravity = Some(gravity);
                    (o.has_gravity, o.gravity_sigma_rad) = (1, 0.01);
                    (o.gravity_world, o.gravity_camera) = (down.into(), gravity.camera.into());
                    let mut wide = WideAbsolutePoseStorage::<S, 60>::new();
                    let guide = epipole::robust::Guide { scores: Some(&scores), keep_going: None };
                    let want = estimate::absolute_pose_guided(
                        &fish,
                        &u2,
                        &points,
                        &kernel,
                        guide,
                        &mut wide.workspace(),
                    )
                    .unwrap();
                    assert!(
                        absolute_pose_guided(
                            &c_fish,
                            flat(&u2),
                            flat(&points),
                            scores.as_ptr(),
                            60,
                            &o,
                            None,
                            context,
                            room,
                            size,
                            &mut e,
                            e_size,
                            m
                        ) >= 0
                    );
                    assert_eq!(e.poses[0], want.pose().map_or(Pose::default(), |p| pose_of(&p)));
                    assert_eq!(e.gravity == PriorFit::None as u32, want.gravity.is_none());

                    let mut o = options!(RefineAbsolutePoseOptions, refine_absolute_pose_options_default);
                    let mut kernel = refine::RefineAbsolutePoseOptions::default();
                    kernel.loss = Loss::Tukey(3.0);
                    kernel.prior = Some(refine::PosePrior { pose, information: Matrix6::identity() * 50.0 });
                    (o.loss, o.loss_scale, o.has_prior, o.prior_pose) =
                        (Loss_::Tukey as u32, 3.0, 1, pose_of(&pose));
                    (0..6).for_each(|k| o.prior_information[k][k] = 50.0);
                    let mut r = zero!(out::RefinedAbsolutePose<S>);
                    let want = refine::absolute_pose(&camera, &u2, &points, &pose, &kernel).unwrap();
                    assert_eq!(
                        refine_absolute_pose(
                            &c,
                            flat(&u2),
                            flat(&points),
                            60,
                            &start,
                            &o,
                            &mut r,
                            size_of::<out::RefinedAbsolutePose<S>>()
                        ),
                        1
                    );
                    assert_eq!((r.pose, r.cost, r.passes), (pose_of(&want.pose), want.cost, want.passes));
                    assert_eq!(r.covariance.concat(), want.covariance.unwrap().numbers());
                }
            }

            #[test]
            fn windows() {
                let Scene { camera, pose, points, pixels, .. } = scene::<S>(12);
                const N: usize = scalars_len(3);
                let mut storage = WindowStorage::<S, 3, 12, 40, N>::new();
                let mut k = storage.window();
                let size = window_size(3, 12, 40, 1);
                let mut memory = vec![0u64; size / 8];
                let mut w: *mut win::Window<S> = std::ptr::null_mut();
                let (c, lens) = (camera_of(&camera), geo::Camera::from(camera));
                let late = geo::Pose::translation(0.1, 0.0, 0.0) * pose;
                // SAFETY: arrays of the sizes that the functions ask for.
                unsafe {
                    assert_eq!(window_create(memory.as_mut_ptr().cast(), size, 3, 12, 40, 1, &mut w), 0);
                    let mut frames = [0u32; 3];
                    let handles = [geo::Pose::identity(), pose, late].map(|p| k.add_frame(lens, &p).unwrap());
                    for (frame, p) in frames.iter_mut().zip([geo::Pose::identity(), pose, late]) {
                        assert_eq!(window_add_frame(w, &c, &pose_of(&p), frame), 0);
                    }
                    assert_eq!(frames, handles.map(|h| h.to_bits()));
                    k.fix_frame(handles[0], true).unwrap();
                    assert_eq!(window_fix_frame(w, frames[0], 1), 0);
                    k.set_distance(handles[0], handles[1], 0.7, 0.01).unwrap();
                    assert_eq!(window_set_distance(w, frames[0], frames[1], 0.7, 0.01), 0);
                    let mut names = Vec::new();
                    for (i, x) in points.iter().enumerate() {
                        let mut point = 0;
                        let handle = k.add_point(x).unwrap();
                        assert_eq!(window_add_point(w, flat(&[*x]), &mut point), 0);
                        assert_eq!(point, handle.to_bits());
                        names.push((handle, point));
                        for (f, list) in [0, 1, 2].into_iter().zip([&pixels[0], &pixels[1], &pixels[1]]) {
                            k.add_observation(handles[f], handle, &list[i], 1.0).unwrap();
                            assert_eq!(window_add_observation(w, frames[f], point, flat(&[list[i]]), 1.0), 0);
                        }
                    }
                    let (h0, p0) = names[0];
                    let mut options = std::mem::zeroed::<win::BundleOptions<S>>();
                    assert_eq!(bundle_options_default(&mut options, size_of_val(&options)), 0);
                    let mut report = std::mem::zeroed::<win::BundleReport<S>>();
                    let (o, r, rs) = (&raw const options, &raw mut report, size_of::<win::BundleReport<S>>());
                    let check_report = |r: *mut win::BundleReport<S>, want: bundle::BundleReport<S>| {
                        let got = *r;
                        assert_eq!(got.cost_before.to_bits(), want.cost_before.to_bits());
                        assert_eq!(got.cost_after.to_bits(), want.cost_after.to_bits());
                        assert_eq!(
                            (got.iterations, got.evaluations, got.observations as usize),
                            (want.iterations, want.evaluations, want.observations)
                        );
                    };
                    let defaults = bundle::BundleOptions::default();
                    assert_eq!(window_refine_frame(w, frames[2], o, r, rs), 0);
                    check_report(r, k.refine_frame(handles[2], &defaults).unwrap());
                    assert_eq!(window_refine_point(w, p0, o, r, rs), 0);
                    check_report(r, k.refine_point(h0, &defaults).unwrap());
                    assert_eq!(window_optimise(w, o, None, std::ptr::null_mut(), r, rs), 0);
                    check_report(r, k.optimise(&defaults).unwrap());
                    for (frame, handle) in frames.iter().zip(handles) {
                        same("pose", 0, &k.pose(handle).unwrap().numbers(), |o| {
                            window_pose(w, *frame, o.cast())
                        });
                    }
                    same("position", 0, &k.position(h0).unwrap().numbers(), |o| window_position(w, p0, o));
                    let mut pr = std::mem::zeroed::<win::PointReport<S>>();
                    assert_eq!(window_point_report(w, p0, 3.0, &mut pr, size_of::<win::PointReport<S>>()), 0);
                    let want = k.point_report(h0, 3.0).unwrap();
                    assert_eq!(
                        (pr.observations as usize, pr.rms_sigma.to_bits()),
                        (want.observations, want.rms_sigma.to_bits())
                    );
                    let loss = Loss::Huber(1.5);
                    let huber = Loss_::Huber as u32;
                    let mut covariance = std::mem::zeroed::<win::FrameCovariance<S>>();
                    match k.frame_covariance(handles[2], &loss) {
                        Ok(want) => {
                            assert_eq!(window_frame_covariance(w, frames[2], huber, 1.5, &mut covariance), 0);
                            assert_eq!(covariance.pose.concat(), want.pose.numbers());
                            assert_eq!(covariance.centre.concat(), want.centre.numbers());
                            assert_eq!(covariance.motion.concat(), want.motion.numbers());
                        }
                        Err(_) => {
                            assert!(window_frame_covariance(w, frames[2], huber, 1.5, &mut covariance) < 0)
                        }
                    }
                    match k.point_covariance(h0, &loss) {
                        Ok(want) => {
                            same("cov", 0, &want.numbers(), |o| window_point_covariance(w, p0, huber, 1.5, o))
                        }
                        Err(_) => {
                            assert!(window_point_covariance(w, p0, huber, 1.5, [0.0; 9].as_mut_ptr()) < 0)
                        }
                    }
                    // Priors, positions, removals.
                    let centre = [0.1, 0.2, 0.3].map(|x: S| x);
                    k.set_pose_prior(
                        handles[1],
                        Some(bundle::PosePrior::position(&Vector3::from(centre), 0.5).unwrap()),
                    )
                    .unwrap();
                    assert_eq!(window_set_position_prior(w, frames[1], centre.as_ptr(), 0.5), 0);
                    k.set_pose_prior(
                        handles[2],
                        Some(bundle::PosePrior::rotation(&pose.rotation, 0.1).unwrap()),
                    )
                    .unwrap();
                    assert_eq!(window_set_rotation_prior(w, frames[2], flat(&[pose.rotation]), 0.1), 0);
                    k.set_position(names[1].0, &Vector3::from(centre)).unwrap();
                    assert_eq!(window_set_position(w, names[1].1, centre.as_ptr()), 0);
                    k.remove_observation(handles[1], names[2].0).unwrap();
                    assert_eq!(window_remove_observation(w, frames[1], names[2].1), 0);
                    k.remove_point(names[3].0).unwrap();
                    assert_eq!(window_remove_point(w, names[3].1), 0);
                    k.fix_point(names[4].0, true).unwrap();
                    assert_eq!(window_fix_point(w, names[4].1, 1), 0);
                    k.remove_distance(handles[0]).unwrap();
                    assert_eq!(window_remove_distance(w, frames[0]), 0);
                    assert_eq!(window_optimise(w, o, None, std::ptr::null_mut(), r, rs), 0);
                    check_report(r, k.optimise(&defaults).unwrap());
                    let information = Matrix6::<S>::identity() * 3.0;
                    k.set_pose_prior(handles[1], Some(bundle::PosePrior::full(&pose, &information).unwrap()))
                        .unwrap();
                    assert_eq!(window_set_pose_prior(w, frames[1], &pose_of(&pose), flat(&[information])), 0);
                    k.set_pose_prior(handles[2], None).unwrap();
                    assert_eq!(window_remove_pose_prior(w, frames[2]), 0);
                    k.set_pose(handles[2], &pose).unwrap();
                    assert_eq!(window_set_pose(w, frames[2], &pose_of(&pose)), 0);
                    k.marginalise_point(h0, &loss).unwrap();
                    assert_eq!(window_marginalise_point(w, p0, huber, 1.5), 0);
                    let gone = k.marginalise_frame(handles[0], &loss).unwrap();
                    assert_eq!(window_marginalise_frame(w, frames[0], huber, 1.5), gone as i32);
                    assert_eq!(window_optimise(w, o, None, std::ptr::null_mut(), r, rs), 0);
                    check_report(r, k.optimise(&defaults).unwrap());
                    let counts = [
                        window_frame_count(w),
                        window_point_count(w),
                        window_observation_count(w),
                        window_prior_frame_count(w),
                    ];
                    assert_eq!(
                        counts.map(|n| n as usize),
                        [k.frame_count(), k.point_count(), k.observation_count(), k.prior_frame_count()]
                    );
                    let mut list = [0u32; 12];
                    let n = window_frames(w, list.as_mut_ptr(), 12) as usize;
                    assert_eq!(
                        list[..n].to_vec(),
                        k.frame_handles().map(|h| h.to_bits()).collect::<Vec<_>>()
                    );
                    let n = window_points(w, list.as_mut_ptr(), 12) as usize;
                    assert_eq!(
                        list[..n].to_vec(),
                        k.point_handles().map(|h| h.to_bits()).collect::<Vec<_>>()
                    );
                    let seen: Vec<_> = k.observations_of(names[5].0).unwrap().collect();
                    same("observations", seen.len(), &all(seen.iter().map(|(_, u)| *u)), |o| {
                        window_observations_of(w, names[5].1, list.as_mut_ptr(), o, 12)
                    });
                    assert_eq!(
                        list[..seen.len()].to_vec(),
                        seen.iter().map(|(h, _)| h.to_bits()).collect::<Vec<_>>()
                    );
                    assert_eq!(window_clear_prior(w), 0);
                    assert_eq!(window_remove_frame(w, frames[2]), 0);
                    assert_eq!((window_prior_frame_count(w), window_frame_count(w)), (0, 1));
                    assert_eq!((window_clear(w), window_point_count(w)), (0, 0));
                }
            }

            #[test]
            fn sizes_are_those_of_the_macros() {
                assert_eq!(relative_pose_workspace_size(100, 0), 100 * (4 * size_of::<S>() + 5));
                assert_eq!(relative_pose_workspace_size(99, 1), 100 * (18 * size_of::<S>() + 5));
                assert_eq!(homography_workspace_size(1), fundamental_workspace_size(4));
                assert_eq!(absolute_pose_workspace_size(8, 0), 8 * (5 * size_of::<S>() + 5));
                assert_eq!(absolute_pose_workspace_size(8, 1), 8 * (12 * size_of::<S>() + 5));
                for count in [usize::MAX, usize::MAX / 8] {
                    assert_eq!(relative_pose_workspace_size(count, 0), 0);
                    assert_eq!(
                        window_size(count, 1, 1, 0)
                            + window_size(1, count, 1, 0)
                            + window_size(1, 1, count, 0),
                        0
                    );
                }
            }
        }
    };
}
use epipole_capi::enums::Loss as Loss_;
round_trips!(f32);
round_trips!(f64);

#[test]
fn statuses_have_sentences() {
    for status in Status::ALL {
        // SAFETY: a static string.
        let text = unsafe { std::ffi::CStr::from_ptr(epipole_capi::status_string(status as i32)) };
        assert!(!text.is_empty());
    }
    assert_eq!(epipole_capi::abi_version(), epipole_capi::ABI_VERSION);
    assert_eq!(epipole_capi::workspace_align(), epipole_capi::WORKSPACE_ALIGN);
}
