//! With any COB-IDs in the dictionary, by default or written by a client, the device obeys NMT,
//! answers its default SDO, and sends nothing under an identifier that is not its own (CiA 301, 7.3.5).

use crate::common::testing::TestOd;
use crate::common::{FULL, NODE, Rig};
use lexican_runtime::device::{Behaviour, ChangeRule};
use lexican_runtime::object::{Address, TimeOfDay};
use proptest::prelude::*;

/// Entries that hold a COB-ID.
const COB_IDS: [(u16, u8); 18] = [
    (0x1005, 0),
    (0x1012, 0),
    (0x1014, 0),
    (0x1028, 1),
    (0x1028, 2),
    (0x1200, 1),
    (0x1200, 2),
    (0x1201, 1),
    (0x1201, 2),
    (0x1202, 1),
    (0x1202, 2),
    (0x1280, 1),
    (0x1280, 2),
    (0x1400, 1),
    (0x1401, 1),
    (0x1402, 1),
    (0x1800, 1),
    (0x1802, 1),
];

/// The entries of these that FULL lacks.
const MORE: &str = "
    1028:00 u8  const - 2
    1028:01 u32 rw - 0x80000000
    1028:02 u32 rw - 0x80000000
    1202:00 u8  const - 3
    1202:01 u32 rw - 0x80000000
    1202:02 u32 rw - 0x80000000
    1202:03 u8  rw - 0
    1280:00 u8  const - 3
    1280:01 u32 rw - 0x80000000
    1280:02 u32 rw - 0x80000000
    1280:03 u8  rw - 0
";

/// Identifiers of the predefined connection set, of this node and of others; the first and the last of each restricted
/// range; and some that any service may use.
const IDS: [u32; 30] = [
    0x000, 0x005, 0x07F, 0x080, 0x085, 0x100, 0x101, 0x180, 0x181, 0x185, 0x205, 0x385, 0x580, 0x581, 0x585, 0x5FF,
    0x600, 0x601, 0x605, 0x645, 0x67F, 0x680, 0x6D0, 0x6E0, 0x6FF, 0x700, 0x701, 0x705, 0x780, 0x7FF,
];

/// Each identifier, some extended ones, and some with bits outside of an identifier; with all combinations of the upper
/// bits.
fn values() -> impl Iterator<Item = u32> + Clone {
    let others = [0x2000_0000, 0x2000_0605, 0x3FFF_FFFF, 0x0000_0800, 0x0001_0605, 0x1FFF_FFFF];
    let ids = IDS.into_iter().chain(others);
    [0, 1 << 30, 1 << 31, 3 << 30].into_iter().flat_map(move |upper| ids.clone().map(move |id| id | upper))
}

fn is_restricted(id: u32) -> bool {
    matches!(
        id,
        0x000..=0x07F | 0x101..=0x180 | 0x581..=0x5FF | 0x601..=0x67F | 0x6E0..=0x6FF | 0x701..=0x7FF
    )
}

fn rig(od: TestOd, changes: ChangeRule) -> Rig {
    Rig::new(od, Behaviour { changes, produces_time: true, ..Behaviour::CIA_301 })
}

/// A dictionary with other COB-IDs, as in a data sheet; `None` for a missing entry.
fn with(cob_ids: &[((u16, u8), Option<u32>)]) -> TestOd {
    let named = |&(index, sub): &(u16, u8)| format!("{index:04X}:{sub:02X} ");
    let others = [FULL, MORE].into_iter().flat_map(str::lines).map(str::trim);
    let others = others.filter(|line| !cob_ids.iter().any(|(at, _)| line.starts_with(&named(at))));
    let lines = cob_ids.iter().filter_map(|(at, value)| Some(format!("{}u32 rw - {}", named(at), (*value)?)));
    TestOd::new(&others.map(str::to_owned).chain(lines).collect::<Vec<_>>().join("\n"))
}

/// Checks what a manager relies on, while the device has many frames to send.
fn check(rig: &mut Rig, what: &dyn std::fmt::Debug) {
    let mut sent = Vec::new();
    for (command, answers) in [
        ("000#8105", None),
        ("000#0105", Some(["705#05", "705#85"])),
        ("000#0205", Some(["705#04", "705#84"])),
        ("000#8005", Some(["705#7F", "705#FF"])),
        ("000#0100", Some(["705#05", "705#85"])),
    ] {
        sent.extend(rig.send(command));
        if answers.is_none() {
            rig.restart();
            let boot = rig.sent();
            assert_eq!(boot.first().map(String::as_str), Some("705#00"), "{what:08X?}");
            // It is then guarded, and produces SYNC if 1005h says so.
            sent.extend(boot);
            let _ = rig.write(0x1017, 0, 2, 0);
            let _ = rig.write(0x1006, 0, 4, 5_000);
        }
        let guarded = rig.send("705#R1");
        if let Some(answers) = answers {
            assert!(guarded.iter().any(|it| answers.contains(&it.as_str())), "{what:08X?}: {command}, {guarded:?}");
        }
        sent.extend(guarded);
        let answer = rig.send("605#4000100000000000");
        let answered = answer.iter().any(|it| it == "585#4300100092010000");
        assert_eq!(answered, command != "000#0205", "{what:08X?}: {command}, {answer:?}");
        sent.extend(answer);
        // An error and its end, a change of an object, and time.
        sent.extend(rig.send("080#010203"));
        sent.extend(rig.send("080#"));
        rig.device.changed(Address::new(0x6041, 0));
        rig.device.send_time(TimeOfDay { days: 1, ms: 1 });
        sent.extend(rig.sent());
        sent.extend(rig.pass_ms(11).iter().map(|it| it.split_once(' ').unwrap().1.to_owned()));
    }
    for frame in sent {
        let id = frame.split_once('#').unwrap().0;
        let own = matches!(id, "585" | "705");
        let restricted = id.len() == 3 && is_restricted(u32::from_str_radix(id, 16).unwrap());
        assert!(own || !restricted, "{what:08X?}: {frame} is for others to send");
    }
}

#[test]
fn any_cob_id_of_a_data_sheet_leaves_nmt_and_the_default_server_alone() {
    for at in COB_IDS {
        for value in values().map(Some).chain([None]) {
            let mut rig = rig(with(&[(at, value)]), ChangeRule::WhileInvalid);
            check(&mut rig, &(at, value));
        }
    }
}

#[test]
fn all_cob_ids_of_a_data_sheet_may_be_the_same_or_missing() {
    for value in values().map(Some).chain([None]) {
        let mut rig = rig(with(&COB_IDS.map(|at| (at, value))), ChangeRule::WhileInvalid);
        check(&mut rig, &value);
    }
}

#[test]
fn any_cob_id_that_a_client_writes_is_refused_or_leaves_nmt_and_the_default_server_alone() {
    let writable = [((0x1200, 1), Some(0x605)), ((0x1200, 2), Some(0x585))];
    for changes in [ChangeRule::WhileInvalid, ChangeRule::InPreOperational] {
        let mut rig = rig(with(&writable), changes);
        for at in COB_IDS {
            for value in values() {
                let before = rig.od.get(at.0, at.1) as u32;
                let result = rig.write(at.0, at.1, 4, value);
                let after = rig.od.get(at.0, at.1) as u32;
                assert_eq!(after, if result.is_ok() { value } else { before }, "{at:04X?} {value:08X}");
                let exists = match at.0 {
                    0x1005 => true,
                    0x1012 => after >> 30 != 0,
                    _ => after >> 31 == 0,
                };
                let is_short = after >> 29 & 1 == 0;
                let is_bad = is_short && (is_restricted(after & 0x7FF) || after & 0x1FFF_F800 != 0);
                assert!(at.0 == 0x1200 || !(exists && is_bad), "{at:04X?} {value:08X} was taken");
                // A write that was refused changes nothing, so there is nothing new to check.
                if result.is_ok() {
                    check(&mut rig, &(changes, at, value));
                    rig.send("000#8005");
                    let _ = rig.write(0x1006, 0, 4, 0);
                }
            }
            rig = self::rig(with(&writable), changes);
        }
    }
}

fn any_cob_id() -> impl Strategy<Value = ((u16, u8), u32)> {
    (prop::sample::select(COB_IDS.to_vec()), prop::sample::select(values().collect::<Vec<u32>>()))
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

    #[test]
    fn any_data_sheet_and_any_writes_leave_nmt_and_the_default_server_alone(
        defaults in prop::collection::vec((any_cob_id(), prop::bool::weighted(0.1)), 0..8),
        writes in prop::collection::vec(any_cob_id(), 0..20),
    ) {
        let defaults: Vec<_> = defaults.iter().map(|&((at, id), missing)| (at, Some(id).filter(|_| !missing))).collect();
        let mut rig = rig(with(&defaults), ChangeRule::WhileInvalid);
        for ((index, sub), value) in &writes {
            let _ = rig.write(*index, *sub, 4, *value);
        }
        prop_assert_eq!(rig.device.node(), NODE);
        check(&mut rig, &(defaults, writes));
    }
}

/// Most data sheets of the corpus have this: a second SDO server without a default.
#[test]
fn a_server_without_identifiers_can_be_given_some() {
    let mut rig = rig(with(&[((0x1201, 1), Some(0)), ((0x1201, 2), Some(0))]), ChangeRule::WhileInvalid);
    assert_eq!(rig.send("000#0105").last().map(String::as_str), Some("185#3412"), "it starts");
    rig.write(0x1201, 1, 4, 0x6D0).unwrap();
    rig.write(0x1201, 2, 4, 0x6D1).unwrap();
    assert_eq!(rig.send("6D0#4000100000000000"), ["6D1#4300100092010000"]);
}

#[test]
fn pdos_and_messages_without_identifier_can_be_given_one() {
    let zero = [(0x1005, 0), (0x1014, 0), (0x1400, 1), (0x1800, 1)].map(|at| (at, Some(0)));
    let mut rig = rig(with(&zero), ChangeRule::WhileInvalid);
    assert_eq!(rig.send("000#"), [""; 0], "which is no SYNC");
    for (index, sub, id) in [(0x1005, 0, 0x81), (0x1014, 0, 0x85), (0x1400, 1, 0x205), (0x1800, 1, 0x185)] {
        assert_eq!(rig.write(index, sub, 4, id), Ok(()), "{index:04X}");
    }
    assert_eq!(rig.send("000#0105"), ["185#3412"]);
    assert_eq!(rig.send("205#01"), ["085#1082110000000000"]);
}
