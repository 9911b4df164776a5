//! SplitMix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014): a seed is a problem.

use epipole::Real;
use epipole::nalgebra::{Unit, UnitQuaternion, Vector3};
use epipole::real::{lit, ln, sin_cos};

/// A seeded stream of random numbers.
#[derive(Clone, Debug)]
pub struct Rng(u64);

impl Rng {
    /// The stream of `seed`.
    pub fn new(seed: u64) -> Self {
        // Neighbouring seeds must not give overlapping streams: the seed is mixed once before it becomes the state.
        let mut rng = Self(seed);
        Self(rng.next_u64())
    }

    /// 64 random bits.
    pub fn next_u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in [low, high).
    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform in 0..n.
    pub fn index(&mut self, n: usize) -> usize {
        ((u128::from(self.next_u64()) * n as u128) >> 64) as usize
    }

    /// Standard normal (Box and Muller 1958). By the kernel's functions: the platform's differ in the last bit, and a
    /// seed is the same problem on every host.
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * ln(1.0 - self.unit())).sqrt();
        radius * sin_cos(std::f64::consts::TAU * self.unit()).1
    }

    /// Three independent standard normals.
    pub fn normal3(&mut self) -> Vector3<f64> {
        Vector3::new(self.normal(), self.normal(), self.normal())
    }

    /// A direction, uniform on the sphere.
    pub fn direction(&mut self) -> Vector3<f64> {
        self.normal3().normalize()
    }

    /// A rotation about a random axis by an angle uniform in [0, max_rad).
    pub fn rotation(&mut self, max_rad: f64) -> UnitQuaternion<f64> {
        let axis = Unit::new_unchecked(self.direction());
        UnitQuaternion::from_axis_angle(&axis, self.range(0.0, max_rad))
    }

    /// A random order of 0..n (Fisher and Yates).
    pub fn permutation(&mut self, n: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..n).collect();
        for k in (1..n).rev() {
            order.swap(k, self.index(k + 1));
        }
        order
    }

    /// Any number that the scalar holds: raw bits, moderate magnitudes, zeros, subnormals, the largest, infinities, NaN.
    pub fn any_bits<T: Real>(&mut self) -> T {
        let special = [0.0, -0.0, 1.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
        match self.index(10) {
            0..4 if size_of::<T>() == 4 => lit(f64::from(f32::from_bits(self.next_u64() as u32))),
            0..4 => lit(f64::from_bits(self.next_u64())),
            4..6 => lit(self.normal() * 2f64.powi(self.index(81) as i32 - 40)),
            6..8 => lit(self.normal()),
            8 => [T::MAX, -T::MAX, T::MIN_POSITIVE, T::MIN_POSITIVE * T::HALF, T::EPSILON][self.index(5)],
            _ => lit(special[self.index(special.len())]),
        }
    }

    /// Three of [`any_bits`](Self::any_bits).
    pub fn any_vector<T: Real>(&mut self) -> Vector3<T> {
        Vector3::new(self.any_bits(), self.any_bits(), self.any_bits())
    }
}
