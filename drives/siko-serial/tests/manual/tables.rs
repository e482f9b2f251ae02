//! Tables as rows by column, and a drive that takes telegrams as texts.

use std::collections::BTreeMap;
use std::path::Path;

use lexican_eds::model::{Parameter, Value};
use lexican_runtime::host::Node;
use lexican_runtime::{CobId, Duration, Frame, Instant};
use siko_serial::sim::SerialDrive;

pub(crate) type Row = BTreeMap<String, String>;

/// The rows of a table, below the root of the workspace.
pub(crate) fn rows(path: &str) -> Vec<Row> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path);
    let mut reader = csv::Reader::from_path(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    reader.deserialize().map(|row| row.expect("a row of the table")).collect()
}

/// A table of the manual.
pub(crate) fn manual(name: &str) -> Vec<Row> {
    rows(&format!("tests/manual/ag02-serial/{name}.csv"))
}

/// The parameters of the overlay, with their numbers in chapter 8, which stand in the descriptions.
pub(crate) fn parameters() -> Vec<Row> {
    let sheet = lexican_eds::library::find("siko/ag02").expect("the library has it");
    let (device, _) = lexican_eds::load(&sheet.input());
    let row = |parameter: &Parameter| {
        let text = parameter.number.to_string();
        let (read, write) = text.split_once('/').unwrap_or(("", &text));
        let (_, number) = parameter.entry.description.as_deref()?.split_once("parameter ")?;
        let codes: Vec<i128> = parameter.values.iter().map(|value| value.value).collect();
        let limit = |limit: &Option<Value>| limit.as_ref().and_then(Value::as_integer);
        let low = codes.iter().min().copied().or(limit(&parameter.entry.low));
        let high = codes.iter().max().copied().or(limit(&parameter.entry.high));
        let object = parameter.object().map(|(index, sub)| format!("{index:04X}:{sub:02X}"));
        let columns = [
            ("parameter", number.split(')').next().unwrap_or_default().to_owned()),
            ("read", read.to_owned()),
            ("write", write.to_owned()),
            ("low", low.expect("a limit").to_string()),
            ("high", high.expect("a limit").to_string()),
            ("object", object.unwrap_or_default()),
            ("stored", if parameter.entry.persistent { "yes" } else { "no" }.to_owned()),
        ];
        Some(columns.into_iter().map(|(column, cell)| (column.to_owned(), cell)).collect())
    };
    let parameters = &device.interfaces["serial"].parameters;
    parameters.iter().map(|parameter| row(parameter).unwrap_or_else(|| panic!("{}", parameter.number))).collect()
}

/// A new drive, and the time.
#[derive(Default)]
pub(crate) struct Raw {
    pub(crate) drive: SerialDrive,
    pub(crate) now: Instant,
}

impl Raw {
    /// Sends telegrams that `;` separates, or lets happen what is named so; returns the last answer.
    pub(crate) fn send(&mut self, telegrams: &str) -> Vec<u8> {
        let mut last = Vec::new();
        for telegram in telegrams.split(';').filter(|telegram| !telegram.is_empty()) {
            if !self.happens(telegram) {
                self.drive.handle_bytes(self.now, telegram.as_bytes());
                last =
                    std::iter::from_fn(|| self.drive.poll_transmit()).flat_map(|it| it.as_bytes().to_vec()).collect();
            }
        }
        last
    }

    /// The answer as a text without its CR.
    pub(crate) fn text(&mut self, telegrams: &str) -> String {
        String::from_utf8(self.send(telegrams)).unwrap().trim_end_matches('\r').to_owned()
    }

    pub(crate) fn status(&mut self) -> u16 {
        u16::from_str_radix(self.text("R").trim_end_matches('>'), 16).unwrap()
    }

    pub(crate) fn pass(&mut self, span: Duration) {
        let until = self.now + span;
        while let Some(deadline) = self.drive.poll_timeout().filter(|deadline| *deadline <= until) {
            self.now = self.now.max(deadline);
            self.drive.handle_timeout(self.now);
        }
        self.now = until;
    }

    fn happens(&mut self, what: &str) -> bool {
        let (now, drive) = (self.now, self.drive.drive_mut());
        match what {
            "fault" => {
                drive.set_inputs(now, |inputs| inputs.sensor_fails = true);
                drive.set_inputs(now, |inputs| inputs.sensor_fails = false);
            }
            "not enabled" => drive.set_inputs(now, |inputs| inputs.enable = false),
            "limit switch 1" => drive.set_inputs(now, |inputs| inputs.limit_switches[0] = true),
            "limit switch 2" => drive.set_inputs(now, |inputs| inputs.limit_switches[1] = true),
            "bus operational" => {
                while drive.poll_transmit(now).is_some() {}
                drive.handle_frame(now, &Frame::from_array(CobId::NMT, [1, 0]));
            }
            _ => return false,
        }
        true
    }
}
