//! What reading costs in memory. A test program of its own, because it measures the whole process.

use std::fs;

use lexican_eds::{Input, Source, load};

#[test]
fn reading_takes_at_most_thirty_times_the_size_of_the_file() {
    let text: String = (0x2000..0x3000).map(object).collect();
    let input = Input::new(Source::from_bytes("x.eds", text.as_bytes()));
    let Some(before) = resident_kib("VmRSS") else {
        eprintln!("SKIPPED: this system has no /proc/self/status");
        return;
    };
    let (device, _) = load(&input);
    let peak = resident_kib("VmHWM").expect("it was there before") - before;
    assert_eq!(device.entries().count(), 0x1000 * 20);
    let times = peak as f64 * 1024.0 / text.len() as f64;
    println!("{} bytes are read with {times:.1} times as many", text.len());
    assert!(times < 30.0, "{times:.1} times the size of the file");
}

/// A record of twenty entries, as editors write it.
fn object(index: u32) -> String {
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
