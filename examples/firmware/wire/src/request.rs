//! What a server is asked.

use epipole::estimate::{AbsolutePoseOptions, GravityPrior, RelativePoseOptions, RelativePosePrior};
use epipole::geometry::{BrownConrady, Camera, CameraError, KannalaBrandt, Pinhole};
use epipole::nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector2, Vector3};
use epipole::robust::RansacOptions;

use crate::bytes::{Body, Reader};
use crate::frame::{Frame, Full, OVERHEAD, encode};
use crate::{Reason, kind};

/// A request, read out of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Request<'a> {
    /// Kind 1.
    RelativePose(RelativePoseRequest<'a>),
    /// Kind 2.
    AbsolutePose(AbsolutePoseRequest<'a>),
    /// Kind 3.
    Statistics,
    /// Kind 4.
    Restart,
}

/// Arguments of [`relative_pose`](epipole::estimate::relative_pose).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativePoseRequest<'a> {
    /// Of view 1 and of view 2.
    pub cameras: [Camera<f32>; 2],
    /// As the estimator takes them.
    pub options: RelativePoseOptions<f32>,
    /// Microseconds after which the search ends with what it has; 0: the server's own limit.
    pub deadline_us: u32,
    /// `u1 v1 u2 v2`.
    pub correspondences: Records<'a, 4>,
}

/// Arguments of [`absolute_pose`](epipole::estimate::absolute_pose).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AbsolutePoseRequest<'a> {
    /// The camera.
    pub camera: Camera<f32>,
    /// As the estimator takes them.
    pub options: AbsolutePoseOptions<f32>,
    /// Microseconds after which the search ends with what it has; 0: the server's own limit.
    pub deadline_us: u32,
    /// `u v X Y Z`.
    pub correspondences: Records<'a, 5>,
}

/// Records of `W` numbers, each followed by its score where there are scores.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Records<'a, const W: usize> {
    bytes: &'a [u8],
    scored: bool,
}

impl<'a, const W: usize> Records<'a, W> {
    /// How many.
    #[must_use]
    pub fn len(&self) -> usize {
        self.bytes.len() / (4 * (W + usize::from(self.scored)))
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// Whether each has a score.
    #[must_use]
    pub fn scored(&self) -> bool {
        self.scored
    }

    /// The numbers of each, and its score.
    pub fn iter(&self) -> impl Iterator<Item = ([f32; W], f32)> + use<'a, W> {
        let (mut rest, scored) = (Reader(self.bytes), self.scored);
        core::iter::from_fn(move || Some((rest.f32s()?, if scored { rest.f32()? } else { 0.0 })))
    }

    /// A count and as many records, which must be all that is left.
    fn parse(body: &mut Reader<'a>, scored: bool) -> Option<Self> {
        let count = usize::from(body.u16()?);
        let bytes = body.slice(count * 4 * (W + usize::from(scored)))?;
        body.0.is_empty().then_some(Self { bytes, scored })
    }
}

/// A bit of the flags: a score follows each record.
const SCORED: u8 = 1;
/// A bit of the flags: a gravity prior follows the options.
const GRAVITY: u8 = 2;
/// A bit of the flags: a prior of the rotation follows the options.
const ROTATION: u8 = 4;

/// The most bytes before the stuffing that a request of so many correspondences takes.
#[must_use]
pub const fn request_bytes(correspondences: usize) -> usize {
    const CAMERA: usize = 1 + 9 * 4;
    const OPTIONS: usize = 1 + 2 * 4 + 32 + 4;
    const PRIOR: usize = (4 + 9) * 4;
    OVERHEAD + 2 * CAMERA + OPTIONS + PRIOR + 2 + correspondences * 24
}

impl<'a> Request<'a> {
    /// What a frame asks.
    ///
    /// # Errors
    /// [`Reason::Kind`], [`Reason::Length`], [`Reason::Camera`]. What the estimators themselves refuse is left to them.
    pub fn parse(frame: &Frame<'a>) -> Result<Self, Reason> {
        let wrong = Reason::Length { given: frame.body.len() as u32 };
        let mut body = Reader(frame.body);
        match frame.kind {
            kind::RELATIVE_POSE => relative(&mut body).ok_or(wrong)?.map(Self::RelativePose),
            kind::ABSOLUTE_POSE => absolute(&mut body).ok_or(wrong)?.map(Self::AbsolutePose),
            kind::STATISTICS | kind::RESTART if !frame.body.is_empty() => Err(wrong),
            kind::STATISTICS => Ok(Self::Statistics),
            kind::RESTART => Ok(Self::Restart),
            kind => Err(Reason::Kind { kind }),
        }
    }
}

/// None where the lengths are wrong; an error where a camera is.
fn relative<'a>(body: &mut Reader<'a>) -> Option<Result<RelativePoseRequest<'a>, Reason>> {
    let cameras = [read_camera(body)?, read_camera(body)?];
    let flags = body.u8().filter(|flags| flags & !(SCORED | GRAVITY | ROTATION) == 0)?;
    let mut options = RelativePoseOptions::default();
    (options.max_error_px, options.sigma_px) = read_noise(body)?;
    options.ransac = read_ransac(body)?;
    let deadline_us = body.u32()?;
    options.prior = match flags & (GRAVITY | ROTATION) {
        0 => None,
        GRAVITY => {
            let (view1, view2) = (Vector3::from(body.f32s::<3>()?), Vector3::from(body.f32s::<3>()?));
            Some(RelativePosePrior::Gravity { view1, view2, sigma_rad: body.f32()? })
        }
        ROTATION => {
            let [i, j, k, w] = body.f32s()?;
            let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k));
            let covariance = Matrix3::from_column_slice(&body.f32s::<9>()?);
            Some(RelativePosePrior::Rotation { rotation, covariance })
        }
        _ => return None,
    };
    let correspondences = Records::parse(body, flags & SCORED != 0)?;
    Some(match cameras {
        [Ok(a), Ok(b)] => Ok(RelativePoseRequest { cameras: [a, b], options, deadline_us, correspondences }),
        [a, _] => Err(Reason::Camera { which: u8::from(a.is_ok()) }),
    })
}

fn absolute<'a>(body: &mut Reader<'a>) -> Option<Result<AbsolutePoseRequest<'a>, Reason>> {
    let camera = read_camera(body)?;
    let flags = body.u8().filter(|flags| flags & !(SCORED | GRAVITY) == 0)?;
    let mut options = AbsolutePoseOptions::default();
    (options.max_error_px, options.sigma_px) = read_noise(body)?;
    options.ransac = read_ransac(body)?;
    let deadline_us = body.u32()?;
    if flags & GRAVITY != 0 {
        let (world, camera) = (Vector3::from(body.f32s::<3>()?), Vector3::from(body.f32s::<3>()?));
        options.gravity = Some(GravityPrior { world, camera, sigma_rad: body.f32()? });
    }
    let correspondences = Records::parse(body, flags & SCORED != 0)?;
    Some(match camera {
        Ok(camera) => Ok(AbsolutePoseRequest { camera, options, deadline_us, correspondences }),
        Err(_) => Err(Reason::Camera { which: 0 }),
    })
}

/// None for an unknown model, as the length that follows is unknown too.
fn read_camera(body: &mut Reader<'_>) -> Option<Result<Camera<f32>, CameraError>> {
    let model = body.u8()?;
    let [fx, fy, cx, cy] = body.f32s()?;
    let pinhole = Pinhole::new(fx, fy, cx, cy);
    Some(match model {
        0 => pinhole.map(Camera::from),
        1 => {
            let distortion = body.f32s()?;
            pinhole.and_then(|pinhole| BrownConrady::new(pinhole, distortion)).map(Camera::from)
        }
        2 => {
            let k = body.f32s()?;
            pinhole.and_then(|pinhole| KannalaBrandt::new(pinhole, k)).map(Camera::from)
        }
        _ => return None,
    })
}

/// The threshold, and sigma where it is not zero.
fn read_noise(body: &mut Reader<'_>) -> Option<(f32, Option<f32>)> {
    let [max_error_px, sigma_px] = body.f32s()?;
    Some((max_error_px, (sigma_px != 0.0).then_some(sigma_px)))
}

fn read_ransac(body: &mut Reader<'_>) -> Option<RansacOptions<f32>> {
    let mut options = RansacOptions::default();
    options.confidence = body.f32()?;
    options.min_iterations = body.u32()?;
    options.budget.max_iterations = body.u32()?;
    options.budget.max_solver_calls = body.u32()?;
    options.budget.max_residuals = u32::try_from(body.u64()?).unwrap_or(u32::MAX);
    options.seed = body.u64()?;
    Some(options)
}

/// Writes a request for a relative pose; returns its length on the line. Correspondences beyond the shorter list, and a
/// score that is missing, are left out or zero; more than 65,535 do not fit.
///
/// # Errors
/// [`Full`].
pub fn relative_pose_request(
    out: &mut [u8],
    sequence: u16,
    cameras: [&Camera<f32>; 2],
    [x1, x2]: [&[Vector2<f32>]; 2],
    scores: Option<&[f32]>,
    options: &RelativePoseOptions<f32>,
    deadline_us: u32,
) -> Result<usize, Full> {
    let count = u16::try_from(core::cmp::min(x1.len(), x2.len())).map_err(|_| Full)?;
    encode(out, kind::RELATIVE_POSE, sequence, |body| {
        for camera in cameras {
            write_camera(body, camera);
        }
        let prior = match &options.prior {
            Some(RelativePosePrior::Gravity { .. }) => GRAVITY,
            Some(RelativePosePrior::Rotation { .. }) => ROTATION,
            _ => 0,
        };
        body.u8(prior | if scores.is_some() { SCORED } else { 0 });
        write_options(body, options.max_error_px, options.sigma_px, &options.ransac, deadline_us);
        match &options.prior {
            Some(RelativePosePrior::Gravity { view1, view2, sigma_rad }) => {
                body.f32s(view1.iter().chain(view2.iter()));
                body.f32(*sigma_rad);
            }
            Some(RelativePosePrior::Rotation { rotation, covariance }) => {
                body.f32s(rotation.coords.iter().chain(covariance.iter()));
            }
            _ => (),
        }
        body.u16(count);
        for (k, (a, b)) in x1.iter().zip(x2).enumerate() {
            body.f32s(a.iter().chain(b.iter()));
            write_score(body, scores, k);
        }
    })
}

/// Writes a request for an absolute pose; otherwise as [`relative_pose_request`].
///
/// # Errors
/// [`Full`].
pub fn absolute_pose_request(
    out: &mut [u8],
    sequence: u16,
    camera: &Camera<f32>,
    pixels: &[Vector2<f32>],
    points: &[Vector3<f32>],
    scores: Option<&[f32]>,
    options: &AbsolutePoseOptions<f32>,
    deadline_us: u32,
) -> Result<usize, Full> {
    let count = u16::try_from(core::cmp::min(pixels.len(), points.len())).map_err(|_| Full)?;
    encode(out, kind::ABSOLUTE_POSE, sequence, |body| {
        write_camera(body, camera);
        let gravity = if options.gravity.is_some() { GRAVITY } else { 0 };
        body.u8(gravity | if scores.is_some() { SCORED } else { 0 });
        write_options(body, options.max_error_px, options.sigma_px, &options.ransac, deadline_us);
        if let Some(prior) = &options.gravity {
            body.f32s(prior.world.iter().chain(prior.camera.iter()));
            body.f32(prior.sigma_rad);
        }
        body.u16(count);
        for (k, (pixel, point)) in pixels.iter().zip(points).enumerate() {
            body.f32s(pixel.iter().chain(point.iter()));
            write_score(body, scores, k);
        }
    })
}

fn write_score(body: &mut Body<'_>, scores: Option<&[f32]>, k: usize) {
    if let Some(scores) = scores {
        body.f32(scores.get(k).copied().unwrap_or(0.0));
    }
}

fn write_camera(body: &mut Body<'_>, camera: &Camera<f32>) {
    let pinhole = camera.pinhole();
    let (model, brown_conrady, kannala_brandt) = match camera {
        Camera::BrownConrady(camera) => (1, Some(camera.distortion()), None),
        Camera::KannalaBrandt(camera) => (2, None, Some(camera.coefficients())),
        _ => (0, None, None),
    };
    body.u8(model);
    body.f32s(&[pinhole.fx(), pinhole.fy(), pinhole.cx(), pinhole.cy()]);
    body.f32s(brown_conrady.iter().flatten().chain(kannala_brandt.iter().flatten()));
}

fn write_options(
    body: &mut Body<'_>,
    max_error_px: f32,
    sigma_px: Option<f32>,
    ransac: &RansacOptions<f32>,
    deadline_us: u32,
) {
    body.f32s(&[max_error_px, sigma_px.unwrap_or(0.0), ransac.confidence]);
    body.u32(ransac.min_iterations);
    body.u32(ransac.budget.max_iterations);
    body.u32(ransac.budget.max_solver_calls);
    body.u64(ransac.budget.max_residuals.into());
    body.u64(ransac.seed);
    body.u32(deadline_us);
}
