//! What a response did to a transfer.

use crate::abort::AbortCode;

/// How a transfer goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Progress {
    /// It does not belong to it.
    Ignored,
    /// It belongs to it, and more will come without a request.
    Awaited,
    /// The next request is to be sent.
    Continue,
    /// The server goes on with segments, and not with blocks.
    Segmented { announced: Option<u32> },
    /// The transfer is complete.
    Done { len: u32 },
    /// The transfer is complete, and the server awaits the confirmation.
    BlockUploadDone { len: u32 },
}

/// Why a transfer ends that is not at its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Failure {
    TimedOut,
    Stalled,
    TooLong { capacity: u32 },
    TooShort { len: u32 },
    Violation(AbortCode),
}
