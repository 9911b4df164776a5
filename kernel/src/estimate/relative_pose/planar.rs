//! A plane among the inliers: its homography, the two motions that explain it, and the verdict on a planar scene.

use nalgebra::{ArrayStorage, Matrix3, Vector3};

use super::super::chance::EXPLAINED_SIGMAS;
use super::super::scatter::Scatter;
use super::covariance::planar_covariance;
use super::judge::{Judge, pose_model};
use super::verdict::{PlanarPose, RelativePoseEstimate, RelativePoseVerdict};
use crate::geometry::pose::rotation_matrix;
use crate::geometry::{Homography, Pose};
use crate::linalg::vec3::{cross, dot};
use crate::linalg::{LANES, add_outer, damped_step, times};
use crate::real::{from_u32, is_finite, lit, max, sqrt};
use crate::refine::blocks::EpipolarBlock;
use crate::refine::homography::{HomographyModel, transfer_equations, transfer_sq};
use crate::refine::relative_pose::PoseModel;
use crate::robust::Sampler;
use crate::robust::loss::Loss;
use crate::{Real, Solutions};

/// A plane is looked for with the threshold of this many standard deviations, and refined with a loss that ends at twice as
/// many; passes over the data of the refinement at the most.
const PLANE_SIGMAS: f64 = 3.5;
const PLANE_PASSES: u32 = 12;
/// Passes after which a plane's inliers are known well enough.
const COARSE_PASSES: u32 = 3;

/// Inliers among which a plane is looked for, and planes through three of them that are tried: of a plane that holds half
/// of them 24 in 25 are found.
const ENTRIES: usize = 64;
const PLANES: u32 = 24;
/// A plane of three is left where it misses more than this share of the entries looked at and so many more.
const LEFT: f64 = 0.7;
const HEAD: f64 = 4.0;
/// A share of the inliers, as a fraction, below which a plane is none of interest.
const HELD: [usize; 2] = [2, 5];

/// A correspondence as a plane sees it.
#[derive(Clone, Copy, Debug)]
struct InverseDepth<T: Real> {
    /// On the plane z = 1 of view 1.
    ray: [T; 3],
    /// 1 / z in view 1.
    value: T,
    /// Squared motion in view 2, in the blocks' unit, a unit of `value`.
    weight: T,
}

impl<T: Real> InverseDepth<T> {
    /// The squared distance in view 2 from where `plane' X1 = 1` puts the point.
    fn squared(&self, plane: &Vector3<T>) -> T {
        let e = self.value - dot(&self.ray, &plane.data.0[0]);
        e * e * self.weight
    }
}

/// One motion that explains a homography.
#[derive(Clone, Copy, Debug)]
pub(super) struct Twin<T: Real> {
    /// The pose, |t| = 1.
    pub(super) pose: Pose<T>,
    /// The plane's normal in view 1, away from the camera.
    normal: Vector3<T>,
    /// |t| over the plane's distance.
    ratio: T,
    /// Cost of the pose over all correspondences.
    pub(super) cost: T,
}

impl<T: Real, B: EpipolarBlock<T>> Judge<'_, '_, T, B> {
    /// The plane that holds the most inliers of a pose, refined, for a look at its inliers by `few` passes; none where less
    /// than half of them may lie on one.
    pub(super) fn plane(
        &self,
        pose: &PoseModel<T>,
        inliers: &[u32],
        sigma: T,
        few: bool,
    ) -> Option<HomographyModel<T>> {
        let plane = self.plane_of_three(pose, inliers, sigma * lit(PLANE_SIGMAS))?;
        let mut h = pose.rotation;
        add_outer(&mut h, &pose.translation, &plane, T::ONE);
        let h = pose.scales.transfer(&h);
        let (passes, tolerance) = if few { (COARSE_PASSES, lit(1e-2)) } else { (PLANE_PASSES, lit(1e-3)) };
        Some(self.refined_plane(&HomographyModel::new(&h)?, sigma, passes, tolerance))
    }

    /// A plane at its optimum.
    pub(super) fn finer(&self, plane: &HomographyModel<T>, sigma: T) -> HomographyModel<T> {
        self.refined_plane(plane, sigma, PLANE_PASSES, lit(1e-3))
    }

    fn refined_plane(
        &self,
        plane: &HomographyModel<T>,
        sigma: T,
        passes: u32,
        tolerance: T,
    ) -> HomographyModel<T> {
        let threshold = sigma * lit(PLANE_SIGMAS);
        let loss = Loss::Tukey(threshold * T::TWO);
        let refined = self.transfer_problem(threshold).optimise(plane, &loss, passes, tolerance);
        HomographyModel::new(&refined.model.0).unwrap_or(*plane)
    }

    /// The plane `p' X1 = 1` that holds the most of some inliers of a pose, fitted to those near the best one of three.
    ///
    /// Once a pose is known, inverse depths are linear in the image on a plane: three correspondences fix it, whether or not
    /// the pose is the right one of the two that a plane leaves open. Not inlined: its list takes no stack while the plane
    /// is refined.
    #[inline(never)]
    fn plane_of_three(&self, pose: &PoseModel<T>, inliers: &[u32], threshold: T) -> Option<Vector3<T>> {
        let mut entries = [InverseDepth { ray: [T::ZERO; 3], value: T::ZERO, weight: T::ZERO }; ENTRIES];
        let used = core::cmp::min(inliers.len(), ENTRIES);
        // k len / used, without a product that 32 bits do not hold.
        let (whole, rest) =
            (inliers.len() / core::cmp::max(used, 1), inliers.len() % core::cmp::max(used, 1));
        let place = |k: usize| k * whole + k * rest / core::cmp::max(used, 1);
        for (k, entry) in entries.iter_mut().enumerate().take(used) {
            *entry = inliers.get(place(k)).and_then(|&index| self.inverse_depth(pose, index))?;
        }
        let entries = entries.get(..used).unwrap_or_default();
        // Noise of both views.
        let limit = threshold * threshold * T::TWO;
        let scale = T::ONE / limit;
        let mut sampler = Sampler::<T>::uniform(self.seed, used as u32);
        let mut best = (from_u32::<T>(used as u32), None);
        for k in 0..PLANES {
            let Some(sample) = sampler.sample::<3>(k) else { break };
            let [Some(a), Some(b), Some(c)] = sample.map(|i| entries.get(i as usize)) else { break };
            let normals = [cross(&b.ray, &c.ray), cross(&c.ray, &a.ray), cross(&a.ray, &b.ray)];
            let inverse = T::ONE / dot(&normals[0], &a.ray);
            let normals = Matrix3::from_data(ArrayStorage(normals));
            let plane = times(&normals, &Vector3::new(a.value, b.value, c.value)) * inverse;
            let (mut cost, mut allowed) = (T::ZERO, lit::<T>(HEAD));
            for entry in entries {
                let share = entry.squared(&plane) * scale;
                cost += if share < T::ONE { share } else { T::ONE };
                // No longer the best, or of no interest.
                allowed += lit(LEFT);
                if !(cost < best.0 && cost < allowed) {
                    cost = T::MAX;
                    break;
                }
            }
            if cost < best.0 {
                best = (cost, Some(plane));
            }
        }
        // All that are near a plane of three give a good one.
        let coarse = best.1?;
        let mut moment = Matrix3::zeros();
        let mut gradient = Vector3::zeros();
        for entry in entries.iter().filter(|entry| entry.squared(&coarse) < limit * T::TWO) {
            let ray = Vector3::from(entry.ray);
            add_outer(&mut moment, &ray, &ray, entry.weight);
            gradient -= ray * (entry.value * entry.weight);
        }
        let (plane, _) = damped_step(&moment, &gradient, T::ZERO)?;
        let held = entries.iter().filter(|entry| entry.squared(&plane) < limit * T::TWO).count();
        if held * HELD[1] < used * HELD[0] {
            return None;
        }
        Some(plane)
    }

    /// The inverse depth of a correspondence in view 1 under a pose, in baselines; none where it is not finite.
    fn inverse_depth(&self, pose: &PoseModel<T>, index: u32) -> Option<InverseDepth<T>> {
        let block = self.problem.data.blocks.get(index as usize / LANES)?;
        let ([x1, y1, x2, y2], share) = block.on_planes(index as usize % LANES)?;
        let (a, b, s) = (pose.scales.inverse1(), pose.scales.inverse2(), pose.scales.view2);
        let ray = Vector3::new(x1 * a[0], y1 * a[1], T::ONE);
        let seen = [x2 * b[0], y2 * b[1], T::ONE];
        let t = &pose.translation.data.0[0];
        let turned = times(&pose.rotation, &ray).data.0[0];
        // seen x (turned + value t) = 0 in the least-squares sense.
        let lever = cross(&seen, t);
        let value = -dot(&lever, &cross(&seen, &turned)) / max(dot(&lever, &lever), T::MIN_POSITIVE);
        let depth = turned[2] + value * t[2];
        // How far the point moves in view 2 with the inverse depth.
        let (x, y) = ((t[0] - seen[0] * t[2]) * s[0], (t[1] - seen[1] * t[2]) * s[1]);
        let weight = (x * x + y * y) * share / (depth * depth);
        let ray = ray.data.0[0];
        (is_finite(value) && is_finite(weight)).then_some(InverseDepth { ray, value, weight })
    }

    /// The correspondences that a plane does not explain, in the memory given.
    pub(super) fn off<'o>(&self, plane: &HomographyModel<T>, sigma: T, order: &'o mut [u32]) -> &'o [u32] {
        let limit = sigma * lit(EXPLAINED_SIGMAS);
        let limit = limit * limit;
        let (mut index, mut length) = (0, 0);
        let mut entries = order.iter_mut();
        for block in self.problem.data.blocks {
            for s in transfer_sq(&plane.0, block, T::ONE) {
                // A NaN is not explained.
                if !(s < limit)
                    && index < self.problem.data.count as u32
                    && let Some(entry) = entries.next()
                {
                    *entry = index;
                    length += 1;
                }
                index += 1;
            }
        }
        order.get(..length).unwrap_or_default()
    }

    /// The up to two motions of a plane that keep its points in front of both cameras, the more likely one first.
    pub(super) fn twins(&self, plane: &HomographyModel<T>) -> Solutions<Twin<T>, 2> {
        let h = Homography(self.problem.scales.transfer_back(&plane.0));
        let mut found: [Option<Twin<T>>; 2] = [None; 2];
        for motion in &h.motions() {
            let t = motion.pose.translation.vector;
            let length = sqrt(t.norm_squared());
            // The normal points away from the camera for points in front of it.
            if !(length > T::ZERO) || !self.visible(plane, &motion.normal) {
                continue;
            }
            let pose = Pose::from_parts((t * (T::ONE / length)).into(), motion.pose.rotation);
            let cost = self.cost(&pose_model(&pose, self.problem));
            let mut moving = Some(Twin { pose, normal: motion.normal, ratio: length, cost });
            for place in &mut found {
                let cost = moving.map_or(T::MAX, |twin| twin.cost);
                if place.is_none_or(|kept| cost < kept.cost) {
                    core::mem::swap(place, &mut moving);
                }
            }
        }
        let mut twins = Solutions::new();
        for twin in found.into_iter().flatten() {
            twins.push(twin);
        }
        twins
    }

    /// True where most of a plane's inliers see the plane's normal point away.
    fn visible(&self, plane: &HomographyModel<T>, normal: &Vector3<T>) -> bool {
        let limit = self.problem.threshold * self.problem.threshold * T::TWO;
        let (mut ahead, mut behind) = (0u32, 0u32);
        let mut left = self.problem.data.count;
        let s = self.problem.scales.inverse1();
        for block in self.problem.data.blocks {
            let squared = transfer_sq(&plane.0, block, T::ONE);
            for l in 0..LANES {
                if l < left
                    && squared[l] < limit
                    && let Some(([x, y, ..], _)) = block.on_planes(l)
                {
                    let side = normal.x * x * s[0] + normal.y * y * s[1] + normal.z;
                    ahead += (side > T::ZERO) as u32;
                    behind += (side <= T::ZERO) as u32;
                }
            }
            left = left.saturating_sub(LANES);
        }
        ahead > behind
    }

    /// The verdict on a planar scene.
    pub(super) fn planar(
        &self,
        plane: &HomographyModel<T>,
        twins: &Solutions<Twin<T>, 2>,
        sigma: T,
        mask: &mut [bool],
        estimate: &mut RelativePoseEstimate<T>,
    ) {
        let support = sigma * lit(PLANE_SIGMAS) * T::TWO;
        let problem = self.transfer_problem(support);
        let sums = transfer_equations(problem.data, plane, &Loss::Tukey(support));
        let scatter = Scatter::new(problem.data, plane, support);
        self.mark_transfer(&plane.0, mask);
        estimate.noise_px = sqrt(scatter.variance());
        estimate.verdict = RelativePoseVerdict::Planar(Solutions::new());
        let RelativePoseVerdict::Planar(poses) = &mut estimate.verdict else { return };
        for &Twin { pose, normal, ratio, .. } in twins {
            let rotation = rotation_matrix(&pose.rotation);
            let t = pose.translation.vector * ratio;
            let scales = &self.problem.scales;
            let covariance = scatter
                .factor()
                .and_then(|factor| planar_covariance(&rotation, &t, &normal, plane, &sums, scales, factor));
            poses.push(PlanarPose { pose, normal, baseline_over_distance: ratio, covariance });
        }
    }
}

/// Two of a sample, whose numbers rise, give way to two others of a list, all as likely.
#[cfg_attr(small, inline)]
pub(super) fn exchange_two(sample: &mut [u32; 5], others: &[u32]) {
    let key = sample.iter().fold(0, |key: u32, &index| key.wrapping_mul(0x9e37_79b9).wrapping_add(index));
    let pair =
        |seed: u64, count: u32| Sampler::<f32>::uniform(seed, count).sample::<2>(key).unwrap_or_default();
    for (place, other) in pair(0, 5).into_iter().zip(pair(1, others.len() as u32)) {
        if let (Some(index), Some(&other)) = (sample.get_mut(place as usize), others.get(other as usize)) {
            *index = other;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 120 numbers 40 stand in the list: how often each of the two kinds is in a sample does not depend on its place.
    #[test]
    fn two_of_a_sample_are_exchanged_evenly() {
        let others: [u32; 40] = core::array::from_fn(|k| 1000 + k as u32);
        let (mut kept, mut taken) = ([0u32; 120], [0u32; 40]);
        let draws = 40_000;
        for k in 0..draws {
            let mut sample = Sampler::<f32>::uniform(3, 120).sample::<5>(k).expect("120 are enough");
            exchange_two(&mut sample, &others);
            for index in sample {
                match index.checked_sub(1000) {
                    Some(other) => taken[other as usize] += 1,
                    None => kept[index as usize] += 1,
                }
            }
        }
        for (counts, expected) in [(&kept[..], 3.0 / 120.0), (&taken[..], 2.0 / 40.0)] {
            let expected = expected * draws as f64;
            for &count in counts {
                assert!((count as f64 - expected).abs() < 5.0 * expected.sqrt(), "{count} {expected}");
            }
        }
    }
}
