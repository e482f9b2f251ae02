//! The AG03/1 as a [`Model`]: its dictionary, and the differences from SIKO's other drives.

use lexican_runtime::Duration;
use lexican_runtime::device::Behaviour;
use lexican_runtime::host::kept::KeptFormat;
use lexican_runtime::service::sdo_server::SizesIndicated;
use lexican_runtime::service::tpdo::Triggers;
use siko::model::{Addressing, BEHAVIOUR, Model};

use crate::fault::{CODES, FAULTS};
use crate::od;
use crate::parameter::PARAMETERS;

/// The AG03/1, for its gateway and its simulator.
pub static MODEL: Model = Model {
    name: "AG03/1",
    eeprom: KeptFormat { name: "lexican siko/ag03-1 eeprom", version: 1 },
    storage: |node| Box::new(od::storage(node)),
    persistent: od::PERSISTENT,
    writable_in: od::WRITABLE_IN,
    ranges: od::RANGES,
    parameters: PARAMETERS,
    constants: &[
        (od::MANUFACTURER_DEVICE_NAME.address(), u32::from_le_bytes(*b"AG03") as u64),
        (od::MANUFACTURER_SOFTWARE_VERSION.address(), u32::from_le_bytes(*b"4.01") as u64),
    ],
    // 24:1, up to 200 rev/min; 48:1 goes up to 100 rev/min.
    gear: od::GearReduction::GEAR_24_1.0,
    behaviour: OWN_BEHAVIOUR,
    faults: FAULTS,
    notices: CODES.notices,
    // 7.2.9.
    reports_recovery: true,
    // Table 2.
    overcurrent_for: Duration::from_secs(4),
    emergencies: None,
    control_by_sdo: true,
    writes_four_bytes: false,
    addressing: Addressing::Switches,
    enable_input: false,
    switches: false,
    keys: true,
    // 2418h holds it.
    loop_length: 0,
};

/// Where the AG03/1 deviates from CiA 301, or decides what that leaves open.
const OWN_BEHAVIOUR: Behaviour = Behaviour {
    // On change and by event timer (1800h:02); "sent with transition to OPERATIONAL" (7.2.2.4). The inhibit time is for
    // this type alone.
    triggers_254: Triggers { start: true, change: true, timer: true, inhibit: true },
    // Table 18 has 4Fh, 4Bh and 43h; the worked example of 7.2.8.1 answers four bytes with 42h.
    sdo_sizes_indicated: SizesIndicated { expedited: [true, true, true, false], longer: true },
    ..BEHAVIOUR
};
