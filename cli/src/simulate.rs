//! `lexican simulate`: a device that exists only in software, on a real bus.

use std::io::Write;

use lexican_runtime::host::{Incoming, Link, LinkError, Node, Pace};
use lexican_runtime::{Duration, Instant, NodeId};
use siko_ag03_1::sim::{Setup, SimulatedDrive};

use crate::bus::simulation::has_simulator;
use crate::bus::virtual_device::VirtualDevice;
use crate::bus::{BusArgs, node_id};
use crate::device::DeviceArgs;
use crate::output::{Failure, Outcome, warn};

/// Simulate a device on a bus
///
/// Any data sheet becomes a node: its defaults are the values, what is written is kept, access rights and limits
/// are enforced, PDOs, heartbeat and EMCY are alive. The SIKO AG03/1 also moves. Runs until it is interrupted.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(flatten)]
    device: DeviceArgs,

    #[command(flatten)]
    bus: BusArgs,

    /// The node-ID, 1 to 127
    #[arg(long, value_name = "ID", value_parser = node_id)]
    node: NodeId,

    /// Stop after so many seconds
    #[arg(long = "for", value_name = "SECONDS")]
    seconds: Option<u64>,
}

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let loaded = args.device.load()?;
    if args.bus.is_log() {
        return Err(Failure::new("a log takes no frames: nobody there would hear the device"));
    }
    let mut link = args.bus.open(Pace::RealTime)?.link;
    let end = args.seconds.map(|seconds| link.now() + Duration::from_secs(seconds));
    let mut node: Box<dyn Node> = if has_simulator(args.device.name()) {
        Box::new(SimulatedDrive::power_on(link.now(), Setup::new(args.node)))
    } else {
        Box::new(VirtualDevice::power_on(link.now(), args.node, &loaded.device))
    };
    let entries = loaded.device.entries().count();
    writeln!(anstream::stderr().lock(), "node {}: {entries} entries of {}", args.node, loaded.input.eds.name())?;
    serve(&mut *link, &mut *node, end)?;
    Ok(Outcome::Clean)
}

/// Lets a node take part in the bus behind a link.
fn serve(link: &mut dyn Link, node: &mut dyn Node, end: Option<Instant>) -> Result<(), Failure> {
    // A bus that is down refuses every frame; once is enough to say so.
    let mut trouble = None;
    loop {
        while let Some(frame) = node.poll_transmit(link.now()) {
            let refused = match link.send(&frame) {
                Err(error) if error.is_final() => return Err(Failure::new(error)),
                Err(error) => Some(error.to_string()),
                Ok(()) => None,
            };
            if refused != trouble {
                refused.iter().for_each(warn);
                trouble = refused;
            }
        }
        let now = link.now();
        if end.is_some_and(|end| now >= end) {
            return Ok(());
        }
        if node.poll_timeout().is_some_and(|at| at <= now) {
            node.handle_timeout(now);
            continue;
        }
        let hour = now + Duration::from_secs(3600);
        let until = [node.poll_timeout(), end].into_iter().flatten().fold(hour, Instant::min);
        match link.receive(until) {
            Ok(Some(Incoming::Frame(frame))) => node.handle_frame(link.now(), &frame),
            Ok(Some(Incoming::State(state))) => warn(format_args!("the bus is {state}")),
            Ok(None) => {}
            Err(LinkError::Ended) => return Ok(()),
            Err(error) => return Err(Failure::new(error)),
        }
    }
}
