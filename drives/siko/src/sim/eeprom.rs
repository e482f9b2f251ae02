//! The non-volatile data of the drive, as a text and as a file.

use std::collections::BTreeMap;

use lexican_runtime::object::Address;
pub use simulator::eeprom::EepromError;
use simulator::eeprom::{EepromFormat, entry_of_line};

use super::address;
use crate::model::Model;

/// Whether an object holds parameter 25.
fn has_inching_stop(model: &Model) -> bool {
    model.persistent.contains(&address::INCHING_STOP)
}

/// The data that survive without power: the EEPROM, and the absolute encoder with its battery.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NonVolatile {
    /// The persistent entries, in wire form.
    pub eeprom: BTreeMap<Address, u64>,
    /// In units of 6064h.
    pub position: i32,
    /// Parameter 25 of a drive without an object for it: how inching operation 2 stops, 0 with full deceleration, 1
    /// with the programmed one.
    pub inching_stop: u8,
}

impl NonVolatile {
    /// As the text of the file:
    ///
    /// ```text
    /// lexican siko/ag03-1 eeprom 1
    /// position -5000
    /// 2410:01 0x64
    /// end 1 entries, crc32 3B0D4C1F
    /// ```
    ///
    /// The first line tells what the file is, and the last one that it is complete: a file that was truncated, edited
    /// without updating the checksum, or written by something else is refused, and never taken for a new drive.
    ///
    /// A drive without 2416h has a line `inching_stop 1` after the position.
    #[must_use]
    pub fn to_text(&self, model: &Model) -> String {
        let position = format!("position {}", self.position);
        let inching_stop = (!has_inching_stop(model)).then(|| format!("{INCHING_STOP} {}", self.inching_stop));
        let entries = self.eeprom.iter().map(|(address, raw)| format!("{address} {raw:#x}"));
        let lines: Vec<String> = [position].into_iter().chain(inching_stop).chain(entries).collect();
        model.eeprom.seal(&lines)
    }

    /// Reads the text of a file.
    ///
    /// Errors: the text is not that of such a drive, or is incomplete.
    pub fn from_text(model: &Model, text: &str) -> Result<Self, EepromError> {
        let mut kept = NonVolatile::default();
        format(model).read(text, |line| kept.take(model, line))?;
        Ok(kept)
    }

    fn take(&mut self, model: &Model, line: &str) -> Option<()> {
        if let Some(position) = line.strip_prefix("position ") {
            self.position = position.parse().ok()?;
            return Some(());
        }
        if !has_inching_stop(model)
            && let Some(stop) = line.strip_prefix(INCHING_STOP).and_then(|stop| stop.strip_prefix(' '))
        {
            self.inching_stop = stop.parse().ok().filter(|stop| *stop <= 1)?;
            return Some(());
        }
        let (address, value) = entry_of_line(line)?;
        let raw = u64::from_str_radix(value.strip_prefix("0x")?, 16).ok()?;
        let kept = model.persistent.contains(&address);
        kept.then(|| self.eeprom.insert(address, raw))?;
        Some(())
    }
}

/// The beginning of the line with parameter 25.
const INCHING_STOP: &str = "inching_stop";

/// The format of a drive's file.
fn format(model: &Model) -> EepromFormat {
    let line = "`position -5000` nor an entry that the drive keeps, such as `2410:01 0x64`";
    EepromFormat { text: model.eeprom, device: model.name, line }
}
