//! Prints frames, one line each, in columns and colours.

use std::fmt::Write as _;

use anstyle::{AnsiColor, Style};
use lexican_runtime::{Frame, Instant};

use crate::output::styled;
use lexican_toolbox::bus::transfers::{End, Transfer};
use lexican_toolbox::decode::{Decoded, Service};
use lexican_toolbox::values::hex;

/// A frame without newline: `   0.012345  405  RPDO3 node 5     1F 00 88 13 00 00    Controlword = ...`.
pub(crate) fn line(at: Instant, frame: &Frame, decoded: &Decoded) -> String {
    let data = if frame.is_remote() { format!("RTR {}", frame.dlc()) } else { hex(frame.data()) };
    let mut name = decoded.name.to_string();
    if let Some(node) = decoded.node {
        // Writing to a string cannot fail.
        let _ = write!(name, " node {node}");
    }
    let dim = Style::new().dimmed();
    format!(
        "{}  {}  {}  {}  {}",
        styled(dim, format_args!("{:>12}", at.to_string())),
        styled(Style::new().bold(), format_args!("{:>3}", frame.id().to_string())),
        styled(style(decoded), format_args!("{name:<21}")),
        styled(dim, format_args!("{data:<23}")),
        if decoded.alarming { styled(ALARM, &decoded.text) } else { decoded.text.clone() },
    )
    .trim_end()
    .to_owned()
}

/// A transfer without newline: `   0.012345       SDO node 5         read 6064:00 Position Actual Value = 0 increments
/// (0.4 ms)`.
pub(crate) fn transfer(transfer: &Transfer) -> String {
    let (dim, is_done) = (Style::new().dimmed(), transfer.end == End::Done);
    let style = if is_done { AnsiColor::Cyan.on_default() } else { ALARM };
    let (name, text) = (format!("SDO node {}", transfer.node), transfer.to_string());
    format!(
        "{}       {}  {:<23}  {}",
        styled(dim, format_args!("{:>12}", transfer.began.to_string())),
        styled(style, format_args!("{name:<21}")),
        "",
        if is_done { text } else { styled(ALARM, text) },
    )
}

/// A line about something else than a frame.
pub(crate) fn notice(text: &str) -> String {
    styled(AnsiColor::Yellow.on_default().bold(), text)
}

const ALARM: Style = AnsiColor::Red.on_default().bold();

fn style(decoded: &Decoded) -> Style {
    if decoded.alarming {
        return ALARM;
    }
    match decoded.service {
        Service::Nmt => AnsiColor::Magenta.on_default(),
        Service::Rpdo => AnsiColor::Yellow.on_default(),
        Service::Tpdo => AnsiColor::Green.on_default(),
        Service::Sdo => AnsiColor::Cyan.on_default(),
        Service::Emcy => ALARM,
        Service::Sync | Service::Time | Service::ErrorControl | Service::Lss => AnsiColor::Blue.on_default(),
        Service::Unknown => Style::new(),
    }
}
