//! Running a test on many seeded cases.

use crate::Rng;

/// Prints how to run a case alone if the case panics.
struct Reporter(u64);

impl Drop for Reporter {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("case failed; EPIPOLE_SEED={} runs it alone", self.0);
        }
    }
}

/// The seeds of a test: 0..count, or the one that `EPIPOLE_SEED` names.
fn seeds(count: u64) -> std::ops::Range<u64> {
    match std::env::var("EPIPOLE_SEED") {
        Ok(text) => {
            let seed = text.parse().expect("EPIPOLE_SEED is a number");
            seed..seed + 1
        }
        Err(_) => 0..count,
    }
}

/// Runs `case` on `count` seeds, each with the random stream of its seed.
pub fn for_each_case(count: u64, mut case: impl FnMut(u64, &mut Rng)) {
    for seed in seeds(count) {
        let _reporter = Reporter(seed);
        case(seed, &mut Rng::new(seed));
    }
}

/// On how many of `count` seeds `case` is true.
pub fn share_of(count: u64, mut case: impl FnMut(u64, &mut Rng) -> bool) -> Share {
    let mut share = Share { count: 0, failed: Vec::new() };
    for_each_case(count, |seed, rng| {
        share.count += 1;
        if !case(seed, rng) {
            share.failed.push(seed);
        }
    });
    share
}

/// How often a statistical test succeeded.
#[derive(Clone, Debug)]
#[must_use]
pub struct Share {
    /// Cases run.
    pub count: usize,
    /// Seeds of the cases that failed.
    pub failed: Vec<u64>,
}

impl Share {
    /// The share that succeeded, in 0..=1.
    pub fn value(&self) -> f64 {
        1.0 - self.failed.len() as f64 / self.count as f64
    }

    /// Panics, naming failed seeds, where less than `wanted` of the cases succeeded.
    #[track_caller]
    pub fn assert_at_least(&self, wanted: f64) {
        let shown = &self.failed[..self.failed.len().min(10)];
        assert!(
            self.value() >= wanted,
            "{:.3} % of {} cases succeeded, {:.3} % wanted; failed seeds: {shown:?}",
            100.0 * self.value(),
            self.count,
            100.0 * wanted
        );
    }
}

/// Makes one test in `f32` and one in `f64` of each generic function.
///
/// ```
/// epipole_host_tests::in_both_scalars! {
///     fn one_is_one<T>() {
///         assert_eq!(T::ONE * T::ONE, T::ONE);
///     }
/// }
/// ```
#[macro_export]
macro_rules! in_both_scalars {
    ($($(#[$doc:meta])* fn $name:ident<$T:ident>() $body:block)*) => {$(
        $(#[$doc])*
        mod $name {
            #[allow(unused_imports)]
            use super::*;

            fn generic<$T: ::epipole::Real>() $body

            #[test]
            fn f32() {
                generic::<f32>();
            }

            #[test]
            fn f64() {
                generic::<f64>();
            }
        }
    )*};
}
