//! The one table of tolerances. A test that needs a bound takes it here; a bound is loosened here or nowhere, and never
//! without a reason.

use epipole::Real;

/// An upper bound on an error, for each scalar.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    /// The bound in `f32`.
    pub f32: f64,
    /// The bound in `f64`.
    pub f64: f64,
    /// Why this and not less.
    pub reason: &'static str,
}

impl Tolerance {
    /// The bound for the scalar `T`.
    pub fn of<T: Real>(&self) -> f64 {
        if size_of::<T>() == 4 { self.f32 } else { self.f64 }
    }
}

macro_rules! table {
    ($($name:ident: $f32:expr, $f64:expr, $reason:expr;)*) => {
        $(#[doc = $reason]
        pub const $name: Tolerance = Tolerance { f32: $f32, f64: $f64, reason: $reason };)*

        /// Every tolerance with its name.
        pub const TABLE: &[(&str, Tolerance)] = &[$((stringify!($name), $name)),*];
    };
}

table! {
    SOLVED_ROTATION: 1e-3, 1e-6,
        "radians; the field's own bound for a noise-free problem solved, so that shares compare with published ones";
    ROUNDING: 1e-6, 2e-15,
        "a dozen rounded operations on numbers near 1";
    ROTATION: 2e-6, 4e-15,
        "radians or matrix entries; a product, inverse or conversion of rotations, each entry a sum of a few products";
    ESSENTIAL_CONSTRAINT: 2e-5, 1e-12,
        "det and the cubic trace constraint of a unit-norm E out of a well-conditioned solver";
    EPIPOLAR_RESIDUAL: 2e-5, 1e-11,
        "x2' E x1 of unit-norm E and bearings on the minimal sample; the sample's null space is exact to rounding, \
         the solver's root moves it by its own error";
    PROJECTION_PX: 5e-4, 1e-10,
        "pixels of 10^3; a division, a polynomial of degree 9 at most and a product, relative error a few EPSILON";
    UNPROJECTION: 4e-6, 1e-14,
        "radians; the rounding of a pixel of 10^3 over the focal length, and of the inverse of the distortion";
    UNPROJECTION_FOLD: 2e-3, 1e-9,
        "radians; as UNPROJECTION, over a slope of the distortion down to 1/30 of the slope in the centre";
    JACOBIAN: 2e-5, 1e-7,
        "relative to the largest entry; f64: central differences with a step of the cube root of EPSILON";
    TRIANGULATED: 5e-4, 1e-9,
        "relative distance of noise-free points at a parallax above 0.01 rad; EPSILON over the parallax, for f32 of \
         inputs rounded before";
    LINEARISED_IMAGE: 7e-4, 2e-4,
        "relative distance of points; the image curved over an error of 0.5 px, squared in radians, over the parallax";
    DLT_ORIGIN: 1e-3, 1e-3,
        "relative distance of points; the DLT weighs a point by its distance from the origin, so views exchanged at a \
         noise of 0.5 px are not quite alike";
    FACTORISATION: 3e-6, 6e-15,
        "relative to the matrix; a product of a few rotations or eliminations, a few EPSILON each";
    ROOT: 5e-5, 1e-13,
        "relative to the roots' size, roots half of it apart: EPSILON in the coefficients over the slope";
    GAUGE_SOLUTION: 5e-3, 1e-7,
        "distance of unit-norm matrices; the inputs' rounding, or the end of the inverse iteration, over the gap between \
         the two smallest singular values of samples with 1 px of noise";
    NULL_VECTOR_P99: 6e-6, 1e-15,
        "99th percentile of the distance of unit-norm E from the solution of the same rounded points in f64 (which is \
         itself 8e-5 off the truth, for f32)";
    TRANSFER_P99: 6e-6, 2e-14,
        "radians, 99th percentile; the figure aimed at for four points rounded to f32, of any shape of quadrilateral";
    TRANSFER_FOUR: 3e-5, 6e-14,
        "radians; the four points themselves, of quadrilaterals with a thin triangle among them";
    PLANE_MOTION: 2e-5, 4e-14,
        "R, t / d and n times |t / d|: a few EPSILON of the homography, a little more near a double singular value";
    EPIPOLE: 2e-4, 1e-12,
        "radians; EPSILON in the elements of F over the angle between its columns, 1/1000 in pixels";
    SOLVED_BEARING: 2e-3, 1e-6,
        "radians between a bearing and its point under a solution; two solutions that merge keep half the digits";
    UPRIGHT_EPIPOLAR: 2e-2, 1e-6,
        "t' (R x1 x x2) of unit vectors, at a root of the determinant; two roots that merge keep half the digits";
    FIVE_POINT_CONSTRAINT: 1e-3, 1e-8,
        "as ESSENTIAL_CONSTRAINT, samples of any conditioning: the last Newton step was shorter than the square root of \
         EPSILON, its square is left over times the curvature";
    FIVE_POINT_ROOT: 1e-3, 1e-6,
        "distance of unit-norm E; two solutions nearer than this are one, beyond it not the same";
    FOLDED_GRAM: 3e-6, 6e-15,
        "elements of R'R relative to the trace of A'A; the rounding of nine reflections a block, 24 rows in blocks of 3";
    ROBUST_EXACT_PX: 2e-2, 1e-7,
        "pixels; exact points, in f32 rounded to 1e-4 of a pixel, extrapolated to the rim of the plane; the end of the \
         refinement";
    ROBUST_SAME_PX: 5e-2, 2e-2,
        "pixels; the same estimate from pixels in another unit: the last step of the refinement was shorter than this";
}
