//! `lexican drive`: moving a drive by hand.

mod args;
mod moving;
mod node;
mod report;

use lexican_driver::Error;
use lexican_runtime::host::{Link, Pace};
use lexican_toolbox::drive::Scales;

use crate::access::read_conditions;
use crate::bus::failure::NO_ANSWER;
use crate::bus::network;
use crate::output::{Failure, Outcome, on_ctrl_c};
pub(crate) use args::Args;
use moving::{Drive, Moving};
use node::DriveNode;
use report::Report;

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    args.check_value()?;
    // Without an end, a simulation runs in real time, so that one can watch it.
    let pace = if args.is_endless() { Pace::RealTime } else { Pace::Virtual };
    let found = DriveNode::open(&args.bus, pace, args.node, args.device.as_deref(), &args.overlay)?;
    let mut scales = Scales::new(&found.sheet.device, found.description);
    let mut network = network(found.link)?;
    for object in scales.objects() {
        read_conditions(&mut network, args.node, object, scales.values())?;
    }
    let order = args.order(&scales)?;
    let mut link = network.into_link();
    link.listen_to(&[])?;
    let mut drive = Drive::connect_described_unprotected(link, args.node, found.description)?;
    let handle = drive.cancel_handle();
    on_ctrl_c(move || handle.cancel())?;
    drive.set_patience(args.within);
    let mut report = Report::new(args.node, &scales, args.json, args.every);
    let mut moving = Moving { args, drive, order, scales: &scales, enabled: false };
    let result = moving.carry_out(&mut report);
    moving.end(&mut report, result)
}

/// How connecting to a drive fails.
impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        match error {
            Error::Link(error) => error.into(),
            Error::Sdo(_) => Failure::new(&error).help(NO_ANSWER),
            Error::NotThisDrive { .. } => Failure::new(&error).help("name what it is: --device FILE.eds"),
            _ => Failure::new(&error),
        }
    }
}
