//! A synthetic flight followed by a sliding window.

use std::collections::{HashMap, VecDeque};
use std::error::Error;

use epipole::Real;
use epipole::bundle::{BundleOptions, BundleReport, FrameHandle, PointHandle};
use epipole::geometry::{Camera, CameraModel, Pinhole, Pose};
use epipole::nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector2, Vector3};
use epipole::real::lit;

use epipole_host_tests::bundle::HeapWindow;
use epipole_host_tests::bundle::problem::{cast_pose, centre, nearest_to_rays};

use crate::noise::Rng;

/// What the window did with one frame.
pub struct Step<T> {
    /// The pose that dead reckoning alone would tell.
    pub before: Pose<f64>,
    /// The estimate when the frame was new.
    pub after: Pose<f64>,
    /// The truth.
    pub truth: Pose<f64>,
    /// The optimisation; none for the first two frames, which are given.
    pub report: Option<BundleReport<T>>,
    /// Standard deviation of the camera's centre, from the window; zero for given frames.
    pub sigma: f64,
}

fn truth(k: usize) -> Pose<f64> {
    let angle = k as f64 / 40.0;
    let c = Vector3::new(40.0 * angle.cos(), 1.5 * (3.0 * angle).sin(), 40.0 * angle.sin());
    let ahead = Vector3::new(-angle.sin(), 0.0, angle.cos());
    let down = Vector3::y();
    let rows = [down.cross(&ahead), down, ahead].map(|r| r.transpose());
    // The camera looks ahead and outwards.
    let sway =
        Rotation3::from_euler_angles(0.03 * (0.7 * k as f64).sin(), 0.6, 0.05 * (0.3 * k as f64).cos());
    let rotation = Rotation3::from_matrix_unchecked(sway.matrix() * Matrix3::from_rows(&rows));
    let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
    Pose::from_parts((-(rotation * c)).into(), rotation)
}

/// Flies `frames` frames with a window of `size` frames, pixels with `sigma_px` of noise, five per cent of them wrong.
pub fn fly<T: Real>(
    frames: usize,
    size: usize,
    sigma_px: f64,
    seed: u64,
) -> Result<Vec<Step<T>>, Box<dyn Error>> {
    let mut noise = Rng::new(seed);
    let exact = Pinhole::new(400.0, 400.0, 319.5, 239.5)?;
    let camera: Camera<T> = Pinhole::new(lit(400.0), lit(400.0), lit(319.5), lit(239.5))?.into();
    let mut memory = HeapWindow::<T>::new(size, 300, 300 * size);
    let mut window = memory.window();
    let options = BundleOptions::<T>::default();
    let mut handles: VecDeque<(usize, FrameHandle)> = VecDeque::new();
    let mut known: HashMap<usize, PointHandle> = HashMap::new();
    let mut waiting: HashMap<usize, Vec<(usize, Vector2<f64>)>> = HashMap::new();
    let (mut landmarks, mut alive): (Vec<Vector3<f64>>, Vec<usize>) = (vec![], vec![]);
    let mut steps: Vec<Step<T>> = vec![];
    for k in 0..frames {
        let true_pose = truth(k);
        let project = |x: &Vector3<f64>| {
            let y = true_pose.rotation * x + true_pose.translation.vector;
            exact.project(&y).filter(|p| y.z > 1.0 && p.x >= 0.0 && p.y >= 0.0 && p.x < 640.0 && p.y < 480.0)
        };
        alive.retain(|&j| project(&landmarks[j]).is_some());
        while alive.len() < 60 {
            let pixel = Vector2::new(640.0 * f64::from(noise.uniform()), 480.0 * f64::from(noise.uniform()));
            let ray = exact.unproject(&pixel)?;
            let depth = 4.0 + 20.0 * f64::from(noise.uniform());
            alive.push(landmarks.len());
            landmarks.push(true_pose.rotation.inverse() * (ray * depth) + centre(&true_pose));
        }
        // Dead reckoning: the true motion with an error of a degree and some centimetres.
        let drift =
            |noise: &mut Rng, sigma: f64| Vector3::from_fn(|_, _| sigma * f64::from(noise.gaussian()));
        let step = |from: &Pose<f64>, noise: &mut Rng| {
            let exact = true_pose * truth(k.saturating_sub(1)).inverse();
            let turn = UnitQuaternion::from_scaled_axis(drift(noise, 0.01));
            Pose::from_parts((exact.translation.vector + drift(noise, 0.05)).into(), turn * exact.rotation)
                * from
        };
        let (before, start) = match steps.last() {
            Some(last) if k >= 2 => (step(&last.before, &mut noise), step(&last.after, &mut noise)),
            _ => (true_pose, true_pose),
        };
        if handles.len() == size
            && let Some((gone, oldest)) = handles.pop_front()
        {
            window.marginalise_frame(oldest, &options.loss)?;
            known.retain(|_, p| window.position(*p).is_ok());
            waiting.values_mut().for_each(|list| list.retain(|o| o.0 != gone));
        }
        let frame = window.add_frame(camera, &cast_pose(&start))?;
        window.fix_frame(frame, k < 2)?;
        handles.push_back((k, frame));
        for &j in &alive {
            let Some(mut pixel) = project(&landmarks[j]) else { continue };
            pixel += Vector2::new(f64::from(noise.gaussian()), f64::from(noise.gaussian())) * sigma_px;
            if f64::from(noise.uniform()) < 0.05 {
                pixel.x += 30.0;
            }
            match known.get(&j) {
                Some(point) => window.add_observation(frame, *point, &pixel.map(lit), lit(sigma_px))?,
                None => waiting.entry(j).or_default().push((k, pixel)),
            }
        }
        if k >= 2 {
            let _ = window.refine_frame(frame, &options);
        }
        waiting.retain(|j, _| alive.contains(j));
        let handle_of: HashMap<usize, FrameHandle> = handles.iter().copied().collect();
        for &j in &alive {
            let Some(list) = waiting.get(&j).filter(|list| list.len() >= 2) else { continue };
            let mut rays = vec![];
            for (f, pixel) in list {
                let pose: Pose<f64> = cast_pose(&window.pose(handle_of[f])?);
                rays.push((centre(&pose), pose.rotation.inverse() * exact.unproject(pixel)?));
            }
            let (Some(first), Some(last)) = (rays.first(), rays.last()) else { continue };
            if first.1.cross(&last.1).norm() < 0.02 {
                continue;
            }
            let Some(x) = nearest_to_rays(&rays) else { continue };
            let Ok(point) = window.add_point(&x.map(lit)) else { continue };
            for (f, pixel) in list {
                window.add_observation(handle_of[f], point, &pixel.map(lit), lit(sigma_px))?;
            }
            if window.point_report(point, lit(5.0))?.behind > 0 {
                window.remove_point(point)?;
            } else {
                known.insert(j, point);
                waiting.remove(&j);
            }
        }
        let report = if k >= 2 { Some(window.optimise(&options)?) } else { None };
        let sigma = if k >= 2 {
            window
                .frame_covariance(frame, &options.loss)
                .map_or(f64::NAN, |c| c.centre.trace().to_f64().sqrt())
        } else {
            0.0
        };
        steps.push(Step { before, after: cast_pose(&window.pose(frame)?), truth: true_pose, report, sigma });
    }
    Ok(steps)
}
