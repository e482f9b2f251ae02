//! Arguments of the LSS commands: which bus, and which device.

use lexican_runtime::Duration;
use lexican_runtime::host::{Link, Pace};
use lexican_runtime::wire::lss::Identity;

use super::session::{Selected, Session, Times, Whom};
use crate::bus::BusArgs;
use crate::duration::milliseconds;
use crate::output::Failure;

/// The arguments of every command.
#[derive(clap::Args, Debug)]
pub(super) struct LinkArgs {
    #[command(flatten)]
    pub(super) bus: BusArgs,

    /// How long to wait for an answer, in milliseconds
    #[arg(long, value_name = "MS", default_value = "500", value_parser = milliseconds)]
    pub(super) wait: Duration,

    /// How long each of the 133 steps of the search for devices without node-ID lasts, in milliseconds
    #[arg(long, value_name = "MS", default_value = "25", value_parser = milliseconds)]
    pub(super) step: Duration,

    /// Print one JSON object per line
    #[arg(long)]
    pub(super) json: bool,
}

impl LinkArgs {
    /// Does some work with LSS on the bus.
    pub(super) fn work<T>(
        &self,
        work: impl FnOnce(&mut Session<Box<dyn Link + Send>>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let link = self.bus.open(Pace::Virtual)?.settled()?.link;
        let times = Times { answer: self.wait, step: self.step };
        Session::run(link, times, work)
    }
}

/// The arguments that select a device.
#[derive(clap::Args, Debug)]
pub(super) struct SelectArgs {
    /// The vendor-ID (1018h:01) of the device that is meant: 405, 0x195 or 195h
    ///
    /// With neither this nor --unconfigured, the only device on the bus is meant.
    #[arg(long, value_name = "NUMBER", value_parser = number, requires_all = ["product", "revision", "serial"])]
    pub(super) vendor: Option<u32>,

    /// Its product code (1018h:02)
    #[arg(long, value_name = "NUMBER", value_parser = number, requires = "vendor")]
    pub(super) product: Option<u32>,

    /// Its revision number (1018h:03)
    #[arg(long, value_name = "NUMBER", value_parser = number, requires = "vendor")]
    pub(super) revision: Option<u32>,

    /// Its serial number (1018h:04)
    #[arg(long, value_name = "NUMBER", value_parser = number, requires = "vendor")]
    pub(super) serial: Option<u32>,

    /// A device without node-ID is meant; of several, the one that `lexican lss find` finds first
    #[arg(long, conflicts_with = "vendor")]
    pub(super) unconfigured: bool,
}

impl SelectArgs {
    pub(super) fn whom(&self) -> Whom {
        match (self.vendor, self.product, self.revision, self.serial) {
            (Some(vendor), Some(product), Some(revision), Some(serial)) => {
                Whom::Identity(Identity { vendor, product, revision, serial })
            }
            _ if self.unconfigured => Whom::Unconfigured,
            _ => Whom::Only,
        }
    }
}

/// The device that is selected; `None` when all are.
pub(super) fn select<L: Link>(
    session: &mut Session<L>,
    select: &SelectArgs,
    everybody: bool,
) -> Result<Option<Selected>, Failure> {
    if everybody { session.select_all().map(|()| None) } else { session.select(select.whom()).map(Some) }
}

/// A number of an identity on the command line: as it is printed, as programs write it, or decimal.
fn number(text: &str) -> Result<u32, String> {
    let hex = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")).or_else(|| text.strip_suffix(['h', 'H']));
    let (digits, radix) = hex.map_or((text, 10), |digits| (digits, 16));
    let number = u32::from_str_radix(digits, radix).ok().filter(|_| !digits.starts_with('+'));
    number.ok_or_else(|| format!("{text:?} is not a number of 32 bits such as 405, 0x195 or 195h"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_an_identity_are_understood() {
        let check = |text: &str, expected: Option<u32>| assert_eq!(number(text).ok(), expected, "{text}");
        check("405", Some(405));
        check("0x195", Some(0x195));
        check("195h", Some(0x195));
        check("0XffffFFFF", Some(u32::MAX));
        check("100000000h", None);
        check("195", Some(195));
        check("2A", None);
        check("-1", None);
        check("+1", None);
        check("", None);
        check("h", None);
    }
}
