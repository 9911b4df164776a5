//! From matched pixels of two images to a pose, inliers and points, in either scalar.

use std::str::FromStr;

use epipole::Real;
use epipole::estimate::{self, RelativePoseOptions, RelativePoseVerdict, TwoViewWorkspace, Unobservable};
use epipole::geometry::triangulation::{Triangulation, ViewPair};
use epipole::geometry::{Camera, CameraModel, Pose};
use epipole::nalgebra::{Isometry3, Matrix3, Quaternion, UnitQuaternion, Vector2, Vector3};
use epipole::real::lit;

use crate::features::FeatureOptions;
use crate::lens::{CameraParameters, numbers};
use crate::matching::Match;

/// What a user may choose of features and estimation, on the command line.
#[derive(clap::Args, Clone, Copy, Debug)]
pub struct Settings {
    /// Largest Sampson error of an inlier, in pixels.
    #[arg(long = "threshold", value_name = "PX", default_value_t = 1.0, allow_negative_numbers = true)]
    pub threshold_px: f64,
    /// Most features an image.
    #[arg(long, value_name = "N", default_value_t = FeatureOptions::default().max_features)]
    pub features: usize,
    /// Seed of the robust estimation.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Estimate in single precision.
    #[arg(long)]
    pub f32: bool,
}

impl Settings {
    /// Options of the feature detector.
    pub fn feature_options(&self) -> FeatureOptions {
        FeatureOptions { max_features: self.features, ..Default::default() }
    }
}

/// The pose between two views and what supports it.
#[derive(Clone, Debug)]
pub struct TwoView {
    /// `X2 = R X1 + t`, |t| = 1.
    pub pose: Isometry3<f64>,
    /// One entry a match.
    pub inliers: Vec<bool>,
    pub iterations: u32,
    /// Whether all inliers lie on one plane; then a second pose may explain them.
    pub planar: bool,
    /// Triangulated inliers in front of both cameras: index of the match, and the point in the frame of view 1.
    pub points: Vec<(usize, Vector3<f64>)>,
}

impl TwoView {
    pub fn inlier_count(&self) -> usize {
        self.inliers.iter().filter(|i| **i).count()
    }
}

/// Estimates the pose between two views.
///
/// # Errors
/// One sentence that says why there is none.
pub fn estimate<T: Real>(
    cameras: &[CameraParameters; 2],
    matches: &[Match],
    settings: &Settings,
) -> Result<TwoView, String> {
    let camera = |i: usize| cameras[i].camera::<T>().map_err(|e| e.to_string());
    let (camera1, camera2) = (camera(0)?, camera(1)?);
    let pixel = |p: [f64; 2]| Vector2::new(lit::<T>(p[0]), lit::<T>(p[1]));
    let x1: Vec<Vector2<T>> = matches.iter().map(|m| pixel(m.x1)).collect();
    let x2: Vec<Vector2<T>> = matches.iter().map(|m| pixel(m.x2)).collect();

    let mut options = RelativePoseOptions::<T>::default();
    options.max_error_px = lit(settings.threshold_px);
    options.ransac.seed = settings.seed;
    // Room for cameras of any kind: 18 numbers a correspondence, in groups of four.
    let capacity = matches.len().next_multiple_of(4);
    let (mut numbers, mut order) = (vec![T::ZERO; 18 * capacity], vec![0; capacity]);
    let mut inliers = vec![false; capacity];
    let mut workspace = TwoViewWorkspace::from_slices(&mut numbers, &mut order, &mut inliers);
    let estimate = estimate::relative_pose(&camera1, &camera2, &x1, &x2, &options, &mut workspace)
        .map_err(|e| e.to_string())?;
    let pose = estimate.pose().ok_or_else(|| no_pose(&estimate.verdict, matches.len()))?;
    let inliers = workspace.inliers().to_vec();
    Ok(TwoView {
        pose: widen(&pose),
        iterations: estimate.report.spent.iterations,
        planar: matches!(estimate.verdict, RelativePoseVerdict::Planar(_)),
        points: triangulate([&camera1, &camera2], &pose, &x1, &x2, &inliers),
        inliers,
    })
}

/// Why there is no pose, in a sentence.
fn no_pose<T: Real>(verdict: &RelativePoseVerdict<T>, matches: usize) -> String {
    match verdict {
        RelativePoseVerdict::PureRotation(motion) => {
            let angle = widen(&Pose::from_parts(Vector3::zeros().into(), motion.rotation)).rotation.angle();
            format!("the camera only turned, by {:.3} deg: no translation can be seen", angle.to_degrees())
        }
        RelativePoseVerdict::NoMotion => "the camera did not move".into(),
        RelativePoseVerdict::Unobservable(Unobservable::Collinear) => {
            "the matches lie on one line: no pose follows from them".into()
        }
        RelativePoseVerdict::Unobservable(_) => {
            "the matches repeat too few distinct points for a pose".into()
        }
        RelativePoseVerdict::TooFewInliers => {
            format!("too few of the {matches} matches agree to tell a pose from chance")
        }
        _ => format!("the {matches} matches agree on no pose"),
    }
}

/// The pose in double precision.
fn widen<T: Real>(pose: &Pose<T>) -> Isometry3<f64> {
    let (q, t) = (pose.rotation.coords, pose.translation.vector);
    let quaternion = Quaternion::from(q.map(|x| x.to_f64()));
    Isometry3::from_parts(t.map(|x| x.to_f64()).into(), UnitQuaternion::from_quaternion(quaternion))
}

/// The inliers' points with least reprojection error, where they lie in front of both cameras.
fn triangulate<T: Real>(
    cameras: [&Camera<T>; 2],
    pose: &Pose<T>,
    x1: &[Vector2<T>],
    x2: &[Vector2<T>],
    inliers: &[bool],
) -> Vec<(usize, Vector3<f64>)> {
    let pair = ViewPair::new(pose);
    let [camera1, camera2] = cameras;
    let point = |p: &Vector2<T>, q: &Vector2<T>| {
        let (f, j) = camera1.unproject_with_jacobian(p).ok()?;
        let (g, k) = camera2.unproject_with_jacobian(q).ok()?;
        match pair.triangulate_optimal_bearings(&f, &g, &j, &k) {
            Triangulation::Point(point) => Some(point.map(|x| x.to_f64())),
            _ => None,
        }
    };
    let pairs = x1.iter().zip(x2).zip(inliers).enumerate().filter(|(_, (_, inlier))| **inlier);
    pairs.filter_map(|(index, ((p, q), _))| point(p, q).map(|x| (index, x))).collect()
}

/// A pose as it is compared and written: a rotation matrix and a translation. It is parsed from twelve numbers, `R`
/// row-major and `t`.
#[derive(Clone, Copy, Debug)]
pub struct Truth {
    pub rotation: Matrix3<f64>,
    pub translation: Vector3<f64>,
}

impl FromStr for Truth {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let n = numbers(text)?;
        if n.len() != 12 {
            return Err(format!("{} numbers given, 12 needed: r11,r12,..,r33,tx,ty,tz", n.len()));
        }
        let rotation = Matrix3::from_row_slice(&n[..9]);
        let translation = Vector3::from_column_slice(&n[9..]);
        if (rotation * rotation.transpose() - Matrix3::identity()).norm() > 1e-3 {
            return Err("the first nine numbers are not a rotation".into());
        }
        Ok(Self { rotation, translation })
    }
}

impl From<Isometry3<f64>> for Truth {
    fn from(pose: Isometry3<f64>) -> Self {
        let rotation = pose.rotation.to_rotation_matrix().into_inner();
        Self { rotation, translation: pose.translation.vector }
    }
}

/// The angle between two rotations in degrees, by the chord: `|A - B|_F = 2 sqrt 2 sin(angle / 2)`.
#[must_use]
pub fn rotation_error_deg(a: &Matrix3<f64>, b: &Matrix3<f64>) -> f64 {
    (2.0 * ((a - b).norm() / 8f64.sqrt()).min(1.0).asin()).to_degrees()
}

/// The angle between two directions in degrees, by the chord.
#[must_use]
pub fn direction_error_deg(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    (2.0 * ((a.normalize() - b.normalize()).norm() / 2.0).min(1.0).asin()).to_degrees()
}
