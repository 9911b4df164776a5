//! The order of correspondences by their match scores.

use crate::Real;

/// Fills `order` with 0, 1, ... sorted by rising score; equal scores keep the order of their indices, NaN goes last.
/// As many entries are used as both slices have. Heap sort: no allocation, at most about 2 n log2 n steps.
///
/// # Examples
/// ```
/// use epipole::robust::rank_by_score;
/// let mut order = [0; 4];
/// rank_by_score(&[0.7_f32, f32::NAN, 0.2, 0.7], &mut order);
/// assert_eq!(order, [2, 0, 3, 1]);
/// ```
pub fn rank_by_score<T: Real>(scores: &[T], order: &mut [u32]) {
    let n = core::cmp::min(scores.len(), order.len());
    let Some(order) = order.get_mut(..n) else { return };
    for (entry, i) in order.iter_mut().zip(0u32..) {
        *entry = i;
    }
    for root in (0..n / 2).rev() {
        sift_down(scores, order, root, n);
    }
    for end in (1..n).rev() {
        if let Some(([first, ..], [last, ..])) = order.split_at_mut_checked(end) {
            core::mem::swap(first, last);
        }
        sift_down(scores, order, 0, end);
    }
}

/// True where correspondence `a` ranks after `b`.
fn after<T: Real>(scores: &[T], a: u32, b: u32) -> bool {
    let score = |i: u32| scores.get(i as usize).copied().unwrap_or(T::MAX);
    let (x, y) = (score(a), score(b));
    let is_nan = |v: T| v.partial_cmp(&v).is_none();
    let (x_nan, y_nan) = (is_nan(x), is_nan(y));
    if x_nan || y_nan {
        return if x_nan == y_nan { a > b } else { x_nan };
    }
    x > y || (x == y && a > b)
}

/// Restores the heap below `root`; the tree has at most 64 levels.
fn sift_down<T: Real>(scores: &[T], order: &mut [u32], mut root: usize, end: usize) {
    for _ in 0..64 {
        let mut child = 2 * root + 1;
        if child >= end {
            return;
        }
        let (Some(&left), Some(&top)) = (order.get(child), order.get(root)) else { return };
        let mut larger = left;
        if child + 1 < end {
            let Some(&right) = order.get(child + 1) else { return };
            if after(scores, right, left) {
                child += 1;
                larger = right;
            }
        }
        if !after(scores, larger, top) {
            return;
        }
        if let Some(entry) = order.get_mut(root) {
            *entry = larger;
        }
        if let Some(entry) = order.get_mut(child) {
            *entry = top;
        }
        root = child;
    }
}

#[cfg(test)]
mod tests {
    use super::rank_by_score;

    #[test]
    fn rising_stable_and_nan_last() {
        let mut order = [9u32; 7];
        rank_by_score(&[3.0f32, f32::NAN, 1.0, 2.0, 1.0, f32::INFINITY, -1.0], &mut order);
        assert_eq!(order, [6, 2, 4, 3, 0, 5, 1]);
    }
}
