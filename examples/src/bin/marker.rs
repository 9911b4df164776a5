//! The pose of a printed square marker of known size from its four corners, drawn into the image as axes.
//!
//! Without arguments it renders a scene of its own: a marker before a wall, seen by a camera whose pose it then finds.

use std::error::Error;
use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use epipole::geometry::{CameraModel, Pinhole, Pose};
use epipole::nalgebra::{Point3, Translation3, UnitQuaternion, Vector2, Vector3};
use epipole::solvers::{PlanarTargetPose, abspose_planar};
use epipole_examples::canvas::{Paint, disc, stroke, text};
use epipole_examples::exit_code;
use epipole_examples::noise::{Rng, fractal};
use image::{ImageReader, Rgb, RgbImage};

#[derive(Parser)]
#[command(name = "marker", version, about = "The pose of a square marker from its four corners")]
struct Arguments {
    /// An image (JPEG or PNG); a built-in scene without it.
    #[arg(requires = "camera", requires = "corners")]
    image: Option<PathBuf>,
    /// Camera in pixels, no distortion: fx,fy,cx,cy; the centre of the top-left pixel is (0, 0).
    #[arg(long, value_name = "NUMBERS", allow_hyphen_values = true)]
    camera: Option<String>,
    /// The corners in the image, in the order of a reader who looks at the marker: top left, top right, bottom right,
    /// bottom left: x,y,x,y,x,y,x,y.
    #[arg(long, value_name = "NUMBERS", allow_hyphen_values = true)]
    corners: Option<String>,
    /// Length of the marker's side, in metres.
    #[arg(long, value_name = "M", default_value_t = 0.2)]
    side: f64,
    /// Seed of the built-in scene's noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// The picture (PNG or JPEG).
    #[arg(long, value_name = "FILE", default_value = "out/marker.png")]
    out: PathBuf,
}

fn main() -> ExitCode {
    exit_code(run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    if !(arguments.side.is_finite() && arguments.side > 0.0) {
        return Err("the side must be positive".into());
    }
    let (camera, mut image, corners, truth) = match &arguments.image {
        Some(path) => {
            let [fx, fy, cx, cy] = numbers(arguments.camera.as_deref().unwrap_or_default())?;
            let [a, b, c, d, e, f, g, h] = numbers(arguments.corners.as_deref().unwrap_or_default())?;
            let corners = [[a, b], [c, d], [e, f], [g, h]].map(Vector2::from);
            let image = ImageReader::open(path)
                .map_err(|e| format!("{}: {e}", path.display()))?
                .decode()
                .map_err(|e| format!("{}: {e}", path.display()))?;
            (Pinhole::new(fx, fy, cx, cy)?, image.to_rgb8(), corners, None)
        }
        None => {
            let camera = Pinhole::new(820.0, 820.0, 319.5, 239.5)?;
            let truth = Pose::from_parts(
                Translation3::new(0.03, -0.02, 0.9),
                UnitQuaternion::from_euler_angles(0.35, -0.6, 0.2),
            );
            let image = render(&camera, &truth, arguments.side, arguments.seed);
            // What a corner detector would report: the corners to a fifth of a pixel.
            let mut rng = Rng::new(arguments.seed);
            let corners = square(arguments.side).map(|p| {
                let at = camera.project(&seen(&truth, p.x, p.y, 0.0)).expect("in front of the camera");
                at + Vector2::new(f64::from(rng.gaussian()), f64::from(rng.gaussian())) * 0.2
            });
            (camera, image, corners, Some(truth))
        }
    };

    let mut bearings = [Vector3::zeros(); 4];
    for (bearing, corner) in bearings.iter_mut().zip(&corners) {
        *bearing = camera.unproject(corner)?;
    }
    let poses = abspose_planar(&bearings, &square(arguments.side))?;
    let Some(best) = poses.first() else { return Err("these corners show no square".into()) };
    for (name, found) in ["pose", "other"].iter().zip(&poses) {
        report(name, found, &camera);
    }
    let ambiguous = poses.get(1).is_some_and(|other| other.rms_rad < 3.0 * best.rms_rad);
    if ambiguous {
        println!("ambiguous: both poses explain the corners; decide by the last pose or another sensor");
    }
    if let Some(truth) = truth {
        let turned = best.pose.rotation.angle_to(&truth.rotation).to_degrees();
        let moved = (best.pose.translation.vector - truth.translation.vector).norm();
        println!("error: {turned:.3} deg, {:.2} mm", 1e3 * moved);
    }

    draw(&mut image, &camera, best, &corners, arguments.side);
    if let Some(folder) = arguments.out.parent() {
        fs::create_dir_all(folder)?;
    }
    image.save(&arguments.out).map_err(|e| format!("{}: {e}", arguments.out.display()))?;
    println!("wrote {}", arguments.out.display());
    Ok(())
}

/// The corners on the marker: x to the right, y down, z into the wall.
fn square(side: f64) -> [Vector2<f64>; 4] {
    let h = side / 2.0;
    [[-h, -h], [h, -h], [h, h], [-h, h]].map(Vector2::from)
}

fn seen(pose: &Pose<f64>, x: f64, y: f64, z: f64) -> Vector3<f64> {
    (pose * Point3::new(x, y, z)).coords
}

fn report(name: &str, found: &PlanarTargetPose<f64>, camera: &Pinhole<f64>) {
    let t = &found.pose.translation.vector;
    let w = found.pose.rotation.scaled_axis() * 180.0 / std::f64::consts::PI;
    println!(
        "{name}: t = ({:.4}, {:.4}, {:.4}) m, rotation vector ({:.2}, {:.2}, {:.2}) deg, {:.3} px RMS",
        t.x,
        t.y,
        t.z,
        w.x,
        w.y,
        w.z,
        found.rms_rad * camera.focal()
    );
}

/// Exactly `N` finite numbers with commas between them.
fn numbers<const N: usize>(list: &str) -> Result<[f64; N], String> {
    let found = epipole_examples::lens::numbers(list)?;
    let count = found.len();
    found.try_into().map_err(|_| format!("{count} numbers, {N} needed: `{list}`"))
}

/// A cell of the marker's 6x6 pattern is dark: a frame, and a code inside that has no symmetry.
fn dark(x: f64, y: f64) -> bool {
    const CODE: [[bool; 4]; 4] = [
        [true, false, false, true],
        [false, true, false, false],
        [true, true, true, false],
        [false, false, true, false],
    ];
    let cell = |v: f64| ((v + 0.5) * 6.0).floor() as i64;
    let (column, row) = (cell(x), cell(y));
    if !(1..=4).contains(&column) || !(1..=4).contains(&row) {
        return true;
    }
    CODE[(row - 1) as usize][(column - 1) as usize]
}

/// The marker on white paper before a rough wall, by casting rays: four a pixel.
fn render(camera: &Pinhole<f64>, pose: &Pose<f64>, side: f64, seed: u64) -> RgbImage {
    let inverse = pose.inverse();
    let origin = inverse.translation.vector;
    let mut rng = Rng::new(seed ^ 0x5eed);
    RgbImage::from_fn(640, 480, |u, v| {
        let mut sum = 0.0;
        for (du, dv) in [(-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)] {
            let pixel = Vector2::new(f64::from(u) + du, f64::from(v) + dv);
            let Ok(bearing) = camera.unproject(&pixel) else { continue };
            let ray = inverse.rotation * bearing;
            let at = origin - ray * (origin.z / ray.z);
            let (x, y) = (at.x / side, at.y / side);
            sum += if x.abs() < 0.5 && y.abs() < 0.5 {
                if dark(x, y) { 0.06 } else { 0.85 }
            } else if x.abs() < 0.65 && y.abs() < 0.65 {
                0.85
            } else {
                0.25 + 0.3 * f64::from(fractal(6.0 * x as f32, 6.0 * y as f32, 4, 3))
            };
        }
        let grey = 255.0 * (sum / 4.0f64).clamp(0.0, 1.0).powf(1.0 / 2.2) + 2.0 * f64::from(rng.gaussian());
        let grey = grey.round().clamp(0.0, 255.0) as u8;
        Rgb([grey, grey, (f64::from(grey) * 0.96) as u8])
    })
}

/// The corners, and the marker's axes: x red, y green, and blue the normal that comes out of the paper.
fn draw(
    image: &mut RgbImage,
    camera: &Pinhole<f64>,
    found: &PlanarTargetPose<f64>,
    corners: &[Vector2<f64>; 4],
    side: f64,
) {
    let point = |p: &Vector2<f64>| [p.x as f32, p.y as f32];
    let project = |x, y, z| camera.project(&seen(&found.pose, x, y, z)).map(|p| point(&p));
    let outline: Vec<[f32; 2]> = corners.iter().chain(&corners[..1]).map(point).collect();
    stroke(image, &outline, 2.0, Paint::new([255, 200, 40], 0.9));
    for corner in corners {
        disc(image, point(corner), 4.0, Paint::new([255, 200, 40], 1.0));
    }
    let length = 0.75 * side;
    let axes = [
        ((length, 0.0, 0.0), [230, 50, 50], "x"),
        ((0.0, length, 0.0), [60, 190, 70], "y"),
        ((0.0, 0.0, -length), [60, 110, 240], "-z"),
    ];
    let Some(middle) = project(0.0, 0.0, 0.0) else { return };
    for ((x, y, z), colour, name) in axes {
        if let Some(end) = project(x, y, z) {
            stroke(image, &[middle, end], 4.0, Paint::new(colour, 1.0));
            text(image, end[0] as i64 + 6, end[1] as i64 - 4, 2, name, Paint::new(colour, 1.0));
        }
    }
    disc(image, middle, 4.0, Paint::new([255, 255, 255], 1.0));
}
