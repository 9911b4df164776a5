//! Requests from files of real correspondences: `K1`, `K2`, `R_gt`, `t_gt`, `n N` and lines `x1 y1 x2 y2 score`, or `K` and
//! lines `X Y Z u v score`; pixels, best first.

use std::error::Error;
use std::fs;
use std::path::Path;

use epipole::estimate::{AbsolutePoseOptions, RelativePoseOptions};
use epipole::geometry::{Camera, Pinhole};
use epipole::nalgebra::{Matrix3, Vector2, Vector3};
use epipole_wire::{absolute_pose_request, encoded_len, relative_pose_request, request_bytes};

/// A request, and the rotation that the file calls true.
pub struct Real {
    /// As it stands on the line.
    pub bytes: Vec<u8>,
    /// Of view 2 in view 1, or world to camera.
    pub rotation: Matrix3<f64>,
}

/// The request about at most `most` correspondences of a file, evenly spread over it, with their scores.
///
/// # Errors
/// What cannot be read.
pub fn read(path: &Path, sequence: u16, most: usize) -> Result<Real, Box<dyn Error>> {
    let text = fs::read_to_string(path)?;
    let mut cameras: Vec<Camera<f32>> = Vec::new();
    let mut rotation = None;
    let mut rows: Vec<Vec<f32>> = Vec::new();
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let mut words = line.split_whitespace();
        let Some(first) = words.next() else { continue };
        let numbers: Vec<f64> = words.map(str::parse).collect::<Result<_, _>>()?;
        match (first, &numbers[..]) {
            ("K" | "K1" | "K2", &[fx, fy, cx, cy]) => {
                cameras.push(Pinhole::new(fx as f32, fy as f32, cx as f32, cy as f32)?.into());
            }
            ("R_gt", nine) if nine.len() == 9 => rotation = Some(Matrix3::from_row_slice(nine)),
            ("t_gt" | "n", _) => (),
            (first, rest) => {
                let first: f64 = first.parse()?;
                rows.push(std::iter::once(first).chain(rest.iter().copied()).map(|x| x as f32).collect());
            }
        }
    }
    let taken = rows.len().min(most);
    let rows: Vec<_> = (0..taken).map(|k| &rows[k * rows.len() / taken.max(1)]).collect();
    let mut out = vec![0; encoded_len(request_bytes(taken))];
    let column = |k: usize| rows.iter().map(move |row| row.get(k).copied().unwrap_or(f32::NAN));
    let pixels = |k: usize| column(k).zip(column(k + 1)).map(|(u, v)| Vector2::new(u, v)).collect::<Vec<_>>();
    let length = match &cameras[..] {
        [a, b] => {
            let scores: Vec<f32> = column(4).collect();
            let options = RelativePoseOptions::default();
            relative_pose_request(
                &mut out,
                sequence,
                [a, b],
                [&pixels(0), &pixels(2)],
                Some(&scores),
                &options,
                0,
            )
        }
        [camera] => {
            let points: Vec<_> =
                column(0).zip(column(1)).zip(column(2)).map(|((x, y), z)| Vector3::new(x, y, z)).collect();
            let scores: Vec<f32> = column(5).collect();
            let options = AbsolutePoseOptions::default();
            absolute_pose_request(&mut out, sequence, camera, &pixels(3), &points, Some(&scores), &options, 0)
        }
        _ => return Err("one or two cameras are needed".into()),
    };
    out.truncate(length.map_err(|_| "no room")?);
    Ok(Real { bytes: out, rotation: rotation.ok_or("no R_gt")? })
}
