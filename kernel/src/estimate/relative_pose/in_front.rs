//! The pose of an essential matrix that keeps a sample in front of both cameras.

use nalgebra::{Matrix3, Vector3};

use crate::Real;
use crate::geometry::Essential;
use crate::linalg::vec3::{cross, dot};
use crate::linalg::{self, times};
use crate::real::{abs, lit, sqrt};

/// The first pose of an essential matrix for which all five points lie in front of both cameras, those with parallel
/// rays left aside; none where there is none. Horn's closed form, without a singular value decomposition.
///
/// # References
/// B. K. P. Horn, "Recovering baseline and orientation from essential matrix", 1990.
pub(super) fn pose_in_front<T: Real>(
    essential: &Essential<T>,
    f1: &[Vector3<T>; 5],
    f2: &[Vector3<T>; 5],
    parallel_sq: T,
) -> Option<(Matrix3<T>, Vector3<T>)> {
    let e = &essential.0.data.0;
    let products = [cross(&e[1], &e[2]), cross(&e[2], &e[0]), cross(&e[0], &e[1])];
    // t is orthogonal to every column: the longest of their cross products.
    let (mut t, mut longest) = (products[0], T::ZERO);
    for product in products {
        let length = dot(&product, &product);
        if length > longest {
            (t, longest) = (product, length);
        }
    }
    let size = essential.0.norm_squared() * T::HALF;
    if !(longest > T::ZERO && size > T::ZERO) {
        return None;
    }
    let scale = T::ONE / sqrt(longest);
    let t = Vector3::new(t[0] * scale, t[1] * scale, t[2] * scale);
    // With |t| = 1 and E scaled to |E|^2 = 2: R = cof(E) - [t]x E, or with -t.
    let scale = T::ONE / sqrt(size);
    let turned = linalg::cross(&t, &essential.0).data.0;
    for side in [-scale, scale] {
        let mut rotation = essential.0;
        for j in 0..3 {
            for i in 0..3 {
                rotation.data.0[j][i] = products[j][i] * (scale * scale) + turned[j][i] * side;
            }
        }
        let mut sign = T::ZERO;
        let mut consistent = true;
        for (x1, x2) in f1.iter().zip(f2) {
            let a = times(&rotation, x1);
            let (aa, bb, ab) = (a.norm_squared(), x2.norm_squared(), a.dot(x2));
            if aa * bb - ab * ab <= parallel_sq * aa * bb && ab > T::ZERO {
                continue;
            }
            let (ta, tb) = (t.dot(&a), t.dot(x2));
            let (depth1, depth2) = (ab * tb - bb * ta, aa * tb - ab * ta);
            if !(depth1 * depth2 > T::ZERO && depth1 * sign >= T::ZERO) {
                consistent = false;
                break;
            }
            sign = depth1;
        }
        if consistent {
            let t = if sign < T::ZERO { Vector3::new(-t.x, -t.y, -t.z) } else { t };
            // A matrix that is not close to essential gives no rotation.
            let off = abs(rotation.norm_squared() - lit(3.0));
            return (off < lit(0.1)).then_some((rotation, t));
        }
    }
    None
}
