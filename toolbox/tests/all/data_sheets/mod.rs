//! Drives known only by their data sheets: what the driver uses instead of missing objects, and how it reports that.

mod corpus;
mod rig;
mod values;

use lexican_driver::{Error, Missing, Protection};
use lexican_eds::{Input, Source};
use lexican_runtime::host::Link as _;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, Duration, Frame, NodeId};
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::drive::{Ending, Fact, Order, Verdict, explain_drive, explain_profile, explain_sheet};
use rig::Rig;

use crate::rows::eds;

const NODE: NodeId = NodeId::literal(5);
const STEP: Order = Order::Step(Some(500));

/// A drive with little more than the necessary: the address, the data type, the access, the default, the highest value.
const DRIVE: &str = "
1000    7 ro 0x20192
1014    7 rw $NODEID+0x80
1016:01 7 rw 0
1018:01 7 ro 0x2A
6040    6 rw 0
6041    6 ro
6060    2 rw 0
6061    2 ro
6064    4 ro
6067    7 rw 10
606C    4 ro
607A    4 rw
6081    7 rw 1000
6083    7 rw 10000
6084    7 rw 10000
6502    7 ro 0x01
";

/// The data sheet with some lines replaced (by address), added, or removed (an address alone).
fn sheet(changes: &str) -> DataSheet {
    let address = |line: &str| line.split_whitespace().next().unwrap_or_default().to_owned();
    let changed: Vec<String> = changes.lines().map(address).collect();
    let kept = DRIVE.lines().filter(|line| !changed.contains(&address(line)));
    let rows = kept.chain(changes.lines().filter(|line| line.split_whitespace().count() > 1));
    let eds = eds("ProductName=Servo\nVendorNumber=0x2A\n", rows.map(str::to_owned));
    DataSheet::parse(Input::new(Source::new("drive.eds", eds)))
}

fn rig(changes: &str) -> Rig {
    Rig::new(sheet(changes), NODE).unwrap()
}

/// The facts about a data sheet whose verdict is not ready.
fn said(changes: &str) -> Vec<Fact> {
    let sheet = sheet(changes);
    let facts = explain_sheet(&sheet.input, &sheet.device).1.into_iter();
    facts.filter(|fact| fact.verdict != Verdict::Ready).collect()
}

#[test]
fn what_is_missing_is_replaced_and_said() {
    let cases: [(&str, &[&str]); 8] = [
        ("", &[]),
        ("1018:01 7 ro 0", &["`VendorNumber` is 0x2A, and 1018h:01 has the vendor-ID 0"]),
        ("1018:01", &["`VendorNumber` is 0x2A, and there is no 1018h:01"]),
        ("1000 7 ro 0x191", &["1000h has device profile 401, not 402"]),
        ("606C", &["there is no 606Ch (actual velocity) that a driver can use"]),
        (
            "606C 8 ro",
            &[
                "606C (actual velocity) is REAL32, and INTEGER32 by CiA 402",
                "there is no 606Ch (actual velocity) that a driver can use",
            ],
        ),
        ("1014 7 rw 0x1A0", &[]),
        ("1016:01 7 rw 0 65535", &["1016:01 (consumer heartbeat) has a limit of 16 bits: no node-ID fits"]),
    ];
    for (changes, expected) in cases {
        let facts = said(changes);
        let texts: Vec<&str> = facts.iter().map(|fact| fact.text.as_str()).collect();
        assert_eq!(texts, expected, "{changes}");
        assert!(facts.iter().all(|fact| fact.verdict == Verdict::Instead && fact.remedy.is_some()), "{facts:?}");
        let mut rig = rig(changes);
        rig.protect().unwrap();
        assert_eq!(rig.carry_out(STEP, None).unwrap(), Ending::Reached, "{changes}");
        assert!((490..=510).contains(&rig.drive.position().unwrap()), "{changes}");
        assert_eq!(rig.drive.velocity().unwrap(), 0);
    }
    assert_eq!(said("6040\n6064 8 ro").iter().filter(|fact| fact.verdict == Verdict::Missing).count(), 2);
}

#[test]
fn a_data_sheet_that_contradicts_itself_fits_no_other_vendor() {
    for (named, simulated, fits) in [
        ("1018:01 7 ro 0", "", true),
        ("1018:01 7 ro 0", "1018:01 7 ro 0x2B", false),
        ("1018:01", "1018:01 7 ro 0x2B", false),
        ("", "1018:01 7 ro 0", false),
        ("", "1018:01", false),
    ] {
        match Rig::of(sheet(simulated), sheet(named), NODE, "") {
            Ok(mut rig) => {
                assert!(fits, "{named} {simulated}");
                let facts = rig.drive.run(async |drive| explain_drive(&drive).await).unwrap();
                assert!(facts.iter().any(|fact| fact.text.ends_with("the vendor-ID of the node is 2Ah")), "{facts:?}");
            }
            Err(Error::NotThisDrive { .. }) => assert!(!fits, "{named} {simulated}"),
            Err(error) => panic!("{error}"),
        }
    }
}

#[test]
fn a_drive_without_velocity_is_seen_to_stand_and_not_before() {
    let mut rig = rig("606C");
    rig.carry_out(Order::Enable, None).unwrap();
    rig.drive.set_mode(lexican_driver::Mode::Positioning).unwrap();
    rig.drive.start_moving_to(5000).unwrap();
    rig.drive.pass(Duration::from_secs(2)).unwrap();
    let velocity = rig.drive.velocity().unwrap();
    assert!((900..=1100).contains(&velocity), "{velocity} counts per second");
    rig.drive.stop().unwrap();
    let at = rig.drive.position().unwrap();
    assert!((1000..4000).contains(&at), "{at}");
    rig.drive.pass(Duration::from_secs(2)).unwrap();
    assert_eq!(rig.drive.position().unwrap(), at, "it stood when the stop was confirmed");
}

#[test]
fn a_blocked_drive_without_velocity_reaches_nothing() {
    let simulated = sheet("606C");
    let mut rig = Rig::of(simulated.clone(), simulated, NODE, "[[step]]\nblocked = true\n").unwrap();
    let ending = rig.carry_out(STEP, None).unwrap();
    assert!(matches!(ending, Ending::Stalled | Ending::Fault(_)), "{ending:?}");
}

#[test]
fn emergencies_are_heard_where_the_drive_sends_them() {
    let sheet = sheet("1014 7 rw 0x1A0");
    let mut rig = Rig::of(sheet.clone(), sheet, NODE, "[[step]]\nafter_ms = 100\nfault = 0x7121\n").unwrap();
    let facts = rig.drive.run(async |drive| explain_drive(&drive).await).unwrap();
    assert!(facts.iter().any(|fact| fact.text == "1014:00 has emergencies on 1A0h, not on 085h"), "{facts:?}");
    let error = rig.carry_out(STEP, None).and_then(|_| rig.carry_out(STEP, None)).map(|ending| ending.to_string());
    // There is no 1003h from which the code could have been read.
    assert!(error.as_ref().map_or_else(ToString::to_string, Clone::clone).contains("7121"), "{error:?}");
}

#[test]
fn a_heartbeat_of_the_drive_is_not_taken_for_an_emergency() {
    // 705h is the drive's own heartbeat, so no emergency can have that identifier.
    let mut rig = rig("1014 7 rw 0x705");
    rig.bus.link().send(&Frame::from_array(CobId::of_node(0x700, NODE), [NmtState::Operational.code()])).unwrap();
    assert_eq!(rig.carry_out(STEP, None).unwrap(), Ending::Reached);
}

#[test]
fn a_consumer_that_takes_no_node_id_is_left_for_another_way() {
    let protected = |changes: &str| rig(changes).protect().unwrap();
    let narrow = "1016:01 7 rw 0 65535";
    assert_eq!(protected(narrow), Protection::None);
    assert!(matches!(protected(""), Protection::Heartbeat { entry: 1, .. }));
    let other = format!("{narrow}\n1016:02 7 rw 0");
    assert!(matches!(protected(&other), Protection::Heartbeat { entry: 2, .. }));
    let guarded = format!("{narrow}\n100C 6 rw 0\n100D 5 rw 0");
    assert!(matches!(protected(&guarded), Protection::LifeGuarding { .. }));
    let narrow_too = format!("{narrow}\n100C 6 rw 0\n100D 5 rw 0 1");
    assert_eq!(protected(&narrow_too), Protection::None);
    let remedy = |changes: &str| said(changes).pop().and_then(|fact| fact.remedy).unwrap_or_default();
    assert!(remedy(narrow).contains("does not notice"), "{}", remedy(narrow));
    assert!(remedy(&guarded).contains("uses life guarding"), "{}", remedy(&guarded));
}

#[test]
fn a_profile_velocity_of_0_is_refused_with_what_to_set_and_that_helps() {
    let mut rig = rig("6081 7 rw 0");
    let Err(Error::Refused(refusal)) = rig.carry_out(STEP, None) else { panic!("it would stand") };
    assert_eq!(refusal.0, [Missing::ProfileVelocity(lexican_runtime::object::Address::new(0x6081, 0))]);
    let remedy = refusal.first().unwrap().remedy().text;
    assert!(remedy.contains("--velocity"), "{remedy}");
    assert_eq!(rig.drive.position().unwrap(), 0);
    assert_eq!(rig.carry_out(STEP, Some(1000)).unwrap(), Ending::Reached);
}

#[test]
fn a_drive_without_position_runs() {
    let mut rig = rig("6064\n60FF 4 rw\n6502 7 ro 0x05");
    assert_eq!(rig.carry_out(Order::Run(100), None).unwrap(), Ending::Reached);
    assert_eq!(rig.drive.velocity().unwrap(), 0);
}

#[test]
fn a_velocity_or_ramp_that_may_be_too_small_is_named() {
    let mut rig = rig("6081 7 rw 1\n6083 7 rw 0 500\n6084");
    let facts = rig.drive.run(async |drive| explain_profile(&drive).await).unwrap();
    let texts: Vec<&str> = facts.iter().map(|fact| fact.text.as_str()).collect();
    assert!(texts[0].starts_with("6081:00 (profile velocity) is 1"), "{texts:?}");
    assert!(texts[1].starts_with("6083:00 (profile acceleration) is 0"), "{texts:?}");
    assert!(facts[1].remedy.as_ref().unwrap().contains("`--acceleration 100`"), "{facts:?}");
    assert!(facts.iter().all(|fact| fact.verdict == Verdict::Set) && facts.len() == 2);
}
