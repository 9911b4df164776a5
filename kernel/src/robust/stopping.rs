//! When enough samples have been drawn, and what chance explains.

use crate::Real;
use crate::real::{from_u32, lit, ln, max, min};

/// The probability that `sample_size` draws without replacement from `count` correspondences hit `inliers` only:
/// the product of (inliers - i) / (count - i).
///
/// ```
/// use epipole::robust::probability_of_inlier_sample;
/// assert_eq!(probability_of_inlier_sample::<f64>(4, 8, 2), 4.0 * 3.0 / (8.0 * 7.0));
/// ```
///
/// # Returns
/// 0 where there are fewer inliers than a sample takes.
///
/// # Cost
/// At most 16 factors: samples are never larger.
#[must_use]
pub fn probability_of_inlier_sample<T: Real>(inliers: u32, count: u32, sample_size: u32) -> T {
    if inliers < sample_size || count < inliers {
        return T::ZERO;
    }
    let mut p = T::ONE;
    for i in 0..core::cmp::min(sample_size, 16) {
        p *= from_u32::<T>(inliers - i) / from_u32::<T>(count - i);
    }
    p
}

/// `-ln(1 - p)`, accurate for small `p` too; `T::MAX` for p >= 1.
fn minus_ln_1m<T: Real>(p: T) -> T {
    if p >= T::ONE {
        T::MAX
    } else if p < lit::<T>(0.01) {
        // Five terms of the series: the sixth is below 1e-12 relative to the first.
        let mut sum = T::ZERO;
        for k in [5, 4, 3, 2, 1] {
            sum = sum * p + T::ONE / from_u32::<T>(k);
        }
        sum * p
    } else {
        -ln(T::ONE - p)
    }
}

/// How many samples make it `confidence` likely that one of them held inliers only, by the exact hypergeometric
/// probability; `u32::MAX` where no number does.
///
/// # Input
/// `confidence` in (0, 1).
///
/// # Accuracy
/// The relative error in `f32` is below 1e-3; the number is rounded up.
///
/// # Examples
/// ```
/// use epipole::robust::iterations_needed;
/// // Half of 100 correspondences are inliers, samples take five: one sample in 36 is good.
/// assert_eq!(iterations_needed(0.999_f64, 50, 100, 5), 242);
/// assert_eq!(iterations_needed(0.999_f64, 4, 100, 5), u32::MAX);
/// ```
#[must_use]
pub fn iterations_needed<T: Real>(confidence: T, inliers: u32, count: u32, sample_size: u32) -> u32 {
    let p = probability_of_inlier_sample::<T>(inliers, count, sample_size);
    if p <= T::ZERO {
        return u32::MAX;
    }
    let n = minus_ln_1m(confidence) / minus_ln_1m(p);
    // Rounded up; beyond 2^31 there is no point in counting.
    if n < lit::<T>(2_147_483_648.0) { n.to_u32() + 1 } else { u32::MAX }
}

/// The probability that none of `iterations` samples held inliers only.
///
/// # Accuracy
/// An error of at most `iterations * (sample_size + 1)` times `EPSILON`, for that of a sample's probability grows with them.
///
/// # Examples
/// ```
/// use epipole::robust::{iterations_needed, miss_probability};
/// let n = iterations_needed(0.999_f64, 50, 100, 5);
/// assert!(miss_probability::<f64>(n, 50, 100, 5) <= 0.001);
/// ```
#[must_use]
pub fn miss_probability<T: Real>(iterations: u32, inliers: u32, count: u32, sample_size: u32) -> T {
    let p = probability_of_inlier_sample::<T>(inliers, count, sample_size);
    // By squares: a logarithm and an exponential are no better than its error, and take more code.
    let (mut power, mut miss) = (T::ONE - p, T::ONE);
    for bit in 0..32 {
        if iterations >> bit & 1 == 1 {
            miss *= power;
        }
        power *= power;
    }
    miss
}

/// The smallest share of inliers that `iterations` samples would have caught with `confidence`: a larger one is
/// excluded where no consensus was found. By bisection over the number of inliers.
///
/// # Cost
/// At most 32 evaluations of [`iterations_needed`].
///
/// # Examples
/// ```
/// use epipole::robust::undetected_inlier_ratio;
/// // A thousand samples of five found nothing: it is excluded that 39 % of the 200 correspondences agree.
/// let excluded = undetected_inlier_ratio(0.999_f64, 1000, 200, 5);
/// assert!(excluded > 0.35 && excluded < 0.39);
/// ```
#[must_use]
pub fn undetected_inlier_ratio<T: Real>(confidence: T, iterations: u32, count: u32, sample_size: u32) -> T {
    let (mut low, mut high) = (0u32, count);
    for _ in 0..32 {
        let middle = low + (high - low) / 2;
        if middle == low {
            break;
        }
        if iterations_needed(confidence, middle, count, sample_size) <= iterations {
            high = middle;
        } else {
            low = middle;
        }
    }
    from_u32::<T>(high) / from_u32::<T>(core::cmp::max(count, 1))
}

/// An upper bound of `ln P(B >= k)` for a binomial `B` of `n` trials with success probability `p`; 0 where `k <= n p`.
///
/// The probability of `k` itself is at most `exp(-n D(k/n || p)) sqrt(n / (2 pi k (n - k)))` by Stirling's formula, and
/// the terms beyond fall at least as fast as a geometric series; where that is no better, Hoeffding's inequality
/// `-n D(k/n || p)` stands.
///
/// # Examples
/// ```
/// use epipole::robust::log_binomial_tail;
/// // Ten tosses of a coin: eight heads or more are 56 of the 1024 outcomes.
/// let bound = log_binomial_tail(10, 8, 0.5_f64);
/// assert!(bound >= (56.0_f64 / 1024.0).ln() && bound < -1.6);
/// ```
#[must_use]
pub fn log_binomial_tail<T: Real>(n: u32, k: u32, p: T) -> T {
    if n == 0 || k == 0 || k > n {
        return T::ZERO;
    }
    let total = from_u32::<T>(n);
    let p = max(min(p, T::ONE - T::EPSILON), T::MIN_POSITIVE);
    let q = from_u32::<T>(k) / total;
    if q <= p {
        return T::ZERO;
    }
    let hit = q * ln(q / p);
    let miss = if k < n { (T::ONE - q) * ln((T::ONE - q) / (T::ONE - p)) } else { T::ZERO };
    let bound = -(total * (hit + miss));
    if k >= n {
        return bound;
    }
    let (k, rest) = (from_u32::<T>(k), from_u32::<T>(n - k));
    let ratio = p * rest / ((k + T::ONE) * (T::ONE - p));
    let stirling = ln(total / (lit::<T>(core::f64::consts::TAU) * k * rest)) * T::HALF;
    bound + min(stirling - ln(T::ONE - ratio), T::ZERO)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn iterations_reach_the_confidence() {
        for (inliers, count) in [(50, 100), (20, 100), (100, 2000), (5, 5), (99, 100)] {
            let n = iterations_needed(0.999f64, inliers, count, 5);
            assert!(miss_probability::<f64>(n, inliers, count, 5) <= 0.001 + 1e-12);
            if n > 1 {
                assert!(miss_probability::<f64>(n - 2, inliers, count, 5) > 0.001);
            }
            let single = iterations_needed(0.999f32, inliers, count, 5) as f64;
            assert!((single / n as f64 - 1.0).abs() < 1e-3 || single - n as f64 <= 1.0, "{single} {n}");
        }
        assert_eq!(iterations_needed(0.999f32, 4, 100, 5), u32::MAX);
    }

    #[test]
    fn the_miss_is_as_accurate_as_it_says() {
        for (inliers, count) in [(50, 100), (20, 1000), (99, 100), (999_999, 1_000_000), (30, 100), (7, 7)] {
            for iterations in [0, 1, 2, 3, 7, 100, 12_345, 1_000_000] {
                for size in 1..8 {
                    let single = miss_probability::<f32>(iterations, inliers, count, size) as f64;
                    let double = miss_probability::<f64>(iterations, inliers, count, size);
                    let bound = iterations as f64 * (size + 1) as f64 * f32::EPSILON as f64;
                    assert!(
                        (single - double).abs() <= bound,
                        "{iterations} {inliers} {count} {size}: {single} {double}"
                    );
                }
            }
        }
        assert_eq!(miss_probability::<f32>(1, 7, 7, 7), 0.0);
    }

    #[test]
    fn the_tail_bound_holds() {
        // P(B >= 8) for B(10, 1/2) = 56 / 1024.
        let bound = log_binomial_tail(10, 8, 0.5f64);
        assert!(bound >= (56.0f64 / 1024.0).ln() && bound < (0.2f64).ln());
        assert_eq!(log_binomial_tail(10, 5, 0.5f64), 0.0);
    }

    #[test]
    fn the_excluded_ratio_is_the_least_detected() {
        let ratio: f64 = undetected_inlier_ratio(0.999, 1000, 200, 5);
        let k = (ratio * 200.0).round() as u32;
        assert!(iterations_needed(0.999, k, 200, 5) <= 1000);
        assert!(iterations_needed(0.999, k - 1, 200, 5) > 1000);
    }
}
