//! Arbitrary bytes through the public functions of `epipole`, one group a target, and through the firmware's wire format: nothing panics, and what is promised
//! finite is finite whatever the input's bits.
//!
//! Long runs, from the project's root (`cargo install cargo-fuzz`; `--sanitizer none` also runs on a stable compiler,
//! and the kernel holds no unsafe code for the address sanitizer to watch):
//!
//! ```text
//! cargo fuzz run --features libfuzzer --sanitizer none solvers -- -max_total_time=600 -max_len=2048
//! ```

pub mod capi;
pub mod wire;

use epipole_exercise::{CAPABILITIES, Sink, Source};

/// Runs one capability of a group, chosen by the first byte, on the other bytes. Panics where a promise is broken.
pub fn run(group: &str, data: &[u8]) {
    let Some((&choice, data)) = data.split_first() else { return };
    let in_group = CAPABILITIES.iter().filter(|capability| capability.name.split("::").next() == Some(group));
    let count = in_group.clone().count();
    assert!(count > 0, "no capability in {group}");
    let double = choice & 1 == 1;
    let Some(capability) = in_group.clone().nth(usize::from(choice >> 1) % count) else { return };
    let mut sink = Sink::default();
    (if double { capability.f64 } else { capability.f32 })(&mut Source::new(data), &mut sink);
    assert!(sink.promises_kept(), "{}: a result that is promised finite is not", capability.name);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fixed inputs, the same on every machine: what a short fuzzing run does, without its chance.
    const INPUTS: u64 = 20_000;

    #[test]
    fn fixed_inputs_break_no_promise() {
        let mut broken = Vec::new();
        for capability in CAPABILITIES {
            for (scalar, call) in [("f32", capability.f32), ("f64", capability.f64)] {
                let seeds: Vec<u64> = (0..INPUTS)
                    .filter(|&seed| {
                        let mut sink = Sink::default();
                        call(&mut Source::seeded(seed), &mut sink);
                        !sink.promises_kept()
                    })
                    .collect();
                if let Some(first) = seeds.first() {
                    broken.push(format!(
                        "{} {scalar}: {} inputs, seed {first} first",
                        capability.name,
                        seeds.len()
                    ));
                }
            }
        }
        assert!(broken.is_empty(), "a result that is promised finite is not:\n{}", broken.join("\n"));
    }

    #[test]
    fn the_same_input_gives_the_same_bits() {
        for capability in CAPABILITIES {
            for seed in 0..100 {
                let hash = |call: fn(&mut Source<'_>, &mut Sink)| {
                    let mut sink = Sink::default();
                    call(&mut Source::seeded(seed), &mut sink);
                    sink.hash()
                };
                assert_eq!(
                    hash(capability.f32),
                    hash(capability.f32),
                    "{} f32, seed {seed}",
                    capability.name
                );
                assert_eq!(
                    hash(capability.f64),
                    hash(capability.f64),
                    "{} f64, seed {seed}",
                    capability.name
                );
            }
        }
    }

    /// The check bites: a number that is not finite breaks a promise of finiteness, and only that.
    #[test]
    fn broken_promises_are_seen() {
        let mut sink = Sink::default();
        sink.number(f32::NAN);
        assert!(sink.promises_kept());
        sink.finite(&[f64::INFINITY]);
        assert!(!sink.promises_kept());
    }

    #[test]
    fn every_group_runs_on_any_bytes() {
        for group in ["linalg", "geometry", "solvers", "robust", "bundle", "estimate"] {
            run(group, &[]);
            for choice in 0..=255 {
                run(group, &[choice]);
                run(group, &[choice, 0, 255, 255, 255, 255]);
            }
        }
    }
}
