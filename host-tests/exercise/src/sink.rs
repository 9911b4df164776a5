//! What came out of the calls.

use epipole::Real;
use epipole::geometry::Pose;
use epipole::real::is_finite;

/// Hashes every result, bit by bit, and remembers whether a promise was broken.
#[derive(Clone, Debug)]
pub struct Sink {
    hash: u64,
    promises_kept: bool,
}

impl Default for Sink {
    fn default() -> Self {
        Self { hash: 0xCBF2_9CE4_8422_2325, promises_kept: true }
    }
}

impl Sink {
    /// FNV-1a over all results so far. All NaN are one: their payload is not part of a result.
    pub fn hash(&self) -> u64 {
        self.hash
    }

    /// False once something that is promised finite was not.
    pub fn promises_kept(&self) -> bool {
        self.promises_kept
    }

    fn word(&mut self, word: u64) {
        for byte in word.to_le_bytes() {
            self.hash = (self.hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3);
        }
    }

    /// A count, an index, a flag.
    pub fn count(&mut self, n: usize) {
        self.word(n as u64);
    }

    /// Whether there was an answer.
    pub fn flag(&mut self, flag: bool) {
        self.word(u64::from(flag));
    }

    /// A number that may be anything.
    pub fn number<T: Real>(&mut self, x: T) {
        let x = x.to_f64();
        self.word(if x.is_nan() { 0x7FF8_0000_0000_0000 } else { x.to_bits() });
    }

    /// Numbers that may be anything.
    pub fn numbers<'a, T: Real>(&mut self, numbers: impl IntoIterator<Item = &'a T>) {
        for &x in numbers {
            self.number(x);
        }
    }

    /// Numbers that are finite whatever the input.
    pub fn finite<'a, T: Real>(&mut self, numbers: impl IntoIterator<Item = &'a T>) {
        for &x in numbers {
            self.promises_kept &= is_finite(x);
            self.number(x);
        }
    }

    /// A pose that is finite whatever the input.
    pub fn finite_pose<T: Real>(&mut self, pose: &Pose<T>) {
        self.finite(&pose.rotation.coords);
        self.finite(&pose.translation.vector);
    }
}
