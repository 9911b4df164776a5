//! Singular values of 3x3 matrices and eigenvalues of symmetric ones, against nalgebra's in f64.

use epipole::Real;
use epipole::linalg::{svd3, symmetric_eigen};
use epipole::nalgebra::{Matrix3, SMatrix, Vector3};
use epipole::real::lit;
use epipole_host_tests::cases::for_each_case;
use epipole_host_tests::matchers::{matrix_f64, vector_f64};
use epipole_host_tests::tolerances::FACTORISATION;
use epipole_host_tests::{Rng, in_both_scalars};

/// A matrix of rank 3, 2 or 1 with singular values over up to six decades, at any scale.
fn matrix<T: Real>(seed: u64, rng: &mut Rng) -> Matrix3<T> {
    let (u, v) = (rng.rotation(3.1).to_rotation_matrix(), rng.rotation(3.1).to_rotation_matrix());
    let mut s = Vector3::new(1.0, 10f64.powf(-6.0 * rng.unit()), 10f64.powf(-6.0 * rng.unit()));
    match seed % 6 {
        1 => s.z = 0.0,
        2 => (s.y, s.z) = (0.0, 0.0),
        3 => (s.y, s.z) = (1.0, 1.0),
        4 => s.y = 1.0,
        _ => {}
    }
    let sign = if rng.unit() < 0.5 { -1.0 } else { 1.0 };
    let scale = sign * 10f64.powf(rng.range(-12.0, 12.0));
    (u.matrix() * Matrix3::from_diagonal(&s) * v.matrix() * scale).map(lit)
}

fn orthogonality(m: &Matrix3<f64>) -> f64 {
    (m.transpose() * m - Matrix3::identity()).norm()
}

in_both_scalars! {
    fn factors_are_orthogonal_sorted_and_reproduce_the_matrix<T>() {
        for_each_case(3000, |seed, rng| {
            let a = matrix::<T>(seed, rng);
            let svd = svd3(&a).unwrap();
            let (a, u, s, v) = (matrix_f64(&a), matrix_f64(&svd.u), vector_f64(&svd.s), matrix_f64(&svd.v));
            let tolerance = FACTORISATION.of::<T>();
            assert!(orthogonality(&u) < tolerance && orthogonality(&v) < tolerance, "{u} {v}");
            assert!((u * Matrix3::from_diagonal(&s) * v.transpose() - a).norm() <= tolerance * a.norm());
            assert!(s.x >= s.y && s.y >= s.z && s.z >= 0.0);
            assert!(v.determinant() > 0.0);
            let oracle = a.svd(false, false).singular_values;
            // The oracle is off by up to 1.2e-14 of the largest value on these matrices, the kernel by 1.2e-15.
            assert!((s - oracle).norm() <= tolerance.max(2e-14) * oracle.x, "{s} {oracle}");
            if oracle.z > 1e-3 * oracle.x {
                assert_eq!(u.determinant() > 0.0, a.determinant() > 0.0);
            }
        });
    }

    fn small_singular_values_keep_relative_accuracy_of_scaled_columns<T>() {
        // One-sided rotations see columns of very different lengths each at its own scale.
        for_each_case(300, |_, rng| {
            let well = rng.rotation(3.1).to_rotation_matrix();
            let d = Matrix3::from_diagonal(&Vector3::new(1.0, 1e-3, 1e-5));
            let a: Matrix3<T> = (well.matrix() * d).map(lit);
            let s = vector_f64(&svd3(&a).unwrap().s);
            let error = (s.component_div(&d.diagonal()) - Vector3::repeat(1.0)).amax();
            assert!(error < FACTORISATION.of::<T>() * 10.0, "{error:e}");
        });
    }

    fn zero_nan_and_infinity<T>() {
        let zero = svd3(&Matrix3::<T>::zeros()).unwrap();
        assert_eq!((zero.u, zero.s, zero.v), (Matrix3::identity(), Vector3::zeros(), Matrix3::identity()));
        for bad in [lit::<T>(f64::NAN), lit(f64::INFINITY), lit(f64::NEG_INFINITY)] {
            for k in 0..9 {
                let mut a = Matrix3::<T>::identity();
                a[k] = bad;
                assert!(svd3(&a).is_none());
                a[k] = T::ONE;
                a[(k / 3, k % 3)] = bad;
                if k / 3 <= k % 3 {
                    assert!(symmetric_eigen(&a).is_none());
                }
            }
        }
        let tiny = Matrix3::from_diagonal(&Vector3::new(T::MIN_POSITIVE, T::MIN_POSITIVE * T::HALF, T::ZERO));
        assert_eq!(svd3(&tiny).unwrap().s, tiny.diagonal());
        let huge = Matrix3::from_diagonal(&Vector3::new(T::MAX, T::MAX * T::HALF, T::ONE));
        assert_eq!(svd3(&huge).unwrap().s.x, T::MAX);
    }

    fn eigenvectors_diagonalise<T>() {
        fn check<T: Real, const N: usize>(rng: &mut Rng, rank: usize) {
            let mut a = SMatrix::<f64, N, N>::zeros();
            for _ in 0..rank {
                let v = SMatrix::<f64, N, 1>::from_fn(|_, _| rng.normal());
                a += v * v.transpose() * rng.normal();
            }
            a *= 10f64.powf(rng.range(-10.0, 10.0));
            let a: SMatrix<T, N, N> = a.map(lit);
            let eigen = symmetric_eigen(&a).unwrap();
            let (a, values, v) = (a.map(T::to_f64), eigen.values.map(T::to_f64), eigen.vectors.map(T::to_f64));
            let tolerance = FACTORISATION.of::<T>() * N as f64;
            assert!((v.transpose() * v - SMatrix::identity()).norm() < tolerance);
            assert!((v * SMatrix::<f64, N, N>::from_diagonal(&values) * v.transpose() - a).norm() <= tolerance * a.norm());
            assert!(values.as_slice().windows(2).all(|w| w[0] >= w[1]));
            // The sum of the eigenvalues' squares is that of the elements', their sum the trace.
            assert!((values.sum() - a.trace()).abs() <= tolerance * a.norm());
            assert!((values.norm() - a.norm()).abs() <= tolerance * a.norm());
        }
        for_each_case(500, |_, rng| {
            check::<T, 1>(rng, 1);
            check::<T, 2>(rng, 2);
            check::<T, 3>(rng, 3);
            check::<T, 3>(rng, 1);
            check::<T, 6>(rng, 6);
            check::<T, 9>(rng, 9);
            check::<T, 9>(rng, 5);
        });
    }

    fn the_lower_triangle_is_not_read<T>() {
        let mut a = Matrix3::<T>::new(T::TWO, T::ONE, T::ZERO, T::ONE, T::TWO, T::ONE, T::ZERO, T::ONE, T::TWO);
        let eigen = symmetric_eigen(&a).unwrap();
        a[(1, 0)] = lit(7.0);
        a[(2, 0)] = lit(-7.0);
        assert_eq!(symmetric_eigen(&a).unwrap(), eigen);
    }
}
