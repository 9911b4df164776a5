//! What an inertial unit knows, beside what the correspondences say.

use nalgebra::Vector3;

use crate::Real;
use crate::geometry::pose::{upright, vector_angle};
use crate::refine::lm::NormalEquations;

/// Whether what was known beforehand agrees with what the correspondences say.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum PriorFit<T> {
    /// The prior fits, and took part in the refinement. By how many standard deviations the two differ.
    Fits(T),
    /// The correspondences contradict the prior: it was left aside. By how many standard deviations the two differ.
    Contradicted(T),
}

/// A direction known in two frames.
#[derive(Clone, Copy, Debug)]
pub(super) struct Direction<T: Real> {
    /// Unit vector in the frame that a rotation maps from.
    pub(super) from: Vector3<T>,
    /// Unit vector in the frame that it maps to.
    pub(super) to: Vector3<T>,
}

impl<T: Real> Direction<T> {
    /// Of two vectors of any length; none where one has none or is not finite.
    pub(super) fn new(from: &Vector3<T>, to: &Vector3<T>) -> Option<Self> {
        // The row of the turn that goes to +y is the unit vector.
        let unit = |v: &Vector3<T>| upright(v).map(|turn| turn.row(1).transpose());
        Some(Self { from: unit(from)?, to: unit(to)? })
    }

    /// The angle between the two under a rotation.
    pub(super) fn turn_between(&self, rotation: &nalgebra::Matrix3<T>) -> T {
        vector_angle(&(rotation * self.from), &self.to)
    }

    /// Adds `weight |R from - to|^2` to equations whose first three unknowns turn `R`.
    pub(super) fn add<const P: usize>(
        &self,
        sums: &mut NormalEquations<T, P>,
        rotation: &nalgebra::Matrix3<T>,
        weight: T,
    ) {
        const { assert!(P >= 3, "the rotation comes first") };
        let a = rotation * self.from;
        let g = self.to.cross(&a) * weight;
        for p in 0..3 {
            sums.gradient.data.0[0][p] += g.data.0[0][p];
            for q in 0..3 {
                let own = if p == q { T::ONE } else { T::ZERO };
                sums.hessian.data.0[q][p] += weight * (own - a.data.0[0][p] * a.data.0[0][q]);
            }
        }
        sums.cost += weight * (a - self.to).norm_squared();
    }
}
