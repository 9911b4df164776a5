//! Synthetic problems with a known truth: a camera of 1241x376 pixels, f = 718, as the figures of other libraries were
//! measured with.

use std::f64::consts::PI;

use epipole::Real;
use epipole::geometry::Pose;
use epipole::nalgebra::{Matrix3, Translation3, Unit, UnitQuaternion, Vector2, Vector3};
use epipole::real::lit;

use crate::Rng;

/// Focal length of the scenes' camera, pixels.
pub const FOCAL: f64 = 718.0;
/// Principal point of the scenes' camera, pixels.
pub const CENTRE: (f64, f64) = (620.5, 188.0);
/// Width and height of the scenes' image, pixels.
pub const SIZE: (f64, f64) = (1241.0, 376.0);

/// The calibration matrix of the scenes' camera.
pub fn calibration() -> Matrix3<f64> {
    Matrix3::new(FOCAL, 0.0, CENTRE.0, 0.0, FOCAL, CENTRE.1, 0.0, 0.0, 1.0)
}

/// How the camera moves between the two views.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// Rotation to 20 degrees, |t| 0.5 to 2 in any direction, depth 2 to 20.
    General,
    /// Rotation to 20 degrees, |t| 0.2 to 1, depth 3 to 10.
    Small,
    /// Any rotation, |t| 0.5 to 2, depth 2 to 20: bearings, for a point may lie behind the second view.
    RandomPose,
    /// A vehicle driving ahead: rotation to 3 degrees, t near the optical axis, depth 5 to 50.
    Forward,
    /// Rotation about the y axis to 20 degrees, otherwise as `General`.
    Upright,
    /// Rotation to 20 degrees, t = 0, depth 2 to 20.
    PureRotation,
    /// The same view twice.
    Still,
}

/// What the camera sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Points at independent depths.
    Volume,
    /// Points of one plane that is seen from its front in both views.
    Plane,
    /// Points of one line in space.
    Line,
    /// This many distinct points, repeated; noise, if any, is drawn for each repetition.
    Repeated(usize),
    /// This many points at depths 2 to 3, the others at 20 to 60.
    NearObject(usize),
}

/// A recipe of two-view problems; [`Scene::generate`] cooks it for a seed.
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    /// How the camera moves.
    pub motion: Motion,
    /// What it sees.
    pub shape: Shape,
    /// How many correspondences.
    pub points: usize,
    /// Standard deviation of each image coordinate's Gaussian noise, pixels.
    pub noise_px: f64,
    /// Share of correspondences, 0 to 1, whose second point is anywhere in the image.
    pub outliers: f64,
}

impl Scene {
    /// Exact correspondences of points at independent depths.
    pub fn new(motion: Motion, points: usize) -> Self {
        Self { motion, shape: Shape::Volume, points, noise_px: 0.0, outliers: 0.0 }
    }

    /// The same with another shape.
    pub fn shape(self, shape: Shape) -> Self {
        Self { shape, ..self }
    }

    /// The same with Gaussian noise.
    pub fn noise_px(self, noise_px: f64) -> Self {
        Self { noise_px, ..self }
    }

    /// The same with a share of outliers, 0 to 1.
    pub fn outliers(self, outliers: f64) -> Self {
        Self { outliers, ..self }
    }

    /// The problem of a seed.
    pub fn generate(&self, seed: u64) -> TwoView {
        let mut rng = Rng::new(seed);
        loop {
            // A motion or plane that leaves nothing in the second view is drawn anew.
            if let Some(problem) = self.attempt(seed, &mut rng) {
                return problem;
            }
        }
    }

    fn attempt(&self, seed: u64, rng: &mut Rng) -> Option<TwoView> {
        let pose = self.pose(rng);
        let (near, far) = match self.motion {
            Motion::Small => (3.0, 10.0),
            Motion::Forward => (5.0, 50.0),
            _ => (2.0, 20.0),
        };
        let normal = (rng.normal3() + Vector3::new(0.0, 0.0, 4.0)).normalize();
        let plane = (normal, rng.range(6.0, 12.0));
        let ends = [0, 1].map(|_| pixel_ray(&random_pixel(rng)) * rng.range(near, far));
        let distinct = if let Shape::Repeated(n) = self.shape { n } else { self.points };

        let mut points = Vec::with_capacity(self.points);
        let mut tries = 0;
        while points.len() < distinct {
            tries += 1;
            if tries > 100 * distinct {
                return None;
            }
            let ray = pixel_ray(&random_pixel(rng));
            let point = match self.shape {
                Shape::Volume | Shape::Repeated(_) => ray * rng.range(near, far),
                Shape::Plane => ray * (plane.1 / plane.0.dot(&ray)),
                Shape::Line => ends[0] + (ends[1] - ends[0]) * rng.unit(),
                Shape::NearObject(near) if points.len() < near => ray * rng.range(2.0, 3.0),
                Shape::NearObject(_) => ray * rng.range(20.0, 60.0),
            };
            let (depth1, seen2) = (point.z, pose * epipole::nalgebra::Point3::from(point));
            let visible = match self.motion {
                Motion::RandomPose => seen2.coords.norm() > 0.3,
                _ => seen2.z > 0.3 && near_image(&ray_pixel(&seen2.coords)),
            };
            if visible && depth1 > 1.0 && depth1 < 60.0 {
                points.push(point);
            }
        }
        for k in distinct..self.points {
            points.push(points[k % distinct]);
        }

        let mut x1 = Vec::with_capacity(self.points);
        let mut x2 = Vec::with_capacity(self.points);
        for point in &points {
            x1.push(self.observe(point, rng));
            x2.push(self.observe(&(pose * epipole::nalgebra::Point3::from(*point)).coords, rng));
        }
        let mut inlier = vec![true; self.points];
        let wrong = (self.outliers * self.points as f64).round() as usize;
        for k in rng.permutation(self.points).into_iter().take(wrong) {
            inlier[k] = false;
            x2[k] = pixel_ray(&random_pixel(rng));
        }
        let plane = (self.shape == Shape::Plane).then_some(plane);
        Some(TwoView { seed, pose, points, x1, x2, inlier, plane })
    }

    fn pose(&self, rng: &mut Rng) -> Pose<f64> {
        let degree = PI / 180.0;
        let rotation = match self.motion {
            Motion::General | Motion::Small | Motion::PureRotation => rng.rotation(20.0 * degree),
            Motion::RandomPose => rng.rotation(PI),
            Motion::Forward => rng.rotation(3.0 * degree),
            Motion::Upright => {
                UnitQuaternion::from_axis_angle(&Vector3::y_axis(), rng.range(0.0, 20.0 * degree))
            }
            Motion::Still => UnitQuaternion::identity(),
        };
        let translation = match self.motion {
            Motion::PureRotation | Motion::Still => Vector3::zeros(),
            Motion::Small => rng.direction() * rng.range(0.2, 1.0),
            Motion::Forward => {
                let side = rng.normal3() * 0.05;
                Vector3::new(side.x, side.y, -1.0).normalize() * rng.range(0.5, 2.0)
            }
            _ => rng.direction() * rng.range(0.5, 2.0),
        };
        Pose::from_parts(Translation3::from(translation), rotation)
    }

    /// The point's image with noise, as a direction: `(x, y, 1)`, or a unit vector where any rotation is allowed.
    fn observe(&self, point: &Vector3<f64>, rng: &mut Rng) -> Vector3<f64> {
        let sigma = self.noise_px / FOCAL;
        let noise = Vector2::new(rng.normal(), rng.normal()) * sigma;
        if self.motion == Motion::RandomPose {
            let bearing = Unit::new_normalize(*point);
            let (e1, e2) = tangents(&bearing);
            (bearing.into_inner() + e1 * noise.x + e2 * noise.y).normalize()
        } else {
            Vector3::new(point.x / point.z + noise.x, point.y / point.z + noise.y, 1.0)
        }
    }
}

/// Two directions that make an orthonormal basis with `bearing`.
fn tangents(bearing: &Unit<Vector3<f64>>) -> (Vector3<f64>, Vector3<f64>) {
    let other = if bearing.x.abs() < 0.5 { Vector3::x() } else { Vector3::y() };
    let e1 = bearing.cross(&other).normalize();
    (e1, bearing.cross(&e1))
}

fn random_pixel(rng: &mut Rng) -> Vector2<f64> {
    Vector2::new(rng.range(0.0, SIZE.0), rng.range(0.0, SIZE.1))
}

fn pixel_ray(pixel: &Vector2<f64>) -> Vector3<f64> {
    Vector3::new((pixel.x - CENTRE.0) / FOCAL, (pixel.y - CENTRE.1) / FOCAL, 1.0)
}

fn ray_pixel(ray: &Vector3<f64>) -> Vector2<f64> {
    Vector2::new(FOCAL * ray.x / ray.z + CENTRE.0, FOCAL * ray.y / ray.z + CENTRE.1)
}

/// The second view is a little wider than the image, so that large motions keep enough points.
fn near_image(pixel: &Vector2<f64>) -> bool {
    let border = 600.0;
    pixel.x > -border && pixel.x < SIZE.0 + border && pixel.y > -border && pixel.y < SIZE.1 + border
}

fn rounded<T: Real>(v: &Vector3<f64>) -> Vector3<T> {
    v.map(lit)
}

/// A two-view problem with its truth. Measurements come out rounded to the scalar asked for.
#[derive(Clone, Debug)]
pub struct TwoView {
    /// The seed that makes this problem again.
    pub seed: u64,
    /// The true pose of view 2 in the frame of view 1.
    pub pose: Pose<f64>,
    /// The true points, in the frame of view 1.
    pub points: Vec<Vector3<f64>>,
    /// Measured directions of view 1, `(x, y, 1)` unless the motion is [`Motion::RandomPose`].
    pub x1: Vec<Vector3<f64>>,
    /// Measured directions of view 2.
    pub x2: Vec<Vector3<f64>>,
    /// False for an outlier.
    pub inlier: Vec<bool>,
    /// Normal n and distance d of the plane `n' X1 = d`, for a planar scene.
    pub plane: Option<(Vector3<f64>, f64)>,
}

impl TwoView {
    /// Measured directions as they stand in [`TwoView::x1`] and [`TwoView::x2`].
    pub fn rays<T: Real>(&self) -> (Vec<Vector3<T>>, Vec<Vector3<T>>) {
        (self.x1.iter().map(rounded).collect(), self.x2.iter().map(rounded).collect())
    }

    /// Measured directions as unit vectors.
    pub fn bearings<T: Real>(&self) -> (Vec<Vector3<T>>, Vec<Vector3<T>>) {
        let unit = |v: &Vector3<f64>| rounded(&v.normalize());
        (self.x1.iter().map(unit).collect(), self.x2.iter().map(unit).collect())
    }

    /// Measured pixels; without meaning for [`Motion::RandomPose`], where a point may lie behind the camera.
    pub fn pixels<T: Real>(&self) -> (Vec<Vector2<T>>, Vec<Vector2<T>>) {
        let pixel = |v: &Vector3<f64>| ray_pixel(v).map(lit);
        (self.x1.iter().map(pixel).collect(), self.x2.iter().map(pixel).collect())
    }

    /// Measured pixels as homogeneous vectors with third coordinate 1.
    pub fn homogeneous_pixels<T: Real>(&self) -> (Vec<Vector3<T>>, Vec<Vector3<T>>) {
        let pixel = |v: &Vector3<f64>| ray_pixel(v).push(1.0).map(lit);
        (self.x1.iter().map(pixel).collect(), self.x2.iter().map(pixel).collect())
    }

    /// `E = [t]x R`.
    pub fn essential(&self) -> Matrix3<f64> {
        self.pose.translation.vector.cross_matrix() * self.rotation()
    }

    /// `F = K^-T E K^-1`.
    pub fn fundamental(&self) -> Matrix3<f64> {
        let k_inverse = calibration().try_inverse().expect("a calibration matrix is regular");
        k_inverse.transpose() * self.essential() * k_inverse
    }

    /// `H = R + t n' / d` between normalised points, of a planar scene; `R` where t is 0.
    pub fn homography(&self) -> Matrix3<f64> {
        let (normal, distance) = self.plane.unwrap_or((Vector3::zeros(), 1.0));
        self.rotation() + self.pose.translation.vector * normal.transpose() / distance
    }

    /// The true rotation as a matrix.
    pub fn rotation(&self) -> Matrix3<f64> {
        self.pose.rotation.to_rotation_matrix().into_inner()
    }
}

/// A pose from points in space and their image.
#[derive(Clone, Debug)]
pub struct AbsoluteScene {
    /// The true pose, world to camera.
    pub pose: Pose<f64>,
    /// Points in the world's frame.
    pub points: Vec<Vector3<f64>>,
    /// Measured directions `(x, y, 1)` in the camera.
    pub x: Vec<Vector3<f64>>,
    /// False for an outlier.
    pub inlier: Vec<bool>,
}

impl AbsoluteScene {
    /// A camera anywhere within 10 units of the world's origin, looking anywhere, at depths 2 to 20; `scene` gives
    /// number, shape, noise and outliers, its motion only the range of depths.
    pub fn generate(scene: &Scene, seed: u64) -> Self {
        let two = scene.generate(seed);
        let mut rng = Rng::new(!seed);
        let rotation = rng.rotation(PI);
        let centre = rng.direction() * rng.range(0.0, 10.0);
        let pose = Pose::from_parts(Translation3::from(-(rotation * centre)), rotation);
        let points = two.points.iter().map(|p| rotation.inverse() * p + centre).collect();
        // View 1 has no outliers: what view 2 saw of the outliers, which is anywhere in the image, takes their place.
        let x = (0..scene.points).map(|k| if two.inlier[k] { two.x1[k] } else { two.x2[k] }).collect();
        Self { pose, points, x, inlier: two.inlier }
    }

    /// The points rounded to `T`.
    pub fn points<T: Real>(&self) -> Vec<Vector3<T>> {
        self.points.iter().map(rounded).collect()
    }

    /// Measured directions as unit vectors.
    pub fn bearings<T: Real>(&self) -> Vec<Vector3<T>> {
        self.x.iter().map(|v| rounded(&v.normalize())).collect()
    }

    /// Measured pixels.
    pub fn pixels<T: Real>(&self) -> Vec<Vector2<T>> {
        self.x.iter().map(|v| ray_pixel(v).map(lit)).collect()
    }
}
