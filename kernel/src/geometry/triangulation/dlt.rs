//! The linear method: the null vector of the homogeneous system of every view's ray equations.

use nalgebra::Vector3;

use super::{Triangulation, ViewPair, all_finite, judge, judge_parallel, parallel_sine};
use crate::geometry::Pose;
use crate::geometry::pose::{centre, tangent_basis};
use crate::linalg::RowQr;
use crate::real::{abs, is_finite, max, sqrt};
use crate::{InputError, Real};

/// Newton steps on the characteristic polynomial at the most. Two are usual, noise-free one.
const MAX_STEPS: usize = 24;

impl<T: Real> ViewPair<T> {
    /// The DLT point of two views, in the frame of view 1: the right singular vector of the smallest singular value of
    /// the 4x4 matrix `A` of the equations `B1' X = 0`, `B2' (X - w c) = 0`, where the two columns of `B` are
    /// orthonormal and orthogonal to the view's bearing, and the baseline is scaled to 1.
    ///
    /// So every equation is an angle, whatever the bearings' lengths, and the answer turns and scales with the frame.
    /// With the plane of the two rays as a frame, `A` has four numbers and the characteristic polynomial of `A'A` a
    /// closed form; its smallest root, 0 for exact data, is found by Newton's iteration from 0, which is monotone.
    ///
    /// # Input
    /// Bearings of any length; the squares of their lengths' product must neither overflow nor underflow.
    ///
    /// # Returns
    /// [`Triangulation`]; the parallax angle of a point is [`ViewPair::parallax`].
    ///
    /// # Degeneracies
    /// As [`ViewPair::triangulate_midpoint`]; `Undetermined` also where the iteration does not converge (a
    /// correspondence whose epipolar error is larger than its parallax).
    ///
    /// # Accuracy
    /// Noise-free, the relative error is a few `EPSILON` over the parallax angle. With noise it is biased at small
    /// parallax, more than the midpoint: prefer [`ViewPair::triangulate_optimal`].
    ///
    /// # Cost
    /// About 200 operations with 4 square roots, and 40 for each of at most 24 Newton steps.
    ///
    /// # References
    /// R. I. Hartley, P. Sturm, "Triangulation", Computer Vision and Image Understanding 68(2), 1997. The reduction to
    /// four numbers is our own.
    #[inline]
    pub fn triangulate_dlt(&self, x1: &Vector3<T>, x2: &Vector3<T>) -> Triangulation<T> {
        let one = T::ONE;
        let d2 = self.rotation.tr_mul(x2);
        let p = x1.cross(&d2);
        let (cross_sq, n1, n2) = (p.norm_squared(), x1.norm_squared(), d2.norm_squared());
        let limit = parallel_sine::<T>() * parallel_sine::<T>() * n1 * n2;
        if !(cross_sq > limit && cross_sq >= T::MIN_POSITIVE && cross_sq <= T::MAX) {
            return judge_parallel(self.centre, *x1, d2);
        }
        let baseline_sq = self.centre.norm_squared();
        if !(baseline_sq >= T::MIN_POSITIVE && baseline_sq <= T::MAX) {
            return Triangulation::Undetermined;
        }
        let (baseline, cross) = (sqrt(baseline_sq), sqrt(cross_sq));
        let lengths = sqrt(n1 * n2);
        // Frame of the rays: x1, the common normal p, and p x x1, all unit. The unknowns are the coordinates
        // (along, normal, across) and w; the rows are normal, across, normal - e w and s along - k across + g w.
        let (s, k) = (cross / lengths, x1.dot(&d2) / lengths);
        let normal = p * (one / cross);
        let u1 = x1 * (one / sqrt(n1));
        let u2 = d2 * (one / sqrt(n2));
        let c = self.centre * (one / baseline);
        let e = normal.dot(&c);
        let g = normal.cross(&u2).dot(&c);
        let Some(least) = Least::solve(e * e, s * s, k * k, g * g) else {
            return Triangulation::Undetermined;
        };
        let along = -g * s * least.rest / least.d;
        let out = e / (T::TWO - least.mu);
        let across = -k * g * least.mu / least.d;
        let local = u1 * along + normal * out + normal.cross(&u1) * across;
        judge(&self.centre, local * baseline, along, (local - c).dot(&u2))
    }
}

/// The smallest eigenvalue `mu` of `A'A`, with `rest = 1 - mu` and `d = s^2 rest - mu (rest + k^2)`.
struct Least<T: Real> {
    mu: T,
    rest: T,
    d: T,
}

impl<T: Real> Least<T> {
    /// The smallest root of `e^2 rest d - mu (2 - mu) (d + g^2 rest)`. The polynomial has real roots only, so Newton's
    /// iteration from below the smallest one rises to it without overshooting.
    #[inline]
    fn solve(e2: T, s2: T, k2: T, g2: T) -> Option<Self> {
        let mut mu = T::ZERO;
        for _ in 0..MAX_STEPS {
            let rest = T::ONE - mu;
            let d = s2 * rest - mu * (rest + k2);
            let dd = mu - s2 - rest - k2;
            let sum = d + g2 * rest;
            let value = e2 * rest * d - mu * (T::ONE + rest) * sum;
            let slope = e2 * (rest * dd - d) - T::TWO * rest * sum - mu * (T::ONE + rest) * (dd - g2);
            let step = -value / slope;
            // What a step changes of d is about 2 step: below the rounding of d it is the last.
            if !(step > T::EPSILON * d * T::HALF) {
                return (d > T::ZERO && is_finite(step)).then_some(Self { mu, rest, d });
            }
            mu += step;
        }
        None
    }
}

/// The DLT point of N views: the right singular vector of the smallest singular value of the 2N x 4 matrix `A` of the
/// equations `Bi' (X - w ci) = 0`, where the two columns of `Bi` are orthonormal and orthogonal to view i's bearing.
///
/// The rows are folded one view after the other into a 4x4 triangle by reflections, never `A'A`. The origin is put into
/// the first view's centre, and the largest distance to another centre is scaled to 1.
///
/// # Input
/// World-to-camera poses, and the point's bearing in each, of any length. At least two.
///
/// # Returns
/// [`Triangulation`], in the world.
///
/// # Errors
/// [`InputError`]: lengths that differ, fewer than two, a pose (array 0) or a bearing (array 1) that is not finite.
///
/// # Degeneracies
/// `AtInfinity` where the rays are parallel, `Undetermined` where the rank of `A` is below 3: no baseline, or every ray
/// along the baseline.
///
/// # Cost
/// Two passes over the views; per view about 250 operations, then 4 inverse iterations.
///
/// # Examples
/// ```
/// use epipole::geometry::{Pose, triangulation::{Triangulation, triangulate_dlt}};
/// use epipole::nalgebra::Vector3;
/// let poses = [0.0, -1.0, -2.0].map(|x| Pose::<f64>::translation(x, 0.0, 0.0));
/// let bearings = [1.0, 0.0, -1.0].map(|x| Vector3::new(x, 0.0, 4.0));
/// let point = triangulate_dlt(&poses, &bearings)?.point().unwrap();
/// assert!((point - Vector3::new(1.0, 0.0, 4.0)).norm() < 1e-12);
/// let parallel = [Vector3::new(0.0, 0.0, 1.0); 3];
/// assert!(matches!(triangulate_dlt(&poses, &parallel)?, Triangulation::AtInfinity { .. }));
/// # Ok::<(), epipole::InputError>(())
/// ```
pub fn triangulate_dlt<T: Real>(
    poses: &[Pose<T>],
    bearings: &[Vector3<T>],
) -> Result<Triangulation<T>, InputError> {
    if poses.len() != bearings.len() {
        return Err(InputError::LengthMismatch { first: poses.len(), second: bearings.len() });
    }
    let ([first, _, ..], [first_bearing, ..]) = (poses, bearings) else {
        return Err(InputError::TooFew { given: poses.len(), needed: 2 });
    };
    let origin = centre(first);
    let (mut scale, mut views) = (T::ZERO, T::ZERO);
    for (index, (pose, bearing)) in poses.iter().zip(bearings).enumerate() {
        let mut numbers = pose.rotation.coords.iter().chain(pose.translation.vector.iter());
        if !numbers.all(|x| is_finite(*x)) {
            return Err(InputError::NotFinite { array: 0, index });
        }
        if !all_finite(bearing) {
            return Err(InputError::NotFinite { array: 1, index });
        }
        let offset = centre(pose) - origin;
        scale = max(max(abs(offset.x), max(abs(offset.y), abs(offset.z))), scale);
        views += T::ONE;
    }
    if !(scale >= T::MIN_POSITIVE && scale <= T::MAX) {
        return Ok(Triangulation::Undetermined);
    }
    let ray = |pose: &Pose<T>, bearing: &Vector3<T>| {
        let d = Vector3::from(super::scaled(&(pose.rotation.inverse() * bearing))?);
        Some((d * (T::ONE / sqrt(d.norm_squared())), (centre(pose) - origin) / scale))
    };
    let mut qr = RowQr::<T, 4>::new();
    for (pose, bearing) in poses.iter().zip(bearings) {
        let Some((d, c)) = ray(pose, bearing) else {
            return Ok(Triangulation::Undetermined);
        };
        let b = tangent_basis(&d);
        qr.fold(
            [[b.m11, b.m21, b.m31], [b.m12, b.m22, b.m32]]
                .map(|[x, y, z]| [x, y, z, -(x * c.x + y * c.y + z * c.z)]),
        );
    }
    let rounding = parallel_sine::<T>() * sqrt(views);
    let Some(least) = qr.least_singular().filter(|least| least.next_value > rounding) else {
        return Ok(Triangulation::Undetermined);
    };
    let [x, y, z, w] = least.vector;
    let homogeneous = Vector3::new(x, y, z);
    let length = sqrt(homogeneous.norm_squared());
    let infinite = abs(w) <= rounding * length;
    // Of a point at infinity, the direction to which the first bearing points.
    let local = if infinite { homogeneous * (T::ONE / length) } else { homogeneous * (T::ONE / w) };
    let flip = infinite && ray(first, first_bearing).is_some_and(|(d, _)| d.dot(&local) < T::ZERO);
    let local = if flip { -local } else { local };
    let mut behind = None;
    let mut count = 0;
    for (index, (pose, bearing)) in poses.iter().zip(bearings).enumerate() {
        let Some((d, c)) = ray(pose, bearing) else {
            return Ok(Triangulation::Undetermined);
        };
        let towards = if infinite { local } else { local - c };
        if !(d.dot(&towards) > T::ZERO) {
            behind = behind.or(Some(index));
            count += 1;
        }
    }
    let point = local * scale + origin;
    Ok(match behind {
        _ if !all_finite(&point) || !all_finite(&local) => Triangulation::Undetermined,
        None if infinite => Triangulation::AtInfinity { direction: local },
        Some(_) if infinite => Triangulation::Undetermined,
        None => Triangulation::Point(point),
        Some(view) => Triangulation::Behind { point, view, count },
    })
}
