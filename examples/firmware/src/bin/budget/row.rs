//! One line of the table.

use core::cell::UnsafeCell;
use core::ops::Range;

use epipole_firmware::{count, println, stack};

/// Problems of a set at the most, as the image was built: 256 suffice for the mean and the stack, all are for the worst.
pub const PROBLEMS: u32 = match option_env!("PROBLEMS") {
    Some(number) => match u32::from_str_radix(number, 10) {
        Ok(number) => number,
        Err(_) => panic!("PROBLEMS is no number"),
    },
    None => 4096,
};
/// Problems of one line at the most.
const MOST: usize = if cfg!(target_arch = "arm") && cfg!(small_ram) { 256 } else { 4096 };
/// Bytes of stack looked at.
const STACK: usize = if cfg!(small_ram) { 9 << 10 } else { 64 << 10 };

/// Costs and errors of the problems of the line that is being measured.
struct Samples(UnsafeCell<([u32; MOST], [f32; MOST])>);
// SAFETY: images have one thread, and interrupt handlers do not come here.
unsafe impl Sync for Samples {}
static SAMPLES: Samples = Samples(UnsafeCell::new(([0; MOST], [0.0; MOST])));

/// One problem.
pub struct Trial {
    /// How far the answer is from the truth; infinity where there was no answer.
    error: f64,
    cost: u64,
    stack: usize,
}

/// Prints the memory that an entry point is lent, as the type that holds it.
pub fn workspace<S>(name: &str) {
    println!("workspace | {name} | {}", size_of::<S>());
}

/// Calls and counts, and calls again to look at the stack, without interrupts; `error` judges the answer.
#[inline(always)]
pub fn trial<R>(mut call: impl FnMut() -> R, error: impl FnOnce(&R) -> f64) -> Trial {
    let (answer, cost) = count::measure(&mut call);
    let (_, stack) = stack::high_water(STACK, call);
    Trial { error: error(&answer), cost, stack }
}

/// Measures the problems, and prints the line: the entry point, the set of problems, and what they cost. A problem is solved where its error is below `limit`.
#[inline(never)]
pub fn row(name: &str, set: &str, problems: Range<u32>, limit: f64, mut run: impl FnMut(u32) -> Trial) {
    // SAFETY: the only reference, for the time of this function.
    let (costs, errors) = unsafe { &mut *SAMPLES.0.get() };
    let (mut used, mut sum, mut solved, mut none, mut stack) = (0usize, 0u64, 0u32, 0u32, 0);
    for k in problems {
        let trial = run(k);
        let (Some(cost), Some(error)) = (costs.get_mut(used), errors.get_mut(used)) else { break };
        (*cost, *error) = (trial.cost as u32, trial.error as f32);
        used += 1;
        sum += trial.cost;
        solved += u32::from(trial.error < limit);
        none += u32::from(trial.error == f64::INFINITY);
        stack = core::cmp::max(stack, trial.stack);
    }
    let costs = &mut costs[..used];
    let errors = &mut errors[..used];
    costs.sort_unstable();
    errors.sort_unstable_by(f32::total_cmp);
    println!(
        "{name} | {set} | {} | {} | {} | {:.2} | {none} | {:.2e} | {stack}",
        (sum + used as u64 / 2) / used as u64,
        costs[(used * 99).div_ceil(100) - 1],
        costs[used - 1],
        f64::from(solved) * 100.0 / used as f64,
        errors[used / 2],
    );
}
