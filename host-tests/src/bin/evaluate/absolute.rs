//! Absolute pose: files of pixels and world points, the estimate of one, and its errors.
//!
//! ```text
//! K fx fy cx cy
//! R_gt r11 r12 .. r33     the true pose, row-major: x ~ K (R_gt X + t_gt)
//! t_gt tx ty tz
//! n N                     then N lines
//! X Y Z u v score         world point and pixel; lower scores are better, and they may be left out
//! ```

use std::fs;
use std::path::Path;
use std::time::Instant;

use epipole::Real;
use epipole::estimate::{
    AbsolutePose, AbsolutePoseOptions, AbsolutePoseVerdict, AbsolutePoseWorkspace, absolute_pose_guided,
};
use epipole::nalgebra::{Matrix3, Vector2, Vector3};
use epipole::real::lit;
use epipole::robust::Guide;

use crate::file::{BrokenFile, array, numbers};
use crate::run::{Settings, doubt, name, next_random, pinhole, spread};
use crate::score::{Outcome, REFUSED, rotation_error_deg};

/// A file as read.
pub(crate) struct AbsoluteFile {
    size: Option<[f64; 2]>,
    intrinsics: [f64; 4],
    rotation: Matrix3<f64>,
    translation: Vector3<f64>,
    /// World point, pixel, score.
    rows: Vec<(Vector3<f64>, Vector2<f64>, f64)>,
}

pub(crate) fn read(path: &Path) -> Result<AbsoluteFile, BrokenFile> {
    let broken = |line: usize, reason: String| BrokenFile { path: path.into(), line, reason };
    let text = fs::read_to_string(path).map_err(|e| broken(0, e.to_string()))?;
    parse(&text).map_err(|(line, reason)| broken(line, reason))
}

fn parse(text: &str) -> Result<AbsoluteFile, (usize, String)> {
    let (mut size, mut k, mut r, mut t) = (None, None, None, None);
    let mut announced = None;
    let mut rows = Vec::new();
    let mut last = 0;
    for (number, line) in (1..).zip(text.lines()) {
        let fail = |reason: String| (number, reason);
        if let Some(comment) = line.strip_prefix('#') {
            if let Some(rest) = comment.trim_start().strip_prefix("size ") {
                size = array::<2>(rest).ok();
            }
            continue;
        }
        let Some(key) = line.split_whitespace().next() else { continue };
        last = number;
        let Some(count) = announced else {
            let rest = line.trim_start().trim_start_matches(key);
            match key {
                "K" => {
                    let found = array::<4>(rest).map_err(fail)?;
                    if found[0] <= 0.0 || found[1] <= 0.0 {
                        return Err(fail("focal length of K is not positive".into()));
                    }
                    k = Some(found);
                }
                "R_gt" => {
                    let found = Matrix3::from_row_slice(&array::<9>(rest).map_err(fail)?);
                    if (found * found.transpose() - Matrix3::identity()).norm() > 1e-3 {
                        return Err(fail("R_gt is not a rotation".into()));
                    }
                    r = Some(found);
                }
                "t_gt" => t = Some(Vector3::from(array::<3>(rest).map_err(fail)?)),
                "n" => {
                    let count = rest.trim().parse::<usize>();
                    announced = Some(count.map_err(|_| fail(format!("`{}` is not a count", rest.trim())))?);
                }
                _ => return Err(fail(format!("unknown header `{key}`"))),
            }
            continue;
        };
        if rows.len() == count {
            return Err(fail(format!("more than the {count} correspondences announced")));
        }
        let row = numbers(line).map_err(fail)?;
        let (&[x, y, z, u, v], score) = match row.split_first_chunk::<5>() {
            Some((five, [])) => (five, rows.len() as f64),
            Some((five, &[score])) => (five, score),
            _ => return Err(fail(format!("{} numbers, 5 or 6 needed", row.len()))),
        };
        rows.push((Vector3::new(x, y, z), Vector2::new(u, v), score));
    }
    let Some(count) = announced else { return Err((last, "no line `n N`".into())) };
    if rows.len() < count {
        return Err((last, format!("{} correspondences, {count} announced", rows.len())));
    }
    let need = |key: &str| (0, format!("no line `{key}`"));
    Ok(AbsoluteFile {
        size,
        intrinsics: k.ok_or_else(|| need("K"))?,
        rotation: r.ok_or_else(|| need("R_gt"))?,
        translation: t.ok_or_else(|| need("t_gt"))?,
        rows,
    })
}

/// Judges the estimate of one file in one scalar: rotation in degrees, and the camera's position in percent of its
/// distance from the middle of the points.
pub(crate) fn run<T: Real>(file: &AbsoluteFile, settings: &Settings) -> Outcome {
    // The best by score, then shuffled: a file is sorted, and an estimator must not profit.
    let mut rows = file.rows.clone();
    rows.sort_by(|a, b| a.2.total_cmp(&b.2));
    rows.truncate(settings.max_correspondences.unwrap_or(usize::MAX));
    let mut state = settings.seed;
    for i in (1..rows.len()).rev() {
        rows.swap(i, (next_random(&mut state) % (i as u64 + 1)) as usize);
    }
    let pixels: Vec<Vector2<T>> = rows.iter().map(|row| row.1.map(lit)).collect();
    let points: Vec<Vector3<T>> = rows.iter().map(|row| row.0.map(lit)).collect();
    let threshold = if file.size.is_some_and(|[width, _]| width > 2000.0) { 4.0 } else { 2.0 };
    let mut options = AbsolutePoseOptions::default();
    options.max_error_px = lit(settings.threshold_px.unwrap_or(threshold));
    settings.apply(&mut options.ransac);
    let count = rows.len().next_multiple_of(4);
    let (mut numbers, mut order, mut inliers) =
        (vec![T::ZERO; 5 * count], vec![0; count], vec![false; count]);
    let mut workspace = AbsolutePoseWorkspace::from_slices(&mut numbers, &mut order, &mut inliers);
    let start = Instant::now();
    let mut keep_going = settings.keep_going(start);
    let guide = Guide { scores: None, keep_going: Some(&mut keep_going) };
    let camera = pinhole::<T>(file.intrinsics);
    let answer = absolute_pose_guided(&camera, &pixels, &points, &options, guide, &mut workspace);
    let milliseconds = 1e3 * start.elapsed().as_secs_f64();
    let estimate = match answer {
        Ok(estimate) => estimate,
        Err(error) => {
            return Outcome {
                errors: [REFUSED; 2],
                correspondences: rows.len(),
                inliers: 0,
                iterations: 0,
                milliseconds,
                doubt: f64::INFINITY,
                refusal: error.to_string(),
            };
        }
    };
    let (errors, refusal) = match estimate.pose() {
        Some(pose) => {
            let found = pose.rotation.to_rotation_matrix().matrix().map(T::to_f64);
            let centre = -(found.transpose() * pose.translation.vector.map(T::to_f64));
            let truth = -(file.rotation.transpose() * file.translation);
            let middle = rows.iter().map(|row| row.0).sum::<Vector3<f64>>() / rows.len() as f64;
            let position = 100.0 * (centre - truth).norm() / (middle - truth).norm();
            ([rotation_error_deg(&found, &file.rotation), position], String::new())
        }
        None => ([REFUSED; 2], name(&estimate.verdict)),
    };
    // The rotation's part: the translation has the unit of the points. A plane's two poses, as in two views.
    let rotation =
        |found: &AbsolutePose<T>| spread(found.covariance.map(|c| c.fixed_view::<3, 3>(0, 0).into_owned()));
    let spread = match &estimate.verdict {
        AbsolutePoseVerdict::Pose(found) => rotation(found),
        AbsolutePoseVerdict::PlanarAmbiguity(poses) => 1.0 + poses.first().map_or(f64::INFINITY, rotation),
        _ => f64::INFINITY,
    };
    Outcome {
        errors,
        doubt: doubt(spread, &estimate.report, rows.len()),
        correspondences: rows.len(),
        inliers: estimate.report.inliers,
        iterations: estimate.report.spent.iterations,
        milliseconds,
        refusal,
    }
}
