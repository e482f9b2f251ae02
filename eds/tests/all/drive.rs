//! Reading the data sheets of drives: [`lexican_eds::drive`].

use lexican_eds::drive::{self, Drive, FINDINGS, Homing, Number, Outputs, Pdo, Signal};
use lexican_eds::types::DataType;
use lexican_eds::{Input, Source, load};

/// A servo with everything that a driver can use. Each line has the address, the data type, the access, the default,
/// the limits.
const SERVO: &str = "
1000    7 ro 0x20192
1008    9 const Servo 7
1010:01 7 rw
1011:01 7 rw
1014    7 rw $NODEID+0x80
1018:01 7 ro 0x2A
1003:01 7 ro
1400:01 7 rw $NODEID+0x200
1400:02 5 rw 255
1401:01 7 rw $NODEID+0x300
1401:02 5 rw 255
1402:01 7 rw $NODEID+0x400
1402:02 5 rw 254
1403:01 7 rw $NODEID+0x80000500
1403:02 5 rw 255
1600:00 5 rw 1
1600:01 7 rw 0x60400010
1601:00 5 rw 2
1601:01 7 rw 0x60400010
1601:02 7 rw 0x60600008
1602:00 5 rw 2
1602:01 7 rw 0x607A0020
1602:02 7 rw 0x60400010
1603:00 5 rw 2
1603:01 7 rw 0x60400010
1603:02 7 rw 0x60FF0020
1800:01 7 rw $NODEID+0x180
1800:02 5 rw 255
1801:01 7 rw $NODEID+0x280
1801:02 5 rw 1
1A00:00 5 rw 3
1A00:01 7 rw 0x60640020
1A00:02 7 rw 0x60410010
1A00:03 7 rw 0x60610008
1A01:00 5 rw 1
1A01:01 7 rw 0x60410010
6040    6 rww
6041    6 ro
605A    3 rw
605D    3 rw
6060    2 rww
6061    2 ro
6064    4 ro
6067    7 rw
606C    4 ro
607A    4 rww 0 -100000 100000
607C    4 rw
607D:01 4 rw
607D:02 4 rw
6081    7 rw
6083    7 rw
6098    2 rw
60B8    6 rw
60B9    6 ro
60BA    4 ro
60E3:01 6 ro 17
60E3:02 6 ro 37
60FF    4 rww 0 0 0
6071    3 rww
6077    3 ro
6502    7 ro 0x2D
";

const OVERLAY: &str = "
[overlay]
format = 1
[object.\"1003:01\"]
enumeration = \"EmergencyCode\"
[object.\"606C\"]
quantity = \"Velocity\"
[enumeration.EmergencyCode]
values = [{ value = 0, name = \"no error\" }, { value = 0x2310, name = \"motor too hot\" }]
[quantity.Velocity]
units = [{ symbol = \"rev/min\", method = \"rpm\", scale = \"0.001\" }]
";

fn number(index: u16, sub: u8, data_type: DataType) -> Number {
    Number { index, sub, data_type, limits: None }
}

/// The data sheet with some lines replaced (by address), added, or removed (an address alone).
fn sheet(changes: &str, overlay: &str) -> Input {
    let address = |line: &str| line.split_whitespace().next().unwrap_or_default().to_owned();
    let changed: Vec<String> = changes.lines().map(address).collect();
    let kept = SERVO.lines().filter(|line| !changed.contains(&address(line)));
    let added = changes.lines().filter(|line| line.split_whitespace().count() > 1);
    let mut lines: Vec<&str> = kept.chain(added).filter(|line| !line.trim().is_empty()).collect();
    lines.sort_unstable();
    let mut eds = "[FileInfo]\nFileName=servo.eds\n[DeviceInfo]\nProductName=Servo\n".to_owned();
    let mut indices: Vec<&str> = Vec::new();
    for line in lines {
        let mut words = line.split_whitespace();
        let (index, sub) = match address(line).split_once(':') {
            Some((_, sub)) => (&line[..4], Some(sub.to_owned())),
            None => (&line[..4], None),
        };
        if !indices.contains(&index) {
            indices.push(index);
            if let Some(sub) = &sub {
                eds += &format!("[{index}]\nParameterName=Object\nObjectType=9\n");
                if sub != "00" {
                    eds += &format!("[{index}sub0]\nParameterName=Count\nDataType=5\nAccessType=ro\nDefaultValue=2\n");
                }
            }
        }
        let section = sub.map_or(index.to_owned(), |sub| {
            format!("{index}sub{}", sub.trim_start_matches('0').to_owned() + if sub == "00" { "0" } else { "" })
        });
        eds += &format!("[{section}]\nParameterName=Value\n");
        words.next();
        for key in ["DataType", "AccessType"] {
            eds += &format!("{key}={}\n", words.next().expect("a data type and an access"));
        }
        let rest: Vec<&str> = words.collect();
        match rest.as_slice() {
            [] => {}
            [default, low, high] => eds += &format!("DefaultValue={default}\nLowLimit={low}\nHighLimit={high}\n"),
            default => eds += &format!("DefaultValue={}\n", default.join(" ")),
        }
    }
    eds += &format!("[OptionalObjects]\nSupportedObjects={}\n", indices.len());
    for (index, number) in indices.iter().zip(1..) {
        eds += &format!("{number}=0x{index}\n");
    }
    let input = Input::new(Source::new("servo.eds", eds));
    if overlay.is_empty() { input } else { input.overlay(Source::new("servo.toml", overlay)) }
}

/// The drive of a changed data sheet without findings.
#[track_caller]
fn read(changes: &str) -> Drive {
    let input = sheet(changes, "");
    let (drive, findings) = drive::read(&load(&input).0);
    assert!(findings.is_empty(), "{}", findings.render(&input));
    drive.expect("there are no errors")
}

#[test]
fn a_servo_is_read_whole() {
    let input = sheet("", OVERLAY);
    let (device, found) = load(&input);
    assert!(!found.has_errors(), "{}", found.render(&input));
    let (drive, findings) = drive::read(&device);
    assert!(findings.is_empty(), "{}", findings.render(&input));
    use DataType::{Integer8, Integer16, Integer32, Unsigned16, Unsigned32};
    let expected = Drive {
        name: "Servo".into(),
        identity: drive::Identity { vendor_ids: vec![0x2A], profile: 402, name: Some("Servo 7".into()) },
        always_four_bytes: false,
        control_word: number(0x6040, 0, Unsigned16),
        status_word: number(0x6041, 0, Unsigned16),
        mode: number(0x6060, 0, Integer8),
        mode_display: Some(number(0x6061, 0, Integer8)),
        actual_position: Some(number(0x6064, 0, Integer32)),
        actual_velocity: Some(number(0x606C, 0, Integer32)),
        profile: Some(drive::Profile {
            velocity: number(0x6081, 0, Unsigned32),
            acceleration: Some(number(0x6083, 0, Unsigned32)),
            deceleration: None,
        }),
        target_position: Some(Number { limits: Some((-100_000, 100_000)), ..number(0x607A, 0, Integer32) }),
        // Two equal limits do not limit anything.
        target_velocity: Some(number(0x60FF, 0, Integer32)),
        torque: Some(drive::Torque { target: number(0x6071, 0, Integer16), actual: number(0x6077, 0, Integer16) }),
        interpolated_position: None,
        position_window: Some(number(0x6067, 0, Unsigned32)),
        position_limits: Some([number(0x607D, 1, Integer32), number(0x607D, 2, Integer32)]),
        latest_fault: Some(number(0x1003, 1, Unsigned32)),
        modes: vec![1, 3, 4, 6],
        homing: Some(Homing {
            method: number(0x6098, 0, Integer8),
            offset: number(0x607C, 0, Integer32),
            methods: vec![17, 37],
        }),
        option_codes: vec![number(0x605A, 0, Integer16), number(0x605D, 0, Integer16)],
        latched: vec![number(0x60BA, 0, Integer32)],
        outputs: Outputs {
            control: Some(Pdo { base: 0x200, signals: vec![Signal::ControlWord] }),
            position: Some(Pdo { base: 0x400, signals: vec![Signal::TargetPosition, Signal::ControlWord] }),
            // This PDO is switched off.
            velocity: None,
        },
        // The other PDO waits for SYNC.
        inputs: vec![Pdo { base: 0x180, signals: vec![Signal::Other(4), Signal::StatusWord, Signal::Other(1)] }],
        store: Some(number(0x1010, 1, Unsigned32)),
        restore: Some(number(0x1011, 1, Unsigned32)),
        emergencies: Some(number(0x1014, 0, Unsigned32)),
        velocity_unit: Some("1/1000 rev/min".into()),
        codes: vec![drive::Code { number: 0x2310, text: "motor too hot".into() }],
    };
    assert_eq!(drive, Some(expected));
}

#[test]
fn modes_are_those_that_the_data_sheet_states_and_has_objects_for() {
    assert_eq!(read("6502 7 ro 0x1").modes, [1]);
    // Nothing states the modes: all modes whose objects exist.
    assert_eq!(read("6502").modes, [1, 3, 4, 6, 8, 9, 10]);
    assert_eq!(read("6502 7 ro 0").modes, [1, 3, 4, 6, 8, 9, 10]);
    assert_eq!(read("6502\n6060 2 rw 1 -3 6").modes, [1, 3, 4, 6]);
    assert_eq!(read("6502\n6060 2 rw 0 -128 127").modes, [1, 3, 4, 6, 8, 9, 10]);
    assert_eq!(read("6502\n607A\n6064").modes, [3, 4, 6, 9, 10]);
    let input = sheet(
        "6502",
        "[overlay]\nformat = 1\n[object.\"6060\"]\nenumeration = \"Modes\"\n[enumeration.Modes]\nvalues = [{ value = 3, name = \"velocity\" }, { value = -1, name = \"own\" }]\n",
    );
    assert_eq!(drive::read(&load(&input).0).0.expect("a drive").modes, [3]);
}

#[test]
fn homing_on_the_spot_is_method_35_or_37() {
    let on_the_spot = |changes: &str| read(changes).homing.expect("homing").on_the_spot();
    assert_eq!(on_the_spot(""), Some(37));
    assert_eq!(on_the_spot("60E3:01 6 ro 35"), Some(35));
    assert_eq!(on_the_spot("60E3:02 6 ro 1"), None);
    assert_eq!(on_the_spot("60E3:01\n60E3:02"), Some(35), "nothing says which methods there are");
    assert_eq!(on_the_spot("60E3:01\n60E3:02\n6098 2 rw 0 0 35"), Some(35));
    assert_eq!(on_the_spot("60E3:01\n60E3:02\n6098 2 rw 0 0 34"), None);
    assert_eq!(read("607C").homing, None);
}

#[test]
fn orders_go_by_pdo_only_where_a_pdo_carries_nothing_else() {
    let by_pdo = |changes: &str| {
        let outputs = read(changes).outputs;
        [outputs.control, outputs.position, outputs.velocity].map(|pdo| pdo.map(|pdo| pdo.base))
    };
    assert_eq!(by_pdo("1403:01 7 rw $NODEID+0x500"), [Some(0x200), Some(0x400), Some(0x500)]);
    assert_eq!(by_pdo("1400:01 7 rw $NODEID+0x40000200"), [Some(0x200), Some(0x400), None], "bit 30 is reserved");
    let none = [None; 3];
    assert_eq!(by_pdo("1400:01 7 rw $NODEID+0x80000200"), none, "switched off");
    assert_eq!(by_pdo("1400:01 7 rw $NODEID+0x210"), none, "elsewhere");
    assert_eq!(by_pdo("1400:01 7 rw 0x201"), none, "of one node");
    assert_eq!(by_pdo("1400:02 5 rw 1"), none, "waits for SYNC");
    assert_eq!(by_pdo("1600:00 5 rw 2\n1600:02 7 rw 0x60710010"), none, "and a torque");
    assert_eq!(by_pdo("1600:01 7 rw 0x607A0020"), none, "a target alone");
}

#[test]
fn how_it_is_recognised_is_as_the_device_will_say() {
    assert_eq!(read("1008 9 ro").identity.name.as_deref(), Some(""), "any name");
    assert_eq!(read("1008").identity.name, None);
    assert_eq!(read("1000 7 ro").identity.profile, 402, "1000h does not say it");
    let overlay = "[overlay]\nformat = 1\nprofile = 402\n";
    let drive = drive::read(&load(&sheet("1000 7 ro 0x191", overlay)).0).0.expect("a drive");
    assert_eq!(drive.identity.profile, 401, "and the device says so too");
}

/// How the data sheet differs, and the findings.
const FOUND: &[(&str, &[&str])] = &[
    (
        "6040\n6060",
        &[
            "drive::no-object: there is no 6040h (control word)",
            "drive::no-object: there is no 6060h (mode of operation)",
        ],
    ),
    ("1000 7 ro 0x191", &["drive::profile: 1000h has device profile 401, not 402"]),
    ("1018:01 7 ro 0", &["drive::vendor: neither 1018h:01 nor `VendorNumber` has a vendor-ID"]),
    ("1018:01", &["drive::vendor: neither 1018h:01 nor `VendorNumber` has a vendor-ID"]),
    ("606C", &["drive::velocity: there is no 606Ch (actual velocity) that a driver can use"]),
    (
        "606C\n6064",
        &[
            "drive::no-object: there is no 606Ch (actual velocity)",
            "drive::left-out: 607A (target position) is there, and no 6064h (actual position)",
        ],
    ),
    ("6041 5 ro", &["drive::object: 6041 (status word) is UNSIGNED8, and UNSIGNED16 by CiA 402"]),
    ("6040 6 ro", &["drive::object: 6040 (control word) is ro, and cannot be written"]),
    (
        "606C 8 ro",
        &[
            "drive::left-out: 606C (actual velocity) is REAL32, and INTEGER32 by CiA 402",
            "drive::velocity: there is no 606Ch (actual velocity) that a driver can use",
        ],
    ),
    ("607D:02 7 rw", &["drive::left-out: 607D:02 (software position limit) is UNSIGNED32, and INTEGER32 by CiA 402"]),
    ("6502 7 ro 0x6D", &["drive::left-out: the drive has interpolated position mode by 6502h, but no 60C1h"]),
    (
        "6502 7 ro 0x20",
        &[
            "drive::no-mode: the drive has neither profile position mode (607Ah, 6064h) nor profile velocity mode (60FFh)",
        ],
    ),
    (
        "6064 8 ro\n60FF\n6502 7 ro 0x1",
        &[
            "drive::left-out: 6064 (actual position) is REAL32, and INTEGER32 by CiA 402",
            "drive::no-mode: the drive has neither profile position mode (607Ah, 6064h) nor profile velocity mode \
             (60FFh); 6064 (actual position) is REAL32, and INTEGER32 by CiA 402",
        ],
    ),
    ("6064", &["drive::left-out: 607A (target position) is there, and no 6064h (actual position)"]),
    ("1A00:01 7 rw 0x60640004", &["drive::pdo: 1A00h maps 16 bits of 6041h from bit 4 on, which has 16"]),
    ("1600:01 7 rw 0x60400008", &["drive::pdo: 1600h maps 8 bits of 6040h from bit 0 on, which has 16"]),
];

#[test]
fn what_is_no_drive_or_not_usable_is_found() {
    for (changes, expected) in FOUND {
        let input = sheet(changes, "");
        let (drive, findings) = drive::read(&load(&input).0);
        let found: Vec<String> = findings.iter().map(|it| format!("{}: {}", it.code, it.message)).collect();
        assert_eq!(found, *expected, "{changes}");
        assert_eq!(drive.is_none(), findings.has_errors());
        for finding in &*findings {
            assert!(finding.span().is_some_and(|span| span.start > 0), "{}: a place", finding.message);
            assert!(finding.help.is_some(), "{}: a remedy", finding.message);
        }
    }
}

#[test]
fn every_code_is_found_in_some_data_sheet() {
    for finding in FINDINGS {
        let found = FOUND.iter().flat_map(|(_, found)| *found).any(|found| found.starts_with(finding.code));
        assert!(found, "{}", finding.code);
    }
}
