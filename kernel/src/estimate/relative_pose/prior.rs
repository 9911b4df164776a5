//! What is known of the rotation beforehand: as a residual of the refinement, and as a test of the answer.

use nalgebra::{Matrix3, SMatrix, UnitQuaternion, Vector3};

use super::super::prior::{Direction, PriorFit};
use super::covariance::Spread;
use super::verdict::{GeneralMotion, RelativePoseVerdict};
use crate::Real;
use crate::geometry::pose::{log, quaternion_from_matrix, rotation_matrix, skew, tangent_basis};
use crate::linalg::Ldlt;
use crate::real::{is_finite, lit, sqrt};
use crate::refine::lm::NormalEquations;
use crate::refine::relative_pose::cayley;

/// What is known of a relative pose before its images are looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum RelativePosePrior<T: Real> {
    /// The direction of gravity, of any length, in the frame of each view. Samples are of three correspondences.
    Gravity {
        /// In view 1.
        view1: Vector3<T>,
        /// In view 2.
        view2: Vector3<T>,
        /// Standard deviation of each of the two directions, about each axis across it, rad.
        sigma_rad: T,
    },
    /// The rotation `R` of `X2 = R X1 + t`, as integrated from a gyroscope. Samples are of two correspondences.
    Rotation {
        /// `R`.
        rotation: UnitQuaternion<T>,
        /// Covariance of w of `R <- Exp(w) R`, rad^2.
        covariance: Matrix3<T>,
    },
}

/// Squared standard deviations beyond which a prior is contradicted: chi-squared with 2 and with 3 degrees of freedom, of
/// which one in 10,000 is larger.
const LIMIT_SQ_GRAVITY: f64 = 18.42;
const LIMIT_SQ_ROTATION: f64 = 21.11;

/// A prior as the refinement sees it: behind a pointer, so that a program without priors holds no code for them.
pub(super) trait RotationPrior<T: Real> {
    /// Adds the squared deviation of a rotation from the prior, in units of the prior's covariance over `variance`, to
    /// equations whose first three unknowns turn it.
    fn add(&self, sums: &mut NormalEquations<T, 5>, rotation: &Matrix3<T>, variance: T);
    /// The squared deviation of a rotation from the prior, in units of the prior's covariance.
    fn cost(&self, rotation: &Matrix3<T>) -> T;
    /// How the prior agrees with what the correspondences say without it: by the step from a pose in which it took part, as in
    /// `sums` with the variance `assumed`, that their equations alone ask for; none where they leave a direction open. In
    /// `sums` it then takes part with the variance found.
    fn agreement(
        &self,
        sums: &mut NormalEquations<T, 5>,
        rotation: &Matrix3<T>,
        assumed: T,
        found: &Spread<T>,
    ) -> Option<PriorFit<T>>;
}

/// A prior that has been checked.
#[derive(Clone, Copy, Debug)]
pub(super) enum KnownRotation<T: Real> {
    /// A direction in both frames.
    Gravity {
        direction: Direction<T>,
        /// Of the difference of the two, about each axis, rad^2.
        variance: T,
    },
    /// All of it.
    Rotation { rotation: UnitQuaternion<T>, covariance: Matrix3<T>, information: Matrix3<T> },
}

impl<T: Real> RotationPrior<T> for KnownRotation<T> {
    fn add(&self, sums: &mut NormalEquations<T, 5>, rotation: &Matrix3<T>, variance: T) {
        match self {
            Self::Gravity { direction, variance: own } => direction.add(sums, rotation, variance / *own),
            Self::Rotation { rotation: known, information, .. } => {
                let e = turn(rotation, known);
                let g = information * e;
                for p in 0..3 {
                    sums.gradient.data.0[0][p] += variance * g.data.0[0][p];
                    for q in 0..3 {
                        sums.hessian.data.0[q][p] += variance * information.data.0[q][p];
                    }
                }
                sums.cost += variance * e.dot(&g);
            }
        }
    }

    fn cost(&self, rotation: &Matrix3<T>) -> T {
        match self {
            Self::Gravity { direction, variance } => {
                (rotation * direction.from - direction.to).norm_squared() / *variance
            }
            Self::Rotation { rotation: known, information, .. } => {
                let e = turn(rotation, known);
                e.dot(&(information * e))
            }
        }
    }

    fn agreement(
        &self,
        sums: &mut NormalEquations<T, 5>,
        rotation: &Matrix3<T>,
        assumed: T,
        found: &Spread<T>,
    ) -> Option<PriorFit<T>> {
        self.add(sums, rotation, -assumed);
        // By a Newton step.
        let fit = Ldlt::new(&sums.hessian).map(|factors| {
            let step = -factors.solve(&(sums.gradient * found.bend));
            let [x, y, z, ..] = step.data.0[0];
            let alone = cayley(&Vector3::new(x, y, z)) * rotation;
            self.fit(&alone, &rotation_block(&(factors.inverse() * found.variance)))
        });
        self.add(sums, rotation, found.variance);
        fit
    }
}

impl<T: Real> KnownRotation<T> {
    /// None where a direction has no length, an uncertainty is not positive, or a number is not finite.
    pub(super) fn new(prior: &RelativePosePrior<T>) -> Option<Self> {
        match prior {
            RelativePosePrior::Gravity { view1, view2, sigma_rad } => {
                let variance = T::TWO * *sigma_rad * *sigma_rad;
                let usable = *sigma_rad > T::ZERO && variance > T::MIN_POSITIVE && is_finite(variance);
                Some(Self::Gravity { direction: Direction::new(view1, view2)?, variance }).filter(|_| usable)
            }
            RelativePosePrior::Rotation { rotation, covariance } => {
                let q = rotation.into_inner();
                let length = sqrt(q.coords.norm_squared());
                let information = Ldlt::new(covariance)?.inverse();
                let trace = covariance.trace() + information.trace();
                if !(length > T::MIN_POSITIVE && is_finite(length) && is_finite(trace)) {
                    return None;
                }
                let rotation = UnitQuaternion::new_unchecked(q * (T::ONE / length));
                // The lower triangle was read.
                let covariance = covariance.lower_triangle() + covariance.lower_triangle().transpose()
                    - Matrix3::from_diagonal(&covariance.diagonal());
                Some(Self::Rotation { rotation, covariance, information })
            }
        }
    }

    /// The mean variance about an axis, rad^2.
    pub(super) fn variance(&self) -> T {
        match self {
            Self::Gravity { variance, .. } => *variance,
            Self::Rotation { covariance, .. } => covariance.trace() / lit(3.0),
        }
    }

    /// How the prior agrees with a rotation of a covariance that was found without it: Wald's test.
    fn fit(&self, rotation: &Matrix3<T>, covariance: &Matrix3<T>) -> PriorFit<T> {
        let (square, limit) = match self {
            Self::Gravity { direction, variance } => {
                let a = rotation * direction.from;
                let basis = tangent_basis(&a);
                let ahead = a.dot(&direction.to);
                // B' da = -B' [a]x w
                let lever = basis.transpose() * skew(&a);
                let mut total = lever * covariance * lever.transpose();
                total.data.0[0][0] += *variance;
                total.data.0[1][1] += *variance;
                let e = basis.transpose() * direction.to * (T::ONE / ahead);
                let square = Ldlt::new(&total).map(|factors| e.dot(&factors.solve(&e)));
                (square.filter(|_| ahead > T::ZERO), lit(LIMIT_SQ_GRAVITY))
            }
            Self::Rotation { rotation: known, covariance: own, .. } => {
                let e = turn(rotation, known);
                let square = Ldlt::new(&(own + covariance)).map(|factors| e.dot(&factors.solve(&e)));
                (square, lit(LIMIT_SQ_ROTATION))
            }
        };
        match square.filter(|square| *square >= T::ZERO && is_finite(*square)) {
            Some(square) if square < limit => PriorFit::Fits(sqrt(square)),
            Some(square) => PriorFit::Contradicted(sqrt(square)),
            None => PriorFit::Contradicted(sqrt(T::MAX)),
        }
    }

    /// True where nothing speaks against the prior in a pose that was found without it: a pose whose covariance is not
    /// known tells nothing.
    pub(super) fn fits(&self, motion: &GeneralMotion<T>) -> bool {
        !matches!(self.fit_of(&motion.pose.rotation, &motion.covariance), Some(PriorFit::Contradicted(_)))
    }

    /// [`Self::fit`] with the rotation's part of a covariance; none without one.
    fn fit_of<const P: usize>(
        &self,
        rotation: &UnitQuaternion<T>,
        covariance: &Option<SMatrix<T, P, P>>,
    ) -> Option<PriorFit<T>> {
        let rotation = rotation_matrix(rotation);
        covariance.as_ref().map(|covariance| self.fit(&rotation, &rotation_block(covariance)))
    }

    /// How the prior agrees with a verdict that was found without it; none where the verdict knows of no rotation.
    pub(super) fn agreement(&self, verdict: &RelativePoseVerdict<T>) -> Option<PriorFit<T>> {
        match verdict {
            RelativePoseVerdict::General(motion) | RelativePoseVerdict::GeneralOrPlanar(motion) => {
                self.fit_of(&motion.pose.rotation, &motion.covariance)
            }
            RelativePoseVerdict::Planar(poses) => {
                // Whichever of the two is right: the nearer one.
                let nearer = |best: Option<PriorFit<T>>, fit: PriorFit<T>| match best {
                    Some(best) if deviations(&best) <= deviations(&fit) => Some(best),
                    _ => Some(fit),
                };
                poses
                    .iter()
                    .filter_map(|planar| self.fit_of(&planar.pose.rotation, &planar.covariance))
                    .fold(None, nearer)
            }
            RelativePoseVerdict::PureRotation(found) => self.fit_of(&found.rotation, &found.covariance),
            RelativePoseVerdict::NoMotion => Some(self.fit(&Matrix3::identity(), &Matrix3::zeros())),
            _ => None,
        }
    }
}

/// `log(R R0')`.
fn turn<T: Real>(rotation: &Matrix3<T>, known: &UnitQuaternion<T>) -> Vector3<T> {
    log(&(quaternion_from_matrix(rotation) * known.inverse()))
}

fn deviations<T: Real>(fit: &PriorFit<T>) -> T {
    match fit {
        PriorFit::Fits(deviations) | PriorFit::Contradicted(deviations) => *deviations,
    }
}

/// The rotation's part of a covariance.
fn rotation_block<T: Real, const P: usize>(covariance: &SMatrix<T, P, P>) -> Matrix3<T> {
    const { assert!(P >= 3, "the rotation comes first") };
    let mut block = Matrix3::zeros();
    for q in 0..3 {
        for p in 0..3 {
            block.data.0[q][p] = covariance.data.0[q][p];
        }
    }
    block
}
