//! Errors of an estimate against the truth, and their statistics.

use epipole::nalgebra::{Matrix3, Vector2, Vector3};

/// The error of a refused or failed estimate, in degrees or pixels: worse than every threshold.
pub(crate) const REFUSED: f64 = f64::INFINITY;

/// One file's result. For a pose the errors are rotation and direction of translation in degrees; for a homography
/// both are the mean transfer error in pixels.
#[derive(Clone, Debug)]
pub(crate) struct Outcome {
    pub(crate) errors: [f64; 2],
    pub(crate) correspondences: usize,
    pub(crate) inliers: u32,
    pub(crate) iterations: u32,
    pub(crate) milliseconds: f64,
    /// How little the estimate itself trusts its answer: orders answers, largest last. Infinite without one.
    pub(crate) doubt: f64,
    /// Why there is no estimate; empty where there is one.
    pub(crate) refusal: String,
}

impl Outcome {
    /// How little the share of inliers trusts the answer: the measure others have.
    pub(crate) fn outlier_share(&self) -> f64 {
        if self.refusal.is_empty() {
            1.0 - f64::from(self.inliers) / self.correspondences as f64
        } else {
            f64::INFINITY
        }
    }

    /// The larger of both errors.
    pub(crate) fn worst(&self) -> f64 {
        self.errors[0].max(self.errors[1])
    }
}

/// The angle between two rotations in degrees, by the chord: `|A - B|_F = 2 sqrt 2 sin(angle / 2)`. Unlike the trace's
/// arc cosine it is exact for small angles, also where a matrix has six digits.
pub(crate) fn rotation_error_deg(a: &Matrix3<f64>, b: &Matrix3<f64>) -> f64 {
    (2.0 * ((a - b).norm() / 8f64.sqrt()).min(1.0).asin()).to_degrees()
}

/// The angle between two directions in degrees, by the chord.
pub(crate) fn direction_error_deg(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    (2.0 * ((a.normalize() - b.normalize()).norm() / 2.0).min(1.0).asin()).to_degrees()
}

/// The mean distance in pixels between where two homographies send a grid of points of image 1; only points that
/// `truth` sends into an image of the same size count.
pub(crate) fn transfer_error_px(truth: &Matrix3<f64>, estimate: &Matrix3<f64>, size: [f64; 2]) -> f64 {
    const GRID: usize = 21;
    let centre = truth * Vector3::new(size[0] / 2.0, size[1] / 2.0, 1.0);
    let map = |h: &Matrix3<f64>, x: &Vector3<f64>| {
        let y = h * x;
        (y.z, Vector2::new(y.x / y.z, y.y / y.z))
    };
    let (mut sum, mut count) = (0.0, 0u32);
    for j in 0..GRID {
        for i in 0..GRID {
            let place = |k: usize, side: f64| k as f64 / (GRID - 1) as f64 * (side - 1.0);
            let x = Vector3::new(place(i, size[0]), place(j, size[1]), 1.0);
            let (depth, want) = map(truth, &x);
            let inside = |v: f64, side: f64| (0.0..=side - 1.0).contains(&v);
            if depth * centre.z > 0.0 && inside(want.x, size[0]) && inside(want.y, size[1]) {
                sum += (map(estimate, &x).1 - want).norm();
                count += 1;
            }
        }
    }
    let mean = sum / f64::from(count);
    if mean.is_finite() { mean } else { REFUSED }
}

/// The area under the cumulative error curve up to a threshold, in percent of the threshold (trapezoids between the
/// sorted errors, as in the literature on image matching).
pub(crate) fn auc_percent(errors: &[f64], threshold: f64) -> f64 {
    let mut sorted = errors.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (mut area, mut last_error, mut last_recall) = (0.0, 0.0, 0.0);
    for (i, &error) in sorted.iter().enumerate().take_while(|(_, e)| **e < threshold) {
        let recall = (i + 1) as f64 / sorted.len() as f64;
        area += (error - last_error) * (recall + last_recall) / 2.0;
        (last_error, last_recall) = (error, recall);
    }
    100.0 * (area + (threshold - last_error) * last_recall) / threshold
}

/// The median, of two middle values their mean; NaN of nothing.
pub(crate) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => sorted[n / 2],
        n => (sorted[n / 2 - 1] + sorted[n / 2]) / 2.0,
    }
}

/// The share of values above a limit.
pub(crate) fn share_above(values: &[f64], limit: f64) -> f64 {
    values.iter().filter(|v| **v > limit).count() as f64 / values.len().max(1) as f64
}

/// The share of errors above `limit`, in percent, among the `k` answers with the least doubt, for each `k`: points of
/// coverage in percent and risk in percent.
pub(crate) fn risk_coverage(doubts_and_errors: &[(f64, f64)], limit: f64) -> Vec<(f64, f64)> {
    let mut sorted = doubts_and_errors.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut wrong = 0;
    let mut points = Vec::with_capacity(sorted.len());
    for (k, (_, error)) in (1..).zip(&sorted) {
        wrong += u32::from(*error > limit);
        points.push((100.0 * f64::from(k) / sorted.len() as f64, 100.0 * f64::from(wrong) / f64::from(k)));
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn area_under_curve() {
        assert_eq!(auc_percent(&[0.0, 0.0], 5.0), 100.0);
        assert_eq!(auc_percent(&[REFUSED; 3], 5.0), 0.0);
        // One error in the middle: a triangle up to it, then a plateau at 1.
        assert_eq!(auc_percent(&[5.0], 10.0), 100.0 * (2.5 + 5.0) / 10.0);
        assert!(auc_percent(&[1.0, 2.0, 30.0], 5.0) < auc_percent(&[1.0, 2.0, 3.0], 5.0));
    }

    #[test]
    fn risk_grows_with_doubt_that_is_right() {
        let curve = risk_coverage(&[(3.0, 9.0), (1.0, 0.1), (2.0, 0.2), (f64::INFINITY, REFUSED)], 5.0);
        assert_eq!(curve, [(25.0, 0.0), (50.0, 0.0), (75.0, 100.0 / 3.0), (100.0, 50.0)]);
    }

    #[test]
    fn medians() {
        assert_eq!(median([3.0, 1.0, 2.0].into_iter()), 2.0);
        assert_eq!(median([4.0, 1.0, 2.0, 3.0].into_iter()), 2.5);
        assert!(median(std::iter::empty()).is_nan());
    }

    #[test]
    fn angles_by_the_chord() {
        let turn = |a: f64| *epipole::nalgebra::Rotation3::from_scaled_axis(Vector3::z() * a).matrix();
        assert!((rotation_error_deg(&turn(0.0), &turn(1e-9)) / 1e-9f64.to_degrees() - 1.0).abs() < 1e-6);
        assert!((rotation_error_deg(&turn(0.0), &turn(3.0)) - 3f64.to_degrees()).abs() < 1e-9);
        assert!((direction_error_deg(&Vector3::x(), &Vector3::y()) - 90.0).abs() < 1e-12);
    }

    #[test]
    fn transfer_of_a_shift() {
        let mut shifted = Matrix3::identity();
        shifted[(0, 2)] = 3.0;
        assert!((transfer_error_px(&Matrix3::identity(), &shifted, [640.0, 480.0]) - 3.0).abs() < 1e-12);
    }
}
