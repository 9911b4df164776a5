//! The point midway between two rays.

use nalgebra::Vector3;

use super::{Triangulation, ViewPair, judge, judge_parallel, parallel_sine};
use crate::Real;

impl<T: Real> ViewPair<T> {
    /// The midpoint of the shortest segment between the two rays, in the frame of view 1.
    ///
    /// With `d = R' x2`, `c = -R' t` and `p = x1 x d`, the feet of the segment are at `x1 (p . (c x d)) / p^2` and
    /// `c + d (p . (c x x1)) / p^2`; the signs of the numerators are the signs of the depths.
    ///
    /// # Input
    /// Bearings of any length; the squares of their lengths' product must neither overflow nor underflow.
    ///
    /// # Returns
    /// [`Triangulation`]; the parallax angle of a point is [`ViewPair::parallax`].
    ///
    /// # Degeneracies
    /// Rays whose angle is below `8 EPSILON` are parallel: `AtInfinity`, or `Undetermined` along the baseline.
    ///
    /// # Accuracy
    /// Noise-free, the relative error is a few `EPSILON` over the parallax angle. With noise, the depth is biased where
    /// the parallax is no larger than a few times the noise.
    ///
    /// # Cost
    /// About 90 operations, one division, no iteration.
    ///
    /// # References
    /// R. I. Hartley, P. Sturm, "Triangulation", Computer Vision and Image Understanding 68(2), 1997.
    ///
    /// # Examples
    /// ```
    /// use epipole::geometry::{Pose, triangulation::ViewPair};
    /// use epipole::nalgebra::Vector3;
    /// let pair = ViewPair::new(&Pose::<f32>::translation(-1.0, 0.0, 0.0));
    /// let point = pair.triangulate_midpoint(&Vector3::new(0.5, 0.0, 1.0), &Vector3::new(0.0, 0.0, 1.0));
    /// assert_eq!(point.point(), Some(Vector3::new(1.0, 0.0, 2.0)));
    /// ```
    #[inline]
    pub fn triangulate_midpoint(&self, x1: &Vector3<T>, x2: &Vector3<T>) -> Triangulation<T> {
        let d2 = self.rotation.tr_mul(x2);
        let c = &self.centre;
        let p = x1.cross(&d2);
        let sine_sq = p.norm_squared();
        let limit = parallel_sine::<T>() * parallel_sine::<T>() * x1.norm_squared() * d2.norm_squared();
        // Also false for NaN, and where the squares overflow or underflow.
        if !(sine_sq > limit && sine_sq >= T::MIN_POSITIVE && sine_sq <= T::MAX) {
            return judge_parallel(self.centre, *x1, d2);
        }
        let depth1 = p.dot(&c.cross(&d2));
        let depth2 = p.dot(&c.cross(x1));
        let point = (x1 * depth1 + d2 * depth2) * (T::HALF / sine_sq) + c * T::HALF;
        judge(c, point, depth1, depth2)
    }
}
