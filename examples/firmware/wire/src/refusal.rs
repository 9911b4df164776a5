//! Why a frame was not answered.

use core::fmt;

use epipole::InputError;
use epipole::robust::OptionsError;

use crate::bytes::Reader;
use crate::frame::{Frame, Full, encode};
use crate::kind;

/// A frame that was not answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// Its sequence number, where it can be trusted.
    pub sequence: Option<u16>,
    /// What is wrong with it.
    pub reason: Reason,
}

/// What is wrong with a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Reason {
    /// It is cut short, or was stuffed wrongly.
    Malformed,
    /// Its checksum is wrong.
    Checksum,
    /// It is longer than the receiver's buffer.
    TooLong {
        /// Bytes before the stuffing that fit.
        capacity: u32,
    },
    /// It speaks another version.
    Version {
        /// The receiver's.
        supported: u8,
    },
    /// Its kind is not known.
    Kind {
        /// The kind.
        kind: u8,
    },
    /// Its body is longer or shorter than its own fields say, or a field is out of range.
    Length {
        /// Bytes of the body.
        given: u32,
    },
    /// Its bytes stopped coming.
    Timeout,
    /// A camera's parameters make no camera.
    Camera {
        /// 0 or 1.
        which: u8,
    },
    /// The estimator's: the correspondences cannot be used.
    Input(InputError),
    /// The estimator's: an option is out of range.
    Options(OptionsError),
    /// The estimator's: the prior cannot be used.
    Prior,
    /// One that a later version knows.
    Other {
        /// Its code.
        code: u8,
    },
}

impl Reason {
    /// The code and its two details.
    fn numbers(&self) -> (u8, u32, u32) {
        match *self {
            Self::Malformed => (1, 0, 0),
            Self::Checksum => (2, 0, 0),
            Self::TooLong { capacity } => (3, capacity, 0),
            Self::Version { supported } => (4, u32::from(supported), 0),
            Self::Kind { kind } => (5, u32::from(kind), 0),
            Self::Length { given } => (6, given, 0),
            Self::Timeout => (7, 0, 0),
            Self::Camera { which } => (8, u32::from(which), 0),
            Self::Input(InputError::LengthMismatch { first, second }) => (9, first as u32, second as u32),
            Self::Input(InputError::TooFew { given, needed }) => (10, given as u32, needed as u32),
            Self::Input(InputError::TooMany { given, capacity }) => (11, given as u32, capacity as u32),
            Self::Input(InputError::NotFinite { array, index }) => (12, array as u32, index as u32),
            Self::Options(OptionsError::MaxError) => (13, 0, 0),
            Self::Options(OptionsError::Sigma) => (14, 0, 0),
            Self::Options(OptionsError::Confidence) => (15, 0, 0),
            Self::Options(OptionsError::NoIterations) => (16, 0, 0),
            Self::Prior => (17, 0, 0),
            Self::Other { code } => (code, 0, 0),
            Self::Input(_) | Self::Options(_) => (254, 0, 0),
        }
    }

    fn from_numbers(code: u8, a: u32, b: u32) -> Self {
        let (x, y) = (a as usize, b as usize);
        match code {
            1 => Self::Malformed,
            2 => Self::Checksum,
            3 => Self::TooLong { capacity: a },
            4 => Self::Version { supported: a as u8 },
            5 => Self::Kind { kind: a as u8 },
            6 => Self::Length { given: a },
            7 => Self::Timeout,
            8 => Self::Camera { which: a as u8 },
            9 => Self::Input(InputError::LengthMismatch { first: x, second: y }),
            10 => Self::Input(InputError::TooFew { given: x, needed: y }),
            11 => Self::Input(InputError::TooMany { given: x, capacity: y }),
            12 => Self::Input(InputError::NotFinite { array: x, index: y }),
            13 => Self::Options(OptionsError::MaxError),
            14 => Self::Options(OptionsError::Sigma),
            15 => Self::Options(OptionsError::Confidence),
            16 => Self::Options(OptionsError::NoIterations),
            17 => Self::Prior,
            code => Self::Other { code },
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Malformed => f.write_str("cut short or stuffed wrongly"),
            Self::Checksum => f.write_str("wrong checksum"),
            Self::TooLong { capacity } => write!(f, "longer than {capacity} bytes"),
            Self::Version { supported } => write!(f, "not version {supported}"),
            Self::Kind { kind } => write!(f, "unknown kind {kind}"),
            Self::Length { given } => write!(f, "a body of {given} bytes contradicts itself"),
            Self::Timeout => f.write_str("stopped before its end"),
            Self::Camera { which } => write!(f, "camera {which} is none"),
            Self::Input(error) => error.fmt(f),
            Self::Options(error) => error.fmt(f),
            Self::Prior => f.write_str("the prior cannot be used"),
            Self::Other { code } => write!(f, "reason {code}"),
        }
    }
}

impl Refusal {
    /// The frame that tells the sender. `refused` is the number of frames refused so far, so that a lost refusal shows.
    ///
    /// # Errors
    /// [`Full`].
    pub fn encode(&self, out: &mut [u8], refused: u32) -> Result<usize, Full> {
        let (code, a, b) = self.reason.numbers();
        encode(out, kind::REFUSED, self.sequence.unwrap_or(0), |body| {
            body.bytes(&[u8::from(self.sequence.is_some()), code]);
            body.u32(a);
            body.u32(b);
            body.u32(refused);
        })
    }

    /// The refusal that a frame of kind [`REFUSED`](kind::REFUSED) tells, and how many there were so far.
    pub(crate) fn parse(frame: &Frame<'_>) -> Option<(Self, u32)> {
        let mut body = Reader(frame.body);
        let [known, code] = body.array()?;
        let (a, b, refused) = (body.u32()?, body.u32()?, body.u32()?);
        if !body.0.is_empty() || known > 1 {
            return None;
        }
        let sequence = (known == 1).then_some(frame.sequence);
        Some((Self { sequence, reason: Reason::from_numbers(code, a, b) }, refused))
    }
}
