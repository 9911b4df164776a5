//! Windows of bundle adjustment on the heap, the problems that go into them, and their picture.

pub mod flight;
pub mod problem;

use std::error::Error;
use std::path::Path;

use epipole::Real;
use epipole::bundle::{
    FrameSlot, ObservationSlot, PointSlot, Window, WindowHeader, WindowMemory, scalars_len,
};
use epipole::geometry::Pose;
use epipole::nalgebra::{UnitQuaternion, Vector3};
use epipole::real::lit;
use plotters::prelude::*;

/// A window's memory on the heap, its capacities chosen at run time.
pub struct HeapWindow<T: Real> {
    header: WindowHeader,
    frames: Vec<FrameSlot<T>>,
    points: Vec<PointSlot<T>>,
    observations: Vec<ObservationSlot<T>>,
    scalars: Vec<T>,
}

impl<T: Real> HeapWindow<T> {
    /// Memory of these capacities.
    pub fn new(frames: usize, points: usize, observations: usize) -> Self {
        Self {
            header: WindowHeader::EMPTY,
            frames: vec![FrameSlot::EMPTY; frames],
            points: vec![PointSlot::EMPTY; points],
            observations: vec![ObservationSlot::EMPTY; observations],
            scalars: vec![T::ZERO; scalars_len(frames)],
        }
    }

    /// Its size in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.header)
            + size_of_val(&*self.frames)
            + size_of_val(&*self.points)
            + size_of_val(&*self.observations)
            + size_of_val(&*self.scalars)
    }

    /// The window over it, as it was left.
    pub fn window(&mut self) -> Window<'_, T> {
        Window::new(WindowMemory {
            header: &mut self.header,
            frames: &mut self.frames,
            points: &mut self.points,
            observations: &mut self.observations,
            scalars: &mut self.scalars,
        })
        .expect("the slices have the lengths asked for")
    }
}

/// The camera's centre in the world.
pub fn centre(pose: &Pose<f64>) -> Vector3<f64> {
    -(pose.rotation.inverse() * pose.translation.vector)
}

/// A pose of another scalar.
pub fn cast_pose<A: Real, B: Real>(pose: &Pose<A>) -> Pose<B> {
    let c = |x: A| lit::<B>(x.to_f64());
    let rotation = UnitQuaternion::new_unchecked(pose.rotation.coords.map(c).into());
    Pose::from_parts(pose.translation.vector.map(c).into(), rotation)
}

/// The point nearest to rays `(origin, unit direction)`; none where they are parallel.
pub fn nearest_to_rays(rays: &[(Vector3<f64>, Vector3<f64>)]) -> Option<Vector3<f64>> {
    let mut a = epipole::nalgebra::Matrix3::zeros();
    let mut b = Vector3::zeros();
    for (origin, d) in rays {
        let across = epipole::nalgebra::Matrix3::identity() - d * d.transpose();
        a += across;
        b += across * origin;
    }
    let x = a.try_inverse()? * b;
    x.iter().all(|x| x.is_finite()).then_some(x)
}

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
