//! The homography of four correspondences, in closed form.

use nalgebra::{Matrix3, Vector3};

use crate::Real;
use crate::geometry::Homography;
use crate::real::{abs, is_finite};

/// The homography of four correspondences in general position: `x2 = lambda H x1`, lambda > 0.
///
/// Three of the points are taken as a basis in each view and the fourth gives the scales: with `A` and `B` the matrices
/// of the first three points, `H = B diag(B^-1 b / A^-1 a) A^-1` maps `a`, the fourth, to `b`.
///
/// # Input
/// Homogeneous points or bearings of any length (not only of length 1 or third coordinate 1), none of length zero, with
/// determinants of three of them inside the range of `T`.
///
/// # Returns
/// `H`, scaled so that it takes the fourth point of view 1 to the fourth of view 2 exactly, with `det H > 0`; or `None`:
/// see the degeneracies.
///
/// # Degeneracies
/// `None` where
/// - three of the points lie on a line in a view, or two coincide (their determinant is within the rounding of its
///   terms);
/// - a triangle of points turns one way in view 1 and the other way in view 2, which the same side of a plane in front
///   of both cameras does not show;
/// - a coordinate is NaN or infinite.
///
/// # Accuracy
/// Backward stable for points in general position: transfer errors of a few `EPSILON` in `f32` and `f64`.
///
/// # Cost
/// No iteration: about 300 operations, 4 divisions.
///
/// # References
/// R. Hartley and A. Zisserman, "Multiple View Geometry in Computer Vision", 2nd edition, 2003, section 2.3 (a
/// projective basis of four points). The orientation constraint: T. Werner and T. Pajdla, "Oriented matching
/// constraints", BMVC 2001.
///
/// # Examples
/// ```
/// use epipole::nalgebra::Vector3;
/// use epipole::solvers::homography_4pt;
/// let x1 = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(u, v)| Vector3::new(u, v, 1.0));
/// let x2 = [(2.0, 1.0), (4.0, 1.0), (4.0, 3.0), (2.0, 3.0)].map(|(u, v)| Vector3::new(u, v, 1.0));
/// let h = homography_4pt(&x1, &x2).unwrap();
/// let centre = h.0 * Vector3::new(0.5, 0.5, 1.0);
/// assert!((centre / centre.z - Vector3::new(3.0, 2.0, 1.0)).norm_squared() < 1e-28);
/// ```
#[must_use]
pub fn homography_4pt<T: Real>(x1: &[Vector3<T>; 4], x2: &[Vector3<T>; 4]) -> Option<Homography<T>> {
    let a = Basis::new(x1)?;
    let b = Basis::new(x2)?;
    // Werner and Pajdla: the four triangles keep their sense.
    let same = |p: T, q: T| (p > T::ZERO) == (q > T::ZERO);
    if !(same(a.triple[0], b.triple[0])
        && same(a.triple[1], b.triple[1])
        && same(a.triple[2], b.triple[2])
        && same(a.triple[3], b.triple[3]))
    {
        return None;
    }
    // H x1_i = w_i x2_i times det A, for the points of the basis; 1 / det B makes the fourth exact.
    let scale = T::ONE / b.triple[3];
    let w0 = b.triple[0] * scale / a.triple[0];
    let w1 = b.triple[1] * scale / a.triple[1];
    let w2 = b.triple[2] * scale / a.triple[2];
    let row = a.n * w0 + a.r1 * (w1 - w0) + a.r2 * (w2 - w0);
    let (e1, e2) = (b.d1 * w1, b.d2 * w2);
    let column = |row: T, r1: T, r2: T| x2[0] * row + e1 * r1 + e2 * r2;
    let h = Matrix3::from_columns(&[
        column(row.x, a.r1.x, a.r2.x),
        column(row.y, a.r1.y, a.r2.y),
        column(row.z, a.r1.z, a.r2.z),
    ]);
    // Coordinates near the ends of the range of T overflow somewhere above.
    is_finite(h.norm_squared()).then_some(Homography(h))
}

/// Point 0 and the differences to points 1 and 2 as a basis, and its adjugate: differences keep the digits of points
/// that are close together.
struct Basis<T: Real> {
    d1: Vector3<T>,
    d2: Vector3<T>,
    /// d1 x d2, d2 x x0, x0 x d1
    n: Vector3<T>,
    r1: Vector3<T>,
    r2: Vector3<T>,
    /// The determinants of the points 321, 032, 013 (coordinates of the fourth point in the first three, times their
    /// determinant) and 012.
    triple: [T; 4],
}

impl<T: Real> Basis<T> {
    /// `None` where a triple is collinear.
    #[cfg_attr(not(small), inline(always))]
    fn new(x: &[Vector3<T>; 4]) -> Option<Self> {
        let (d1, d2, d3) = (x[1] - x[0], x[2] - x[0], x[3] - x[0]);
        let (n, r1, r2, r3) = (d1.cross(&d2), d2.cross(&x[0]), x[0].cross(&d1), x[0].cross(&d3));
        let (b1, b2) = (r1.dot(&d3), r2.dot(&d3));
        let triple = [n.dot(&x[3]) - b1 - b2, b1, b2, n.dot(&x[0])];
        // Rounding moves each coordinate by EPSILON / 2 of itself, and so each determinant by less than this.
        let size = |i: usize| abs(x[0][i]) + abs(x[1][i]) + abs(x[2][i]) + abs(x[3][i]);
        let side = |i: usize| abs(r1[i]) + abs(r2[i]) + abs(r3[i]);
        let rounding = T::TWO * T::EPSILON * (size(0) * side(0) + size(1) * side(1) + size(2) * side(2));
        let distinct = (abs(triple[0]) > rounding)
            & (abs(triple[1]) > rounding)
            & (abs(triple[2]) > rounding)
            & (abs(triple[3]) > rounding);
        distinct.then_some(Self { d1, d2, n, r1, r2, triple })
    }
}
