//! What the library answers here: the bits that a server's answer must have.

use epipole::estimate::{
    AbsolutePoseEstimate, RelativePoseEstimate, WideAbsolutePoseStorage, WideTwoViewStorage,
    absolute_pose_guided, relative_pose_guided,
};
use epipole::nalgebra::{Vector2, Vector3};
use epipole::robust::{Guide, RansacOptions, RansacReport, StopReason};
use epipole_wire::{
    AbsolutePoseRequest, Decoder, Frame, RelativePoseRequest, Reply, Request, absolute_pose_reply,
    encoded_len, relative_pose_reply, reply_bytes,
};

/// The most correspondences of a request.
pub const CAPACITY: usize = 1024;

/// Memory for the library's own answers.
pub struct Library {
    two_view: Box<WideTwoViewStorage<f32, CAPACITY>>,
    absolute: Box<WideAbsolutePoseStorage<f32, CAPACITY>>,
}

impl Default for Library {
    fn default() -> Self {
        Self {
            two_view: Box::new(WideTwoViewStorage::new()),
            absolute: Box::new(WideAbsolutePoseStorage::new()),
        }
    }
}

impl Library {
    /// The bytes on the line that answer `request` with the order and the time that `reply` tells; none where the two
    /// do not belong together, or where the library refuses.
    ///
    /// An answer that a deadline ended is compared with a search of as many iterations.
    pub fn expected(&mut self, request: &Frame<'_>, reply: &Reply<'_>) -> Option<Vec<u8>> {
        let mut out = vec![0; encoded_len(reply_bytes(CAPACITY))];
        let length = match (Request::parse(request).ok()?, reply) {
            (Request::RelativePose(mut asked), Reply::RelativePose(reply)) => {
                cut_off(&mut asked.options.ransac, &reply.estimate.report);
                let (mut estimate, inliers) = self.relative(&asked)?;
                restore(&mut estimate.report, &reply.estimate.report);
                let (order, time) = (reply.order, reply.elapsed_us);
                relative_pose_reply(&mut out, request.sequence, order, time, &estimate, &inliers).ok()?
            }
            (Request::AbsolutePose(mut asked), Reply::AbsolutePose(reply)) => {
                cut_off(&mut asked.options.ransac, &reply.estimate.report);
                let (mut estimate, inliers) = self.absolute(&asked)?;
                restore(&mut estimate.report, &reply.estimate.report);
                let (order, time) = (reply.order, reply.elapsed_us);
                absolute_pose_reply(&mut out, request.sequence, order, time, &estimate, &inliers).ok()?
            }
            _ => return None,
        };
        out.truncate(length);
        Some(out)
    }
}

impl Library {
    /// Whether the library refuses the correspondences or the options of a request.
    pub fn refuses(&mut self, request: &Frame<'_>) -> bool {
        match Request::parse(request) {
            Ok(Request::RelativePose(mut asked)) => {
                asked.options.ransac.budget.max_iterations =
                    asked.options.ransac.budget.max_iterations.min(1);
                self.relative(&asked).is_none()
            }
            Ok(Request::AbsolutePose(mut asked)) => {
                asked.options.ransac.budget.max_iterations =
                    asked.options.ransac.budget.max_iterations.min(1);
                self.absolute(&asked).is_none()
            }
            _ => false,
        }
    }

    fn relative(
        &mut self,
        asked: &RelativePoseRequest<'_>,
    ) -> Option<(RelativePoseEstimate<f32>, Vec<bool>)> {
        let records: Vec<_> = asked.correspondences.iter().collect();
        let x1: Vec<_> = records.iter().map(|([u, v, ..], _)| Vector2::new(*u, *v)).collect();
        let x2: Vec<_> = records.iter().map(|([.., u, v], _)| Vector2::new(*u, *v)).collect();
        let scores: Vec<_> = records.iter().map(|(_, score)| *score).collect();
        let scores = asked.correspondences.scored().then_some(&scores[..]);
        let guide = Guide { scores, keep_going: None };
        let mut workspace = self.two_view.workspace();
        let [a, b] = &asked.cameras;
        let estimate = relative_pose_guided(a, b, &x1, &x2, &asked.options, guide, &mut workspace).ok()?;
        Some((estimate, workspace.inliers().to_vec()))
    }

    fn absolute(
        &mut self,
        asked: &AbsolutePoseRequest<'_>,
    ) -> Option<(AbsolutePoseEstimate<f32>, Vec<bool>)> {
        let records: Vec<_> = asked.correspondences.iter().collect();
        let pixels: Vec<_> = records.iter().map(|([u, v, ..], _)| Vector2::new(*u, *v)).collect();
        let points: Vec<_> = records.iter().map(|([.., x, y, z], _)| Vector3::new(*x, *y, *z)).collect();
        let scores: Vec<_> = records.iter().map(|(_, score)| *score).collect();
        let scores = asked.correspondences.scored().then_some(&scores[..]);
        let guide = Guide { scores, keep_going: None };
        let mut workspace = self.absolute.workspace();
        let options = &asked.options;
        let estimate =
            absolute_pose_guided(&asked.camera, &pixels, &points, options, guide, &mut workspace).ok()?;
        Some((estimate, workspace.inliers().to_vec()))
    }
}

fn cut_off(options: &mut RansacOptions<f32>, report: &RansacReport<f32>) {
    if report.stop == StopReason::Interrupted {
        options.budget.max_iterations = report.spent.iterations;
    }
}

/// The reason of the end is the one thing that differs from the search that was cut off by a number.
fn restore(here: &mut RansacReport<f32>, there: &RansacReport<f32>) {
    if there.stop == StopReason::Interrupted && here.stop == StopReason::MaxIterations {
        here.stop = StopReason::Interrupted;
    }
}

/// Calls `each` with every frame that arrived whole, and the bytes that made it.
///
/// # Panics
/// Where a frame is damaged.
pub fn frames(line: &[u8], mut each: impl FnMut(&Frame<'_>, &[u8])) {
    let mut buffer = vec![0; line.len()];
    let mut decoder = Decoder::new(&mut buffer);
    let mut start = 0;
    for (k, &byte) in line.iter().enumerate() {
        if let Some(frame) = decoder.feed(byte) {
            each(&frame.expect("a whole frame"), &line[start..=k]);
            start = k + 1;
        }
    }
}
