//! All real essential matrices of five bearing pairs, in double-double arithmetic: null space by elimination with
//! complete pivoting, the ten cubics by plain polynomial multiplication, the polynomial of degree 10 of the hidden
//! variable, its real roots counted and isolated by Sturm's theorem. Shares no formula with the kernel's solver beyond
//! the constraints themselves.

use std::collections::BTreeMap;

use epipole::nalgebra::{Matrix3, Vector3};

use super::Dd;

/// A polynomial in x, y, z: exponents to coefficient.
#[derive(Clone, Default)]
struct Poly3(BTreeMap<[u8; 3], Dd>);

impl Poly3 {
    fn add_scaled(&mut self, other: &Self, f: Dd) {
        for (&m, &c) in &other.0 {
            *self.0.entry(m).or_insert(Dd::ZERO) += c * f;
        }
    }

    fn times(&self, other: &Self) -> Self {
        let mut product = Self::default();
        for (m, &c) in &self.0 {
            for (n, &d) in &other.0 {
                let exponents = [m[0] + n[0], m[1] + n[1], m[2] + n[2]];
                *product.0.entry(exponents).or_insert(Dd::ZERO) += c * d;
            }
        }
        product
    }
}

/// The reduced row echelon form by complete pivoting within the first `pivots` columns; the column of each pivot.
fn reduce<const N: usize>(rows: &mut [[Dd; N]], pivots: usize) -> Vec<usize> {
    let mut order = Vec::new();
    for k in 0..rows.len() {
        let candidates = (k..rows.len())
            .flat_map(|r| (0..pivots).map(move |c| (r, c)))
            .filter(|(_, c)| !order.contains(c));
        let (r, c) = candidates
            .max_by(|a, b| {
                let size = |&(r, c): &(usize, usize)| rows[r][c].abs().to_f64();
                size(a).total_cmp(&size(b))
            })
            .expect("more columns than rows");
        rows.swap(k, r);
        order.push(c);
        let pivot = rows[k][c];
        rows[k] = rows[k].map(|v| v / pivot);
        for r in 0..rows.len() {
            if r != k {
                let f = rows[r][c];
                for j in 0..N {
                    let v = rows[k][j];
                    rows[r][j] -= f * v;
                }
            }
        }
    }
    order
}

fn null_space(x1: &[Vector3<f64>; 5], x2: &[Vector3<f64>; 5]) -> Vec<[Dd; 9]> {
    let mut rows: Vec<[Dd; 9]> =
        (0..5).map(|i| std::array::from_fn(|k| Dd::from(x2[i][k / 3]) * Dd::from(x1[i][k % 3]))).collect();
    let pivots = reduce(&mut rows, 9);
    let mut basis: Vec<[Dd; 9]> = Vec::new();
    for free in (0..9).filter(|c| !pivots.contains(c)) {
        let mut v = [Dd::ZERO; 9];
        v[free] = Dd::ONE;
        for (row, &c) in rows.iter().zip(&pivots) {
            v[c] = -row[free];
        }
        for _ in 0..2 {
            for b in &basis {
                let dot = (0..9).fold(Dd::ZERO, |s, k| s + b[k] * v[k]);
                for k in 0..9 {
                    v[k] -= dot * b[k];
                }
            }
        }
        let norm = (0..9).fold(Dd::ZERO, |s, k| s + v[k] * v[k]).sqrt();
        basis.push(v.map(|a| a / norm));
    }
    basis
}

fn cubics(basis: &[[Dd; 9]]) -> Vec<Poly3> {
    let e: Vec<Poly3> = (0..9)
        .map(|k| {
            let monomials = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]];
            Poly3(monomials.into_iter().zip(basis).map(|(m, b)| (m, b[k])).collect())
        })
        .collect();
    let mut square = vec![Poly3::default(); 9];
    for r in 0..3 {
        for c in 0..3 {
            for k in 0..3 {
                square[3 * r + c].add_scaled(&e[3 * r + k].times(&e[3 * c + k]), Dd::ONE);
            }
        }
    }
    let mut trace = Poly3::default();
    for k in 0..3 {
        trace.add_scaled(&square[4 * k], Dd::ONE);
    }
    let mut constraints = Vec::new();
    for r in 0..3 {
        for c in 0..3 {
            let mut p = Poly3::default();
            for k in 0..3 {
                p.add_scaled(&square[3 * r + k].times(&e[3 * k + c]), Dd::from(2.0));
            }
            p.add_scaled(&trace.times(&e[3 * r + c]), Dd::from(-1.0));
            constraints.push(p);
        }
    }
    let mut det = Poly3::default();
    for k in 0..3 {
        let (a, b) = ((k + 1) % 3, (k + 2) % 3);
        det.add_scaled(&e[k].times(&e[3 + a].times(&e[6 + b])), Dd::ONE);
        det.add_scaled(&e[k].times(&e[3 + b].times(&e[6 + a])), Dd::from(-1.0));
    }
    constraints.push(det);
    constraints
}

/// Monomials of total degree 3 in x and y, and those times z of degree 2: eliminated. The rest stays.
const MONOMIALS: [[u8; 3]; 20] = [
    [3, 0, 0],
    [2, 1, 0],
    [1, 2, 0],
    [0, 3, 0],
    [2, 0, 1],
    [2, 0, 0],
    [1, 1, 1],
    [1, 1, 0],
    [0, 2, 1],
    [0, 2, 0],
    [1, 0, 2],
    [1, 0, 1],
    [1, 0, 0],
    [0, 1, 2],
    [0, 1, 1],
    [0, 1, 0],
    [0, 0, 3],
    [0, 0, 2],
    [0, 0, 1],
    [0, 0, 0],
];

fn value(p: &[Dd], x: Dd) -> Dd {
    p.iter().rev().fold(Dd::ZERO, |f, &c| f * x + c)
}

fn product(a: &[Dd], b: &[Dd]) -> Vec<Dd> {
    let mut p = vec![Dd::ZERO; a.len() + b.len() - 1];
    for (i, &u) in a.iter().enumerate() {
        for (j, &v) in b.iter().enumerate() {
            p[i + j] += u * v;
        }
    }
    p
}

fn sum(a: &[Dd], b: &[Dd], f: f64) -> Vec<Dd> {
    let at = |p: &[Dd], k: usize| p.get(k).copied().unwrap_or(Dd::ZERO);
    (0..a.len().max(b.len())).map(|k| at(a, k) + at(b, k) * Dd::from(f)).collect()
}

/// Sturm's chain, each member scaled to a largest coefficient of 1.
fn sturm(p: &[Dd]) -> Vec<Vec<Dd>> {
    let scaled = |p: Vec<Dd>| -> Vec<Dd> {
        let largest = p.iter().fold(0.0f64, |m, c| m.max(c.to_f64().abs()));
        p.iter().map(|&c| c / Dd::from(largest)).collect()
    };
    let derivative = p.iter().enumerate().skip(1).map(|(k, &c)| c * Dd::from(k as f64)).collect();
    let mut chain = vec![scaled(p.to_vec()), scaled(derivative)];
    loop {
        let (mut a, b) = (chain[chain.len() - 2].clone(), chain[chain.len() - 1].clone());
        while a.len() >= b.len() {
            let f = a[a.len() - 1] / b[b.len() - 1];
            let shift = a.len() - b.len();
            for k in 0..b.len() {
                a[k + shift] -= f * b[k];
            }
            a.pop();
        }
        if a.is_empty() || a.iter().all(|c| c.to_f64().abs() < 1e-28) {
            return chain;
        }
        let last = a.len() == 1;
        chain.push(scaled(a.into_iter().map(|c| -c).collect()));
        if last {
            return chain;
        }
    }
}

fn sign_changes(chain: &[Vec<Dd>], x: Dd) -> usize {
    let signs: Vec<bool> =
        chain.iter().map(|p| value(p, x)).filter(|v| v.to_f64() != 0.0).map(|v| v > Dd::ZERO).collect();
    signs.windows(2).filter(|w| w[0] != w[1]).count()
}

/// The real roots in (lo, hi].
fn roots_between(p: &[Dd], lo: f64, hi: f64) -> Vec<Dd> {
    let chain = sturm(p);
    let mut roots = Vec::new();
    let (lo, hi) = (Dd::from(lo), Dd::from(hi));
    let mut open = vec![(lo, hi, sign_changes(&chain, lo), sign_changes(&chain, hi), 0)];
    while let Some((mut lo, mut hi, at_lo, at_hi, depth)) = open.pop() {
        if at_lo <= at_hi {
            continue;
        }
        let half = Dd::from(0.5);
        if at_lo - at_hi > 1 && depth < 90 {
            let mid = (lo + hi) * half;
            let at_mid = sign_changes(&chain, mid);
            open.push((lo, mid, at_lo, at_mid, depth + 1));
            open.push((mid, hi, at_mid, at_hi, depth + 1));
            continue;
        }
        let positive = value(p, lo) > Dd::ZERO;
        for _ in 0..105 {
            let mid = (lo + hi) * half;
            if (value(p, mid) > Dd::ZERO) == positive { lo = mid } else { hi = mid }
        }
        roots.push(lo);
    }
    roots
}

/// Every real essential matrix, of unit norm, that the five pairs allow.
pub fn essential_matrices(x1: &[Vector3<f64>; 5], x2: &[Vector3<f64>; 5]) -> Vec<Matrix3<f64>> {
    let basis = null_space(x1, x2);
    let mut m: Vec<[Dd; 20]> =
        cubics(&basis).iter().map(|p| MONOMIALS.map(|e| p.0.get(&e).copied().unwrap_or(Dd::ZERO))).collect();
    let order = reduce(&mut m, 10);
    let row = |column: usize| m[order.iter().position(|&c| c == column).expect("every pivot column")];
    // The row of a monomial times z less z times the row of the monomial.
    let hidden: Vec<[Vec<Dd>; 3]> = [(4, 5), (6, 7), (8, 9)]
        .map(|(p, q)| {
            let (p, q) = (row(p), row(q));
            [10..13, 13..16, 16..20].map(|range| {
                let part = |r: &[Dd; 20]| r[range.clone()].iter().rev().copied().collect::<Vec<_>>();
                sum(&part(&p), &product(&part(&q), &[Dd::ZERO, Dd::ONE]), -1.0)
            })
        })
        .to_vec();
    let mut det = vec![Dd::ZERO; 11];
    for (i, j, k) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
        let minor = sum(&product(&hidden[i][0], &hidden[j][1]), &product(&hidden[j][0], &hidden[i][1]), -1.0);
        det = sum(&det, &product(&minor, &hidden[k][2]), 1.0);
    }
    let reversed: Vec<Dd> = det.iter().rev().copied().collect();
    let inside = roots_between(&det, -1.0, 1.0);
    let outside = roots_between(&reversed, -1.0, 1.0);
    let outside = outside.into_iter().filter(|w| w.to_f64().abs() < 1.0 && w.to_f64() != 0.0);
    let mut solutions = Vec::new();
    for z in inside.into_iter().chain(outside.map(|w| Dd::ONE / w)) {
        let b: Vec<[Dd; 3]> = hidden.iter().map(|r| std::array::from_fn(|k| value(&r[k], z))).collect();
        let cross = |u: &[Dd; 3], v: &[Dd; 3]| {
            [0, 1, 2].map(|k| u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3])
        };
        // Rows of like size, so that the largest product is the best determined one.
        let b: Vec<[Dd; 3]> = b
            .iter()
            .map(|r| {
                let n = r.iter().fold(Dd::ZERO, |s, &v| s + v * v).sqrt();
                r.map(|v| v / n)
            })
            .collect();
        let null = [cross(&b[0], &b[1]), cross(&b[1], &b[2]), cross(&b[2], &b[0])]
            .into_iter()
            .max_by(|u, v| {
                let size = |u: &[Dd; 3]| u.iter().map(|c| c.to_f64().powi(2)).sum::<f64>();
                size(u).total_cmp(&size(v))
            })
            .expect("three products");
        let c = [null[0], null[1], z * null[2], null[2]];
        let e: [Dd; 9] = std::array::from_fn(|k| (0..4).fold(Dd::ZERO, |s, i| s + c[i] * basis[i][k]));
        let e = Matrix3::from_fn(|r, c| e[3 * r + c].to_f64());
        solutions.push(e / e.norm());
    }
    solutions
}
