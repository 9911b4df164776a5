//! Measures the robust estimators on input that costs most, and checks the bounds of `epipole_firmware::worst_case`: no call may
//! take more than its bound, and a budget turned into samples by the bound must be kept to within 5 %. A search that ends by
//! itself half way may be followed by a second look with what is left (near planes): every input is given to both, and the
//! second look must have been taken. Where most matches are wrong a search is longest: those end by themselves, too, and take
//! no more than the bound of the samples that they drew. Exit code 1 where one is not.
#![no_std]
#![no_main]

use core::cell::Cell;
use core::hint::black_box;

use epipole::estimate::{
    AbsolutePoseOptions, AbsolutePoseStorage, FundamentalOptions, HomographyOptions, RelativePoseOptions,
    TwoViewStorage, absolute_pose, fundamental, homography, relative_pose,
};
use epipole::geometry::Pinhole;
use epipole::nalgebra::{Vector2, Vector3};
use epipole::robust::{RansacOptions, RansacReport, StopReason};
use epipole_firmware::worst_case::{ABSOLUTE_POSE, Bound, FUNDAMENTAL, HOMOGRAPHY, RELATIVE_POSE};
use epipole_firmware::{count, entry, println};
use epipole_problems::two_view::FOCAL;
use epipole_problems::{Geometry, TwoView};

const N: usize = 200;
const SIZES: [usize; 3] = [40, 100, 200];
const SAMPLES: [u32; 2] = [8, 64];
/// Samples at the most of a search that ends by itself.
const LONGEST: u32 = 1024;
/// How names end of inputs with more wrong matches than right ones: few samples are good, and the two poses of a plane, or a pose
/// beside a rotation, stay rivals.
const RIVALS: &str = "with rivals";
/// Budgets, instructions.
const BUDGETS: [u64; 3] = [5_000_000, 20_000_000, 60_000_000];

/// Correspondences that make an estimator work: pixels of two views and the points of the first.
struct Input {
    name: &'static str,
    x1: [Vector2<f32>; N],
    x2: [Vector2<f32>; N],
    points: [Vector3<f32>; N],
}

fn inputs(found: &mut dyn FnMut(&Input)) {
    let elsewhere = TwoView::<N>::new(Geometry::Ransac, 99).pixels()[1];
    for (name, geometry) in [
        ("noise and wrong matches", Geometry::Ransac),
        ("exact", Geometry::General),
        ("exact plane", Geometry::Planar),
        ("noisy plane", Geometry::Planar),
        ("noisy plane with rivals", Geometry::Planar),
        ("near plane", Geometry::Planar),
        ("near plane with rivals", Geometry::Planar),
        ("all wrong", Geometry::Ransac),
        ("turning", Geometry::General),
        ("turning with rivals", Geometry::General),
        ("still with rivals", Geometry::General),
        ("repeated", Geometry::General),
    ] {
        let scene = TwoView::<N>::new(geometry, 3);
        let ([x1, mut x2], points) = (scene.pixels(), scene.points());
        let mut input = Input { name, x1, x2, points };
        match name.trim_end_matches(RIVALS).trim_end() {
            "all wrong" => input.x2 = elsewhere,
            "turning" => {
                let rotation = scene.pose::<f32>().rotation;
                for (x2, point) in x2.iter_mut().zip(&points) {
                    let ray = rotation * point;
                    *x2 = ray.xy() * (FOCAL as f32 / ray.z);
                }
                input.x2 = x2;
            }
            "noisy plane" => [input.x1, input.x2] = scene.spoiled().pixels(),
            "near plane" => {
                // One correspondence in eight lies off the plane, with the same motion.
                for k in (0..N).step_by(8) {
                    let point = scene.points[k] * 1.5;
                    let seen = scene.rotation * point + scene.translation;
                    input.x2[k] = (seen.xy() * (FOCAL / seen.z)).map(|x| x as f32);
                    input.points[k] = point.map(|x| x as f32);
                }
            }
            "still" => input.x2 = input.x1,
            "repeated" => {
                for k in 0..N {
                    (input.x1[k], input.x2[k]) = (input.x1[k % 12], input.x2[k % 12]);
                    input.points[k] = input.points[k % 12];
                }
            }
            _ => {}
        }
        if name.ends_with(RIVALS) {
            for (k, (x2, elsewhere)) in input.x2.iter_mut().zip(&elsewhere).enumerate() {
                if k % 9 < 5 {
                    *x2 = *elsewhere;
                }
            }
        }
        found(&input);
    }
}

/// What a search drew; none of what cannot be searched.
fn samples<E>(report: Result<RansacReport<f32>, E>) -> u32 {
    report.map_or(0, |report| report.spent.iterations)
}

/// Calls with a number of correspondences and a limit of samples; what the search spent, and the cost.
type Call<'a> = &'a mut dyn FnMut(&Input, usize, RansacOptions<f32>) -> (u32, u64);

/// Prints the dearest input of each size, and whether bound and budgets hold.
fn check(name: &str, bound: &Bound, call: Call<'_>) -> bool {
    let mut kept = true;
    // All samples at once, or half of them where the consensus is clear.
    let most_of = |call: Call<'_>, input: &Input, n: usize, samples: u32| {
        let mut options = RansacOptions::<f32>::default();
        options.confidence = 0.999_999;
        options.budget.max_iterations = samples;
        options.min_iterations = samples / 2;
        let halves = call(input, n, options).1;
        options.min_iterations = u32::MAX;
        halves.max(call(input, n, options).1)
    };
    for n in SIZES {
        for samples in SAMPLES {
            let (mut most, mut dearest) = (0, "");
            inputs(&mut |input| {
                let cost = most_of(call, input, n, samples);
                if cost > most {
                    (most, dearest) = (cost, input.name);
                }
            });
            let limit = bound.instructions(n as u64, samples.into());
            kept &= most <= limit;
            println!("{name} | {n} | {samples} | {most} | {limit} | {dearest}");
        }
        for budget in BUDGETS {
            let Some(samples) = bound.max_iterations(budget, n as u64) else { continue };
            let mut most = 0;
            inputs(&mut |input| most = most.max(most_of(call, input, n, samples)));
            kept &= most <= budget + budget / 20;
            println!("{name} | {n} | {samples} | {most} | {budget} | budget");
        }
        inputs(&mut |input| {
            if !input.name.ends_with(RIVALS) {
                return;
            }
            let mut options = RansacOptions::<f32>::default();
            options.budget.max_iterations = LONGEST;
            let (samples, cost) = call(input, n, options);
            let limit = bound.instructions(n as u64, samples.into());
            kept &= cost <= limit;
            println!("{name} | {n} | {samples} | {cost} | {limit} | {}, to its end", input.name);
        });
    }
    kept
}

entry!(main);

fn main() -> i32 {
    count::init();
    println!("estimator | N | samples | instructions at the most | bound | dearest input");
    let focal = FOCAL as f32;
    let Ok(camera) = Pinhole::new(focal, focal, 0.0, 0.0) else { return 2 };
    let mut storage = TwoViewStorage::<f32, N>::new();
    let mut workspace = storage.workspace();
    let looks = Cell::new(0);
    let mut kept = check("relative_pose", &RELATIVE_POSE, &mut |input, n, ransac| {
        let mut options = RelativePoseOptions::default();
        options.ransac = ransac;
        let (x1, x2) = (black_box(&input.x1[..n]), &input.x2[..n]);
        let (report, cost) = count::measure(|| {
            relative_pose(&camera, &camera, x1, x2, &options, &mut workspace).map(|found| found.report)
        });
        // A search that ended by itself, and more samples.
        let more = |report: &RansacReport<f32>| {
            report.stop == StopReason::Confident && report.spent.iterations > ransac.min_iterations
        };
        let cut = ransac.budget.max_iterations != LONGEST;
        looks.set(looks.get() + u32::from(cut && report.as_ref().is_ok_and(more)));
        (samples(report), cost)
    });
    println!("second looks: {}", looks.get());
    kept &= looks.get() > 0;
    kept &= check("homography", &HOMOGRAPHY, &mut |input, n, ransac| {
        let mut options = HomographyOptions::default();
        options.ransac = ransac;
        let (x1, x2) = (black_box(&input.x1[..n]), &input.x2[..n]);
        count::measure(|| samples(homography(x1, x2, &options, &mut workspace).map(|found| found.report)))
    });
    kept &= check("fundamental", &FUNDAMENTAL, &mut |input, n, ransac| {
        let mut options = FundamentalOptions::default();
        options.ransac = ransac;
        let (x1, x2) = (black_box(&input.x1[..n]), &input.x2[..n]);
        count::measure(|| samples(fundamental(x1, x2, &options, &mut workspace).map(|found| found.report)))
    });
    let mut storage = AbsolutePoseStorage::<f32, N>::new();
    let mut workspace = storage.workspace();
    kept &= check("absolute_pose", &ABSOLUTE_POSE, &mut |input, n, ransac| {
        let mut options = AbsolutePoseOptions::default();
        options.ransac = ransac;
        let (x2, points) = (black_box(&input.x2[..n]), &input.points[..n]);
        count::measure(|| {
            samples(absolute_pose(&camera, x2, points, &options, &mut workspace).map(|found| found.report))
        })
    });
    println!(
        "{}",
        if kept { "every bound and every budget kept" } else { "a bound or a budget was not kept" }
    );
    i32::from(!kept)
}
