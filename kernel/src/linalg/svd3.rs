//! Singular values of a 3x3 matrix.

use nalgebra::{Matrix3, Vector3};

use super::eigen::jacobi_angle;
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
    let largest = super::largest_magnitude(a.data.0.iter().flatten())?;
    if largest == T::ZERO {
        return Some(Svd3 { u: super::identity(), s: Vector3::zeros(), v: super::identity() });
    }
    let mut m = a.data.0;
    m.iter_mut().flatten().for_each(|x| *x /= largest);
    let [mut m0, mut m1, mut m2] = m.map(Vector3::from);
    let mut v0 = Vector3::new(T::ONE, T::ZERO, T::ZERO);
    let mut v1 = Vector3::new(T::ZERO, T::ONE, T::ZERO);
    let mut v2 = Vector3::new(T::ZERO, T::ZERO, T::ONE);

    // Columns of A V are made orthogonal; V gathers the rotations.
    let floor = T::EPSILON * T::EPSILON * (m0.norm_squared() + m1.norm_squared() + m2.norm_squared());
    let mut converged = false;
    for _ in 0..MAX_SWEEPS {
        let a = orthogonalise(&mut m0, &mut m1, &mut v0, &mut v1, floor);
        let b = orthogonalise(&mut m0, &mut m2, &mut v0, &mut v2, floor);
        let c = orthogonalise(&mut m1, &mut m2, &mut v1, &mut v2, floor);
        if a && b && c {
            converged = true;
            break;
        }
    }
    if !converged {
        return None;
    }
    // Largest first.
    sort(&mut m0, &mut m1, &mut v0, &mut v1);
    sort(&mut m1, &mut m2, &mut v1, &mut v2);
    sort(&mut m0, &mut m1, &mut v0, &mut v1);

    let s0 = sqrt(m0.norm_squared());
    let u0 = m0 / s0;
    // A small second column keeps an error along the first: it is taken out once more.
    let rest = m1 - u0 * u0.dot(&m1);
    let s1 = sqrt(rest.norm_squared());
    let u1 = if s1 > T::EPSILON * s0 { rest / s1 } else { perpendicular(&u0) };
    let u2 = u0.cross(&u1);
    let s2 = u2.dot(&m2);
    let u2 = if s2 < -T::EPSILON * s0 { -u2 } else { u2 };
    Some(Svd3 {
        u: Matrix3::from_columns(&[u0, u1, u2]),
        // Equal values stay in order whatever their rounding.
        s: Vector3::new(s0, min(s1, s0), min(abs(s2), min(s1, s0))) * largest,
        v: Matrix3::from_columns(&[v0, v1, v2]),
    })
}

/// Rotates the columns `a` and `b` so that they become orthogonal, and `va`, `vb` with them; true where they were.
#[cfg_attr(not(small), inline(always))]
fn orthogonalise<T: Real>(
    a: &mut Vector3<T>,
    b: &mut Vector3<T>,
    va: &mut Vector3<T>,
    vb: &mut Vector3<T>,
    floor: T,
) -> bool {
    let (aa, ab, bb) = (a.norm_squared(), a.dot(b), b.norm_squared());
    // Orthogonal to rounding, or so small beside the matrix that its direction means nothing.
    let bound = lit::<T>(4.0) * T::EPSILON;
    if ab * ab <= bound * bound * aa * bb || abs(ab) <= floor {
        return true;
    }
    let (sine, _, cosine) = jacobi_angle(aa, ab, bb);
    (*a, *b) = (*a * cosine - *b * sine, *a * sine + *b * cosine);
    (*va, *vb) = (*va * cosine - *vb * sine, *va * sine + *vb * cosine);
    false
}

/// Exchanges two columns of A V and V where the second is the longer; with a change of sign it is a rotation: V stays one.
#[cfg_attr(not(small), inline(always))]
#[cfg_attr(small, inline(never))]
fn sort<T: Real>(a: &mut Vector3<T>, b: &mut Vector3<T>, va: &mut Vector3<T>, vb: &mut Vector3<T>) {
    if b.norm_squared() > a.norm_squared() {
        (*a, *b, *va, *vb) = (*b, -*a, *vb, -*va);
    }
}

/// A unit vector perpendicular to the unit vector `a`.
#[inline]
fn perpendicular<T: Real>(a: &Vector3<T>) -> Vector3<T> {
    let (x, y, z) = (abs(a.x), abs(a.y), abs(a.z));
    let o = T::ZERO;
    let p = if x <= y && x <= z {
        Vector3::new(o, a.z, -a.y)
    } else if y <= z {
        Vector3::new(-a.z, o, a.x)
    } else {
        Vector3::new(a.y, -a.x, o)
    };
    p / sqrt(p.norm_squared())
}
