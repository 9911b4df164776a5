//! The text format of correspondence files.
//!
//! One item a line; blank lines and lines that start with `#` are skipped, except that `# size W H` gives the size of
//! image 1 in pixels. The header, in any order, then the correspondences:
//!
//! ```text
//! K1 fx fy cx cy          relative pose and fundamental: pinhole intrinsics of both images, in pixels
//! K2 fx fy cx cy
//! R_gt r11 r12 .. r33     the true pose, row-major: x2 ~ K2 (R_gt X1 + t_gt); only t's direction counts
//! t_gt tx ty tz
//! H_gt h11 h12 .. h33     homography instead: x2 ~ H_gt x1
//! n N                     then N lines
//! x1 y1 x2 y2 score       pixels, the centre of the top-left pixel being (0, 0); lower scores are better
//! ```
//!
//! The score may be left out; such lines count as ordered best first.

use std::fs;
use std::path::{Path, PathBuf};

use epipole::nalgebra::{Matrix3, Vector2, Vector3};

/// What must be estimated; it decides which header lines a file needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Problem {
    RelativePose,
    Homography,
    Fundamental,
    AbsolutePose,
}

/// The ground truth of a file.
pub(crate) enum Truth {
    Pose(TruePose),
    Homography(Matrix3<f64>),
}

/// Pinhole cameras and `X2 = R X1 + t`, t of any length.
pub(crate) struct TruePose {
    pub(crate) intrinsics: [[f64; 4]; 2],
    pub(crate) rotation: Matrix3<f64>,
    pub(crate) translation: Vector3<f64>,
}

/// A correspondence: pixels in image 1 and image 2, and a score, lower is better.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Correspondence {
    pub(crate) x1: Vector2<f64>,
    pub(crate) x2: Vector2<f64>,
    pub(crate) score: f64,
}

/// A file as read.
pub(crate) struct CorrespondenceFile {
    /// Width and height of image 1.
    pub(crate) size: Option<[f64; 2]>,
    pub(crate) truth: Truth,
    pub(crate) correspondences: Vec<Correspondence>,
}

/// A file that cannot be used: `path:line: why`.
#[derive(Debug)]
pub(crate) struct BrokenFile {
    pub(crate) path: PathBuf,
    /// Counted from 1; 0 where the file as a whole is meant.
    pub(crate) line: usize,
    pub(crate) reason: String,
}

impl std::fmt::Display for BrokenFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.line {
            0 => write!(f, "{}: {}", self.path.display(), self.reason),
            line => write!(f, "{}:{line}: {}", self.path.display(), self.reason),
        }
    }
}

/// Reads a file, whole.
pub(crate) fn read(path: &Path, problem: Problem) -> Result<CorrespondenceFile, BrokenFile> {
    let broken = |line: usize, reason: String| BrokenFile { path: path.into(), line, reason };
    let text = fs::read_to_string(path).map_err(|e| broken(0, e.to_string()))?;
    parse(&text, problem)
        .map(|(size, truth, correspondences)| CorrespondenceFile { size, truth, correspondences })
        .map_err(|(line, reason)| broken(line, reason))
}

type Parsed = (Option<[f64; 2]>, Truth, Vec<Correspondence>);

fn parse(text: &str, problem: Problem) -> Result<Parsed, (usize, String)> {
    let mut header = Header::default();
    let mut announced = None;
    let mut correspondences = Vec::new();
    let mut last = 0;
    for (number, line) in (1..).zip(text.lines()) {
        let fail = |reason: String| (number, reason);
        if let Some(comment) = line.strip_prefix('#') {
            header.read_size(comment);
            continue;
        }
        let Some(key) = line.split_whitespace().next() else { continue };
        last = number;
        let Some(count) = announced else {
            let rest = line.trim_start().trim_start_matches(key);
            if key == "n" {
                let count = rest.trim().parse::<usize>();
                announced = Some(count.map_err(|_| fail(format!("`{}` is not a count", rest.trim())))?);
            } else {
                header.read(key, rest).map_err(fail)?;
            }
            continue;
        };
        if correspondences.len() == count {
            return Err(fail(format!("more than the {count} correspondences announced")));
        }
        let (x1, y1, x2, y2, score) = match *numbers(line).map_err(fail)?.as_slice() {
            [x1, y1, x2, y2] => (x1, y1, x2, y2, correspondences.len() as f64),
            [x1, y1, x2, y2, score] => (x1, y1, x2, y2, score),
            ref row => return Err(fail(format!("{} numbers, 4 or 5 needed", row.len()))),
        };
        correspondences.push(Correspondence { x1: Vector2::new(x1, y1), x2: Vector2::new(x2, y2), score });
    }
    let Some(count) = announced else {
        return Err((last, "no line `n N`".into()));
    };
    if correspondences.len() < count {
        return Err((last, format!("{} correspondences, {count} announced", correspondences.len())));
    }
    Ok((header.size, header.truth(problem).map_err(|reason| (0, reason))?, correspondences))
}

/// The header lines seen so far.
#[derive(Default)]
struct Header {
    size: Option<[f64; 2]>,
    intrinsics: [Option<[f64; 4]>; 2],
    rotation: Option<Matrix3<f64>>,
    translation: Option<Vector3<f64>>,
    homography: Option<Matrix3<f64>>,
}

impl Header {
    /// `size W H` of a comment; other comments say nothing.
    fn read_size(&mut self, comment: &str) {
        if let Some(rest) = comment.trim_start().strip_prefix("size ")
            && let Ok(size) = array::<2>(rest)
        {
            self.size = Some(size);
        }
    }

    fn read(&mut self, key: &str, rest: &str) -> Result<(), String> {
        match key {
            "K1" | "K2" => {
                let k = array::<4>(rest)?;
                if k[0] <= 0.0 || k[1] <= 0.0 {
                    return Err(format!("focal length of {key} is not positive"));
                }
                self.intrinsics[usize::from(key == "K2")] = Some(k);
            }
            "R_gt" => {
                let r = Matrix3::from_row_slice(&array::<9>(rest)?);
                if (r * r.transpose() - Matrix3::identity()).norm() > 1e-3 || r.determinant() < 0.0 {
                    return Err("R_gt is not a rotation".into());
                }
                self.rotation = Some(r);
            }
            "t_gt" => self.translation = Some(array::<3>(rest)?.into()),
            "H_gt" => self.homography = Some(Matrix3::from_row_slice(&array::<9>(rest)?)),
            _ => return Err(format!("unknown header `{key}`")),
        }
        Ok(())
    }

    fn truth(self, problem: Problem) -> Result<Truth, String> {
        let need = |key: &str| format!("no line `{key}`");
        if problem == Problem::Homography {
            return self.homography.map(Truth::Homography).ok_or_else(|| need("H_gt"));
        }
        let [k1, k2] = self.intrinsics;
        Ok(Truth::Pose(TruePose {
            intrinsics: [k1.ok_or_else(|| need("K1"))?, k2.ok_or_else(|| need("K2"))?],
            rotation: self.rotation.ok_or_else(|| need("R_gt"))?,
            translation: self.translation.ok_or_else(|| need("t_gt"))?,
        }))
    }
}

/// Finite numbers with spaces between them.
pub(crate) fn numbers(text: &str) -> Result<Vec<f64>, String> {
    text.split_whitespace()
        .map(|word| match word.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(format!("`{word}` is not a finite number")),
        })
        .collect()
}

pub(crate) fn array<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let numbers = numbers(text)?;
    numbers.try_into().map_err(|found: Vec<f64>| format!("{} numbers, {N} needed", found.len()))
}
