//! `epipole::solvers`.

use epipole::Real;
use epipole::solvers as s;

use crate::{Sink, Source};

pub(crate) fn relpose_5pt<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let (x1, x2) = (source.vectors::<T, 5>(), source.vectors::<T, 5>());
    let solutions = s::relpose_5pt(&x1, &x2);
    sink.count(solutions.len());
    for e in &solutions {
        sink.finite(&e.0);
    }
    let wide = s::relpose_5pt_wide(
        &x1.map(|v| v.map(|x| x.to_f64() as f32)),
        &x2.map(|v| v.map(|x| x.to_f64() as f32)),
    );
    for e in &wide {
        sink.finite(&e.0);
    }
}
