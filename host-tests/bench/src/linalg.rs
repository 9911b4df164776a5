//! `epipole::linalg`: the factorisations and roots that solvers are made of.

use epipole::Real;
use epipole::linalg::poly::real_roots_10;
use epipole::linalg::{Ldlt, Lu, RowQr, cubic_roots, null_space, quartic_roots, svd3, symmetric_eigen};
use epipole::nalgebra::{Matrix3, Matrix6, SMatrix, Vector6};
use epipole::real::lit;
use epipole_host_tests::Rng;

use crate::Run;

const PROBLEMS: usize = 32;

crate::both_scalars! {
    null_space_5x9, row_qr_9_least_singular_of_20, svd3_any, symmetric_eigen_4, lu_6, ldlt_6, cubic, quartic, degree_10,
}

fn random<T: Real, const R: usize, const C: usize>(seed: u64) -> Vec<SMatrix<T, R, C>> {
    let mut rng = Rng::new(seed);
    (0..PROBLEMS).map(|_| SMatrix::from_fn(|_, _| lit(rng.normal()))).collect()
}

fn null_space_5x9<T: Real>() -> Run {
    let rows = random::<T, 9, 5>(1).into_iter().map(|m| m.data.0).collect();
    Run::each(rows, |rows: &[[T; 9]; 5]| null_space::<T, 5, 9, 4>(rows))
}

fn row_qr_9_least_singular_of_20<T: Real>() -> Run {
    let rows = random::<T, 9, 20>(2).into_iter().map(|m| m.data.0).collect();
    Run::each(rows, |rows: &[[T; 9]; 20]| {
        let mut qr = RowQr::<T, 9>::new();
        for four in rows.as_chunks::<4>().0 {
            qr.fold(*four);
        }
        qr.least_singular()
    })
}

fn svd3_any<T: Real>() -> Run {
    Run::each(random::<T, 3, 3>(3), |m: &Matrix3<T>| svd3(m))
}

fn symmetric_eigen_4<T: Real>() -> Run {
    let symmetric = random::<T, 4, 4>(4).into_iter().map(|m| m + m.transpose()).collect();
    Run::each(symmetric, |m| symmetric_eigen(m))
}

fn systems<T: Real>(seed: u64) -> Vec<(Matrix6<T>, Vector6<T>)> {
    random::<T, 6, 6>(seed).into_iter().zip(random::<T, 6, 1>(seed + 1)).collect()
}

fn lu_6<T: Real>() -> Run {
    Run::each(systems::<T>(5), |(a, b)| Lu::new(a).map(|lu| lu.solve(b)))
}

fn ldlt_6<T: Real>() -> Run {
    let positive = |(a, b): (Matrix6<T>, Vector6<T>)| (a * a.transpose() + Matrix6::identity(), b);
    Run::each(systems::<T>(6).into_iter().map(positive).collect(), |(a, b)| Ldlt::new(a).map(|f| f.solve(b)))
}

fn cubic<T: Real>() -> Run {
    let coefficients = random::<T, 4, 1>(7).into_iter().map(|m| m.data.0[0]).collect();
    Run::each(coefficients, |c| cubic_roots(c))
}

fn quartic<T: Real>() -> Run {
    let coefficients = random::<T, 5, 1>(8).into_iter().map(|m| m.data.0[0]).collect();
    Run::each(coefficients, |c| quartic_roots(c))
}

fn degree_10<T: Real>() -> Run {
    let coefficients = random::<T, 11, 1>(9).into_iter().map(|m| m.data.0[0]).collect();
    let error = lit::<T>(16.0) * T::EPSILON;
    Run::each(coefficients, move |c| real_roots_10(c, error))
}
