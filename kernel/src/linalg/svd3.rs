//! Singular values of a 3x3 matrix.

use nalgebra::{ArrayStorage, Matrix3, Vector3};

use super::eigen::jacobi_angle;
use super::vec3::{cross, dot, less, over, scaled};
use crate::Real;
use crate::real::{abs, lit, min, sqrt};

/// Sweeps of Jacobi rotations at the most. Convergence is quadratic: 3 to 6 are usual.
const MAX_SWEEPS: usize = 15;

/// `A = U diag(s) V'` of a 3x3 matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Svd3<T: Real> {
    /// The left singular vectors, as columns: orthogonal, with the determinant's sign that of `det A` (+1 where `A` is
    /// singular to working precision).
    pub u: Matrix3<T>,
    /// The singular values, largest first, none negative.
    pub s: Vector3<T>,
    /// The right singular vectors, as columns: a rotation, `det V = +1`.
    pub v: Matrix3<T>,
}

/// The singular value decomposition of a 3x3 matrix, by one-sided Jacobi rotations.
///
/// # Input
/// Any matrix, of any rank and scale.
///
/// # Returns
/// `None` where `a` holds a NaN or an infinity, or after 15 sweeps without convergence (not observed).
///
/// # Degeneracies
/// Of rank below 3, the vectors of the zero singular values complete an orthogonal basis; of the zero matrix both bases
/// are the identity.
///
/// # Accuracy
/// `U` and `V` orthogonal to a few `EPSILON`, singular values to a few `EPSILON` times the largest.
///
/// # Cost
/// At most 15 sweeps of three rotations; 3 to 6 are usual.
///
/// # References
/// J. Demmel and K. Veselic, "Jacobi's Method is More Accurate than QR", SIAM Journal on Matrix Analysis and
/// Applications, 1992. The last left vectors are made by cross products, so that `U` is orthogonal whatever the rank.
///
/// # Examples
/// ```
/// use epipole::linalg::svd3;
/// use epipole::nalgebra::{Matrix3, Vector3};
/// let svd = svd3(&Matrix3::from_diagonal(&Vector3::new(2.0_f32, 0.0, -5.0))).unwrap();
/// assert_eq!(svd.s, Vector3::new(5.0, 2.0, 0.0));
/// ```
#[must_use]
pub fn svd3<T: Real>(a: &Matrix3<T>) -> Option<Svd3<T>> {
    let largest = super::largest_magnitude(a.data.0.as_flattened().iter())?;
    if largest == T::ZERO {
        let unit = super::identity();
        return Some(Svd3 { u: unit, s: Vector3::zeros(), v: unit });
    }
    // Columns of A V are made orthogonal; V gathers the rotations.
    let mut columns = [[[T::ZERO; 3]; 2]; 3];
    for k in 0..3 {
        columns[k][0] = over(&a.data.0[k], largest);
        columns[k][1][k] = T::ONE;
    }
    let [a, b, c] = &mut columns;
    let floor = T::EPSILON * T::EPSILON * (dot(&a[0], &a[0]) + dot(&b[0], &b[0]) + dot(&c[0], &c[0]));
    let mut converged = false;
    for _ in 0..MAX_SWEEPS {
        let ab = orthogonalise(a, b, floor);
        let ac = orthogonalise(a, c, floor);
        let bc = orthogonalise(b, c, floor);
        if ab && ac && bc {
            converged = true;
            break;
        }
    }
    if !converged {
        return None;
    }
    // Largest first.
    sort(a, b);
    sort(b, c);
    sort(a, b);

    let [[a, va], [b, vb], [c, vc]] = &columns;
    let s0 = sqrt(dot(a, a));
    let u0 = over(a, s0);
    // A small second column keeps an error along the first: it is taken out once more.
    let rest = less(b, &u0, dot(&u0, b));
    let s1 = sqrt(dot(&rest, &rest));
    let u1 = if s1 > T::EPSILON * s0 { over(&rest, s1) } else { perpendicular(&u0) };
    let u2 = cross(&u0, &u1);
    let s2 = dot(&u2, c);
    let u2 = if s2 < -T::EPSILON * s0 { scaled(&u2, -T::ONE) } else { u2 };
    // Equal values stay in order whatever their rounding.
    let s1 = min(s1, s0);
    Some(Svd3 {
        u: Matrix3::from_data(ArrayStorage([u0, u1, u2])),
        s: scaled(&[s0, s1, min(abs(s2), s1)], largest).into(),
        v: Matrix3::from_data(ArrayStorage([*va, *vb, *vc])),
    })
}

/// A column of A V, and that of V.
type Column<T> = [[T; 3]; 2];

/// Rotates two columns so that those of A V become orthogonal; true where they were.
#[cfg_attr(not(small), inline(always))]
fn orthogonalise<T: Real>(a: &mut Column<T>, b: &mut Column<T>, floor: T) -> bool {
    let (aa, ab, bb) = (dot(&a[0], &a[0]), dot(&a[0], &b[0]), dot(&b[0], &b[0]));
    // Orthogonal to rounding, or so small beside the matrix that its direction means nothing.
    let bound = lit::<T>(4.0) * T::EPSILON;
    if ab * ab <= bound * bound * aa * bb || abs(ab) <= floor {
        return true;
    }
    let (sine, _, cosine) = jacobi_angle(aa, ab, bb);
    for (a, b) in a.as_flattened_mut().iter_mut().zip(b.as_flattened_mut()) {
        (*a, *b) = (*a * cosine - *b * sine, *a * sine + *b * cosine);
    }
    false
}

/// Exchanges two columns where the second of A V is the longer; with a change of sign it is a rotation: V stays one.
#[cfg_attr(not(small), inline(always))]
#[cfg_attr(small, inline(never))]
fn sort<T: Real>(a: &mut Column<T>, b: &mut Column<T>) {
    if dot(&b[0], &b[0]) > dot(&a[0], &a[0]) {
        for (a, b) in a.as_flattened_mut().iter_mut().zip(b.as_flattened_mut()) {
            (*a, *b) = (*b, -*a);
        }
    }
}

/// A unit vector perpendicular to the unit vector `a`.
#[inline]
fn perpendicular<T: Real>(&[a, b, c]: &[T; 3]) -> [T; 3] {
    let (x, y, z) = (abs(a), abs(b), abs(c));
    let o = T::ZERO;
    let p = if x <= y && x <= z {
        [o, c, -b]
    } else if y <= z {
        [-c, o, a]
    } else {
        [b, -a, o]
    };
    over(&p, sqrt(dot(&p, &p)))
}
