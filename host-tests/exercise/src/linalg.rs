//! `epipole::real` and `epipole::linalg`.

use epipole::linalg::poly::RealRoots10;
use epipole::linalg::{self, Ldlt, Lu, RowQr};
use epipole::{Real, real};

use crate::{Sink, Source};

pub(crate) fn scalar<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let (x, y) = (source.scalar::<T>(), source.scalar::<T>());
    let (sin, cos) = real::sin_cos(x);
    sink.numbers(&[sin, cos, real::sqrt(x), real::atan2(y, x), real::ln(x), real::exp(x), real::cbrt(x)]);
    let whole = real::from_u32(real::from_u32::<T>(source.byte().into()).to_u32());
    sink.numbers(&[real::abs(x), real::max(x, y), real::min(x, y), whole]);
    sink.numbers(&[<T as Real>::from_f64(0.1), <T as Real>::from_u32(7)]);
    sink.flag(real::is_finite(x));
}

pub(crate) fn null_space<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let basis = linalg::null_space::<T, 5, 9, 4>(&source.rows());
    sink.flag(basis.is_some());
    sink.finite(basis.iter().flatten().flatten());
    let refined = linalg::null_space_refined::<T, 7, 9, 2>(&source.rows());
    sink.finite(refined.iter().flatten().flatten());
    let vector = linalg::null_space::<T, 8, 9, 1>(&source.rows());
    sink.finite(vector.iter().flatten().flatten());
}

pub(crate) fn row_qr<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let mut qr = RowQr::<T, 9>::new();
    for _ in 0..source.below(12) {
        qr.fold([source.array::<T, 9>()]);
    }
    sink.numbers(qr.r().iter().flatten());
    let least = qr.least_singular();
    sink.flag(least.is_some());
    if let Some(least) = least {
        sink.finite(&least.vector);
        sink.finite(&[least.value, least.next_value]);
    }
}

pub(crate) fn lu<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let lu = Lu::<T, 6>::new(&source.matrix());
    sink.flag(lu.is_some());
    if let Some(lu) = lu {
        sink.numbers(&lu.solve(&source.matrix::<T, 6, 2>()));
        sink.numbers(&lu.inverse());
        sink.number(lu.determinant());
    }
}

pub(crate) fn ldlt<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let a = source.matrix::<T, 6, 6>();
    let ldlt = Ldlt::new(&(a.transpose() * a));
    sink.flag(ldlt.is_some());
    if let Some(ldlt) = ldlt {
        sink.numbers(&ldlt.solve(&source.matrix::<T, 6, 2>()));
        sink.numbers(&ldlt.inverse());
    }
}

pub(crate) fn symmetric_eigen<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let eigen = linalg::symmetric_eigen(&source.matrix::<T, 5, 5>());
    sink.flag(eigen.is_some());
    if let Some(eigen) = eigen {
        sink.numbers(&eigen.values);
        sink.numbers(&eigen.vectors);
    }
}

pub(crate) fn svd3<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let svd = linalg::svd3(&source.matrix::<T, 3, 3>());
    sink.flag(svd.is_some());
    if let Some(svd) = svd {
        sink.numbers(&svd.u);
        sink.numbers(&svd.s);
        sink.numbers(&svd.v);
    }
}

pub(crate) fn polynomials<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let roots = linalg::poly::projective_roots_10(&source.array::<T, 11>(), T::EPSILON);
    sink.count(roots.len());
    sink.numbers(roots.iter().flat_map(|chart| chart.as_slice()));
    let roots = linalg::poly::real_roots_10(&source.array::<T, 11>(), T::EPSILON);
    sink.numbers(RealRoots10::as_slice(&roots));
    let worst = roots.least_determined();
    sink.numbers(&[worst.x, worst.spread]);
    let roots = linalg::cubic_roots(&source.array::<T, 4>());
    sink.count(roots.len());
    sink.finite(roots.iter());
    let roots = linalg::quartic_roots(&source.array::<T, 5>());
    sink.count(roots.len());
    sink.finite(roots.iter());
    let roots = linalg::quadratic_roots(&source.array::<T, 3>());
    sink.count(roots.len());
    sink.finite(roots.iter());
}
