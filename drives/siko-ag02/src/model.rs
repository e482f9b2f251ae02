//! The AG02 as a [`Model`]: its dictionary, and the differences from SIKO's other drives.

use lexican_runtime::Duration;
use lexican_runtime::device::Behaviour;
use lexican_runtime::host::kept::KeptFormat;
use lexican_runtime::service::sdo_server::SizesIndicated;
use lexican_runtime::service::tpdo::Triggers;
use siko::model::{Addressing, BEHAVIOUR, Model};

use crate::driver::AG02;
use crate::fault::{CODES, FAULTS};
use crate::od;

/// The AG02, for its gateway and its simulator.
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

/// Where the AG02 deviates from CiA 301, or decides what that leaves open.
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
