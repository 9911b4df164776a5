//! `bundle_points PROBLEM.txt ...`: points as XYZ against points as bearing and inverse depth in the frame that saw them
//! first. Both are adjusted by the same Levenberg-Marquardt on dense normal equations with numeric Jacobians, so that
//! nothing but the parameters differs; once as the file has it, and once with all depths ten times as large, where
//! points have hardly any parallax.

use std::error::Error;
use std::path::Path;

use epipole::geometry::Pose;
use epipole::nalgebra::{UnitQuaternion, Vector2, Vector3};
use epipole::robust::loss::Loss;
use epipole_host_tests::bundle::problem::{Problem, centre};

const HUBER: Loss<f64> = Loss::Huber(1.0);

#[derive(Clone, Copy)]
enum Points {
    Xyz,
    InverseDepth,
}

struct State {
    poses: Vec<Pose<f64>>,
    points: Vec<Vector3<f64>>,
}

/// The frame that saw each point first.
fn anchors(p: &Problem) -> Vec<usize> {
    let mut first = vec![0; p.points.len()];
    p.observations.iter().rev().for_each(|o| first[o.1] = o.0);
    first
}

impl State {
    fn new(p: &Problem, points: Points, anchors: &[usize]) -> Self {
        let points = p.points.iter().zip(anchors).map(|(x, a)| match points {
            Points::Xyz => *x,
            Points::InverseDepth => {
                let y = p.poses[*a].rotation * x + p.poses[*a].translation.vector;
                Vector3::new(y.x / y.z, y.y / y.z, 1.0 / y.z)
            }
        });
        Self { poses: p.poses.clone(), points: points.collect() }
    }

    fn position(&self, points: Points, j: usize, anchor: usize) -> Vector3<f64> {
        let q = self.points[j];
        match points {
            Points::Xyz => q,
            Points::InverseDepth => {
                let pose = &self.poses[anchor];
                pose.rotation.inverse() * (Vector3::new(q.x, q.y, 1.0) / q.z - pose.translation.vector)
            }
        }
    }

    fn moved(&self, fixed: usize, k: usize, step: f64) -> Self {
        let mut next = Self { poses: self.poses.clone(), points: self.points.clone() };
        next.nudge(fixed, k, step);
        next
    }

    fn nudge(&mut self, fixed: usize, k: usize, step: f64) {
        let frames = 6 * (self.poses.len() - fixed);
        if k >= frames {
            self.points[(k - frames) / 3][(k - frames) % 3] += step;
            return;
        }
        let pose = &mut self.poses[fixed + k / 6];
        let mut d = Vector3::zeros();
        d[k % 3] = step;
        if k % 6 < 3 {
            let turn = UnitQuaternion::from_scaled_axis(d);
            *pose = Pose::from_parts((turn * pose.translation.vector).into(), turn * pose.rotation);
        } else {
            pose.translation.vector += d;
        }
    }
}

fn residual(p: &Problem, s: &State, points: Points, anchors: &[usize], o: usize) -> Option<Vector2<f64>> {
    use epipole::geometry::CameraModel;
    let (i, j, pixel) = &p.observations[o];
    let y = s.poses[*i].rotation * s.position(points, *j, anchors[*j]) + s.poses[*i].translation.vector;
    Some(p.cameras[*i].project(&y)? - pixel)
}

fn cost(p: &Problem, s: &State, points: Points, anchors: &[usize]) -> f64 {
    (0..p.observations.len())
        .map(|o| {
            residual(p, s, points, anchors, o)
                .map_or(f64::INFINITY, |r| 0.5 * HUBER.evaluate(r.norm_squared()).0)
        })
        .sum()
}

/// Solves `A x = b` for a symmetric positive definite matrix, row by row; false where it is not definite.
fn solve(a: &mut [Vec<f64>], b: &mut [f64]) -> bool {
    let n = b.len();
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = a[i][j] - (0..j).map(|k| a[i][k] * a[j][k]).sum::<f64>();
            if i == j && !(sum > 0.0) {
                return false;
            }
            a[i][j] = if i == j { sum.sqrt() } else { sum / a[j][j] };
        }
        b[i] = (b[i] - (0..i).map(|k| a[i][k] * b[k]).sum::<f64>()) / a[i][i];
    }
    for i in (0..n).rev() {
        b[i] = (b[i] - (i + 1..n).map(|k| a[k][i] * b[k]).sum::<f64>()) / a[i][i];
    }
    true
}

/// Costs after each iteration.
fn adjust(p: &Problem, points: Points) -> Vec<f64> {
    let anchors = anchors(p);
    let mut s = State::new(p, points, &anchors);
    let frames = 6 * (p.poses.len() - p.fixed);
    let n = frames + 3 * p.points.len();
    let (mut damping, mut growth) = (1e-4, 2.0);
    let mut costs = vec![cost(p, &s, points, &anchors)];
    while costs.len() <= 100 {
        let now = costs[costs.len() - 1];
        let (mut a, mut b) = (vec![vec![0.0; n]; n], vec![0.0; n]);
        for (o, (i, j, _)) in p.observations.iter().enumerate() {
            let Some(r) = residual(p, &s, points, &anchors, o) else { continue };
            let weight = HUBER.evaluate(r.norm_squared()).1;
            let mut unknowns: Vec<usize> = (0..3).map(|k| frames + 3 * j + k).collect();
            for frame in [*i, anchors[*j]] {
                let moves = frame >= p.fixed && (frame == *i || matches!(points, Points::InverseDepth));
                if moves && !unknowns.contains(&(6 * (frame - p.fixed))) {
                    unknowns.extend((0..6).map(|k| 6 * (frame - p.fixed) + k));
                }
            }
            let h = 1e-6;
            let columns: Vec<Vector2<f64>> = unknowns
                .iter()
                .map(|&k| {
                    let at = |h| residual(p, &s.moved(p.fixed, k, h), points, &anchors, o).unwrap_or(r);
                    (at(h) - at(-h)) / (2.0 * h)
                })
                .collect();
            for (x, &k) in columns.iter().zip(&unknowns) {
                b[k] -= weight * x.dot(&r);
                for (y, &l) in columns.iter().zip(&unknowns) {
                    a[k][l] += weight * x.dot(y);
                }
            }
        }
        let gradient = b.clone();
        let diagonal: Vec<f64> = (0..n).map(|k| a[k][k]).collect();
        (0..n).for_each(|k| a[k][k] += damping * a[k][k] + 1e-12);
        let mut accepted = false;
        if solve(&mut a, &mut b) {
            let mut next = s.moved(p.fixed, 0, 0.0);
            b.iter().enumerate().for_each(|(k, step)| next.nudge(p.fixed, k, *step));
            let then = cost(p, &next, points, &anchors);
            let promise: f64 =
                (0..n).map(|k| 0.5 * b[k] * (damping * diagonal[k] * b[k] + gradient[k])).sum();
            if then < now {
                s = next;
                costs.push(then);
                let x = 2.0 * (now - then) / promise - 1.0;
                damping *= (1.0 - x * x * x).max(1.0 / 3.0);
                growth = 2.0;
                accepted = true;
                if now - then <= 1e-7 * then {
                    break;
                }
            }
        }
        if !accepted {
            costs.push(now);
            damping *= growth;
            growth *= 2.0;
            if damping > 1e10 {
                break;
            }
        }
    }
    costs
}

/// The same views of a scene ten times as far away from the first frame.
fn far(p: &Problem) -> Problem {
    let mut p = p.clone();
    let from = centre(&p.true_poses[0]);
    for x in &mut p.true_points {
        *x = from + 10.0 * (*x - from);
    }
    for (x, truth) in p.points.iter_mut().zip(&p.true_points) {
        let near = from + 10.0 * (*x - from);
        *x = truth + (near - truth) * 0.5;
    }
    for k in 0..p.observations.len() {
        use epipole::geometry::CameraModel;
        let (i, j, pixel) = p.observations[k];
        let y = |x: &Vector3<f64>| p.true_poses[i].rotation * x + p.true_poses[i].translation.vector;
        let (then, now) = (y(&(from + (p.true_points[j] - from) / 10.0)), y(&p.true_points[j]));
        if let (Some(then), Some(now)) = (p.cameras[i].project(&then), p.cameras[i].project(&now)) {
            p.observations[k].2 = now + (pixel - then);
        }
    }
    p
}

fn main() -> Result<(), Box<dyn Error>> {
    println!("{:24} {:>5} points         iterations  cost after 5 -> at the end", "file", "depth");
    for file in std::env::args().skip(1) {
        let near = Problem::read(Path::new(&file))?;
        if near.true_poses.is_empty() || near.true_points.is_empty() {
            return Err(format!("{file}: a problem with its truth is needed").into());
        }
        for (depth, problem) in [("x 1", &near), ("x 10", &far(&near))] {
            for (name, points) in [("XYZ", Points::Xyz), ("inverse depth", Points::InverseDepth)] {
                let costs = adjust(problem, points);
                let file = Path::new(&file).file_stem().unwrap_or_default().to_string_lossy().into_owned();
                let (five, last) = (costs[5.min(costs.len() - 1)], costs[costs.len() - 1]);
                println!("{file:24} {depth:>5} {name:13} {:11}  {five:12.4} -> {last:.4}", costs.len() - 1);
            }
        }
    }
    Ok(())
}
