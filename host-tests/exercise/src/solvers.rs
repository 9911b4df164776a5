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

pub(crate) fn relpose_7pt<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let solutions = s::relpose_7pt(&source.vectors::<T, 7>(), &source.vectors());
    sink.count(solutions.len());
    for f in &solutions {
        sink.finite(&f.0);
    }
}

pub(crate) fn relpose_8pt<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let (x1, x2) = (source.vectors::<T, 11>(), source.vectors::<T, 11>());
    for n in [8, 7 + source.below(5)] {
        let (x1, x2) = (x1.get(..n).unwrap_or(&x1), x2.get(..n).unwrap_or(&x2));
        let e = s::relpose_8pt(x1, x2);
        sink.flag(e.is_ok());
        if let Ok(Some(e)) = e {
            sink.finite(&e.0);
        }
        let f = s::fundamental_8pt(x1, x2);
        sink.flag(f.is_ok());
        if let Ok(Some(f)) = f {
            sink.finite(&f.0);
        }
    }
}

pub(crate) fn homography<T: Real>(source: &mut Source<'_>, sink: &mut Sink) {
    let h = s::homography_4pt(&source.vectors::<T, 4>(), &source.vectors());
    sink.flag(h.is_some());
    if let Some(h) = h {
        sink.finite(&h.0);
    }
    let (x1, x2) = (source.vectors::<T, 6>(), source.vectors::<T, 6>());
    let n = 3 + source.below(4);
    let h = s::homography_npt(x1.get(..n).unwrap_or(&x1), x2.get(..n).unwrap_or(&x2));
    sink.flag(h.is_ok());
    if let Ok(Some(h)) = h {
        sink.finite(&h.0);
    }
}
