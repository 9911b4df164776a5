//! Every message comes back as it was sent, bit by bit.

use epipole::estimate::{
    AbsolutePoseOptions, AbsolutePoseStorage, AbsolutePoseVerdict, GravityPrior, RelativePoseOptions,
    RelativePosePrior, RelativePoseStorage, RelativePoseVerdict, absolute_pose, relative_pose,
};
use epipole::geometry::{BrownConrady, Camera, KannalaBrandt, Pinhole};
use epipole::nalgebra::{Matrix3, UnitQuaternion, Vector2, Vector3};
use epipole_problems::{Geometry, TwoView};
use epipole_wire::*;
use proptest::prelude::*;

fn parsed<R>(bytes: &[u8], read: impl FnOnce(&Frame<'_>) -> R) -> R {
    let mut buffer = vec![0; bytes.len()];
    let mut decoder = Decoder::new(&mut buffer);
    for &byte in &bytes[..bytes.len() - 1] {
        assert!(decoder.feed(byte).is_none());
    }
    read(&decoder.feed(bytes[bytes.len() - 1]).unwrap().unwrap())
}

fn camera() -> impl Strategy<Value = Camera<f32>> {
    (0..3, 100.0f32..2000.0, prop::array::uniform5(-0.1f32..0.1)).prop_map(|(model, f, k)| {
        let pinhole = Pinhole::new(f, f + 1.0, 320.0, 240.0).unwrap();
        match model {
            0 => pinhole.into(),
            1 => BrownConrady::new(pinhole, k).unwrap().into(),
            _ => KannalaBrandt::new(pinhole, [k[0], k[1], k[2], k[3]]).unwrap().into(),
        }
    })
}

/// Any bits, NaN included.
fn number() -> impl Strategy<Value = f32> {
    any::<u32>().prop_map(f32::from_bits)
}

fn bits<const N: usize>(numbers: [f32; N]) -> [u32; N] {
    numbers.map(f32::to_bits)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn relative_pose_requests_come_back(
        a in camera(),
        b in camera(),
        data in prop::collection::vec(prop::array::uniform5(number()), 0..60),
        scored: bool,
        numbers in prop::array::uniform2(1e-6f32..1e6),
        counts: [u32; 3],
        seed: u64,
        prior in prop::option::of((any::<bool>(), prop::array::uniform7(-1e3f32..1e3))),
        sequence: u16,
    ) {
        let mut options = RelativePoseOptions::default();
        options.prior = prior.map(|(gravity, g)| match gravity {
            true => RelativePosePrior::Gravity {
                view1: Vector3::new(g[0], g[1], g[2]),
                view2: Vector3::new(g[3], g[4], g[5]),
                sigma_rad: g[6],
            },
            false => RelativePosePrior::Rotation {
                rotation: UnitQuaternion::new(Vector3::new(g[0], g[1], g[2])),
                covariance: Matrix3::new(g[0], g[1], g[2], g[3], g[4], g[5], g[6], 1.0, 2.0),
            },
        });
        options.max_error_px = numbers[0];
        options.sigma_px = scored.then_some(numbers[1]);
        options.ransac.seed = seed;
        options.ransac.min_iterations = counts[0];
        options.ransac.budget.max_iterations = counts[1];
        let x1: Vec<_> = data.iter().map(|d| Vector2::new(d[0], d[1])).collect();
        let x2: Vec<_> = data.iter().map(|d| Vector2::new(d[2], d[3])).collect();
        let scores: Vec<_> = data.iter().map(|d| d[4]).collect();
        let scores = scored.then_some(&scores[..]);
        let mut out = vec![0; encoded_len(request_bytes(data.len()))];
        let n = relative_pose_request(&mut out, sequence, [&a, &b], [&x1, &x2], scores, &options, counts[2])
            .unwrap();
        prop_assert!(!out[1..n - 1].contains(&0));
        parsed(&out[..n], |frame| {
            assert_eq!(frame.sequence, sequence);
            let Ok(Request::RelativePose(request)) = Request::parse(frame) else { panic!() };
            assert_eq!((request.cameras, request.options, request.deadline_us), ([a, b], options, counts[2]));
            assert_eq!((request.correspondences.len(), request.correspondences.scored()), (data.len(), scored));
            let records: Vec<_> = request.correspondences.iter().collect();
            assert_eq!(records.len(), data.len());
            for ((numbers, score), d) in records.iter().zip(&data) {
                assert_eq!(bits(*numbers), bits([d[0], d[1], d[2], d[3]]));
                assert_eq!(score.to_bits(), if scored { d[4].to_bits() } else { 0 });
            }
        });
        // A byte less is too little room for it.
        prop_assert_eq!(
            relative_pose_request(&mut out[..n - 1], sequence, [&a, &b], [&x1, &x2], scores, &options, counts[2]),
            Err(Full)
        );
    }

    #[test]
    fn absolute_pose_requests_come_back(
        a in camera(),
        data in prop::collection::vec(prop::array::uniform6(number()), 0..60),
        scored: bool,
        gravity in prop::option::of(prop::array::uniform7(-1e3f32..1e3)),
        sequence: u16,
    ) {
        let mut options = AbsolutePoseOptions::default();
        options.gravity = gravity.map(|g| GravityPrior {
            world: Vector3::new(g[0], g[1], g[2]),
            camera: Vector3::new(g[3], g[4], g[5]),
            sigma_rad: g[6],
        });
        let pixels: Vec<_> = data.iter().map(|d| Vector2::new(d[0], d[1])).collect();
        let points: Vec<_> = data.iter().map(|d| Vector3::new(d[2], d[3], d[4])).collect();
        let scores: Vec<_> = data.iter().map(|d| d[5]).collect();
        let scores = scored.then_some(&scores[..]);
        let mut out = vec![0; encoded_len(request_bytes(data.len()))];
        let n = absolute_pose_request(&mut out, sequence, &a, &pixels, &points, scores, &options, 0).unwrap();
        parsed(&out[..n], |frame| {
            let Ok(Request::AbsolutePose(request)) = Request::parse(frame) else { panic!() };
            assert_eq!((request.camera, request.options), (a, options));
            for ((numbers, _), d) in request.correspondences.iter().zip(&data) {
                assert_eq!(bits(numbers), bits([d[0], d[1], d[2], d[3], d[4]]));
            }
        });
    }

    /// What another program sends is read, refused, or answered by a refusal: never a panic.
    #[test]
    fn any_body_is_read_or_refused(kind in 0u8..6, body in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = Request::parse(&Frame { kind, sequence: 0, body: &body });
        let _ = Reply::parse(&Frame { kind: kind | 0x80, sequence: 0, body: &body });
        let _ = Reply::parse(&Frame { kind: 0xff, sequence: 0, body: &body });
    }

    /// A body cut short contradicts itself.
    #[test]
    fn a_body_of_the_wrong_length_is_refused(cut in 1usize..200) {
        let camera = Pinhole::new(500.0, 500.0, 0.0, 0.0).unwrap().into();
        let x = [Vector2::new(1.0, 2.0); 8];
        let mut out = [0; 600];
        let n = relative_pose_request(
            &mut out, 0, [&camera; 2], [&x, &x], None, &RelativePoseOptions::default(), 0
        ).unwrap();
        parsed(&out[..n], |frame| {
            let body = &frame.body[..frame.body.len().saturating_sub(cut)];
            let given = body.len() as u32;
            assert_eq!(Request::parse(&Frame { body, ..*frame }), Err(Reason::Length { given }));
            let mut longer = frame.body.to_vec();
            longer.extend(vec![0; cut]);
            assert!(Request::parse(&Frame { body: &longer, ..*frame }).is_err());
        });
    }
}

#[test]
fn estimates_come_back() {
    let camera = Pinhole::new(500.0, 500.0, 0.0, 0.0).unwrap();
    let mut storage = RelativePoseStorage::<f32, 100>::new();
    let mut workspace = storage.workspace();
    let mut verdicts = [0; 4];
    for k in 0..30 {
        let geometry = [Geometry::Ransac, Geometry::Planar][k as usize % 2];
        let scene = TwoView::<100>::new(geometry, k);
        let [x1, mut x2] = scene.pixels();
        if k % 5 == 4 {
            x2 = x1;
        }
        let mut options = RelativePoseOptions::default();
        options.planes = k % 3 != 2;
        let estimate = relative_pose(&camera, &camera, &x1, &x2, &options, &mut workspace).unwrap();
        verdicts[match estimate.verdict {
            RelativePoseVerdict::General(_) => 0,
            RelativePoseVerdict::Planar(_) => 1,
            RelativePoseVerdict::GeneralOrPlanar(_) => 2,
            _ => 3,
        }] += 1;
        let mut out = [0; encoded_len(reply_bytes(100))];
        let n = relative_pose_reply(&mut out, 9, Order::Gap, 1234, &estimate, workspace.inliers()).unwrap();
        parsed(&out[..n], |frame| {
            let Some(Reply::RelativePose(answer)) = Reply::parse(frame) else { panic!() };
            assert_eq!((answer.order, answer.elapsed_us), (Order::Gap, 1234));
            assert_eq!(answer.estimate, estimate);
            assert!(answer.inliers.iter().eq(workspace.inliers().iter().copied()));
        });
    }
    assert!(verdicts.iter().all(|&count| count > 2), "{verdicts:?}");
}

#[test]
fn absolute_estimates_come_back() {
    let camera = Pinhole::new(500.0, 500.0, 0.0, 0.0).unwrap();
    let mut storage = AbsolutePoseStorage::<f32, 60>::new();
    let mut workspace = storage.workspace();
    let mut verdicts = [0; 3];
    for k in 0..20 {
        let scene = TwoView::<60>::new([Geometry::General, Geometry::Planar][k as usize % 2], k);
        let [mut pixels, _] = scene.pixels();
        let mut points = scene.points::<f32, 60>();
        match k % 4 {
            2 => pixels.iter_mut().for_each(|p| *p = Vector2::new(p.y * p.x, 7.0 * p.y)),
            // A small plane far away: either of its poses fits.
            3 => {
                points.iter_mut().for_each(|p| *p = Vector3::new(0.3 * p.x, 0.3 * p.y, 40.0));
                pixels = points.map(|p| Vector2::new(500.0 * p.x / p.z, 500.0 * p.y / p.z));
                pixels.iter_mut().step_by(2).for_each(|p| p.x += 0.7);
            }
            _ => (),
        }
        let mut options = AbsolutePoseOptions::default();
        options.gravity = (k % 3 == 0).then_some(GravityPrior {
            world: Vector3::y(),
            camera: Vector3::y(),
            sigma_rad: 0.01,
        });
        let estimate = absolute_pose(&camera, &pixels, &points, &options, &mut workspace).unwrap();
        verdicts[match estimate.verdict {
            AbsolutePoseVerdict::Pose(_) => 0,
            AbsolutePoseVerdict::PlanarAmbiguity(_) => 1,
            _ => 2,
        }] += 1;
        let mut out = [0; encoded_len(reply_bytes(60))];
        let n = absolute_pose_reply(&mut out, 9, Order::Next, 0, &estimate, workspace.inliers()).unwrap();
        parsed(&out[..n], |frame| {
            let Some(Reply::AbsolutePose(answer)) = Reply::parse(frame) else { panic!() };
            assert_eq!(answer.estimate, estimate);
            assert!(answer.inliers.iter().eq(workspace.inliers().iter().copied()));
        });
    }
    assert!(verdicts.iter().all(|&count| count > 2), "{verdicts:?}");
}

#[test]
fn refusals_come_back() {
    use epipole::InputError;
    use epipole::robust::OptionsError;
    for reason in [
        Reason::Malformed,
        Reason::Checksum,
        Reason::TooLong { capacity: 5000 },
        Reason::Version { supported: 1 },
        Reason::Kind { kind: 77 },
        Reason::Length { given: 12 },
        Reason::Timeout,
        Reason::Camera { which: 1 },
        Reason::Input(InputError::LengthMismatch { first: 4, second: 5 }),
        Reason::Input(InputError::TooFew { given: 4, needed: 5 }),
        Reason::Input(InputError::TooMany { given: 201, capacity: 200 }),
        Reason::Input(InputError::NotFinite { array: 1, index: 17 }),
        Reason::Options(OptionsError::MaxError),
        Reason::Options(OptionsError::Sigma),
        Reason::Options(OptionsError::Confidence),
        Reason::Options(OptionsError::NoIterations),
        Reason::Prior,
    ] {
        for sequence in [None, Some(0), Some(65535)] {
            let refusal = Refusal { sequence, reason };
            let mut out = [0; 40];
            let n = refusal.encode(&mut out, 99).unwrap();
            parsed(&out[..n], |frame| assert_eq!(Reply::parse(frame), Some(Reply::Refused(refusal, 99))));
            assert!(!format!("{reason}").is_empty());
        }
    }
}

#[test]
fn statistics_come_back_and_sum_up() {
    let mut statistics = Statistics { malformed: 3, unusable: 4, missed: 9, ..Statistics::default() };
    statistics.output_errors = 0xDEAD_BEEF;
    let mut out = [0; 200];
    let n = encode(&mut out, kind::STATISTICS | kind::ANSWER, 3, |body| statistics.write(body)).unwrap();
    parsed(&out[..n], |frame| assert_eq!(Reply::parse(frame), Some(Reply::Statistics(statistics))));
    assert_eq!(statistics.refused(), 7);
}
