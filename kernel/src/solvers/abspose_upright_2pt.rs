//! Absolute pose of two known points and the vertical.
//!
//! In upright frames `R` turns about y. With `u = z + i x` for the horizontal part of a vector, `R` multiplies by
//! `e = cos + i sin`, and `d1 x1 - d2 x2 = R (X1 - X2)` separates into one linear equation (the vertical part) and one
//! quadratic (the length of the horizontal part) in the distances.

use nalgebra::{Translation3, Vector3};

use crate::geometry::Pose;
use crate::geometry::pose::rotation_about_y;
use crate::real::{lit, sqrt};
use crate::{Real, Solutions};

/// The up to two poses of a camera that sees two known points, if both frames have the vertical as their y axis.
///
/// `d_i x_i = R X_i + t` with `d_i > 0` and `R` a rotation about y.
///
/// # Input
/// `bearings` of any length, in a camera frame that has been turned until gravity is along y; `points` in a world
/// frame whose y axis is along gravity too, in any unit.
///
/// # Returns
/// Poses world to (turned) camera, in the unit of the points.
///
/// # Degeneracies
/// Empty where both bearings are horizontal, where they are equal, where one point is above the other (any rotation
/// fits), where no real solution exists or a point would lie behind the camera, and for input that is not finite.
///
/// # Accuracy
/// Noise-free, depth 2 to 20: 100 % within 1e-3 rad (`f32`) and 1e-6 rad (`f64`).
///
/// # Cost
/// Closed form: one square root, and one more for each solution.
///
/// # References
/// Z. Kukelova, M. Bujnak, T. Pajdla, "Closed-form solutions to the minimal absolute pose problems with known vertical
/// direction", ACCV 2010. Here the distances come out directly, without a division that fails for one horizontal
/// bearing.
///
/// # Examples
/// ```
/// use epipole::geometry::Pose;
/// use epipole::nalgebra::{Point3, Vector3};
/// use epipole::solvers::abspose_upright_2pt;
/// let truth = Pose::new(Vector3::new(0.1, -0.2, 1.0), Vector3::new(0.0, 0.3, 0.0));
/// let points = [Vector3::new(1.0, 0.0, 4.0), Vector3::new(-1.0, 0.5, 5.0)];
/// let bearings = points.map(|p| (truth * Point3::from(p)).coords);
/// let poses = abspose_upright_2pt(&bearings, &points);
/// assert!(poses.iter().any(|pose| (pose.to_homogeneous() - truth.to_homogeneous()).norm() < 1e-12));
/// ```
pub fn abspose_upright_2pt<T: Real>(
    bearings: &[Vector3<T>; 2],
    points: &[Vector3<T>; 2],
) -> Solutions<Pose<T>, 2> {
    let mut solutions = Solutions::new();
    let [x1, x2] = bearings;
    let (y1, y2) = (x1.y, x2.y);
    let edge = points[0] - points[1];
    let span = edge.z * edge.z + edge.x * edge.x;
    let (s1, s2) = (x1.z * x1.z + x1.x * x1.x, x2.z * x2.z + x2.x * x2.x);
    // conj(u1) u2
    let (dot, cross) = (x1.z * x2.z + x1.x * x2.x, x1.z * x2.x - x1.x * x2.z);
    // |y2 u1 - y1 u2|^2
    let (wz, wx) = (y2 * x1.z - y1 * x2.z, y2 * x1.x - y1 * x2.x);
    let w = wz * wz + wx * wx;
    let lift = edge.y * cross;
    let root = sqrt(w * span - lift * lift);
    let (inverse_w, inverse_span) = (T::ONE / w, T::ONE / span);
    let a1 = edge.y * (y1 * s2 - y2 * dot);
    let a2 = edge.y * (y1 * dot - y2 * s1);
    for root in [root, -root] {
        let d1 = (a1 + y2 * root) * inverse_w;
        let d2 = (a2 + y1 * root) * inverse_w;
        if !(d1 > T::ZERO && d2 > T::ZERO) {
            continue;
        }
        let (ez, ex) = (d1 * x1.z - d2 * x2.z, d1 * x1.x - d2 * x2.x);
        let c = (ez * edge.z + ex * edge.x) * inverse_span;
        let s = (ex * edge.z - ez * edge.x) * inverse_span;
        // A unit vector but for rounding: one step of the reciprocal square root.
        let scale = lit::<T>(1.5) - T::HALF * (c * c + s * s);
        let (c, s) = (c * scale, s * scale);
        let p = &points[0];
        let translation =
            Vector3::new(d1 * x1.x - (c * p.x + s * p.z), d1 * y1 - p.y, d1 * x1.z - (c * p.z - s * p.x));
        if scale > T::HALF {
            solutions.push(Pose::from_parts(Translation3::from(translation), rotation_about_y(c, s)));
        }
    }
    solutions
}
