//! A sensor that is not there, and a descent.

use core::fmt;

use embedded_hal::delay::DelayNs;
use embedded_hal::i2c::{ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation};
use epipole::geometry::pose::{exp, log, rotation_angle};
use epipole::geometry::{CameraModel, Pose};
use epipole::linalg::Ldlt;
use epipole::nalgebra::{Vector2, Vector3, Vector6};
use epipole::real::sin_cos;
use epipole_problems::random::SplitMix64;
use epipole_problems::two_view::cast_pose;
use epipole_sen0158::{ADDRESS, Blob, Blobs, CONFIGURATION, HEIGHT, READING, Sen0158, WIDTH, encode};

use crate::{BEACONS, PadPose, Sighting, Tracker, nominal_camera};

/// The sensor's side of the bus.
#[derive(Clone, Debug)]
pub struct SimulatedSensor {
    /// How much of its configuration it has got, in order.
    configured: usize,
    reading: [u8; 16],
    /// What the next reading begins with.
    torn: Option<[u8; 16]>,
    /// It does not acknowledge the next time.
    silent: bool,
}

impl Default for SimulatedSensor {
    fn default() -> Self {
        Self { configured: 0, reading: [0xff; 16], torn: None, silent: false }
    }
}

impl SimulatedSensor {
    /// What it sees from now on. A torn reading is half the last and half this one; a silent sensor misses one call.
    pub fn show(&mut self, blobs: &Blobs, torn: bool, silent: bool) {
        let new = encode(blobs);
        let mut half = self.reading;
        for (old, new) in half.iter_mut().zip(&new).take(9) {
            *old = *new;
        }
        (self.torn, self.silent) = (torn.then_some(half), silent);
        self.reading = new;
    }
}

impl ErrorType for SimulatedSensor {
    type Error = ErrorKind;
}

impl I2c for SimulatedSensor {
    fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), ErrorKind> {
        if address != ADDRESS || core::mem::take(&mut self.silent) {
            return Err(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address));
        }
        for operation in operations {
            match operation {
                Operation::Write([READING]) => (),
                Operation::Write(write) => {
                    let next = CONFIGURATION.get(self.configured).map(|write| &write[..]);
                    self.configured = if next == Some(*write) { self.configured + 1 } else { 0 };
                }
                Operation::Read(buffer) => {
                    // Not configured, it sees nothing.
                    let whole =
                        if self.configured == CONFIGURATION.len() { self.reading } else { [0xff; 16] };
                    let reading = self.torn.take().unwrap_or(whole);
                    for (to, from) in buffer.iter_mut().zip(&reading) {
                        *to = *from;
                    }
                }
            }
        }
        Ok(())
    }
}

/// Time that nobody waits for.
#[derive(Clone, Copy, Debug)]
pub struct NoDelay;

impl DelayNs for NoDelay {
    fn delay_ns(&mut self, _: u32) {}
}

/// Frames of the descent.
pub const FRAMES: u32 = 240;
/// Of a blob's coordinate, pixels: what is added, and the rounding.
const NOISE_PX: f64 = 0.3;

/// The true pose in a frame: from 2.6 m down to 0.45 m, swaying, tilting, and turning by half a circle.
#[must_use]
pub fn truth(frame: u32) -> Pose<f64> {
    let s = f64::from(frame) / f64::from(FRAMES);
    let (a, b) = sin_cos(9.0 * s);
    let tilt = exp(&Vector3::new(0.12 * a, 0.15 * b, 0.0));
    let rotation = tilt * exp(&Vector3::new(0.0, 0.0, 3.0 * s - 1.0));
    let height = 2.6 - 2.15 * s;
    // It looks at the pad, more or less.
    let aim = rotation.inverse() * Vector3::new(0.02 * b, 0.02 * a, 1.0);
    let centre = aim * (-height / aim.z);
    Pose::from_parts((-(rotation * centre)).into(), rotation)
}

/// What the sensor sees in a frame: noisy, rounded, in any order; now and then a beacon is hidden, or a reflection takes
/// its place.
#[must_use]
pub fn seen(frame: u32) -> Blobs {
    let mut random = SplitMix64(0x1A4D_0000 + u64::from(frame));
    let (pose, camera) = (truth(frame), nominal_camera());
    let mut blobs = [None; 4];
    for (k, (blob, beacon)) in (0u32..).zip(blobs.iter_mut().zip(&BEACONS)) {
        let at = pose.rotation * Vector3::new(f64::from(beacon.x), f64::from(beacon.y), 0.0)
            + pose.translation.vector;
        let [n, m] = random.normal_pair();
        let hidden = frame % 13 == 6 && frame / 13 % 4 == k || frame % 40 == 31 && k < 2;
        let mut pixel = camera.project(&at.map(|x| x as f32)).unwrap_or(Vector2::new(-1.0, -1.0));
        if frame % 29 == 20 && frame / 29 % 4 == k {
            pixel = Vector2::new(random.between(0.0, 1023.0) as f32, random.between(0.0, 767.0) as f32);
        }
        let round = |x: f32, noise: f64| (f64::from(x) + NOISE_PX * noise + 0.5) as i32;
        let (x, y) = (round(pixel.x, n), round(pixel.y, m));
        let inside = pixel.x > 0.0 && pixel.y > 0.0 && x < i32::from(WIDTH) && y < i32::from(HEIGHT);
        *blob = (inside && !hidden).then_some(Blob { x: x as u16, y: y as u16, size: 2 });
    }
    // The order of detection changes when a beacon comes back.
    for k in (1..4usize).rev() {
        let other = SplitMix64(u64::from(frame / 6) * 4 + k as u64).bits() % (k as u64 + 1);
        blobs.swap(k, other as usize);
    }
    blobs
}

/// How a descent went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Report {
    /// Frames with one pose of four beacons.
    pub seen: u32,
    /// Frames with two poses of four beacons, and those whose first pose was the true one.
    pub ambiguous: [u32; 2],
    /// Frames with the pose of three beacons.
    pub tracked: u32,
    /// Frames with three blobs and no recent pose.
    pub undecided: u32,
    /// Frames with fewer than three blobs.
    pub too_few: u32,
    /// Frames whose blobs are no beacons.
    pub unknown: u32,
    /// Frames without a reading.
    pub unread: u32,
    /// Readings that differ from what was to be seen: torn ones that passed.
    pub misread: u32,
    /// Poses whose translation is off by more than 5 % of the distance, or whose rotation is off by more than 0.3 rad.
    pub wrong: u32,
    /// Largest error of the camera's place over the distance, of the poses that are not wrong.
    pub worst: f32,
    /// Mean of the squared error over the covariance, of four beacons: six where the covariance is right.
    pub consistency: f32,
    /// Of the bits of all poses.
    pub hash: u64,
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            seen, ambiguous: [ambiguous, right], tracked, undecided, too_few, unknown, unread, ..
        } = self;
        write!(
            f,
            "{FRAMES} frames: {seen} seen, {ambiguous} ambiguous ({right} right), {tracked} of three beacons, {undecided} \
             undecided, {too_few} with too few, {unknown} unknown, {unread} unread, {} misread, {} wrong; worst {:.5} of \
             the distance, consistency {:.3}, bits {:016x}",
            self.misread, self.wrong, self.worst, self.consistency, self.hash
        )
    }
}

impl Report {
    /// Every pose is right or told to be open, and the covariance is what the errors are.
    #[must_use]
    pub fn passed(&self) -> bool {
        let posed = self.seen + self.ambiguous[0] + self.tracked;
        let all = posed + self.undecided + self.too_few + self.unknown + self.unread;
        all == FRAMES
            && self.wrong == 0
            && self.misread == 0
            && self.ambiguous[0] == self.ambiguous[1]
            && posed * 10 >= FRAMES * 9
            && self.consistency > 4.0
            && self.consistency < 8.0
    }
}

/// Flies down with the sensor's driver and the tracker; `log` gets every frame.
pub fn descend(mut log: impl FnMut(u32, &Sighting)) -> Report {
    let mut sensor = SimulatedSensor::default();
    let mut report = Report { hash: 0xCBF2_9CE4_8422_2325, ..Report::default() };
    if Sen0158::new(&mut sensor).configure(&mut NoDelay).is_err() {
        return report;
    }
    let mut tracker = Tracker::new(nominal_camera(), 0.42);
    let mut squares = 0.0;
    for frame in 0..FRAMES {
        let shown = seen(frame);
        sensor.show(&shown, frame % 5 == 3, frame % 50 == 44);
        let Ok(blobs) = Sen0158::new(&mut sensor).blobs() else {
            report.unread += 1;
            continue;
        };
        report.misread += u32::from(blobs != shown);
        let sighting = tracker.update(&blobs);
        log(frame, &sighting);
        let true_pose = cast_pose::<f32>(&truth(frame));
        let found = match &sighting {
            Sighting::Seen(found, _) => {
                report.seen += 1;
                squares += consistency(found, &true_pose);
                found
            }
            Sighting::Ambiguous(found, other) => {
                let apart = |pose: &PadPose| rotation_angle(&pose.pose.rotation, &true_pose.rotation);
                report.ambiguous[0] += 1;
                report.ambiguous[1] += u32::from(apart(found) <= apart(other));
                found
            }
            Sighting::Tracked(found) => {
                report.tracked += 1;
                found
            }
            other => {
                match other {
                    Sighting::Undecided => report.undecided += 1,
                    Sighting::TooFew(_) => report.too_few += 1,
                    _ => report.unknown += 1,
                }
                continue;
            }
        };
        let moved = found.pose.translation.vector - true_pose.translation.vector;
        let off = epipole::real::sqrt(moved.norm_squared() / true_pose.translation.vector.norm_squared());
        if off > 0.05 || rotation_angle(&found.pose.rotation, &true_pose.rotation) > 0.3 {
            report.wrong += 1;
        } else if off > report.worst {
            report.worst = off;
        }
        for x in found.pose.rotation.coords.iter().chain(found.pose.translation.vector.iter()) {
            report.hash = (report.hash ^ u64::from(x.to_bits())).wrapping_mul(0x0100_0000_01B3);
        }
    }
    report.consistency = squares / core::cmp::max(report.seen, 1) as f32;
    report
}

/// The squared error over the covariance.
fn consistency(found: &PadPose, truth: &Pose<f32>) -> f32 {
    let turn = log(&(found.pose.rotation * truth.rotation.inverse()));
    let moved = found.pose.translation.vector - truth.translation.vector;
    let error = Vector6::new(turn.x, turn.y, turn.z, moved.x, moved.y, moved.z);
    match found.covariance.and_then(|covariance| Ldlt::new(&covariance)) {
        Some(factors) => error.dot(&(factors.inverse() * error)),
        None => f32::MAX,
    }
}
