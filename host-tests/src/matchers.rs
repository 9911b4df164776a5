//! Errors between an estimate and the truth that know the symmetries: q and -q, the sign and scale of E, F and H, the
//! four poses of an essential matrix. All answers are `f64`; NaN in an estimate gives infinity, never a match.

use epipole::Real;
use epipole::geometry::Pose;
use epipole::nalgebra::{Matrix3, UnitQuaternion, Vector2, Vector3};

/// The value in `f64`.
pub fn matrix_f64<T: Real>(m: &Matrix3<T>) -> Matrix3<f64> {
    m.map(T::to_f64)
}

/// The value in `f64`.
pub fn vector_f64<T: Real>(v: &Vector3<T>) -> Vector3<f64> {
    v.map(T::to_f64)
}

fn or_infinite(error: f64) -> f64 {
    if error.is_nan() { f64::INFINITY } else { error }
}

/// The angle between two rotations in radians, the same for q and -q.
pub fn rotation_error<T: Real, U: Real>(a: &UnitQuaternion<T>, b: &UnitQuaternion<U>) -> f64 {
    let (a, b) = (a.coords.map(T::to_f64), b.coords.map(U::to_f64));
    // conj(a) b, from coordinates in the order x, y, z, w.
    let (u, v) = (a.xyz(), b.xyz());
    let vector = v * a.w - u * b.w - u.cross(&v);
    or_infinite(2.0 * vector.norm().atan2((a.w * b.w + u.dot(&v)).abs()))
}

/// The angle between two rotation matrices in radians.
pub fn rotation_matrix_error<T: Real, U: Real>(a: &Matrix3<T>, b: &Matrix3<U>) -> f64 {
    let distance = (matrix_f64(a) - matrix_f64(b)).norm();
    or_infinite(2.0 * (distance / 8f64.sqrt()).min(1.0).asin())
}

/// The angle between two directions in radians; lengths do not count, signs do. A vector of length 0 matches nothing.
pub fn direction_error<T: Real, U: Real>(a: &Vector3<T>, b: &Vector3<U>) -> f64 {
    let (a, b) = (vector_f64(a).normalize(), vector_f64(b).normalize());
    or_infinite(a.cross(&b).norm().atan2(a.dot(&b)))
}

/// The angle between two lines through the origin in radians: `v` and `-v` are the same.
pub fn axis_error<T: Real, U: Real>(a: &Vector3<T>, b: &Vector3<U>) -> f64 {
    let error = direction_error(a, b);
    error.min((std::f64::consts::PI - error).abs())
}

/// Rotation error and error of the direction of translation, in radians.
pub fn pose_error<T: Real, U: Real>(estimate: &Pose<T>, truth: &Pose<U>) -> (f64, f64) {
    (
        rotation_error(&estimate.rotation, &truth.rotation),
        direction_error(&estimate.translation.vector, &truth.translation.vector),
    )
}

/// The Frobenius distance of two matrices scaled to norm 1, the smaller for the two signs: for E, F and H.
pub fn projective_distance<T: Real, U: Real>(a: &Matrix3<T>, b: &Matrix3<U>) -> f64 {
    let (a, b) = (matrix_f64(a).normalize(), matrix_f64(b).normalize());
    or_infinite((a - b).norm().min((a + b).norm()))
}

/// The angle between the vector `H x1` and `x2`, in radians, whatever the sign of H.
pub fn transfer_angle<T: Real, U: Real>(h: &Matrix3<T>, x1: &Vector3<U>, x2: &Vector3<U>) -> f64 {
    axis_error(&(matrix_f64(h) * vector_f64(x1)), x2)
}

/// `|x2' E x1|` with E and both vectors scaled to norm 1.
pub fn epipolar_residual<T: Real, U: Real>(e: &Matrix3<T>, x1: &Vector3<U>, x2: &Vector3<U>) -> f64 {
    let (e, x1, x2) = (matrix_f64(e).normalize(), vector_f64(x1).normalize(), vector_f64(x2).normalize());
    or_infinite(x2.dot(&(e * x1)).abs())
}

/// How far E, scaled to norm 1, is from being essential: the norm of `2 E E' E - trace(E E') E`, and `|det E|`.
pub fn essential_violation<T: Real>(e: &Matrix3<T>) -> f64 {
    let e = matrix_f64(e).normalize();
    let square = e * e.transpose();
    or_infinite((square * e * 2.0 - e * square.trace()).norm().max(e.determinant().abs()))
}

/// The best of the four poses of an essential matrix against the truth: rotation error and axis error of t, radians.
/// It decomposes by nalgebra's SVD, which the kernel does not use: an oracle for the kernel's own decomposition.
pub fn essential_error<T: Real, U: Real>(e: &Matrix3<T>, truth: &Pose<U>) -> (f64, f64) {
    let e = matrix_f64(e);
    if !e.iter().all(|x| x.is_finite()) {
        return (f64::INFINITY, f64::INFINITY);
    }
    let svd = e.svd(true, true);
    let (u, v_t) = (svd.u.expect("asked for"), svd.v_t.expect("asked for"));
    let w = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let truth_r = matrix_f64(&truth.rotation.to_rotation_matrix().into_inner());
    let rotation = [u * w * v_t, u * w.transpose() * v_t]
        .map(|r| rotation_matrix_error(&(r * r.determinant().signum()), &truth_r));
    (rotation[0].min(rotation[1]), axis_error(&u.column(2).into_owned(), &truth.translation.vector))
}

/// The smallest of the errors: infinity where there is none.
pub fn best(errors: impl IntoIterator<Item = f64>) -> f64 {
    errors.into_iter().fold(f64::INFINITY, f64::min)
}

/// `|a - b|` of two image points, in their unit.
pub fn pixel_distance<T: Real, U: Real>(a: &Vector2<T>, b: &Vector2<U>) -> f64 {
    or_infinite((a.map(T::to_f64) - b.map(U::to_f64)).norm())
}

/// `|a - b| / |b|` of two points in space.
pub fn relative_distance<T: Real, U: Real>(a: &Vector3<T>, b: &Vector3<U>) -> f64 {
    let b = vector_f64(b);
    or_infinite((vector_f64(a) - b).norm() / b.norm())
}
