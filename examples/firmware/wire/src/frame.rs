//! Frames: where one begins and ends, whether it is whole, and whose version it speaks.

use cobs::{CobsEncoder, DecodeResult, DecoderState};
use crc::{CRC_32_ISCSI, Crc};

use crate::bytes::Body;
use crate::{Reason, Refusal, VERSION};

/// Castagnoli's polynomial: Hamming distance 6 up to 655 bytes, 4 beyond (P. Koopman, "32-bit cyclic redundancy codes for
/// internet applications", DSN 2002).
static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);

/// Bytes of a frame beside its body, before the stuffing: version, kind, sequence number, checksum.
pub const OVERHEAD: usize = 8;

/// The most bytes that a frame with a body of so many takes on the line, both delimiters included.
#[must_use]
pub const fn encoded_len(body: usize) -> usize {
    let content = body + OVERHEAD;
    content + content / 254 + 1 + 2
}

/// The buffer is too small for the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Full;

/// Writes a frame, delimiters included, and returns its length.
///
/// # Errors
/// [`Full`]; the buffer then holds nothing of use.
pub fn encode(
    out: &mut [u8],
    kind: u8,
    sequence: u16,
    body: impl FnOnce(&mut Body<'_>),
) -> Result<usize, Full> {
    let (first, rest) = out.split_first_mut().ok_or(Full)?;
    *first = 0;
    let mut frame = Body { cobs: CobsEncoder::new(rest), digest: CRC.digest(), full: false };
    frame.bytes(&[VERSION, kind]);
    frame.u16(sequence);
    body(&mut frame);
    let Body { mut cobs, digest, full } = frame;
    if full || cobs.push(&digest.finalize().to_le_bytes()).is_err() {
        return Err(Full);
    }
    let length = cobs.finalize();
    *rest.get_mut(length).ok_or(Full)? = 0;
    Ok(length + 2)
}

/// A frame that arrived whole, of this version.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// One of [`kind`](crate::kind), or one that this version does not know.
    pub kind: u8,
    /// Its number.
    pub sequence: u16,
    /// What it says.
    pub body: &'a [u8],
}

/// Finds frames in a stream of bytes, one byte at a time, in memory that its owner lends.
#[derive(Debug)]
pub struct Decoder<'a> {
    buffer: &'a mut [u8],
    length: usize,
    state: DecoderState,
    /// The frame is longer than the buffer: its rest is dropped.
    too_long: bool,
    /// What comes before the next delimiter belongs to a frame that was given up.
    skipping: bool,
}

impl<'a> Decoder<'a> {
    /// A decoder for frames of at most so many bytes before the stuffing: [`OVERHEAD`] and the body.
    pub fn new(buffer: &'a mut [u8]) -> Self {
        Self { buffer, length: 0, state: DecoderState::Idle, too_long: false, skipping: false }
    }

    /// Takes the next byte. At the delimiter that ends a frame: the frame, or what is wrong with it. Two delimiters in
    /// succession have no frame between them.
    pub fn feed(&mut self, byte: u8) -> Option<Result<Frame<'_>, Refusal>> {
        if self.skipping {
            self.skipping = byte != 0;
            return None;
        }
        match self.state.feed(byte) {
            Ok(DecodeResult::NoData) => None,
            Ok(DecodeResult::DataStart) => {
                (self.length, self.too_long) = (0, false);
                None
            }
            Ok(DecodeResult::DataContinue(byte)) => {
                match self.buffer.get_mut(self.length) {
                    Some(slot) => {
                        *slot = byte;
                        self.length += 1;
                    }
                    None => self.too_long = true,
                }
                None
            }
            Ok(DecodeResult::DataComplete) if !self.too_long => {
                Some(check(self.buffer.get(..self.length).unwrap_or_default()))
            }
            Ok(DecodeResult::DataComplete) | Err(_) => Some(Err(Refusal {
                sequence: None,
                reason: match self.too_long {
                    true => Reason::TooLong { capacity: self.buffer.len() as u32 },
                    false => Reason::Malformed,
                },
            })),
        }
    }

    /// Whether a frame has begun and not ended.
    #[must_use]
    pub fn pending(&self) -> bool {
        !matches!(self.state, DecoderState::Idle)
    }

    /// Gives up the frame that has begun; bytes up to the next delimiter are dropped as part of it.
    pub fn give_up(&mut self) {
        self.skipping |= self.pending();
        self.state = DecoderState::Idle;
    }

    /// The memory, while no frame is pending: a frame that was returned is lost when it is written to.
    pub fn buffer(&mut self) -> &mut [u8] {
        self.buffer
    }
}

/// Length, checksum, version, in this order: the first four bytes and the checksum stand where they stand in every
/// version.
fn check(bytes: &[u8]) -> Result<Frame<'_>, Refusal> {
    let refused = |sequence, reason| Err(Refusal { sequence, reason });
    let Some((content, crc)) = bytes.split_last_chunk::<4>() else {
        return refused(None, Reason::Malformed);
    };
    let Some(([version, kind, low, high], body)) = content.split_first_chunk::<4>() else {
        return refused(None, Reason::Malformed);
    };
    if CRC.checksum(content) != u32::from_le_bytes(*crc) {
        return refused(None, Reason::Checksum);
    }
    let sequence = u16::from_le_bytes([*low, *high]);
    if *version != VERSION {
        return refused(Some(sequence), Reason::Version { supported: VERSION });
    }
    Ok(Frame { kind: *kind, sequence, body })
}
