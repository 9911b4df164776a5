//! Symbols that the comparison programs load: each converts types and calls one public function.
//!
//! A task `bench_<task>_<scalar>(a, b, out)` takes one problem, writes its solutions row-major one after the other and
//! returns how many there are.

pub mod absolute;
pub mod poses;
pub mod robust;
pub mod solvers;
