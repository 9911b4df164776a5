//! The cumulative error curve: which share of the files has an error below x.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};

use plotters::prelude::*;

use crate::file::Problem;
use crate::report::{scale, scene};
use crate::score::Outcome;

/// Draws a curve a scene and one of all files.
pub(crate) fn write_svg(
    path: &Path,
    problem: Problem,
    outcomes: &[(PathBuf, Outcome)],
) -> Result<(), Box<dyn Error>> {
    let scale = scale(problem);
    let limit = scale.thresholds[2];
    let mut curves = BTreeMap::<String, Vec<f64>>::new();
    for (file, outcome) in outcomes {
        curves.entry(scene(file)).or_default().push(outcome.worst());
    }
    let all: Vec<f64> = outcomes.iter().map(|(_, o)| o.worst()).collect();

    let root = SVGBackend::new(path, (900, 600)).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .margin(16)
        .caption("Cumulative error", ("sans-serif", 24))
        .x_label_area_size(48)
        .y_label_area_size(56)
        .build_cartesian_2d(0.0..limit, 0.0..100.0)?;
    let axis = match problem {
        Problem::Homography => format!("mean transfer error ({})", scale.unit),
        Problem::AbsolutePose => format!("larger error of rotation and position ({})", scale.unit),
        _ => format!("larger error of rotation and direction of translation ({})", scale.unit),
    };
    chart
        .configure_mesh()
        .x_desc(axis)
        .y_desc("files with a smaller error (%)")
        .max_light_lines(1)
        .x_label_formatter(&f64::to_string)
        .y_label_formatter(&f64::to_string)
        .draw()?;
    let named = curves.iter().map(|(name, errors)| (name.as_str(), errors));
    for (index, (name, errors)) in named.chain([("all files", &all)]).enumerate() {
        let is_all = index == curves.len();
        let colour = if is_all { BLACK.to_rgba() } else { Palette99::pick(index).to_rgba() };
        let style = colour.stroke_width(if is_all { 3 } else { 2 });
        chart
            .draw_series(LineSeries::new(steps(errors, limit), style))?
            .label(format!("{name} ({})", errors.len()))
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], style));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerRight)
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.3))
        .draw()?;
    root.present()?;
    Ok(())
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
