//! Which correspondences are neighbours: wrong ones seldom move as those around them do, so that neighbours are right
//! together more often than others.

use nalgebra::Vector3;

use crate::Real;
use crate::real::lit;

/// The square of how differently two correspondences move counts so many times that of how far apart they lie in view 1.
const MOTION: f64 = 10.0;

/// How far two correspondences are apart, by place and, more, by motion.
pub(super) fn apart<T: Real>(a: &(Vector3<T>, Vector3<T>), b: &(Vector3<T>, Vector3<T>)) -> T {
    let place = a.0 - b.0;
    let motion = a.1 - b.1 - place;
    place.dot(&place) + motion.dot(&motion) * lit(MOTION)
}
