//! `bundle_flight [FRAMES [SEEDS]]`: the position error of a sliding window over a synthetic flight with 1 px noise, with
//! the prior, without it, and of full bundle adjustment over all observations so far.
//!
//! `bundle_flight long [FRAMES [SEED]]`: a long flight with a measured distance between neighbouring frames; prints
//! the error and the normalised error squared (NEES over its 6 degrees of freedom, expected 1) along the way.

use epipole::Real;
use epipole_host_tests::Rng;
use epipole_host_tests::bundle::flight::{Flight, centre};
use epipole_host_tests::bundle::odometer::{Odometer, Oldest};

const TRACKS: usize = 60;

/// Position errors at the checkpoints.
fn run<T: Real>(flight: &Flight, capacity: usize, oldest: Oldest, marks: &[usize]) -> Vec<f64> {
    let points = if oldest == Oldest::Keep { flight.landmarks.len() } else { 4 * TRACKS };
    let mut odometer = Odometer::<T>::new(capacity, points, oldest);
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
    let sigma = 0.02;
    let flight = Flight::new(frames, TRACKS, 1.0, seed);
    let mut odometer = Odometer::<T>::new(8, 4 * TRACKS, Oldest::Marginalise);
    odometer.distance_sigma = Some(sigma);
    let mut rng = Rng::new(seed + 1);
    let (mut nees, mut count) = (0.0, 0);
    let mark = (frames / 10).max(1);
    for k in 0..frames {
        let step = if k > 0 { (flight.centre(k) - flight.centre(k - 1)).norm() } else { 1.0 };
        odometer.step(&flight, Some(step + sigma * rng.normal()));
        if k % 25 == 24 {
            let told = odometer.normalised_error(&flight);
            if k + 1 >= frames / 10 {
                nees += told;
                count += 1;
            }
        }
        if (k + 1) % mark == 0 {
            let error = (centre(&odometer.poses[k]) - flight.centre(k)).norm();
            println!(
                "frame {:6}: error {error:9.3} m, mean NEES / 6 so far {:.3}",
                k + 1,
                nees / (6 * count.max(1)) as f64
            );
        }
    }
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
    let mut number = |default: usize| arguments.next().and_then(|a| a.parse().ok()).unwrap_or(default);
    let (frames, seeds, full) = (number(300), number(5), number(1));
    let marks: Vec<usize> = (1..=6).map(|i| frames * i / 6 - 1).collect();
    let (mut prior, mut single, mut forget, mut all) = (vec![], vec![], vec![], vec![]);
    println!("frames {marks:?}: position error, m");
    for seed in 0..seeds as u64 {
        let flight = Flight::new(frames, TRACKS, 1.0, seed);
        let show = |name: &str, errors: &[f64]| {
            let list: Vec<String> = errors.iter().map(|e| format!("{e:8.4}")).collect();
            println!("{seed:3} {name:12} {}", list.join(" "));
        };
        prior.push(run::<f64>(&flight, 8, Oldest::Marginalise, &marks));
        show("prior f64", &prior[prior.len() - 1]);
        single.push(run::<f32>(&flight, 8, Oldest::Marginalise, &marks));
        show("prior f32", &single[single.len() - 1]);
        forget.push(run::<f64>(&flight, 8, Oldest::Forget, &marks));
        show("no prior", &forget[forget.len() - 1]);
        if full > 0 {
            all.push(run::<f64>(&flight, frames, Oldest::Keep, &marks));
            show("full", &all[all.len() - 1]);
        }
    }
    println!(
        "rms: prior f64 {:.4}, prior f32 {:.4}, no prior {:.4}",
        rms(&prior),
        rms(&single),
        rms(&forget)
    );
    if full > 0 {
        println!("full {:.4}: prior is {:.3} times that", rms(&all), rms(&prior) / rms(&all));
    }
}
