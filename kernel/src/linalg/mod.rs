//! Small fixed-size linear algebra without panic paths or unbounded loops.

mod null_space;
mod row_qr;

pub use null_space::null_space;
pub use row_qr::{LeastSingular, RowQr};
