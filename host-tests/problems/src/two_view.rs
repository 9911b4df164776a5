//! Correspondences of two views under a known motion, the same as those by which other libraries were measured on
//! microcontrollers: general motion, vertical axis, plane, and matches of which some are wrong.

use epipole::Real;
use epipole::geometry::Pose;
use epipole::nalgebra::{Matrix3, Quaternion, Translation3, UnitQuaternion, Vector2, Vector3};
use epipole::real::{lit, sin_cos, sqrt};

use crate::random::SplitMix64;

/// What scene and motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Geometry {
    /// Any rotation up to 20 degrees, any direction; without noise.
    General = 1,
    /// A rotation about y; without noise.
    Upright = 3,
    /// Points of a plane; without noise.
    Planar = 5,
    /// Noise of a pixel at a focal length of 500; of 100 points, the first 30 are wrong matches.
    Ransac = 7,
}

/// The focal length, in pixels, at which noise is one pixel.
pub const FOCAL: f64 = 500.0;

/// A scene of `N` points in two views, in double precision. `X2 = R X1 + t`.
#[derive(Clone, Debug)]
pub struct TwoView<const N: usize> {
    /// Points in the frame of view 1.
    pub points: [Vector3<f64>; N],
    /// On the plane z = 1 of view 1, as measured.
    pub x1: [Vector2<f64>; N],
    /// On the plane z = 1 of view 2, as measured.
    pub x2: [Vector2<f64>; N],
    /// R.
    pub rotation: Matrix3<f64>,
    /// t.
    pub translation: Vector3<f64>,
    /// n / d of the plane of a planar scene; zero otherwise.
    pub plane: Vector3<f64>,
}

impl<const N: usize> TwoView<N> {
    /// Scene `k` of a kind.
    #[must_use]
    pub fn new(geometry: Geometry, k: u32) -> Self {
        let seed = 0x5EED_0000 + 65_536 * geometry as u64 + u64::from(k);
        let mut random = SplitMix64(seed);
        let mut axis = random.direction();
        if geometry == Geometry::Upright {
            axis = Vector3::y();
        }
        let rotation = rodrigues(&axis, random.between(0.0, 20.0 * core::f64::consts::PI / 180.0));
        let direction = random.direction();
        let translation = direction * random.between(0.2, 1.0);
        let mut plane = Vector3::zeros();
        if geometry == Geometry::Planar {
            let n = Vector3::new(random.between(-0.3, 0.3), random.between(-0.3, 0.3), 1.0);
            plane = n / sqrt(n.norm_squared());
            plane /= random.between(4.0, 8.0);
        }
        let mut scene = Self {
            points: [Vector3::zeros(); N],
            x1: [Vector2::zeros(); N],
            x2: [Vector2::zeros(); N],
            rotation,
            translation,
            plane,
        };
        for ((point, x1), x2) in scene.points.iter_mut().zip(&mut scene.x1).zip(&mut scene.x2) {
            loop {
                let ray = Vector3::new(random.between(-0.6, 0.6), random.between(-0.45, 0.45), 1.0);
                let mut z = random.between(3.0, 10.0);
                if geometry == Geometry::Planar {
                    z = 1.0 / plane.dot(&ray);
                }
                let second = rotation * ray * z + translation;
                if second.z >= 0.5 {
                    (*point, *x1, *x2) = (ray * z, ray.xy(), second.xy() / second.z);
                    break;
                }
            }
        }
        if geometry == Geometry::Ransac { scene.spoiled_by(seed) } else { scene }
    }

    /// The scene with noise on all points, and wrong matches in place of the first 30 of 100.
    #[must_use]
    pub fn spoiled(self) -> Self {
        self.spoiled_by(0)
    }

    fn spoiled_by(mut self, seed: u64) -> Self {
        let random = &mut SplitMix64(seed ^ 0xA5A5_A5A5);
        for x in self.x1.iter_mut().zip(&mut self.x2).flat_map(|(a, b)| [a, b]) {
            *x += Vector2::from(random.normal_pair()) / FOCAL;
        }
        for x in self.x2.iter_mut().take(N * 3 / 10) {
            *x = Vector2::new(random.between(-0.6, 0.6), random.between(-0.45, 0.45));
        }
        self
    }

    /// Unit bearings of the first `M` points in both views.
    #[must_use]
    pub fn bearings<T: Real, const M: usize>(&self) -> [[Vector3<T>; M]; 2] {
        let unit = |x: Option<&Vector2<f64>>| {
            let v = x.map_or(Vector3::z(), |x| Vector3::new(x.x, x.y, 1.0));
            cast(&(v / sqrt(v.norm_squared())))
        };
        [&self.x1, &self.x2].map(|x| core::array::from_fn(|i| unit(x.get(i))))
    }

    /// Pixels of both views in a camera with the focal length [`FOCAL`] and its principal point at (0, 0).
    #[must_use]
    pub fn pixels<T: Real>(&self) -> [[Vector2<T>; N]; 2] {
        [&self.x1, &self.x2].map(|x| x.map(|x| Vector2::new(lit(FOCAL * x.x), lit(FOCAL * x.y))))
    }

    /// The first `M` points, in the frame of view 1.
    #[must_use]
    pub fn points<T: Real, const M: usize>(&self) -> [Vector3<T>; M] {
        core::array::from_fn(|i| self.points.get(i).map_or_else(Vector3::zeros, cast))
    }

    /// The true pose of view 2.
    #[must_use]
    pub fn pose<T: Real>(&self) -> Pose<T> {
        cast_pose(&epipole::geometry::pose::from_parts(&self.rotation, &self.translation))
    }

    /// How far a rotation is from the true one, rad: `2 asin(|R - R_true| / (2 sqrt 2))`, in double precision.
    #[must_use]
    pub fn rotation_error<T: Real>(&self, rotation: &UnitQuaternion<T>) -> f64 {
        let [x, y, z, w] = rotation.coords.data.0[0].map(|c| c.to_f64());
        let n = sqrt(x * x + y * y + z * z + w * w);
        let q = Quaternion::new(w / n, x / n, y / n, z / n);
        let r = UnitQuaternion::new_unchecked(q).to_rotation_matrix().into_inner();
        let half = sqrt((r - self.rotation).norm_squared() / 8.0);
        let half = if half < 1.0 { half } else { 1.0 };
        2.0 * epipole::real::atan2(half, sqrt(1.0 - half * half))
    }

    /// The distance of a matrix, of any scale and sign, from `[t]x R`, both of Frobenius norm 1.
    #[must_use]
    pub fn essential_error<T: Real>(&self, e: &Matrix3<T>) -> f64 {
        distance(e, &(epipole::geometry::pose::skew(&self.translation) * self.rotation))
    }

    /// The distance of a homography from `R + t n' / d`, both of Frobenius norm 1.
    #[must_use]
    pub fn homography_error<T: Real>(&self, h: &Matrix3<T>) -> f64 {
        distance(h, &(self.rotation + self.translation * self.plane.transpose()))
    }
}

fn distance<T: Real>(found: &Matrix3<T>, truth: &Matrix3<f64>) -> f64 {
    let found = found.map(|x| x.to_f64());
    let (a, b) = (found / sqrt(found.norm_squared()), truth / sqrt(truth.norm_squared()));
    let [plus, minus] = [(a - b).norm_squared(), (a + b).norm_squared()];
    sqrt(if plus < minus { plus } else { minus })
}

fn cast<T: Real>(v: &Vector3<f64>) -> Vector3<T> {
    v.map(|x| lit(x))
}

/// A pose, rounded.
#[must_use]
pub fn cast_pose<T: Real>(pose: &Pose<f64>) -> Pose<T> {
    let [x, y, z, w] = pose.rotation.coords.data.0[0].map(lit::<T>);
    let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
    Pose::from_parts(Translation3::from(cast(&pose.translation.vector)), rotation)
}

/// The rotation about a unit axis.
fn rodrigues(axis: &Vector3<f64>, angle: f64) -> Matrix3<f64> {
    let k = epipole::geometry::pose::skew(axis);
    let (sin, cos) = sin_cos(angle);
    Matrix3::identity() + k * sin + k * k * (1.0 - cos)
}
