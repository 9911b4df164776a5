//! Visual odometry in its shortest form: consecutive frames of a sequence, two at a time.
//!
//! Rotation and direction come from each pair alone; the length of a step is carried on by the points that two pairs
//! have in common. There is no bundle adjustment and no loop closure: the drift is that of single pairs.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use epipole::nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};
use epipole_examples::align::refine_matches;
use epipole_examples::exit_code;
use epipole_examples::export::write_matches;
use epipole_examples::features::{Features, detect};
use epipole_examples::lens::{CameraParameters, Lens};
use epipole_examples::matching::{Match, match_features};
use epipole_examples::track::draw_track;
use epipole_examples::two_view::{Settings, TwoView, direction_error_deg, estimate, rotation_error_deg};

#[derive(Parser)]
#[command(name = "odometry", version, about = "Chain the relative poses of consecutive frames")]
struct Arguments {
    /// Folder with calib.txt (first line: a 3x4 projection matrix K [I | 0], row-major), the frames in image_l or
    /// image_0, and, to compare with, poses.txt (a 3x4 camera-to-world matrix a line, row-major).
    folder: PathBuf,
    #[command(flatten)]
    settings: Settings,
    /// Use only the first N frames.
    #[arg(long, value_name = "N")]
    frames: Option<usize>,
    /// The picture of the path seen from above (PNG or JPEG).
    #[arg(long, value_name = "FILE", default_value = "out/odometry.png")]
    out: PathBuf,
    /// Write the correspondences of every pair as a text file that `evaluate` reads; needs poses.txt.
    #[arg(long, value_name = "DIR")]
    matches: Option<PathBuf>,
}

fn main() -> ExitCode {
    exit_code(run(&Arguments::parse()))
}

/// A frame and what was found in it.
struct Frame {
    name: String,
    size: [u32; 2],
    features: Features,
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let folder = &arguments.folder;
    let camera = read_calibration(&folder.join("calib.txt"))?;
    let poses = folder.join("poses.txt");
    let truth = if poses.exists() { Some(read_poses(&poses)?) } else { None };
    let mut paths = frames(folder)?;
    paths.truncate(arguments.frames.unwrap_or(usize::MAX));
    if let Some(truth) = &truth
        && truth.len() < paths.len()
    {
        return Err(format!("{}: {} poses for {} frames", poses.display(), truth.len(), paths.len()).into());
    }
    if let Some(out) = &arguments.matches {
        fs::create_dir_all(out).map_err(|e| format!("{}: {e}", out.display()))?;
    }
    let settings = &arguments.settings;
    let options = arguments.settings.feature_options();
    let step = |k: usize| truth.as_ref().map(|poses| poses[k + 1].inverse() * poses[k]);

    // World to camera of each frame; the world is the first camera.
    let mut path = vec![Isometry3::identity()];
    let mut errors = Vec::new();
    let mut lost = 0usize;
    let mut last: Option<Frame> = None;
    let mut last_pair: Option<Pair> = None;
    println!("frames           matches inliers iterations    ms   rotation deg   direction of t deg");
    for image_path in &paths {
        let image = image::open(image_path).map_err(|e| format!("{}: {e}", image_path.display()))?;
        let image = image.into_luma8();
        let frame = Frame {
            name: image_path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            size: [image.width(), image.height()],
            features: detect(&image, &options),
        };
        let Some(previous) = last.replace(frame) else { continue };
        let Some(frame) = &last else { continue };
        let index = path.len() - 1;
        let mut matches = match_features(&previous.features, &frame.features);
        refine_matches(&previous.features, &frame.features, &mut matches);
        let start = Instant::now();
        let found = if settings.f32 {
            estimate::<f32>(&[camera; 2], &matches, settings)
        } else {
            estimate::<f64>(&[camera; 2], &matches, settings)
        };
        let milliseconds = 1e3 * start.elapsed().as_secs_f64();
        print!("{:7}-{:7}  {:7}", previous.name, frame.name, matches.len());
        if let (Some(out), Some(truth)) = (&arguments.matches, step(index)) {
            let file = out.join(format!("{}-{}_orb.txt", previous.name, frame.name));
            write_matches(&file, &[camera; 2], frame.size, &truth, &matches)
                .map_err(|e| format!("{}: {e}", file.display()))?;
        }
        let pose = match found {
            Ok(view) => {
                let first = || step(index).map_or(1.0, |t| t.translation.vector.norm());
                let pair = Pair::new(view, matches, last_pair.as_ref(), first);
                let view = &pair.view;
                print!(" {:7} {:10} {milliseconds:5.1}", view.inlier_count(), view.iterations);
                if let Some(truth) = step(index) {
                    let rotation = |p: &Isometry3<f64>| p.rotation.to_rotation_matrix().into_inner();
                    let r = rotation_error_deg(&rotation(&view.pose), &rotation(&truth));
                    let t = direction_error_deg(&view.pose.translation.vector, &truth.translation.vector);
                    print!("   {r:12.4}   {t:18.3}");
                    errors.push([r, t]);
                }
                println!();
                let mut pose = view.pose;
                pose.translation.vector *= pair.scale;
                last_pair = Some(pair);
                pose
            }
            Err(reason) => {
                println!(" {reason}");
                lost += 1;
                last_pair = None;
                Isometry3::identity()
            }
        };
        path.push(pose * path[index]);
    }
    if path.len() < 2 {
        return Err(format!("{}: fewer than two frames", folder.display()).into());
    }

    let truth: Option<Vec<Vector3<f64>>> = truth.map(|poses| {
        let first = poses[0].inverse();
        poses.iter().take(path.len()).map(|p| (first * p).translation.vector).collect()
    });
    let centres: Vec<Vector3<f64>> = path.iter().map(|p| p.inverse().translation.vector).collect();
    if let Some(folder) = arguments.out.parent() {
        fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    }
    draw_track(&centres, truth.as_deref())
        .save(&arguments.out)
        .map_err(|e| format!("{}: {e}", arguments.out.display()))?;
    println!("wrote {}", arguments.out.display());
    if let Some(truth) = &truth {
        let length: f64 = truth.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
        let end = (centres[centres.len() - 1] - truth[truth.len() - 1]).norm();
        println!("path {length:.1} m, end off by {end:.2} m ({:.2} %)", 100.0 * end / length);
        let sorted = |k: usize| {
            let mut values: Vec<f64> = errors.iter().map(|e: &[f64; 2]| e[k]).collect();
            values.sort_by(f64::total_cmp);
            values
        };
        let (r, t) = (sorted(0), sorted(1));
        let median =
            |v: &[f64]| if v.is_empty() { f64::NAN } else { (v[(v.len() - 1) / 2] + v[v.len() / 2]) / 2.0 };
        let largest = |v: &[f64]| v.last().copied().unwrap_or(f64::NAN);
        println!(
            "pairs={} lost={lost} median_r_deg={:.4} median_t_deg={:.3} max_r_deg={:.4} max_t_deg={:.3}",
            path.len() - 1,
            median(&r),
            median(&t),
            largest(&r),
            largest(&t)
        );
    }
    Ok(())
}

/// A solved pair and the length of its baseline in the path's unit.
struct Pair {
    view: TwoView,
    matches: Vec<Match>,
    scale: f64,
}

impl Pair {
    /// The baseline's length by the points seen in this pair and the one before: the median ratio of their distances
    /// from the frame in common. Without common points it stays as it was; `first` gives the first one.
    fn new(view: TwoView, matches: Vec<Match>, before: Option<&Self>, first: impl Fn() -> f64) -> Self {
        /// In baselines: farther points know their distance badly, and to one side.
        const FARTHEST: f64 = 15.0;
        let Some(before) = before else {
            return Self { view, matches, scale: first() };
        };
        let known: std::collections::HashMap<usize, f64> = before
            .view
            .points
            .iter()
            .map(|(m, x)| {
                let seen = before.view.pose.rotation * x + before.view.pose.translation.vector;
                (before.matches[*m].index2, seen.norm())
            })
            .filter(|(_, distance)| *distance < FARTHEST)
            .collect();
        let mut ratios: Vec<f64> = view
            .points
            .iter()
            .filter(|(_, x)| x.norm() < FARTHEST)
            .filter_map(|(m, x)| known.get(&matches[*m].index1).map(|distance| distance / x.norm()))
            .collect();
        ratios.sort_by(f64::total_cmp);
        let ratio = ratios.get(ratios.len() / 2).copied().unwrap_or(1.0);
        Self { view, matches, scale: before.scale * ratio }
    }
}

/// The frames of a sequence in order of their names.
fn frames(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let images = ["image_l", "image_0"].map(|name| folder.join(name)).into_iter().find(|p| p.is_dir());
    let images = images.ok_or_else(|| format!("{}: no folder image_l or image_0", folder.display()))?;
    let entries = fs::read_dir(&images).map_err(|e| format!("{}: {e}", images.display()))?;
    let is_image = |p: &PathBuf| p.extension().is_some_and(|e| e == "png" || e == "jpg" || e == "jpeg");
    let mut paths: Vec<PathBuf> = entries.filter_map(|e| e.ok().map(|e| e.path())).filter(is_image).collect();
    paths.sort();
    Ok(paths)
}

/// The lines of a text file as 3x4 matrices, row-major.
fn read_matrices(path: &Path) -> Result<Vec<[f64; 12]>, String> {
    let text = fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let row = |line: &str| {
        let numbers: Result<Vec<f64>, _> = line.split_whitespace().map(str::parse).collect();
        numbers.ok().and_then(|n| n.get(..12).and_then(|n| n.try_into().ok()))
    };
    let broken = |k: usize| format!("{}:{}: not twelve numbers", path.display(), k + 1);
    text.lines().enumerate().map(|(k, line)| row(line).ok_or_else(|| broken(k))).collect()
}

fn read_calibration(path: &Path) -> Result<CameraParameters, String> {
    let rows = read_matrices(path)?;
    let p = rows.first().ok_or_else(|| format!("{}: empty", path.display()))?;
    let camera = CameraParameters { intrinsics: [p[0], p[5], p[2], p[6]], lens: Lens::None };
    camera.camera::<f64>().map_err(|e| format!("{}: {e}", path.display()))?;
    Ok(camera)
}

/// Camera-to-world poses.
fn read_poses(path: &Path) -> Result<Vec<Isometry3<f64>>, String> {
    let pose = |p: [f64; 12]| {
        let m = Matrix3::new(p[0], p[1], p[2], p[4], p[5], p[6], p[8], p[9], p[10]);
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(m));
        Isometry3::from_parts(Vector3::new(p[3], p[7], p[11]).into(), rotation)
    };
    Ok(read_matrices(path)?.into_iter().map(pose).collect())
}
