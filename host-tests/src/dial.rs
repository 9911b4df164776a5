//! How the verdict on two views turns as a scene turns from one kind into another: a dial a scene, a row a position.

use std::fmt::Write;

use epipole::estimate::{RelativePoseOptions, RelativePoseVerdict};
use epipole::geometry::pose::{exp, from_parts};
use epipole::nalgebra::{Vector2, Vector3};

use crate::Rng;
use crate::matchers::pose_error;
use crate::scenes::{CENTRE, FOCAL, SIZE};
use crate::two_view::estimate_pixels;

/// What is turned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dial {
    /// The length of the translation over the mean depth, from a rotation alone on.
    Baseline,
    /// The spread of the points about a plane over its distance.
    PlaneThickness,
    /// The spread of the points about a line in space, over its depth.
    LineThickness,
}

/// Every dial, with its name.
pub const DIALS: [(&str, Dial); 3] = [
    ("baseline_over_depth", Dial::Baseline),
    ("plane_thickness", Dial::PlaneThickness),
    ("line_thickness", Dial::LineThickness),
];

/// The names of a row's counts.
pub const VERDICTS: [&str; 6] =
    ["general", "general_within_5_deg", "planar", "rotation_or_still", "unobservable", "none"];

/// Problems a position.
pub const PROBLEMS: u64 = 20;

impl Dial {
    /// The positions of the table.
    pub fn positions(self) -> [f64; 9] {
        match self {
            Self::Baseline => [0.0, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1],
            Self::PlaneThickness => [0.0, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5],
            Self::LineThickness => [0.0, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1],
        }
    }

    /// How many of the problems at a position end in each of [`VERDICTS`]: 120 points, 0.5 px, one in five wrong.
    pub fn counts(self, position: f64) -> [u32; 6] {
        let mut counts = [0; 6];
        for seed in 0..PROBLEMS {
            let rng = &mut Rng::new(seed + 777);
            let rotation = exp(&(rng.direction() * rng.range(0.02, 0.15)));
            let length = if self == Self::Baseline { 10.0 * position } else { 1.5 };
            let truth = from_parts(&rotation.to_rotation_matrix().into_inner(), &(rng.direction() * length));
            let normal = (rng.normal3() * 0.3 + Vector3::z()).normalize();
            let (mut x1, mut x2) = (Vec::new(), Vec::new());
            while x1.len() < 120 {
                let pixel = Vector2::new(rng.range(0.0, SIZE.0), rng.range(0.0, SIZE.1));
                let ray = Vector3::new((pixel.x - CENTRE.0) / FOCAL, (pixel.y - CENTRE.1) / FOCAL, 1.0);
                let point = match self {
                    Self::Baseline => ray * rng.range(5.0, 15.0),
                    Self::PlaneThickness => ray * (10.0 * (1.0 + position * rng.normal()) / normal.dot(&ray)),
                    Self::LineThickness => {
                        let on_line = Vector3::new(5.0, 0.8, 3.0) * rng.range(-1.0, 1.0);
                        Vector3::new(0.5, 0.2, 10.0) + on_line + rng.normal3() * (10.0 * position)
                    }
                };
                let seen = truth.rotation * point + truth.translation.vector;
                if point.z < 1.0 || seen.z < 1.0 {
                    continue;
                }
                let mut noisy = |v: &Vector3<f64>| {
                    Vector2::new(
                        FOCAL * v.x / v.z + CENTRE.0 + 0.5 * rng.normal(),
                        FOCAL * v.y / v.z + CENTRE.1 + 0.5 * rng.normal(),
                    )
                };
                let (p, q) = (noisy(&point), noisy(&seen));
                x1.push(p);
                let wrong = x1.len() % 5 == 0;
                x2.push(if wrong { Vector2::new(rng.range(0.0, SIZE.0), rng.range(0.0, SIZE.1)) } else { q });
            }
            let (estimate, _) =
                estimate_pixels::<f64>(&x1, &x2, &RelativePoseOptions::default()).expect("well-formed");
            match &estimate.verdict {
                RelativePoseVerdict::General(found) => {
                    counts[0] += 1;
                    let (r, t) = pose_error(&found.pose, &truth);
                    counts[1] += u32::from(r.max(t) < 5f64.to_radians());
                }
                RelativePoseVerdict::Planar(_) => counts[2] += 1,
                RelativePoseVerdict::PureRotation(_) | RelativePoseVerdict::NoMotion => counts[3] += 1,
                RelativePoseVerdict::Unobservable(_) => counts[4] += 1,
                _ => counts[5] += 1,
            }
        }
        counts
    }
}

/// The table of all dials; `done` is told of every row.
pub fn table(mut done: impl FnMut()) -> String {
    let mut table = format!("# dial position, then of {PROBLEMS}: {}\n", VERDICTS.join(" "));
    for (name, dial) in DIALS {
        for position in dial.positions() {
            write!(table, "{name} {position}").expect("memory");
            for count in dial.counts(position) {
                write!(table, " {count}").expect("memory");
            }
            table.push('\n');
            done();
        }
    }
    table
}
