//! Brute-force matching of binary descriptors by Hamming distance with cross-check, and the sub-pixel alignment of
//! matched patches.

use crate::features::{Descriptor, Features};

/// A correspondence: pixels of both images and the Hamming distance of the descriptors.
#[derive(Clone, Copy, Debug)]
pub struct Match {
    /// Index of the keypoint in image 1.
    pub index1: usize,
    /// Index of the keypoint in image 2.
    pub index2: usize,
    /// Pixel in image 1.
    pub x1: [f64; 2],
    /// Pixel in image 2.
    pub x2: [f64; 2],
    /// Hamming distance, lower is better.
    pub distance: u32,
}

/// Pairs whose descriptors are each other's nearest.
pub fn match_features(a: &Features, b: &Features) -> Vec<Match> {
    cross_check(&a.descriptors, &b.descriptors)
        .into_iter()
        .map(|(i, j, distance)| {
            let (p, q) = (a.keypoints[i], b.keypoints[j]);
            Match {
                index1: i,
                index2: j,
                x1: [f64::from(p.x), f64::from(p.y)],
                x2: [f64::from(q.x), f64::from(q.y)],
                distance,
            }
        })
        .collect()
}

/// Index pairs `(i, j, distance)`: `b[j]` is the nearest to `a[i]` and `a[i]` the nearest to `b[j]`, of equals the
/// first.
pub fn cross_check(a: &[Descriptor], b: &[Descriptor]) -> Vec<(usize, usize, u32)> {
    let (forward, backward) = std::thread::scope(|scope| {
        let backward = scope.spawn(|| nearest(b, a));
        (nearest(a, b), backward.join().expect("matching thread"))
    });
    forward
        .into_iter()
        .enumerate()
        .filter(|&(i, (j, _))| backward.get(j).is_some_and(|&(k, _)| k == i))
        .map(|(i, (j, distance))| (i, j, distance))
        .collect()
}

/// The nearest of `b` to each of `a`, and its distance.
fn nearest(a: &[Descriptor], b: &[Descriptor]) -> Vec<(usize, u32)> {
    a.iter()
        .map(|x| {
            let mut best = (usize::MAX, u32::MAX);
            for (j, y) in b.iter().enumerate() {
                let distance = hamming(x, y);
                if distance < best.1 {
                    best = (j, distance);
                }
            }
            best
        })
        .collect()
}

fn hamming(a: &Descriptor, b: &Descriptor) -> u32 {
    a.iter().zip(b).map(|(x, y)| (x ^ y).count_ones()).sum()
}
