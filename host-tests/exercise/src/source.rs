//! Arguments out of bytes.

use epipole::Real;
use epipole::nalgebra::{Matrix3, Quaternion, SMatrix, Translation3, UnitQuaternion, Vector2, Vector3};
use epipole::real::{is_finite, lit, sqrt};

/// Turns bytes into arguments: mostly moderate numbers, now and then any bits. When the bytes run out, a stream of
/// random ones that depends on them goes on, so that short inputs reach every call.
pub struct Source<'a> {
    bytes: &'a [u8],
    state: u64,
}

impl<'a> Source<'a> {
    /// Arguments out of these bytes.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, state: 0 }
    }

    /// Arguments out of the random stream of a seed.
    pub fn seeded(seed: u64) -> Source<'static> {
        Source { bytes: &[], state: seed }
    }

    /// The next byte.
    pub fn byte(&mut self) -> u8 {
        if let Some((&first, rest)) = self.bytes.split_first() {
            self.bytes = rest;
            self.state = (self.state ^ u64::from(first)).wrapping_mul(0x0100_0000_01B3);
            return first;
        }
        // SplitMix64.
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z >> 56) as u8
    }

    fn bits(&mut self, bytes: u32) -> u64 {
        let mut bits = 0;
        for _ in 0..bytes {
            bits = bits << 8 | u64::from(self.byte());
        }
        bits
    }

    /// A count below `n`, which is at most 256.
    pub fn below(&mut self, n: usize) -> usize {
        (usize::from(self.byte()) * n) >> 8
    }

    /// Any number: one in 64 has any bits, the others lie in [-4, 4).
    pub fn scalar<T: Real>(&mut self) -> T {
        match self.byte() {
            0 => lit(f64::from_bits(self.bits(8))),
            1 => lit(f64::from(f32::from_bits(self.bits(4) as u32))),
            2 => {
                lit([0.0, -0.0, f64::NAN, f64::INFINITY, -f64::INFINITY, 1e300, 1e-310, 1e30]
                    [self.below(8) & 7])
            }
            3 => lit([1.0, -1.0, 1e-40, 3e38, 1e-20, 1e-7, 0.5, 2.0][self.below(8) & 7]),
            _ => self.moderate(),
        }
    }

    /// A number in [-4, 4).
    pub fn moderate<T: Real>(&mut self) -> T {
        lit(f64::from(self.bits(4) as u32 as i32) / f64::from(1u32 << 29))
    }

    /// A positive number in (0, 4).
    pub fn positive<T: Real>(&mut self) -> T {
        lit((f64::from(self.bits(2) as u32) + 1.0) / f64::from(1u32 << 14))
    }

    /// An array of numbers.
    pub fn array<T: Real, const N: usize>(&mut self) -> [T; N] {
        let mut array = [T::ZERO; N];
        for x in &mut array {
            *x = self.scalar();
        }
        array
    }

    /// Rows of numbers.
    pub fn rows<T: Real, const M: usize, const N: usize>(&mut self) -> [[T; N]; M] {
        let mut rows = [[T::ZERO; N]; M];
        for x in rows.iter_mut().flatten() {
            *x = self.scalar();
        }
        rows
    }

    /// A matrix of numbers.
    pub fn matrix<T: Real, const M: usize, const N: usize>(&mut self) -> SMatrix<T, M, N> {
        let mut matrix = SMatrix::zeros();
        for x in matrix.data.0.iter_mut().flatten() {
            *x = self.scalar();
        }
        matrix
    }

    /// A vector of three numbers.
    pub fn vector3<T: Real>(&mut self) -> Vector3<T> {
        Vector3::from(self.array::<T, 3>())
    }

    /// A vector of two numbers.
    pub fn vector2<T: Real>(&mut self) -> Vector2<T> {
        Vector2::from(self.array::<T, 2>())
    }

    /// Vectors of three numbers.
    pub fn vectors<T: Real, const N: usize>(&mut self) -> [Vector3<T>; N] {
        let mut vectors = [Vector3::zeros(); N];
        for v in &mut vectors {
            *v = self.vector3();
        }
        vectors
    }

    /// A unit quaternion; the identity where the bytes give none.
    pub fn rotation<T: Real>(&mut self) -> UnitQuaternion<T> {
        let [w, x, y, z] = [self.moderate::<T>(), self.moderate(), self.moderate(), self.moderate()];
        let length = sqrt(w * w + x * x + y * y + z * z);
        let quaternion = if length > T::ZERO && is_finite(length) {
            Quaternion::new(w / length, x / length, y / length, z / length)
        } else {
            Quaternion::new(T::ONE, T::ZERO, T::ZERO, T::ZERO)
        };
        UnitQuaternion::new_unchecked(quaternion)
    }

    /// A rotation by a quarter of a radian at the most.
    pub fn small_rotation<T: Real>(&mut self) -> UnitQuaternion<T> {
        let w = Vector3::from([self.moderate::<T>(), self.moderate(), self.moderate()]);
        epipole::geometry::pose::exp(&(w * lit::<T>(0.03)))
    }

    /// A rotation as a matrix.
    pub fn rotation_matrix<T: Real>(&mut self) -> Matrix3<T> {
        self.rotation().to_rotation_matrix().into_inner()
    }

    /// A pose with any translation.
    pub fn pose<T: Real>(&mut self) -> epipole::geometry::Pose<T> {
        let rotation = self.rotation();
        epipole::geometry::Pose::from_parts(Translation3::from(self.vector3()), rotation)
    }
}
