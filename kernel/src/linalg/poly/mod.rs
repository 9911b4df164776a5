//! Real roots of polynomials. Coefficients stand from the constant term upwards: `c[0] + c[1] x + ...`.

mod degree_10;

pub use degree_10::{LeastDetermined, RealRoots10, projective_roots_10, real_roots_10};
