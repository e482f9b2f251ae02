//! A drive that is both simulated and driven by its data sheet, as by `lexican drive`.

use lexican_driver::{Any, Drive, Error, Protection, Supervision};
use lexican_eds::Source;
use lexican_runtime::host::{VirtualBus, VirtualLink};
use lexican_runtime::{Duration, NodeId};
use lexican_simulation::{Plant, PlantDevice};
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::drive::{Ending, Order, Times, carry_out, describe, prepare, set_profile};

pub(crate) struct Rig {
    pub(crate) bus: VirtualBus,
    pub(crate) drive: Drive<VirtualLink, Any>,
}

impl Rig {
    /// Connects to the simulated drive.
    pub(crate) fn new(sheet: DataSheet, node: NodeId) -> Result<Self, Error> {
        Rig::of(sheet.clone(), sheet, node, "")
    }

    /// Connects, by one data sheet, to a drive that is simulated by another one and follows a script.
    pub(crate) fn of(simulated: DataSheet, named: DataSheet, node: NodeId, script: &str) -> Result<Self, Error> {
        let description = describe(&named.input).expect("a drive of CiA 402");
        let mut device = PlantDevice::new(Some(node), "drive.eds", simulated);
        device.script = (!script.is_empty()).then(|| Source::new("script.toml", script));
        let bus = VirtualBus::with_bit_rate(500);
        bus.attach(Plant::of(device).segment(bus.now()).expect("a device of its data sheet"));
        let drive = Drive::connect_described_unprotected(bus.link(), node, description)?;
        Ok(Rig { bus, drive })
    }

    /// Arms the drive's way to notice that the command is gone, if it has one.
    pub(crate) fn protect(&mut self) -> Result<Protection, Error> {
        match self.drive.protect(Supervision::within(Duration::from_secs(1))) {
            Err(Error::Unsupported { .. } | Error::HeartbeatExcludesGuarding { .. }) => Ok(Protection::None),
            other => other,
        }
    }

    /// Enables the drive and gives it an order, with velocity and ramps if they are given.
    pub(crate) fn carry_out(&mut self, order: Order, profile: Option<i64>) -> Result<Ending, Error> {
        self.drive.run(async |drive| set_profile(&drive, profile, None).await)?;
        self.drive.run(async |drive| prepare(&drive, order).await)?;
        self.drive.enable()?;
        let times = Times { within: Duration::from_secs(600), lasting: Some(Duration::from_secs(2)) };
        self.drive.run(async |drive| carry_out(&drive, order, times, &mut |_| {}, &mut |_| None).await)
    }
}
