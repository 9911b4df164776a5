//! Camera models: OpenCV as an oracle, inverses, Jacobians, the edge of the domain, any bits.

use epipole::Real;
use epipole::geometry::{
    BrownConrady, Camera, CameraError, CameraModel, KannalaBrandt, Pinhole, UnprojectError,
};
use epipole::nalgebra::{Matrix2x3, Matrix3x2, Vector2, Vector3};
use epipole::real::lit;
use epipole_host_tests::matchers::{direction_error, pixel_distance};
use epipole_host_tests::{Rng, for_each_case, in_both_scalars, tolerances};

/// A lens by its numbers, so that one can be made in every scalar.
#[derive(Clone, Copy)]
struct Lens {
    name: &'static str,
    pinhole: [f64; 4],
    coefficients: &'static [f64],
    /// Angles off the axis that are tested, rad.
    max_angle: f64,
}

/// The EuRoC MAV camera 0 (with a k3) and a TUM-VI fisheye; the others are extremes.
const LENSES: [Lens; 7] = [
    Lens { name: "pinhole", pinhole: [718.0, 700.0, 620.5, 188.0], coefficients: &[], max_angle: 1.2 },
    Lens {
        name: "radtan",
        pinhole: [458.654, 457.296, 367.215, 248.375],
        coefficients: &[-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0.01],
        max_angle: 0.9,
    },
    Lens {
        name: "pincushion",
        pinhole: [900.0, 910.0, 640.0, 360.0],
        coefficients: &[0.4, 0.1, 0.002, -0.003, 0.05],
        max_angle: 0.9,
    },
    Lens {
        name: "strong barrel", // folds back at a radius of 0.966
        pinhole: [300.0, 300.0, 320.0, 240.0],
        coefficients: &[-0.35, 0.0, 0.0, 0.0, 0.0],
        max_angle: 0.76,
    },
    Lens {
        name: "fisheye",
        pinhole: [190.978477, 190.973307, 254.931706, 256.897442],
        coefficients: &[0.003482389, 0.000715035, -0.002053236, 0.000202937],
        max_angle: 1.7,
    },
    Lens {
        name: "equidistant",
        pinhole: [200.0, 200.0, 500.0, 500.0],
        coefficients: &[0.0, 0.0, 0.0, 0.0],
        max_angle: 3.1,
    },
    Lens {
        name: "strong fisheye", // folds back at 1.826 rad
        pinhole: [350.0, 350.0, 500.0, 500.0],
        coefficients: &[-0.1, 0.0, 0.0, 0.0],
        max_angle: 1.75,
    },
];

impl Lens {
    fn camera<T: Real>(&self) -> Camera<T> {
        let [fx, fy, cx, cy] = self.pinhole.map(lit::<T>);
        let pinhole = Pinhole::new(fx, fy, cx, cy).unwrap();
        let k: Vec<T> = self.coefficients.iter().map(|k| lit(*k)).collect();
        match *k {
            [k1, k2, p1, p2, k3] => BrownConrady::new(pinhole, [k1, k2, p1, p2, k3]).unwrap().into(),
            [k1, k2, k3, k4] => KannalaBrandt::new(pinhole, [k1, k2, k3, k4]).unwrap().into(),
            _ => pinhole.into(),
        }
    }

    /// The same camera in `f64`, with the parameters as the scalar `T` rounds them.
    fn rounded<T: Real>(&self) -> Camera<f64> {
        let round = |x: &f64| lit::<T>(*x).to_f64();
        let coefficients: Vec<f64> = self.coefficients.iter().map(round).collect();
        let lens =
            Lens { pinhole: self.pinhole.map(|x| round(&x)), coefficients: coefficients.leak(), ..*self };
        lens.camera::<f64>()
    }

    /// A point at an angle up to `max_angle` off the axis, some of them on it and at the edge.
    fn point<T: Real>(&self, rng: &mut Rng) -> Vector3<T> {
        let angle = match rng.index(8) {
            0 => 0.0,
            1 => rng.range(0.0, 1e-6),
            2 => self.max_angle,
            _ => rng.range(0.0, self.max_angle),
        };
        let turn = rng.range(0.0, std::f64::consts::TAU);
        let ray = Vector3::new(angle.sin() * turn.cos(), angle.sin() * turn.sin(), angle.cos());
        (ray * rng.range(0.1, 50.0)).map(lit)
    }
}

in_both_scalars! {
    /// Values of OpenCV 5.0.0's `projectPoints` and `fisheye::projectPoints`.
    fn projects_as_opencv<T>() {
        let radtan = [
            ([0.1, 0.2, 1.0], [412.443123716740, 338.567041876625]),
            ([-0.5, 0.3, 1.2], [188.070278704866, 355.565625555194]),
            ([0.9, -0.6, 1.1], [668.922166283709, 47.923221558091]),
            ([1.0, 0.8, 1.0], [724.329577086795, 533.355390130721]),
            ([0.0, 0.0, 2.0], [367.215, 248.375]),
        ];
        let fisheye = [
            ([0.1, 0.2, 1.0], [273.723670515226, 294.480354353077]),
            ([-0.5, 0.3, 1.2], [180.805774990066, 301.371797515241]),
            ([3.0, -2.0, 1.0], [461.476953083997, 119.204339227915]),
            ([-5.0, 4.0, 0.1], [25.212156166213, 440.668107707562]),
            ([0.02, 0.01, 2.0], [256.841412093714, 257.852270067400]),
        ];
        let fisheye_lens = Lens {
            pinhole: [190.97847715128717, 190.9733070521226, 254.93170605935475, 256.8974428996504],
            coefficients: &[
                0.0034823894022493434,
                0.0007150348452162257,
                -0.0020532361418706202,
                0.00020293673591811182,
            ],
            ..LENSES[4]
        };
        for (lens, table) in [(LENSES[1], radtan), (fisheye_lens, fisheye)] {
            let camera = lens.camera::<T>();
            for (point, pixel) in table {
                let projected = camera.project(&Vector3::from(point.map(lit::<T>))).unwrap();
                let distance = pixel_distance(&projected, &Vector2::from(pixel));
                assert!(distance < tolerances::PROJECTION_PX.of::<T>(), "{} {point:?}: {distance}", lens.name);
            }
        }
    }

    /// On the axis, at the edge of the domain, beyond 90 degrees.
    fn unprojection_inverts_projection<T>() {
        for lens in LENSES {
            let camera = lens.camera::<T>();
            // Near the fold the slope is small, and a pixel says little about the angle.
            let fold = lens.name.starts_with("strong");
            let bound = if fold { tolerances::UNPROJECTION_FOLD } else { tolerances::UNPROJECTION };
            for_each_case(300, |_, rng| {
                let point = lens.point::<T>(rng);
                let pixel = camera.project(&point).unwrap_or_else(|| panic!("{}: {point:?}", lens.name));
                let bearing = camera.unproject(&pixel).unwrap_or_else(|e| panic!("{}: {point:?} {e}", lens.name));
                let error = direction_error(&bearing, &point);
                assert!(error < bound.of::<T>(), "{} {point:?}: {error}", lens.name);
                let norm = bearing.map(T::to_f64).norm();
                assert!((norm - 1.0).abs() < tolerances::ROUNDING.of::<T>(), "{}: {norm}", lens.name);
            });
        }
    }

    /// The calibrated images of EuRoC MAV's and TUM-VI's cameras, to the corners.
    fn every_pixel_of_a_calibrated_image_has_a_bearing<T>() {
        for (lens, width, height) in [(LENSES[1], 752, 480), (LENSES[4], 512, 512)] {
            let camera = lens.camera::<T>();
            for (u, v) in (0..width).step_by(7).flat_map(|u| (0..height).step_by(7).map(move |v| (u, v))) {
                let pixel = Vector2::new(lit::<T>(f64::from(u)), lit(f64::from(v)));
                let bearing = camera.unproject(&pixel).unwrap_or_else(|e| panic!("{} {u} {v}: {e}", lens.name));
                let distance = pixel_distance(&camera.project(&bearing).unwrap(), &pixel);
                assert!(distance < tolerances::PROJECTION_PX.of::<T>(), "{} {u} {v}: {distance}", lens.name);
            }
        }
    }

    /// The analytic Jacobians in `T` against central differences in `f64`.
    fn jacobians_are_the_differences<T>() {
        let bound = tolerances::JACOBIAN.of::<T>();
        for lens in LENSES {
            let (camera, exact) = (lens.camera::<T>(), lens.rounded::<T>());
            // At the very edge a difference would leave the domain.
            let lens = Lens { max_angle: lens.max_angle * 0.97, ..lens };
            for_each_case(100, |_, rng| {
                let point = lens.point::<T>(rng);
                let (pixel, jacobian) = camera.project_with_jacobian(&point).unwrap();
                assert_eq!(Some(pixel), camera.project(&point), "{}", lens.name);
                let p = point.map(T::to_f64);
                let h = p.norm() * 1e-5;
                let difference = Matrix2x3::from_columns(&[0, 1, 2].map(|k| {
                    let step = Vector3::ith(k, h);
                    (exact.project(&(p + step)).unwrap() - exact.project(&(p - step)).unwrap()) / (2.0 * h)
                }));
                let error = (jacobian.map(T::to_f64) - difference).amax() / difference.amax();
                assert!(error < bound, "{} project {point:?}: {error}", lens.name);

                let (bearing, jacobian) = camera.unproject_with_jacobian(&pixel).unwrap();
                assert_eq!(Ok(bearing), camera.unproject(&pixel), "{}", lens.name);
                let u = pixel.map(T::to_f64);
                let h = 1e-3;
                let difference = Matrix3x2::from_columns(&[0, 1].map(|k| {
                    let step = Vector2::ith(k, h);
                    (exact.unproject(&(u + step)).unwrap() - exact.unproject(&(u - step)).unwrap()) / (2.0 * h)
                }));
                let error = (jacobian.map(T::to_f64) - difference).amax() / difference.amax();
                // Where the slope is small, in f32 the bearing at which it is taken is itself uncertain.
                let bound = if size_of::<T>() == 4 && lens.name.starts_with("strong") { 20.0 * bound } else { bound };
                assert!(error < bound, "{} unproject {point:?}: {error}", lens.name);
            });
        }
    }

    fn intrinsics_jacobians_are_the_differences<T>() {
        fn differences<const N: usize>(
            parameters: [f64; N],
            project: impl Fn([f64; N]) -> Vector2<f64>,
        ) -> [Vector2<f64>; N] {
            std::array::from_fn(|k| {
                let h = 1e-5 * parameters[k].abs().max(0.1);
                let moved = |sign: f64| {
                    let mut p = parameters;
                    p[k] += sign * h;
                    project(p)
                };
                (moved(1.0) - moved(-1.0)) / (2.0 * h)
            })
        }
        let bound = tolerances::JACOBIAN.of::<T>();
        let check = |name: &str, analytic: &[T], expected: &[Vector2<f64>]| {
            let size = expected.iter().map(|v| v.amax()).fold(0.0, f64::max);
            for (a, e) in analytic.chunks(2).zip(expected) {
                let error = (Vector2::new(a[0].to_f64(), a[1].to_f64()) - e).amax() / size;
                assert!(error < bound, "{name}: {error}");
            }
        };
        let pinhole = |p: &[f64]| Pinhole::new(p[0], p[1], p[2], p[3]).unwrap();
        for lens in LENSES {
            let lens = Lens { max_angle: lens.max_angle * 0.97, ..lens };
            let round = |x: &f64| lit::<T>(*x).to_f64();
            let parameters: Vec<f64> = lens.pinhole.iter().chain(lens.coefficients).map(round).collect();
            for_each_case(20, |_, rng| {
                let point = lens.point::<T>(rng);
                let p = point.map(T::to_f64);
                match lens.camera::<T>() {
                    Camera::Pinhole(camera) => {
                        let expected = differences::<4>(parameters.clone().try_into().unwrap(), |q| {
                            pinhole(&q).project(&p).unwrap()
                        });
                        check(lens.name, camera.intrinsics_jacobian(&point).unwrap().as_slice(), &expected);
                    }
                    Camera::BrownConrady(camera) => {
                        let expected = differences::<9>(parameters.clone().try_into().unwrap(), |q| {
                            let k = [q[4], q[5], q[6], q[7], q[8]];
                            BrownConrady::new(pinhole(&q), k).unwrap().project(&p).unwrap()
                        });
                        check(lens.name, camera.intrinsics_jacobian(&point).unwrap().as_slice(), &expected);
                    }
                    Camera::KannalaBrandt(camera) => {
                        let expected = differences::<8>(parameters.clone().try_into().unwrap(), |q| {
                            let k = [q[4], q[5], q[6], q[7]];
                            KannalaBrandt::new(pinhole(&q), k).unwrap().project(&p).unwrap()
                        });
                        check(lens.name, camera.intrinsics_jacobian(&point).unwrap().as_slice(), &expected);
                    }
                    other => panic!("{other:?}"),
                }
            });
        }
    }

    fn a_longer_ray_has_the_same_pixel<T>() {
        for lens in LENSES {
            let camera = lens.camera::<T>();
            for_each_case(50, |_, rng| {
                let point = lens.point::<T>(rng);
                for factor in [0.25, 4.0, 65536.0] {
                    assert_eq!(camera.project(&(point * lit::<T>(factor))), camera.project(&point), "{}", lens.name);
                }
            });
        }
    }

    fn no_pixel_outside_the_domain<T>() {
        let none = |lens: &Lens, p: [f64; 3]| {
            let point = Vector3::from(p.map(lit::<T>));
            assert_eq!(lens.camera::<T>().project(&point), None, "{} {p:?}", lens.name);
            assert_eq!(lens.camera::<T>().project_with_jacobian(&point), None, "{} {p:?}", lens.name);
        };
        for lens in &LENSES {
            none(lens, [0.0, 0.0, 0.0]);
            none(lens, [0.0, 0.0, -1.0]);
            none(lens, [f64::NAN, 0.0, 1.0]);
            none(lens, [0.0, f64::INFINITY, 1.0]);
            none(lens, [0.0, 0.0, f64::INFINITY]);
        }
        for lens in &LENSES[..4] {
            none(lens, [1.0, 0.5, 0.0]);
            none(lens, [1.0, 0.5, -1.0]);
        }
        // Past the fold a second pixel would answer to the first's bearing.
        none(&LENSES[3], [0.98, 0.0, 1.0]);
        none(&LENSES[6], [1.0, 0.0, -0.27]);
        // A fisheye sees sideways.
        let fisheye = LENSES[4].camera::<T>();
        for z in [1e-3, 0.0, -1e-3, -0.1] {
            let point = Vector3::new(T::ONE, T::ZERO, lit(z));
            let bearing = fisheye.unproject(&fisheye.project(&point).unwrap()).unwrap();
            assert!(direction_error(&bearing, &point) < tolerances::UNPROJECTION.of::<T>());
        }
    }

    fn no_bearing_outside_the_image<T>() {
        let far = Vector2::new(lit::<T>(2500.0), lit(500.0));
        for (lens, angle) in [(LENSES[3], None), (LENSES[5], None), (LENSES[6], Some(1.825_741_858))] {
            assert_eq!(lens.camera::<T>().unproject(&far), Err(UnprojectError::OutsideDomain), "{}", lens.name);
            if let (Camera::KannalaBrandt(camera), Some(angle)) = (lens.camera::<T>(), angle) {
                assert!((camera.max_angle().to_f64() - angle).abs() < 1e-6);
            }
        }
        let Camera::BrownConrady(barrel) = LENSES[3].camera::<T>() else { panic!() };
        assert!((barrel.max_radius().to_f64() - (1.0f64 / 1.05).sqrt()).abs() < 1e-6);
        let texts = [UnprojectError::NotFinite, UnprojectError::OutsideDomain, UnprojectError::NotConverged];
        assert!(texts.map(|e| e.to_string().contains("pixel")).iter().all(|found| *found));
        for lens in LENSES {
            for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let pixel = Vector2::new(T::ZERO, lit(bad));
                assert_eq!(lens.camera::<T>().unproject(&pixel), Err(UnprojectError::NotFinite), "{}", lens.name);
            }
        }
    }

    fn constructors_name_the_parameter<T>() {
        let new = |p: [f64; 4]| {
            let [fx, fy, cx, cy] = p.map(lit::<T>);
            Pinhole::new(fx, fy, cx, cy)
        };
        let not_finite = |parameter| CameraError::NotFinite { parameter };
        assert_eq!(new([f64::NAN, 1.0, 1.0, 1.0]), Err(not_finite("fx")));
        assert_eq!(new([1.0, f64::INFINITY, 1.0, 1.0]), Err(not_finite("fy")));
        assert_eq!(new([1.0, 1.0, f64::NAN, f64::NAN]), Err(not_finite("cx")));
        assert_eq!(new([1.0, 1.0, 1.0, f64::NEG_INFINITY]), Err(not_finite("cy")));
        assert_eq!(new([0.0, 1.0, 1.0, 1.0]), Err(CameraError::NotPositive { parameter: "fx" }));
        assert_eq!(new([1.0, -1.0, 1.0, 1.0]), Err(CameraError::NotPositive { parameter: "fy" }));
        let pinhole = new([1.0; 4]).unwrap();
        for (k, name) in ["k1", "k2", "p1", "p2", "k3"].into_iter().enumerate() {
            let mut d = [T::ZERO; 5];
            d[k] = lit(f64::NAN);
            assert_eq!(BrownConrady::new(pinhole, d), Err(not_finite(name)));
        }
        for (k, name) in ["k1", "k2", "k3", "k4"].into_iter().enumerate() {
            let mut d = [T::ZERO; 4];
            d[k] = lit(f64::INFINITY);
            assert_eq!(KannalaBrandt::new(pinhole, d), Err(not_finite(name)));
        }
        assert_eq!(not_finite("k2").to_string(), "camera parameter k2 is not finite");
        let not_positive = CameraError::NotPositive { parameter: "fx" };
        assert_eq!(not_positive.to_string(), "camera parameter fx is not positive");
    }

    fn the_matrix_is_the_pinhole<T>() {
        let camera = LENSES[0].camera::<T>().pinhole();
        let point = Vector3::new(lit::<T>(0.3), lit(-0.2), lit(1.5));
        let pixel = camera.project(&point).unwrap();
        let x = camera.matrix() * point;
        assert!(pixel_distance(&(x.xy() / x.z), &pixel) < tolerances::PROJECTION_PX.of::<T>());
        let back = camera.inverse_matrix() * pixel.push(T::ONE);
        assert!(direction_error(&back, &point) < tolerances::UNPROJECTION.of::<T>());
        assert_eq!((camera.fx(), camera.cx(), camera.focal()), (lit(718.0), lit(620.5), lit(709.0)));
        assert_eq!((camera.fy(), camera.cy()), (lit(700.0), lit(188.0)));
    }

    /// Whatever the bits of parameters, point and pixel: an accepted answer is finite, and a bearing has length 1.
    fn any_bits_give_finite_answers<T>() {
        let mut accepted = [0usize; 3];
        for_each_case(100_000, |_, rng| {
            let parameters: [T; 9] = std::array::from_fn(|_| rng.any_bits());
            let [fx, fy, cx, cy, k1, k2, k3, k4, k5] = parameters;
            let abs = |x: T| if x < T::ZERO { -x } else { x };
            let Ok(pinhole) = Pinhole::new(abs(fx), abs(fy), cx, cy) else { return };
            let camera = match rng.index(3) {
                0 => pinhole.into(),
                1 => match BrownConrady::new(pinhole, [k1, k2, k3, k4, k5]) {
                    Ok(camera) => Camera::from(camera),
                    Err(_) => return,
                },
                _ => match KannalaBrandt::new(pinhole, [k1, k2, k3, k4]) {
                    Ok(camera) => camera.into(),
                    Err(_) => return,
                },
            };
            let finite = |values: &[T]| values.iter().all(|v| v.to_f64().is_finite());
            let point = rng.any_vector::<T>();
            if let Some(pixel) = camera.project(&point) {
                accepted[0] += 1;
                assert!(finite(pixel.as_slice()), "{camera:?} {point:?} -> {pixel:?}");
            }
            if let Some((pixel, jacobian)) = camera.project_with_jacobian(&point) {
                accepted[1] += 1;
                assert!(finite(pixel.as_slice()) && finite(jacobian.as_slice()), "{camera:?} {point:?}");
            }
            match camera {
                Camera::BrownConrady(c) => {
                    assert!(c.intrinsics_jacobian(&point).is_none_or(|j| finite(j.as_slice())));
                    assert_eq!(c.distortion(), [k1, k2, k3, k4, k5]);
                }
                Camera::KannalaBrandt(c) => {
                    assert!(c.intrinsics_jacobian(&point).is_none_or(|j| finite(j.as_slice())));
                    assert_eq!(c.coefficients(), [k1, k2, k3, k4]);
                }
                _ => assert!(pinhole.intrinsics_jacobian(&point).is_none_or(|j| finite(j.as_slice()))),
            }
            let pixel = Vector2::new(rng.any_bits::<T>(), rng.any_bits());
            if let Ok((bearing, jacobian)) = camera.unproject_with_jacobian(&pixel) {
                accepted[2] += 1;
                assert!(finite(bearing.as_slice()) && finite(jacobian.as_slice()), "{camera:?} {pixel:?}");
                let norm = bearing.map(T::to_f64).norm();
                assert!((norm - 1.0).abs() < tolerances::ROUNDING.of::<T>(), "{camera:?} {pixel:?}: {norm}");
            }
        });
        assert!(accepted[0] > 1000 && accepted[1] > 1000 && accepted[2] > 1000, "too few accepted: {accepted:?}");
    }
}
