//! Counter-based random samples: the sample of an iteration is a function of the seed and the iteration alone.

use crate::Real;
use crate::real::{from_u32, lit};

/// An odd constant near 2^64 / golden ratio: steps of it visit all 64-bit numbers evenly.
const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

/// A word of the sequence of a key: a bijection of 64-bit words in which every input bit reaches every output bit
/// (SplitMix64).
#[cfg_attr(not(small), inline)]
#[cfg_attr(small, inline(never))]
const fn mix(key: u64, number: u32) -> u64 {
    let mut z = key.wrapping_add((number as u64).wrapping_mul(STEP));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Draws minimal samples without replacement, uniformly or, where the correspondences are ranked, best first.
///
/// Ranked sampling follows PROSAC's growth function: iteration by iteration the pool grows from the best few
/// correspondences to all of them, and a sample always holds the newest of the pool.
///
/// # References
/// G. Steele, D. Lea, C. Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014 (the mixing function).
/// O. Chum, J. Matas, "Matching with PROSAC: progressive sample consensus", CVPR 2005 (the growth function).
///
/// # Examples
/// ```
/// use epipole::robust::Sampler;
/// let mut sampler = Sampler::<f32>::uniform(7, 100);
/// let first: [u32; 5] = sampler.sample(0).unwrap();
/// let again: [u32; 5] = Sampler::<f32>::uniform(7, 100).sample(0).unwrap();
/// assert_eq!(first, again);
/// assert!(first.iter().all(|&i| i < 100));
/// ```
#[derive(Clone, Debug)]
pub struct Sampler<T> {
    /// Low and high half: on a core of 32 bits nothing of a search is then aligned to more.
    seed: [u32; 2],
    count: u32,
    growth: Option<Growth<T>>,
}

/// State of PROSAC's growth: the pool holds the best `pool` correspondences until iteration `until`.
#[derive(Clone, Debug)]
struct Growth<T> {
    pool: u32,
    samples: T,
    until: T,
}

/// A gathered sample is one correspondence and the nearest of so many others, at most of one in so many.
const OTHERS: u32 = 16;
const OTHERS_ONE_IN: u32 = 4;
/// After so many samples ranked sampling has become uniform sampling (`T_N` of Chum and Matas).
const GROWTH_SAMPLES: f64 = 200_000.0;

impl<T: Real> Sampler<T> {
    /// Samples of `count` correspondences, all alike.
    #[must_use]
    pub fn uniform(seed: u64, count: u32) -> Self {
        let seed = mix(seed, 1);
        Self { seed: [seed as u32, (seed >> 32) as u32], count, growth: None }
    }

    /// Samples of `count` correspondences in the order of their rank, in sets of `sample_size`.
    #[must_use]
    pub fn ranked(seed: u64, count: u32, sample_size: u32) -> Self {
        let mut samples = lit::<T>(GROWTH_SAMPLES);
        for i in 0..smallest([sample_size, count, 16]) {
            samples *= from_u32::<T>(sample_size - i) / from_u32::<T>(count - i);
        }
        let growth = (count > sample_size).then_some(Growth { pool: sample_size, samples, until: T::ONE });
        Self { growth, ..Self::uniform(seed, count) }
    }

    /// The sample of an iteration: `S` distinct numbers below `count`, none where `count < S` or the sampler was
    /// ranked for smaller samples.
    ///
    /// Iterations must be asked for in order where the sampler is ranked.
    ///
    /// # Cost
    /// S steps of at most S comparisons each, one mixing of 64 bits a step.
    ///
    /// # References
    /// O. Chum, J. Matas, "Matching with PROSAC", CVPR 2005 (the growing pool of a ranked sampler).
    ///
    /// # Examples
    /// ```
    /// use epipole::robust::Sampler;
    /// let mut sampler = Sampler::<f32>::uniform(1, 100);
    /// let sample = sampler.sample::<5>(7).unwrap();
    /// assert!(sample.windows(2).all(|pair| pair[0] < pair[1]) && sample[4] < 100);
    /// // Counter-based: a sample depends on the seed and its number alone.
    /// assert_eq!(Sampler::<f32>::uniform(1, 100).sample(7), Some(sample));
    /// ```
    #[inline]
    #[must_use]
    pub fn sample<const S: usize>(&mut self, iteration: u32) -> Option<[u32; S]> {
        let mut sample = [0; S];
        self.draw(iteration, true, &mut sample).then_some(sample)
    }

    /// [`sample`](Self::sample) of any size, of all numbers alike unless `ranked`: false where there is none.
    #[inline]
    pub(super) fn draw(&mut self, iteration: u32, ranked: bool, chosen: &mut [u32]) -> bool {
        let size = chosen.len();
        if (self.count as u64) < size as u64 || size == 0 {
            return false;
        }
        let (mut pool, mut newest) = (self.count, None);
        if ranked && let Some(growth) = &mut self.growth {
            // A sampler ranked for smaller samples has too small a pool for these.
            if (growth.pool as u64) < size as u64 {
                return false;
            }
            growth.grow(iteration, size, self.count);
            if growth.pool < self.count {
                pool = growth.pool - 1;
                newest = Some(pool);
            }
        }
        let seed = (self.seed[1] as u64) << 32 | self.seed[0] as u64;
        choose(mix(seed, iteration), pool, newest, chosen);
        true
    }

    /// In place of a sample one of its members and those nearest to that of some others; it stays as it is where `apart` tells
    /// no distances, or where there are too few to choose from.
    pub(super) fn gather<const S: usize>(
        &self,
        iteration: u32,
        sample: &mut [u32; S],
        apart: impl Fn(u32, u32) -> Option<T>,
    ) {
        let seed = (self.seed[1] as u64) << 32 | self.seed[0] as u64;
        // Not the words that `choose` takes.
        let key = mix(!seed, iteration);
        let below = |count: u32, k: u32| (((mix(key, k) >> 32) * count as u64) >> 32) as u32;
        let Some(&first) = sample.get(below(S as u32, 0) as usize) else { return };
        let mut nearest = [(T::MAX, first); S];
        for k in 1..=core::cmp::min(self.count / OTHERS_ONE_IN, OTHERS) {
            let other = below(self.count, k);
            if nearest.iter().any(|&(_, taken)| taken == other) {
                continue;
            }
            let Some(distance) = apart(first, other) else { return };
            let mut entry = (distance, other);
            for near in nearest.iter_mut().skip(1) {
                if entry.0 < near.0 {
                    core::mem::swap(near, &mut entry);
                }
            }
        }
        if nearest.iter().skip(1).all(|near| near.0 < T::MAX) {
            *sample = nearest.map(|near| near.1);
        }
    }
}

impl<T: Real> Growth<T> {
    /// The pool grows by one where its share of samples is used up; one step an iteration bounds the work, and only the
    /// first few shares are smaller than one sample.
    fn grow(&mut self, iteration: u32, size: usize, count: u32) {
        if from_u32::<T>(iteration) >= self.until && self.pool < count {
            let grown = self.samples * from_u32::<T>(self.pool + 1)
                / from_u32::<T>(self.pool + 1 - core::cmp::min(size as u32, self.pool));
            self.until += crate::real::max(grown - self.samples, T::ONE);
            self.samples = grown;
            self.pool += 1;
        }
    }
}

/// Distinct numbers below `pool` in rising order, `newest` among them if there is one.
#[cfg_attr(small, inline(never))]
fn choose(key: u64, pool: u32, newest: Option<u32>, chosen: &mut [u32]) {
    let draws = chosen.len() - newest.is_some() as usize;
    for k in 0..draws as u32 {
        let word = mix(key, k + 1);
        // A number among those not chosen yet: walk up past the chosen ones, which are in rising order.
        let mut value = (((word >> 32) * (pool - k) as u64) >> 32) as u32;
        for &taken in chosen.iter().take(k as usize) {
            if taken <= value {
                value += 1;
            }
        }
        insert(chosen, k as usize, value);
    }
    if let Some(newest) = newest {
        insert(chosen, draws, newest);
    }
}

fn smallest<const N: usize>(numbers: [u32; N]) -> u32 {
    numbers.into_iter().fold(u32::MAX, core::cmp::min)
}

/// Puts `value` into a rising list of `count` entries.
#[inline]
fn insert(rising: &mut [u32], count: usize, mut value: u32) {
    for entry in rising.iter_mut().take(count) {
        if value < *entry {
            core::mem::swap(entry, &mut value);
        }
    }
    if let Some(entry) = rising.get_mut(count) {
        *entry = value;
    }
}

#[cfg(test)]
mod tests {
    use super::Sampler;

    #[test]
    fn samples_are_distinct_and_even() {
        let mut sampler = Sampler::<f32>::uniform(1, 9);
        let mut seen = [0u32; 9];
        for i in 0..9000 {
            let sample: [u32; 5] = sampler.sample(i).unwrap();
            assert!(sample.windows(2).all(|w| w[0] < w[1]));
            for &k in &sample {
                seen[k as usize] += 1;
            }
        }
        // 5000 expected of each, with a deviation of about 47.
        assert!(seen.iter().all(|&n| (4750..5250).contains(&n)), "{seen:?}");
    }

    #[test]
    fn ranked_samples_grow_from_the_best() {
        let mut sampler = Sampler::<f64>::ranked(1, 200, 5);
        let mut largest = 0;
        for i in 0..200_000 {
            let sample: [u32; 5] = sampler.sample(i).unwrap();
            assert!(sample.windows(2).all(|w| w[0] < w[1]) && sample[4] < 200);
            if i == 0 {
                assert_eq!(sample, [0, 1, 2, 3, 4]);
            }
            if i < 50 {
                assert!(sample[4] < 56);
            }
            largest = largest.max(sample[4]);
        }
        assert_eq!(largest, 199);
    }

    #[test]
    fn gathered_samples_are_of_near_numbers() {
        let mut sampler = Sampler::<f32>::uniform(1, 1000);
        let (mut drawn, mut gathered) = (0, 0);
        for i in 0..1000 {
            let uniform: [u32; 5] = sampler.sample(i).unwrap();
            let mut sample = uniform;
            sampler.gather(i, &mut sample, |a, b| Some(a.abs_diff(b) as f32));
            sample.sort_unstable();
            assert!(sample.windows(2).all(|w| w[0] < w[1]) && sample[4] < 1000);
            assert!(uniform.iter().any(|k| sample.contains(k)));
            drawn += uniform[4] - uniform[0];
            gathered += sample[4] - sample[0];
            let mut same = uniform;
            sampler.gather(i, &mut same, |_, _| None);
            assert_eq!(same, uniform);
        }
        // The widths of five of a thousand and of the nearest four of sixteen.
        assert!((640_000..690_000).contains(&drawn) && gathered < drawn / 2, "{drawn} {gathered}");
    }

    #[test]
    fn the_whole_set_and_less_than_a_sample() {
        assert_eq!(Sampler::<f64>::uniform(3, 4).sample::<4>(8), Some([0, 1, 2, 3]));
        assert_eq!(Sampler::<f64>::uniform(3, 3).sample::<4>(8), None);
        assert_eq!(Sampler::<f64>::ranked(3, 4, 4).sample::<4>(8), Some([0, 1, 2, 3]));
    }
}
