//! Devices whose LSS is wrong in one thing each, and the cases that notice. The device has node-ID 5, and the identity
//! 4C58h, 9, 20001h, 80000003h.

use crate::faulty::State::Stopped;
use crate::faulty::{Fault, every_ms, fault, heard, sent};

const IDENTIFIED: &str = "7E4#4F00000000000000";

pub const FAULTS: &[Fault] = &[
    // Switching states.
    fault("switch state global does not lead to LSS configuration", &[heard("7E5#0401*")], "305/6.3.2/1"),
    fault("switch state global does not lead to LSS waiting", &[heard("7E5#0400*")], "305/6.3.2/1 305/6.3.2/2"),
    fault("there is no LSS in STOPPED", &[heard("7E5#*").when(Stopped)], "305/6.3.2/2"),
    fault(
        "the device is not selected, and says it is",
        &[heard("7E5#43*").is_answered("7E4#4400000000000000")],
        "305/6.3.3/1 305/6.3.3/2 305/6.4.2/1 305/6.4.2/2 305/6.4.2/4 305/6.4.3/1 305/6.4.3/2 305/6.4.5/1 305/6.5.2/1 \
         305/6.5.3/1 305/6.6.4/2 305/6.7/1 305/6.7/2",
    ),
    fault("any vendor-ID selects", &[heard("7E5#40*").becomes("7E5#40584C0000000000")], "305/6.3.3/2"),
    fault("any product code selects", &[heard("7E5#41*").becomes("7E5#4109000000000000")], "305/6.3.3/2"),
    fault("any revision number selects", &[heard("7E5#42*").becomes("7E5#4201000200000000")], "305/6.3.3/2"),
    fault("any serial number selects", &[heard("7E5#43*").becomes("7E5#4303000080000000")], "305/6.3.3/2"),
    // Configuring.
    fault(
        "node-ID 127 is confirmed, and not taken",
        &[heard("7E5#117F*").is_answered("7E4#1100000000000000")],
        "305/6.4.2/1",
    ),
    fault(
        "the old node-ID stays beside the new one",
        &[heard("605#40*").is_answered("585#4300100000000000").after(&["7E5#117F*"])],
        "305/6.4.2/1",
    ),
    fault("node-ID 0 is taken", &[heard("7E5#1100*").is_answered("7E4#1100000000000000")], "305/6.4.2/2"),
    fault("a node-ID is refused with another error", &[sent("7E4#1101*").becomes("7E4#11FF*")], "305/6.4.2/2"),
    fault(
        "a node-ID is taken in LSS waiting",
        &[heard("7E5#1105*").is_answered("7E4#1100000000000000")],
        "305/6.4.2/3",
    ),
    fault(
        "the vendor-ID is reported in LSS waiting",
        &[heard("7E5#5A*").is_answered("7E4#5A584C0000000000")],
        "305/6.4.2/3",
    ),
    fault(
        "SDO is answered without node-ID",
        &[heard("605#40*").is_answered("585#4300100000000000").after(&["7E5#11FF*"])],
        "305/6.4.2/4",
    ),
    fault("there is a heartbeat without node-ID", &[every_ms(50, "705#7F").after(&["7E5#11FF*"])], "305/6.4.2/4"),
    fault("250 kbit/s is refused", &[heard("7E5#130003*").is_answered("7E4#1301000000000000")], "305/6.4.3/1"),
    fault("20 kbit/s is taken", &[heard("7E5#130007*").is_answered("7E4#1300000000000000")], "305/6.4.3/2"),
    fault("the table of bit rates is not looked at", &[heard("7E5#1301*").becomes("7E5#1300*")], "305/6.4.3/2"),
    fault("storing fails", &[sent("7E4#1700*").becomes("7E4#1702*")], "305/6.4.5/1"),
    fault(
        "the configuration is stored in LSS waiting",
        &[heard("7E5#17*").is_answered("7E4#1700000000000000").until("7E5#43*")],
        "305/6.4.5/2",
    ),
    // Inquiring and identifying.
    fault("LSS has another serial number", &[sent("7E4#5D*").becomes("7E4#5D04*")], "305/6.5.2/1"),
    fault(
        "the configured node-ID is reported as the active one",
        &[sent("7E4#5E05*").becomes("7E4#5E7F*").after(&["7E5#117F*"])],
        "305/6.5.3/1",
    ),
    fault("the widest range has no device", &[heard("7E5#4BFFFFFFFF*")], "305/6.6.2/1"),
    fault("any vendor-ID is in the range", &[heard("7E5#46*").becomes("7E5#46584C0000000000")], "305/6.6.2/2"),
    fault("any product code is in the range", &[heard("7E5#47*").becomes("7E5#4709000000000000")], "305/6.6.2/2"),
    fault("the lowest revision is not looked at", &[heard("7E5#48*").becomes("7E5#4800000000000000")], "305/6.6.2/2"),
    fault(
        "the lowest serial number is not looked at",
        &[heard("7E5#4A*").becomes("7E5#4A00000000000000")],
        "305/6.6.2/2",
    ),
    fault(
        "the highest serial number is not looked at",
        &[heard("7E5#4B*").becomes("7E5#4BFFFFFFFF000000")],
        "305/6.6.2/2",
    ),
    fault(
        "a device with node-ID says that it has none",
        &[heard("7E5#4C*").is_answered("7E4#5000000000000000").until("7E5#11FF*")],
        "305/6.6.4/1",
    ),
    fault("a device without node-ID does not say so", &[sent("7E4#50*")], "305/6.6.4/2"),
    // Fastscan.
    fault(
        "bit 14 of the vendor-ID is not looked at",
        &[heard("7E5#51000000000E0000").is_answered(IDENTIFIED)],
        "305/6.7/1",
    ),
    fault("a scan that has met does not select", &[heard("7E5#5103000080000300").is_answered(IDENTIFIED)], "305/6.7/1"),
    fault(
        "a part is answered out of its turn",
        &[heard("7E5#5109000000010101").is_answered(IDENTIFIED).until("7E5#51584C0000000001")],
        "305/6.7/2",
    ),
    fault(
        "a scan that has begun does not begin anew",
        &[heard("7E5#51........80*").is_answered(IDENTIFIED).after(&["7E5#51584C0000000001"])],
        "305/6.7/2",
    ),
    fault(
        "a device with node-ID takes part in fastscan",
        &[heard("7E5#51........80*").is_answered(IDENTIFIED).until("7E5#11FF*")],
        "305/6.7/3",
    ),
];
