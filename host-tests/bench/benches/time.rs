//! The time of every case: a run is all its calls.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use epipole_bench::cases;

fn time(criterion: &mut Criterion) {
    for case in cases() {
        let mut run = (case.prepare)();
        let mut group = criterion.benchmark_group(case.name);
        group.throughput(Throughput::Elements(run.calls as u64));
        group.bench_function(case.scalar, |bencher| bencher.iter(&mut run.body));
        group.finish();
    }
}

criterion_group!(benches, time);
criterion_main!(benches);
