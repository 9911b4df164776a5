//! Writing a triangulated pair for other programs: PLY for mesh viewers, COLMAP's text model for reconstruction tools,
//! correspondences for `evaluate`.

use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::Path;

use epipole::geometry::{Camera, CameraModel};
use epipole::nalgebra::{Isometry3, Point3, Vector3};
use image::RgbImage;

use crate::lens::CameraParameters;
use crate::matching::Match;
use crate::two_view::TwoView;

/// A triangulated correspondence.
#[derive(Clone, Copy, Debug)]
pub struct ScenePoint {
    /// In the frame of view 1, the unit of length being the baseline.
    pub position: Vector3<f64>,
    pub colour: [u8; 3],
    /// Pixels in both images.
    pub pixels: [[f64; 2]; 2],
    /// Mean reprojection error in pixels.
    pub error_px: f64,
}

/// One of the two images, for COLMAP.
pub struct View<'a> {
    /// File name of the image.
    pub name: &'a str,
    pub size: [u32; 2],
    pub camera: CameraParameters,
    /// World (the frame of view 1) to camera.
    pub pose: Isometry3<f64>,
}

/// The points in front of both cameras, coloured as in image 1, with their reprojection errors.
#[must_use]
pub fn scene_points(
    image: &RgbImage,
    cameras: &[Camera<f64>; 2],
    matches: &[Match],
    found: &TwoView,
) -> Vec<ScenePoint> {
    let poses = [Isometry3::identity(), found.pose];
    let points = found.points.iter().filter_map(|&(index, position)| {
        let pixels = [matches[index].x1, matches[index].x2];
        let mut error_px = 0.0;
        for ((camera, pose), pixel) in cameras.iter().zip(&poses).zip(pixels) {
            let seen = camera.project(&(pose * Point3::from(position)).coords)?;
            error_px += (seen.x - pixel[0]).hypot(seen.y - pixel[1]) / 2.0;
        }
        let at = |x: f64, side: u32| (x.round().max(0.0) as u32).min(side - 1);
        let [x, y] = pixels[0];
        let colour = image.get_pixel(at(x, image.width()), at(y, image.height())).0;
        Some(ScenePoint { position, colour, pixels, error_px })
    });
    points.collect()
}

/// The points with their colours, as a PLY file.
///
/// # Errors
/// The file cannot be written.
pub fn write_ply(path: &Path, points: &[ScenePoint]) -> io::Result<()> {
    let mut out = format!(
        "ply\nformat ascii 1.0\ncomment x right, y down, z forward; unit: the baseline\nelement vertex {}\n",
        points.len()
    );
    for axis in ["x", "y", "z"] {
        let _ = writeln!(out, "property float {axis}");
    }
    for colour in ["red", "green", "blue"] {
        let _ = writeln!(out, "property uchar {colour}");
    }
    out.push_str("end_header\n");
    for p in points {
        let ([r, g, b], x) = (p.colour, p.position);
        let _ = writeln!(out, "{} {} {} {r} {g} {b}", x.x as f32, x.y as f32, x.z as f32);
    }
    fs::write(path, out)
}

/// `cameras.txt`, `images.txt` and `points3D.txt` in a directory, which is made where it is missing.
///
/// # Errors
/// The directory or a file cannot be written.
pub fn write_colmap(directory: &Path, views: &[View<'_>; 2], points: &[ScenePoint]) -> io::Result<()> {
    fs::create_dir_all(directory)?;
    let mut cameras = String::from("# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n");
    let mut images = String::from(
        "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# POINTS2D[] as (X, Y, POINT3D_ID)\n",
    );
    for (i, view) in views.iter().enumerate() {
        let id = i + 1;
        let (model, parameters) = view.camera.colmap();
        let [width, height] = view.size;
        let parameters: Vec<String> = parameters.iter().map(f64::to_string).collect();
        let _ = writeln!(cameras, "{id} {model} {width} {height} {}", parameters.join(" "));
        let (q, t) = (view.pose.rotation, view.pose.translation.vector);
        let name = view.name;
        let _ = writeln!(images, "{id} {} {} {} {} {} {} {} {id} {name}", q.w, q.i, q.j, q.k, t.x, t.y, t.z);
        let observations: Vec<String> = points
            .iter()
            .enumerate()
            .map(|(k, p)| format!("{} {} {}", p.pixels[i][0] + 0.5, p.pixels[i][1] + 0.5, k + 1))
            .collect();
        let _ = writeln!(images, "{}", observations.join(" "));
    }
    let mut list =
        String::from("# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n");
    for (k, p) in points.iter().enumerate() {
        let ([r, g, b], x) = (p.colour, p.position);
        let _ = writeln!(list, "{} {} {} {} {r} {g} {b} {} 1 {k} 2 {k}", k + 1, x.x, x.y, x.z, p.error_px);
    }
    fs::write(directory.join("cameras.txt"), cameras)?;
    fs::write(directory.join("images.txt"), images)?;
    fs::write(directory.join("points3D.txt"), list)
}

/// Correspondences with the true pose, best first, in the text format of `evaluate`; lens distortion is not part of it.
///
/// # Errors
/// The file cannot be written.
pub fn write_matches(
    path: &Path,
    cameras: &[CameraParameters; 2],
    size: [u32; 2],
    truth: &Isometry3<f64>,
    matches: &[Match],
) -> io::Result<()> {
    let mut sorted: Vec<&Match> = matches.iter().collect();
    sorted.sort_by_key(|m| m.distance);
    let join = |numbers: &[f64]| numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let mut out = format!("# size {} {}\n", size[0], size[1]);
    for (name, camera) in ["K1", "K2"].iter().zip(cameras) {
        let _ = writeln!(out, "{name} {}", join(&camera.intrinsics));
    }
    let rotation = truth.rotation.to_rotation_matrix().into_inner();
    let _ = writeln!(out, "R_gt {}", join(rotation.transpose().as_slice()));
    let _ = writeln!(out, "t_gt {}", join(truth.translation.vector.as_slice()));
    let _ = writeln!(out, "n {}", sorted.len());
    for m in sorted {
        let _ = writeln!(out, "{:.4} {:.4} {:.4} {:.4} {}", m.x1[0], m.x1[1], m.x2[0], m.x2[1], m.distance);
    }
    fs::write(path, out)
}
