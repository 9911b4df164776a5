//! Bundle adjustment of a sliding window in single precision over a flight of 40 frames: each new frame and its points
//! come in, the oldest frame is marginalised, and the window is optimised. Logs by defmt.
//!
//! The exit code is 0 where the last position is within 3 % of the path's length.
#![no_std]
#![no_main]

use defmt::{Debug2Format, error, info};
use epipole::bundle::{BundleOptions, FrameHandle, PointHandle, Window, WindowStorage, scalars_len};
use epipole::geometry::pose;
use epipole::nalgebra::Vector3;
use epipole_firmware::{count, entry};
use epipole_problems::Flight;

/// Frames of the window, points of the window, new points with a frame, frames of the flight.
const FRAMES: usize = 6;
const POINTS: usize = 72;
const NEW: u32 = 8;
const FLIGHT: u32 = 40;
const SCALARS: usize = scalars_len(FRAMES);

entry!(main);

fn main() -> i32 {
    count::init();
    match fly() {
        Ok(share) if share < 0.03 => 0,
        Ok(share) => {
            error!("{} of the path is too far off", share);
            1
        }
        Err(what) => {
            error!("the window refused: {}", what);
            2
        }
    }
}

/// A point of the window and its number in the flight.
type Seen = (PointHandle, u32);

/// The error of the last position as a share of the path.
fn fly() -> Result<f32, &'static str> {
    let flight = Flight { seed: 7 };
    let camera = flight.camera::<f32>().ok_or("camera")?;
    let mut storage = WindowStorage::<f32, FRAMES, POINTS, { FRAMES * POINTS }, SCALARS>::new();
    info!("memory of the window: {} bytes", size_of_val(&storage));
    let mut window = storage.window();
    let mut frames: [Option<FrameHandle>; FRAMES] = [None; FRAMES];
    let mut points: [Option<Seen>; POINTS] = [None; POINTS];
    let options = BundleOptions { max_iterations: 5, ..BundleOptions::default() };
    let mut share = 0.0;
    for k in 0..FLIGHT {
        if let [Some(oldest), .., Some(_)] = frames {
            window.marginalise_frame(oldest, &options.loss).map_err(|_| "marginalise")?;
            frames.rotate_left(1);
            frames[FRAMES - 1] = None;
        }
        // The first two frames are known, which fixes the scale; later ones are guessed.
        let known = k < 2;
        let start =
            if known { epipole_problems::two_view::cast_pose(&flight.pose(k)) } else { flight.guess(k) };
        let frame = window.add_frame(camera, &start).map_err(|_| "frame")?;
        window.fix_frame(frame, known).map_err(|_| "fix")?;
        if let Some(slot) = frames.iter_mut().find(|slot| slot.is_none()) {
            *slot = Some(frame);
        }
        observe(&mut window, &flight, frame, k, &mut points)?;
        if k == 0 {
            continue;
        }
        let (report, cost) = count::measure(|| window.optimise(&options));
        let report = report.map_err(|_| "optimise")?;
        let estimate = window.pose(frame).map_err(|_| "pose")?;
        let truth = pose::centre(&flight.pose(k)).map(|x| x as f32);
        let first = pose::centre(&flight.pose(0)).map(|x| x as f32);
        let (off, path): (Vector3<f32>, Vector3<f32>) = (pose::centre(&estimate) - truth, truth - first);
        share = epipole::real::sqrt(off.norm_squared() / path.norm_squared());
        info!(
            "frame {}: {} points, {} observations, {} iterations, {}, {} {}, off by {} of the path",
            k,
            window.point_count(),
            window.observation_count(),
            report.iterations,
            Debug2Format(&report.termination),
            cost,
            count::UNIT,
            share
        );
    }
    Ok(share)
}

/// The frame's pixels of the points of the window, and its new points.
fn observe(
    window: &mut Window<'_, f32>,
    flight: &Flight,
    frame: FrameHandle,
    k: u32,
    points: &mut [Option<Seen>; POINTS],
) -> Result<(), &'static str> {
    let number = |j: u32| flight.pixel(k, j, &flight.point(j, NEW)).map(|pixel| pixel.map(|x| x as f32));
    for slot in points.iter_mut() {
        // Marginalised with the last frame that saw it, or out of sight: its place is free.
        let Some((point, j)) = *slot else { continue };
        match (window.position(point), number(j)) {
            (Ok(_), Some(pixel)) => window.add_observation(frame, point, &pixel, 1.0).map_err(|_| "pixel")?,
            (Ok(_), None) => {}
            (Err(_), _) => *slot = None,
        }
    }
    for j in k * NEW..(k + 1) * NEW {
        let (Some(pixel), Some(slot)) = (number(j), points.iter_mut().find(|slot| slot.is_none())) else {
            continue;
        };
        // Stands for the triangulation: two per cent too far away.
        let start = (flight.point(j, NEW) * 1.02).map(|x| x as f32);
        let Ok(point) = window.add_point(&start) else { break };
        window.add_observation(frame, point, &pixel, 1.0).map_err(|_| "pixel")?;
        *slot = Some((point, j));
    }
    Ok(())
}
