//! Where a frame is: rotation and camera centre, and the chart in which small motions of it are written.
//!
//! A frame moves by `(w, v)`: `R <- C(w) R`, `centre <- centre - R' v` with the old `R`, so that a point of the camera
//! frame moves by `w x y + v`: rotation about the camera's own centre, wherever the world's origin lies. `C` is the
//! Cayley map, the unit quaternion along `(1, w / 2)`: it agrees with the exponential to second order, its inverse and
//! Jacobian are rational, and no transcendental function is called.

use nalgebra::{Quaternion, Translation3, UnitQuaternion, Vector3};

use super::small::{M3, V3, mul, mul_transposed, sub};
use crate::Real;
use crate::geometry::Pose;
use crate::real::{is_finite, sqrt};

/// Rotation (as unit quaternion `w x y z` and as matrix) and camera centre.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placement<T> {
    quaternion: [T; 4],
    pub(super) centre: V3<T>,
    pub(super) rotation: M3<T>,
}

impl<T: Real> Placement<T> {
    pub(super) const IDENTITY: Self = Self {
        quaternion: [T::ONE, T::ZERO, T::ZERO, T::ZERO],
        centre: [T::ZERO; 3],
        rotation: [[T::ONE, T::ZERO, T::ZERO], [T::ZERO, T::ONE, T::ZERO], [T::ZERO, T::ZERO, T::ONE]],
    };

    fn new(q: [T; 4], centre: V3<T>) -> Self {
        let scale = T::ONE / sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        let [w, x, y, z] = [q[0] * scale, q[1] * scale, q[2] * scale, q[3] * scale];
        let two = T::TWO;
        let rotation = [
            [T::ONE - two * (y * y + z * z), two * (x * y - w * z), two * (x * z + w * y)],
            [two * (x * y + w * z), T::ONE - two * (x * x + z * z), two * (y * z - w * x)],
            [two * (x * z - w * y), two * (y * z + w * x), T::ONE - two * (x * x + y * y)],
        ];
        Self { quaternion: [w, x, y, z], centre, rotation }
    }

    /// None where a number is not finite.
    pub(super) fn from_pose(pose: &Pose<T>) -> Option<Self> {
        let c = &pose.rotation.coords;
        let t = [pose.translation.x, pose.translation.y, pose.translation.z];
        let q = [c[3], c[0], c[1], c[2]];
        let turned = Self::new(q, [T::ZERO; 3]);
        let minus = mul_transposed(&turned.rotation, &t);
        let centre = [-minus[0], -minus[1], -minus[2]];
        let finite = turned.quaternion.iter().chain(&centre).all(|&x| is_finite(x));
        finite.then_some(Self { centre, ..turned })
    }

    pub(super) fn pose(&self) -> Pose<T> {
        let [w, x, y, z] = self.quaternion;
        let t = mul(&self.rotation, &self.centre);
        Pose::from_parts(
            Translation3::from(-Vector3::from(t)),
            UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z)),
        )
    }

    /// The point of the world in the camera frame.
    #[inline(always)]
    pub(super) fn in_camera(&self, x: &V3<T>) -> V3<T> {
        mul(&self.rotation, &sub(x, &self.centre))
    }

    /// Moved by `(w, v)`.
    pub(super) fn moved(&self, d: &[T; 6]) -> Self {
        let [w, x, y, z] = self.quaternion;
        let (a, b, c) = (d[0] * T::HALF, d[1] * T::HALF, d[2] * T::HALF);
        let q = [
            w - a * x - b * y - c * z,
            x + a * w + b * z - c * y,
            y + b * w + c * x - a * z,
            z + c * w + a * y - b * x,
        ];
        let centre = sub(&self.centre, &mul_transposed(&self.rotation, &[d[3], d[4], d[5]]));
        Self::new(q, centre)
    }

    /// The motion `(w, v)` that leads from `base` to here. Finite unless the two are half a turn apart.
    pub(super) fn motion_from(&self, base: &Self) -> [T; 6] {
        let [w, x, y, z] = self.quaternion;
        let [bw, bx, by, bz] = base.quaternion;
        // q (conjugate of base)
        let scale = T::TWO / (w * bw + x * bx + y * by + z * bz);
        let a = (x * bw - w * bx - y * bz + z * by) * scale;
        let b = (y * bw - w * by - z * bx + x * bz) * scale;
        let c = (z * bw - w * bz - x * by + y * bx) * scale;
        let v = mul(&base.rotation, &sub(&base.centre, &self.centre));
        [a, b, c, v[0], v[1], v[2]]
    }

    /// The turn of the world's axes, as a quaternion, that takes the rotation of `base` to this one when the world is
    /// turned instead of the camera.
    pub(super) fn turn_from(&self, base: &Self) -> [T; 4] {
        let ([w, x, y, z], [bw, bx, by, bz]) = (self.quaternion, base.quaternion);
        // (conjugate of base) q
        [
            bw * w + bx * x + by * y + bz * z,
            bw * x - bx * w - by * z + bz * y,
            bw * y - by * w - bz * x + bx * z,
            bw * z - bz * w - bx * y + by * x,
        ]
    }

    /// Where this placement is after a turn of the world's axes about the origin.
    pub(super) fn turned(&self, turn: &[T; 4]) -> Self {
        let [w, x, y, z] = self.quaternion;
        let [a, b, c, d] = *turn;
        let q = [
            w * a - x * b - y * c - z * d,
            w * b + x * a + y * d - z * c,
            w * c + y * a + z * b - x * d,
            w * d + z * a + x * c - y * b,
        ];
        let axes = Self::new(*turn, [T::ZERO; 3]).rotation;
        Self::new(q, mul_transposed(&axes, &self.centre))
    }

    /// The Jacobian of [`motion_from`](Self::motion_from) `= e` by a further motion of this placement: the two diagonal
    /// blocks, rotation and translation.
    pub(super) fn motion_jacobian(&self, base: &Self, e: &[T; 6]) -> [M3<T>; 2] {
        let h = T::HALF;
        let (a, b, c) = (e[0] * h, e[1] * h, e[2] * h);
        let one = T::ONE;
        // I - [e/2]x + (e/2)(e/2)'
        let turn = [
            [one + a * a, a * b + c, a * c - b],
            [a * b - c, one + b * b, b * c + a],
            [a * c + b, b * c - a, one + c * c],
        ];
        [turn, super::small::product_transposed(&base.rotation, &self.rotation)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some(k: f64) -> Placement<f64> {
        Placement::new([0.9, 0.1 * k, -0.3, 0.2], [1.0, 2.0 * k, -0.5])
    }

    #[test]
    fn motion_is_inverted() {
        let d = [0.3, -0.2, 0.1, 1.0, -2.0, 0.5];
        let e = some(1.0).moved(&d).motion_from(&some(1.0));
        for (a, b) in d.iter().zip(e) {
            assert!((a - b).abs() < 1e-14, "{d:?} {e:?}");
        }
    }

    #[test]
    fn jacobian_by_central_differences() {
        let (base, here) = (some(1.0), some(1.4));
        let e = here.motion_from(&base);
        let [turn, shift] = here.motion_jacobian(&base, &e);
        for k in 0..6 {
            let h = 1e-6;
            let mut d = [0.0; 6];
            d[k] = h;
            let up = here.moved(&d).motion_from(&base);
            d[k] = -h;
            let down = here.moved(&d).motion_from(&base);
            for i in 0..6 {
                let slope = (up[i] - down[i]) / (2.0 * h);
                let told = match (i < 3, k < 3) {
                    (true, true) => turn[i][k],
                    (false, false) => shift[i - 3][k - 3],
                    _ => 0.0,
                };
                assert!((slope - told).abs() < 1e-8, "{i} {k}: {slope} {told}");
            }
        }
    }

    #[test]
    fn pose_there_and_back() {
        let p = some(0.7);
        let q = Placement::from_pose(&p.pose()).unwrap();
        assert!(q.motion_from(&p).iter().all(|x| x.abs() < 1e-14));
    }
}
