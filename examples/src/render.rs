//! The built-in scene: a gallery with a tiled floor, a brick wall, pictures, crates and stone balls at several
//! depths, ray-cast for any camera pose. Lengths are in metres, in the frame of camera 1.

use epipole::nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector2, Vector3};
use image::RgbImage;

use crate::noise::{Rng, mix};
use crate::texture::{Colour, Texture};

type V3 = Vector3<f32>;

/// Rays a pixel side: each pixel is the mean of their square.
const SAMPLES: u32 = 2;

/// Size and intrinsics of the built-in camera.
pub const WIDTH: u32 = 960;
pub const HEIGHT: u32 = 640;
/// `fx, fy, cx, cy` in pixels.
pub const INTRINSICS: [f64; 4] = [820.0, 820.0, 479.5, 319.5];
/// Deviation of the images' noise, in grey values of 255.
const NOISE: f32 = 2.0;

/// The pose of view 2 in the frame of view 1: `X2 = R X1 + t`.
pub fn true_pose() -> Isometry3<f64> {
    let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(0.035, 0.14, -0.03));
    let centre = Vector3::new(-0.85, -0.12, 0.35);
    Isometry3::from_parts(Translation3::from(-(rotation * centre)), rotation)
}

/// Both images of the built-in scene, noise included.
pub fn image_pair() -> (RgbImage, RgbImage) {
    (render(&Isometry3::identity(), 1), render(&true_pose(), 2))
}

enum Shape {
    /// A rectangle: its corner, the directions and lengths of its sides, its normal.
    Rectangle {
        corner: V3,
        sides: [V3; 2],
        extent: Vector2<f32>,
        normal: V3,
    },
    Sphere {
        centre: V3,
        radius: f32,
    },
}

struct Object {
    shape: Shape,
    texture: Texture,
}

impl Shape {
    /// Where along the ray the surface is met, in lengths of `direction`, if nearer than `limit`.
    fn hit(&self, origin: &V3, direction: &V3, limit: f32) -> Option<f32> {
        const NEAREST: f32 = 1e-3;
        match self {
            Self::Rectangle { corner, sides, extent, normal } => {
                let to = corner - origin;
                let distance = to.dot(normal) / direction.dot(normal);
                if !(distance > NEAREST && distance < limit) {
                    return None;
                }
                let p = direction * distance - to;
                let (u, v) = (p.dot(&sides[0]), p.dot(&sides[1]));
                (u >= 0.0 && v >= 0.0 && u <= extent.x && v <= extent.y).then_some(distance)
            }
            Self::Sphere { centre, radius } => {
                let to = origin - centre;
                let (a, b) = (direction.norm_squared(), to.dot(direction));
                let disc = b * b - a * (to.norm_squared() - radius * radius);
                if disc < 0.0 {
                    return None;
                }
                let distance = (-b - disc.sqrt()) / a;
                (distance > NEAREST && distance < limit).then_some(distance)
            }
        }
    }

    /// At a point of the surface seen along `direction`: the normal towards the viewer, the place on the surface in
    /// metres (on a sphere along its parallels and meridians), and the surface's size.
    fn surface(&self, point: &V3, direction: &V3) -> (V3, Vector2<f32>, Vector2<f32>) {
        match self {
            Self::Rectangle { corner, sides, extent, normal } => {
                let p = point - corner;
                let facing = if direction.dot(normal) > 0.0 { -normal } else { *normal };
                (facing, Vector2::new(p.dot(&sides[0]), p.dot(&sides[1])), *extent)
            }
            Self::Sphere { centre, radius } => {
                let normal = (point - centre) / *radius;
                let uv = Vector2::new(normal.x.atan2(-normal.z), normal.y.clamp(-1.0, 1.0).asin()) * *radius;
                (normal, uv, Vector2::repeat(*radius))
            }
        }
    }
}

fn quad(corner: V3, u: V3, v: V3, texture: Texture) -> Object {
    let extent = Vector2::new(u.norm(), v.norm());
    let shape = Shape::Rectangle {
        corner,
        sides: [u / extent.x, v / extent.y],
        extent,
        normal: u.cross(&v).normalize(),
    };
    Object { shape, texture }
}

fn rectangle(corner: [f32; 3], u: [f32; 3], v: [f32; 3], texture: Texture) -> Object {
    quad(corner.into(), u.into(), v.into(), texture)
}

fn sphere(centre: [f32; 3], radius: f32, texture: Texture) -> Object {
    Object { shape: Shape::Sphere { centre: centre.into(), radius }, texture }
}

/// The five visible faces of a crate standing on the floor, turned about the vertical.
fn crate_box(objects: &mut Vec<Object>, foot: [f32; 3], side: [f32; 3], turn: f32, seed: u32) {
    let (s, c) = turn.sin_cos();
    let (u, w, v) =
        (V3::new(c, 0.0, s) * side[0], V3::new(-s, 0.0, c) * side[2], V3::new(0.0, -side[1], 0.0));
    let corner = V3::from(foot) - (u + w) / 2.0;
    let faces = [(corner, u, v), (corner + w, u, v), (corner, w, v), (corner + u, w, v), (corner + v, u, w)];
    for (i, (corner, u, v)) in faces.into_iter().enumerate() {
        objects.push(quad(corner, u, v, Texture::Crate(seed + i as u32)));
    }
}

/// Everything in the room; camera 1 stands at the origin, the floor 1.5 m below it.
fn scene() -> Vec<Object> {
    const FLOOR: f32 = 1.5;
    const TOP: f32 = -3.2;
    let height = FLOOR - TOP;
    let mut objects = vec![
        rectangle([-6.0, FLOOR, -1.0], [13.0, 0.0, 0.0], [0.0, 0.0, 12.0], Texture::Tiles),
        rectangle([-6.0, TOP, 9.5], [13.0, 0.0, 0.0], [0.0, height, 0.0], Texture::Bricks),
        rectangle([-4.2, TOP, -1.0], [0.0, 0.0, 11.0], [0.0, height, 0.0], Texture::Plaster(3)),
        rectangle([5.2, TOP, -1.0], [0.0, 0.0, 11.0], [0.0, height, 0.0], Texture::Planks),
        rectangle([-6.0, TOP, -1.0], [13.0, 0.0, 0.0], [0.0, 0.0, 12.0], Texture::Plaster(4)),
        // Pictures, a hand's breadth before their wall.
        rectangle([-2.9, -1.9, 9.35], [2.4, 0.0, 0.0], [0.0, 1.9, 0.0], Texture::Cells(11)),
        rectangle([0.6, -2.0, 9.35], [3.0, 0.0, 0.0], [0.0, 2.0, 0.0], Texture::Julia),
        rectangle([-4.05, -1.5, 3.6], [0.0, 0.0, 1.9], [0.0, 1.7, 0.0], Texture::Cells(23)),
        rectangle([-4.05, -1.4, 6.4], [0.0, 0.0, 1.8], [0.0, 1.5, 0.0], Texture::Mosaic(5)),
        rectangle([5.05, -1.6, 5.2], [0.0, 0.0, 2.6], [0.0, 1.8, 0.0], Texture::Mosaic(9)),
        // A board that leans on nothing, close to the cameras.
        rectangle([1.25, -0.55, 3.3], [1.25, 0.0, 0.55], [0.1, 1.5, -0.12], Texture::Mosaic(31)),
        sphere([-0.35, 0.95, 4.0], 0.55, Texture::Marble(2)),
        sphere([-1.9, 1.05, 3.4], 0.45, Texture::Marble(7)),
        sphere([2.9, 0.75, 7.0], 0.75, Texture::Marble(12)),
    ];
    crate_box(&mut objects, [-2.3, FLOOR, 6.2], [1.5, 1.5, 1.5], 0.45, 40);
    crate_box(&mut objects, [-2.2, FLOOR - 1.5, 6.2], [0.8, 0.8, 0.8], -0.25, 50);
    crate_box(&mut objects, [0.75, FLOOR, 5.9], [1.2, 1.0, 1.0], -0.6, 60);
    crate_box(&mut objects, [3.6, FLOOR, 4.6], [0.9, 1.9, 0.9], 0.3, 70);
    objects
}

/// The image a camera at `pose` (world to camera) sees, with noise of the given seed.
pub fn render(pose: &Isometry3<f64>, noise_seed: u64) -> RgbImage {
    let objects = scene();
    let inverse = pose.inverse();
    let turn = inverse.rotation.cast::<f32>();
    let origin: V3 = inverse.translation.vector.cast();
    let mut image = RgbImage::new(WIDTH, HEIGHT);
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
    let rows = (HEIGHT as usize).div_ceil(threads * 8);
    let mut bands: Vec<_> = image.chunks_mut(rows * 3 * WIDTH as usize).enumerate().collect();
    std::thread::scope(|scope| {
        // Bands go around the threads, because the floor costs less than the pictures.
        let mut shares: Vec<Vec<_>> = (0..threads).map(|_| Vec::new()).collect();
        for (i, band) in bands.drain(..) {
            shares[i % threads].push((i * rows, band));
        }
        for share in shares {
            let objects = &objects;
            scope.spawn(move || {
                for (first_row, band) in share {
                    for (i, pixel) in band.chunks_mut(3).enumerate() {
                        let (x, y) = ((i as u32) % WIDTH, (first_row as u32) + (i as u32) / WIDTH);
                        let colour = pixel_colour(objects, &origin, &turn, x, y);
                        let mut rng = Rng::new(mix(noise_seed) ^ u64::from(y * WIDTH + x));
                        let noise = rng.gaussian() * NOISE;
                        for (out, c) in pixel.iter_mut().zip(colour.iter()) {
                            *out =
                                (255.0 * c.max(0.0).powf(1.0 / 2.2) + noise).round().clamp(0.0, 255.0) as u8;
                        }
                    }
                }
            });
        }
    });
    image
}

fn pixel_colour(objects: &[Object], origin: &V3, turn: &UnitQuaternion<f32>, x: u32, y: u32) -> Colour {
    let [fx, fy, cx, cy] = INTRINSICS.map(|p| p as f32);
    let mut sum = Colour::zeros();
    for j in 0..SAMPLES {
        for i in 0..SAMPLES {
            let offset = |k: u32| (k as f32 + 0.5) / SAMPLES as f32 - 0.5;
            let ray = V3::new((x as f32 + offset(i) - cx) / fx, (y as f32 + offset(j) - cy) / fy, 1.0);
            sum += trace(objects, origin, &(turn * ray));
        }
    }
    sum / (SAMPLES * SAMPLES) as f32
}

/// The light that comes along a ray: two lamps with shadows, and light from everywhere.
fn trace(objects: &[Object], origin: &V3, direction: &V3) -> Colour {
    const LAMPS: [([f32; 3], f32); 2] = [([2.2, -2.9, 2.0], 15.0), ([-2.6, -2.8, 5.0], 8.0)];
    let mut nearest: Option<(f32, &Object)> = None;
    for object in objects {
        let limit = nearest.map_or(f32::MAX, |n| n.0);
        if let Some(distance) = object.shape.hit(origin, direction, limit) {
            nearest = Some((distance, object));
        }
    }
    let Some((distance, object)) = nearest else {
        return Colour::zeros();
    };
    let point = origin + direction * distance;
    let (normal, uv, extent) = object.shape.surface(&point, direction);
    let outside = point + normal * 2e-3;
    let mut light = Colour::new(0.30, 0.32, 0.36) * (0.75 - 0.25 * normal.y);
    for (lamp, power) in LAMPS {
        let to_lamp = V3::from(lamp) - outside;
        let facing = normal.dot(&to_lamp) / to_lamp.norm();
        let shadowed = || objects.iter().any(|o| o.shape.hit(&outside, &to_lamp, 1.0).is_some());
        if facing > 0.0 && !shadowed() {
            light += Colour::new(1.0, 0.93, 0.82) * (facing * power / (4.0 + to_lamp.norm_squared()));
        }
    }
    object.texture.colour(uv, extent).component_mul(&light)
}
