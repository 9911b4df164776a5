//! Bundle problems from files: tracks with camera lines (`ncam npt nobs`, as described in their comment lines) and the
//! format of "Bundle Adjustment in the Large".

use std::error::Error;
use std::path::Path;

use epipole::geometry::{BrownConrady, Camera, CameraModel, Pinhole, Pose, pose};
use epipole::nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector2, Vector3};

use super::{centre, nearest_to_rays};

/// Frames, points and observations.
#[derive(Clone)]
pub struct Problem {
    /// One camera a frame.
    pub cameras: Vec<Camera<f64>>,
    /// Where to start, world to camera.
    pub poses: Vec<Pose<f64>>,
    /// The truth, where the file tells it.
    pub truth: Vec<Pose<f64>>,
    /// Where to start.
    pub points: Vec<Vector3<f64>>,
    /// Frame, point, pixel; in order of points.
    pub observations: Vec<(usize, usize, Vector2<f64>)>,
}

struct Numbers<'a>(std::str::SplitAsciiWhitespace<'a>);

impl Numbers<'_> {
    fn next(&mut self) -> Result<f64, Box<dyn Error>> {
        let word = self.0.next().ok_or("the file ends too early")?;
        word.parse().map_err(|_| format!("`{word}` is not a number").into())
    }

    fn vector(&mut self) -> Result<Vector3<f64>, Box<dyn Error>> {
        Ok(Vector3::new(self.next()?, self.next()?, self.next()?))
    }

    fn pose(&mut self) -> Result<Pose<f64>, Box<dyn Error>> {
        let rows = [self.vector()?, self.vector()?, self.vector()?];
        Ok(pose::from_parts(&Matrix3::from_rows(&rows.map(|r| r.transpose())), &self.vector()?))
    }
}

impl Problem {
    /// Reads a file of either format; which, the first number of its second line tells (an observation's index 0 in
    /// "Bundle Adjustment in the Large", a focal length else).
    pub fn read(path: &Path) -> Result<Self, Box<dyn Error>> {
        let text = std::fs::read_to_string(path)?;
        let lines = || text.lines().filter(|l| !l.starts_with('#') && !l.trim().is_empty());
        let second =
            lines().nth(1).and_then(|l| l.split_ascii_whitespace().next()).ok_or("two lines at least")?;
        let body: String = lines().flat_map(|l| [l, "\n"]).collect();
        let mut n = Numbers(body.split_ascii_whitespace());
        let (frames, points, observations) = (n.next()? as usize, n.next()? as usize, n.next()? as usize);
        let mut p =
            Self { cameras: vec![], poses: vec![], truth: vec![], points: vec![], observations: vec![] };
        if second == "0" {
            p.large(&mut n, frames, points, observations)?
        } else {
            p.tracks(&mut n, frames, points, observations)?
        }
        if p.observations.iter().any(|o| o.0 >= frames || o.1 >= points) {
            return Err("an observation names a camera or point that is not there".into());
        }
        p.observations.sort_by_key(|o| (o.1, o.0));
        Ok(p)
    }

    fn tracks(
        &mut self,
        n: &mut Numbers<'_>,
        frames: usize,
        points: usize,
        observations: usize,
    ) -> Result<(), Box<dyn Error>> {
        for _ in 0..frames {
            self.cameras.push(Pinhole::new(n.next()?, n.next()?, n.next()?, n.next()?)?.into());
            self.truth.push(n.pose()?);
            self.poses.push(n.pose()?);
        }
        for _ in 0..points {
            self.points.push(n.vector()?);
        }
        for _ in 0..observations {
            let (i, j) = (n.next()? as usize, n.next()? as usize);
            self.observations.push((i, j, Vector2::new(n.next()?, n.next()?)));
            n.next()?;
        }
        // The file's points were made with the true cameras: made again with those of the start.
        self.observations.sort_by_key(|o| (o.1, o.0));
        for group in self.observations.chunk_by(|a, b| a.1 == b.1) {
            let rays: Vec<_> = group.iter().filter_map(|o| self.ray(o)).collect();
            if let (Some(first), Some(x)) = (group.first(), nearest_to_rays(&rays)) {
                self.points[first.1] = x;
            }
        }
        Ok(())
    }

    fn large(
        &mut self,
        n: &mut Numbers<'_>,
        frames: usize,
        points: usize,
        observations: usize,
    ) -> Result<(), Box<dyn Error>> {
        // That format's camera looks along -z with y up: turned about x by half a turn.
        let turn = UnitQuaternion::from_quaternion(epipole::nalgebra::Quaternion::new(0.0, 1.0, 0.0, 0.0));
        for _ in 0..observations {
            let (i, j) = (n.next()? as usize, n.next()? as usize);
            let (u, v) = (n.next()?, n.next()?);
            self.observations.push((i, j, Vector2::new(u, -v)));
        }
        for _ in 0..frames {
            let (w, t) = (n.vector()?, n.vector()?);
            let rotation = turn * UnitQuaternion::from_rotation_matrix(&Rotation3::new(w));
            self.poses.push(Pose::from_parts((turn * t).into(), rotation));
            let (f, k1, k2) = (n.next()?, n.next()?, n.next()?);
            self.cameras
                .push(BrownConrady::new(Pinhole::new(f, f, 0.0, 0.0)?, [k1, k2, 0.0, 0.0, 0.0])?.into());
        }
        for _ in 0..points {
            self.points.push(n.vector()?);
        }
        Ok(())
    }

    /// The ray of an observation in the world: the camera's centre and a unit direction.
    pub fn ray(&self, o: &(usize, usize, Vector2<f64>)) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let bearing = self.cameras[o.0].unproject(&o.2).ok()?;
        let pose = &self.poses[o.0];
        Some((centre(pose), pose.rotation.inverse() * bearing))
    }

    /// As many frames and points as fit: the two frames that share most points, then always the frame that shares most
    /// points with those chosen; of their points those seen by most of them. Of each point all observations in the
    /// chosen frames, as long as there is room.
    pub fn choose(&self, frames: usize, points: usize, observations: usize) -> Self {
        let mut sees = vec![vec![false; self.points.len()]; self.poses.len()];
        for o in &self.observations {
            sees[o.0][o.1] = true;
        }
        let shared = |a: &[bool], b: &[bool]| a.iter().zip(b).filter(|(a, b)| **a && **b).count();
        let pairs = (0..sees.len()).flat_map(|a| (0..a).map(move |b| (b, a)));
        let Some((a, b)) = pairs.max_by_key(|&(a, b)| shared(&sees[a], &sees[b])) else {
            return self.clone();
        };
        let mut chosen = vec![a, b];
        let mut union: Vec<bool> = sees[a].iter().zip(&sees[b]).map(|(a, b)| *a || *b).collect();
        while chosen.len() < frames.min(self.poses.len()) {
            let rest = (0..sees.len()).filter(|i| !chosen.contains(i));
            let Some(next) = rest.max_by_key(|&i| shared(&sees[i], &union)) else { break };
            chosen.push(next);
            union.iter_mut().zip(&sees[next]).for_each(|(u, s)| *u |= s);
        }
        let seen_by = |j: usize| chosen.iter().filter(|&&i| sees[i][j]).count();
        let mut best: Vec<usize> = (0..self.points.len()).filter(|&j| seen_by(j) >= 2).collect();
        best.sort_by_key(|&j| (std::cmp::Reverse(seen_by(j)), j));
        let mut left = observations;
        best.truncate(points);
        best.retain(|&j| {
            let fits = seen_by(j) <= left;
            left -= if fits { seen_by(j) } else { 0 };
            fits
        });
        let pick = |poses: &[Pose<f64>]| chosen.iter().filter_map(|&i| poses.get(i).copied()).collect();
        let new_frame = |i: usize| chosen.iter().position(|&c| c == i);
        let mut new_point = vec![None; self.points.len()];
        best.iter().enumerate().for_each(|(new, &old)| new_point[old] = Some(new));
        let mut observations: Vec<_> =
            self.observations.iter().filter_map(|o| Some((new_frame(o.0)?, new_point[o.1]?, o.2))).collect();
        observations.sort_by_key(|o| (o.1, o.0));
        Self {
            cameras: chosen.iter().map(|&i| self.cameras[i]).collect(),
            poses: pick(&self.poses),
            truth: pick(&self.truth),
            points: best.iter().map(|&j| self.points[j]).collect(),
            observations,
        }
    }

    /// The problem as text for other solvers: `P L M 1`, poses (R row-major, t), points, observations on the plane z = 1,
    /// then the true poses and the points again.
    pub fn export(&self) -> String {
        use std::fmt::Write;
        let mut text = String::new();
        let rows: Vec<_> = self
            .observations
            .iter()
            .filter_map(|o| {
                let b = self.cameras[o.0].unproject(&o.2).ok()?;
                Some((o.0, o.1, b.x / b.z, b.y / b.z))
            })
            .collect();
        let _ = writeln!(text, "{} {} {} 1", self.poses.len(), self.points.len(), rows.len());
        let poses = |text: &mut String, poses: &[Pose<f64>]| {
            for pose in poses {
                let r = pose.rotation.to_rotation_matrix();
                let numbers = r
                    .matrix()
                    .transpose()
                    .iter()
                    .chain(&pose.translation.vector)
                    .map(f64::to_string)
                    .collect::<Vec<_>>();
                let _ = writeln!(text, "{}", numbers.join(" "));
            }
        };
        let points = |text: &mut String| {
            for x in &self.points {
                let _ = writeln!(text, "{} {} {}", x.x, x.y, x.z);
            }
        };
        poses(&mut text, &self.poses);
        points(&mut text);
        for (i, j, x, y) in rows {
            let _ = writeln!(text, "{i} {j} {x} {y}");
        }
        poses(&mut text, if self.truth.is_empty() { &self.poses } else { &self.truth });
        points(&mut text);
        text
    }
}
