//! What a pose server's partner on the host needs: requests, damage, and the answers that the library gives here.
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod answers;
pub mod damage;
pub mod files;
pub mod problems;
