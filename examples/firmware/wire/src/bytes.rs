//! Numbers to bytes and back: little-endian, whatever the machine.

use cobs::CobsEncoder;

/// The body of a frame that is being encoded.
pub struct Body<'a> {
    pub(crate) cobs: CobsEncoder<'a>,
    pub(crate) digest: crc::Digest<'static, u32>,
    /// The buffer was too small for what was written.
    pub(crate) full: bool,
}

impl Body<'_> {
    /// Appends bytes.
    pub fn bytes(&mut self, bytes: &[u8]) {
        self.digest.update(bytes);
        self.full |= self.cobs.push(bytes).is_err();
    }

    pub(crate) fn u8(&mut self, x: u8) {
        self.bytes(&[x]);
    }

    pub(crate) fn u16(&mut self, x: u16) {
        self.bytes(&x.to_le_bytes());
    }

    pub(crate) fn u32(&mut self, x: u32) {
        self.bytes(&x.to_le_bytes());
    }

    pub(crate) fn u64(&mut self, x: u64) {
        self.bytes(&x.to_le_bytes());
    }

    pub(crate) fn f32(&mut self, x: f32) {
        self.bytes(&x.to_le_bytes());
    }

    pub(crate) fn f32s<'x>(&mut self, numbers: impl IntoIterator<Item = &'x f32>) {
        for &x in numbers {
            self.f32(x);
        }
    }
}

/// What is left to read of a body.
pub(crate) struct Reader<'a>(pub(crate) &'a [u8]);

impl<'a> Reader<'a> {
    pub(crate) fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*head)
    }

    pub(crate) fn slice(&mut self, length: usize) -> Option<&'a [u8]> {
        let (head, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(head)
    }

    pub(crate) fn u8(&mut self) -> Option<u8> {
        self.array().map(u8::from_le_bytes)
    }

    pub(crate) fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    pub(crate) fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub(crate) fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    pub(crate) fn f32(&mut self) -> Option<f32> {
        self.array().map(f32::from_le_bytes)
    }

    pub(crate) fn f32s<const N: usize>(&mut self) -> Option<[f32; N]> {
        let mut numbers = [0.0; N];
        for x in &mut numbers {
            *x = self.f32()?;
        }
        Some(numbers)
    }
}
