//! `bundle_flight [FRAMES [SEEDS [FULL [FIRST]]]]`: the position error of a sliding window over a synthetic flight with 1 px noise, with
//! the prior (the oldest frame leaving, or by turns one from the middle), without it, and of full bundle adjustment over all observations so far (0 for FULL leaves that out), for
//! SEEDS flights from seed FIRST on.
//!
//! `bundle_flight long [FRAMES [SEED]]`: a long flight with a measured distance between neighbouring frames; prints
//! the error and the normalised error squared (NEES over its 6 degrees of freedom, expected 1) along the way.
//!
//! `bundle_flight consistency [RUNS [FRAMES [FIRST]]]`: that many such flights, and the mean of their last frames' NEES,
//! which are independent, with the bounds for it.

use std::slice::from_ref;

use epipole::Real;
use epipole_host_tests::bundle::flight::{Flight, centre};
use epipole_host_tests::bundle::odometer::{
    Leaving, Odometer, chi_square_bounds, last_normalised_error, measured_flight,
};

const TRACKS: usize = 60;

/// Position errors at the checkpoints.
fn run<T: Real>(flight: &Flight, capacity: usize, leaving: Leaving, marks: &[usize]) -> Vec<f64> {
    let points = if leaving == Leaving::Keep { flight.landmarks.len() } else { 4 * TRACKS };
    let mut odometer = Odometer::<T>::new(capacity, points, leaving);
    if leaving == Leaving::Keep {
        // The minimum is that of all observations, however often it is looked for: the checkpoints are multiples of 10.
        odometer.optimise_every = 10;
    }
    let mut errors = vec![];
    for k in 0..flight.poses.len() {
        odometer.step(flight, None);
        if marks.contains(&k) {
            errors.push((centre(&odometer.poses[k]) - flight.centre(k)).norm());
        }
    }
    errors
}

fn rms(rows: &[Vec<f64>]) -> f64 {
    let all = rows.iter().flatten();
    (all.clone().map(|e| e * e).sum::<f64>() / all.count() as f64).sqrt()
}

fn long<T: Real>(frames: usize, seed: u64) {
    let mark = (frames / 10).max(1);
    let (mut nees, mut count) = (0.0, 0);
    measured_flight::<T>(frames, TRACKS, seed, |odometer, flight, k| {
        if k % 25 == 24 && k + 1 >= frames / 10 {
            nees += odometer.normalised_error(flight);
            count += 1;
        }
        if (k + 1) % mark == 0 {
            let error = (centre(&odometer.poses[k]) - flight.centre(k)).norm();
            println!(
                "frame {:6}: error {error:9.3} m, mean NEES / 6 so far {:.3}",
                k + 1,
                nees / (6 * count.max(1)) as f64
            );
        }
    });
}

/// Independent flights: of each the error of its last frame, normalised; the mean ought to lie between the 95 % bounds
/// of the chi-square distribution.
fn consistency<T: Real>(runs: usize, frames: usize, first: u64) {
    let mut told: Vec<f64> =
        (0..runs as u64).map(|run| last_normalised_error::<T>(frames, TRACKS, first + run)).collect();
    let mean = told.iter().sum::<f64>() / (6 * runs) as f64;
    let [low, high] = chi_square_bounds(6 * runs);
    told.sort_by(f64::total_cmp);
    let above = told.iter().filter(|&&e| e > 12.592).count();
    println!(
        "{runs} flights of {frames} frames: mean NEES / 6 {mean:.3}, 95 % bounds {low:.3} to {high:.3}; {:.1} % above the \
         95 % quantile, worst {:.2}",
        100.0 * above as f64 / runs as f64,
        told[runs - 1] / 6.0
    );
}

fn main() {
    let mut arguments = std::env::args().skip(1).peekable();
    if arguments.next_if(|a| a == "long").is_some() {
        let mut number = |default: usize| arguments.next().and_then(|a| a.parse().ok()).unwrap_or(default);
        let (frames, seed) = (number(10_000), number(0) as u64);
        println!("f64");
        long::<f64>(frames, seed);
        println!("f32");
        long::<f32>(frames, seed);
        return;
    }
    if arguments.next_if(|a| a == "consistency").is_some() {
        let mut number = |default: usize| arguments.next().and_then(|a| a.parse().ok()).unwrap_or(default);
        let (runs, frames, first) = (number(100), number(300), number(0) as u64);
        print!("f64: ");
        consistency::<f64>(runs, frames, first);
        print!("f32: ");
        consistency::<f32>(runs, frames, first);
        return;
    }
    let mut number = |default: usize| arguments.next().and_then(|a| a.parse().ok()).unwrap_or(default);
    let (frames, seeds, full, first) = (number(300), number(5), number(1), number(0));
    let marks: Vec<usize> = (1..=6).map(|i| frames * i / 6 - 1).collect();
    let (mut prior, mut single, mut turns, mut forget, mut all) = (vec![], vec![], vec![], vec![], vec![]);
    println!("frames {marks:?}: position error, m");
    for seed in (first..first + seeds).map(|seed| seed as u64) {
        let flight = Flight::new(frames, TRACKS, 1.0, seed);
        let show = |name: &str, errors: &[f64]| {
            let list: Vec<String> = errors.iter().map(|e| format!("{e:8.4}")).collect();
            println!("{seed:3} {name:12} {}", list.join(" "));
        };
        prior.push(run::<f64>(&flight, 8, Leaving::Oldest, &marks));
        show("prior f64", &prior[prior.len() - 1]);
        single.push(run::<f32>(&flight, 8, Leaving::Oldest, &marks));
        show("prior f32", &single[single.len() - 1]);
        turns.push(run::<f64>(&flight, 8, Leaving::Alternate, &marks));
        show("by turns f64", &turns[turns.len() - 1]);
        forget.push(run::<f64>(&flight, 8, Leaving::Forget, &marks));
        show("no prior", &forget[forget.len() - 1]);
        if full > 0 {
            all.push(run::<f64>(&flight, frames, Leaving::Keep, &marks));
            show("full", &all[all.len() - 1]);
        }
    }
    println!(
        "rms: prior f64 {:.4}, prior f32 {:.4}, frames leaving by turns {:.4}, no prior {:.4}",
        rms(&prior),
        rms(&single),
        rms(&turns),
        rms(&forget)
    );
    if full > 0 {
        let ratio = |a: &[Vec<f64>], b: &[Vec<f64>]| rms(a) / rms(b);
        for (name, rows) in [("oldest frame leaves", &prior), ("by turns", &turns)] {
            let worst =
                rows.iter().zip(&all).fold(0.0, |w: f64, (a, b)| w.max(ratio(from_ref(a), from_ref(b))));
            println!(
                "{name}: {:.3} times full ({:.4}), at worst {worst:.3} times in a flight",
                ratio(rows, &all),
                rms(&all)
            );
        }
    }
}
