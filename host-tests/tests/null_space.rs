//! Null spaces by Householder reflections, and the triangular factor of rows that come in blocks.

use epipole::Real;
use epipole::linalg::{RowQr, null_space};
use epipole::nalgebra::SMatrix;
use epipole::real::lit;
use epipole_host_tests::cases::for_each_case;
use epipole_host_tests::tolerances::{FACTORISATION, FOLDED_GRAM};
use epipole_host_tests::{Rng, in_both_scalars};

fn random_rows<T: Real, const M: usize, const N: usize>(rng: &mut Rng) -> [[T; N]; M] {
    std::array::from_fn(|_| {
        let scale = 10f64.powf(rng.range(-3.0, 3.0));
        std::array::from_fn(|_| lit(scale * rng.normal()))
    })
}

fn dot<T: Real>(a: &[T], b: &[T]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x.to_f64() * y.to_f64()).sum()
}

fn basis_is_orthonormal_and_orthogonal_to_the_rows<T: Real, const M: usize, const K: usize>(rng: &mut Rng) {
    let rows = random_rows::<T, M, 9>(rng);
    let basis = null_space::<T, M, 9, K>(&rows).unwrap();
    for (j, v) in basis.iter().enumerate() {
        for (k, w) in basis.iter().enumerate() {
            assert!((dot(v, w) - f64::from(u8::from(j == k))).abs() < FACTORISATION.of::<T>());
        }
        for row in &rows {
            assert!(dot(row, v).abs() < FACTORISATION.of::<T>() * dot(row, row).sqrt());
        }
    }
}

in_both_scalars! {
    fn null_spaces_of_minimal_problems<T>() {
        for_each_case(500, |_, rng| {
            basis_is_orthonormal_and_orthogonal_to_the_rows::<T, 5, 4>(rng);
            basis_is_orthonormal_and_orthogonal_to_the_rows::<T, 7, 2>(rng);
            basis_is_orthonormal_and_orthogonal_to_the_rows::<T, 8, 1>(rng);
        });
    }

    fn dependent_rows_have_no_basis<T>() {
        for_each_case(200, |_, rng| {
            let mut rows = random_rows::<T, 5, 9>(rng);
            let k = rng.index(4);
            rows[4] = rows[k].map(|v| v * lit::<T>(-3.0));
            assert!(null_space::<T, 5, 9, 4>(&rows).is_none());
            rows[4] = [T::ZERO; 9];
            assert!(null_space::<T, 5, 9, 4>(&rows).is_none());
            rows[4] = [T::ONE; 9];
            rows[rng.index(5)][rng.index(9)] = lit([f64::NAN, f64::INFINITY][rng.index(2)]);
            assert!(null_space::<T, 5, 9, 4>(&rows).is_none());
        });
    }

    /// The factor does not know how the rows were divided into blocks, and has the singular values of the whole.
    fn blocks_add_up<T>() {
        for_each_case(200, |_, rng| {
            let rows: [[T; 9]; 24] = std::array::from_fn(|_| std::array::from_fn(|k| lit(rng.normal() * if k == 4 { 0.1 } else { 1.0 })));
            let (mut by_eight, mut by_three) = (RowQr::<T, 9>::new(), RowQr::<T, 9>::new());
            for block in rows.as_chunks::<8>().0 {
                by_eight.fold(*block);
            }
            for block in rows.as_chunks::<3>().0 {
                by_three.fold(*block);
            }
            let whole = SMatrix::<f64, 24, 9>::from_fn(|r, c| rows[r][c].to_f64()).svd(false, true);
            let order = {
                let mut order: Vec<usize> = (0..9).collect();
                order.sort_by(|&a, &b| whole.singular_values[a].total_cmp(&whole.singular_values[b]));
                order
            };
            for qr in [&by_eight, &by_three] {
                let gram = |j: usize, k: usize| -> f64 { qr.r().iter().map(|r| r[j].to_f64() * r[k].to_f64()).sum() };
                let expected = |j: usize, k: usize| -> f64 { rows.iter().map(|r| r[j].to_f64() * r[k].to_f64()).sum() };
                let trace: f64 = (0..9).map(|k| expected(k, k)).sum();
                for j in 0..9 {
                    for k in 0..9 {
                        let error = (gram(j, k) - expected(j, k)).abs();
                        assert!(error < FOLDED_GRAM.of::<T>() * trace, "{error}");
                    }
                }
                let least = qr.least_singular().unwrap();
                let (smallest, largest) = (whole.singular_values[order[0]], whole.singular_values[order[8]]);
                let error = (least.value.to_f64() - smallest).abs();
                assert!(error < 10.0 * FACTORISATION.of::<T>(), "{error}");
                assert!(least.next_value.to_f64() >= smallest && least.next_value.to_f64() <= largest);
            }
        });
    }

    fn least_singular_vector_of_an_exact_null_space<T>() {
        for_each_case(500, |_, rng| {
            // Rows orthogonal to n, whose elements are zero in random places: the pivots vanish anywhere.
            let n: [f64; 9] = std::array::from_fn(|_| if rng.index(3) == 0 { 0.0 } else { rng.normal() });
            let norm = dot(&n, &n).sqrt();
            if norm < 0.1 {
                return;
            }
            let mut qr = RowQr::<T, 9>::new();
            for _ in 0..3 {
                qr.fold::<4>(std::array::from_fn(|_| {
                    let row: [f64; 9] = std::array::from_fn(|_| rng.normal());
                    let f = dot(&row, &n) / (norm * norm);
                    std::array::from_fn(|k| lit(row[k] - f * n[k]))
                }));
            }
            let least = qr.least_singular().unwrap();
            let cosine = dot(&least.vector.map(T::to_f64), &n).abs() / norm;
            let next = least.next_value.to_f64();
            assert!((1.0 - cosine) * next * next < 100.0 * FACTORISATION.of::<T>(), "{cosine}");
            assert!(least.value.to_f64() < 100.0 * FACTORISATION.of::<T>());
        });
    }

    fn malformed_rows_have_no_least_vector<T>() {
        assert!(RowQr::<T, 9>::new().least_singular().is_none());
        for bad in [f64::NAN, f64::INFINITY] {
            let mut qr = RowQr::<T, 9>::default();
            let mut rows = random_rows::<T, 4, 9>(&mut Rng::new(3));
            rows[2][5] = lit(bad);
            qr.fold(rows);
            assert!(qr.least_singular().is_none());
        }
    }
}
