//! Why a slave exchanges no data.

use core::fmt;
use std::format;
use std::string::String;

use profirust::dp::{DiagnosticFlags, Peripheral, PeripheralEvent};

use crate::master::MASTER;

/// Why a slave exchanges no data, as the master has last noticed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Trouble {
    /// Nothing answers at its address.
    Silent { address: u8 },
    /// The slave is of another kind.
    Ident {
        address: u8,
        /// The ident number that the master expects.
        expected: u16,
        /// The ident number of the slave.
        found: u16,
    },
    /// The slave refuses the data of Set_Prm.
    Parameters { address: u8 },
    /// The slave refuses the data of Chk_Cfg.
    Configuration { address: u8 },
    /// Another master has parameterised the slave.
    OtherMaster { address: u8, master: u8 },
    /// The slave answers, but not with the expected data.
    Data { address: u8 },
}

impl Trouble {
    /// The trouble that the last diagnosis of a slave shows; `None` while it exchanges data.
    pub(crate) fn of(peripheral: &Peripheral<'_>, event: PeripheralEvent) -> Option<Self> {
        if matches!(event, PeripheralEvent::DataExchanged | PeripheralEvent::Diagnostics) {
            return None;
        }
        let (address, expected) = (peripheral.address(), peripheral.options().ident_number);
        let Some(seen) = peripheral.last_diagnostics() else { return Some(Trouble::Silent { address }) };
        let has = |flag| seen.flags.contains(flag);
        Some(match (seen.ident_number, seen.master_address) {
            (found, _) if found != expected => Trouble::Ident { address, expected, found },
            (_, Some(master)) if master != MASTER => Trouble::OtherMaster { address, master },
            _ if has(DiagnosticFlags::PARAMETER_FAULT) => Trouble::Parameters { address },
            _ if has(DiagnosticFlags::CONFIGURATION_FAULT) => Trouble::Configuration { address },
            _ => Trouble::Data { address },
        })
    }

    /// What to check, in words.
    #[must_use]
    pub fn remedy(&self) -> String {
        match self {
            Trouble::Silent { address } => format!(
                "is it with power, do its switches say {address}, does it know the bit rate, and are A and B the right way \
                 round and the ends of the line terminated? Two slaves of one address look the same"
            ),
            Trouble::Ident { found, .. } => {
                format!(
                    "name the drive that it is, or the GSD file of its maker: gsd=FILE with the ident number {found:04X}"
                )
            }
            Trouble::Parameters { .. } => "take them from the GSD file of its maker: gsd=FILE".into(),
            Trouble::Configuration { .. } => {
                "take it from the GSD file of its maker: gsd=FILE, and module=NAME where the file has several".into()
            }
            Trouble::OtherMaster { master, .. } => {
                format!("stop master {master}, such as a PLC, or take it off the line: a slave has one master")
            }
            Trouble::Data { .. } => {
                "name the module that is plugged in, in the GSD file of its maker: gsd=FILE&module=NAME".into()
            }
        }
    }
}

impl fmt::Display for Trouble {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Trouble::Silent { address } => write!(f, "no slave answers at address {address} of the PROFIBUS"),
            Trouble::Ident { address, expected, found } => write!(
                f,
                "the slave at address {address} has the ident number {found:04X}, and {expected:04X} is expected"
            ),
            Trouble::Parameters { address } => write!(f, "the slave at address {address} refuses its parameters"),
            Trouble::Configuration { address } => write!(f, "the slave at address {address} refuses the configuration"),
            Trouble::OtherMaster { address, master } => {
                write!(f, "the slave at address {address} belongs to another master, {master}")
            }
            Trouble::Data { address } => {
                write!(f, "the slave at address {address} answers, but exchanges no data of the expected length")
            }
        }
    }
}
