//! What a server has seen.

use crate::bytes::{Body, Reader};

macro_rules! statistics {
    ($($(#[$doc:meta])* $name:ident,)*) => {
        /// Counters since the start, modulo 2^32, and the server's sizes.
        ///
        /// Every frame that arrived is in exactly one of `answered`, `asked` and the counters that
        /// [`refused`](Self::refused) sums.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct Statistics {
            $($(#[$doc])* pub $name: u32,)*
        }

        impl Statistics {
            /// Names and values, in the order of the format.
            pub fn entries(&self) -> impl Iterator<Item = (&'static str, u32)> {
                [$((stringify!($name), self.$name),)*].into_iter()
            }

            pub(crate) fn parse(body: &[u8]) -> Option<Self> {
                let mut body = Reader(body);
                let statistics = Self { $($name: body.u32()?,)* };
                body.0.is_empty().then_some(statistics)
            }
        }
    };
}

statistics! {
    /// Correspondences that fit, of ordinary cameras.
    capacity,
    /// Correspondences that fit where a camera is a fisheye.
    wide_capacity,
    /// Bytes of a frame that fit, before the stuffing.
    frame_capacity,
    /// Milliseconds since the start.
    uptime_ms,
    /// Bytes received.
    bytes,
    /// Frames answered by an estimate.
    answered,
    /// Frames answered by these counters.
    asked,
    /// Refused: cut short or stuffed wrongly.
    malformed,
    /// Refused: wrong checksum.
    checksum,
    /// Refused: longer than the buffer.
    too_long,
    /// Refused: another version.
    version,
    /// Refused: unknown kind.
    kind,
    /// Refused: a body that contradicts itself.
    length,
    /// Refused: stopped before the end.
    timeout,
    /// Refused: camera, correspondences or options that cannot be used.
    unusable,
    /// Sequence numbers left out, whose frames never came or came damaged.
    missed,
    /// Frames whose number had been passed, repeated ones included.
    late,
    /// Jumps of the number that are neither: a sender that started again.
    restarted,
    /// Estimates that the deadline ended.
    interrupted,
    /// Errors that the line reported: lost bytes, noise.
    line_errors,
    /// Answers that could not be sent, or whose data-ready pin could not be set.
    output_errors,
}

impl Statistics {
    /// Frames refused.
    #[must_use]
    pub fn refused(&self) -> u32 {
        [
            self.malformed,
            self.checksum,
            self.too_long,
            self.version,
            self.kind,
            self.length,
            self.timeout,
            self.unusable,
        ]
        .into_iter()
        .fold(0, u32::wrapping_add)
    }

    /// Writes the counters into a frame's body.
    pub fn write(&self, body: &mut Body<'_>) {
        for (_, value) in self.entries() {
            body.u32(value);
        }
    }
}
