//! `lexican drive`: moving a drive by hand.

mod args;
mod explain;
mod moving;
mod node;
mod report;

use lexican_runtime::host::{Link, Pace};
use lexican_toolbox::drive::Scales;

use crate::access::read_conditions;
use crate::bus::network;
use crate::output::{Failure, Outcome, on_ctrl_c};
pub(crate) use args::Args;
use moving::Moving;
use node::{Drive, DriveNode, failed};
use report::Report;

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    if args.explain {
        return explain::run(args);
    }
    args.check_value()?;
    // An endless simulation runs in real time, so that users can watch it.
    let pace = if args.is_endless() { Pace::RealTime } else { Pace::Virtual };
    let found = DriveNode::open(&args.bus, pace, args.node, args.device.as_deref(), &args.overlay)?;
    let mut scales = Scales::new(&found.sheet.device, found.description);
    let mut network = network(found.link)?;
    for object in scales.objects() {
        read_conditions(&mut network, args.node, object, scales.values())?;
    }
    let order = args.order(&scales)?;
    let profile = args.profile(&scales, found.description)?;
    explain::say_what_is_used_instead(&found.sheet);
    let mut link = network.into_link();
    link.listen_to(&[])?;
    let mut drive = Drive::connect_described_unprotected(link, args.node, found.description)
        .map_err(|error| failed(error, args.device.is_some()))?;
    let handle = drive.cancel_handle();
    on_ctrl_c(move || handle.cancel())?;
    drive.set_patience(args.within);
    let mut report = Report::new(args.node, &scales, args.json, args.every);
    let mut moving = Moving { args, drive, order, profile, scales: &scales, enabled: false };
    let result = moving.carry_out(&mut report);
    moving.end(&mut report, result)
}
