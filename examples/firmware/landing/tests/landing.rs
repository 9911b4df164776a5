//! The tracker on single frames, and a whole descent.

use epipole::geometry::pose::rotation_angle;
use epipole::geometry::{CameraModel, Pose};
use epipole::nalgebra::{Vector2, Vector3};
use epipole_landing::simulation::{FRAMES, descend};
use epipole_landing::{BEACONS, Sighting, Tracker, nominal_camera};
use epipole_sen0158::{Blob, Blobs};

fn blobs(pose: &Pose<f32>) -> Blobs {
    BEACONS.map(|beacon| {
        let at = pose.rotation * Vector3::new(beacon.x, beacon.y, 0.0) + pose.translation.vector;
        let pixel: Vector2<f32> = nominal_camera().project(&at).unwrap();
        Some(Blob { x: pixel.x.round() as u16, y: pixel.y.round() as u16, size: 2 })
    })
}

fn near() -> Pose<f32> {
    Pose::new(Vector3::new(0.01, -0.02, 0.7), Vector3::new(0.3, -0.25, 0.4))
}

fn tracker() -> Tracker {
    Tracker::new(nominal_camera(), 0.42)
}

#[test]
fn a_descent_is_flown_without_a_wrong_pose() {
    let mut frames = 0;
    let report = descend(|frame, sighting| {
        frames += 1;
        let name: String = format!("{sighting:?}").chars().take_while(|c| *c != '(').collect();
        println!("{frame} {name}");
    });
    println!("{report:#?}");
    assert!(report.passed());
    assert_eq!(frames + report.unread, FRAMES);
    // Everything that can happen has happened.
    assert!(
        report.seen > 100 && report.tracked > 10 && report.too_few > 2 && report.unread > 2,
        "{report:?}"
    );
    assert!(report.ambiguous[0] > 0, "{report:?}");
}

#[test]
fn any_order_of_the_blobs_gives_the_same_pose() {
    let whole = blobs(&near());
    let orders = (0..256u32).map(|n| [n & 3, n >> 2 & 3, n >> 4 & 3, n >> 6].map(|k| k as usize));
    let orders: Vec<_> = orders.filter(|o| (0..4).all(|k| o.contains(&k))).collect();
    assert_eq!(orders.len(), 24);
    for order in orders {
        let Sighting::Seen(found, twin) = tracker().update(&order.map(|k| whole[k])) else {
            panic!("{order:?}")
        };
        assert!(rotation_angle(&found.pose.rotation, &near().rotation) < 0.01);
        assert!((found.pose.translation.vector - near().translation.vector).norm() < 0.005);
        assert!(found.covariance.is_some());
        for (k, slot) in found.slots.iter().enumerate() {
            assert_eq!(order[usize::from(slot.unwrap())], k);
        }
        assert!(twin.is_none_or(|twin| twin.rms_px > 2.0 * found.rms_px));
    }
}

#[test]
fn a_far_pad_is_ambiguous_and_the_last_pose_decides() {
    let far = |tilt: f32| Pose::<f32>::new(Vector3::new(0.0, 0.0, 3.0), Vector3::new(tilt, 0.0, 0.3));
    let seen = blobs(&far(0.1));
    let Sighting::Ambiguous(one, other) = tracker().update(&seen) else { panic!() };
    for start in [one, other] {
        // Nearer, the same tilt is seen in one way; the tracker goes on from there.
        let mut tracker = tracker();
        let nearer = Pose::from_parts((start.pose.translation.vector * 0.2).into(), start.pose.rotation);
        assert!(matches!(tracker.update(&blobs(&nearer)), Sighting::Seen(..)));
        let Sighting::Ambiguous(first, _) = tracker.update(&seen) else { panic!() };
        assert!(rotation_angle(&first.pose.rotation, &start.pose.rotation) < 1e-3);
    }
}

#[test]
fn three_beacons_are_followed_and_alone_decide_nothing() {
    for hidden in 0..4 {
        let mut part = blobs(&near());
        part[hidden] = None;
        assert_eq!(tracker().update(&part), Sighting::Undecided);
        let mut tracker = tracker();
        tracker.update(&blobs(&near()));
        let Sighting::Tracked(found) = tracker.update(&part) else { panic!("{hidden}") };
        assert!((found.pose.translation.vector - near().translation.vector).norm() < 0.01);
        assert_eq!(found.slots[hidden], None);
        // Too long without any: the last pose tells nothing any more.
        for _ in 0..11 {
            assert_eq!(tracker.update(&[None; 4]), Sighting::TooFew(0));
        }
        assert_eq!(tracker.update(&part), Sighting::Undecided);
    }
}

#[test]
fn reflections_and_mirrors_are_no_beacons() {
    let mut mirrored = blobs(&near());
    for blob in mirrored.iter_mut().flatten() {
        blob.x = 1023 - blob.x;
    }
    assert_eq!(tracker().update(&mirrored), Sighting::Unknown);
    let mut part = blobs(&near());
    part[1] = Some(Blob { x: 900, y: 50, size: 9 });
    assert_eq!(tracker().update(&part), Sighting::Unknown);
    let mut tracker = tracker();
    tracker.update(&blobs(&near()));
    let Sighting::Tracked(found) = tracker.update(&part) else { panic!() };
    assert_eq!(found.slots[1], None);
    tracker.reset();
    // All in one place, or on a line.
    for line in [0, 1] {
        let blobs = [0, 1, 2, 3].map(|k| Some(Blob { x: 300 + 50 * line * k, y: 300, size: 1 }));
        assert_eq!(tracker.update(&blobs), Sighting::Unknown);
    }
}
