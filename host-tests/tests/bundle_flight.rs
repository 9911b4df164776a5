//! Long flights with a sliding window: consistent to the end, and nearly as accurate as one adjustment of all.

use epipole::Real;
use epipole_host_tests::bundle::flight::{Flight, centre};
use epipole_host_tests::bundle::odometer::{
    Leaving, Odometer, chi_square_bounds, last_normalised_error, measured_flight,
};

/// One flight's errors depend on one another: those of the last frames of independent flights do not.
fn flights_end_consistently<T: Real>() {
    let flights = 40;
    let mean = (0..flights).map(|seed| last_normalised_error::<T>(60, 40, 500 + seed)).sum::<f64>()
        / (6 * flights) as f64;
    let [_, high] = chi_square_bounds(6 * flights as usize);
    // Never too sure. Below 1 by design: what a leaving frame says of a point that lives on is compared with the
    // observations that stay, and counts for less than it would with those that come (0.88 over 100 flights).
    assert!(mean > 0.7 && mean < high, "mean normalised error squared {mean}, at most {high}");
}

#[test]
fn flights_end_consistently_f64() {
    flights_end_consistently::<f64>();
}

#[test]
fn flights_end_consistently_f32() {
    flights_end_consistently::<f32>();
}

fn a_long_flight_stays_consistent<T: Real>() {
    let (mut sum, mut count) = (0.0, 0);
    let (odometer, flight) = measured_flight::<T>(300, 40, 11, |odometer, flight, k| {
        if k % 10 == 9 {
            sum += odometer.normalised_error(flight) / 6.0;
            count += 1;
        }
    });
    let error = (centre(&odometer.poses[299]) - flight.centre(299)).norm();
    let mean = sum / f64::from(count);
    assert!(error < 5.0, "error {error} m after 300 m");
    assert!(mean > 0.2 && mean < 2.5, "mean normalised error squared {mean}");
}

#[test]
fn a_long_flight_stays_consistent_f64() {
    a_long_flight_stays_consistent::<f64>();
}

#[test]
fn a_long_flight_stays_consistent_f32() {
    a_long_flight_stays_consistent::<f32>();
}

#[test]
fn the_prior_keeps_nearly_what_full_adjustment_knows() {
    let (mut prior, mut full) = (0.0, 0.0);
    for seed in 0..4 {
        let flight = Flight::new(40, 40, 1.0, 100 + seed);
        let mut sliding = Odometer::<f64>::new(8, 160, Leaving::Oldest);
        let mut all = Odometer::<f64>::new(40, flight.landmarks.len(), Leaving::Keep);
        for k in 0..40 {
            sliding.step(&flight, None);
            all.step(&flight, None);
            if k >= 10 {
                let error = |o: &Odometer<f64>| (centre(&o.poses[k]) - flight.centre(k)).norm_squared();
                prior += error(&sliding);
                full += error(&all);
            }
        }
    }
    let ratio = (prior / full).sqrt();
    assert!(ratio < 1.5, "{ratio} times the error of full bundle adjustment");
}
