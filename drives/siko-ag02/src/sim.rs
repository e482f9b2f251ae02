//! The simulated AG02, as a [`Model`] of [`siko::sim`]: its dictionary, and what differs from SIKO's other drives.
//!
//! # What the manual leaves open
//!
//! Where both manuals are silent, it does as the simulated AG03/1 does. Besides:
//!
//! | Question | Here |
//! |---|---|
//! | which limit switch is at which end | 1 where positions are high |
//! | how a drive stops on a limit switch | with full deceleration; a positioning is over then |
//! | what the calibration switch does | makes the calibration value the position when it becomes active, unless a job is |
//! | SDO commands 2Fh, 2Bh, 27h, 22h and 21h (table 18 has 23h only) | 0601 0000h |
//! | 23h with a number that the object has no room for | 0601 0000h |
//! | the code of fault F in 1003h (table 20 has none) | 8120h, beside which it names the fault |
//! | 1001h after 8001h to 8004h | as after 8120h: bit 4, until the bus is said to be well, or a fault is reset |
//! | which EMCY bytes are high (table 20) | as CiA 301 has it |
//! | the default 50 of 2410h:05 and :09 with the gear 135:1, which allows 35 | 35 |
//! | TPDO3 and TPDO4 of type 254 | are sent when anything in them changes, and not by the event timer, nor when OPERATIONAL begins |
//! | parameter 25, which no object holds | 0: full deceleration |
//! | the base of accelerations in per cent | that of the AG03/1: 4 rev/s² |
//! | the version of the firmware | 2.00 |

use lexican_runtime::Duration;
use lexican_runtime::device::Behaviour;
use lexican_runtime::host::kept::KeptFormat;
use lexican_runtime::service::sdo_server::SizesIndicated;
use lexican_runtime::service::tpdo::Triggers;
pub use siko::sim::*;

use crate::driver::AG02;
use crate::fault::{CODES, FAULTS};
use crate::od;

/// The simulated AG02.
pub static MODEL: Model = Model {
    name: "AG02",
    eeprom: KeptFormat { name: "lexican siko/ag02 eeprom", version: 1 },
    storage: |node| Box::new(od::storage(node)),
    persistent: od::PERSISTENT,
    writable_in: od::WRITABLE_IN,
    ranges: od::RANGES,
    parameters: siko::description::PARAMETERS,
    // The first character in bits 31 to 24.
    constants: &[(od::MANUFACTURER_SOFTWARE_VERSION.address(), u32::from_be_bytes(*b"2.00") as u64)],
    gear: od::GearReduction::GEAR_55_1.0,
    behaviour: OWN_BEHAVIOUR,
    faults: FAULTS,
    notices: CODES.notices,
    // "Not for errors of communication" (10.2.9).
    reports_recovery: false,
    // Table 1, bit 13.
    overcurrent_for: Duration::from_secs(10),
    emergencies: AG02.emergencies,
    control_by_sdo: false,
    writes_four_bytes: true,
    addressing: Addressing::Object,
    enable_input: true,
    switches: true,
    keys: false,
    // Half a revolution (figure 3).
    loop_length: 800,
};

/// In what the AG02 deviates from CiA 301, or fills in what that leaves open.
const OWN_BEHAVIOUR: Behaviour = Behaviour {
    triggers_254: Triggers { start: false, change: true, timer: false, inhibit: false },
    // 1800h:02: 254 does what 255 does; "for TPDO3 and TPDO4 only" (10.2.5.4).
    tpdos_of_255: &[1],
    // "Not used" in all COB-IDs of PDOs.
    pdo_bit_31: false,
    // Reads are answered by 42h (table 18).
    sdo_sizes_indicated: SizesIndicated { expedited: [false; 4], longer: false },
    ..BEHAVIOUR
};
