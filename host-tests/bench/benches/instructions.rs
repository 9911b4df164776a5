//! One run of every case under callgrind.

use epipole_bench::{Case, Run, cases};
use gungraun::{Callgrind, LibraryBenchmarkConfig, library_benchmark, library_benchmark_group, main};

fn prepare(case: Case) -> Run {
    (case.prepare)()
}

#[library_benchmark]
#[benches::all(iter = cases(), setup = prepare)]
fn run(mut run: Run) -> Run {
    (run.body)();
    run
}

library_benchmark_group!(name = calls, benchmarks = run);
main!(
    // The C library's `memcpy` and `memset` differ by processor: the tunables leave the ones of baseline x86-64.
    config = LibraryBenchmarkConfig::default()
        .env(
            "GLIBC_TUNABLES",
            "glibc.cpu.hwcaps=-AVX512F,-AVX512VL,-AVX2,-AVX2_Usable,-AVX,-AVX_Fast_Unaligned_Load,-ERMS,-FSRM,-SSSE3"
        )
        .tool(Callgrind::with_args(["--cache-sim=no"]));
    library_benchmark_groups = calls
);
