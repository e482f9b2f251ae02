//! The PDOs that a driver can use.

use super::data::{Drive, Number, Outputs, Pdo, Signal};
use super::objects::Reader;
use crate::model::{self, Direction, Mapped, Value};
use lexican_cia::cia301;

/// Event-driven, manufacturer-specific or by device profile (CiA 301, 7.5.2.35): the drive does not wait for SYNC.
const EVENT_DRIVEN: [u8; 2] = [254, 255];

pub(super) fn pdos(reader: &mut Reader<'_>, drive: &Drive) -> (Outputs, Vec<Pdo>) {
    let (mut outputs, mut inputs) = (Outputs::default(), Vec::new());
    for pdo in &reader.device.pdos {
        let Some(base) = base(reader, pdo) else { continue };
        let Some(signals) = signals(reader, pdo, drive) else { continue };
        let carries =
            |wanted: &[Signal]| signals.len() == wanted.len() && wanted.iter().all(|signal| signals.contains(signal));
        let output = match pdo.direction {
            Direction::Transmit => None,
            _ if carries(&[Signal::ControlWord]) => Some(&mut outputs.control),
            _ if carries(&[Signal::ControlWord, Signal::TargetPosition]) => Some(&mut outputs.position),
            _ if carries(&[Signal::ControlWord, Signal::TargetVelocity]) => Some(&mut outputs.velocity),
            _ => None,
        };
        match output {
            Some(output) => _ = output.get_or_insert(Pdo { base, signals }),
            None if pdo.direction == Direction::Transmit && signals.contains(&Signal::StatusWord) => {
                inputs.push(Pdo { base, signals });
            }
            None => {}
        }
    }
    // A control word by SDO could overtake a target by PDO, or fall behind it.
    if outputs.control.is_none() {
        outputs = Outputs::default();
    }
    (outputs, inputs)
}

/// The COB-ID without node-ID, if the PDO is valid, event-driven and has its COB-ID of the predefined connection set.
fn base(reader: &Reader<'_>, pdo: &model::Pdo) -> Option<u16> {
    let predefined = pdo.direction.predefined_cob_id(pdo.number)?;
    let event_driven = pdo.transmission_type.is_some_and(|kind| EVENT_DRIVEN.contains(&kind));
    let in_place = match pdo.cob_id {
        None => reader.device.object(pdo.direction.communication_parameter(pdo.number)).is_some(),
        Some(Value::NodeIdPlus(word)) => u32::try_from(word).is_ok_and(|word| {
            word & (cia301::INVALID | cia301::EXTENDED) == 0 && word & cia301::IDENTIFIER == u32::from(predefined)
        }),
        Some(_) => false,
    };
    (event_driven && in_place).then_some(predefined)
}

/// The signals of a PDO; `None`, and a finding, if a driver cannot decode it.
fn signals(reader: &mut Reader<'_>, pdo: &model::Pdo, drive: &Drive) -> Option<Vec<Signal>> {
    let mut signals = Vec::new();
    let (mut bit, mut others) = (0_u16, 0_u16);
    for mapped in &pdo.mapping {
        let Some((signal, number)) = signal(*mapped, drive) else {
            (bit, others) = (bit + u16::from(mapped.bits), others + u16::from(mapped.bits));
            continue;
        };
        if bit % 8 != 0 || mapped.bits != number.size() * 8 {
            let index = pdo.direction.mapping_parameter(pdo.number);
            let (bits, size) = (mapped.bits, number.size() * 8);
            let message =
                format!("{index:04X}h maps {bits} bits of {:04X}h from bit {bit} on, which has {size}", mapped.index);
            let help = "the driver does not use this PDO; if the drive maps it otherwise, correct the data sheet";
            reader.report("drive::pdo", message, reader.nearest(index), help);
            return None;
        }
        signals.extend(other(others));
        signals.push(signal);
        (bit, others) = (bit + u16::from(mapped.bits), 0);
    }
    signals.extend(other(others));
    (bit <= 64).then_some(signals)
}

fn other(bits: u16) -> Option<Signal> {
    u8::try_from(bits.div_ceil(8)).ok().filter(|&bytes| bytes > 0).map(Signal::Other)
}

fn signal(mapped: Mapped, drive: &Drive) -> Option<(Signal, Number)> {
    let known = [
        (Signal::ControlWord, Some(drive.control_word)),
        (Signal::StatusWord, Some(drive.status_word)),
        (Signal::TargetPosition, drive.target_position),
        (Signal::TargetVelocity, drive.target_velocity),
    ];
    let of = |number: Number| (number.index, number.sub) == (mapped.index, mapped.sub);
    known.into_iter().find_map(|(signal, number)| Some((signal, number.filter(|number| of(*number))?)))
}
