//! What PDOs carry, and which of them the driver uses.

pub use lexican_runtime::profile::cia402::Signal;
use lexican_runtime::{CobId, NodeId};

/// How orders get to the drive.
#[derive(Clone, Copy, Debug)]
pub struct Outputs {
    /// The PDO with the control word; `None` if it is written by SDO.
    pub control: Option<Pdo>,
    /// The PDO with the target position; `None` if it is written by SDO. If the control word is not in this PDO, it is
    /// sent after it in its own way.
    pub position: Option<Pdo>,
    /// The PDO with the target velocity, by the same rules.
    pub velocity: Option<Pdo>,
}

/// A PDO that the driver sends or hears.
#[derive(Clone, Copy, Debug)]
pub struct Pdo {
    /// The COB-ID without the node-ID, as in the predefined connection set (CiA 301, 7.3.5): 200h, 300h, 400h or 500h
    /// of a receive PDO, 180h, 280h, 380h or 480h of a transmit PDO.
    pub base: u16,
    /// What it carries, from the first byte on; at most eight bytes.
    pub signals: &'static [Signal],
}

impl Outputs {
    /// The receive PDOs of CiA 402-3 for the driver's modes: control word, with target position, with target velocity.
    pub const CIA_402: Outputs = Outputs {
        control: Some(Pdo { base: 0x200, signals: &[Signal::ControlWord] }),
        position: Some(Pdo { base: 0x400, signals: &[Signal::ControlWord, Signal::TargetPosition] }),
        velocity: Some(Pdo { base: 0x500, signals: &[Signal::ControlWord, Signal::TargetVelocity] }),
    };

    /// Nothing by PDO.
    pub const BY_SDO: Outputs = Outputs { control: None, position: None, velocity: None };

    /// The PDO that carries both a target position and the control word that starts the travel, so that both can wait
    /// for SYNC.
    #[must_use]
    pub fn start_by_sync(&self) -> Option<Pdo> {
        self.position.filter(|pdo| pdo.carries(Signal::ControlWord))
    }

    /// Whether any order is sent by PDO.
    #[must_use]
    pub const fn any(&self) -> bool {
        self.control.is_some() || self.position.is_some() || self.velocity.is_some()
    }
}

impl Pdo {
    /// The transmit PDOs of CiA 402-3: status word, with mode, with position, with velocity.
    pub const CIA_402_INPUTS: &'static [Pdo] = &[
        Pdo { base: 0x180, signals: &[Signal::StatusWord] },
        Pdo { base: 0x280, signals: &[Signal::StatusWord, Signal::Other(1)] },
        Pdo { base: 0x380, signals: &[Signal::StatusWord, Signal::Other(4)] },
        Pdo { base: 0x480, signals: &[Signal::StatusWord, Signal::Other(4)] },
    ];

    /// Whether the signal is in it.
    #[must_use]
    pub fn carries(&self, signal: Signal) -> bool {
        self.signals.contains(&signal)
    }

    pub(crate) fn cob_id(&self, node: NodeId) -> CobId {
        CobId::of_node(self.base, node)
    }
}
