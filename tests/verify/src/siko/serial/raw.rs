//! A simulated drive that takes telegrams as texts.

use lexican_runtime::host::Node;
use lexican_runtime::{CobId, Duration, Frame, Instant};
use siko_serial::sim::SerialDrive;

/// A drive with its time.
#[derive(Default)]
pub(crate) struct Raw {
    pub(crate) drive: SerialDrive,
    pub(crate) now: Instant,
}

impl Raw {
    /// Sends telegrams separated by `;`, or causes an event that has such a name. Returns the last answer.
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
        String::from_utf8(self.send(telegrams)).unwrap_or_default().trim_end_matches('\r').to_owned()
    }

    /// The system status word; 0 if the drive does not answer.
    pub(crate) fn status(&mut self) -> u16 {
        u16::from_str_radix(self.text("R").trim_end_matches('>'), 16).unwrap_or_default()
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

/// A telegram that begins as a table lists it, with values added where they are missing.
pub(crate) fn whole(listed: &str) -> String {
    let rest = match (listed.as_bytes().first(), listed.len()) {
        (Some(b'A' | b'E' | b'L' | b'T' | b'X'), 1) => "0",
        (Some(b'F'), 1) => "0+0000000",
        (Some(b'F'), 2) => "+0000000",
        (Some(b'G'), 1) => "00",
        (Some(b'H'), 1) => "0000250",
        (Some(b'H'), 3) => "00001",
        (Some(b'S'), 1) => "11103",
        _ => "",
    };
    format!("{listed}{rest}")
}
