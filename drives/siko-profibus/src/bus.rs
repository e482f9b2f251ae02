//! Simulated drives with the master of `profirust`, in virtual time (feature `master`).

use lexican_profibus::Slave;
use lexican_profibus::virtual_bus::{SlaveId, VirtualBus};
use profirust::dp::PeripheralOptions;

use crate::drive::ProfibusDrive;
use crate::model::{Model, PPO};

/// A bus with one drive.
#[must_use]
pub fn with(model: &'static Model, address: u8) -> (VirtualBus<ProfibusDrive>, SlaveId) {
    let mut bus = VirtualBus::new();
    let drive = attach(&mut bus, model, address);
    (bus, drive)
}

/// Attaches a drive.
pub fn attach(bus: &mut VirtualBus<ProfibusDrive>, model: &'static Model, address: u8) -> SlaveId {
    let slave = slave(bus, model, address);
    bus.attach(slave, options(model), (PPO.len(), PPO.len()))
}

/// Attaches a drive that the master is not told of.
pub fn attach_unknown(bus: &mut VirtualBus<ProfibusDrive>, model: &'static Model, address: u8) -> SlaveId {
    let slave = slave(bus, model, address);
    bus.attach_unknown(slave)
}

fn slave(bus: &VirtualBus<ProfibusDrive>, model: &'static Model, address: u8) -> Slave<ProfibusDrive> {
    let drive = ProfibusDrive::new(bus.now(), model, address);
    Slave::new(drive.address(), model.identity, bus.bit_rate(), drive)
}

/// The options of a drive for the master.
#[must_use]
pub fn options(model: &'static Model) -> PeripheralOptions<'static> {
    PeripheralOptions {
        ident_number: model.identity.ident,
        max_tsdr: 100,
        user_parameters: Some(&[]),
        config: Some(model.identity.configuration),
        ..PeripheralOptions::default()
    }
}

/// Sets the outputs of a drive other than the PKW.
pub fn set(bus: &mut VirtualBus<ProfibusDrive>, drive: SlaveId, control: u16, target: i32) {
    if let Some(peripheral) = bus.peripheral(drive) {
        PPO.set_word(peripheral.pi_q_mut(), 0, control);
        PPO.set_double_word(peripheral.pi_q_mut(), 1, target);
    }
}

/// The last status word, with the position in positioning mode, or the velocity in rev/min in velocity mode.
pub fn get(bus: &mut VirtualBus<ProfibusDrive>, drive: SlaveId) -> Option<(u16, i32)> {
    let inputs = bus.peripheral(drive)?.pi_i();
    Some((PPO.word(inputs, 0)?, PPO.double_word(inputs, 1)?))
}
