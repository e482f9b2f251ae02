//! Arguments of the LSS commands: the bus, and the device.

use lexican_runtime::Duration;
use lexican_runtime::host::{Link, Pace};
use lexican_runtime::wire::lss::Identity;
use lexican_toolbox::lss::{SCAN_STEPS, Selected, Session, Target, Times, Trouble};

use crate::bus::BusArgs;
use crate::output::{Failure, progress};
use lexican_toolbox::text::duration::{in_milliseconds, milliseconds};

#[derive(clap::Args, Debug)]
pub(crate) struct LinkArgs {
    #[command(flatten)]
    bus: BusArgs,

    /// How long to wait for a response
    #[arg(long, value_name = "TIME", default_value = "500ms", value_parser = milliseconds)]
    timeout: Duration,

    /// How long each of the 133 steps of the search for devices without node-ID lasts
    ///
    /// A response that comes later, within --timeout, is waited for, unless the device does not know the request "identify
    /// non-configured remote slave".
    #[arg(long, value_name = "TIME", default_value = "25ms", value_parser = milliseconds)]
    step: Duration,

    /// Print one JSON object per line
    #[arg(long)]
    pub(super) json: bool,
}

impl LinkArgs {
    /// Opens the bus and runs a session.
    pub(super) fn run<T>(
        &self,
        work: impl FnOnce(&mut Session<Box<dyn Link + Send>>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let link = self.bus.open(Pace::Virtual)?.settled()?.link;
        let times = Times { response: self.timeout, step: self.step };
        Session::run(link, times, |session| {
            let bar = progress("searching {wide_bar} {percent}%", SCAN_STEPS);
            session.on_step(move |step| match step {
                0 => bar.finish_and_clear(),
                step => {
                    if step == 1 {
                        bar.reset();
                    }
                    bar.set_position(step);
                }
            });
            work(session)
        })
    }
}

impl From<Trouble> for Failure {
    fn from(trouble: Trouble) -> Self {
        let failure = Failure::new(&trouble);
        match trouble {
            Trouble::NoDevice => failure.help(
                "is one with LSS on this bus, with power and at this bit rate? Some older devices answer only while they \
                 are stopped: `lexican nmt stop --all`",
            ),
            Trouble::NoSuchDevice => failure.help(
                "is it on this bus, with power and at this bit rate? All four numbers must be those of 1018h; some older \
                 devices answer only while they are stopped: `lexican nmt stop --all`",
            ),
            Trouble::NoUnconfigured => {
                failure.help("`lexican scan` shows those that have one; is it on this bus, and at this bit rate?")
            }
            Trouble::NoFastscan => failure
                .help("select it by --vendor, --product, --revision and --serial, or leave it alone on the bus"),
            Trouble::NoNodeId => {
                failure.help("a response may have been lost: try again, or give it more time with --timeout")
            }
            Trouble::Refused(_) => failure.help("`lexican lss node-id` gives it with more explanations"),
            Trouble::Several => failure.help(
                "select one by --vendor, --product, --revision and --serial: `lexican lss find` shows them for devices \
                 without node-ID, `lexican scan` for the others",
            ),
            Trouble::LostAnswer { times: Times { response, step }, .. } => failure.help(format_args!(
                "a response was lost or came too late: try again with --step {}ms --timeout {}ms",
                in_milliseconds(step.times(4)),
                in_milliseconds(response.times(4))
            )),
            Trouble::Unexpected(_) => failure,
            Trouble::Link(error) => error.into(),
        }
    }
}

#[derive(clap::Args, Debug)]
pub(crate) struct DeviceArgs {
    #[command(flatten)]
    pub(super) link: LinkArgs,

    /// The vendor-ID (1018h:01) of the device: 405, 0x195 or 195h
    ///
    /// With neither this nor --unconfigured, the device is the only one on the bus.
    #[arg(long, value_name = "NUMBER", value_parser = number, requires_all = ["product", "revision", "serial"])]
    vendor: Option<u32>,

    /// Its product code (1018h:02)
    #[arg(long, value_name = "NUMBER", value_parser = number, requires = "vendor")]
    product: Option<u32>,

    /// Its revision number (1018h:03)
    #[arg(long, value_name = "NUMBER", value_parser = number, requires = "vendor")]
    revision: Option<u32>,

    /// Its serial number (1018h:04)
    #[arg(long, value_name = "NUMBER", value_parser = number, requires = "vendor")]
    serial: Option<u32>,

    /// The first device without node-ID that `lexican lss find` finds
    #[arg(long, conflicts_with = "vendor")]
    unconfigured: bool,
}

impl DeviceArgs {
    pub(super) fn target(&self) -> Target {
        match (self.vendor, self.product, self.revision, self.serial) {
            (Some(vendor), Some(product), Some(revision), Some(serial)) => {
                Target::Identity(Identity { vendor, product, revision, serial })
            }
            _ if self.unconfigured => Target::Unconfigured,
            _ => Target::Only,
        }
    }
}

/// One device, or all.
#[derive(clap::Args, Debug)]
pub(crate) struct DevicesArgs {
    #[command(flatten)]
    pub(super) device: DeviceArgs,

    /// All devices that have LSS
    #[arg(long, conflicts_with_all = ["vendor", "unconfigured"])]
    all: bool,
}

impl DevicesArgs {
    /// Selects one device, or all devices, for which it returns `None`.
    pub(super) fn select<L: Link>(&self, session: &mut Session<L>) -> Result<Option<Selected>, Failure> {
        if self.all {
            session.select_all()?;
            Ok(None)
        } else {
            Ok(Some(session.select(self.device.target())?))
        }
    }
}

/// Parses a 32-bit number of an identity: decimal, or hexadecimal with `0x` or `h`.
pub(crate) fn number(text: &str) -> Result<u32, String> {
    let hex = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")).or_else(|| text.strip_suffix(['h', 'H']));
    let (digits, radix) = hex.map_or((text, 10), |digits| (digits, 16));
    let number = u32::from_str_radix(digits, radix).ok().filter(|_| !digits.starts_with('+'));
    number.ok_or_else(|| format!("{text:?} is not a number of 32 bits such as 405, 0x195 or 195h"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_an_identity_are_parsed() {
        for (text, expected) in
            [("405", 405), ("0x195", 0x195), ("195h", 0x195), ("0XffffFFFF", u32::MAX), ("195", 195)]
        {
            assert_eq!(number(text), Ok(expected), "{text}");
        }
        for text in ["100000000h", "2A", "-1", "+1", "", "h"] {
            assert!(number(text).is_err(), "{text}");
        }
    }
}
