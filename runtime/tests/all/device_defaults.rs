//! Defaults that a device cannot serve: nobody writes them, so no abort code reports them.

use crate::common::testing::TestOd;
use crate::common::{self, FULL, Rig};
use lexican_runtime::AbortCode;
use lexican_runtime::device::{Behaviour, Device, ErrorControlRule, Misconfigured};

fn faults(changes: &str) -> Vec<String> {
    let behaviour = Behaviour { error_control: ErrorControlRule::Exclusive, ..Behaviour::CIA_301 };
    let mut rig = Rig::new(TestOd::new(FULL).with(changes), behaviour);
    rig.device.misconfigured(&mut rig.od).map(|fault| format!("{} {:08X}", fault.address, fault.reason.0)).collect()
}

#[track_caller]
fn check(changes: &str, expected: &[(&str, AbortCode)]) {
    let expected: Vec<String> = expected.iter().map(|(address, code)| format!("{address} {:08X}", code.0)).collect();
    assert_eq!(faults(changes), expected, "{changes}");
}

#[test]
fn a_dictionary_that_is_served_has_no_faults() {
    check("", &[]);
    check("1200:01 u32 ro - 0x605\n1800:01 u32 rw - 0x80000701\n1014:00 u32 rw - 0x80000000", &[]);
}

#[test]
fn a_pdo_that_the_device_has_no_room_for_is_reported() {
    let more = "1403:01 u32 rw - 0x206\n1603:00 u8 rw - 0\n1404:01 u32 rw - 0x207\n1604:00 u8 rw - 0";
    check(more, &[("1404:01", AbortCode::DEVICE_INCOMPATIBLE)]);
    check(&more.replace("0x207", "0x80000207"), &[]);
    let mut od = TestOd::new(FULL);
    let mut device: Device<0, 1, 1, 0> = Device::new(common::NODE, Behaviour::CIA_301);
    device.restart(lexican_runtime::Instant::ZERO, &mut od);
    let found: Vec<Misconfigured> = device.misconfigured(&mut od).collect();
    let addresses: Vec<String> = found.iter().map(|fault| fault.address.to_string()).collect();
    assert_eq!(addresses, ["1400:01", "1402:01", "1802:01"]);
    assert_eq!(found[0].to_string(), "1400:01: 0604 0047: general internal incompatibility in the device");
}

#[test]
fn an_impossible_mapping_is_reported_by_its_entry_or_its_length() {
    check("1600:01 u32 rw - 0x60640020", &[("1600:01", AbortCode::NOT_MAPPABLE)]);
    check("1600:01 u32 rw - 0x60400008", &[("1600:01", AbortCode::NOT_MAPPABLE)]);
    check("1A02:02 u32 rw - 0x2FFF0008", &[("1A02:02", AbortCode::NO_SUCH_OBJECT)]);
    check("1A02:02 u32 rw - 0x20000908", &[("1A02:02", AbortCode::NO_SUCH_SUB_INDEX)]);
    // 72 bits; more entries than there are; more than a PDO can have.
    check("1A02:01 u32 rw - 0x20000340\n1A02:02 u32 rw - 0x20000208", &[("1A02:00", AbortCode::PDO_LENGTH_EXCEEDED)]);
    check("1A02:00 u8 rw - 3", &[("1A02:00", AbortCode::PDO_LENGTH_EXCEEDED)]);
    check("1A02:00 u8 rw - 65", &[("1A02:00", AbortCode::PDO_LENGTH_EXCEEDED)]);
    // A PDO that is off is checked, too, because it may be switched on at any time.
    check("1800:01 u32 rw - 0x80000185\n1A00:01 u32 rw - 0x607A0020", &[("1A00:01", AbortCode::NOT_MAPPABLE)]);
}

#[test]
fn impossible_parameters_of_a_pdo_are_reported() {
    let invalid = AbortCode::INVALID_VALUE;
    check("1400:01 u32 rw - 0x605", &[("1400:01", invalid)]);
    check("1400:01 u32 rw - 0x1205", &[("1400:01", invalid)]);
    check("1400:02 u8 rw - 253", &[("1400:02", invalid)]);
    check("1800:02 u8 rw - 250\n1800:06 u8 rw - 241", &[("1800:02", invalid), ("1800:06", invalid)]);
    let taken = AbortCode::PARAMETER_INCOMPATIBLE;
    check("1800:01 u32 rw - 0x385", &[("1800:01", taken), ("1802:01", taken)]);
}

#[test]
fn other_impossible_parameters_are_reported() {
    let (invalid, taken) = (AbortCode::INVALID_VALUE, AbortCode::PARAMETER_INCOMPATIBLE);
    check("1005:00 u32 rw - 0x701", &[("1005:00", invalid)]);
    check("1005:00 u32 rw - 0x85", &[("1005:00", taken), ("1014:00", taken)]);
    check("1014:00 u32 rw - 0x601", &[("1014:00", invalid)]);
    check("1012:00 u32 rw - 0x80000581", &[("1012:00", invalid)]);
    check("1012:00 u32 rw - 0x40000100", &[("1012:00", invalid)]);
    check("1016:02 u32 rw - 0x00060064\n1016:03 u32 rw - 0x00060064", &[("1016:02", taken), ("1016:03", taken)]);
    check("1016:00 u8 ro - 4\n1016:04 u32 rw - 0x00060064", &[("1016:04", AbortCode::DEVICE_INCOMPATIBLE)]);
    check("1017:00 u16 rw - 1\n100C:00 u16 rw - 1\n100D:00 u8 rw - 1", &[("1017:00", taken)]);
    check("1019:00 u8 rw - 1\n1029:01 u8 rw - 3", &[("1019:00", invalid), ("1029:01", invalid)]);
}

#[test]
fn a_server_that_the_device_has_no_room_for_is_reported_and_refused() {
    let two = "1201:01 u32 rw - 0x6D0\n1201:02 u32 rw - 0x6D1\n1202:01 u32 rw - 0x6D2\n1202:02 u32 rw - 0x6D3";
    check(two, &[("1202:01", AbortCode::DEVICE_INCOMPATIBLE)]);
    check(&two.replace("0x6D2", "0x80000000"), &[]);
    check(
        &two.replace("0x6D0", "0x6D2"),
        &[("1201:01", AbortCode::PARAMETER_INCOMPATIBLE), ("1202:01", AbortCode::PARAMETER_INCOMPATIBLE)],
    );
    let mut rig = Rig::with(&two.replace("0x6D2", "0x80000000"));
    assert_eq!(rig.write(0x1202, 1, 4, 0x6D2), Err(AbortCode::DEVICE_INCOMPATIBLE.0));
    rig.write(0x1201, 1, 4, 0x8000_06D0).unwrap();
    assert_eq!(rig.write(0x1202, 1, 4, 0x6D2), Ok(()));
    assert_eq!(rig.send("6D2#4000100000000000"), ["6D3#4300100092010000"]);
}
