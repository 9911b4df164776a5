//! From blobs to the pose of the camera.

use epipole::Solutions;
use epipole::geometry::pose::rotation_angle;
use epipole::geometry::{CameraModel, Pinhole, Pose};
use epipole::nalgebra::{Matrix6, Vector2, Vector3, Vector6};
use epipole::refine::{PosePrior, RefineAbsolutePoseOptions, absolute_pose};
use epipole::robust::loss::Loss;
use epipole::solvers::{abspose_planar, p3p};
use epipole_sen0158::Blobs;

use crate::BEACONS;

/// A pose from the pad to the camera, `x_cam = R X + t`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PadPose {
    /// Pad to camera.
    pub pose: Pose<f32>,
    /// Of the rotation vector (rad), then of t (m); none where the beacons leave a direction open. To first order: a pad
    /// seen nearly from the front from afar has larger errors of its tilt.
    pub covariance: Option<Matrix6<f32>>,
    /// Root mean square of the beacons' errors, pixels.
    pub rms_px: f32,
    /// The slot in which each beacon was seen.
    pub slots: [Option<u8>; 4],
}

/// What the blobs say.
#[derive(Clone, Debug, PartialEq)]
pub enum Sighting {
    /// All beacons were seen, and one pose explains them; the other pose of the plane, where there is one, does not.
    Seen(PadPose, Option<PadPose>),
    /// All beacons were seen, and both poses of their plane explain them: the first is nearer to the last pose, or, without
    /// one, more likely.
    Ambiguous(PadPose, PadPose),
    /// Three beacons were seen near where the last pose expects them: their pose with the last one as a prior, where no
    /// other pose of theirs (P3P) is as likely.
    Tracked(PadPose),
    /// Three blobs and no recent pose: three points leave up to four poses for each of twelve assignments.
    Undecided,
    /// Fewer than three blobs: how many.
    TooFew(u8),
    /// The blobs are no beacons in any assignment: reflections, or a mirrored image.
    Unknown,
}

/// Turns blobs into poses, and remembers the last one.
#[derive(Clone, Debug)]
pub struct Tracker {
    camera: Pinhole<f32>,
    /// Of a blob's coordinate, pixels.
    sigma_px: f32,
    last: Option<Pose<f32>>,
    /// Frames since.
    age: u32,
}

/// Frames after which a pose is too old to expect beacons by.
const MAX_AGE: u32 = 10;
/// How far a beacon may be from where it is expected, pixels.
const GATE_PX: f32 = 60.0;
/// Standard deviations of the motion in one frame: rotation, rad, and translation, as a share of the distance.
const MOTION: [f32; 2] = [0.05, 0.03];
/// Twice the logarithm of 100: squared errors over the variance by which a pose is told from another.
const TOLD_APART: f32 = 9.2;
/// Squared error over the variance of four beacons, eight numbers less six unknowns, beyond which it is no pose.
const MAX_ERROR: f32 = 25.0;

/// A blob in its slot.
type Spot = (u8, Vector2<f32>);

impl Tracker {
    /// A tracker for blobs with so much noise; the sensor's own rounding is 0.3 pixels.
    #[must_use]
    pub fn new(camera: Pinhole<f32>, sigma_px: f32) -> Self {
        Self { camera, sigma_px, last: None, age: 0 }
    }

    /// What the blobs of the next frame say.
    pub fn update(&mut self, blobs: &Blobs) -> Sighting {
        let mut spots = Solutions::<Spot, 4>::new();
        for (slot, blob) in (0u8..).zip(blobs) {
            if let Some(blob) = blob {
                spots.push((slot, Vector2::new(f32::from(blob.x), f32::from(blob.y))));
            }
        }
        self.age = self.age.saturating_add(1);
        if self.age > MAX_AGE {
            self.last = None;
        }
        let sighting = match *spots.as_slice() {
            [a, b, c, d] => self.four([a, b, c, d]),
            [_, _, _] => match self.last {
                Some(last) => self.three(&spots, &last).map_or(Sighting::Unknown, Sighting::Tracked),
                None => Sighting::Undecided,
            },
            ref few => Sighting::TooFew(few.len() as u8),
        };
        if let Sighting::Seen(found, _) | Sighting::Ambiguous(found, _) | Sighting::Tracked(found) = &sighting
        {
            (self.last, self.age) = (Some(found.pose), 0);
        }
        sighting
    }

    /// Forgets the last pose.
    pub fn reset(&mut self) {
        self.last = None;
    }

    /// Blobs in the order of the beacons, clockwise, from any of them: four assignments, each with the poses of a plane.
    fn four(&self, spots: [Spot; 4]) -> Sighting {
        let around = clockwise(spots);
        let mut best: Option<(PadPose, Option<PadPose>)> = None;
        for turn in 0..4 {
            let mut ordered = around;
            ordered.rotate_left(turn);
            let Some(found) = self.planar(&ordered) else { continue };
            if best.as_ref().is_none_or(|(first, _)| found.0.rms_px < first.rms_px) {
                best = Some(found);
            }
        }
        let variance = self.sigma_px * self.sigma_px;
        let error = |found: &PadPose| 4.0 * found.rms_px * found.rms_px / variance;
        match best {
            Some((first, twin)) if error(&first) < MAX_ERROR => match (twin, &self.last) {
                (Some(twin), last) if error(&twin) - error(&first) < TOLD_APART => {
                    let apart = |found: &PadPose| {
                        last.map_or(0.0, |last| rotation_angle(&found.pose.rotation, &last.rotation))
                    };
                    if apart(&twin) < apart(&first) {
                        Sighting::Ambiguous(twin, first)
                    } else {
                        Sighting::Ambiguous(first, twin)
                    }
                }
                (twin, _) => Sighting::Seen(first, twin),
            },
            // One of them may be a reflection in place of a beacon.
            _ => match &self.last {
                Some(last) => self.three(&spots, last).map_or(Sighting::Unknown, Sighting::Tracked),
                None => Sighting::Unknown,
            },
        }
    }

    /// The poses of the pad's plane for blobs in the order of the beacons, refined on the pixels.
    fn planar(&self, ordered: &[Spot; 4]) -> Option<(PadPose, Option<PadPose>)> {
        let mut bearings = [Vector3::z(); 4];
        for (bearing, (_, pixel)) in bearings.iter_mut().zip(ordered) {
            *bearing = self.camera.unproject(pixel).ok()?;
        }
        let poses = abspose_planar(&bearings, &BEACONS).ok()?;
        let seen = ordered.map(Some);
        let mut refined = poses.iter().filter_map(|found| self.refined(&found.pose, &seen, None));
        let (first, second) = (refined.next()?, refined.next());
        Some(match second {
            // Refined into the same minimum, there is one.
            Some(second) if rotation_angle(&second.pose.rotation, &first.pose.rotation) < 1e-3 => {
                (first, None)
            }
            Some(second) if second.rms_px < first.rms_px => (second, Some(first)),
            second => (first, second),
        })
    }

    /// Blobs near where the last pose expects beacons, and their pose near the last one.
    fn three(&self, spots: &[Spot], last: &Pose<f32>) -> Option<PadPose> {
        let mut seen = [None; 4];
        for (slot, beacon) in seen.iter_mut().zip(&BEACONS) {
            let expected = self.project(last, beacon)?;
            *slot = nearest(spots, &expected);
        }
        // A blob that two beacons claim is neither's.
        for k in 0..4 {
            let claimed =
                seen.iter().flatten().filter(|(slot, _)| Some(*slot) == seen[k].map(|(slot, _)| slot));
            if claimed.count() > 1 {
                return None;
            }
        }
        let mut bearings = Solutions::<Vector3<f32>, 4>::new();
        let mut points = Solutions::<Vector3<f32>, 4>::new();
        for (spot, beacon) in seen.iter().zip(&BEACONS) {
            if let Some((_, pixel)) = spot {
                bearings.push(self.camera.unproject(pixel).ok()?);
                points.push(raised(beacon));
            }
        }
        let (&[a, b, c, ..], &[p, q, r, ..]) = (bearings.as_slice(), points.as_slice()) else { return None };
        // How unlikely a motion is, as a squared error over its variance.
        let [turn, moved] = MOTION.map(|sigma| 1.0 / (sigma * sigma * self.age as f32));
        let moved = moved / last.translation.vector.norm_squared();
        let unlikely = |pose: &Pose<f32>| {
            let angle = rotation_angle(&pose.rotation, &last.rotation);
            let shift = pose.translation.vector - last.translation.vector;
            turn * angle * angle + moved * shift.norm_squared()
        };
        let information = Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, moved, moved, moved));
        let found = self.refined(last, &seen, Some(PosePrior { pose: *last, information }))?;
        // Another pose of the same three beacons that is as likely leaves it open. Seen from above, two of their poses are
        // near each other, or vanish in the noise, which is why the refinement starts from the last pose.
        let bound = unlikely(&found.pose) + TOLD_APART;
        let open = p3p(&[a, b, c], &[p, q, r]).iter().any(|other| {
            rotation_angle(&other.rotation, &found.pose.rotation) > 4.0 * MOTION[0] && unlikely(other) < bound
        });
        if open {
            return None;
        }
        (found.rms_px < 3.0 * self.sigma_px).then_some(found)
    }

    fn refined(
        &self,
        start: &Pose<f32>,
        seen: &[Option<Spot>; 4],
        prior: Option<PosePrior<f32>>,
    ) -> Option<PadPose> {
        let mut pixels = Solutions::<Vector2<f32>, 4>::new();
        let mut points = Solutions::<Vector3<f32>, 4>::new();
        for (spot, beacon) in seen.iter().zip(&BEACONS) {
            if let Some((_, pixel)) = spot {
                pixels.push(*pixel);
                points.push(raised(beacon));
            }
        }
        let mut options = RefineAbsolutePoseOptions::default();
        options.loss = Loss::Squared;
        options.sigma_px = self.sigma_px;
        options.prior = prior;
        let refined = absolute_pose(&self.camera, &pixels, &points, start, &options).ok()?;
        let mean = refined.cost / pixels.len() as f32;
        Some(PadPose {
            pose: refined.pose,
            covariance: refined.covariance,
            rms_px: epipole::real::sqrt(mean),
            slots: seen.map(|spot| spot.map(|(slot, _)| slot)),
        })
    }

    fn project(&self, pose: &Pose<f32>, beacon: &Vector2<f32>) -> Option<Vector2<f32>> {
        self.camera.project(&(pose.rotation * raised(beacon) + pose.translation.vector))
    }
}

fn raised(beacon: &Vector2<f32>) -> Vector3<f32> {
    Vector3::new(beacon.x, beacon.y, 0.0)
}

/// The blob nearest to where one is expected, inside the gate.
fn nearest(spots: &[Spot], expected: &Vector2<f32>) -> Option<Spot> {
    let mut best = None;
    let mut least = GATE_PX * GATE_PX;
    for spot in spots {
        let distance = (spot.1 - expected).norm_squared();
        if distance < least {
            (best, least) = (Some(*spot), distance);
        }
    }
    best
}

/// Four points in clockwise order about their middle, which lies inside the cross from wherever it is seen: the line of
/// sight keeps lines, and the beacons stand at the corners of a convex shape.
fn clockwise(mut spots: [Spot; 4]) -> [Spot; 4] {
    let middle = spots.iter().fold(Vector2::zeros(), |sum, (_, p)| sum + p) * 0.25;
    let angle = |(_, p): &Spot| epipole::real::atan2(p.y - middle.y, p.x - middle.x);
    // Few enough for exchanges.
    for end in (1..4).rev() {
        for k in 0..end {
            if angle(&spots[k]) > angle(&spots[k + 1]) {
                spots.swap(k, k + 1);
            }
        }
    }
    spots
}
