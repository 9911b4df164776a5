//! Frames, what can happen to them on a line, and the format read slowly and plainly.

use epipole_problems::random::SplitMix64;
use epipole_wire::{Reason, VERSION, encode};

/// What happened to a frame on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Damage {
    /// Nothing.
    None,
    /// Bits were turned over.
    Bits,
    /// Its end is missing.
    Cut,
    /// Its beginning is missing.
    Headless,
    /// A delimiter stands in it.
    Torn,
    /// Random bytes were put in.
    Noise,
    /// It is longer than the receiver's buffer.
    TooLong,
    /// It speaks another version.
    Version,
}

impl Damage {
    /// One frame in three is whole.
    pub fn any(random: &mut SplitMix64) -> Self {
        match below(random, 12) {
            0 | 1 => Self::Bits,
            2 => Self::Cut,
            3 => Self::Headless,
            4 => Self::Torn,
            5 => Self::Noise,
            6 => Self::TooLong,
            7 => Self::Version,
            _ => Self::None,
        }
    }
}

/// A frame and what became of it.
#[derive(Clone, Debug)]
pub struct Sent {
    /// Its number.
    pub sequence: u16,
    /// What it said.
    pub body: Vec<u8>,
    /// What happened to it.
    pub damage: Damage,
    /// What is on the line.
    pub bytes: Vec<u8>,
}

/// A number below `n`.
pub fn below(random: &mut SplitMix64, n: usize) -> usize {
    (random.bits() % n as u64) as usize
}

/// Stuffing (S. Cheshire, M. Baker, "Consistent overhead byte stuffing", SIGCOMM 1997): a code tells how far the next
/// zero is.
fn stuffed(content: &[u8]) -> Vec<u8> {
    let mut out = vec![0];
    let mut runs = content.split(|&b| b == 0).peekable();
    while let Some(mut run) = runs.next() {
        while run.len() >= 254 {
            out.push(255);
            out.extend(&run[..254]);
            run = &run[254..];
            if run.is_empty() && runs.peek().is_none() {
                out.push(0);
                return out;
            }
        }
        out.push(run.len() as u8 + 1);
        out.extend(run);
    }
    out.push(0);
    out
}

/// CRC-32C, bit by bit.
fn crc(bytes: &[u8]) -> u32 {
    let mut crc = !0u32;
    for &byte in bytes {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0x82F6_3B78 } else { crc >> 1 };
        }
    }
    !crc
}

/// A frame of any version, by hand.
pub fn by_hand(version: u8, kind: u8, sequence: u16, body: &[u8]) -> Vec<u8> {
    let mut content = vec![version, kind];
    content.extend(sequence.to_le_bytes());
    content.extend(body);
    content.extend(crc(&content).to_le_bytes());
    stuffed(&content)
}

/// A frame's kind, number and body, or what is wrong with it.
pub type Outcome = Result<(u8, u16, Vec<u8>), (Option<u16>, Reason)>;

/// What a receiver with so much room makes of the bytes between two delimiters.
pub fn reference(chunk: &[u8], capacity: usize) -> Outcome {
    let mut content = Vec::new();
    let (mut at, mut whole) = (0, true);
    while at < chunk.len() {
        let code = usize::from(chunk[at]);
        let end = at + code;
        whole = end <= chunk.len();
        content.extend(&chunk[at + 1..end.min(chunk.len())]);
        if code < 255 && end < chunk.len() {
            content.push(0);
        }
        at = end;
    }
    if content.len() > capacity {
        return Err((None, Reason::TooLong { capacity: capacity as u32 }));
    }
    if !whole || content.len() < 8 {
        return Err((None, Reason::Malformed));
    }
    let (content, sum) = content.split_at(content.len() - 4);
    if crc(content).to_le_bytes() != sum {
        return Err((None, Reason::Checksum));
    }
    let sequence = u16::from_le_bytes([content[2], content[3]]);
    if content[0] != VERSION {
        return Err((Some(sequence), Reason::Version { supported: VERSION }));
    }
    Ok((content[1], sequence, content[4..].to_vec()))
}

/// A frame, damaged or not, for a receiver with so much room.
pub fn send(
    random: &mut SplitMix64,
    damage: Damage,
    kind: u8,
    sequence: u16,
    body: Vec<u8>,
    capacity: usize,
) -> Sent {
    let mut bytes = vec![0; epipole_wire::encoded_len(body.len())];
    let length = encode(&mut bytes, kind, sequence, |out| out.bytes(&body)).expect("it fits");
    bytes.truncate(length);
    match damage {
        Damage::None => assert_eq!(bytes, by_hand(VERSION, kind, sequence, &body)),
        Damage::Bits => {
            for _ in 0..=below(random, 4) {
                let at = below(random, bytes.len());
                bytes[at] ^= 1 << below(random, 8);
            }
        }
        Damage::Cut => bytes.truncate(below(random, bytes.len())),
        Damage::Headless => drop(bytes.drain(..1 + below(random, bytes.len() - 1))),
        Damage::Torn => {
            let at = below(random, bytes.len());
            bytes.insert(at, 0);
        }
        Damage::Noise => {
            let at = below(random, bytes.len());
            let noise: Vec<u8> = (0..1 + below(random, 40)).map(|_| random.bits() as u8).collect();
            bytes.splice(at..at, noise);
        }
        Damage::TooLong => {
            let length = capacity + below(random, capacity);
            let body: Vec<u8> = (0..length).map(|_| random.bits() as u8).collect();
            bytes = by_hand(VERSION, kind, sequence, &body);
        }
        Damage::Version => {
            let version = [0, 2, 3, 255][below(random, 4)];
            bytes = by_hand(version, kind, sequence, &body);
        }
    }
    Sent { sequence, body, damage, bytes }
}
