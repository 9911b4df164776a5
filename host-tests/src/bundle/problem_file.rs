//! The text formats of bundle problems.
//!
//! | first lines | what |
//! |---|---|
//! | `P L M huber` | poses (`R` row-major, `t`), points, observations `pose point x y` on the plane z = 1, true poses, true points; one focal length of 718 pixels, the first two poses are exact |
//! | `ncam npt nobs`, then cameras | `fx fy cx cy`, the true pose, the pose to start from; points; `camera point u v flag` in pixels |
//! | `ncam npt nobs`, then `0 ..` | "Bundle Adjustment in the Large": observations `camera point u v`; cameras `w t f k1 k2`; points |
//!
//! Lines that start with `#` are comments.

use std::error::Error;
use std::path::Path;

use epipole::geometry::{BrownConrady, Pinhole, Pose, pose};
use epipole::nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector2, Vector3};

use super::problem::{Problem, nearest_to_rays, pinhole};

struct Numbers<'a>(std::str::SplitAsciiWhitespace<'a>);

impl Numbers<'_> {
    fn next(&mut self) -> Result<f64, Box<dyn Error>> {
        let word = self.0.next().ok_or("the file ends too early")?;
        word.parse().map_err(|_| format!("`{word}` is not a number").into())
    }

    fn index(&mut self) -> Result<usize, Box<dyn Error>> {
        let word = self.0.next().ok_or("the file ends too early")?;
        word.parse().map_err(|_| format!("`{word}` is not a count or an index").into())
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
    /// Reads a file of any of these formats.
    pub fn read(path: &Path) -> Result<Self, Box<dyn Error>> {
        let text = std::fs::read_to_string(path)?;
        let lines: Vec<&str> = text.lines().filter(|l| !l.starts_with('#') && !l.trim().is_empty()).collect();
        let words = |line: usize| lines.get(line).map(|l| l.split_ascii_whitespace());
        let header = words(0).ok_or("an empty file")?.count();
        let second = words(1).and_then(|mut w| w.next()).ok_or("two lines at least")?;
        let body = lines.join("\n");
        let mut n = Numbers(body.split_ascii_whitespace());
        let counts = [n.index()?, n.index()?, n.index()?];
        let mut p = Self::default();
        match (header, second) {
            (4, _) => p.synthetic(&mut n, counts)?,
            (_, "0") => p.large(&mut n, counts)?,
            _ => p.tracks(&mut n, counts)?,
        }
        let (poses, points) = (p.poses.iter().chain(&p.true_poses), p.points.iter().chain(&p.true_points));
        let finite = poses.clone().all(|p| p.to_matrix().iter().all(|x| x.is_finite()))
            && points.clone().flatten().all(|x| x.is_finite())
            && p.observations.iter().flat_map(|o| &o.2).all(|x| x.is_finite());
        if !finite {
            return Err("a number is not finite".into());
        }
        if p.observations.iter().any(|o| o.0 >= counts[0] || o.1 >= counts[1]) {
            return Err("an observation names a camera or point that is not there".into());
        }
        p.observations.sort_by_key(|o| (o.1, o.0));
        Ok(p)
    }

    fn synthetic(&mut self, n: &mut Numbers<'_>, [p, l, m]: [usize; 3]) -> Result<(), Box<dyn Error>> {
        const FOCAL: f64 = 718.0;
        n.next()?;
        self.cameras = vec![pinhole([FOCAL, FOCAL, 0.0, 0.0])?; p];
        self.fixed = 2;
        self.poses = (0..p).map(|_| n.pose()).collect::<Result<_, _>>()?;
        self.points = (0..l).map(|_| n.vector()).collect::<Result<_, _>>()?;
        for _ in 0..m {
            let (i, j) = (n.index()?, n.index()?);
            self.observations.push((i, j, Vector2::new(n.next()?, n.next()?) * FOCAL));
        }
        self.true_poses = (0..p).map(|_| n.pose()).collect::<Result<_, _>>()?;
        self.true_points = (0..l).map(|_| n.vector()).collect::<Result<_, _>>()?;
        Ok(())
    }

    fn tracks(
        &mut self,
        n: &mut Numbers<'_>,
        [frames, points, observations]: [usize; 3],
    ) -> Result<(), Box<dyn Error>> {
        self.fixed = 2;
        for _ in 0..frames {
            self.cameras.push(pinhole([n.next()?, n.next()?, n.next()?, n.next()?])?);
            self.true_poses.push(n.pose()?);
            self.poses.push(n.pose()?);
        }
        for _ in 0..points {
            self.points.push(n.vector()?);
        }
        for _ in 0..observations {
            let (i, j) = (n.index()?, n.index()?);
            self.observations.push((i, j, Vector2::new(n.next()?, n.next()?)));
            n.next()?;
        }
        // The file's points were made with the true cameras: made again with those of the start.
        self.observations.sort_by_key(|o| (o.1, o.0));
        if self.observations.iter().any(|o| o.0 >= frames || o.1 >= points) {
            return Ok(());
        }
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
        [frames, points, observations]: [usize; 3],
    ) -> Result<(), Box<dyn Error>> {
        self.fixed = 2;
        // That format's camera looks along -z with y up: turned about x by half a turn.
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(0.0, 1.0, 0.0, 0.0));
        for _ in 0..observations {
            let (i, j) = (n.index()?, n.index()?);
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

    /// The problem as text for other solvers: `P L M 1`, poses (R row-major, t), points, observations on the plane z = 1,
    /// then the true poses and the points again.
    pub fn export(&self) -> String {
        use epipole::geometry::CameraModel;
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
        poses(&mut text, if self.true_poses.is_empty() { &self.poses } else { &self.true_poses });
        points(&mut text);
        text
    }
}
