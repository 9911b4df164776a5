//! The server itself.

use embedded_hal::digital::OutputPin;
use embedded_io::{Read, ReadReady, Write};
use epipole::InputError;
use epipole::estimate::{
    AbsolutePoseError, AbsolutePoseEstimate, AbsolutePoseWorkspace, RelativePoseEstimate,
    RelativePoseWorkspace, TwoViewError, absolute_pose_guided, relative_pose_guided,
};
use epipole::nalgebra::{Vector2, Vector3};
use epipole::robust::{Guide, Progress, StopReason};
use epipole_wire::{
    AbsolutePoseRequest, Decoder, Full, Order, Reason, Records, Refusal, RelativePoseRequest, Request,
    Statistics, absolute_pose_reply, encode, kind, relative_pose_reply,
};

use crate::Memory;
use crate::memory::Slices;
use crate::order::Sequence;

/// Time, for deadlines and timeouts.
pub trait Clock {
    /// Microseconds since any moment; never less than before.
    fn now_us(&mut self) -> u64;
}

/// What no request may exceed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// The longest search, microseconds; a request may ask for less. Then the best pose so far is refined and judged, and
    /// the answer says that the deadline ended it. Default one second.
    pub deadline_us: u32,
    /// The longest pause inside a frame, microseconds. Default 100 ms.
    pub pause_us: u32,
}

impl Default for Limits {
    fn default() -> Self {
        Self { deadline_us: 1_000_000, pause_us: 100_000 }
    }
}

/// What a call of [`Server::poll`] came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activity {
    /// No frame has ended.
    Idle,
    /// A request was answered.
    Answered,
    /// A frame was refused.
    Refused(Reason),
    /// The sender, who has been answered, asks for a restart.
    Restart,
}

/// Answers the requests that arrive on a serial line.
///
/// The data-ready pin is high from when an answer is known to when its last byte has left.
///
/// A line that loses bytes while the server computes needs a buffer behind its interrupt, or a sender who waits for each
/// answer before the next request.
pub struct Server<'m, U, P, C> {
    line: U,
    ready: P,
    clock: C,
    limits: Limits,
    decoder: Decoder<'m>,
    slices: Slices<'m>,
    sequence: Sequence,
    statistics: Statistics,
    started_us: u64,
    /// When the last byte came.
    heard_us: u64,
}

impl<'m, U: Read + ReadReady + Write, P: OutputPin, C: Clock> Server<'m, U, P, C> {
    /// A server; its pin goes low.
    pub fn new<const N: usize, const BYTES: usize>(
        memory: &'m mut Memory<N, BYTES>,
        line: U,
        ready: P,
        mut clock: C,
        limits: Limits,
    ) -> Self {
        let started_us = clock.now_us();
        let (mut decoder, slices) = memory.split();
        let statistics = Statistics {
            capacity: N as u32,
            wide_capacity: (N * 5 / 18 / 4 * 4) as u32,
            frame_capacity: decoder.buffer().len() as u32,
            ..Statistics::default()
        };
        let sequence = Sequence::default();
        let heard_us = started_us;
        let mut server =
            Self { line, ready, clock, limits, decoder, slices, sequence, statistics, started_us, heard_us };
        let low = server.ready.set_low();
        server.count_output(low.is_ok());
        server
    }

    /// What it has seen so far.
    pub fn statistics(&mut self) -> Statistics {
        let uptime_us = self.clock.now_us().saturating_sub(self.started_us);
        self.statistics.uptime_ms = (uptime_us / 1000) as u32;
        self.statistics
    }

    /// Whether a frame has begun: then [`poll`](Self::poll) should be called before the pause in it is too long, even
    /// if no byte comes.
    #[must_use]
    pub fn pending(&self) -> bool {
        self.decoder.pending()
    }

    /// Gives the line, the pin and the clock back.
    pub fn release(self) -> (U, P, C) {
        (self.line, self.ready, self.clock)
    }

    /// Takes the bytes that are there, up to the end of a frame, and answers it. Does not wait for bytes.
    pub fn poll(&mut self) -> Activity {
        loop {
            match self.line.read_ready() {
                Ok(true) => (),
                Ok(false) => return self.pause(),
                Err(_) => {
                    self.statistics.line_errors = self.statistics.line_errors.wrapping_add(1);
                    return Activity::Idle;
                }
            }
            let mut byte = [0];
            match self.line.read(&mut byte) {
                Ok(0) => return self.pause(),
                Ok(_) => (),
                // A byte was lost or damaged: the checksum tells, if it was a frame's.
                Err(_) => {
                    self.statistics.line_errors = self.statistics.line_errors.wrapping_add(1);
                    continue;
                }
            }
            self.statistics.bytes = self.statistics.bytes.wrapping_add(1);
            self.heard_us = self.clock.now_us();
            // The frame lies in the buffer in which its answer will stand: what the answer tells is kept aside.
            let told = match self.decoder.feed(byte[0]) {
                None => continue,
                Some(Err(refusal)) => {
                    if let Some(number) = refusal.sequence {
                        self.sequence.take(number, &mut self.statistics);
                    }
                    Err(refusal)
                }
                Some(Ok(frame)) => {
                    let order = self.sequence.take(frame.sequence, &mut self.statistics);
                    let until_us = |asked_us| {
                        let limit_us = self.limits.deadline_us;
                        let span_us =
                            if asked_us == 0 { limit_us } else { core::cmp::min(asked_us, limit_us) };
                        self.heard_us.saturating_add(u64::from(span_us))
                    };
                    match Request::parse(&frame) {
                        Ok(Request::RelativePose(request)) => {
                            let until_us = until_us(request.deadline_us);
                            relative(&request, &mut self.slices, &mut self.clock, until_us)
                                .map(|(estimate, count)| Told::Relative(order, estimate, count))
                        }
                        Ok(Request::AbsolutePose(request)) => {
                            let until_us = until_us(request.deadline_us);
                            absolute(&request, &mut self.slices, &mut self.clock, until_us)
                                .map(|(estimate, count)| Told::Absolute(order, estimate, count))
                        }
                        Ok(Request::Statistics) => Ok(Told::Statistics(kind::STATISTICS)),
                        Ok(Request::Restart) => Ok(Told::Statistics(kind::RESTART)),
                        Ok(_) => Err(Reason::Kind { kind: frame.kind }),
                        Err(reason) => Err(reason),
                    }
                    .map(|told| (told, frame.sequence))
                    .map_err(|reason| Refusal { sequence: Some(frame.sequence), reason })
                }
            };
            return match told {
                Ok((told, sequence)) => self.answer(&told, sequence),
                Err(refusal) => self.refuse(refusal),
            };
        }
    }

    /// Gives up a frame whose bytes stopped coming.
    fn pause(&mut self) -> Activity {
        let quiet_us = self.clock.now_us().saturating_sub(self.heard_us);
        if !self.decoder.pending() || quiet_us < u64::from(self.limits.pause_us) {
            return Activity::Idle;
        }
        self.decoder.give_up();
        self.refuse(Refusal { sequence: None, reason: Reason::Timeout })
    }

    fn answer(&mut self, told: &Told, sequence: u16) -> Activity {
        let elapsed_us = self.clock.now_us().saturating_sub(self.heard_us);
        let elapsed_us = u32::try_from(elapsed_us).unwrap_or(u32::MAX);
        let (length, activity) = match told {
            Told::Relative(order, estimate, count) => {
                self.count_estimate(estimate.report.stop);
                let out = self.decoder.buffer();
                let inliers = taken(self.slices.inliers, *count);
                (
                    relative_pose_reply(out, sequence, *order, elapsed_us, estimate, inliers),
                    Activity::Answered,
                )
            }
            Told::Absolute(order, estimate, count) => {
                self.count_estimate(estimate.report.stop);
                let out = self.decoder.buffer();
                let inliers = taken(self.slices.inliers, *count);
                (
                    absolute_pose_reply(out, sequence, *order, elapsed_us, estimate, inliers),
                    Activity::Answered,
                )
            }
            Told::Statistics(kind) => {
                self.statistics.asked = self.statistics.asked.wrapping_add(1);
                let statistics = self.statistics();
                let out = self.decoder.buffer();
                let length = encode(out, kind | kind::ANSWER, sequence, |body| statistics.write(body));
                let activity = if *kind == kind::RESTART { Activity::Restart } else { Activity::Answered };
                (length, activity)
            }
        };
        self.send(length);
        activity
    }

    fn count_estimate(&mut self, stop: StopReason) {
        let statistics = &mut self.statistics;
        statistics.answered = statistics.answered.wrapping_add(1);
        let interrupted = u32::from(stop == StopReason::Interrupted);
        statistics.interrupted = statistics.interrupted.wrapping_add(interrupted);
    }

    fn refuse(&mut self, refusal: Refusal) -> Activity {
        let statistics = &mut self.statistics;
        let counter = match refusal.reason {
            Reason::Malformed => &mut statistics.malformed,
            Reason::Checksum => &mut statistics.checksum,
            Reason::TooLong { .. } => &mut statistics.too_long,
            Reason::Version { .. } => &mut statistics.version,
            Reason::Kind { .. } => &mut statistics.kind,
            Reason::Length { .. } => &mut statistics.length,
            Reason::Timeout => &mut statistics.timeout,
            _ => &mut statistics.unusable,
        };
        *counter = counter.wrapping_add(1);
        let refused = statistics.refused();
        let length = refusal.encode(self.decoder.buffer(), refused);
        self.send(length);
        Activity::Refused(refusal.reason)
    }

    /// Sends what stands in the buffer.
    fn send(&mut self, length: Result<usize, Full>) {
        let high = self.ready.set_high();
        let frame = length.ok().and_then(|length| self.decoder.buffer().get(..length));
        let sent = match frame {
            Some(frame) => self.line.write_all(frame).is_ok() && self.line.flush().is_ok(),
            None => false,
        };
        let low = self.ready.set_low();
        self.count_output(sent && high.is_ok() && low.is_ok());
    }

    fn count_output(&mut self, well: bool) {
        self.statistics.output_errors = self.statistics.output_errors.wrapping_add(u32::from(!well));
    }
}

/// What an answer tells.
#[allow(clippy::large_enum_variant)] // Where nothing is allocated there is no other place.
enum Told {
    /// With the number of correspondences.
    Relative(Order, RelativePoseEstimate<f32>, usize),
    Absolute(Order, AbsolutePoseEstimate<f32>, usize),
    /// To a request of this kind.
    Statistics(u8),
}

fn relative(
    request: &RelativePoseRequest<'_>,
    slices: &mut Slices<'_>,
    clock: &mut impl Clock,
    until_us: u64,
) -> Result<(RelativePoseEstimate<f32>, usize), Reason> {
    let count = room(&request.correspondences, slices)?;
    let (x1, x2, scores) = (&mut *slices.first, &mut *slices.second, &mut *slices.scores);
    let records = request.correspondences.iter();
    for (((([u1, v1, u2, v2], score), x1), x2), slot) in records.zip(&mut *x1).zip(&mut *x2).zip(&mut *scores)
    {
        (*x1, *x2, *slot) = (Vector2::new(u1, v1), Vector2::new(u2, v2), score);
    }
    let mut in_time = |_: &Progress| clock.now_us() < until_us;
    let guide = Guide {
        scores: request.correspondences.scored().then(|| taken(scores, count)),
        keep_going: Some(&mut in_time),
    };
    let mut workspace = RelativePoseWorkspace::from_slices(slices.numbers, slices.order, slices.inliers);
    let [camera1, camera2] = &request.cameras;
    let (x1, x2) = (taken(x1, count), taken(x2, count));
    let estimate = relative_pose_guided(camera1, camera2, x1, x2, &request.options, guide, &mut workspace);
    match estimate {
        Ok(estimate) => Ok((estimate, count)),
        Err(TwoViewError::Input(error)) => Err(Reason::Input(error)),
        Err(TwoViewError::Options(error)) => Err(Reason::Options(error)),
        Err(TwoViewError::Prior) => Err(Reason::Prior),
        Err(_) => Err(UNKNOWN),
    }
}

fn absolute(
    request: &AbsolutePoseRequest<'_>,
    slices: &mut Slices<'_>,
    clock: &mut impl Clock,
    until_us: u64,
) -> Result<(AbsolutePoseEstimate<f32>, usize), Reason> {
    let count = room(&request.correspondences, slices)?;
    let (pixels, points, scores) = (&mut *slices.first, &mut *slices.points, &mut *slices.scores);
    let records = request.correspondences.iter();
    for (((([u, v, x, y, z], score), pixel), point), slot) in
        records.zip(&mut *pixels).zip(&mut *points).zip(&mut *scores)
    {
        (*pixel, *point, *slot) = (Vector2::new(u, v), Vector3::new(x, y, z), score);
    }
    let mut in_time = |_: &Progress| clock.now_us() < until_us;
    let guide = Guide {
        scores: request.correspondences.scored().then(|| taken(scores, count)),
        keep_going: Some(&mut in_time),
    };
    let mut workspace = AbsolutePoseWorkspace::from_slices(slices.numbers, slices.order, slices.inliers);
    let (pixels, points) = (taken(pixels, count), taken(points, count));
    let estimate =
        absolute_pose_guided(&request.camera, pixels, points, &request.options, guide, &mut workspace);
    match estimate {
        Ok(estimate) => Ok((estimate, count)),
        Err(AbsolutePoseError::Input(error)) => Err(Reason::Input(error)),
        Err(AbsolutePoseError::Options(error)) => Err(Reason::Options(error)),
        Err(AbsolutePoseError::Gravity) => Err(Reason::Prior),
        Err(_) => Err(UNKNOWN),
    }
}

/// An error that a later version of the library knows.
const UNKNOWN: Reason = Reason::Other { code: 254 };

/// The number of correspondences, if there is room for them.
fn room<const W: usize>(records: &Records<'_, W>, slices: &Slices<'_>) -> Result<usize, Reason> {
    let (given, capacity) = (records.len(), slices.first.len());
    if given > capacity { Err(Reason::Input(InputError::TooMany { given, capacity })) } else { Ok(given) }
}

fn taken<T>(slice: &[T], count: usize) -> &[T] {
    slice.get(..count).unwrap_or_default()
}
