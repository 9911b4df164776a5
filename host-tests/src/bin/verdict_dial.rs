//! Draws how the verdict turns as a scene turns from one kind into another: `cargo run --release --bin verdict_dial -- FILE`
//! writes the curves (SVG) and prints the table.

use std::error::Error;
use std::io::{self, IsTerminal};
use std::path::PathBuf;

use clap::Parser;
use epipole_host_tests::dial::{DIALS, PROBLEMS, VERDICTS, table};
use indicatif::{ProgressBar, ProgressDrawTarget};
use plotters::prelude::*;

#[derive(Parser)]
#[command(name = "verdict_dial", version, about = "Draw the verdict against a dial of the scene")]
struct Arguments {
    /// Where to draw (SVG).
    #[arg(default_value = "verdict_dial.svg")]
    path: PathBuf,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let bar = ProgressBar::new(DIALS.iter().map(|(_, dial)| dial.positions().len() as u64).sum());
    if !io::stderr().is_terminal() {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    let table = table(|| bar.inc(1));
    bar.finish_and_clear();
    print!("{table}");

    let root = SVGBackend::new(&arguments.path, (900, 1200)).into_drawing_area();
    root.fill(&WHITE)?;
    for ((name, dial), area) in DIALS.iter().zip(root.split_evenly((3, 1))) {
        // Positions are spaced evenly: they span orders of magnitude, and the first is zero.
        let last = dial.positions().len() as f64 - 1.0;
        let mut chart = ChartBuilder::on(&area)
            .margin(12)
            .x_label_area_size(36)
            .y_label_area_size(44)
            .build_cartesian_2d(0.0..last, 0.0..1.02)?;
        let label =
            |x: &f64| dial.positions().get(x.round() as usize).map_or(String::new(), |p| p.to_string());
        chart
            .configure_mesh()
            .x_labels(dial.positions().len())
            .x_label_formatter(&label)
            .x_desc(*name)
            .y_desc("share of the problems")
            .draw()?;
        for (k, verdict) in VERDICTS.iter().enumerate() {
            let colour = Palette99::pick(k).to_rgba();
            let curve: Vec<(f64, f64)> = table
                .lines()
                .filter(|line| line.starts_with(&format!("{name} ")))
                .zip(0u32..)
                .filter_map(|(line, x)| {
                    let count: f64 = line.split(' ').nth(2 + k)?.parse().ok()?;
                    Some((f64::from(x), count / PROBLEMS as f64))
                })
                .collect();
            chart
                .draw_series(LineSeries::new(curve, colour.stroke_width(2)))?
                .label(*verdict)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
        }
        chart.configure_series_labels().background_style(WHITE.mix(0.8)).border_style(BLACK).draw()?;
    }
    root.present()?;
    println!("wrote {}", arguments.path.display());
    Ok(())
}
