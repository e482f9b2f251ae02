//! The services of DP-V0 between a master and a slave, as bytes and as words.

use core::fmt;

/// Service access points of slaves, and of the master that uses them. Data exchange has none.
pub mod sap {
    /// Set_Slave_Add: another address.
    pub const SET_SLAVE_ADDRESS: u8 = 55;
    /// RD_Inp: the inputs, for any master.
    pub const READ_INPUTS: u8 = 56;
    /// RD_Outp: the outputs, for any master.
    pub const READ_OUTPUTS: u8 = 57;
    /// Global_Control: to all slaves at once, not answered.
    pub const GLOBAL_CONTROL: u8 = 58;
    /// Get_Cfg: the present configuration.
    pub const GET_CONFIGURATION: u8 = 59;
    /// Slave_Diag.
    pub const DIAGNOSIS: u8 = 60;
    /// Set_Prm.
    pub const SET_PARAMETERS: u8 = 61;
    /// Chk_Cfg.
    pub const CHECK_CONFIGURATION: u8 = 62;
    /// The SAP of the master (MS0).
    pub const MASTER: u8 = 62;
}

/// The data of Set_Prm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameters<'a> {
    /// The master takes the slave for itself.
    pub lock: bool,
    /// The master gives the slave free.
    pub unlock: bool,
    /// Sync mode will be used.
    pub sync: bool,
    /// Freeze mode will be used.
    pub freeze: bool,
    /// The two factors of the watchdog, whose time is their product times 10 ms; `None` if it is off.
    pub watchdog: Option<(u8, u8)>,
    /// The shortest time before an answer (minimum T_SDR), in bits; 0 leaves it unchanged.
    pub min_tsdr_bits: u8,
    /// The ident number that the slave is expected to have.
    pub ident: u16,
    /// The groups for Global_Control, one per bit.
    pub groups: u8,
    /// User parameters, particular to the slave.
    pub user: &'a [u8],
}

impl<'a> Parameters<'a> {
    /// Reads the data of Set_Prm; `None` if they have fewer than seven bytes.
    #[must_use]
    pub fn parse(payload: &'a [u8]) -> Option<Self> {
        let (&[status, factor_1, factor_2, min_tsdr_bits, high, low, groups], user) =
            payload.split_first_chunk::<7>()?;
        Some(Parameters {
            lock: status & 0x80 != 0,
            unlock: status & 0x40 != 0,
            sync: status & 0x20 != 0,
            freeze: status & 0x10 != 0,
            watchdog: (status & 0x08 != 0).then_some((factor_1, factor_2)),
            min_tsdr_bits,
            ident: u16::from_be_bytes([high, low]),
            groups,
            user,
        })
    }

    /// The first seven bytes of its data.
    #[must_use]
    pub fn head(&self) -> [u8; 7] {
        let bit = |set: bool, mask: u8| if set { mask } else { 0 };
        let status = bit(self.lock, 0x80)
            | bit(self.unlock, 0x40)
            | bit(self.sync, 0x20)
            | bit(self.freeze, 0x10)
            | bit(self.watchdog.is_some(), 0x08);
        let (factor_1, factor_2) = self.watchdog.unwrap_or_default();
        let [high, low] = self.ident.to_be_bytes();
        [status, factor_1, factor_2, self.min_tsdr_bits, high, low, self.groups]
    }
}

/// The command of Global_Control.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GlobalControl {
    /// Sets outputs to zero.
    pub clear: bool,
    /// Inputs are updated again.
    pub unfreeze: bool,
    /// Inputs stay as they are now, until the next freeze.
    pub freeze: bool,
    /// Outputs are updated again.
    pub unsync: bool,
    /// Outputs become the last ones received, and stay so until the next sync.
    pub sync: bool,
    /// The groups that are addressed; 0 for all slaves.
    pub groups: u8,
}

impl GlobalControl {
    /// Reads the data of Global_Control; `None` if they have fewer than two bytes.
    #[must_use]
    pub fn parse(payload: &[u8]) -> Option<Self> {
        let &[command, groups] = payload.first_chunk()?;
        let [clear, unfreeze, freeze, unsync, sync] = [1, 2, 3, 4, 5].map(|bit| command >> bit & 1 == 1);
        Some(GlobalControl { clear, unfreeze, freeze, unsync, sync, groups })
    }

    /// Its data.
    #[must_use]
    pub fn bytes(&self) -> [u8; 2] {
        let bits = [self.clear, self.unfreeze, self.freeze, self.unsync, self.sync];
        let command = bits.iter().zip(1..).fold(0, |command, (set, bit)| command | u8::from(*set) << bit);
        [command, self.groups]
    }
}

macro_rules! diagnosis_bits {
    ($($name:ident = $byte:literal, $bit:literal, $text:literal;)*) => {
        /// Bits of the first three bytes of a diagnosis, byte 1 lowest.
        pub mod diagnosis {
            $(#[doc = concat!("Byte ", $byte, ", bit ", $bit, ": ", $text, ".")]
            pub const $name: u32 = 1 << (8 * ($byte - 1) + $bit);)*

            /// The text of each bit.
            pub const TEXTS: &[(u32, &str)] = &[$(($name, $text)),*];
        }
    };
}

diagnosis_bits! {
    STATION_NON_EXISTENT = 1, 0, "the station does not answer (set by the master)";
    STATION_NOT_READY = 1, 1, "not ready for data exchange";
    CONFIGURATION_FAULT = 1, 2, "the configuration is not that of the slave";
    EXTENDED = 1, 3, "more diagnosis follows";
    NOT_SUPPORTED = 1, 4, "a function is asked for that the slave does not have";
    INVALID_RESPONSE = 1, 5, "the slave's answer makes no sense (set by the master)";
    PARAMETER_FAULT = 1, 6, "the parameters, or the ident number, are not those of the slave";
    MASTER_LOCK = 1, 7, "another master has the slave (set by the master)";
    PARAMETERS_REQUIRED = 2, 0, "parameters and configuration are needed";
    STATIC = 2, 1, "the slave has no valid data: only diagnosis until this is over";
    ALWAYS = 2, 2, "a diagnosis of a slave";
    WATCHDOG_ON = 2, 3, "the watchdog is on";
    FREEZE = 2, 4, "inputs are frozen";
    SYNC = 2, 5, "outputs are synchronised";
    DEACTIVATED = 2, 7, "the slave is not in use (set by the master)";
    OVERFLOW = 3, 7, "more diagnosis than there is room for";
}

/// The first six bytes of the answer to Slave_Diag.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Diagnosis {
    /// Bytes 1 to 3, see [`diagnosis`].
    pub bits: u32,
    /// The address of the master that has parameterised the slave.
    pub master: Option<u8>,
    /// The ident number.
    pub ident: u16,
}

impl Diagnosis {
    /// Reads the first six bytes; `None` if there are fewer.
    #[must_use]
    pub fn parse(payload: &[u8]) -> Option<Self> {
        let &[a, b, c, master, high, low] = payload.first_chunk()?;
        let master = (master != 0xFF).then_some(master);
        Some(Diagnosis { bits: u32::from_le_bytes([a, b, c, 0]), master, ident: u16::from_be_bytes([high, low]) })
    }

    /// Its bytes.
    #[must_use]
    pub fn bytes(&self) -> [u8; 6] {
        let [a, b, c, _] = self.bits.to_le_bytes();
        let [high, low] = self.ident.to_be_bytes();
        [a, b, c, self.master.unwrap_or(0xFF), high, low]
    }

    /// The texts of the bits that are set.
    pub fn texts(&self) -> impl Iterator<Item = &'static str> + use<> {
        let bits = self.bits & !diagnosis::ALWAYS;
        diagnosis::TEXTS.iter().filter(move |(bit, _)| bits & bit != 0).map(|(_, text)| *text)
    }
}

/// `ident 0AC5, master 2: not ready for data exchange; the watchdog is on`
impl fmt::Display for Diagnosis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ident {:04X}, ", self.ident)?;
        match self.master {
            Some(master) => write!(f, "master {master}")?,
            None => write!(f, "no master")?,
        }
        for (number, text) in self.texts().enumerate() {
            write!(f, "{}{text}", if number == 0 { ": " } else { "; " })?;
        }
        Ok(())
    }
}

/// The length of inputs and outputs in a configuration; `None` if it ends in the middle of an identifier, or has no
/// data.
///
/// An identifier in the compact format is one byte. In the special format (bits 5 and 4 are 0), length bytes follow,
/// first that of the outputs, and then as many manufacturer bytes as bits 3 to 0 say.
#[must_use]
pub fn lengths(configuration: &[u8]) -> Option<Lengths> {
    let bytes = |length: u8| (if length & 0x40 != 0 { 2 } else { 1 }) * (usize::from(length & 0x3F) + 1);
    let (mut sum, mut rest) = (Lengths { inputs: 0, outputs: 0 }, configuration);
    let mut next = || {
        let (first, others) = rest.split_first()?;
        rest = others;
        Some(*first)
    };
    while let Some(identifier) = next() {
        let (outputs, inputs) = (identifier & 0x20 != 0, identifier & 0x10 != 0);
        if outputs || inputs {
            let len = bytes(identifier & 0x4F);
            sum.outputs += if outputs { len } else { 0 };
            sum.inputs += if inputs { len } else { 0 };
            continue;
        }
        sum.outputs += if identifier & 0x80 != 0 { bytes(next()?) } else { 0 };
        sum.inputs += if identifier & 0x40 != 0 { bytes(next()?) } else { 0 };
        for _ in 0..identifier & 0x0F {
            next()?;
        }
    }
    (sum.inputs + sum.outputs > 0).then_some(sum)
}

/// Bytes of cyclic data, as the master sees them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lengths {
    /// From the slave.
    pub inputs: usize,
    /// To the slave.
    pub outputs: usize,
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;

    use super::*;

    #[test]
    fn parameters_are_read_as_they_are_written() {
        let payload = [0xB8, 2, 50, 11, 0x0A, 0xC5, 0x80, 1, 2];
        let parameters = Parameters::parse(&payload).unwrap();
        let expected = Parameters {
            lock: true,
            unlock: false,
            sync: true,
            freeze: true,
            watchdog: Some((2, 50)),
            min_tsdr_bits: 11,
            ident: 0x0AC5,
            groups: 0x80,
            user: &[1, 2],
        };
        assert_eq!((parameters, &parameters.head()[..]), (expected, &payload[..7]));
        assert_eq!(Parameters::parse(&payload[..6]), None);
    }

    #[test]
    fn each_bit_of_the_station_status_is_one_thing() {
        let of = |status| {
            let payload = [status, 1, 1, 0, 0, 0, 0];
            let read = Parameters::parse(&payload).unwrap();
            assert_eq!(read.head()[0], status & 0xF8);
            [read.lock, read.unlock, read.sync, read.freeze, read.watchdog.is_some()]
        };
        for (place, bit) in [0x80, 0x40, 0x20, 0x10, 0x08].into_iter().enumerate() {
            assert_eq!(of(bit), core::array::from_fn(|flag| flag == place));
        }
        assert_eq!(of(0x07), [false; 5]);
    }

    #[test]
    fn global_control_is_read_as_it_is_written() {
        for command in 0..=0xFF_u8 {
            let read = GlobalControl::parse(&[command, 0x11]).unwrap();
            assert_eq!(read.bytes(), [command & 0x3E, 0x11]);
        }
        assert_eq!(GlobalControl::parse(&[8, 0]), Some(GlobalControl { freeze: true, ..GlobalControl::default() }));
        assert_eq!(GlobalControl::parse(&[0]), None);
    }

    #[test]
    fn a_diagnosis_says_what_it_means() {
        let bytes = [0x42, 0x05, 0x00, 0xFF, 0x0A, 0xC5];
        let read = Diagnosis::parse(&bytes).unwrap();
        assert_eq!(read.bytes(), bytes);
        assert_eq!(
            read.to_string(),
            "ident 0AC5, no master: not ready for data exchange; the parameters, or the ident number, are not those \
             of the slave; parameters and configuration are needed"
        );
        let well = Diagnosis::parse(&[0, 0x0C, 0, 2, 0x08, 0xC9]).unwrap();
        assert_eq!(well.to_string(), "ident 08C9, master 2: the watchdog is on");
        assert_eq!(Diagnosis::parse(&bytes[..5]), None);
    }

    #[test]
    fn a_configuration_says_how_long_the_data_is() {
        // Four and three words in both directions; one byte of inputs; two bytes of outputs.
        assert_eq!(lengths(&[0xF3, 0xF2]), Some(Lengths { inputs: 14, outputs: 14 }));
        assert_eq!(lengths(&[0x10, 0x21]), Some(Lengths { inputs: 1, outputs: 2 }));
        assert_eq!(lengths(&[0x11]), Some(Lengths { inputs: 2, outputs: 0 }));
        // In the special format: seven words each way, with two bytes of the maker; inputs only; an empty slot.
        assert_eq!(lengths(&[0xC2, 0xC6, 0xC6, 1, 2]), Some(Lengths { inputs: 14, outputs: 14 }));
        assert_eq!(lengths(&[0x40, 0x83, 0x00, 0xF3]), Some(Lengths { inputs: 12, outputs: 8 }));
        assert_eq!(lengths(&[0x80, 0x01]), Some(Lengths { inputs: 0, outputs: 2 }));
        assert_eq!(lengths(&[0x01, 0x05, 0x11]), Some(Lengths { inputs: 2, outputs: 0 }));
        for broken in [&[][..], &[0x00], &[0xC0, 0xC6], &[0xF3, 0x80], &[0xC1, 0xC6, 0xC6]] {
            assert_eq!(lengths(broken), None, "{broken:02X?}");
        }
    }
}
