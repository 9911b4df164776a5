#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]
#![doc = include_str!("../README.md")]

mod bytes;
mod frame;
mod refusal;
mod reply;
mod request;
mod statistics;

pub use bytes::Body;
pub use frame::{Decoder, Frame, Full, OVERHEAD, encode, encoded_len};
pub use refusal::{Reason, Refusal};
pub use reply::{Answer, Inliers, Order, Reply, absolute_pose_reply, relative_pose_reply, reply_bytes};
pub use request::{
    AbsolutePoseRequest, Records, RelativePoseRequest, Request, absolute_pose_request, relative_pose_request,
    request_bytes,
};
pub use statistics::Statistics;

/// The version of the format that this crate speaks.
pub const VERSION: u8 = 1;

/// What a frame is, in its second byte.
pub mod kind {
    /// Correspondences of two views.
    pub const RELATIVE_POSE: u8 = 1;
    /// Correspondences of pixels and known points.
    pub const ABSOLUTE_POSE: u8 = 2;
    /// Asks for the counters.
    pub const STATISTICS: u8 = 3;
    /// Asks for the counters and a restart.
    pub const RESTART: u8 = 4;
    /// Added to a request's kind in its answer.
    pub const ANSWER: u8 = 0x80;
    /// A frame that could not be answered.
    pub const REFUSED: u8 = 0xff;
}
