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

#[cfg(test)]
mod tests {
    use super::*;

    fn bits(n: u64) -> Descriptor {
        let mut d = Descriptor::default();
        d[0] = n;
        d
    }

    #[test]
    fn only_mutual_neighbours_match() {
        let a = [bits(0b1111), bits(0b0000), bits(0b1110)];
        let b = [bits(0b0001), bits(0b1111)];
        // a[2] is nearest to b[1], which prefers a[0].
        assert_eq!(cross_check(&a, &b), [(0, 1, 0), (1, 0, 1)]);
        assert_eq!(cross_check(&a, &[]), []);
        assert_eq!(cross_check(&[], &b), []);
    }
}
