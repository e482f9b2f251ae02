//! The simulated AKD, for the comparisons of any servo.

use kollmorgen_akd::fault;
use kollmorgen_akd::sim::MODEL;
use lexican_runtime::NodeId;
use simulator::servo::ServoModel;

use crate::rig::Rig;
use crate::servo::{OfModel, Servo};

/// The velocity of homing.
pub(super) const SPEED: &str = "equivalent 60 rpm";

/// The drive.
pub(super) enum Akd {}

pub(super) type Simulated = Servo<Akd>;

impl OfModel for Akd {
    const NODE: NodeId = NodeId::literal(3);
    // F439.
    const FAULT: u16 = 0x8611;

    fn model() -> &'static ServoModel {
        &MODEL
    }

    fn code(label: &str) -> Option<u16> {
        fault::find(label).map(|code| code.number)
    }

    fn has_default_in_words(rig: &mut Rig<Simulated>, words: &str) -> bool {
        let [fast, slow] = [1, 2].map(|sub| rig.read(0x6099, sub).unwrap_or(0));
        match words {
            SPEED => fast == 1000,
            "1/8 * Object 6099 sub 1" => slow == fast / 8,
            _ => false,
        }
    }
}
