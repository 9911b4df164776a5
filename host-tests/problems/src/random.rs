//! Random numbers, and what they are turned into.

use epipole::nalgebra::Vector3;
use epipole::real::{ln, sin_cos, sqrt};

/// SplitMix64 (G. Steele, D. Lea, C. Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014).
#[derive(Clone, Debug)]
pub struct SplitMix64(pub u64);

impl SplitMix64 {
    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// A number in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A number in [from, to).
    pub fn between(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.unit()
    }

    /// A direction.
    pub fn direction(&mut self) -> Vector3<f64> {
        loop {
            let v = Vector3::from_fn(|_, _| self.between(-1.0, 1.0));
            let square = v.norm_squared();
            if square > 0.01 && square <= 1.0 {
                return v / sqrt(square);
            }
        }
    }

    /// Two independent normal numbers (Box and Muller).
    pub fn normal_pair(&mut self) -> [f64; 2] {
        let (u1, u2) = (self.unit(), self.unit());
        let r = sqrt(-2.0 * ln(1.0 - u1));
        let (sin, cos) = sin_cos(core::f64::consts::TAU * u2);
        [r * cos, r * sin]
    }
}
