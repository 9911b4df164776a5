//! Curves: the cumulative error, the risk beside the coverage, the area under the curve beside the time.

use std::collections::BTreeMap;
use std::error::Error;
use std::ops::Range;
use std::path::{Path, PathBuf};

use plotters::prelude::*;

use crate::file::Problem;
use crate::report::{Timed, scale, scene};
use crate::score::{Outcome, risk_coverage};

type Curve = (String, Vec<(f64, f64)>);

struct Axes {
    caption: &'static str,
    x: String,
    y: String,
    x_range: Range<f64>,
    y_range: Range<f64>,
    x_label: fn(&f64) -> String,
    legend: SeriesLabelPosition,
}

/// Draws the curves; the last one thick and black.
fn draw(path: &Path, axes: Axes, curves: &[Curve]) -> Result<(), Box<dyn Error>> {
    let root = SVGBackend::new(path, (900, 600)).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .margin(16)
        .caption(axes.caption, ("sans-serif", 24))
        .x_label_area_size(48)
        .y_label_area_size(56)
        .build_cartesian_2d(axes.x_range, axes.y_range)?;
    chart
        .configure_mesh()
        .x_desc(axes.x)
        .y_desc(axes.y)
        .max_light_lines(1)
        .x_label_formatter(&axes.x_label)
        .y_label_formatter(&f64::to_string)
        .draw()?;
    for (index, (name, points)) in curves.iter().enumerate() {
        let last = index + 1 == curves.len();
        let colour = if last { BLACK.to_rgba() } else { Palette99::pick(index).to_rgba() };
        let style = colour.stroke_width(if last { 3 } else { 2 });
        chart
            .draw_series(LineSeries::new(points.iter().copied(), style))?
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], style));
    }
    chart
        .configure_series_labels()
        .position(axes.legend)
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.3))
        .draw()?;
    root.present()?;
    Ok(())
}

/// The cost of bundle adjustment by iteration, as the logarithm of its share of the first.
pub(crate) fn falling_cost(path: &Path, curves: Vec<Curve>) -> Result<(), Box<dyn Error>> {
    let points = || curves.iter().flat_map(|c| &c.1);
    let last = points().fold(1.0f64, |m, p| m.max(p.0));
    let lowest = points().fold(-0.1f64, |m, p| m.min(p.1));
    let axes = Axes {
        caption: "Cost of bundle adjustment",
        x: "iteration".into(),
        y: "log10 of the cost's share of the first".into(),
        x_range: 0.0..last,
        y_range: 1.1 * lowest..0.05,
        x_label: |x| format!("{x:.0}"),
        legend: SeriesLabelPosition::UpperRight,
    };
    draw(path, axes, &curves)
}

/// The cumulative error of each scene and of all files.
pub(crate) fn cumulative_error(
    path: &Path,
    problem: Problem,
    outcomes: &[(PathBuf, Outcome)],
) -> Result<(), Box<dyn Error>> {
    let scale = scale(problem);
    let limit = scale.thresholds[2];
    let mut scenes = BTreeMap::<String, Vec<f64>>::new();
    for (file, outcome) in outcomes {
        scenes.entry(scene(file)).or_default().push(outcome.worst());
    }
    let all = outcomes.iter().map(|(_, o)| o.worst()).collect();
    let named = scenes.into_iter().chain([("all files".into(), all)]);
    let curves: Vec<Curve> =
        named.map(|(name, errors)| (format!("{name} ({})", errors.len()), steps(&errors, limit))).collect();
    let x = match problem {
        Problem::Homography => format!("mean transfer error ({})", scale.unit),
        Problem::AbsolutePose => format!("larger error of rotation and position ({})", scale.unit),
        _ => format!("larger error of rotation and direction of translation ({})", scale.unit),
    };
    let axes = Axes {
        caption: "Cumulative error",
        x,
        y: "files with a smaller error (%)".into(),
        x_range: 0.0..limit,
        y_range: 0.0..100.0,
        x_label: f64::to_string,
        legend: SeriesLabelPosition::LowerRight,
    };
    draw(path, axes, &curves)
}

/// The share of failures among the answers trusted most: by covariance, verdict and share
/// of inliers, and by the last alone, which is all that most libraries tell.
pub(crate) fn risk(
    path: &Path,
    problem: Problem,
    outcomes: &[(PathBuf, Outcome)],
) -> Result<(), Box<dyn Error>> {
    let scale = scale(problem);
    let curve = |doubt: fn(&Outcome) -> f64| {
        let ranked: Vec<_> = outcomes.iter().map(|(_, o)| (doubt(o), o.worst())).collect();
        risk_coverage(&ranked, scale.fail)
    };
    let curves = [
        ("by the share of inliers".into(), curve(Outcome::outlier_share)),
        ("by covariance, verdict and inliers".into(), curve(|o| o.doubt)),
    ];
    let top = curves.iter().flat_map(|(_, points)| points).fold(1.0, |top: f64, point| top.max(point.1));
    let axes = Axes {
        caption: "Risk and coverage",
        x: "answers kept, those trusted most first (%)".into(),
        y: format!("of these, error above {} {} (%)", scale.fail, scale.unit),
        x_range: 0.0..100.0,
        y_range: 0.0..1.1 * top,
        x_label: f64::to_string,
        legend: SeriesLabelPosition::UpperLeft,
    };
    draw(path, axes, &curves)
}

/// The areas under the cumulative error curve beside the mean time that runs with a time budget took.
pub(crate) fn area_by_time(path: &Path, problem: Problem, timed: &[Timed]) -> Result<(), Box<dyn Error>> {
    let scale = scale(problem);
    let curves: Vec<Curve> = (0..3)
        .rev()
        .map(|k| {
            let points = timed.iter().map(|t| (t.milliseconds.log10(), t.aucs[k])).collect();
            (format!("AUC@{} {}", scale.thresholds[k], scale.unit), points)
        })
        .collect();
    let x = |t: Option<&Timed>| t.map_or(0.0, |t| t.milliseconds.log10());
    let fastest = timed.iter().min_by(|a, b| a.milliseconds.total_cmp(&b.milliseconds));
    let slowest = timed.iter().max_by(|a, b| a.milliseconds.total_cmp(&b.milliseconds));
    let axes = Axes {
        caption: "Area under the cumulative error curve by time",
        x: "mean time of a file (ms)".into(),
        y: "AUC (%)".into(),
        x_range: x(fastest) - 0.05..x(slowest) + 0.05,
        y_range: 0.0..100.0,
        x_label: |x| format!("{:.2}", 10f64.powf(*x)),
        legend: SeriesLabelPosition::LowerRight,
    };
    draw(path, axes, &curves)
}

/// The points of the staircase from (0, 0) to the limit.
fn steps(errors: &[f64], limit: f64) -> Vec<(f64, f64)> {
    let mut sorted = errors.to_vec();
    sorted.sort_by(f64::total_cmp);
    let share = |k: usize| 100.0 * k as f64 / sorted.len() as f64;
    let mut points = vec![(0.0, 0.0)];
    for (k, &error) in sorted.iter().enumerate().take_while(|(_, e)| **e <= limit) {
        points.extend([(error, share(k)), (error, share(k + 1))]);
    }
    let last = points.last().map_or(0.0, |p| p.1);
    points.push((limit, last));
    points
}
