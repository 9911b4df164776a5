//! From two images to a relative pose, its inliers, points and a picture.
//!
//! Without arguments it renders a scene of its own and compares the answer with the truth.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use epipole::nalgebra::Isometry3;
use epipole_examples::exit_code;
use epipole_examples::export::{View, scene_points, write_colmap, write_matches, write_ply};
use epipole_examples::features::detect;
use epipole_examples::lens::{CameraParameters, FisheyeCoefficients, Lens};
use epipole_examples::matching::{Match, match_features};
use epipole_examples::two_view::{
    Settings, Truth, TwoView, direction_error_deg, estimate, rotation_error_deg,
};
use epipole_examples::{align, picture, render};
use image::{DynamicImage, ImageReader, RgbImage};
use serde_json::json;

#[derive(Parser)]
#[command(name = "two_view", version, about = "The relative pose of two images: X2 = R X1 + t, |t| = 1.")]
struct Arguments {
    /// Two images (JPEG or PNG); a built-in scene without them.
    #[arg(num_args = 2, value_names = ["IMAGE1", "IMAGE2"], requires = "camera")]
    images: Vec<PathBuf>,
    /// Camera of both images, in pixels: `fx,fy,cx,cy[,k1,k2,p1,p2[,k3]]`; the centre of the top-left pixel is (0, 0).
    #[arg(long, value_name = "NUMBERS", allow_hyphen_values = true)]
    camera: Option<CameraParameters>,
    /// Camera of image 2, where it differs.
    #[arg(long, value_name = "NUMBERS", allow_hyphen_values = true, requires = "camera")]
    camera2: Option<CameraParameters>,
    /// The lens is a fisheye (Kannala-Brandt): k1,k2,k3,k4.
    #[arg(long, value_name = "NUMBERS", allow_hyphen_values = true, requires = "camera")]
    fisheye: Option<FisheyeCoefficients>,
    /// Fisheye coefficients of image 2, where they differ.
    #[arg(long, value_name = "NUMBERS", allow_hyphen_values = true, requires = "fisheye")]
    fisheye2: Option<FisheyeCoefficients>,
    /// The true pose, to compare with: nine numbers of R row-major, three of t.
    #[arg(long, value_name = "NUMBERS", allow_hyphen_values = true, requires = "camera")]
    truth: Option<Truth>,
    #[command(flatten)]
    settings: Settings,
    /// The picture of matches and epipolar lines (PNG or JPEG).
    #[arg(long, value_name = "FILE", default_value = "out/two_view.png")]
    out: PathBuf,
    /// Widest picture, in pixels.
    #[arg(long, value_name = "PX", default_value_t = 1928)]
    width: u32,
    /// Write the result as JSON.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write the triangulated points as PLY.
    #[arg(long, value_name = "FILE")]
    ply: Option<PathBuf>,
    /// Write the triangulated scene as a COLMAP text model: cameras, images, points3D.
    #[arg(long, value_name = "DIR")]
    colmap: Option<PathBuf>,
    /// Write the two built-in images as view1.png and view2.png, the arguments to run on them, and their matches with
    /// the true pose as a file for `evaluate`.
    #[arg(long, value_name = "DIR", conflicts_with = "images")]
    dump: Option<PathBuf>,
}

/// Two images and what is known about them.
struct Input {
    names: [String; 2],
    images: [RgbImage; 2],
    cameras: [CameraParameters; 2],
    truth: Option<Truth>,
}

fn main() -> ExitCode {
    exit_code(run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let start = Instant::now();
    let input = match arguments.images.as_slice() {
        [first, second] => read(arguments, [first, second])?,
        _ => built_in(arguments)?,
    };
    let [w, h] = [input.images[0].width(), input.images[0].height()];
    let verb = if arguments.images.is_empty() { "rendered" } else { "read" };
    println!("{} and {}, {w} x {h}, {verb} in {:.2} s", input.names[0], input.names[1], seconds(start));

    let start = Instant::now();
    let options = arguments.settings.feature_options();
    let features =
        [0, 1].map(|i| detect(&DynamicImage::ImageRgb8(input.images[i].clone()).into_luma8(), &options));
    let mut matches = match_features(&features[0], &features[1]);
    align::refine_matches(&features[0], &features[1], &mut matches);
    let counts = features.map(|f| f.keypoints.len());
    println!(
        "{} matches of {} and {} features in {:.2} s",
        matches.len(),
        counts[0],
        counts[1],
        seconds(start)
    );

    if let Some(folder) = &arguments.dump {
        let file = folder.join("matches.txt");
        write_matches(&file, &input.cameras, [w, h], &render::true_pose(), &matches)
            .map_err(|e| format!("{}: {e}", file.display()))?;
    }
    let start = Instant::now();
    let settings = &arguments.settings;
    let found = if settings.f32 {
        estimate::<f32>(&input.cameras, &matches, settings)
    } else {
        estimate::<f64>(&input.cameras, &matches, settings)
    }?;
    let milliseconds = 1e3 * seconds(start);
    let errors = print_pose(&found, matches.len(), milliseconds, input.truth);

    let mut caption = format!(
        "rotation {:.2} deg, t = ({:.3}, {:.3}, {:.3})",
        found.pose.rotation.angle().to_degrees(),
        found.pose.translation.x,
        found.pose.translation.y,
        found.pose.translation.z
    );
    if let Some([r, t]) = errors {
        caption += &format!(", error {r:.3} deg in R, {t:.2} deg in t");
    }
    let camera = |i: usize| input.cameras[i].camera::<f64>();
    let drawn = picture::draw(
        &picture::Scene {
            images: [&input.images[0], &input.images[1]],
            cameras: [camera(0)?, camera(1)?],
            pose: found.pose,
            matches: &matches,
            inliers: &found.inliers,
            caption: &caption,
        },
        arguments.width,
    );
    if let Some(folder) = arguments.out.parent() {
        fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    }
    drawn.save(&arguments.out).map_err(|e| format!("{}: {e}", arguments.out.display()))?;
    println!("wrote {}", arguments.out.display());
    export(arguments, &input, &matches, &found, errors)
}

fn seconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64()
}

fn read(arguments: &Arguments, paths: [&Path; 2]) -> Result<Input, Box<dyn Error>> {
    let camera = arguments.camera.ok_or("the images need their --camera")?;
    let fisheye = |camera: CameraParameters, k: Option<FisheyeCoefficients>| match k {
        Some(k) => camera.with_fisheye(k).ok_or("a fisheye camera has four numbers: fx,fy,cx,cy"),
        None => Ok(camera),
    };
    let cameras = [
        fisheye(camera, arguments.fisheye)?,
        fisheye(arguments.camera2.unwrap_or(camera), arguments.fisheye2.or(arguments.fisheye))?,
    ];
    // By its content: a wrong extension hides nothing.
    let open = |path: &Path| -> Result<RgbImage, String> {
        let named = |e: &dyn Error| format!("{}: {e}", path.display());
        let reader = ImageReader::open(path).and_then(ImageReader::with_guessed_format);
        reader.map_err(|e| named(&e))?.decode().map(DynamicImage::into_rgb8).map_err(|e| named(&e))
    };
    Ok(Input {
        names: paths.map(|p| p.file_name().unwrap_or_default().to_string_lossy().into_owned()),
        images: [open(paths[0])?, open(paths[1])?],
        cameras,
        truth: arguments.truth,
    })
}

fn built_in(arguments: &Arguments) -> Result<Input, Box<dyn Error>> {
    let (first, second) = render::image_pair();
    let camera = CameraParameters { intrinsics: render::INTRINSICS, lens: Lens::None };
    let truth = Truth::from(render::true_pose());
    let names = ["view1.png", "view2.png"];
    if let Some(folder) = &arguments.dump {
        fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        for (name, image) in names.iter().zip([&first, &second]) {
            image.save(folder.join(name)).map_err(|e| format!("{}: {e}", folder.join(name).display()))?;
        }
        let rows = truth.rotation.transpose();
        let pose: Vec<String> = rows.iter().chain(&truth.translation).map(f64::to_string).collect();
        let line = format!("{} {} --camera {camera} --truth={}\n", names[0], names[1], pose.join(","));
        fs::write(folder.join("arguments.txt"), line)?;
    }
    Ok(Input {
        names: names.map(String::from),
        images: [first, second],
        cameras: [camera; 2],
        truth: Some(truth),
    })
}

/// Prints the result; returns the errors of rotation and direction of t in degrees, where the truth is known.
fn print_pose(found: &TwoView, matches: usize, milliseconds: f64, truth: Option<Truth>) -> Option<[f64; 2]> {
    let pose = Truth::from(found.pose);
    for (row, label) in pose.rotation.row_iter().zip(["R =", "", ""]) {
        println!("{label:4}[{:9.6} {:9.6} {:9.6}]", row[0], row[1], row[2]);
    }
    let t = pose.translation;
    println!("t = [{:9.6} {:9.6} {:9.6}]", t.x, t.y, t.z);
    let (inliers, angle) = (found.inlier_count(), found.pose.rotation.angle().to_degrees());
    println!("{inliers} inliers of {matches} matches, {} iterations, {milliseconds:.1} ms", found.iterations);
    println!("angle between the views {angle:.3} deg");
    if found.planar {
        println!("all inliers lie on one plane: this is the likelier of the poses that explain it");
    }
    println!("{} of {inliers} triangulated inliers lie in front of both cameras", found.points.len());
    truth.map(|truth| {
        let r = rotation_error_deg(&pose.rotation, &truth.rotation);
        let t = direction_error_deg(&pose.translation, &truth.translation);
        println!("against the truth: rotation {r:.4} deg, direction of t {t:.3} deg");
        [r, t]
    })
}

/// Writes the files that were asked for.
fn export(
    arguments: &Arguments,
    input: &Input,
    matches: &[Match],
    found: &TwoView,
    errors: Option<[f64; 2]>,
) -> Result<(), Box<dyn Error>> {
    if let Some(path) = &arguments.json {
        let pose = Truth::from(found.pose);
        let mut result = json!({
            "R": pose.rotation.transpose().as_slice(),
            "t": pose.translation.as_slice(),
            "matches": matches.len(),
            "inliers": found.inlier_count(),
            "iterations": found.iterations,
            "in_front": found.points.len(),
        });
        if let Some([rotation, translation]) = errors {
            result["rotation_error_deg"] = rotation.into();
            result["translation_error_deg"] = translation.into();
        }
        fs::write(path, format!("{result:#}\n")).map_err(|e| format!("{}: {e}", path.display()))?;
        println!("wrote {}", path.display());
    }
    if arguments.ply.is_none() && arguments.colmap.is_none() {
        return Ok(());
    }
    let camera = |i: usize| input.cameras[i].camera::<f64>();
    let points = scene_points(&input.images[0], &[camera(0)?, camera(1)?], matches, found);
    if let Some(path) = &arguments.ply {
        write_ply(path, &points).map_err(|e| format!("{}: {e}", path.display()))?;
        println!("wrote {} points to {}", points.len(), path.display());
    }
    if let Some(folder) = &arguments.colmap {
        let view = |i: usize, pose: Isometry3<f64>| View {
            name: &input.names[i],
            size: [input.images[i].width(), input.images[i].height()],
            camera: input.cameras[i],
            pose,
        };
        let views = [view(0, Isometry3::identity()), view(1, found.pose)];
        write_colmap(folder, &views, &points).map_err(|e| format!("{}: {e}", folder.display()))?;
        println!("wrote cameras.txt, images.txt, points3D.txt to {}", folder.display());
    }
    Ok(())
}
