//! A flight followed by a sliding window, and its picture.

pub mod flight;

use std::error::Error;
use std::path::Path;

use epipole::nalgebra::Vector3;
use plotters::prelude::*;

/// A path with its name.
pub type NamedPath<'a> = (&'a str, Vec<Vector3<f64>>);

/// Draws paths seen from above (x to the right, z up) as SVG.
pub fn draw_paths(file: &Path, title: &str, paths: &[NamedPath<'_>]) -> Result<(), Box<dyn Error>> {
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let all = || paths.iter().flat_map(|p| &p.1);
    let range = |value: fn(&Vector3<f64>) -> f64| {
        let (low, high) = all().map(value).fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)));
        let margin = 0.05 * (high - low).max(1e-3);
        low - margin..high + margin
    };
    let root = SVGBackend::new(file, (900, 700)).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .caption(title, ("sans-serif", 20))
        .margin(12)
        .x_label_area_size(36)
        .y_label_area_size(48)
        .build_cartesian_2d(range(|c| c.x), range(|c| c.z))?;
    chart.configure_mesh().x_desc("x").y_desc("z").light_line_style(WHITE).draw()?;
    for ((name, path), colour) in paths.iter().zip([RED, BLUE, BLACK]) {
        chart
            .draw_series(LineSeries::new(path.iter().map(|c| (c.x, c.z)), colour.stroke_width(2)))?
            .label(*name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], colour.stroke_width(2)));
    }
    chart.configure_series_labels().background_style(WHITE).border_style(BLACK).draw()?;
    root.present()?;
    Ok(())
}
