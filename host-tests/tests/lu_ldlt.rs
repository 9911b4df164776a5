//! LU and LDL' factors: residuals in f64, verdicts, structure.

use epipole::Real;
use epipole::linalg::{Ldlt, Lu};
use epipole::nalgebra::{Matrix2, Matrix3, SMatrix};
use epipole::real::lit;
use epipole_host_tests::cases::{for_each_case, share_of};
use epipole_host_tests::tolerances::FACTORISATION;
use epipole_host_tests::{Rng, in_both_scalars};

fn random<T: Real, const N: usize, const M: usize>(rng: &mut Rng) -> SMatrix<T, N, M> {
    SMatrix::from_fn(|_, _| lit(rng.normal()))
}

/// `|A X - B|` relative to `|A| |X|`.
fn residual<T: Real, const N: usize, const M: usize>(
    a: &SMatrix<T, N, N>,
    x: &SMatrix<T, N, M>,
    b: &SMatrix<T, N, M>,
) -> f64 {
    let (a, x, b) = (a.map(T::to_f64), x.map(T::to_f64), b.map(T::to_f64));
    (a * x - b).norm() / (a.norm() * x.norm())
}

fn lu<T: Real, const N: usize>(rng: &mut Rng) {
    let a = random::<T, N, N>(rng);
    let lu = Lu::new(&a).unwrap();
    let b = random::<T, N, 2>(rng);
    let tolerance = FACTORISATION.of::<T>() * N as f64;
    assert!(residual(&a, &lu.solve(&b), &b) < tolerance);
    assert!(residual(&a, &lu.inverse(), &SMatrix::identity()) < tolerance);
    // Columns permuted by one exchange: the determinant changes its sign, by rounding only otherwise.
    if N > 1 {
        let mut swapped = a;
        swapped.swap_columns(0, N - 1);
        let (d, e) = (lu.determinant().to_f64(), Lu::new(&swapped).unwrap().determinant().to_f64());
        let size: f64 = a.map(T::to_f64).column_iter().map(|c| c.norm()).product();
        assert!((d + e).abs() <= tolerance * size, "{d} {e}");
    }
}

fn ldlt<T: Real, const N: usize>(rng: &mut Rng) {
    // Unknowns in units that differ by many orders of magnitude: the verdict must not see them.
    let units =
        SMatrix::<f64, N, N>::from_diagonal(&SMatrix::from_fn(|_, _| 10f64.powf(rng.range(-6.0, 6.0))));
    let j = SMatrix::<f64, N, N>::from_fn(|_, _| rng.normal());
    let well = j * j.transpose() + SMatrix::identity();
    let a: SMatrix<T, N, N> = (units * well * units).map(lit);
    let a = (a + a.transpose()) * T::HALF;
    let ldlt = Ldlt::new(&a).unwrap();
    let b = random::<T, N, 2>(rng);
    let to_f64 = |m: SMatrix<T, N, N>| m.map(T::to_f64);
    let scaled = |m: SMatrix<f64, N, N>, s: &SMatrix<f64, N, N>| s * m * s;
    let inverse_units = units.map(|x| if x == 0.0 { 0.0 } else { 1.0 / x });
    let x = units * ldlt.solve(&b).map(T::to_f64);
    let b = inverse_units * b.map(T::to_f64);
    let a_scaled = scaled(to_f64(a), &inverse_units);
    let tolerance = FACTORISATION.of::<T>() * N as f64;
    assert!((a_scaled * x - b).norm() < tolerance * a_scaled.norm() * x.norm());
    let inverse = ldlt.inverse();
    assert_eq!(inverse, inverse.transpose());
    let product = a_scaled * scaled(to_f64(inverse), &units);
    assert!((product - SMatrix::identity()).norm() < tolerance * a_scaled.norm() * 3.0, "{product}");
    // The upper triangle is not read.
    let mut lower = a;
    for i in 0..N {
        for j in i + 1..N {
            lower[(i, j)] = lit(f64::NAN);
        }
    }
    assert_eq!(Ldlt::new(&lower).unwrap().inverse(), inverse);
}

in_both_scalars! {
    fn lu_solves<T>() {
        for_each_case(300, |_, rng| {
            lu::<T, 1>(rng);
            lu::<T, 2>(rng);
            lu::<T, 3>(rng);
            lu::<T, 6>(rng);
            lu::<T, 9>(rng);
        });
    }

    fn lu_of_an_integer_matrix_is_exact<T>() {
        let m = |a: [i32; 9]| Matrix3::<T>::from_row_slice(&a.map(|x| lit(x.into())));
        let lu = Lu::new(&m([0, 2, 0, 1, 0, 0, 0, 0, 4])).unwrap();
        assert_eq!(lu.determinant(), lit(-8.0));
        assert_eq!(lu.inverse(), Matrix3::new(T::ZERO, T::ONE, T::ZERO, T::HALF, T::ZERO, T::ZERO, T::ZERO, T::ZERO, lit(0.25)));
    }

    fn lu_verdicts<T>() {
        assert!(Lu::new(&Matrix3::<T>::zeros()).is_none());
        // Rank 4, to rounding. A verdict by pivots misses the few whose elimination amplifies the rounding.
        let singular = |_, rng: &mut Rng| Lu::new(&(random::<T, 5, 4>(rng) * random::<T, 4, 5>(rng))).is_none();
        share_of(1000, singular).assert_at_least(0.95);
        for_each_case(200, |_, rng| {
            // Any scale.
            let a = random::<T, 5, 5>(rng);
            for scale in [1e-30, 1e30] {
                assert!(Lu::new(&(a * lit::<T>(scale))).is_some());
            }
            for bad in [f64::NAN, f64::INFINITY] {
                let mut a = a;
                a[rng.index(25)] = lit(bad);
                assert!(Lu::new(&a).is_none());
            }
        });
    }

    fn ldlt_solves<T>() {
        for_each_case(300, |_, rng| {
            ldlt::<T, 1>(rng);
            ldlt::<T, 2>(rng);
            ldlt::<T, 3>(rng);
            ldlt::<T, 6>(rng);
            ldlt::<T, 9>(rng);
        });
    }

    fn ldlt_verdicts<T>() {
        assert!(Ldlt::new(&Matrix3::<T>::zeros()).is_none());
        // Rank 4, to rounding; more than in LU pass, for no rows are exchanged.
        let singular = |_, rng: &mut Rng| {
            let p = random::<T, 5, 4>(rng);
            Ldlt::new(&(p * p.transpose())).is_none()
        };
        share_of(1000, singular).assert_at_least(0.8);
        assert!(Ldlt::new(&-Matrix3::<T>::identity()).is_none());
        assert!(Ldlt::new(&Matrix2::<T>::new(T::ONE, T::TWO, T::TWO, T::ONE)).is_none());
        for_each_case(200, |_, rng| {
            for bad in [f64::NAN, f64::INFINITY] {
                let mut a = SMatrix::<T, 5, 5>::identity();
                let (i, j) = (rng.index(5), rng.index(5));
                (a[(i, j)], a[(j, i)]) = (lit(bad), lit(bad));
                assert!(Ldlt::new(&a).is_none());
            }
        });
    }
}
