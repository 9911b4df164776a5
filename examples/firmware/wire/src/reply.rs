//! What a server answers.

use epipole::Solutions;
use epipole::estimate::{
    AbsolutePose, AbsolutePoseEstimate, AbsolutePoseVerdict, GeneralMotion, PlanarPose, PriorFit,
    PureRotation, RelativePoseEstimate, RelativePoseVerdict, Unobservable,
};
use epipole::geometry::Pose;
use epipole::nalgebra::{Quaternion, SMatrix, Translation3, UnitQuaternion, Vector3};
use epipole::robust::{Progress, RansacReport, StopReason};

use crate::bytes::{Body, Reader};
use crate::frame::{Frame, Full, OVERHEAD, encode};
use crate::{Refusal, Statistics, kind};

/// How a frame's number follows the last one's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// It is the next.
    #[default]
    Next,
    /// Some in between never came, or came damaged.
    Gap,
    /// It had been passed.
    Late,
    /// It is far from both: the sender started again.
    Restart,
}

/// What came with an estimate.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer<'a, E> {
    /// How the request's number followed the last one's.
    pub order: Order,
    /// From the last byte of the request to the answer, microseconds.
    pub elapsed_us: u32,
    /// What the estimator answered.
    pub estimate: E,
    /// Which correspondences are inliers.
    pub inliers: Inliers<'a>,
}

/// One bit a correspondence, the lowest of the first byte first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Inliers<'a> {
    bytes: &'a [u8],
    count: usize,
}

impl<'a> Inliers<'a> {
    /// The mask.
    pub fn iter(&self) -> impl Iterator<Item = bool> + use<'a> {
        self.bytes.iter().flat_map(|byte| (0..8).map(move |bit| byte >> bit & 1 == 1)).take(self.count)
    }
}

/// An answer, read out of a frame.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[allow(clippy::large_enum_variant)] // Where nothing is allocated there is no other place.
pub enum Reply<'a> {
    /// To kind 1.
    RelativePose(Answer<'a, RelativePoseEstimate<f32>>),
    /// To kind 2.
    AbsolutePose(Answer<'a, AbsolutePoseEstimate<f32>>),
    /// To kind 3.
    Statistics(Statistics),
    /// To kind 4: the server starts again.
    Restart(Statistics),
    /// A frame was not answered; with the number of those so far.
    Refused(Refusal, u32),
}

/// The most bytes before the stuffing that an answer about so many correspondences takes.
#[must_use]
pub const fn reply_bytes(correspondences: usize) -> usize {
    const HEAD: usize = 1 + 4 + 2 + 4 + 1 + 4 * 4 + 2 * 8 + 4;
    const PLANAR: usize = 1 + 2 * (28 + 12 + 4 + 1 + 64 * 4) + 1 + 28 + 1 + 25 * 4;
    OVERHEAD + 2 * HEAD + PLANAR + correspondences.div_ceil(8)
}

/// Writes the answer to a request for a relative pose; returns its length on the line.
///
/// # Errors
/// [`Full`].
pub fn relative_pose_reply(
    out: &mut [u8],
    sequence: u16,
    order: Order,
    elapsed_us: u32,
    estimate: &RelativePoseEstimate<f32>,
    inliers: &[bool],
) -> Result<usize, Full> {
    encode(out, kind::RELATIVE_POSE | kind::ANSWER, sequence, |body| {
        write_head(body, order, elapsed_us, estimate.noise_px, &estimate.report);
        write_fit(body, &estimate.prior);
        match &estimate.verdict {
            RelativePoseVerdict::General(motion) => {
                body.u8(0);
                write_pose(body, &motion.pose);
                write_covariance(body, &motion.covariance);
            }
            RelativePoseVerdict::Planar(poses) => {
                body.u8(1);
                body.u8(poses.len() as u8);
                for planar in poses {
                    write_pose(body, &planar.pose);
                    body.f32s(planar.normal.iter());
                    body.f32(planar.baseline_over_distance);
                    write_covariance(body, &planar.covariance);
                }
                body.u8(estimate.general.is_some() as u8);
                if let Some(motion) = &estimate.general {
                    write_pose(body, &motion.pose);
                    write_covariance(body, &motion.covariance);
                }
            }
            RelativePoseVerdict::PureRotation(turn) => {
                body.u8(2);
                body.f32s(turn.rotation.coords.iter());
                write_covariance(body, &turn.covariance);
            }
            RelativePoseVerdict::NoMotion => body.u8(3),
            RelativePoseVerdict::Unobservable(Unobservable::Collinear) => body.u8(4),
            RelativePoseVerdict::Unobservable(_) => body.u8(5),
            RelativePoseVerdict::TooFewInliers => body.u8(6),
            RelativePoseVerdict::GeneralOrPlanar(motion) => {
                body.u8(8);
                write_pose(body, &motion.pose);
                write_covariance(body, &motion.covariance);
            }
            _ => body.u8(7),
        }
        write_mask(body, inliers);
    })
}

/// Writes the answer to a request for an absolute pose; returns its length on the line.
///
/// # Errors
/// [`Full`].
pub fn absolute_pose_reply(
    out: &mut [u8],
    sequence: u16,
    order: Order,
    elapsed_us: u32,
    estimate: &AbsolutePoseEstimate<f32>,
    inliers: &[bool],
) -> Result<usize, Full> {
    encode(out, kind::ABSOLUTE_POSE | kind::ANSWER, sequence, |body| {
        write_head(body, order, elapsed_us, estimate.noise_px, &estimate.report);
        write_fit(body, &estimate.gravity);
        match &estimate.verdict {
            AbsolutePoseVerdict::Pose(found) => {
                body.u8(0);
                write_absolute(body, found);
            }
            AbsolutePoseVerdict::PlanarAmbiguity(poses) => {
                body.u8(1);
                body.u8(poses.len() as u8);
                for found in poses {
                    write_absolute(body, found);
                }
            }
            AbsolutePoseVerdict::BehindCamera => body.u8(3),
            AbsolutePoseVerdict::Unobservable(Unobservable::Collinear) => body.u8(4),
            AbsolutePoseVerdict::Unobservable(_) => body.u8(5),
            AbsolutePoseVerdict::TooFewInliers => body.u8(6),
            _ => body.u8(7),
        }
        write_mask(body, inliers);
    })
}

impl<'a> Reply<'a> {
    /// The answer that a frame holds; none where it holds none that this version knows.
    #[must_use]
    pub fn parse(frame: &Frame<'a>) -> Option<Self> {
        let mut body = Reader(frame.body);
        match frame.kind ^ kind::ANSWER {
            kind::RELATIVE_POSE => relative(&mut body).map(Self::RelativePose),
            kind::ABSOLUTE_POSE => absolute(&mut body).map(Self::AbsolutePose),
            kind::STATISTICS => Statistics::parse(frame.body).map(Self::Statistics),
            kind::RESTART => Statistics::parse(frame.body).map(Self::Restart),
            _ if frame.kind == kind::REFUSED => {
                Refusal::parse(frame).map(|(refusal, count)| Self::Refused(refusal, count))
            }
            _ => None,
        }
    }
}

fn relative<'a>(body: &mut Reader<'a>) -> Option<Answer<'a, RelativePoseEstimate<f32>>> {
    let (order, elapsed_us, noise_px, report) = read_head(body)?;
    let prior = read_fit(body)?;
    let mut general = None;
    let verdict = match body.u8()? {
        0 => RelativePoseVerdict::General(read_motion(body)?),
        1 => {
            let mut poses = Solutions::new();
            for _ in 0..body.u8().filter(|&count| count <= 2)? {
                poses.push(PlanarPose {
                    pose: read_pose(body)?,
                    normal: Vector3::from(body.f32s::<3>()?),
                    baseline_over_distance: body.f32()?,
                    covariance: read_covariance(body)?,
                });
            }
            if body.u8()? == 1 {
                general = Some(read_motion(body)?);
            }
            RelativePoseVerdict::Planar(poses)
        }
        2 => RelativePoseVerdict::PureRotation(PureRotation {
            rotation: read_rotation(body)?,
            covariance: read_covariance(body)?,
        }),
        3 => RelativePoseVerdict::NoMotion,
        4 => RelativePoseVerdict::Unobservable(Unobservable::Collinear),
        5 => RelativePoseVerdict::Unobservable(Unobservable::TooFewDistinct),
        6 => RelativePoseVerdict::TooFewInliers,
        7 => RelativePoseVerdict::NoConsensus,
        8 => RelativePoseVerdict::GeneralOrPlanar(read_motion(body)?),
        _ => return None,
    };
    let estimate = RelativePoseEstimate { verdict, general, prior, noise_px, report };
    Some(Answer { order, elapsed_us, estimate, inliers: read_mask(body)? })
}

fn read_motion(body: &mut Reader<'_>) -> Option<GeneralMotion<f32>> {
    Some(GeneralMotion { pose: read_pose(body)?, covariance: read_covariance(body)? })
}

fn absolute<'a>(body: &mut Reader<'a>) -> Option<Answer<'a, AbsolutePoseEstimate<f32>>> {
    let (order, elapsed_us, noise_px, report) = read_head(body)?;
    let gravity = read_fit(body)?;
    let verdict = match body.u8()? {
        0 => AbsolutePoseVerdict::Pose(read_absolute(body)?),
        1 => {
            let mut poses = Solutions::new();
            for _ in 0..body.u8().filter(|&count| count <= 2)? {
                poses.push(read_absolute(body)?);
            }
            AbsolutePoseVerdict::PlanarAmbiguity(poses)
        }
        3 => AbsolutePoseVerdict::BehindCamera,
        4 => AbsolutePoseVerdict::Unobservable(Unobservable::Collinear),
        5 => AbsolutePoseVerdict::Unobservable(Unobservable::TooFewDistinct),
        6 => AbsolutePoseVerdict::TooFewInliers,
        7 => AbsolutePoseVerdict::NoConsensus,
        _ => return None,
    };
    let estimate = AbsolutePoseEstimate { verdict, gravity, noise_px, report };
    Some(Answer { order, elapsed_us, estimate, inliers: read_mask(body)? })
}

fn write_head(body: &mut Body<'_>, order: Order, elapsed_us: u32, noise_px: f32, report: &RansacReport<f32>) {
    body.u8(order as u8);
    body.u32(elapsed_us);
    let RansacReport { spent, stop, inliers, cost, miss_probability, excluded_inlier_ratio, rival_share } =
        report;
    body.u8(match stop {
        StopReason::Confident => 0,
        StopReason::MaxIterations => 1,
        StopReason::MaxSolverCalls => 2,
        StopReason::MaxResiduals => 3,
        StopReason::Interrupted => 4,
        _ => 5,
    });
    let Progress { iterations, solver_calls, hypotheses, residuals, refinements, inliers: best } = spent;
    for count in [iterations, solver_calls, hypotheses, refinements, best, inliers] {
        body.u32(*count);
    }
    body.u64((*residuals).into());
    body.f32s([cost, miss_probability, excluded_inlier_ratio, rival_share, &noise_px]);
}

fn read_head(body: &mut Reader<'_>) -> Option<(Order, u32, f32, RansacReport<f32>)> {
    let order = match body.u8()? {
        0 => Order::Next,
        1 => Order::Gap,
        2 => Order::Late,
        3 => Order::Restart,
        _ => return None,
    };
    let elapsed_us = body.u32()?;
    let stop = match body.u8()? {
        0 => StopReason::Confident,
        1 => StopReason::MaxIterations,
        2 => StopReason::MaxSolverCalls,
        3 => StopReason::MaxResiduals,
        4 => StopReason::Interrupted,
        _ => return None,
    };
    let (iterations, solver_calls, hypotheses) = (body.u32()?, body.u32()?, body.u32()?);
    let (refinements, best, inliers) = (body.u32()?, body.u32()?, body.u32()?);
    let residuals = body.u64()?.try_into().ok()?;
    let spent = Progress { iterations, solver_calls, hypotheses, residuals, refinements, inliers: best };
    let [cost, miss_probability, excluded_inlier_ratio, rival_share, noise_px] = body.f32s()?;
    let report =
        RansacReport { spent, stop, inliers, cost, miss_probability, excluded_inlier_ratio, rival_share };
    Some((order, elapsed_us, noise_px, report))
}

fn write_fit(body: &mut Body<'_>, fit: &Option<PriorFit<f32>>) {
    let (code, sigmas) = match *fit {
        None => (0, 0.0),
        Some(PriorFit::Fits(sigmas)) => (1, sigmas),
        Some(PriorFit::Contradicted(sigmas)) => (2, sigmas),
        Some(_) => (3, 0.0),
    };
    body.u8(code);
    body.f32(sigmas);
}

#[allow(clippy::option_option)] // The outer one: the body is too short.
fn read_fit(body: &mut Reader<'_>) -> Option<Option<PriorFit<f32>>> {
    let (code, sigmas) = (body.u8()?, body.f32()?);
    match code {
        0 => Some(None),
        1 => Some(Some(PriorFit::Fits(sigmas))),
        2 => Some(Some(PriorFit::Contradicted(sigmas))),
        _ => None,
    }
}

fn write_absolute(body: &mut Body<'_>, found: &AbsolutePose<f32>) {
    write_pose(body, &found.pose);
    body.f32(found.rms_px);
    write_covariance(body, &found.covariance);
}

fn read_absolute(body: &mut Reader<'_>) -> Option<AbsolutePose<f32>> {
    let (pose, rms_px) = (read_pose(body)?, body.f32()?);
    Some(AbsolutePose { pose, covariance: read_covariance(body)?, rms_px })
}

/// The quaternion `i j k w`, then t.
fn write_pose(body: &mut Body<'_>, pose: &Pose<f32>) {
    body.f32s(pose.rotation.coords.iter().chain(pose.translation.vector.iter()));
}

fn read_pose(body: &mut Reader<'_>) -> Option<Pose<f32>> {
    let (rotation, t) = (read_rotation(body)?, Vector3::from(body.f32s::<3>()?));
    Some(Pose::from_parts(Translation3::from(t), rotation))
}

fn read_rotation(body: &mut Reader<'_>) -> Option<UnitQuaternion<f32>> {
    let [i, j, k, w] = body.f32s()?;
    Some(UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k)))
}

/// Whether there is one, then its columns.
fn write_covariance<const N: usize>(body: &mut Body<'_>, covariance: &Option<SMatrix<f32, N, N>>) {
    body.u8(u8::from(covariance.is_some()));
    if let Some(matrix) = covariance {
        body.f32s(matrix.iter());
    }
}

#[allow(clippy::option_option)] // The outer one: the body is too short.
fn read_covariance<const N: usize>(body: &mut Reader<'_>) -> Option<Option<SMatrix<f32, N, N>>> {
    match body.u8()? {
        0 => Some(None),
        1 => {
            let mut matrix = SMatrix::<f32, N, N>::zeros();
            for x in matrix.iter_mut() {
                *x = body.f32()?;
            }
            Some(Some(matrix))
        }
        _ => None,
    }
}

/// The count, then the bits.
fn write_mask(body: &mut Body<'_>, inliers: &[bool]) {
    body.u16(inliers.len() as u16);
    for eight in inliers.chunks(8) {
        body.u8(eight.iter().rev().fold(0, |bits, &inlier| bits << 1 | u8::from(inlier)));
    }
}

/// All that is left.
fn read_mask<'a>(body: &mut Reader<'a>) -> Option<Inliers<'a>> {
    let count = usize::from(body.u16()?);
    let bytes = body.slice(count.div_ceil(8))?;
    body.0.is_empty().then_some(Inliers { bytes, count })
}
