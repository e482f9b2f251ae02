//! Which CAN interfaces exist, and whether they are up.

use std::fs;
use std::path::Path;
use std::string::String;
use std::vec::Vec;

/// Whether an interface can be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Presence {
    Absent,
    NotCan,
    Down,
    NoCarrier,
    Up,
}

/// Where Linux lists the interfaces.
const INTERFACES: &str = "/sys/class/net";

impl Presence {
    pub(super) fn of(interface: &str) -> Presence {
        const UP: u32 = 1;
        let folder = Path::new(INTERFACES).join(interface);
        if !folder.exists() {
            // Without this list, only opening the interface shows whether it exists.
            return if Path::new(INTERFACES).exists() { Presence::Absent } else { Presence::Up };
        }
        let read = |file: &str| fs::read_to_string(folder.join(file)).unwrap_or_default();
        let flags = u32::from_str_radix(read("flags").trim().trim_start_matches("0x"), 16).unwrap_or(UP);
        if !is_can(&folder) {
            Presence::NotCan
        } else if flags & UP == 0 {
            Presence::Down
        } else if read("carrier").trim() == "0" {
            Presence::NoCarrier
        } else {
            Presence::Up
        }
    }
}

/// The CAN interfaces of this machine, by name.
pub(super) fn interfaces() -> Vec<String> {
    let Ok(entries) = fs::read_dir(INTERFACES) else { return Vec::new() };
    let found = entries.filter_map(Result::ok).filter(|entry| is_can(&entry.path()));
    let mut names: Vec<String> = found.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.sort();
    names
}

fn is_can(folder: &Path) -> bool {
    // `ARPHRD_CAN` of Linux's `if_arp.h`.
    fs::read_to_string(folder.join("type")).is_ok_and(|kind| kind.trim() == "280")
}
