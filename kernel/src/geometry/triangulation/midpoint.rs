//! The point midway between two rays.

use nalgebra::Vector3;

use super::{Triangulation, ViewPair, judge, judge_parallel, parallel_sine};
use crate::Real;
use crate::linalg::vec3::{cross, dot};

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
        let (a, b, c) = (&x1.data.0[0], &x2.data.0[0], &self.centre.data.0[0]);
        let d2 = self.rotation.data.0.map(|column| dot(&column, b));
        let p = cross(a, &d2);
        let sine_sq = dot(&p, &p);
        let limit = parallel_sine::<T>() * parallel_sine::<T>() * dot(a, a) * dot(&d2, &d2);
        // Also false for NaN, and where the squares overflow or underflow.
        if !(sine_sq > limit && sine_sq >= T::MIN_POSITIVE && sine_sq <= T::MAX) {
            return judge_parallel(self.centre, *x1, d2.into());
        }
        let depth1 = dot(&p, &cross(c, &d2));
        let depth2 = dot(&p, &cross(c, a));
        let scale = T::HALF / sine_sq;
        let at = |k: usize| (a[k] * depth1 + d2[k] * depth2) * scale + c[k] * T::HALF;
        let point = Vector3::new(at(0), at(1), at(2));
        judge(&self.centre, point, depth1, depth2)
    }
}
