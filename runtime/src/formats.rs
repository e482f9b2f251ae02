//! `defmt::Format` of types whose `Display` is not a list of their fields: formatted as `Display` does.

use defmt::{Format, Formatter, write};

use crate::abort::AbortCode;
use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::object::Address;
use crate::time::{Duration, Instant};
use crate::wire::emcy::{ErrorCode, ErrorRegister};
use crate::wire::pdo::PdoCobId;

macro_rules! formats {
    ($($(#[$doc:meta])* $type:ty: $text:literal, $it:ident => $($value:expr),*;)*) => {$(
        $(#[$doc])*
        impl Format for $type {
            fn format(&self, f: Formatter<'_>) {
                let $it = self;
                write!(f, $text, $($value),*);
            }
        }
    )*};
}

formats! {
    NodeId: "{=u8}", it => it.get();
    Address: "{=u16:04X}:{=u8:02X}", it => it.index(), it.sub();
    /// The number; the firmware need not have the texts.
    AbortCode: "{=u32:08X}", it => it.0;
    PdoCobId: "{=u32:08X}", it => it.0;
    ErrorCode: "{=u16:04X}", it => it.0;
    ErrorRegister: "{=u8:02X}", it => it.0;
    Instant: "{=u64:us}", it => it.as_micros();
    Duration: "{=u64} us", it => it.as_micros();
}

impl Format for CobId {
    fn format(&self, f: Formatter<'_>) {
        match u16::try_from(self.raw()) {
            Ok(standard) if !self.is_extended() => write!(f, "{=u16:03X}", standard),
            _ => write!(f, "{=u32:08X}", self.raw()),
        }
    }
}

/// Data as a list of bytes in hexadecimal.
impl Format for Frame {
    fn format(&self, f: Formatter<'_>) {
        if self.is_remote() {
            write!(f, "{}#R{=u8}", self.id(), self.dlc());
        } else {
            write!(f, "{}#{=[u8]:02X}", self.id(), self.data());
        }
    }
}

#[cfg(test)]
mod tests {
    use defmt::Format;

    use crate::device::{Event, Misconfigured};
    use crate::manager;
    use crate::service::{lss_device, sdo_client};
    use crate::wire::sdo::{ClientRequest, ServerResponse};

    /// What a firmware logs.
    #[test]
    fn events_errors_and_messages_have_a_format() {
        fn check<T: Format>() {}
        check::<(Event, Misconfigured)>();
        check::<(manager::Event, manager::NetworkEvent)>();
        check::<(lss_device::Event, sdo_client::SdoError)>();
        check::<(ClientRequest, ServerResponse)>();
        check::<(crate::Frame, crate::NodeId, crate::Instant, crate::AbortCode)>();
    }
}
