//! Telegrams of the fieldbus data link layer (EN 50170-2, part 4).
//!
//! A character has 11 bits (8 data bits, even parity). A telegram is one of five forms, by its first byte:
//!
//! | form | bytes |
//! |---|---|
//! | SD1 | `10 DA SA FC FCS 16`: no data |
//! | SD2 | `68 LE LE 68 DA SA FC data FCS 16`, LE from 4 to 249 counts DA to data |
//! | SD3 | `A2 DA SA FC data FCS 16`, eight bytes of data |
//! | SD4 | `DC DA SA`: the token |
//! | SC | `E5`: short acknowledgement |
//!
//! FCS is the sum of DA to data, modulo 256. With bit 7 of an address set, its service access point (SAP) is the first
//! byte of the data.
//!
//! `profirust`, the master, has the same telegrams, but its types are private, and its functions assert. The slave has
//! to accept any bytes, needs no std, and exists without the feature `master`. With the master's own codec, tests could
//! not find errors in it.

use core::ops::Deref;

/// The broadcast address, to which all stations listen.
pub const BROADCAST: u8 = 127;
/// The bits of one character on the line.
pub const CHARACTER_BITS: u32 = 11;
/// The idle time before a request, in bits, by which stations find the beginning of a telegram (T_SYN).
pub const IDLE_BITS: u32 = 33;
/// The longest telegram, in bytes.
pub const MAX_LEN: usize = 255;
/// The longest data of a telegram without SAPs, in bytes.
pub const MAX_PAYLOAD: usize = 246;

const SD1: u8 = 0x10;
const SD2: u8 = 0x68;
const SD3: u8 = 0xA2;
const SD4: u8 = 0xDC;
const SC: u8 = 0xE5;
const END: u8 = 0x16;
const EXTENDED: u8 = 0x80;

/// A telegram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Telegram<'a> {
    /// SC: a request without data to return was taken.
    Acknowledgement,
    /// SD4: the right to send passes from one master to another.
    Token {
        /// The station that gets the token.
        to: u8,
        /// The station that had the token.
        from: u8,
    },
    /// SD1, SD2 or SD3.
    Data(Data<'a>),
}

/// A request or a response.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Data<'a> {
    /// DA: the destination, 0 to 127.
    pub to: u8,
    /// SA: the source, 0 to 126.
    pub from: u8,
    /// The service access point at the destination.
    pub to_sap: Option<u8>,
    /// The service access point at the source.
    pub from_sap: Option<u8>,
    /// FC.
    pub function: Function,
    /// The data after the SAPs.
    pub payload: &'a [u8],
}

/// The function code FC.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Function {
    /// Bit 6 is set.
    Request {
        /// The requested service.
        service: Service,
        /// Bits 5 and 4.
        count: FrameCount,
    },
    /// Bit 6 is not set.
    Response {
        /// Bits 5 and 4: 0 is a slave, others are masters.
        station: u8,
        /// Bits 3 to 0.
        status: Status,
    },
}

/// The frame count bit (FCB) and whether it is valid. A repeated request has the same bit as the one before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameCount {
    /// FCB, bit 5.
    pub bit: bool,
    /// FCV, bit 4: if it is clear, a set FCB starts anew.
    pub valid: bool,
}

macro_rules! codes {
    ($(#[$doc:meta])* $name:ident { $($(#[$variant_doc:meta])* $variant:ident = $code:literal,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum $name {
            $($(#[$variant_doc])* $variant = $code,)*
        }

        impl $name {
            /// All of them.
            pub const ALL: &'static [$name] = &[$($name::$variant),*];

            /// The one with this code.
            #[must_use]
            pub fn from_code(code: u8) -> Option<Self> {
                Self::ALL.iter().copied().find(|one| *one as u8 == code)
            }
        }
    };
}

codes! {
    /// The service of a request.
    Service {
        /// Send data, acknowledged, with low priority.
        SdaLow = 3,
        /// Send data, not acknowledged, with low priority.
        SdnLow = 4,
        /// Send data, acknowledged, with high priority.
        SdaHigh = 5,
        /// Send data, not acknowledged, with high priority.
        SdnHigh = 6,
        /// Is there a station?
        FdlStatus = 9,
        /// Send and request data, with low priority.
        SrdLow = 12,
        /// Send and request data, with high priority.
        SrdHigh = 13,
        /// The identity of the station.
        Ident = 14,
        /// The capabilities of a service access point.
        LsapStatus = 15,
    }
}

codes! {
    /// The status of a response.
    Status {
        /// Accepted.
        Ok = 0,
        /// UE: the user of the data link layer failed.
        UserError = 1,
        /// RR: no room.
        NoResources = 2,
        /// RS: the service access point does not exist, or is not active.
        SapNotEnabled = 3,
        /// DL: data.
        DataLow = 8,
        /// NR: no data.
        NoData = 9,
        /// DH: data, and diagnosis is waiting.
        DataHigh = 10,
        /// RDL: not accepted; data.
        NotTakenDataLow = 12,
        /// RDH: not accepted; data, and diagnosis is waiting.
        NotTakenDataHigh = 13,
    }
}

impl Function {
    const fn code(self) -> u8 {
        match self {
            Function::Request { service, count } => {
                0x40 | service as u8 | ((count.bit as u8) << 5) | ((count.valid as u8) << 4)
            }
            Function::Response { station, status } => (station & 3) << 4 | status as u8,
        }
    }

    fn from_code(code: u8) -> Option<Self> {
        if code & 0x80 != 0 {
            return None;
        }
        let (bit, valid) = (code & 0x20 != 0, code & 0x10 != 0);
        Some(if code & 0x40 != 0 {
            Function::Request { service: Service::from_code(code & 0xF)?, count: FrameCount { bit, valid } }
        } else {
            Function::Response { station: code >> 4 & 3, status: Status::from_code(code & 0xF)? }
        })
    }
}

/// The result of decoding the beginning of a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decoded<'a> {
    /// A telegram, and its length in bytes.
    Complete(Telegram<'a>, usize),
    /// The beginning of a telegram.
    Incomplete,
    /// Not a telegram.
    Invalid,
}

/// Decodes the beginning of `bytes`.
#[must_use]
pub fn decode(bytes: &[u8]) -> Decoded<'_> {
    match *bytes {
        [] => Decoded::Incomplete,
        [SC, ..] => Decoded::Complete(Telegram::Acknowledgement, 1),
        [SD4, to, from, ..] if to < EXTENDED && from < EXTENDED => Decoded::Complete(Telegram::Token { to, from }, 3),
        [SD4, _, _, ..] => Decoded::Invalid,
        [SD1, ref rest @ ..] => framed(rest, 3, 1),
        [SD3, ref rest @ ..] => framed(rest, 11, 1),
        [SD2, len, again, SD2, ref rest @ ..] if len == again && (4..=249).contains(&len) => {
            framed(rest, len.into(), 4)
        }
        [SD2, _, _, _, ..] => Decoded::Invalid,
        [SD2 | SD4, ..] => Decoded::Incomplete,
        _ => Decoded::Invalid,
    }
}

/// Decodes `len` bytes from DA to the data, FCS and the end, after a header of `header` bytes.
fn framed(bytes: &[u8], len: usize, header: usize) -> Decoded<'_> {
    let Some((content, [sum, end])) = bytes.get(..len + 2).and_then(<[u8]>::split_last_chunk::<2>) else {
        return Decoded::Incomplete;
    };
    match data(content) {
        Some(data) if *sum == checksum(content) && *end == END => {
            Decoded::Complete(Telegram::Data(data), header + len + 2)
        }
        _ => Decoded::Invalid,
    }
}

fn data(content: &[u8]) -> Option<Data<'_>> {
    let (&[to, from, function], mut payload) = content.split_first_chunk::<3>()?;
    let mut sap = |address: u8| {
        if address & EXTENDED == 0 {
            return Some(None);
        }
        let (&sap, rest) = payload.split_first()?;
        payload = rest;
        Some(Some(sap))
    };
    let (to_sap, from_sap) = (sap(to)?, sap(from)?);
    let function = Function::from_code(function)?;
    Some(Data { to: to & !EXTENDED, from: from & !EXTENDED, to_sap, from_sap, function, payload })
}

fn checksum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum, byte| sum.wrapping_add(*byte))
}

impl Telegram<'_> {
    /// Encodes it; `None` if an address is above 127 or the data are too long for a telegram.
    #[must_use]
    pub fn encode(&self) -> Option<Wire> {
        let mut wire = Wire::EMPTY;
        match *self {
            Telegram::Acknowledgement => wire.push(&[SC])?,
            Telegram::Token { to, from } if to < EXTENDED && from < EXTENDED => wire.push(&[SD4, to, from])?,
            Telegram::Data(data) if data.to < EXTENDED && data.from < EXTENDED => data.encode(&mut wire)?,
            Telegram::Token { .. } | Telegram::Data(_) => return None,
        }
        Some(wire)
    }
}

impl Data<'_> {
    fn encode(&self, wire: &mut Wire) -> Option<()> {
        let saps = usize::from(self.to_sap.is_some()) + usize::from(self.from_sap.is_some());
        // More than 249 bytes would not fit into `wire`.
        let len = u8::try_from(3 + saps + self.payload.len()).ok()?;
        match len {
            3 => wire.push(&[SD1])?,
            11 => wire.push(&[SD3])?,
            _ => wire.push(&[SD2, len, len, SD2])?,
        }
        let begin = usize::from(wire.len);
        let address = |address: u8, sap: Option<u8>| if sap.is_some() { address | EXTENDED } else { address };
        wire.push(&[address(self.to, self.to_sap), address(self.from, self.from_sap), self.function.code()])?;
        for sap in [self.to_sap, self.from_sap].into_iter().flatten() {
            wire.push(&[sap])?;
        }
        wire.push(self.payload)?;
        let sum = checksum(wire.get(begin..)?);
        wire.push(&[sum, END])
    }
}

/// The bytes of a telegram.
#[derive(Clone, Copy, Debug)]
pub struct Wire {
    bytes: [u8; MAX_LEN],
    len: u8,
}

impl Wire {
    /// No bytes.
    pub const EMPTY: Wire = Wire { bytes: [0; MAX_LEN], len: 0 };

    /// Appends bytes; `None`, and no change, if there is no room.
    pub(crate) fn push(&mut self, bytes: &[u8]) -> Option<()> {
        let begin = usize::from(self.len);
        let end = begin + bytes.len();
        self.bytes.get_mut(begin..end)?.copy_from_slice(bytes);
        self.len = end as u8;
        Some(())
    }

    /// Removes the first bytes, of which there must be `count`.
    pub(crate) fn drop_first(&mut self, count: usize) {
        self.bytes.copy_within(count..self.len.into(), 0);
        self.len -= count as u8;
    }
}

impl Deref for Wire {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.bytes[..self.len.into()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATUS: Data<'_> = Data {
        to: 7,
        from: 2,
        to_sap: None,
        from_sap: None,
        function: Function::Request { service: Service::FdlStatus, count: FrameCount { bit: false, valid: false } },
        payload: &[],
    };

    #[track_caller]
    fn check(telegram: Telegram<'_>, bytes: &[u8]) {
        assert_eq!(telegram.encode().as_deref(), Some(bytes));
        assert_eq!(decode(bytes), Decoded::Complete(telegram, bytes.len()));
        for cut in 0..bytes.len() {
            assert_eq!(decode(&bytes[..cut]), Decoded::Incomplete, "{cut} of {bytes:02X?}");
        }
    }

    #[test]
    fn each_form_has_its_bytes() {
        check(Telegram::Acknowledgement, &[0xE5]);
        check(Telegram::Token { to: 2, from: 3 }, &[0xDC, 2, 3]);
        check(Telegram::Data(STATUS), &[0x10, 7, 2, 0x49, 0x52, 0x16]);
        let diagnosis = Data {
            to_sap: Some(60),
            from_sap: Some(62),
            function: Function::Request { service: Service::SrdLow, count: FrameCount { bit: true, valid: false } },
            ..STATUS
        };
        check(Telegram::Data(diagnosis), &[0x68, 5, 5, 0x68, 0x87, 0x82, 0x6C, 60, 62, 0xEF, 0x16]);
        let function = Function::Response { station: 0, status: Status::DataLow };
        let answer = Data { to: 2, from: 7, function, payload: &[1, 2, 3, 4, 5, 6, 7, 8], ..STATUS };
        check(Telegram::Data(answer), &[0xA2, 2, 7, 8, 1, 2, 3, 4, 5, 6, 7, 8, 0x35, 0x16]);
        // Another master that has the token.
        let function = Function::Response { station: 3, status: Status::Ok };
        check(Telegram::Data(Data { to: 2, from: 3, function, ..STATUS }), &[0x10, 2, 3, 0x30, 0x35, 0x16]);
    }

    #[test]
    fn what_is_wrong_is_no_telegram() {
        for bytes in [
            &[0x10, 7, 2, 0x49, 0x53, 0x16][..],
            &[0x10, 7, 2, 0x49, 0x52, 0x17],
            &[0x10, 7, 2, 0xC9, 0xD2, 0x16],
            &[0x68, 5, 6, 0x68],
            &[0x68, 5, 5, 0x69],
            &[0x68, 3, 3, 0x68],
            &[0x68, 250, 250, 0x68],
            &[0xDC, 0x80, 1],
            &[0xDC, 1, 0x80],
            &[0x68, 4, 4, 0x68, 0x87, 0x82, 0x6C, 60, 0xB1, 0x16],
            &[0x00],
        ] {
            assert_eq!(decode(bytes), Decoded::Invalid, "{bytes:02X?}");
        }
    }

    #[test]
    fn what_has_no_telegram_is_not_encoded() {
        let long = [0; MAX_PAYLOAD + 1];
        assert!(Telegram::Data(Data { payload: &long, ..STATUS }).encode().is_none());
        assert!(Telegram::Data(Data { payload: &long[1..], ..STATUS }).encode().is_some());
        for (to, from) in [(128, 2), (7, 128), (200, 2), (7, 200)] {
            assert!(Telegram::Data(Data { to, from, ..STATUS }).encode().is_none());
            assert!(Telegram::Token { to, from }.encode().is_none());
        }
    }
}
