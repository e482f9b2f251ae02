//! The memory that reading takes, for an ordinary file and for files made to take much. Each is read in a separate
//! process, because only the peak of a whole process can be measured.

use std::process::Command;
use std::{env, fs};

use lexican_eds::{Diagnostics, Input, Source, load};

/// The file that the child reads.
const SHAPE: &str = "LEXICAN_SHAPE";
/// The approximate size of the files, in bytes.
const BYTES: usize = 1_000_000;

#[test]
fn an_ordinary_file_takes_at_most_thirty_times_its_size() {
    check("records", 30.0);
}

#[test]
fn distinct_unknown_keys_take_at_most_thirty_times_the_size_of_the_file() {
    check("unknown_keys", 30.0);
    check("short_unknown_keys", 30.0);
    check("empty_keys", 30.0);
}

#[test]
fn odd_sections_and_lines_take_at_most_thirty_times_the_size_of_the_file() {
    check("unknown_sections", 30.0);
    check("empty_sections", 30.0);
    check("stray_lines", 30.0);
    check("odd_values", 30.0);
    check("lists", 30.0);
}

#[test]
fn poor_objects_take_at_most_thirty_times_the_size_of_the_file() {
    check("unknown_keys_of_sections", 30.0);
    check("empty_objects", 30.0);
    check("empty_subs", 30.0);
    check("limited_subs", 30.0);
    check("linked_objects", 30.0);
}

/// Here, seven bytes make an object and its entry. There are at most 65,536 of them, which take 20 MB.
#[test]
fn all_objects_without_content_take_at_most_forty_five_times_the_size_of_the_file() {
    check("nothing_but_objects", 45.0);
    check("short_objects", 40.0);
}

/// The expansion of one line is limited, however long its texts are.
#[test]
fn compact_objects_take_at_most_sixty_times_the_size_of_the_file() {
    check("long_compact_name", 60.0);
    check("long_compact_value", 60.0);
    check("compact_objects", 60.0);
}

/// In the child: reads one file, and prints in KiB by how much the peak of the process exceeds the memory before.
#[test]
fn read_one_file() {
    let Some(shape) = env::var_os(SHAPE) else { return };
    let input = Input::new(Source::from_bytes("x.eds", shaped(&shape.to_string_lossy()).as_bytes()));
    let before = resident_kib("VmRSS").expect("the parent has looked");
    let (device, diagnostics) = load(&input);
    let peak = resident_kib("VmHWM").expect("it was there before") - before;
    println!("\npeak={peak} bytes={}", input.eds.text().len());
    nothing_is_lost(&diagnostics);
    drop(device);
}

/// Findings that are not kept must be counted.
fn nothing_is_lost(diagnostics: &Diagnostics) {
    for code in diagnostics.iter().map(|finding| finding.code) {
        let kept = diagnostics.iter().filter(|finding| finding.code == code).count();
        let counted =
            diagnostics.iter().any(|finding| finding.message.ends_with(&format!("findings of {code} are not shown")));
        assert!(kept < lexican_eds::MAX_PER_CODE || counted, "{kept} findings of {code}, and no count of the others");
    }
}

#[track_caller]
fn check(shape: &str, times: f64) {
    if resident_kib("VmHWM").is_none() {
        eprintln!("SKIPPED: this system has no /proc/self/status");
        return;
    }
    let this = env::current_exe().expect("a test is a program");
    let mut child = Command::new(this);
    child.args(["--exact", "read_one_file", "--nocapture"]).env(SHAPE, shape);
    let output = child.output().expect("it was started before");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{shape}: {said}{}", String::from_utf8_lossy(&output.stderr));
    let number = |key: &str| {
        let (_, rest) = said.split_once(key).expect("the child prints its figures");
        rest.split_whitespace().next().and_then(|digits| digits.parse::<f64>().ok()).expect("a number")
    };
    let found = number("peak=") * 1024.0 / number("bytes=");
    println!("{shape}: {found:.1} times the size of the file");
    assert!(found < times, "{shape}: {found:.1} times the size of the file");
}

fn shaped(shape: &str) -> String {
    match shape {
        "records" => repeat("", record),
        "unknown_keys" => repeat("[DeviceInfo]\n", |n| format!("UnknownKeyNumber{n}=1\n")),
        "short_unknown_keys" => repeat("[DeviceInfo]\n", |n| format!("k{n}=\n")),
        "unknown_keys_of_sections" => repeat("", |n| format!("[{:X}]\nDataType=7\nk{n}=1\n", 0x1000 + n % 0xF000)),
        "empty_keys" => repeat("[DeviceInfo]\n", |n| format!("VendorNumber{n}=\n")),
        "unknown_sections" => repeat("", |n| format!("[section {n}]\n")),
        "empty_sections" => repeat("", |_| "[]\n".to_owned()),
        "long_compact_name" => {
            format!("{}ObjectType=8\nCompactSubObj=254\n", long("[2000]\nDataType=6\nParameterName="))
        }
        "long_compact_value" => {
            format!("{}ObjectType=8\nCompactSubObj=254\n", long("[2000]\nDataType=9\nParameterName=x\nDefaultValue="))
        }
        "compact_objects" => repeat("", |n| {
            format!("[{:X}]\nParameterName=x\nObjectType=8\nDataType=6\nCompactSubObj=254\n", 0x1000 + n % 0xF000)
        }),
        "empty_objects" => repeat("", |n| format!("[{n:X}]\n")),
        "nothing_but_objects" => (0..=0xFFFF).map(|n| format!("[{n:X}]\n")).collect(),
        "short_objects" => (0..=0xFFFF).map(|n| format!("[{n:X}]\nk=\n")).collect(),
        "limited_subs" => repeat("", |n| format!("[{:X}sub{:X}]\nLowLimit=0\n", n / 254, n % 254)),
        "linked_objects" => (0..=0xFFFF).map(|n| format!("[{n:X}ObjectLinks]\n1=1\n")).collect(),
        "empty_subs" => repeat("", |n| format!("[{:X}sub{:X}]\n", n / 254, n % 254)),
        "stray_lines" => repeat("", |n| format!("x{n}\n")),
        "odd_values" => repeat("", |n| format!("[{n:X}]\nDataType=7\nDefaultValue=x\nLowLimit=08\n")),
        "lists" => repeat("[OptionalObjects]\n", |n| format!("{n}={}\n", n % 65536)),
        other => panic!("there is no shape {other}"),
    }
}

/// As many pieces as it takes for [`BYTES`].
fn repeat(head: &str, piece: impl Fn(usize) -> String) -> String {
    let mut text = head.to_owned();
    let mut lines = 0;
    for number in 0.. {
        let piece = piece(number);
        lines += piece.matches('\n').count();
        if text.len() + piece.len() > BYTES || lines > 900_000 {
            break;
        }
        text += &piece;
    }
    text
}

/// A record of twenty entries, as editors write it.
fn record(number: usize) -> String {
    let index = 0x2000 + number;
    let sub = |sub: u32| {
        format!(
            "[{index:04X}sub{sub:X}]\r\nParameterName=Value {sub}\r\nObjectType=0x7\r\nDataType=0x0006\r\n\
             AccessType=rw\r\nDefaultValue=0\r\nPDOMapping=0\r\n\r\n"
        )
    };
    let subs: String = (0..20).map(sub).collect();
    format!("[{index:04X}]\r\nParameterName=Object\r\nObjectType=0x9\r\nSubNumber=20\r\n\r\n{subs}")
}

fn resident_kib(key: &str) -> Option<usize> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(':'))?;
    line.trim().trim_end_matches(" kB").parse().ok()
}

/// A line of about [`BYTES`].
fn long(before: &str) -> String {
    format!("{before}{}\n", "x".repeat(BYTES))
}
