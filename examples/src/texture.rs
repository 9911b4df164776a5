//! Procedural textures of the built-in scene: linear colours as a function of the place on a surface, in metres.

use epipole::nalgebra::{Vector2, Vector3};

use crate::noise::{fractal, lattice, value};

/// Linear red, green, blue, 1 for white.
pub type Colour = Vector3<f32>;

/// What a surface is made of; the number is a seed.
#[derive(Clone, Copy)]
pub enum Texture {
    Tiles,
    Bricks,
    Planks,
    Plaster(u32),
    Marble(u32),
    Crate(u32),
    /// A framed picture of coloured cells with dark borders.
    Cells(u32),
    /// A framed picture of small squares.
    Mosaic(u32),
    /// A framed picture of a Julia set.
    Julia,
}

fn rgb(r: f32, g: f32, b: f32) -> Colour {
    Colour::new(r, g, b)
}

fn mix(a: Colour, b: Colour, t: f32) -> Colour {
    a.lerp(&b, t.clamp(0.0, 1.0))
}

/// A warm colour of a hue in turns (a cosine palette).
fn hue(h: f32) -> Colour {
    let wave = |middle: f32, shift: f32| middle + 0.32 * (std::f32::consts::TAU * (h + shift)).cos();
    rgb(wave(0.56, 0.0), wave(0.48, 0.28), wave(0.46, 0.52)).map(|c| c * c)
}

impl Texture {
    /// The colour at `uv`, on a surface of the given sides.
    pub fn colour(self, uv: Vector2<f32>, extent: Vector2<f32>) -> Colour {
        let (u, v) = (uv.x, uv.y);
        match self {
            Self::Tiles => tiles(u, v),
            Self::Bricks => bricks(u, v),
            Self::Planks => planks(u, v, 0.22, 77),
            Self::Plaster(seed) => plaster(u, v, seed),
            Self::Marble(seed) => marble(u, v, extent.x, seed),
            Self::Crate(seed) => crate_side(u, v, extent, seed),
            Self::Cells(seed) => framed(uv, extent, |u, v| cells(u * 6.0, v * 6.0, seed)),
            Self::Mosaic(seed) => framed(uv, extent, |u, v| mosaic(u, v, seed)),
            Self::Julia => {
                framed(uv, extent, |u, v| julia(u / extent.x * 3.0 - 1.5, (v / extent.y - 0.5) * 2.0))
            }
        }
    }
}

/// Stone tiles of 40 cm, each of its own tone, with a dark inlay in some.
fn tiles(u: f32, v: f32) -> Colour {
    const SIDE: f32 = 0.4;
    let (i, j) = ((u / SIDE).floor(), (v / SIDE).floor());
    let (x, y) = (u / SIDE - i, v / SIDE - j);
    let (i, j) = (i as i32, j as i32);
    let edge = x.min(1.0 - x).min(y).min(1.0 - y);
    let grain = fractal(u * 14.0, v * 14.0, 4, 5);
    if edge < 0.025 {
        return rgb(0.10, 0.09, 0.08) * (0.6 + 0.8 * grain);
    }
    let light = (i + j).rem_euclid(2) == 0;
    let base = if light { rgb(0.62, 0.56, 0.47) } else { rgb(0.22, 0.25, 0.28) };
    let tone = 0.7 + 0.6 * lattice(i, j, 9);
    let vein = (fractal(u * 3.0 + 40.0 * lattice(i, j, 2), v * 3.0, 4, 6) - 0.5).abs();
    let mut colour = base * tone * (0.65 + 0.7 * grain) * (0.75 + (vein * 6.0).min(0.35));
    if lattice(i, j, 31) < 0.3 && (x - 0.5).abs() + (y - 0.5).abs() < 0.24 {
        colour = mix(colour, hue(lattice(i, j, 32)), 0.75);
    }
    colour
}

/// Running bond, bricks of 38 x 14 cm.
fn bricks(u: f32, v: f32) -> Colour {
    let row = (v / 0.14).floor();
    let shifted = u / 0.38 + 0.5 * row.rem_euclid(2.0);
    let (i, j) = (shifted.floor() as i32, row as i32);
    let (x, y) = ((shifted - shifted.floor()) * 0.38, v - row * 0.14);
    let edge = x.min(0.38 - x).min(y).min(0.14 - y);
    let grain = fractal(u * 18.0, v * 18.0, 4, 1);
    if edge < 0.012 {
        return rgb(0.46, 0.43, 0.38) * (0.5 + 0.7 * grain);
    }
    let tone = lattice(i, j, 3);
    mix(rgb(0.42, 0.13, 0.08), rgb(0.62, 0.32, 0.20), tone)
        * (0.45 + 0.9 * grain)
        * (0.8 + 0.4 * lattice(j, i, 4))
}

/// Boards along u with grain and knots.
fn planks(u: f32, v: f32, width: f32, seed: u32) -> Colour {
    let board = (v / width).floor();
    let y = v / width - board;
    let offset = 9.0 * lattice(board as i32, 0, seed);
    let piece = ((u + offset) / 1.7).floor();
    let x = (u + offset) / 1.7 - piece;
    if !(0.03..0.97).contains(&y) || x < 0.008 {
        return rgb(0.05, 0.035, 0.02);
    }
    let tone = 0.7 + 0.5 * lattice(board as i32, piece as i32, seed + 1);
    let bend = 2.5 * fractal(u * 1.3 + offset, v * 5.0, 3, seed + 2);
    let rings = ((v * 34.0 + bend * 3.0 + offset).sin() * 0.5 + 0.5).powi(2);
    let fibre = fractal(u * 5.0 + offset, v * 90.0, 3, seed + 3);
    mix(rgb(0.50, 0.31, 0.15), rgb(0.28, 0.15, 0.07), 0.55 * rings + 0.5 * fibre) * tone
}

fn plaster(u: f32, v: f32, seed: u32) -> Colour {
    let stain = fractal(u * 0.9, v * 0.9, 4, seed);
    let grain = fractal(u * 22.0, v * 22.0, 3, seed + 1);
    let base = mix(rgb(0.62, 0.60, 0.52), rgb(0.42, 0.47, 0.45), stain * 1.6 - 0.3);
    let crack = (fractal(u * 1.7, v * 1.7, 5, seed + 2) - 0.5).abs();
    base * (0.75 + 0.4 * grain) * if crack < 0.006 { 0.55 } else { 1.0 }
}

/// Veined stone with speckles; u and v are arcs on a ball of the given radius.
fn marble(u: f32, v: f32, radius: f32, seed: u32) -> Colour {
    let (a, b) = (u / radius, v / radius);
    let warp = fractal(a * 2.0, b * 2.0, 4, seed);
    let vein = (9.0 * (a * 0.6 + b + 1.6 * warp)).sin().abs().powf(0.45);
    let fine = fractal(a * 16.0, b * 16.0, 3, seed + 1);
    let dark = mix(hue(lattice(seed as i32, 1, 5)), rgb(0.05, 0.05, 0.06), 0.5);
    mix(dark, rgb(0.78, 0.76, 0.72), vein * (0.5 + 0.7 * fine))
        * (0.7 + 0.5 * value(a * 30.0, b * 30.0, seed + 2))
}

/// Boards behind a frame of battens and a diagonal, with nail heads.
fn crate_side(u: f32, v: f32, extent: Vector2<f32>, seed: u32) -> Colour {
    let batten = 0.12 * extent.x.min(extent.y);
    let (eu, ev) = (u.min(extent.x - u), v.min(extent.y - v));
    let edge = eu.min(ev);
    let slope = extent.y / extent.x;
    let diagonal = (v - u * slope).abs() / (1.0 + slope * slope).sqrt();
    if edge < batten || diagonal < 0.55 * batten {
        let rim =
            (batten - edge).abs() < 0.008 || (edge >= batten && (diagonal - 0.55 * batten).abs() < 0.008);
        let nail = |c: f32| (c / 0.22 - (c / 0.22).round()).abs() * 0.22;
        let head = if ev < eu { nail(u).hypot(ev - batten / 2.0) } else { nail(v).hypot(eu - batten / 2.0) };
        if edge < batten && head < 0.014 {
            return rgb(0.04, 0.04, 0.045);
        }
        let wood = if ev < eu { planks(u, v, 5.0, seed) } else { planks(v, u, 5.0, seed) };
        return wood * if rim { 0.25 } else { 1.25 };
    }
    planks(u, v, 0.16, seed + 7) * 0.85
}

/// Voronoi cells (Worley 1996), each of its own colour, with dark borders.
fn cells(u: f32, v: f32, seed: u32) -> Colour {
    let (i0, j0) = (u.floor() as i32, v.floor() as i32);
    let (mut first, mut second, mut id) = (f32::MAX, f32::MAX, (0, 0));
    for j in j0 - 1..=j0 + 1 {
        for i in i0 - 1..=i0 + 1 {
            let (x, y) = (i as f32 + lattice(i, j, seed), j as f32 + lattice(i, j, seed + 1));
            let d = (x - u).hypot(y - v);
            if d < first {
                (second, first, id) = (first, d, (i, j));
            } else if d < second {
                second = d;
            }
        }
    }
    let border = second - first;
    let grain = 0.75 + 0.5 * fractal(u * 3.0, v * 3.0, 3, seed + 3);
    if border < 0.09 {
        return rgb(0.03, 0.03, 0.04);
    }
    let ring = if (first * 9.0).fract() < 0.25 { 0.6 } else { 1.0 };
    hue(lattice(id.0, id.1, seed + 2)) * grain * ring * 1.2
}

/// Squares of 9 cm, half of them split in two along a diagonal.
fn mosaic(u: f32, v: f32, seed: u32) -> Colour {
    let (x, y) = (u / 0.09, v / 0.09);
    let (i, j) = (x.floor() as i32, y.floor() as i32);
    let (fx, fy) = (x - x.floor(), y - y.floor());
    if fx.min(fy) < 0.08 {
        return rgb(0.08, 0.08, 0.09);
    }
    let split = lattice(i, j, seed);
    let half = if split < 0.25 {
        fx > fy
    } else if split < 0.5 {
        fx + fy > 1.0
    } else {
        false
    };
    let h = value(i as f32 * 0.35, j as f32 * 0.35, seed + 1)
        + 0.35 * lattice(i, j, seed + 2)
        + if half { 0.4 } else { 0.0 };
    let shade = 0.35 + 0.9 * lattice(i, j, seed + 4 + u32::from(half));
    hue(h) * shade
}

/// The escape time of z^2 + c.
fn julia(x: f32, y: f32) -> Colour {
    let (mut a, mut b) = (x, y);
    let mut steps = 0;
    while a * a + b * b < 16.0 && steps < 90 {
        (a, b) = (a * a - b * b - 0.79, 2.0 * a * b + 0.156);
        steps += 1;
    }
    if steps == 90 {
        return rgb(0.01, 0.01, 0.03);
    }
    let smooth = steps as f32 + 1.0 - ((a * a + b * b).ln() * 0.5).ln() / std::f32::consts::LN_2;
    let band = if (smooth * 0.5).fract() < 0.2 { 0.5 } else { 1.1 };
    hue(0.35 + smooth * 0.03) * band
}

/// A dark wooden frame of 9 cm around a picture.
fn framed(uv: Vector2<f32>, extent: Vector2<f32>, picture: impl Fn(f32, f32) -> Colour) -> Colour {
    const FRAME: f32 = 0.09;
    let edge = uv.x.min(extent.x - uv.x).min(uv.y).min(extent.y - uv.y);
    if edge > FRAME {
        return picture(uv.x, uv.y);
    }
    let profile =
        if !(0.012..FRAME - 0.012).contains(&edge) { 0.3 } else { 1.0 + 3.0 * (edge / FRAME - 0.5).abs() };
    rgb(0.16, 0.09, 0.04) * profile * (0.7 + 0.6 * fractal(uv.x * 30.0, uv.y * 30.0, 2, 8))
}
