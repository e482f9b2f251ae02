//! The differences between the drives on PROFIBUS.

use lexican_driver::description::Description;
use lexican_profibus::Identity;
use lexican_profibus::profidrive::Ppo;
use lexican_runtime::NodeId;

use crate::table::{self, Row};

/// SIKO's own PPO type: PKW, and three words of process data (figure 8).
pub const PPO: Ppo = Ppo { parameters: true, process_words: 3 };

/// A drive on PROFIBUS.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Model {
    pub name: &'static str,
    /// For the driver.
    pub description: &'static Description,
    /// The simulated drive behind the slave.
    pub drive: &'static siko::model::Model,
    pub identity: Identity,
    pub table: &'static [Row],
    /// The version of the firmware, in BCD (PNU 965).
    pub version: u16,
    /// The constant value of bit 14 of the status word in velocity mode, in which the manuals differ.
    pub velocity_bit_14: bool,
}

/// The identity of both drives. The ident number is that in the name of the vendor's GSD file. The configuration bytes
/// are an assumption, since the file was not available: four words and three words, each consistent and in both
/// directions. So is the support of sync and freeze, for which the diagnosis has bits.
const fn identity(ident: u16) -> Identity {
    let len = PPO.len() as u8;
    Identity { ident, configuration: &[0xF3, 0xF2], inputs: len, outputs: len, sync: true, freeze: true }
}

/// The AG03/1, firmware 1.00 or higher.
pub static AG03_1: Model = Model {
    name: "AG03/1",
    description: &siko_ag03_1::driver::AG03_1,
    drive: &siko_ag03_1::model::MODEL,
    identity: identity(0x0AC5),
    table: table::AG03_1,
    version: 0x0100,
    velocity_bit_14: true,
};

/// The AG02, firmware 2.00 or higher.
pub static AG02: Model = Model {
    name: "AG02",
    description: &siko_ag02::driver::AG02,
    drive: &siko_ag02::model::MODEL,
    identity: identity(0x08C9),
    table: table::AG02,
    version: 0x0200,
    velocity_bit_14: false,
};

impl Model {
    /// The address of a drive whose switches, or whose parameter 22, are set to `set`: at most 126.
    #[must_use]
    pub fn address(set: u8) -> u8 {
        set.min(126)
    }
}

/// The node-ID of the drive's CAN side, which is not connected.
pub(crate) const NODE: NodeId = NodeId::literal(1);
